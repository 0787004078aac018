//! Runs each block on measured inputs, through the model's own free runs.

use std::borrow::Cow;
use std::ops::Range;

use super::block_run::{BlockRun, NoisePath};
use super::run::RunMode;
use super::thresholds::THRESHOLDS;
use super::{CompareConfig, CompareError, gyro_block};
use crate::cancel;
use crate::effect::Law;
use crate::estimation::slope::forward_slopes;
use crate::estimation::windows;
use crate::log::segments::{held_throughout, stretches};
use crate::log::signals::rotor_of;
use crate::log::{Cells, Dataset};
use crate::model::{BodyInput, BodyStart, BodyTrace, Equations, Model, RotorInput, RotorStart, RotorTrace};
use crate::screening::{DrivenBy, ScreenedBody, ScreenedLog, readings};
use crate::signal::columns::{
    self, BATTERY_VOLTAGE, BODY_ANGLE, BODY_RATE, COMMANDS, PROPELLER_RATES, TORQUE_COMMAND,
};
use crate::signal::{ROTORS, side};
use crate::threads::spread_longest_first;

/// Runs every block that finds its inputs and its output.
pub(crate) fn blocks(
    model: &Model,
    screened: &ScreenedLog,
    config: &CompareConfig,
) -> Result<Vec<BlockRun>, CompareError> {
    let equations = model.equations()?;
    let log = screened.dataset();
    let driven = |name: &'static str, driven: Option<BodyDrive>| {
        driven.map_or_else(Vec::new, |driven| body(name, &equations, log, config, &driven))
    };
    let one = |(_, part): &(usize, Part)| -> Result<Vec<BlockRun>, CompareError> {
        let found: Vec<BlockRun> = match *part {
            Part::Actuator(rotor) => actuator(model, &equations, screened, rotor)?.into_iter().collect(),
            Part::Thrust(rotor) => thrust(model, &equations, screened, rotor).into_iter().collect(),
            Part::Body => driven("body", body_inputs(&equations, screened)),
            Part::Sensors => gyro_block::run(&equations, log).into_iter().collect(),
            Part::Chain => driven("chain", commanded(&equations, screened)),
        };
        Ok(found.into_iter().map(BlockRun::end).collect())
    };
    // Those of the body, which are downstream, take longest.
    let parts: Vec<(usize, Part)> = parts(log).into_iter().enumerate().collect();
    let found = spread_longest_first(&parts, |(place, _)| *place, one);
    let found: Result<Vec<Vec<BlockRun>>, CompareError> = found.into_iter().collect();
    Ok(found?.into_iter().flatten().collect())
}

/// What may be run by itself.
enum Part {
    Actuator(usize),
    Thrust(usize),
    Body,
    Sensors,
    Chain,
}

/// Upstream first.
fn parts(log: &Dataset) -> Vec<Part> {
    let last = log.names().filter_map(rotor_of).max().unwrap_or(0).max(ROTORS);
    let rotors = (0..last).flat_map(|rotor| [Part::Actuator(rotor), Part::Thrust(rotor)]);
    rotors.chain([Part::Body, Part::Sensors, Part::Chain]).collect()
}

/// Command and battery to rate, free run over each stretch.
fn actuator(
    model: &Model,
    equations: &Equations,
    screened: &ScreenedLog,
    rotor: usize,
) -> Result<Option<BlockRun>, CompareError> {
    let log = screened.dataset();
    let (signal, command_name) = (columns::propeller_rate(rotor + 1), columns::command(rotor + 1));
    let (Some(judged), Some(rate)) = (screened.rotor(rotor + 1), log.column(&signal)) else {
        return Ok(None);
    };
    let (command, battery) = (&judged.data().command[..], judged.voltage());
    let mut driven_by = vec![command_name.as_str()];
    driven_by.extend(battery.map(|_| BATTERY_VOLTAGE));
    let name = format!("actuator_{}", rotor + 1);
    let mut block = BlockRun::new(&name, &signal, "rad/s", &driven_by, NoisePath::Sensor);
    let mut is_slow = false;
    for added in &model.effects {
        is_slow |= matches!(model.effect(&added.id)?.law, Law::Memory(memory) if memory.slow);
    }
    // Mostly every reading is scored: nothing to copy.
    let is_left_out = |row: usize| rate[row].is_finite() && !judged.is_scored(row);
    let in_part = judged.stretches().iter().cloned().flatten().any(is_left_out);
    let (mut squares, mut count) = (0.0, 0.0);
    for rows in judged.stretches().iter().cloned() {
        let time = &log.time()[rows.clone()];
        let shown = &rate[rows.clone()];
        let scored = || rows.clone().zip(shown);
        let measured: Cow<[f64]> = if in_part {
            scored().map(|(row, rate)| if judged.is_scored(row) { *rate } else { f64::NAN }).collect()
        } else {
            Cow::Borrowed(shown)
        };
        let from = judged.data().command_from_beside(equations.command_delay(), &rows);
        let input = RotorInput {
            time,
            command: &command[rows.clone()],
            command_from: from.as_deref(),
            voltage: battery.map(|volts| &volts[rows.clone()]),
            side: side(rotor),
        };
        let modelled = rotor_run(equations, &input, rows.start == 0, (shown, &measured), is_slow);
        let (added, over) = one_step_squares(time, (&measured, &modelled), model.actuator.pole);
        (squares, count) = (squares + added, count + over);
        add(&mut block, in_part.then_some(&measured), rows, &modelled);
    }
    block.one_step = (count > 0.0).then(|| f64::sqrt(squares / count));
    Ok((count > 0.0).then_some(block))
}

/// Squares of what a first-order rotor does one sample ahead, and how many: the residual less what it had coming.
fn one_step_squares(time: &[f64], (measured, modelled): (&[f64], &[f64]), pole: f64) -> (f64, f64) {
    let (mut squares, mut count) = (0.0, 0.0);
    let mut before: Option<usize> = None;
    for k in (0..measured.len()).filter(|k| measured[*k].is_finite()) {
        if let Some(j) = before.replace(k) {
            let kept = (-pole * (time[k] - time[j])).exp();
            let step = measured[k] - modelled[k] - kept * (measured[j] - modelled[j]);
            if step.is_finite() {
                squares += step * step;
                count += 1.0;
            }
        }
    }
    (squares, count)
}

/// Rate that the telemetry would show over a stretch, started at the first measured value; of `scored` a slow state is learned.
fn rotor_run(
    equations: &Equations,
    input: &RotorInput,
    is_first: bool,
    (measured, scored): (&[f64], &[f64]),
    is_slow: bool,
) -> Vec<f64> {
    let mut start = RotorStart {
        rate: measured.first().copied().filter(|rate| rate.is_finite()),
        is_first,
        ..RotorStart::default()
    };
    let mut trace = RotorTrace::default();
    equations.simulate_rotor(input, &start, &mut trace);
    if is_slow {
        // How warm the motor was at the start is not in the log: the value that fits best, the response to it
        // being close to linear.
        let from_steady = std::mem::take(&mut trace.measured);
        start.slow = THRESHOLDS.slow_trial;
        equations.simulate_rotor(input, &start, &mut trace);
        let (mut along, mut size) = (0.0, 0.0);
        for ((y, a), b) in
            scored.iter().zip(&from_steady).zip(&trace.measured).filter(|((y, _), _)| y.is_finite())
        {
            along += (y - a) * (b - a);
            size += (b - a).powi(2);
        }
        start.slow = if size > 0.0 { THRESHOLDS.slow_trial * along / size } else { 0.0 };
        equations.simulate_rotor(input, &start, &mut trace);
    }
    trace.measured
}

/// Measured rate to thrust.
fn thrust(model: &Model, equations: &Equations, screened: &ScreenedLog, rotor: usize) -> Option<BlockRun> {
    let log = screened.dataset();
    let (signal, rate_name) = (columns::thrust(rotor + 1), columns::propeller_rate(rotor + 1));
    let (judged, rate) = (screened.thrust(rotor + 1)?, log.column(&rate_name)?);
    let scored = judged.scored(log);
    // Where the body matters to a law of the model, it has to be known.
    let driving = |name: &str| {
        log.column(name).filter(|_| model.needs(name)).map(|values| readings::bridged(log.time(), values))
    };
    let still = || Cow::Owned(vec![0.0; log.len()]);
    let angle = driving(BODY_ANGLE).unwrap_or_else(still);
    let body_rate = driving(BODY_RATE).unwrap_or_else(still);
    let rate = readings::bridged(log.time(), rate);
    let at = |rate: f64, row: usize| equations.rotor_thrust(rate, side(rotor), angle[row], body_rate[row]);
    let middle = rate.iter().copied().filter(|rate| rate.is_finite()).sum::<f64>()
        / rate.iter().filter(|rate| rate.is_finite()).count() as f64;
    let slope = equations.rotor_thrust(middle + 1.0, side(rotor), 0.0, 0.0)
        - equations.rotor_thrust(middle, side(rotor), 0.0, 0.0);
    let name = format!("thrust_{}", rotor + 1);
    let mut block = BlockRun::new(&name, &signal, "N", &[&rate_name], NoisePath::Thrust(slope));
    for stretch in stretches(log, &[&rate, &angle, &body_rate]) {
        let modelled: Vec<f64> = stretch.rows.clone().map(|row| at(rate[row], row)).collect();
        block.add_scored(stretch.rows.clone(), &scored[stretch.rows], &modelled);
    }
    block.is_scored(log).then_some(block)
}

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

fn by_rates(
    equations: &Equations,
    log: &Dataset,
    stretches: &[Range<usize>],
) -> Vec<(Range<usize>, BodyInput)> {
    let rates =
        PROPELLER_RATES.map(|name| readings::carried(log.time(), log.column(name).unwrap_or_default()));
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
fn commanded<'a>(equations: &Equations, screened: &'a ScreenedLog) -> Option<BodyDrive<'a>> {
    let log = screened.dataset();
    let judged = screened.chain().filter(|judged| !judged.is_held())?;
    let rotors = [screened.commanded(1)?, screened.commanded(2)?];
    let body = judged.stretches().iter().map(|rows| {
        let time = &log.time()[rows.clone()];
        let rates = [0, 1].map(|rotor| {
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
            let start = RotorStart { rate, is_first: rows.start == 0, ..RotorStart::default() };
            let mut trace = RotorTrace::default();
            equations.simulate_rotor(&input, &start, &mut trace);
            trace.rate
        });
        (rows.clone(), rotor_driven(equations, log.time_cells().part(rows.clone()), rates))
    });
    let battery = log.column(BATTERY_VOLTAGE);
    let by = COMMANDS.into_iter().chain(battery.map(|_| BATTERY_VOLTAGE)).collect();
    Some(BodyDrive { stretches: with_memory(equations, log, body.collect()), by, judged })
}

/// Windows over the body: rate, and angle where it is measured.
fn body(
    name: &'static str,
    equations: &Equations,
    log: &Dataset,
    config: &CompareConfig,
    driven: &BodyDrive,
) -> Vec<BlockRun> {
    let Some(shown) = log.column(BODY_RATE) else { return Vec::new() };
    let shown_angle = log.column(BODY_ANGLE);
    let rate = driven.judged.driven_rows(shown);
    let angle = shown_angle.map(|angle| driven.judged.driven_rows(angle));
    // Where a window starts; it is scored by what was measured.
    let start_angle = shown_angle.map(|angle| readings::bridged(log.time(), angle));
    let in_part = matches!(rate, Cow::Owned(_));
    let rotors = driven.by.first() == Some(&PROPELLER_RATES[0]);
    let floor = |angle| NoisePath::Window { rotors, angle };
    let mut rates = BlockRun::new(name, BODY_RATE, "rad/s", &driven.by, floor(false));
    let mut angles = BlockRun::new(name, BODY_ANGLE, "rad", &driven.by, floor(true));
    let (mut squares, mut count) = (0.0, 0.0);
    let mut trace = BodyTrace::default();
    for (rows, input) in &driven.stretches {
        cancel::check();
        let measured = (&rate[rows.clone()], start_angle.as_ref().map(|angle| &angle[rows.clone()]));
        let is_known =
            |row: usize| measured.0[row].is_finite() && measured.1.is_none_or(|angle| angle[row].is_finite());
        for window in windows::joined(&input.time, is_known, config.horizon_s) {
            window_run(equations, input, &window, measured, &mut trace);
            // The start is the measurement itself: it is not scored.
            let scored = rows.start + window.start + 1..rows.start + window.end;
            add(&mut rates, in_part.then_some(&rate[scored.clone()]), scored.clone(), &trace.rate[1..]);
            if let Some(angle) = &angle {
                add(&mut angles, in_part.then_some(&angle[scored.clone()]), scored, &trace.angle[1..]);
            }
        }
        for window in windows::joined(&input.time, is_known, f64::MIN_POSITIVE) {
            window_run(equations, input, &window, measured, &mut trace);
            let step = measured.0[window.end - 1] - trace.rate[1];
            if step.is_finite() {
                squares += step * step;
                count += 1.0;
            }
        }
    }
    rates.run = RunMode::Windows(config.horizon_s);
    angles.run = rates.run;
    rates.one_step = (count > 0.0).then(|| f64::sqrt(squares / count));
    [rates, angles].into_iter().filter(|block| block.is_scored(log)).collect()
}

/// Adds a part to a run; `scored` is what is, of a channel that is scored in part only.
fn add(run: &mut BlockRun, scored: Option<&[f64]>, rows: Range<usize>, modelled: &[f64]) {
    match scored {
        None => run.add(rows, modelled),
        Some(scored) => run.add_scored(rows, scored, modelled),
    }
}

/// One window from the measured state.
fn window_run(
    equations: &Equations,
    input: &BodyInput,
    window: &Range<usize>,
    measured: (&[f64], Option<&[f64]>),
    trace: &mut BodyTrace,
) {
    let angle = measured.1.map_or(0.0, |angle| angle[window.start]);
    let rate = true_rate(equations, input, window.start, angle, measured.0[window.start]);
    let start = BodyStart { angle, rate, sensor: 0.0 };
    trace.rate.clear();
    trace.angle.clear();
    equations.simulate_body(input, window.start, window.end, &start, trace);
}

/// [rad/s] the body rate that the model's gyroscope would show as `reading`: its laws are straight lines.
pub(crate) fn true_rate(
    equations: &Equations,
    input: &BodyInput,
    row: usize,
    angle: f64,
    reading: f64,
) -> f64 {
    if !equations.has_rate_sensor_laws() {
        return reading;
    }
    let shown = |rate: f64| {
        let mut trace = BodyTrace::default();
        equations.simulate_body(input, row, row + 1, &BodyStart { angle, rate, sensor: 0.0 }, &mut trace);
        trace.rate.first().copied().unwrap_or(rate)
    };
    let (offset, slope) = (shown(0.0), shown(1.0) - shown(0.0));
    if slope.abs() > 1e-6 { (reading - offset) / slope } else { reading }
}
