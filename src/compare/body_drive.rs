//! What drives the body: its rotors as they were measured, its torque as it was commanded, or its rotors as the model runs them.

use std::borrow::Cow;
use std::ops::Range;

use crate::estimation::slope::{finite_slope, forward_slopes};
use crate::log::segments::held_throughout;
use crate::log::{Cells, Dataset};
use crate::model::{BodyInput, Equations, LagInverse, Remembered, RotorInput, RotorStart, RotorTrace};
use crate::screening::{DrivenBy, ScreenedBody, ScreenedLog, readings};
use crate::signal::columns::{
    BATTERY_VOLTAGE, BODY_ANGLE, BODY_RATE, COMMANDS, PROPELLER_RATES, TORQUE_COMMAND,
};
use crate::signal::side;

/// What drives the body.
pub(crate) struct BodyDrive<'a> {
    /// Rows of the log, and the input over them.
    pub stretches: Vec<(Range<usize>, BodyInput)>,
    /// Columns.
    pub by: Vec<&'static str>,
    /// Which rows are scored.
    pub judged: &'a ScreenedBody,
}

/// Measured inputs of the body. `None` where the log has not got it, or it was held still.
pub(crate) fn body_inputs<'a>(equations: &Equations, screened: &'a ScreenedLog) -> Option<BodyDrive<'a>> {
    let log = screened.dataset();
    let judged = screened.body().filter(|judged| !judged.is_held())?;
    let (by, stretches) = match judged.driven_by() {
        DrivenBy::MeasuredRates => (PROPELLER_RATES.to_vec(), by_rates(equations, log, judged.stretches())),
        DrivenBy::TorqueCommand => {
            let input = |rows: &Range<usize>| {
                let time = log.time_cells().part(rows.clone());
                let still = vec![0.0; time.len()];
                let torque = equations.torque_means(&time, &judged.torque()[rows.clone()], &still);
                (rows.clone(), BodyInput { time, torque, propeller_rate: [Vec::new(), Vec::new()] })
            };
            (vec![TORQUE_COMMAND], judged.stretches().iter().map(input).collect())
        }
        DrivenBy::Commands => return None,
    };
    let stretches = with_memory(equations, log, stretches);
    Some(BodyDrive { stretches, by, judged })
}

/// The same with what laws add that remember where the body has been: as it was measured.
fn with_memory(
    equations: &Equations,
    log: &Dataset,
    mut stretches: Vec<(Range<usize>, BodyInput)>,
) -> Vec<(Range<usize>, BodyInput)> {
    if !equations.has_remembered_torque() {
        return stretches;
    }
    let held = |name: &str| {
        let bridged = readings::bridged(log.time(), log.column(name).unwrap_or_default());
        held_throughout(&bridged)
    };
    let (angle, rate) = (held(BODY_ANGLE), held(BODY_RATE));
    let of = |values: &[f64], rows: &Range<usize>| values.get(rows.clone()).unwrap_or_default().to_vec();
    for (rows, input) in &mut stretches {
        equations.add_remembered_torque(input, &of(&angle, rows), &of(&rate, rows));
    }
    stretches
}

/// [rad/s] what a rotor did of which these are the readings, not-a-number where there is none.
pub(crate) fn true_rates<'a>(
    equations: &Equations,
    telemetry: &LagInverse,
    log: &Dataset,
    readings: Cow<'a, [f64]>,
) -> Cow<'a, [f64]> {
    equations.rates_behind(telemetry, readings, |readings, half| {
        (0..readings.len()).map(|row| finite_slope(log.time(), readings, row, half)).collect()
    })
}

fn by_rates(
    equations: &Equations,
    log: &Dataset,
    stretches: &[Range<usize>],
) -> Vec<(Range<usize>, BodyInput)> {
    let telemetry = equations.telemetry_inverse(log.median_interval());
    let rates = PROPELLER_RATES.map(|name| {
        let rates = readings::carried(log.time(), log.column(name).unwrap_or_default());
        true_rates(equations, &telemetry, log, rates)
    });
    match stretches {
        // Mostly all of the log: nothing to copy.
        [all] if all.len() == log.len() => {
            vec![(all.clone(), rotor_driven(equations, log.time_cells(), rates.map(Cow::into_owned)))]
        }
        stretches => {
            let input = |rows: &Range<usize>| {
                let rates = rates.each_ref().map(|rates| rates[rows.clone()].to_vec());
                (rows.clone(), rotor_driven(equations, log.time_cells().part(rows.clone()), rates))
            };
            stretches.iter().map(input).collect()
        }
    }
}

/// Input of the body from the rates of both rotors at the samples, straight lines between them.
fn rotor_driven(equations: &Equations, time: Cells, rates: [Vec<f64>; 2]) -> BodyInput {
    let [mut rate_1, mut rate_2] = rates;
    let pairs = rate_1.iter().zip(&rate_2);
    let mut torque: Vec<f64> = pairs.map(|(a, b)| equations.rotor_torque(*a, *b)).collect();
    let slopes = forward_slopes(&time, &torque);
    // In place: of a long log each of these takes as much as a column.
    for values in [&mut rate_1, &mut rate_2, &mut torque] {
        for row in 1..values.len() {
            values[row - 1] = 0.5 * (values[row - 1] + values[row]);
        }
    }
    BodyInput {
        torque: equations.torque_means(&time, &torque, &slopes),
        propeller_rate: [rate_1, rate_2],
        time,
    }
}

/// Inputs of the body through the modelled rotors.
pub(crate) fn commanded<'a>(equations: &Equations, screened: &'a ScreenedLog) -> Option<BodyDrive<'a>> {
    let log = screened.dataset();
    let judged = screened.chain().filter(|judged| !judged.is_held())?;
    let rotors = [screened.commanded(1)?, screened.commanded(2)?];
    let mut ends: [Option<(f64, Remembered)>; 2] = [None; 2];
    let body = judged.stretches().iter().map(|rows| {
        let time = &log.time()[rows.clone()];
        let mut rotor_rates = |rotor: usize| {
            let data = rotors[rotor].data();
            let from = data.command_from_beside(equations.command_delay(), rows);
            let input = RotorInput {
                time,
                command: &data.command[rows.clone()],
                command_from: from.as_deref(),
                voltage: rotors[rotor].voltage().map(|voltage| &voltage[rows.clone()]),
                side: side(rotor),
            };
            let first = log.column(PROPELLER_RATES[rotor]).and_then(|rates| rates.get(rows.start).copied());
            let rate = first.filter(|rate| rate.is_finite());
            let before = Remembered::at_begin(ends[rotor], time);
            let start = RotorStart { rate, is_first: rows.start == 0, before, ..RotorStart::default() };
            let mut trace = RotorTrace::default();
            equations.simulate_rotor(&input, &start, &mut trace);
            ends[rotor] = time.last().copied().zip(trace.end);
            trace.rate
        };
        let rates = [rotor_rates(0), rotor_rates(1)];
        (rows.clone(), rotor_driven(equations, log.time_cells().part(rows.clone()), rates))
    });
    let battery = log.column(BATTERY_VOLTAGE);
    let by = COMMANDS.into_iter().chain(battery.map(|_| BATTERY_VOLTAGE)).collect();
    Some(BodyDrive { stretches: with_memory(equations, log, body.collect()), by, judged })
}
