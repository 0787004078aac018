//! From rotor logs to the record that the pole is fitted to: which inputs, and with which delay.

use std::ops::Range;

use super::thresholds::THRESHOLDS;
use crate::cancel;
use crate::estimation::variable_projection::Record;
use crate::screening::rotor_data::RotorLog;

/// [s] No delay, but scored as the others are.
pub(crate) const NO_DELAY: f64 = f64::MIN_POSITIVE;

/// The record of all `rotors`, each stretch by itself. `inputs(u, drop)` makes the inputs from the command [-]
/// and the voltage drop v_bmax - v_b [V]. Commands act `delay` [s] after they were sent, exactly: where one changes between two
/// samples, the record gets an unscored row at that instant. What is measured within `unheard_intervals` of the beginning of a
/// stretch answers to commands from before it: with a delay, however short, it is not scored, so that all delays are
/// judged on the same samples, and the free state of the stretch stands for those commands.
pub(crate) fn record_of<const M: usize>(
    rotors: &[RotorLog],
    full_voltage: f64,
    delay: f64,
    inputs: impl Fn(f64, f64) -> [f64; M],
) -> Record<M> {
    let rows: usize = rotors.iter().map(|rotor| rotor.time.len()).sum();
    let mut record = Record {
        time: Vec::with_capacity(rows),
        output: Vec::with_capacity(rows),
        inputs: Vec::with_capacity(rows),
        segments: Vec::new(),
    };
    for rotor in rotors {
        for stretch in &rotor.stretches {
            let start = record.time.len();
            walk(rotor, stretch, full_voltage, delay, |it| {
                record.time.push(it.time);
                record.output.push(it.rate);
                record.inputs.push(inputs(it.command, it.drop));
            });
            record.segments.push(start..record.time.len());
        }
    }
    record
}

/// What acts on a rotor from one instant on.
pub(crate) struct Acting {
    /// The row of the log; `None` between two rows, where a command comes with its delay.
    pub row: Option<usize>,
    /// [s]
    pub time: f64,
    /// [rad/s] what was measured; not-a-number = nothing, or not to be scored.
    pub rate: f64,
    /// [-] the command that the rotor obeys.
    pub command: f64,
    /// [V] v_bmax - v_b.
    pub drop: f64,
}

/// Goes through a stretch of a rotor's rows as [`record_of`] lays them out.
pub(crate) fn walk(
    rotor: &RotorLog,
    stretch: &Range<usize>,
    full_voltage: f64,
    delay: f64,
    mut visit: impl FnMut(Acting),
) {
    let (times, rates, commands) = (&rotor.time[..], &rotor.rate[..], &rotor.command[..]);
    // From when on the commands are in force.
    let since = rotor.command_from.as_deref().unwrap_or(times);
    let behind = delay + rotor.instants_later(0.0);
    let voltage = rotor.voltage.as_deref();
    // A battery does not jump as a command does: over an interval it counts with both ends.
    let drop_at = |row: usize| {
        let next = (row + 1).min(stretch.end - 1);
        let interval = times[next] - times[row];
        let weight = rotor.instrument.map_or(0.5, |it| end_weight(it.pole * interval));
        let held = |voltage: &[f64]| voltage[row] + weight * (voltage[next] - voltage[row]);
        voltage.map_or(0.0, |voltage| full_voltage - held(voltage))
    };
    // `acting` is the row whose command the rotor obeys; before its delay has passed, the first one.
    let mut acting = stretch.start;
    let heard = if delay > 0.0 {
        times[stretch.start] + THRESHOLDS.unheard_intervals * rotor.interval
    } else {
        f64::NEG_INFINITY
    };
    for row in stretch.clone() {
        cancel::check_at(row);
        let time = times[row];
        // A command that was in force before its row is that of the next one at most.
        let last = if rotor.command_from.is_some() { (row + 1).min(stretch.end - 1) } else { row };
        let rate = if time < heard { f64::NAN } else { rates[row] };
        while acting < last && since[acting + 1] + behind <= time {
            acting += 1;
        }
        let drop = drop_at(row);
        visit(Acting { row: Some(row), time, rate, command: commands[acting], drop });
        let next = if row + 1 < stretch.end { times[row + 1] } else { continue };
        while acting < last && since[acting + 1] + behind < next {
            acting += 1;
            if commands[acting] != commands[acting - 1] {
                let time = since[acting] + behind;
                visit(Acting { row: None, time, rate: f64::NAN, command: commands[acting], drop });
            }
        }
    }
}

/// [-] with which the end of an interval counts beside its beginning, of what moves in it as 1 - e^(-p s), for what follows
/// it with the same p: ∫ p e^(-p (T - s)) (1 - e^(-p s)) ds over (1 - e^(-p T))², `through` being p T.
fn end_weight(through: f64) -> f64 {
    let left = (-through).exp();
    let gone = 1.0 - left;
    // Evenly, and 1/12 of p T more, where the difference of the two terms drowns.
    if through.abs() < 1e-3 { 0.5 + through / 12.0 } else { (gone - through * left) / (gone * gone) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// A dead time that nobody can tell from none is a part of the instants; of one that shows, the fit finds how long it is.
    #[test]
    fn a_step_between_rows_acts_when_the_rates_answered() {
        let time: Vec<f64> = (0..40).map(|row| 0.02 * f64::from(row)).collect();
        let command: Vec<f64> = (0..40).map(|row| if row < 20 { 0.4 } else { 0.5 }).collect();
        let rate = command.iter().map(|command| 1_000.0 * command).collect();
        let mut log = Dataset::new("here", "", time).expect("time rises");
        log.insert("command_1", command).expect("fits");
        log.insert("propeller_rate_1_rad_s", rate).expect("fits");
        let mut data = RotorLog::clone(ScreenedLog::from(log).rotor(1).expect("a rotor").data());
        data.command_from = Some(data.time.iter().map(|at| at - 0.008).collect());
        data.delay_unknown = 0.006;
        for (found, delay, acts) in
            [(0.005, 0.0, 0.397), (0.005, 0.003, 0.4), (0.03, 0.0, 0.392), (0.03, 0.03, 0.422)]
        {
            data.delay_found = found;
            let mut first = f64::NAN;
            walk(&data, &(0..40), 12.0, delay, |it| {
                if it.command == 0.5 && first.is_nan() {
                    first = it.time;
                }
            });
            assert!((first - acts).abs() < 1e-9, "{found}, {delay}: {first}");
        }
    }
}
