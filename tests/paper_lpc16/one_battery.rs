//! Two rotors that draw on one battery, each with commands of its own.

use rotorbench::identify::{Identification, IdentifySettings, identify};
use rotorbench::log::Dataset;
use rotorbench::screening::screened;

use super::logs::{C_G1, C_G2, PERIOD, POLE, codes, exciting, of_columns, z};

const ROWS: usize = 3000;

/// Noise of this strength that nobody can foretell: a hash of the row, uniform, whose rms is half its width over the root of
/// three.
fn noise(row: usize, channel: usize, rms: f64) -> f64 {
    let hash = (row + 7919 * channel).wrapping_mul(2_654_435_761) ^ (row * channel).wrapping_mul(40_503);
    rms * 3f64.sqrt() * (f64::from((hash >> 13 & 1023) as u16) / 511.5 - 1.0)
}

/// [V] what both draw from it, a quarter of a volt where they hover.
fn voltage(t: f64, rates: [f64; 2]) -> f64 {
    12.5 - 0.003 * t - rates.iter().map(|rate| 0.125 * (rate / 617.0).powi(3)).sum::<f64>()
}

/// The log of both, in 20 midpoint steps for each row; the voltage read in steps of `step` [V].
fn log(step: f64) -> Dataset {
    let commands = |t: f64| [exciting(t), exciting(t + 1000.0)];
    let z = |u: [f64; 2], v: f64| [0, 1].map(|at| z(u[at], v));
    let mut rates = z(commands(0.0), 11.9);
    let mut columns: [Vec<f64>; 5] = Default::default();
    for row in 0..ROWS {
        let t = row as f64 * PERIOD;
        let (u, volts) = (commands(t), voltage(t, rates) + noise(row, 3, 0.02));
        let read = if step > 0.0 { (volts / step).round() * step } else { volts };
        let measured = [0, 1].map(|at| rates[at] + noise(row, at + 1, 1.5));
        let row = [u[0], u[1], measured[0], measured[1], read];
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        let h = PERIOD / 20.0;
        for part in 0..20 {
            let now = t + (f64::from(part) + 0.5) * h;
            let slope = |rates: [f64; 2]| {
                let steady = z(u, voltage(now, rates));
                [0, 1].map(|at| POLE * (steady[at] - rates[at]))
            };
            let first = slope(rates);
            let middle = slope([0, 1].map(|at| rates[at] + 0.5 * h * first[at]));
            rates = [0, 1].map(|at| rates[at] + h * middle[at]);
        }
    }
    let names =
        ["command_1", "command_2", "propeller_rate_1_rad_s", "propeller_rate_2_rad_s", "battery_voltage_v"];
    of_columns("both.csv", names, columns)
}

fn found(log: &Dataset, rotors: &[usize]) -> Identification {
    let settings =
        IdentifySettings { degree: Some(2), rotors: rotors.to_vec(), ..IdentifySettings::default() };
    identify(&screened(std::slice::from_ref(log)), &[], &settings).expect("identified")
}

/// What the other rotor draws is no physics that is missing: left out, it stayed in the residual (4 rad/s where the noise is
/// 1.5), was reported as that, and made all errors ten times larger.
#[test]
fn what_the_other_rotor_draws_from_the_battery_is_known() {
    for step in [0.0, 0.1] {
        let log = log(step);
        for rotors in [[1, 2].as_slice(), &[1], &[2]] {
            let found = found(&log, rotors);
            assert_eq!(codes(&found), [""; 0], "{step} V, rotors {rotors:?}");
            let fit = found.joint.expect("exciting commands");
            let [linear, quadratic] = [0, 1].map(|at| fit.coefficients[at]);
            let gain = fit.voltage_gain.expect("it shows");
            println!(
                "{step} V, rotors {rotors:?}: {:.2} rad/s, {linear:?}, {gain:?}, {:?}",
                fit.residual_rms, fit.pole
            );
            assert!(fit.residual_rms < 1.75, "{}", fit.residual_rms);
            assert!(fit.pole.standard_error < 0.03 && gain.standard_error < 1.0, "{:?} {gain:?}", fit.pole);
            for (estimate, truth) in [(linear, C_G2), (quadratic, C_G1), (gain, 40.0), (fit.pole, POLE)] {
                assert!(estimate.distance(truth) < 3.0, "{estimate:?} of {truth}");
            }
        }
    }
}
