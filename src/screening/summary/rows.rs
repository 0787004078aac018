//! Which rows of a log are held against a model: counted, for people and scripts.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::screening::screened_log::ScreenedLog;
use crate::screening::screened_rotor::ScreenedRotor;
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// Which rows of one rotor are held against a model.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RotorSummary {
    /// Its number in the columns' names, from 1.
    pub rotor: usize,
    /// Rows whose reading is scored.
    pub scored: usize,
    /// Rows whose reading is not, by the code of the reason; empty cells have none.
    pub not_scored: BTreeMap<&'static str, usize>,
}

/// Which rows of the body are held against a model.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BodySummary {
    /// `measured_rotor_rates`, `torque_command` or `predicted_rotor_rates`: what drives it.
    pub driven_by: &'static str,
    /// Rows whose body rate is scored.
    pub scored: usize,
    /// Rows whose body rate is not, by the code of the reason; empty cells have none.
    pub not_scored: BTreeMap<&'static str, usize>,
    /// Rows whose body angle is scored.
    pub scored_angles: usize,
}

impl RotorSummary {
    pub(super) fn of(rotor: &ScreenedRotor, rows: usize) -> Self {
        let not_scored = counted((0..rows).filter_map(|row| rotor.reason(row)));
        Self { rotor: rotor.number(), scored: rotor.scored().count(), not_scored }
    }

    pub(super) fn of_thrusts(log: &ScreenedLog) -> Vec<Self> {
        let each = log.thrusts().iter().map(|thrust| Self {
            rotor: thrust.number(),
            scored: thrust.scored(log.dataset()).iter().filter(|it| it.is_finite()).count(),
            not_scored: counted((0..log.raw().len()).filter_map(|row| thrust.reason(row))),
        });
        each.collect()
    }
}

impl BodySummary {
    pub(super) fn of(log: &ScreenedLog) -> Option<Self> {
        let body = log.body()?;
        let scored = |name: &str| {
            let values = log.dataset().cells(name).unwrap_or_default().for_once();
            let values = values.iter().enumerate();
            values.filter(|(row, value)| value.is_finite() && body.reason(*row).is_none()).count()
        };
        Some(Self {
            driven_by: body.driven_by().code(),
            scored: scored(BODY_RATE),
            not_scored: counted(log.body_reasons(BODY_RATE).into_iter().flatten()),
            scored_angles: scored(BODY_ANGLE),
        })
    }
}

fn counted(reasons: impl Iterator<Item = &'static str>) -> BTreeMap<&'static str, usize> {
    let mut counted = BTreeMap::new();
    reasons.for_each(|reason| *counted.entry(reason).or_insert(0) += 1);
    counted
}
