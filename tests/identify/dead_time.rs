//! Rotors with a dead time, on batteries that give way under the load.

use rotorbench::emulate::EmulatorConfig;
use rotorbench::identify::{Estimate, IdentifySettings, identify};
use rotorbench::screening::screened;

use super::bench::{bench, prbs, run};

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    /// The voltage of such a battery says how fast the rotor turns better than the command does, which comes too early by the
    /// delay: a lag fitted without the delay takes it for the cause, with a k_V of -2700 and a pole of 18000 rad/s. What is
    /// fitted must be the delay, and beside it the bench's own numbers. Of 32 estimates all lie within 3 standard errors with
    /// a chance of 92 %; the seeds are fixed.
    #[test]
    fn a_battery_does_not_stand_in_for_a_delay() {
        // The longer the log, the more of its discharge looks like something else that is missing.
        let benches = [(0.012, 0.03, 60.0), (0.05, 0.03, 60.0), (0.03, 0.02, 600.0), (0.07, 0.017, 300.0)];
        for (resistance, delay, seconds) in benches {
            for seed in 0..2 {
                let mut config = EmulatorConfig { command_delay_s: delay, ..bench(77 + seed) };
                config.battery.internal_resistance = resistance;
                let log = run(&config, prbs(seconds, 7 + seed), "delayed");
                let found =
                    identify(&screened(&[log]), &[], &IdentifySettings::default()).expect("identified");
                let joint = found.joint.expect("exciting commands");
                let case = format!("{resistance} ohm, {delay} s of dead time, {seconds} s, seed {seed}");
                let found = joint.delay.unwrap_or_else(|| panic!("{case}: no delay, {:?}", joint.pole));
                assert!((found.delay.value - delay).abs() < 1e-4, "{case}: {:?}", found.delay);
                assert!((1.4..1.6).contains(&joint.residual_rms), "{case}: {}", joint.residual_rms);
                let gain = joint.voltage_gain.unwrap_or_else(|| panic!("{case}: no k_V"));
                let curve = &joint.coefficients;
                let holds = |name: &str, estimate: Estimate, truth: f64| {
                    println!("{case}: {name} {:.2} standard errors", estimate.distance(truth));
                    assert!(estimate.distance(truth) < 3.0, "{case}: {name} {estimate:?}");
                };
                holds("p", joint.pole, 16.0);
                holds("k_V", gain, 40.0);
                holds("c_g2", curve[0], 1124.5);
                holds("c_g1", curve[1], 447.1);
            }
        }
    }
}
