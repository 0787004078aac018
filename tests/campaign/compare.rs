//! `compare` on what the adversary made: the block that hides the effect fails, and only that one.

use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rotorbench::compare::{CompareConfig, Comparison, compare};
use rotorbench::log::{Dataset, csv};
use rotorbench::model::Model;
use rotorbench::screening::ScreenedLog;

use crate::catalogue::Kind;
use crate::experiment::{actuator, attitude};
use crate::noise::Noise;
use crate::plant::{Base, Hidden};

fn made(kind: Kind, hidden: &Hidden, seed: u64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let truth = match kind {
        Kind::Actuator => actuator(&Base::PAPER, hidden, &mut rng, false),
        Kind::Attitude => attitude((&Base::PAPER, &Base::PAPER), hidden, &mut rng, false),
    };
    let text = truth.expect("stays on its bench").csv(Noise::USUAL, &mut rng);
    csv::parse(text.as_bytes(), Path::new("made.csv")).expect("a log")
}

fn paper_on(log: &Dataset) -> Comparison {
    compare(&[Model::paper()], &ScreenedLog::of(log), &CompareConfig::default())
        .expect("comparable")
        .remove(0)
}

/// Error over noise floor of every signal of a block.
fn over_floor(comparison: &Comparison, block: &str) -> f64 {
    let found = comparison.blocks.iter().filter(|b| b.name == block);
    found.map(|b| b.error.over_floor()).fold(f64::NAN, f64::max)
}

#[test]
fn a_model_that_lacks_nothing_is_at_the_floor_everywhere() {
    for seed in 1..4 {
        for kind in [Kind::Actuator, Kind::Attitude] {
            let comparison = paper_on(&made(kind, &Hidden::nothing(), seed));
            for block in &comparison.blocks {
                let ratio = block.error.over_floor();
                assert!(block.error.is_noise(), "{} {}: {ratio} of its floor", block.name, block.signal);
                // The floor is an estimate, but no excuse: it does not lie high above the error either.
                assert!(ratio > 0.85, "{} {}: {ratio} of its floor", block.name, block.signal);
            }
            if let Some(torque) = &comparison.unknown_torque {
                // What cannot be known is not claimed: a torque within its own uncertainty.
                assert!(
                    torque.rms < 1.5 * torque.uncertainty,
                    "{} N m of {}",
                    torque.rms,
                    torque.uncertainty
                );
            }
        }
    }
}

#[test]
fn one_block_s_error_does_not_hide_in_the_next() {
    let rotors = Hidden { transport_delay: 0.03, ..Hidden::nothing() };
    let comparison = paper_on(&made(Kind::Attitude, &rotors, 5));
    assert!(over_floor(&comparison, "actuator_1") > 2.0 && over_floor(&comparison, "actuator_2") > 2.0);
    assert!(over_floor(&comparison, "body") < 1.25, "the body is driven by measured rates");
    assert!(over_floor(&comparison, "chain") > 2.0, "the chain shows it");

    let gyro = Hidden { gyro_bias: 0.05, ..Hidden::nothing() };
    let comparison = paper_on(&made(Kind::Attitude, &gyro, 6));
    assert_eq!(comparison.worst().map(|block| block.name.as_str()), Some("sensors"));
    assert!(over_floor(&comparison, "actuator_1") < 1.1);
}

/// With its law in the model a sensor that lags hides nothing from the blocks behind it: their windows start where the body is,
/// and not where the gyroscope is, and the rotors drive it as they turn, and not as they say.
#[test]
fn behind_a_sensor_of_which_the_model_knows_nothing_is_missing() {
    let lagging = [
        ("gyro_lag.pole", 30.0, Hidden { gyro_lag: 30.0, ..Hidden::nothing() }),
        ("gyro_bias.bias", 0.05, Hidden { gyro_bias: 0.05, ..Hidden::nothing() }),
        ("telemetry_lag.pole", 40.0, Hidden { telemetry_lag: 40.0, ..Hidden::nothing() }),
    ];
    for (seed, (name, value, hidden)) in lagging.into_iter().enumerate() {
        let log = made(Kind::Attitude, &hidden, 9 + seed as u64);
        let (id, _) = name.split_once('.').expect("of an effect");
        let mut model = Model::paper().with(&Model::paper().effect(id).expect("known"));
        model.set_parameter(name, value);
        let mut compared = compare(&[model], &ScreenedLog::of(&log), &CompareConfig::default());
        let comparison = compared.as_mut().expect("comparable").remove(0);
        for block in &comparison.blocks {
            let ratio = block.error.over_floor();
            assert!(block.error.is_noise(), "{id}, {} {}: {ratio} of its floor", block.name, block.signal);
        }
        let torque = comparison.unknown_torque.as_ref().expect("a body rate is measured");
        assert!(torque.rms < 1.5 * torque.uncertainty, "{id}: {} of {}", torque.rms, torque.uncertainty);
    }
}

/// A hole in the readings of a sensor that lags costs the rows in it, and none behind it.
#[test]
fn behind_a_hole_of_a_sensor_that_lags_everything_goes_on() {
    let hidden = Hidden { telemetry_lag: 40.0, gyro_lag: 30.0, ..Hidden::nothing() };
    let whole = made(Kind::Attitude, &hidden, 12);
    let mut model = Model::paper();
    for (id, number, pole) in
        [("gyro_lag", "gyro_lag.pole", 30.0), ("telemetry_lag", "telemetry_lag.pole", 40.0)]
    {
        model = model.with(&model.effect(id).expect("known"));
        model.set_parameter(number, pole);
    }
    for holed in ["propeller_rate_1_rad_s", "body_rate_rad_s"] {
        let mut log = Dataset::new("holed.csv", "", whole.time().to_vec()).expect("time rises");
        for name in whole.names() {
            let mut values = whole.column(name).expect("listed").to_vec();
            if name == holed {
                values[1000..1040].fill(f64::NAN);
            }
            log.insert(name, values).expect("fits");
        }
        let comparison =
            compare(std::slice::from_ref(&model), &ScreenedLog::of(&log), &CompareConfig::default())
                .expect("comparable")
                .remove(0);
        let body = comparison.blocks.iter().find(|block| block.name == "body").expect("it is driven");
        // The windows of 0.3 s that the hole cuts into, and their starts.
        assert!(body.samples + 40 + 4 * 30 > log.len() - log.len() / 30, "{holed}: {} samples", body.samples);
        assert!(body.error.is_noise(), "{holed}: {}", body.error.over_floor());
        let torque = comparison.unknown_torque.as_ref().expect("a body rate is measured");
        assert!(torque.rms.is_finite() && torque.mean.is_finite(), "{holed}: {torque:?}");
    }
}

#[test]
fn the_unknown_torque_is_the_hidden_one() {
    let pendulum = Hidden { gravity_pendulum: [0.3, 0.1], ..Hidden::nothing() };
    let log = made(Kind::Attitude, &pendulum, 7);
    let comparison = paper_on(&log);
    let torque = comparison.unknown_torque.as_ref().expect("a body rate is measured");
    assert_eq!(torque.dependences[0].on.to_string(), "body_angle_rad");
    assert!(torque.dependences[0].explained > 0.9, "{}", torque.dependences[0].explained);
    let angle = log.column("body_angle_rad").expect("measured");
    let errors: Vec<f64> =
        torque.rows.iter().zip(&torque.torque).map(|(row, t)| t + 0.3 * (angle[row] + 0.1).sin()).collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    // It says itself how well it knows the torque; half as much again for a wander that is no pendulum.
    assert!(rms < 1.5 * torque.uncertainty, "{rms} N m off, {} N m claimed", torque.uncertainty);
    assert!(rms < 0.15 * torque.rms, "{rms} N m off of {}", torque.rms);
}

#[test]
fn up_and_down_steps_are_told_apart() {
    // Coasts slower than it accelerates: rising, then falling, differ in sign and size.
    let asymmetric = Hidden { asymmetric_pole: 1.4, ..Hidden::nothing() };
    let comparison = paper_on(&made(Kind::Actuator, &asymmetric, 8));
    let failure = &comparison.blocks[0].failure;
    let mean = |name: &str| failure.groups.iter().find(|group| group.name == name).map(|group| group.mean);
    assert!(mean("rising") > Some(5.0) && mean("falling") > Some(5.0), "{:?}", failure.groups);
    assert!(mean("steady") < mean("rising"), "{:?}", failure.groups);
}

#[test]
fn refuses_what_cannot_be_compared() {
    let config = CompareConfig::default();
    let time: Vec<f64> = (0..100).map(f64::from).collect();
    let mut log = Dataset::new("here.csv", "", time).expect("time rises");
    log.insert("battery_voltage_v", vec![12.0; 100]).expect("fits");
    let error = compare(&[Model::paper()], &ScreenedLog::of(&log), &config)
        .expect_err("nothing to compare")
        .to_string();
    assert!(
        error.starts_with("nothing to compare") && error.ends_with("here.csv holds `battery_voltage_v`"),
        "{error}"
    );
    let error =
        compare(&[Model::paper()], &log.slice(0..10).into(), &config).expect_err("too short").to_string();
    assert_eq!(error, "here.csv: 10 samples; at least 50 are needed");
    assert!(
        compare(
            &[Model::paper()],
            &ScreenedLog::of(&log),
            &CompareConfig { horizon_s: f64::NAN, ..CompareConfig::default() }
        )
        .is_err()
    );
    // Constant data: no division by a variance that is not there may reach the output as infinity or panic.
    log.insert("command_1", vec![0.5; 100]).expect("fits");
    log.insert("propeller_rate_1_rad_s", vec![600.0; 100]).expect("fits");
    assert!(compare(&[Model::paper()], &log.into(), &config).is_ok());
}
