//! The battery's voltage without the noise of its reading.
//!
//! **Deviation:** (6) and what the paper builds on it regress on the voltage as it was read. Noise of a regressor biases
//! its coefficient towards zero: of a minute's discharge half of what is read is noise. So the voltage is replaced by
//! what can be predicted of it (two-stage least squares): its smooth course over time, and what the commands draw from
//! it, at once and as the rotors follow them. None of these carries noise of the reading. What the other rotor draws has a
//! part in it, too: left out, it would stay behind in the rates, and look like physics that is missing.

use super::thresholds::THRESHOLDS;

use super::regressors::record_of;
use crate::effect::step_response;
use crate::estimation::hats::hats;
use crate::estimation::ridge::RidgeSums;
use crate::log::Cells;
use crate::screening::rotor_data::{Beside, RotorLog, VoltageInstrument};

/// Functions of a rotor's command: u, u², and the first three powers of the rate that they give; and of both rotors.
const OF_ONE: usize = 5;
const OF_COMMAND: usize = 2 * OF_ONE;

/// How a rotor follows its command, roughly: what it draws from the battery goes with its rate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RotorResponse {
    /// [1/s]
    pub pole: f64,
    /// [s]
    pub delay: f64,
    /// [rad/s] of u and u².
    pub curve: [f64; 2],
    /// [rad/(s V)] k_V: a rotor that draws less as the voltage gives way follows faster.
    pub voltage_gain: f64,
    /// [V] v_bmax
    pub full_voltage: f64,
}

/// The log with the smooth course of its voltage over time alone: what goes with the load is not in it, and so cannot stand
/// in for the rate of a rotor with a dead time. Unchanged where it has none, or too little of it.
pub(crate) fn course(rotor: &RotorLog) -> RotorLog {
    let Some(voltage) = rotor.voltage.as_deref() else { return rotor.clone() };
    let nothing = OfCommand { functions: [0.0; OF_COMMAND], known: true };
    let course = predict(rotor, voltage, &vec![nothing; rotor.time.len()], 0).map(|(course, _)| course);
    RotorLog { voltage: course.map(Cells::from).or_else(|| rotor.voltage.clone()), ..rotor.clone() }
}

/// The log with its voltage replaced; unchanged where it has none, or too little of it.
pub(crate) fn without_noise(rotor: &RotorLog, response: RotorResponse) -> RotorLog {
    let Some(voltage) = rotor.voltage.as_deref() else { return rotor.clone() };
    let mut smooth = RotorLog { voltage: None, ..rotor.clone() };
    // The rates that draw on the voltage give way with it themselves: at first as if they did not.
    for _ in 0..THRESHOLDS.instrument_passes {
        let (of_command, count) = of_both(&smooth, response);
        let Some((predicted, noise)) = predict(&smooth, voltage, &of_command, count) else {
            return rotor.clone();
        };
        smooth.voltage = Some(predicted.into());
        smooth.instrument = Some(VoltageInstrument { pole: response.pole, noise });
    }
    smooth
}

/// [V] what time and the first `count` functions of the commands predict of `voltage`, and the rms of what is left.
fn predict(
    rotor: &RotorLog,
    voltage: &[f64],
    of_command: &[OfCommand],
    count: usize,
) -> Option<(Vec<f64>, f64)> {
    let (first, last) = (*rotor.time.first()?, *rotor.time.last()?);
    let bends = ((last - first) / THRESHOLDS.shortest_bend).floor() as usize;
    let knots = bends.clamp(1, THRESHOLDS.most_knots) + 1;
    let spacing = (last - first) / (knots - 1) as f64;
    let size = knots + count;
    // The columns that are not zero: the two hats that a time lies under, and the functions of the command.
    let columns = |row: usize| {
        let place = ((rotor.time[row] - first) / spacing).clamp(0.0, (knots - 1) as f64);
        let of_command = of_command[row].functions;
        hats(place, knots - 1).into_iter().chain((0..count).map(move |at| (knots + at, of_command[at])))
    };
    let mut sums = RidgeSums::new(size);
    let mut known = 0;
    let whole = rotor.whole();
    let rows = whole.iter().flat_map(Clone::clone);
    for row in rows.clone().filter(|row| of_command[*row].known && voltage[*row].is_finite()) {
        known += 1;
        sums.add(columns(row), 1.0, voltage[row]);
    }
    if known < THRESHOLDS.rows_per_number * size {
        return None;
    }
    let weights = sums.solve(known)?;
    let mut predicted = voltage.to_vec();
    let mut left = 0.0;
    for row in rows {
        predicted[row] = columns(row).map(|(at, x)| weights[at] * x).sum();
        if of_command[row].known && voltage[row].is_finite() {
            left += (voltage[row] - predicted[row]).powi(2);
        }
    }
    Some((predicted, (left / (known - size) as f64).sqrt()))
}

/// What a row's commands give.
#[derive(Debug, Clone, Copy)]
struct OfCommand {
    /// Those of the rotor itself first.
    functions: [f64; OF_COMMAND],
    /// Whether the rate comes from commands that are known: not so soon after some that are missing, for as long as these
    /// act on behind a delay. What such rows say of the battery would be taken for noise.
    known: bool,
}

/// What the commands of all that draws on the battery give, and how many functions that are; `rotor` has the voltage that
/// was predicted before.
fn of_both(rotor: &RotorLog, response: RotorResponse) -> (Vec<OfCommand>, usize) {
    let mut all = of_command(rotor, response, missing(rotor, response));
    let is_apart = |beside: &&Beside| {
        rotor
            .command
            .iter()
            .zip(&beside.command)
            .any(|(one, other)| (one - other).abs() > THRESHOLDS.same_command)
    };
    let Some(beside) = rotor.beside.as_ref().filter(is_apart) else { return (all, OF_ONE) };
    // What was measured is not its rate.
    let other = RotorLog { command: beside.command.clone(), ..rotor.clone() };
    for (both, other) in all.iter_mut().zip(of_command(&other, response, None)) {
        both.functions[OF_ONE..].copy_from_slice(&other.functions[..OF_ONE]);
    }
    (all, OF_COMMAND)
}

/// [rad/s] What the rate lacks, on the whole: at first all that the battery takes.
fn missing(rotor: &RotorLog, response: RotorResponse) -> Option<f64> {
    let (mut missing, mut count) = (0.0, 0.0);
    let held = predicted_rate(rotor, response, None);
    for (row, rate, _) in held.into_iter().filter(|(row, ..)| rotor.rate[*row].is_finite()) {
        missing += rate - rotor.rate[row];
        count += 1.0;
    }
    Some(if count > 0.0 { missing / count } else { 0.0 })
}

/// [-] u and u² now, and the first powers of the rate, steady where a segment begins. Commands that are missing are held;
/// where they are known (again), the rate goes on from what was measured there, and as much more as is `missing` [rad/s]: its
/// noise has no part in that of the voltage.
fn of_command(rotor: &RotorLog, response: RotorResponse, missing: Option<f64>) -> Vec<OfCommand> {
    let at_once = |u: &f64| {
        let mut functions = [0.0; OF_COMMAND];
        functions[..2].copy_from_slice(&[*u, u * u]);
        OfCommand { functions, known: false }
    };
    let mut all: Vec<OfCommand> = rotor.command.iter().map(at_once).collect();
    let predicted = predicted_rate(rotor, response, missing);
    // Centred and scaled: powers of a rate that moves by a tenth of itself would hardly be separable.
    let share = 1.0 / predicted.len().max(1) as f64;
    let mean = predicted.iter().map(|(_, rate, _)| rate * share).sum::<f64>();
    let spread = predicted.iter().map(|(_, rate, _)| (rate - mean).powi(2) * share).sum::<f64>().sqrt();
    for (row, rate, known) in predicted {
        let rate = if spread > 0.0 { (rate - mean) / spread } else { 0.0 };
        all[row].functions[2..OF_ONE].copy_from_slice(&[rate, rate * rate, rate.powi(3)]);
        all[row].known = known;
    }
    all
}

/// Row, the rate [rad/s] that the curve gives, less what the voltage takes that was predicted before, and whether the commands
/// that it comes from are known. With `missing` [rad/s] the rate goes on from what was measured, and as much more, where
/// commands are known again, or a stretch begins.
fn predicted_rate(
    rotor: &RotorLog,
    response: RotorResponse,
    missing: Option<f64>,
) -> Vec<(usize, f64, bool)> {
    let RotorResponse { pole, delay, curve: [linear, quadratic], voltage_gain, full_voltage } = response;
    let whole = RotorLog { segments: rotor.whole(), ..rotor.clone() };
    let mut begun = f64::INFINITY;
    let mut begins = rotor.segments.iter().map(|known| known.start).peekable();
    // The commands as they act, with a row more where one comes between two samples.
    let acting = record_of(std::slice::from_ref(&whole), full_voltage, delay, |u, drop| {
        [linear * u + quadratic * u * u - voltage_gain * drop]
    });
    let mut each = Vec::with_capacity(rotor.time.len());
    for (segment, rows) in whole.segments.iter().zip(&acting.segments) {
        let mut left = segment.clone();
        let [mut rate] = acting.inputs[rows.start];
        for at in rows.clone() {
            if let Some(row) = left.clone().next()
                && rotor.time[row] == acting.time[at]
            {
                left.start += 1;
                while let Some(begin) = begins.next_if(|begin| *begin <= row) {
                    // What came before it still acts for as long as the delay.
                    begun = rotor.time[begin] + delay;
                }
                let measured = rotor.rate[row];
                if let Some(missing) = missing.filter(|_| rotor.time[row] >= begun && measured.is_finite()) {
                    rate = measured + missing;
                    begun = f64::INFINITY;
                }
                each.push((row, rate, begun.is_infinite()));
            }
            if at + 1 < rows.end {
                let share = step_response(pole, acting.time[at + 1] - acting.time[at]);
                let [steady] = acting.inputs[at];
                rate += (steady - rate) * share;
            }
        }
    }
    each
}
