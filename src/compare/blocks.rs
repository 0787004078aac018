//! Runs each block on measured inputs, through the model's own free runs.

use std::borrow::Cow;

use super::block_run::{BlockRun, NoisePath};
use super::body_drive::{BodyDrive, body_inputs, commanded, true_rates};
use super::body_windows::body;
use super::thresholds::THRESHOLDS;
use super::{CompareConfig, CompareError, gyro_block};
use crate::effect::Law;
use crate::log::Dataset;
use crate::log::segments::stretches;
use crate::log::signals::rotor_of;
use crate::model::{Equations, Model, Remembered, RotorInput, RotorStart, RotorTrace};
use crate::screening::{ScreenedLog, readings};
use crate::signal::columns::{self, BATTERY_VOLTAGE, BODY_ANGLE, BODY_RATE};
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
    let is_slow = has_slow_state(model)?;
    // Mostly every reading is scored: nothing to copy.
    let is_left_out = |row: usize| rate[row].is_finite() && !judged.is_scored(row);
    let in_part = judged.stretches().iter().cloned().flatten().any(is_left_out);
    let (mut squares, mut count) = (0.0, 0.0);
    let mut last_end = None;
    for rows in judged.stretches().iter().cloned() {
        let time = &log.time()[rows.clone()];
        let shown = &rate[rows.clone()];
        let of_row = |(row, rate): (usize, &f64)| if judged.is_scored(row) { *rate } else { f64::NAN };
        let measured: Cow<[f64]> =
            if in_part { rows.clone().zip(shown).map(of_row).collect() } else { Cow::Borrowed(shown) };
        let from = judged.data().command_from_beside(equations.command_delay(), &rows);
        let input = RotorInput {
            time,
            command: &command[rows.clone()],
            command_from: from.as_deref(),
            voltage: battery.map(|volts| &volts[rows.clone()]),
            side: side(rotor),
        };
        // Where a fit finds how warm each stretch began, the stretches do not see each other.
        let before = Remembered::at_begin(last_end.take_if(|_| !is_slow), time);
        let rate = shown.first().copied().filter(|rate| rate.is_finite());
        let start = RotorStart { rate, is_first: rows.start == 0, before, ..RotorStart::default() };
        let (modelled, end) = rotor_run(equations, &input, start, &measured, is_slow);
        last_end = time.last().copied().zip(end);
        let (added, over) = one_step_squares(time, (&measured, &modelled), model.actuator.pole);
        (squares, count) = (squares + added, count + over);
        block.add_part(in_part.then_some(&measured), rows, &modelled);
    }
    block.one_step = (count > 0.0).then(|| f64::sqrt(squares / count));
    Ok((count > 0.0).then_some(block))
}

/// Whether a law of a model has a slow state, as heat is.
fn has_slow_state(model: &Model) -> Result<bool, CompareError> {
    let mut is_slow = false;
    for added in &model.effects {
        is_slow |= matches!(model.effect(&added.id)?.law, Law::Memory(memory) if memory.slow);
    }
    Ok(is_slow)
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

/// Rate that the telemetry would show over a stretch, and what the next one remembers of it; of `scored` a slow state is learned.
fn rotor_run(
    equations: &Equations,
    input: &RotorInput,
    mut start: RotorStart,
    scored: &[f64],
    is_slow: bool,
) -> (Vec<f64>, Option<Remembered>) {
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
    (trace.measured, trace.end)
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
    let telemetry = equations.telemetry_inverse(log.median_interval());
    let rate = true_rates(equations, &telemetry, log, readings::bridged(log.time(), rate));
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

#[cfg(test)]
mod tests {
    use super::super::compare;
    use super::*;
    use crate::effect::Site;
    use crate::model::UserEffect;

    /// Commands between the thresholds on both sides of a hole: only what was remembered says which level holds.
    #[test]
    fn a_relay_keeps_its_level_across_a_hole() {
        let time: Vec<f64> = (0..2400).map(|row| 0.01 * f64::from(row)).collect();
        let levels = [0.40, 0.47, 0.44, 0.48, 0.55, 0.45, 0.44, 0.47];
        let command: Vec<f64> = (0..2400).map(|row| levels[row / 300]).collect();
        for (site, size) in [(Site::SteadyRate, 30.0), (Site::Command, 0.02)] {
            let mut model = Model::paper();
            model.user_effects.push(UserEffect {
                id: "snap".to_owned(),
                site,
                expression: format!("{size}*relay(command-0.46,0.05)"),
                parameters: Vec::new(),
                meaning: String::new(),
            });
            model = model.with(&model.effect("snap").expect("it parses"));
            let input =
                RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
            let mut trace = RotorTrace::default();
            model.equations().expect("binds").simulate_rotor(&input, &RotorStart::default(), &mut trace);
            let noise = |row: usize| ((row * 37 % 11) as f64 - 5.0) * 0.2;
            // Rows are missing within each level.
            let kept = |row: &usize| !(150..170).contains(&(row % 300));
            let only = |value: &dyn Fn(usize) -> f64| (0..2400).filter(kept).map(value).collect::<Vec<f64>>();
            let log = Dataset::made(
                only(&|row| time[row]),
                [
                    ("command_1", only(&|row| command[row])),
                    ("propeller_rate_1_rad_s", only(&|row| trace.rate[row] + noise(row))),
                ],
            );
            let found = compare(&[model], &log.into(), &CompareConfig::default()).expect("a rotor");
            let residual = found[0].blocks[0].trace.residual();
            let rms = (residual.iter().map(|it| it * it).sum::<f64>() / residual.len() as f64).sqrt();
            assert!(rms < 1.5, "{site:?}: {rms} rad/s, of a noise of 0.6");
        }
    }
}
