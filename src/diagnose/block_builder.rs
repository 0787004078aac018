//! From logs to blocks: which blocks the logs hold, what is held out, what drives the body.

use std::borrow::Cow;
use std::ops::Range;

use super::block_data::{BlockData, Runs};
use super::body_block::{BodyRun, BodySource};
use super::candidate_fit::CandidateFit;
use super::data_split::DataSplit;
use super::directions::Directions;
use super::gyro_and_angle::{BehindAngle, BiasDrift};
use super::refusal::EffectRefusal;
use super::rotor_block::{RotorRun, rotor_runs, simulate};
use super::thresholds::THRESHOLDS;
use crate::effect::{Law, Site, Term};
use crate::estimation::quantile::distinct;
use crate::estimation::slope::forward_slopes;
use crate::estimation::smoother::{copy_missing, smooth, white};
use crate::log::Cells;
use crate::log::segments::held_throughout;
use crate::log::signals::MOST_ROTORS;
use crate::model::{Effect, Equations, Model, ModelError, RotorInput, RotorStart, RotorTrace};
use crate::screening::channel_noise::ChannelNoise;
use crate::screening::checks::rate_is_angle_difference::RATE_OF_ANGLE;
use crate::screening::{DrivenBy, ScreenedBody, ScreenedLog, readings};
use crate::signal::ROTORS;
use crate::signal::columns;
use crate::threads::both;

/// The rotor block of the logs; `None` when no log has a command beside a rotor rate.
#[must_use]
pub fn rotor_split(train: &[ScreenedLog], validate: &[ScreenedLog]) -> Option<DataSplit> {
    let block = |logs| BlockData::new(Runs::Rotor(rotor_runs(logs)));
    let (train, held_out) = both(|| block(train), || block(validate));
    parted(train, held_out, validate)
}

/// The body block of the logs; `None` when no log has a body rate beside anything that drives it. Logs in which the body was
/// held still have no part in it, unless there are no others.
///
/// # Errors
/// [`ModelError`] when the model holds an unknown effect.
pub fn body_split(
    train: &[ScreenedLog],
    validate: &[ScreenedLog],
    driver: &Driver,
    horizon: f64,
) -> Result<Option<DataSplit>, ModelError> {
    let is_body_held = is_body_held(train);
    let block = |logs: &[ScreenedLog], locals: Option<&CandidateFit>, held_out: bool| {
        let counts = |log: &ScreenedLog| is_body_held || !log.body().is_some_and(ScreenedBody::is_held);
        let logs = logs.iter().enumerate().filter(|(_, log)| counts(log));
        let runs = logs.flat_map(|(log, data)| driver.runs(log, data, locals, held_out, horizon));
        BlockData::new(Runs::Body(runs.collect()))
    };
    let (train_block, validate_block) =
        both(|| block(train, driver.fitted, false), || block(validate, driver.fitted, true));
    let mut split = parted(train_block, validate_block, validate);
    split.iter_mut().for_each(|split| split.is_body_held = is_body_held);
    Ok(split)
}

/// Whether the body was held still in each of the logs that have one.
pub(crate) fn is_body_held(logs: &[ScreenedLog]) -> bool {
    let mut bodies = logs.iter().filter_map(ScreenedLog::body).peekable();
    bodies.peek().is_some() && bodies.all(ScreenedBody::is_held)
}

fn parted(train: BlockData, validate: BlockData, logs: &[ScreenedLog]) -> Option<DataSplit> {
    if train.is_empty() || (!logs.is_empty() && validate.is_empty()) {
        return None;
    }
    Some(DataSplit::new(train, (!logs.is_empty()).then_some(validate)))
}

/// What drives the body: rotor rates as measured, their noise taken out with the help of the rotor model.
pub struct Driver<'a> {
    /// The rotor model as it was found, bound.
    pub equations: &'a Equations,
    /// The rotor block's answer, and its data.
    pub fitted: Option<&'a CandidateFit>,
    /// The rotor block's data.
    pub split: Option<&'a DataSplit>,
}

impl Driver<'_> {
    /// The runs of one log.
    fn runs(
        &self,
        log: usize,
        screened: &ScreenedLog,
        fitted: Option<&CandidateFit>,
        held_out: bool,
        horizon: f64,
    ) -> Vec<BodyRun> {
        let data = screened.dataset();
        let Some((judged, rate)) = screened.body().zip(data.cells(columns::BODY_RATE)) else {
            return Vec::new();
        };
        let driven = |cells: Cells| match judged.driven_rows(&cells) {
            Cow::Owned(driven) => driven.into(),
            Cow::Borrowed(_) => cells,
        };
        let rate: Cells = driven(rate);
        let angle = data.cells(columns::BODY_ANGLE).map(|angle| driven(angle.for_once()));
        let by_rotors = judged.driven_by() != DrivenBy::TorqueCommand;
        let of_rotor = |rotor| self.rotor_rate(log, rotor, screened, fitted, held_out);
        let mut rates: Option<[_; ROTORS]> = by_rotors.then(|| both(|| of_rotor(0), || of_rotor(1)).into());
        // One with a dead time may have been on its way to anything where the log begins.
        let is_modelled = self.fitted.is_some() && by_rotors;
        let mut runs = Vec::new();
        for rows in judged.stretches().iter().cloned() {
            let time = &data.time()[rows.clone()];
            let is_last = judged.stretches().last() == Some(&rows);
            let torque = match &mut rates {
                Some([Some(first), Some(second)]) => {
                    self.torque_of([first.take(&rows, is_last), second.take(&rows, is_last)], time)
                }
                Some(_) => return Vec::new(),
                None => TorqueOver::commanded(&judged.torque()[rows.clone()]),
            };
            let source = BodySource {
                time: data.time_cells().part(rows.clone()),
                torque: torque.mean,
                torque_slope: torque.slope,
                propagated: torque.propagated,
                propeller_rate: torque.rates.map(Cells::into_vec),
                rate: rate.part(rows.clone()),
                angle: angle.as_ref().map(|angle| angle.part(rows.clone())).unwrap_or_default(),
            };
            let unlogged = if is_modelled && rows.start == 0 { THRESHOLDS.unlogged_command_s } else { 0.0 };
            let begin = source.time.first().map_or(0.0, |first| first + self.unknown_s(judged).max(unlogged));
            runs.push(BodyRun::new(log, rows.clone(), source, horizon).since(begin));
        }
        runs.retain(|run| !run.windows.is_empty());
        runs
    }

    /// [s] for which nothing is known where a stretch begins: a rotor that nobody measured is taken as steady there, which it may
    /// not be.
    fn unknown_s(&self, judged: &ScreenedBody) -> f64 {
        match judged.driven_by() {
            DrivenBy::Commands => THRESHOLDS.forgotten_after / self.equations.rotor_pole(),
            _ => 0.0,
        }
    }

    /// The torque of both rotors over a stretch. Of a long one each column is let go of where it has served.
    fn torque_of(&self, [first, second]: [Rates; 2], time: &[f64]) -> TorqueOver {
        let torque = |first: &[f64], second: &[f64]| -> Vec<f64> {
            let pairs = first.iter().zip(second);
            pairs.map(|(first, second)| self.equations.rotor_torque(*first, *second)).collect()
        };
        let slope = forward_slopes(time, &torque(&first.at, &second.at)).into();
        drop((first.at, second.at));
        let mean = torque(&first.mean, &second.mean);
        let noisy = |rates: &[f64], propagated: &[f64], row: usize| rates[row] + propagated[row];
        let torque_with_noise = |row: usize| {
            let rates =
                [noisy(&first.mean, &first.propagated, row), noisy(&second.mean, &second.propagated, row)];
            self.equations.rotor_torque(rates[0], rates[1])
        };
        let propagated = mean.iter().enumerate().map(|(row, quiet)| torque_with_noise(row) - quiet).collect();
        TorqueOver { mean, slope, propagated, rates: [first.mean, second.mean] }
    }

    /// The best guess of a rotor's true rate over a log.
    fn rotor_rate(
        &self,
        log: usize,
        rotor: usize,
        screened: &ScreenedLog,
        fitted: Option<&CandidateFit>,
        held_out: bool,
    ) -> Option<Rates> {
        let data = screened.dataset();
        let measured = data.column(columns::PROPELLER_RATES[rotor]);
        let has_command = data.has(columns::COMMANDS[rotor]);
        match (measured, fitted, self.split) {
            (Some(measured), Some(fitted), Some(split)) if has_command => {
                let mut rates = Rates::between(data.time(), measured);
                for (run, locals) in runs_of(split, fitted, held_out) {
                    if run.log == log && run.rotor == rotor {
                        self.correct_by_measured(run, locals, &mut rates);
                    }
                }
                Some(rates)
            }
            (Some(measured), ..) => Some(Rates::between(data.time(), measured)),
            (None, ..) if has_command => self.simulated(rotor, screened),
            _ => None,
        }
    }

    /// The free run of the rotor model, moved by what the smoothed measurement says it lacks.
    fn correct_by_measured(&self, run: &RotorRun, locals: &[f64], rates: &mut Rates) {
        let mut trace = RotorTrace::default();
        simulate(self.equations, run, None, locals, &mut trace);
        let mut left: Vec<f64> =
            run.measured.iter().zip(&trace.measured).map(|(measured, model)| measured - model).collect();
        // What comes before is not run through.
        left[..run.begins].fill(f64::NAN);
        let noise = ChannelNoise::of(run.measured.iter().copied());
        let (modelled, whole) = (|row: usize| trace.measured[row], 0..left.len());
        let noise = noise.in_residual((&left, &modelled), std::slice::from_ref(&whole), 0.0, 1.0);
        trace.measured = Vec::new();
        let (lacks, propagated) = smooth(&left, &noise);
        drop(left);
        let Rates { at, mean, propagated: noise } = rates;
        let (at, mean, noise) = (&mut at[..], &mut mean[..], &mut noise[..]);
        for (row, lack) in run.rows.clone().zip(&lacks).skip(run.begins) {
            let within = row - run.rows.start;
            let next = lacks.get(within + 1).unwrap_or(lack);
            at[row] = trace.rate[within] + lack;
            mean[row] = trace.mean[within] + 0.5 * (lack + next);
            // Each rotor has noise of its own: the second takes the example backwards.
            let drawn = if run.rotor == 0 { within } else { propagated.len() - 1 - within };
            noise[row] = propagated[drawn];
        }
    }

    /// Without a measurement the rotor model has to do.
    fn simulated(&self, rotor: usize, screened: &ScreenedLog) -> Option<Rates> {
        let judged = screened.commanded(rotor + 1)?;
        let data = judged.data();
        let still = Cells::from(vec![0.0; data.time.len()]);
        let mut rates = Rates { at: still.clone(), mean: still.clone(), propagated: still };
        let mut trace = RotorTrace::default();
        for rows in judged.stretches().iter().cloned() {
            let input = RotorInput {
                time: &data.time[rows.clone()],
                command: &data.command[rows.clone()],
                command_from: data.command_from(&rows),
                voltage: judged.voltage().map(|voltage| &voltage[rows.clone()]),
                side: if rotor == 0 { 1.0 } else { -1.0 },
            };
            self.equations.simulate_rotor(&input, &RotorStart::default(), &mut trace);
            rates.at[rows.clone()].copy_from_slice(&trace.rate);
            rates.mean[rows].copy_from_slice(&trace.mean);
        }
        Some(rates)
    }
}

/// A torque over a stretch, as a run takes it.
struct TorqueOver {
    /// [N m] over the interval after each sample.
    mean: Vec<f64>,
    /// [N m/s]
    slope: Cells,
    /// [N m] an example of the noise in it.
    propagated: Cells,
    /// [rad/s] means of the rotors' rates; empty where it was logged.
    rates: [Cells; 2],
}

impl TorqueOver {
    /// The torque as it was commanded [N m]: held from row to row, and without noise.
    fn commanded(torque: &[f64]) -> Self {
        let zeros = || Cells::from(vec![0.0; torque.len()]);
        Self { mean: torque.to_vec(), slope: zeros(), propagated: zeros(), rates: Default::default() }
    }
}

/// [rad/s] rates of a rotor: at the samples, their means over the interval after each, and an example of the noise in
/// them.
struct Rates {
    at: Cells,
    mean: Cells,
    propagated: Cells,
}

impl Rates {
    /// Straight lines between the samples at `time` [s].
    fn between(time: &[f64], measured: &[f64]) -> Self {
        let lines = |values: &[f64]| held_throughout(&readings::carried(time, values));
        let at = lines(measured);
        let pairs = at.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let whole = 0..measured.len();
        let size = ChannelNoise::of(measured.iter().copied()).white_in_residual(
            measured,
            std::slice::from_ref(&whole),
            1.0,
        );
        let mut propagated = white(at.len(), size);
        copy_missing(&mut propagated, measured);
        Self {
            mean: pairs.chain(at.last().copied()).collect(),
            propagated: lines(&propagated).into(),
            at: at.into(),
        }
    }

    /// Those of a stretch, of which the last one takes all that is left.
    fn take(&mut self, rows: &Range<usize>, is_last: bool) -> Self {
        let take = |values: &mut Cells| {
            let own = values.part(rows.clone());
            if is_last {
                *values = Cells::default();
            }
            own
        };
        Self { at: take(&mut self.at), mean: take(&mut self.mean), propagated: take(&mut self.propagated) }
    }
}

/// The runs of a part of a rotor split, each with its local start.
fn runs_of<'a>(
    split: &'a DataSplit,
    fitted: &'a CandidateFit,
    held_out: bool,
) -> impl Iterator<Item = (&'a RotorRun, &'a [f64])> {
    let (data, fit) =
        if held_out { (&split.validate, &fitted.held_out) } else { (&split.train, &fitted.fit) };
    let runs = match &data.runs {
        Runs::Rotor(runs) => runs.as_slice(),
        Runs::Body(_) => &[],
    };
    let locals = fit.locals.len() / runs.len().max(1);
    runs.iter()
        .enumerate()
        .map(move |(index, run)| (run, fit.locals.get(index * locals..(index + 1) * locals).unwrap_or(&[])))
}

fn different_commands(log: &ScreenedLog) -> usize {
    let log = log.dataset();
    let commands = (1..=MOST_ROTORS).filter_map(|rotor| log.column(&columns::command(rotor)));
    commands.map(|commands| distinct(commands).len()).max().unwrap_or(0)
}

/// The effects that act in a block, and why these logs cannot show one.
pub(crate) fn eligible<'a>(
    (known, model): (&'a [Effect], &Model),
    split: &DataSplit,
    logs: &[ScreenedLog],
) -> Vec<(&'a Effect, Option<EffectRefusal>)> {
    let too_little = split.insufficient_data();
    let why = |effect: &Effect| refusal(effect, model, logs).or_else(|| too_little.clone());
    known.iter().filter(|effect| split.holds(effect)).map(|effect| (effect, why(effect))).collect()
}

/// Why an effect is not tried, or `None` when it can.
#[must_use]
pub fn refusal(effect: &Effect, model: &Model, logs: &[ScreenedLog]) -> Option<EffectRefusal> {
    if model.has(&effect.id) {
        return Some(EffectRefusal::InModel);
    }
    let term = effect.card.and_then(|card| card.acts_as);
    if term == Some(Term::VoltageDrop) && model.actuator.voltage_gain != 0.0 {
        return Some(EffectRefusal::InModelAs { parameter: "voltage_gain" });
    }
    // c3 (u - u0)³ is a polynomial of degree three: the model's own coefficients reach all of it.
    if term == Some(Term::Cubic) && model.actuator.steady_rate.len() > 3 {
        return Some(EffectRefusal::CubicInCurve);
    }
    // Where few levels are held, a grid is an offset of each of them at will.
    if effect.is_grid() {
        let (commands, needed) =
            (logs.iter().map(different_commands).min().unwrap_or(0), THRESHOLDS.fewest_commands_for_grid);
        if commands < needed {
            return Some(EffectRefusal::TooFewCommands { commands, needed });
        }
    }
    let lacking = effect.needs.iter().find_map(|need| {
        let there = |log: &ScreenedLog| {
            let any = |name: String| log.dataset().has(&name);
            if need.contains('*') {
                (1..=MOST_ROTORS).any(|rotor| any(need.replace('*', &rotor.to_string())))
            } else {
                any(need.clone())
            }
        };
        // A torque command stands in for rotor rates only where the law does not look at them.
        (!logs.iter().all(there)).then(|| EffectRefusal::ColumnLacking { column: need.clone() })
    });
    lacking.or_else(|| refused_by_gyro(effect, logs)).or_else(|| refused_by_ways(effect, model, logs))
}

/// Why the gyro cannot show an effect of its own.
fn refused_by_gyro(effect: &Effect, logs: &[ScreenedLog]) -> Option<EffectRefusal> {
    if effect.site != Site::BodyRateSensor {
        return None;
    }
    let is_made = |log: &ScreenedLog| log.body().is_some_and(|body| body.has(RATE_OF_ANGLE));
    if effect.card.is_some() && logs.iter().any(is_made) {
        return Some(EffectRefusal::RateOfAngle);
    }
    if matches!(effect.law, Law::Memory(_)) {
        let shown = BehindAngle::of(logs).filter(|shown| shown.is_none())?;
        let (lag_ms, error_ms) = (1e3 * shown.lag, 1e3 * shown.error);
        return Some(EffectRefusal::AngleShowsNoLag { lag_ms, error_ms });
    }
    let is_constant = effect.card.and_then(|card| card.acts_as) == Some(Term::Constant);
    let drift = is_constant.then(|| logs.iter().find_map(BiasDrift::of)).flatten()?;
    Some(EffectRefusal::BiasDrifts { least_rad_s: drift.least, most_rad_s: drift.most })
}

/// Why the rows on their way to a new level cannot show an effect.
fn refused_by_ways(effect: &Effect, model: &Model, logs: &[ScreenedLog]) -> Option<EffectRefusal> {
    let card = effect.card.filter(|card| card.needs_both_directions || card.needs_transients)?;
    let ways = Directions::of(&rotor_runs(logs), model.actuator.pole);
    if card.needs_transients && ways.are_at_rest() {
        let (moving, needed) = (ways.moving, THRESHOLDS.fewest_moving_rows);
        return Some(EffectRefusal::NoTransients { moving, needed });
    }
    (card.needs_both_directions && ways.is_one_way())
        .then_some(EffectRefusal::OneDirection { rising: ways.rising, falling: ways.falling })
}

#[cfg(test)]
mod tests {
    use super::super::tests::noise;
    use super::*;
    use crate::log::Dataset;
    use crate::screening::tests::log_with_hole;

    #[test]
    fn a_grid_is_not_looked_for_in_few_levels() {
        let grid = Model::paper().effect("command_quantization").expect("known");
        for (levels, refused) in [(59, true), (60, false)] {
            let time: Vec<f64> = (0..600).map(|row| 0.01 * f64::from(row)).collect();
            let command: Vec<f64> = (0..600).map(|row| 0.3 + 1e-3 * f64::from(row % levels)).collect();
            let rates = command.iter().map(|command| 1300.0 * command).collect();
            let log = Dataset::made(time, [("command_1", command), ("propeller_rate_1_rad_s", rates)]);
            assert_eq!(refusal(&grid, &Model::paper(), &[log.into()]).is_some(), refused, "{levels} levels");
        }
    }

    /// A rotor that comes down while its rows do not count, and does as the model says from then on.
    #[test]
    fn what_comes_before_a_run_begins_drives_the_body_as_it_was_measured() {
        let (begins, rows, model) = (12, 600, Model::paper());
        let mut run = rotor_runs(&[log_with_hole(rows, &[], 900).into()]).remove(0);
        let settled = model.steady_rate(run.command[0]);
        let rate = |row: usize| {
            let above = if row < begins { 60.0 * (begins - row) as f64 } else { 0.0 };
            settled + above + noise(row)
        };
        let measured: Vec<f64> = (0..rows).map(rate).collect();
        (run.begins, run.measured) = (begins, measured.clone().into());
        // As a fit finds it.
        let departure = settled - measured[begins];
        let equations = model.equations().expect("binds");
        let driver = Driver { equations: &equations, fitted: None, split: None };
        let mut rates = Rates::between(&run.time, &measured);
        driver.correct_by_measured(&run, &[departure], &mut rates);
        assert_eq!(rates.at[..begins], measured[..begins]);
        // The noise of 1 rad/s rms is smoothed away as if nothing had been before: with what was before in it, more than that is left.
        let off = rates.at[begins..].iter().map(|rate| (rate - settled).powi(2)).sum::<f64>();
        let rms = (off / (rows - begins) as f64).sqrt();
        assert!(rms < 0.2, "{rms}");
    }
}
