//! What a law may look at: the channels that are known at each site, and where the logs have been.

use super::thresholds::THRESHOLDS;
use crate::diagnose::block_data::{BlockData, Runs};
use crate::diagnose::body_block::BodyRun;
use crate::diagnose::rotor_block::RotorRun;
use crate::effect::Site;
use crate::effect::signals;
use crate::estimation::quantile::{extremes, quantile};
use crate::signal::{Sensor, columns};

/// A channel as a law at a site sees it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LawInput {
    /// Its name in expressions.
    pub signal: &'static str,
    /// Its name in logs.
    pub log: &'static str,
    /// Its SI unit.
    pub unit: &'static str,
    /// In `unit`: where the logs have been, but for a few rows.
    pub low: f64,
    pub high: f64,
    /// Whether a law may be odd about none of it: angles, rates and torques have two sides.
    pub is_signed: bool,
}

impl LawInput {
    /// How far the logs went.
    pub fn range(&self) -> f64 {
        self.high - self.low
    }

    /// The largest size it has.
    pub fn size(&self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    pub fn is_time(&self) -> bool {
        self.signal == "time"
    }
}

/// A site and the channels that a law there may look at.
pub(crate) struct Outlook {
    pub site: Site,
    pub channels: Vec<LawInput>,
}

/// What laws of a block may look at, site by site. Of sites at which a law of a channel does the same to the block, the one that
/// people write it at: a law of the command moves the steady rate, one of the rate the acceleration.
pub(crate) fn outlooks(data: &BlockData) -> Vec<Outlook> {
    match &data.runs {
        Runs::Rotor(runs) => of_rotor(runs),
        Runs::Body(runs) => of_body(runs),
    }
}

fn of_rotor(runs: &[RotorRun]) -> Vec<Outlook> {
    let of = |values: fn(&RotorRun) -> &[f64]| runs.iter().flat_map(move |run| values(run).iter().copied());
    let command = channel((signals::COMMAND, "command", "-"), of(|run| &run.command), false);
    let rate = channel(
        (signals::PROPELLER_RATE, Sensor::PropellerRate.name_with_unit(), "rad/s"),
        of(|run| &run.measured),
        false,
    );
    let battery = runs.iter().flat_map(|run| run.voltage.iter().flatten().copied());
    let battery = channel((signals::BATTERY_VOLTAGE, columns::BATTERY_VOLTAGE, "V"), battery, false);
    let time = channel((signals::TIME, columns::TIME, "s"), of(|run| &run.time), false);
    let some = |channels: [&Option<LawInput>; 3]| channels.into_iter().flatten().cloned().collect();
    vec![
        Outlook { site: Site::SteadyRate, channels: some([&command, &battery, &time]) },
        Outlook { site: Site::RotorAcceleration, channels: some([&rate, &None, &None]) },
        Outlook { site: Site::RotorRateSensor, channels: some([&rate, &None, &None]) },
    ]
}

fn of_body(runs: &[BodyRun]) -> Vec<Outlook> {
    let of = |values: fn(&BodyRun) -> &[f64]| runs.iter().flat_map(move |run| values(run).iter().copied());
    let angle = channel((signals::BODY_ANGLE, columns::BODY_ANGLE, "rad"), of(|run| &run.angle), true);
    let rate = channel((signals::BODY_RATE, columns::BODY_RATE, "rad/s"), of(|run| &run.rate), true);
    let torque = channel((signals::TORQUE, "torque_nm", "N m"), of(|run| &run.input.torque), true);
    let time = channel((signals::TIME, columns::TIME, "s"), of(|run| &run.input.time), false);
    let rotors = runs.iter().flat_map(|run| run.input.propeller_rate.iter().flatten().copied());
    let propeller =
        channel((signals::PROPELLER_RATE, Sensor::PropellerRate.name_with_unit(), "rad/s"), rotors, false);
    let some = |channels: [&Option<LawInput>; 4]| channels.into_iter().flatten().cloned().collect();
    vec![
        Outlook { site: Site::Torque, channels: some([&angle, &rate, &torque, &time]) },
        Outlook { site: Site::Thrust, channels: some([&propeller, &None, &None, &None]) },
        Outlook { site: Site::BodyRateSensor, channels: some([&angle, &rate, &None, &None]) },
    ]
}

/// The channel; `None` where it is not logged or does not move.
fn channel(
    (signal, log, unit): (&'static str, &'static str, &'static str),
    values: impl Iterator<Item = f64> + Clone,
    is_signed: bool,
) -> Option<LawInput> {
    let (least, most) = extremes(values.clone());
    let low = quantile(values.clone(), THRESHOLDS.tail)?;
    let high = quantile(values, 1.0 - THRESHOLDS.tail)?;
    let moves = high - low > 1e-9 * least.abs().max(most.abs());
    moves.then_some(LawInput { signal, log, unit, low, high, is_signed })
}
