//! The battery's voltage without the noise of its reading.
//!
//! **Deviation:** (6) and what the paper builds on it regress on the voltage as it was read. Noise of a regressor biases
//! its coefficient towards zero: of a minute's discharge half of what is read is noise. So the voltage is replaced by
//! what can be predicted of it (two-stage least squares): its smooth course over time, and what the commands draw from
//! it, at once and as the rotors follow them. None of these carries noise of the reading. What the other rotor draws has a
//! part in it, too: left out, it would stay behind in the rates, and look like physics that is missing.

use super::thresholds::THRESHOLDS;

use super::regressors::walk;
use crate::cancel;
use crate::effect::RowResponse;
use crate::estimation::hats::hats;
use crate::estimation::ridge::RidgeSums;
use crate::log::Cells;
use crate::screening;
use crate::screening::rotor_data::{Beside, RotorLog, VoltageInstrument};

/// Functions of a rotor's command: u, u², and the first three powers of the rate that they give.
const OF_ONE: usize = 5;

/// How a rotor follows its command, roughly: what it draws from the battery goes with its rate.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RotorResponse {
    /// [rad/s]
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
    let course = predict(rotor, voltage, &[], |_| true).map(|(course, _)| course);
    RotorLog { voltage: course.map(Cells::from).or_else(|| rotor.voltage.clone()), ..rotor.clone() }
}

/// The log with its voltage replaced; unchanged where it has none, or too little of it.
pub(crate) fn without_noise(rotor: &RotorLog, response: RotorResponse) -> RotorLog {
    let Some(voltage) = rotor.voltage.as_deref() else { return rotor.clone() };
    let mut smooth = RotorLog { voltage: None, ..rotor.clone() };
    // The rates that draw on the voltage give way with it themselves: at first as if they did not.
    for _ in 0..THRESHOLDS.instrument_passes {
        let loads = of_both(&smooth, response);
        let is_known = |row: usize| loads.first().is_none_or(|own| own.state[row] == State::Known);
        let Some((predicted, noise)) = predict(&smooth, voltage, &loads, is_known) else {
            return rotor.clone();
        };
        smooth.voltage = Some(predicted.into());
        smooth.instrument = Some(VoltageInstrument { pole: response.pole, noise });
    }
    smooth
}

/// [V] what time and what draws on the battery predict of `voltage`, and the rms of what is left where that is known.
fn predict(
    rotor: &RotorLog,
    voltage: &[f64],
    loads: &[Load],
    is_known: impl Fn(usize) -> bool,
) -> Option<(Vec<f64>, f64)> {
    match loads {
        [] => predict_by(rotor, voltage, |_| [], is_known),
        [own] => predict_by(rotor, voltage, |row| own.functions(row), is_known),
        [own, other, ..] => {
            let functions = |row: usize| {
                let (own, other) = (own.functions(row), other.functions(row));
                std::array::from_fn::<f64, { 2 * OF_ONE }, _>(|at| {
                    if at < OF_ONE { own[at] } else { other[at - OF_ONE] }
                })
            };
            predict_by(rotor, voltage, functions, is_known)
        }
    }
}

/// The same with `functions` of a row beside time.
fn predict_by<const N: usize>(
    rotor: &RotorLog,
    voltage: &[f64],
    functions: impl Fn(usize) -> [f64; N],
    is_known: impl Fn(usize) -> bool,
) -> Option<(Vec<f64>, f64)> {
    let (first, last) = (*rotor.time.first()?, *rotor.time.last()?);
    let bends = ((last - first) / screening::thresholds::THRESHOLDS.shortest_bend).floor() as usize;
    let knots = bends.clamp(1, THRESHOLDS.most_knots) + 1;
    let spacing = (last - first) / (knots - 1) as f64;
    let size = knots + N;
    let time = &rotor.time[..];
    // The two hats that a time lies under.
    let hats_at = |row: usize| {
        let place = ((time[row] - first) / spacing).clamp(0.0, (knots - 1) as f64);
        hats(place, knots - 1)
    };
    let mut sums = RidgeSums::new(size);
    let mut known = 0;
    let whole = rotor.whole();
    let rows = whole.iter().flat_map(Clone::clone);
    for row in rows.clone().filter(|row| is_known(*row) && voltage[*row].is_finite()) {
        cancel::check_at(known);
        known += 1;
        sums.add_dense(hats_at(row), (knots, &functions(row)), voltage[row]);
    }
    if known < THRESHOLDS.rows_per_number * size {
        return None;
    }
    let weights = sums.solve(known)?;
    let of_functions: [f64; N] = std::array::from_fn(|at| weights[knots + at]);
    let mut predicted = voltage.to_vec();
    let mut left = 0.0;
    for row in rows {
        let course = hats_at(row).map(|(at, x)| weights[at] * x);
        let load = functions(row).into_iter().zip(of_functions).map(|(x, weight)| weight * x);
        predicted[row] = course.into_iter().chain(load).sum();
        if is_known(row) && voltage[row].is_finite() {
            left += (voltage[row] - predicted[row]).powi(2);
        }
    }
    Some((predicted, (left / (known - size) as f64).sqrt()))
}

/// Whether the rate of a row comes from commands that are known: not so soon after some that are missing, for as long as these
/// act on behind a delay. What such rows say of the battery would be taken for noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Unknown,
    Predicted,
    Known,
}

/// What a rotor draws from the battery goes with its command, and with the rate that follows it.
struct Load {
    /// [-]
    command: Cells,
    /// [-] rate, less its mean, over its spread; zero where it is not known. Powers of a rate that moves by a tenth of itself would
    /// hardly be separable.
    rate: Vec<f64>,
    state: Vec<State>,
}

impl Load {
    /// [-] u and u² now, and the first powers of the rate, steady where a segment begins. Commands that are missing are held;
    /// where they are known (again), the rate goes on from what was measured there, and as much more as is `missing` [rad/s]: its
    /// noise has no part in that of the voltage.
    fn of(rotor: &RotorLog, response: RotorResponse, missing: Option<f64>) -> Self {
        let rows = rotor.time.len();
        let (mut rate, mut state) = (vec![0.0; rows], vec![State::Unknown; rows]);
        let mut count = 0_usize;
        predicted_rate(rotor, response, missing, |row, now, is_known| {
            count += 1;
            rate[row] = now;
            state[row] = if is_known { State::Known } else { State::Predicted };
        });
        let share = 1.0 / count.max(1) as f64;
        let predicted = || rate.iter().zip(&state).filter(|(_, state)| **state != State::Unknown);
        let mean = predicted().map(|(rate, _)| rate * share).sum::<f64>();
        let spread = predicted().map(|(rate, _)| (rate - mean).powi(2) * share).sum::<f64>().sqrt();
        for (rate, _) in rate.iter_mut().zip(&state).filter(|(_, state)| **state != State::Unknown) {
            *rate = if spread > 0.0 { (*rate - mean) / spread } else { 0.0 };
        }
        Self { command: rotor.command.clone(), rate, state }
    }

    fn functions(&self, row: usize) -> [f64; OF_ONE] {
        let (u, rate) = (self.command[row], self.rate[row]);
        [u, u * u, rate, rate * rate, rate.powi(3)]
    }
}

/// What draws on the battery, the rotor itself first; it has the voltage that was predicted before.
fn of_both(rotor: &RotorLog, response: RotorResponse) -> Vec<Load> {
    let own = Load::of(rotor, response, missing(rotor, response));
    let is_apart = |beside: &&Beside| {
        let pairs = rotor.command.iter().zip(&beside.command);
        pairs.into_iter().any(|(one, other)| (one - other).abs() > THRESHOLDS.same_command)
    };
    let Some(beside) = rotor.beside.as_ref().filter(is_apart) else { return vec![own] };
    // What was measured is not its rate.
    let other = RotorLog { command: beside.command.clone(), ..rotor.clone() };
    vec![own, Load::of(&other, response, None)]
}

/// [rad/s] What the rate lacks, on the whole: at first all that the battery takes.
fn missing(rotor: &RotorLog, response: RotorResponse) -> Option<f64> {
    let (mut missing, mut count) = (0.0, 0.0);
    predicted_rate(rotor, response, None, |row, rate, _| {
        if rotor.rate[row].is_finite() {
            missing += rate - rotor.rate[row];
            count += 1.0;
        }
    });
    Some(if count > 0.0 { missing / count } else { 0.0 })
}

/// Row, the rate [rad/s] that the curve gives, less what the voltage takes that was predicted before, and whether the commands
/// that it comes from are known. With `missing` [rad/s] the rate goes on from what was measured, and as much more, where
/// commands are known again, or a stretch begins.
fn predicted_rate(
    rotor: &RotorLog,
    response: RotorResponse,
    missing: Option<f64>,
    mut visit: impl FnMut(usize, f64, bool),
) {
    let RotorResponse { pole, delay, curve: [linear, quadratic], voltage_gain, full_voltage } = response;
    let mut begun = f64::INFINITY;
    let mut begins = rotor.stretches.iter().map(|known| known.start).peekable();
    let measured_at = &rotor.rate[..];
    for segment in rotor.whole() {
        let (mut rate, mut before) = (f64::NAN, None);
        let mut response = RowResponse::of(pole);
        // The commands as they act, with a step more where one comes between two samples.
        walk(rotor, &segment, full_voltage, delay, |acting| {
            let u = acting.command;
            let steady = linear * u + quadratic * u * u - voltage_gain * acting.drop;
            match before {
                None => rate = steady,
                Some((time, steady)) => {
                    rate += (steady - rate) * response.over(acting.time - time);
                }
            }
            before = Some((acting.time, steady));
            let Some(row) = acting.row else { return };
            while let Some(begin) = begins.next_if(|begin| *begin <= row) {
                // What came before it still acts for as long as the delay.
                begun = rotor.time[begin] + delay;
            }
            let measured = measured_at[row];
            if let Some(missing) = missing.filter(|_| acting.time >= begun && measured.is_finite()) {
                rate = measured + missing;
                begun = f64::INFINITY;
            }
            visit(row, rate, begun.is_infinite());
        });
    }
}
