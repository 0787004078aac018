//! Answers and fits for tests that need one, without a search.

use std::collections::BTreeMap;

use super::block_data::{BlockData, Runs};
use super::body_block::{BodyRun, BodySource};
use super::candidate_fit::CandidateFit;
use super::data_split::DataSplit;
use super::diagnosis::{ChangedParameter, Diagnosis, ErrorSummary, TrainValidate, Verdict};
use super::grid_constraint::{BoundedNumber, WithoutSlope};
use super::rotor_block::rotor_runs;
use crate::estimation::output_error::Fit;
use crate::log::Dataset;
use crate::model::{Measure, Model};

/// Samples of [`split`].
pub(crate) const ROWS: usize = 4800;

/// A rotor, read a hundred times a second, that answers each command at once.
pub(crate) fn at_once(command: impl Iterator<Item = f64>) -> BlockData {
    let command: Vec<f64> = command.collect();
    let time = (0..command.len()).map(|row| 0.01 * row as f64).collect();
    let rates = command.iter().map(|command| 1200.0 * command).collect();
    let log = Dataset::made(time, [("command_1", command), ("propeller_rate_1_rad_s", rates)]);
    BlockData::new(Runs::Rotor(rotor_runs(&[log.into()])))
}

/// A rotor that steps between three levels, 0.4, 0.6 and 0.8, the same on both parts.
pub(crate) fn split() -> DataSplit {
    let data = at_once((0..ROWS).map(|row| 0.4 + 0.2 * (row / 40 % 3) as f64));
    DataSplit::new(data.clone(), Some(data))
}

/// A set that leaves these residuals on both parts.
pub(crate) fn leaves(residuals: Vec<f64>) -> CandidateFit {
    let cost = residuals.iter().map(|value| value * value).sum();
    let fit = Fit {
        globals: Vec::new(),
        locals: Vec::new(),
        standard_errors: Vec::new(),
        cost,
        residuals: residuals.into(),
        iterations: 0,
    };
    let (effects, names, model) = (Vec::new(), Vec::new(), Model::paper());
    CandidateFit { effects, model, names, held_out: fit.clone(), fit }
}

/// Noise of ±1 without a pattern: a bit of a hash (splitmix64).
pub(crate) fn noise(row: usize) -> f64 {
    let mut bits = (row as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    if (bits >> 40) & 1 == 0 { 1.0 } else { -1.0 }
}

impl ErrorSummary {
    /// Errors of a rotor, the same on both parts, over a noise of 0.83 rad/s: as it is, refitted, extended.
    pub(crate) fn of_rotor([base, refitted, extended]: [f64; 3]) -> Self {
        let both = |error| TrainValidate { train: error, validate: error };
        Self {
            measure: Measure::of_free_runs("propeller_rate_rad_s", None, "rad/s"),
            channel: String::new(),
            unit: "rad/s",
            noise_floor: 0.83,
            base: both(base),
            refitted: both(refitted),
            extended: both(extended),
        }
    }
}

impl Diagnosis {
    /// An answer that names `effects`, and says nothing else.
    pub(crate) fn of(verdict: Verdict, effects: &[&str]) -> Self {
        Self {
            verdict,
            effects: effects.iter().map(|id| (*id).to_owned()).collect(),
            alternatives: Vec::new(),
            further_alternatives: Vec::new(),
            common_effects: effects.iter().map(|id| (*id).to_owned()).collect(),
            changed_parameters: Vec::new(),
            parameters: BTreeMap::new(),
            error: ErrorSummary::of_rotor([17.7, 39.3, 9.626]),
            r#where: Vec::new(),
            ladder: Vec::new(),
            candidates: Vec::new(),
            findings: Vec::new(),
            next_experiment: None,
            alternative_errors: Vec::new(),
            turns_against_torque: false,
            is_torque_driven: false,
            model: Model::paper(),
        }
    }

    /// The same, with another number in the model.
    pub(crate) fn with_changed(self, name: &str, from: f64, to: f64) -> Self {
        let (unit, symbol) = Model::base_parameter_unit(name);
        let changed = ChangedParameter {
            name: name.to_owned(),
            symbol: symbol.to_owned(),
            from,
            to,
            standard_error: None,
            unit: unit.to_owned(),
        };
        Self { changed_parameters: vec![changed], ..self }
    }
}

/// A weight that pulls the body back a hundred times as hard as the torque on it pushes, which is in no model; a torque of this sign,
/// and the angle where it is logged.
pub(crate) fn weighed_down(sign: f64, has_angle: bool) -> DataSplit {
    const ROWS: usize = 4000;
    let torque: Vec<f64> = (0..ROWS).map(|row| 0.02 * f64::from((row * 37 / 50 % 5) as u32) - 0.04).collect();
    let (mut angle, mut rate) = (vec![0.5_f64], vec![0.0_f64]);
    for row in 1..ROWS {
        // A hundred small steps a row: J = 0.03, a weight of 3 N m, some friction.
        let (mut now, mut turning) = (angle[row - 1], rate[row - 1]);
        for _ in 0..100 {
            turning += 1e-4 * (torque[row - 1] - 3.0 * now.sin() - 0.01 * turning) / 0.03;
            now += 1e-4 * turning;
        }
        angle.push(now);
        rate.push(turning);
    }
    let zeros = vec![0.0; ROWS];
    let source = BodySource {
        time: (0..ROWS).map(|row| 0.01 * row as f64).collect::<Vec<f64>>().into(),
        torque: torque.into_iter().map(|torque| sign * torque).collect(),
        torque_slope: zeros.clone().into(),
        propagated: zeros.into(),
        rate: rate.into(),
        angle: if has_angle { angle.into() } else { Default::default() },
        ..BodySource::default()
    };
    let data = BlockData::new(Runs::Body(vec![BodyRun::new(0, 0..ROWS, source, 0.4)]));
    DataSplit::new(data.clone(), Some(data))
}

/// The step of a grid as the first number of a problem, the width of a dead zone ahead of it as the second.
pub fn behind_a_dead_zone() -> WithoutSlope {
    WithoutSlope {
        grid: BoundedNumber { index: 0, bounds: (0.0, 0.3) },
        ahead: vec![BoundedNumber { index: 1, bounds: (0.0, 0.5) }],
        laws_ahead: vec!["command_dead_zone".to_owned()],
    }
}
