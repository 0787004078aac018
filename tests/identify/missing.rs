//! Rows and commands that are missing.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rotorbench::emulate::EmulatorConfig;
use rotorbench::identify::{IdentifySettings, identify};
use rotorbench::log::Dataset;
use rotorbench::screening::screened;

use super::bench::{bench, prbs, run};

/// `log` without the rows that `lost` names, or with their command cells empty.
fn with_missing(log: &Dataset, mut lost: impl FnMut(usize) -> bool, cells: bool) -> Dataset {
    let lost: Vec<bool> = (0..log.len()).map(&mut lost).collect();
    let kept = |values: &[f64]| -> Vec<f64> {
        let rows = values.iter().zip(&lost).filter(|(_, lost)| cells || !**lost);
        rows.map(|(value, _)| *value).collect()
    };
    let mut left = Dataset::new(log.source_name(), "", kept(log.time())).expect("rising time");
    for name in log.names() {
        let mut column = kept(log.column(name).unwrap_or(&vec![f64::NAN; log.len()]));
        if cells && name.starts_with("command") {
            column.iter_mut().zip(&lost).filter(|(_, lost)| **lost).for_each(|(cell, _)| *cell = f64::NAN);
        }
        left.insert(name, column).expect("as long as time");
    }
    left
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    /// One in ten rows lost at random, or one in ten commands: what the rotor was commanded meanwhile is not known, and a log read
    /// as if the last command had been sent again makes the pole 15 to 25 % too fast, tens of standard errors away.
    #[test]
    fn what_is_missing_between_commands_does_not_move_the_pole() {
        const DRAWS: u64 = 16;
        for cells in [false, true] {
            let mut away: Vec<f64> = Vec::new();
            for draw in 0..DRAWS {
                let mut random = ChaCha8Rng::seed_from_u64(40 + draw);
                let mut config = bench(200 + draw);
                config.plant.pole = random.random_range(8.0..24.0);
                let whole = run(&config, prbs(60.0, draw), "prbs");
                let log = with_missing(&whole, |_| random.random_bool(0.1), cells);
                let settings = IdentifySettings { degree: Some(2), ..IdentifySettings::default() };
                let found = identify(&screened(&[log]), &[], &settings).expect("identified");
                let joint = found.joint.expect("exciting commands");
                let (pole, truth) = (joint.pole, config.plant.pole);
                println!("{pole:?} of {truth}, residual {}", joint.residual_rms);
                away.push((pole.value - truth) / pole.standard_error);
                // The sensor's noise is all that is left: 1.5 rad/s.
                assert!((1.3..1.7).contains(&joint.residual_rms), "{}", joint.residual_rms);
                assert!(pole.standard_error < 0.01 * truth, "{pole:?}: a minute says more than that");
                let missing = found.findings.iter().find(|it| it.code == "commands_missing").expect("found");
                assert!((missing.number("interval_s") - 0.02).abs() < 1e-9, "{missing:?}");
                assert!(!found.findings.iter().any(|it| it.code == "rotor_residual_correlated"));
            }
            // Of sixteen honest intervals more than three without the truth come in 0.7 % of the cases, a mean of 3/4 of a
            // standard error in 0.3 %.
            let outside = away.iter().filter(|z| z.abs() > 1.96).count();
            let mean = away.iter().sum::<f64>() / away.len() as f64;
            assert!(
                outside <= 3 && mean.abs() < 0.75,
                "cells {cells}: {outside} outside, mean {mean}: {away:?}"
            );
        }
    }
}

/// A delay is found with its pole where rows are missing, too, and none where there is none.
#[test]
fn what_is_missing_between_commands_does_not_look_like_a_delay() {
    for delay in [0.0, 0.013, 0.03] {
        let mut random = ChaCha8Rng::seed_from_u64(9);
        let config = EmulatorConfig { command_delay_s: delay, ..bench(77) };
        let log = with_missing(&run(&config, prbs(120.0, 7), "delayed"), |_| random.random_bool(0.1), false);
        let settings = IdentifySettings { degree: Some(2), ..IdentifySettings::default() };
        let found = identify(&screened(&[log]), &[], &settings).expect("identified");
        let joint = found.joint.expect("exciting commands");
        let found = joint.delay.as_ref().map_or(0.0, |it| it.delay.value);
        println!("{delay}: {found} {:?} {:?}", joint.pole, joint.delay);
        assert!((found - delay).abs() < 4e-4, "{delay}: {:?}", joint.delay);
        assert!(joint.pole.distance(16.0) < 3.0, "{delay}: {:?}", joint.pole);
    }
}
