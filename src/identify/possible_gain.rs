//! A k_V that no motor has: more rate for one volt than its share of all of them, or plainly less than none. A motor without any drag
//! turns in proportion to its voltage; what drags at it takes from that. Where more comes out, something else went with the voltage (a
//! motor that warms up, a supply that wanders), and curve and pole would be bent to it: it is not taken.

use super::Estimate;
use super::significance;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::quantile;
use crate::screening::Finding;
use crate::screening::rotor_data::RotorLog;

/// Whether a k_V is more than a motor has, `most` being its share of a volt [rad/(s V) both].
pub(crate) fn is_too_great(gain: f64, most: f64) -> bool {
    gain > THRESHOLDS.voltage_gain_of_motor * most
}

/// A k_V that is not taken; `left_out`: the model goes without the battery's part for it.
pub(crate) fn refused(gain: f64, most: f64, left_out: bool) -> Finding {
    let found = Finding::new("voltage_gain_impossible", "voltage_gain").with("value", gain);
    found.with("most_rad_s_v", most).with("left_out", usize::from(left_out))
}

/// Whether a k_V that shows is none that a motor has.
pub(crate) fn is_impossible(gain: &Estimate, most: f64) -> bool {
    significance::is_significant(gain) && (gain.value < 0.0 || is_too_great(gain.value, most))
}

/// Why nothing is taken of constant commands whose k_V no motor has.
pub(crate) fn no_step(gain: &Estimate, most: f64) -> Finding {
    let code = if gain.value < 0.0 { "voltage_gain_negative" } else { "voltage_gain_of_no_motor" };
    significance::with_estimate(Finding::new(code, "voltage_gain"), gain).with("most_rad_s_v", most)
}

/// [rad/s] what a rotor does at full command, by what it does at high ones: the rate rises in proportion, or more; each over what
/// `of` says of its row.
pub(crate) fn at_full_command(rotors: &[RotorLog], of: impl Fn(&RotorLog, usize) -> f64) -> Option<f64> {
    let highest = rotors.iter().flat_map(|rotor| &rotor.command).copied().fold(0.0, f64::max);
    let high = THRESHOLDS.high_command * highest;
    let shares = |rotor: &RotorLog| -> Vec<f64> {
        let counts = |row: &usize| rotor.rate[*row].is_finite() && rotor.command[*row] > high;
        let share = |row: usize| rotor.rate[row] / (rotor.command[row] * of(rotor, row));
        (0..rotor.time.len()).filter(counts).map(share).collect()
    };
    let shares = rotors.iter().flat_map(shares).filter(|share| share.is_finite());
    quantile(shares, THRESHOLDS.high_rates)
}

/// [rad/(s V)] all of the rate over all of the volts that a battery had meanwhile; `None` without either.
pub(crate) fn most(rotors: &[RotorLog]) -> Option<f64> {
    let volts = |rotor: &RotorLog, row: usize| rotor.voltage.as_ref().map_or(f64::NAN, |volts| volts[row]);
    at_full_command(rotors, volts)
}

#[cfg(test)]
mod tests {
    use crate::identify::{IdentifySettings, identify};
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// Levels of half a minute, at 50 Hz, on a supply that gives way by a hundredth of a volt, while the rates drift by `drift` [rad/s] in
    /// each of them: k_V comes out as many hundreds, up or down.
    fn levels(drift: f64) -> ScreenedLog {
        let rows = 9_000_usize;
        let within = |row: usize| (row % 1_500) as f64 / 1_500.0;
        let noise = |row: usize, factor: usize| (row.wrapping_mul(factor) >> 16 & 255) as f64 / 127.5 - 1.0;
        let command = |row: usize| 0.3 + 0.1 * (row / 1_500) as f64;
        let of = |value: &dyn Fn(usize) -> f64| (0..rows).map(value).collect::<Vec<f64>>();
        let rate = |row: usize| 1_000.0 * command(row) - drift * within(row) + noise(row, 2_654_435_761);
        let volts = |row: usize| 12.0 - 0.01 * within(row) + 1e-4 * noise(row, 2_246_822_519);
        let time = of(&|row| 0.02 * row as f64);
        let columns = [("command_1", of(&command)), ("propeller_rate_1_rad_s", of(&rate))];
        let mut log = Dataset::made(time, columns);
        log.insert("battery_voltage_v", of(&volts)).expect("as long as time");
        log.into()
    }

    #[test]
    fn a_k_v_of_constant_commands_that_no_motor_has_is_not_taken() {
        let found = identify(&[levels(10.0)], &[], &IdentifySettings::default()).expect("levels");
        let refused = found.findings.iter().find(|it| it.code == "voltage_gain_impossible").expect("said");
        assert!((refused.number("value") - 1_000.0).abs() < 100.0, "{refused:?}");
        assert!((refused.number("most_rad_s_v") - 1_000.0 / 12.0).abs() < 5.0, "{refused:?}");
        assert_eq!(refused.count("left_out"), 1, "no other k_V is known");
        assert_eq!(found.parts[0].finding.code, "voltage_gain_of_no_motor", "{:?}", found.parts);
        assert!(found.battery.is_none() && found.actuator.voltage_gain == 0.0, "{:?}", found.actuator);
        let at_full = found.actuator.steady_rate(1.0, None);
        assert!((at_full - 1_000.0).abs() < 20.0, "as with --no-battery: {at_full}");
        // A battery that gives way makes no rotor faster, and holding on for longer would not change that.
        let rising = identify(&[levels(-10.0)], &[], &IdentifySettings::default()).expect("levels");
        let why = &rising.parts[0].finding;
        assert_eq!(why.code, "voltage_gain_negative", "{why:?}");
        assert!((why.number("value") + 1_000.0).abs() < 100.0, "{why:?}");
        assert_eq!(rising.actuator.voltage_gain, 0.0, "{:?}", rising.findings);
        // Of a hundredth of a volt a motor may make 80 rad/s for one.
        let possible = identify(&[levels(0.8)], &[], &IdentifySettings::default()).expect("levels");
        assert!((possible.actuator.voltage_gain - 80.0).abs() < 30.0, "{:?}", possible.actuator);
    }
}
