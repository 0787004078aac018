//! How long the rates take for the steps of the command, read off the steps themselves: a pole that is fitted must not say otherwise. A
//! curve that is not of the rotor's form leaves an error at every level, which a slow pole makes smaller.

use std::ops::Range;

use super::Estimate;
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::{deviation, mean};
use crate::estimation::quantile::median;
use crate::screening::Finding;
use crate::screening::rotor_data::RotorLog;

/// Why a pole is none: the steps are over long before it would have them.
pub(crate) fn contradicts(rotors: &[RotorLog], pole: &Estimate) -> Option<Finding> {
    let steps: Vec<StepTime> = rotors.iter().flat_map(step_times).collect();
    let times: Vec<f64> = steps.iter().map(|step| step.time).collect();
    if times.len() < THRESHOLDS.fewest_step_times {
        return None;
    }
    let typical = median(times.iter().copied())?;
    (pole.value * typical < THRESHOLDS.least_pole_time).then(|| {
        let found = Finding::new("pole_contradicts_steps", "pole").with("pole_rad_s", pole.value);
        let found = found.with("steps", times.len()).with("risen_after_s", typical);
        match ways_apart(&steps) {
            Some([up, down]) => found.with("up_after_s", up).with("down_after_s", down),
            None => found,
        }
    })
}

/// How long one step takes.
struct StepTime {
    /// [s] from the step on until the rate has gone most of its way.
    time: f64,
    is_up: bool,
}

/// [s] how long steps up and steps down take, where that plainly differs.
fn ways_apart(steps: &[StepTime]) -> Option<[f64; 2]> {
    let typical = |is_up: bool| {
        let own = steps.iter().filter(|step| step.is_up == is_up);
        if own.clone().count() < THRESHOLDS.fewest_step_times { None } else { median(own.map(|it| it.time)) }
    };
    let (up, down) = (typical(true)?, typical(false)?);
    (up.max(down) > THRESHOLDS.ways_apart * up.min(down)).then_some([up, down])
}

/// The steps of a rotor and how long each takes, where the command is held before and behind it for so long that the
/// rate plainly comes to rest.
fn step_times(rotor: &RotorLog) -> Vec<StepTime> {
    let held = |from: usize, rows: &mut dyn Iterator<Item = usize>| {
        rows.take_while(|row| (rotor.command[*row] - rotor.command[from]).abs() < 1e-6).count()
    };
    let within = |row: usize| rotor.stretches.iter().find(|rows| rows.contains(&row));
    let time = |jump: usize| {
        let stretch = within(jump)?;
        let before = held(jump, &mut (stretch.start..=jump).rev());
        let behind = held(jump + 1, &mut (jump + 1..stretch.end));
        step_time(rotor, jump + 1 - before..jump + 1, jump + 1..jump + 1 + behind)
    };
    rotor.jumps().into_iter().filter_map(time).collect()
}

fn step_time(rotor: &RotorLog, before: Range<usize>, behind: Range<usize>) -> Option<StepTime> {
    let rates = |rows: Range<usize>| -> Vec<f64> {
        rows.map(|row| rotor.rate[row]).filter(|rate| rate.is_finite()).collect()
    };
    let middle = behind.start + behind.len() / 2;
    let three_quarters = behind.start + (THRESHOLDS.level_end_share * behind.len() as f64) as usize;
    let (old, half, end) = (
        rates(before.start + before.len() / 2..before.end),
        rates(middle..three_quarters),
        rates(three_quarters..behind.end),
    );
    if [&old, &half, &end].iter().any(|rates| rates.len() < THRESHOLDS.fewest_level_rates) {
        return None;
    }
    let (from, to) = (mean(&old), mean(&end));
    let step = to - from;
    let scatter = deviation(old.into_iter()).max(deviation(end.into_iter()));
    let is_plain = step.abs() > THRESHOLDS.plain_step * scatter;
    let has_settled = (to - mean(&half)).abs() < THRESHOLDS.settled_share * step.abs();
    if !is_plain || !has_settled {
        return None;
    }
    let begin = *rotor.time.get(behind.start)?;
    let risen = behind.clone().find(|row| (rotor.rate[*row] - from) / step >= THRESHOLDS.risen_share)?;
    Some(StepTime { time: rotor.time[risen] - begin, is_up: step > 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// Steps of 3 s that a rotor follows with this pole [rad/s].
    fn rotor(pole: f64) -> RotorLog {
        rotor_of([pole, pole])
    }

    /// The same with a pole for the way up and one for the way down.
    fn rotor_of([up, down]: [f64; 2]) -> RotorLog {
        let command = |row: usize| 0.2 + 0.1 * ((row / 300 * 7) % 5) as f64;
        let mut rate = 200.0;
        let rates = (0..6_000).map(|row| {
            let way = 1_000.0 * command(row) - rate;
            rate += way * (1.0 - (-0.01 * if way > 0.0 { up } else { down }).exp());
            rate + ((row * 37 % 11) as f64 - 5.0) * 0.2
        });
        let time = (0..6_000).map(|row| 0.01 * row as f64).collect();
        let mut log = Dataset::new("steps", "", time).unwrap();
        log.insert("propeller_rate_1_rad_s", rates.collect()).unwrap();
        log.insert("command_1", (0..6_000).map(command).collect()).unwrap();
        RotorLog::clone(ScreenedLog::from(log).rotor(1).expect("a rotor").data())
    }

    #[test]
    fn a_pole_much_slower_than_the_steps_is_contradicted_by_them() {
        let estimate = |value| Estimate { value, standard_error: 0.01 };
        let rotors = [rotor(5.0)];
        let times: Vec<f64> = step_times(&rotors[0]).iter().map(|step| step.time).collect();
        assert!(times.len() >= 8 && times.iter().all(|time| (time - 0.2).abs() < 0.03), "{times:?}");
        let why = contradicts(&rotors, &estimate(0.09)).expect("a tenth of a rad/s");
        assert!((why.number("risen_after_s") - 0.2).abs() < 0.02, "{why:?}");
        for pole in [3.0, 5.0, 50.0] {
            assert!(contradicts(&rotors, &estimate(pole)).is_none(), "{pole}");
        }
        assert!(!why.number("up_after_s").is_finite(), "both ways are as quick: {why:?}");
        let apart = contradicts(&[rotor_of([8.0, 3.0])], &estimate(0.09)).expect("a tenth of a rad/s");
        assert!((apart.number("up_after_s") - 0.125).abs() < 0.02, "{apart:?}");
        assert!((apart.number("down_after_s") - 0.333).abs() < 0.03, "{apart:?}");
        // A rotor that is as slow does not come to rest within its levels: nothing is known to be over.
        assert!(contradicts(&[rotor(0.3)], &estimate(0.09)).is_none());
    }
}
