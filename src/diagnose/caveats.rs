//! What is said beside the answer.

use super::block_data::{BlockData, Runs};
use super::curve_caveat::shift_is_curve;
use super::directions::Directions;
use super::model_selection::ran_off;
use super::refusal::EffectRefusal;
use super::rest_of_body::rest_follows;
use super::rotor_block::rotor_runs;
use super::search_result::SearchResult;
use super::thresholds::THRESHOLDS;
use super::unknown_size::size;
use super::verdict::{fails_in_training_only, turns_against_torque};
use crate::effect::{Law, Site, Term, acting_as, find};
use crate::estimation::moments::{mean_square, squares_about_mean};
use crate::estimation::slope::slope;
use crate::model::Model;
use crate::screening::checks::rate_is_angle_difference::RATE_OF_ANGLE;
use crate::screening::summary::LogSummary;
use crate::screening::{Finding, ScreenedBody, ScreenedLog};
use crate::signal::columns;

/// What the logs are found to hold, what is not compared, what stays unexplained.
pub(crate) fn warnings(logs: &[ScreenedLog], blocks: &[SearchResult]) -> Vec<Finding> {
    let mut warnings: Vec<Finding> = Vec::new();
    for log in logs {
        warnings.extend(LogSummary::of(log).findings);
    }
    if blocks.iter().all(|found| found.split.train.is_rotor()) && logs.iter().any(has_free_body) {
        warnings.push(Finding::new("body_not_compared", "body"));
    }
    for found in blocks {
        warnings.extend(found.split.insufficient_data().and_then(insufficient));
        warnings.extend(of_other_bench(found));
        warnings.extend(found.split.is_at_rest().then(|| Finding::new("no_transients", "rotors")));
        warnings.extend(one_direction(logs, found));
        warnings.extend(delay_or_late_reading(logs, blocks, found));
        let (over, channel) = found.over_floor(&found.answer);
        if over > found.at_floor() {
            let name = found.split.train.channels()[channel].name;
            warnings.push(Finding::new("error_above_floor", name).with("times_floor", over));
            warnings.extend(slow_drift(logs, found));
            warnings.extend(battery_or_time(logs, found));
        }
        warnings.extend(
            rest_follows(found, &found.answer)
                .map(|rest| Finding::new("rest_follows_body", rest.channel).with("share", rest.share)),
        );
        if turns_against_torque(found) {
            let is_of_angle = |log: &ScreenedLog| log.body().is_some_and(|body| body.has(RATE_OF_ANGLE));
            let of_angle = usize::from(logs.iter().any(is_of_angle));
            warnings.push(Finding::new("turns_against_torque", "body").with("rate_of_angle", of_angle));
        }
        warnings.extend(shift_is_curve(found));
        warnings.extend(at_bounds(found));
        warnings.extend(of_numbers(found));
        warnings.extend(found.unnamed_effects());
        warnings.extend(only_in_training(found));
        warnings.extend(rotors_differ(logs, found));
    }
    warnings
}

/// Which numbers of a block were kept as they are, and which are hardly known.
pub(crate) fn of_numbers(found: &SearchResult) -> Vec<Finding> {
    let held = found.split.holds_levels.then(|| Finding::new("levels_held", "rotors"));
    held.into_iter().chain(not_known(&found.answer.model, &found.answer.effects)).collect()
}

/// Logs that are held out, all of them or in parts, and that the base's own numbers were identified from.
pub(crate) fn seen_by_base(model: &Model, train: &[ScreenedLog], validate: &[ScreenedLog]) -> Vec<Finding> {
    let held_out = if validate.is_empty() { train } else { validate };
    let saw = |log: &&ScreenedLog| {
        let (raw, time) = (log.raw(), log.raw().time());
        let (Some(first), Some(last)) = (time.first(), time.last()) else { return false };
        model.identified_from.iter().any(|seen| {
            !seen.sha256.is_empty()
                && seen.sha256 == raw.sha256()
                && *first < seen.to_s
                && seen.from_s < *last
        })
    };
    held_out
        .iter()
        .filter(saw)
        .map(|log| Finding::new("base_saw_held_out", "").of(log.source_name()))
        .collect()
}

/// A model that is so far off that it cannot be this bench's. Of rotors only: an unstable body departs from any model.
fn of_other_bench(found: &SearchResult) -> Option<Finding> {
    let data = &found.split.validate;
    let Runs::Rotor(runs) = &data.runs else { return None };
    let error = found.nominal.channel_error(&found.split, 0, true);
    let measured = runs.iter().flat_map(|run| &run.measured).copied().filter(|rate| rate.is_finite());
    let rates: Vec<f64> = measured.collect();
    let (spread, size) = (data.spread(0), mean_square(&rates).sqrt());
    (error > spread && error > THRESHOLDS.foreign_error * size).then(|| {
        Finding::new("model_of_other_bench", "rotors").with("error_rad_s", error).with("spread_rad_s", spread)
    })
}

/// Transients that nearly all go one way.
fn one_direction(logs: &[ScreenedLog], found: &SearchResult) -> Option<Finding> {
    if !found.split.train.is_rotor() {
        return None;
    }
    let ways = Directions::of(&rotor_runs(logs), found.nominal.model.actuator.pole);
    ways.is_one_way().then(|| {
        let finding = Finding::new("one_direction_only", "rotors");
        finding.with("rising_rows", ways.rising).with("falling_rows", ways.falling)
    })
}

/// A delay from a rotor's command to its reading, where neither a load cell nor the body says whether the rotor is late or what is read
/// of it.
fn delay_or_late_reading(
    logs: &[ScreenedLog],
    blocks: &[SearchResult],
    found: &SearchResult,
) -> Option<Finding> {
    let delay = acting_as(Site::Command, Term::DeadTime)?;
    let is_delayed = found.answer.model.effects.iter().any(|effect| effect.id == delay.id);
    let asks_rotors_alone = blocks.iter().all(|block| block.split.train.is_rotor());
    let is_told = logs.iter().any(|log| !log.thrusts().is_empty());
    (is_delayed && asks_rotors_alone && !is_told).then(|| Finding::new("delay_or_late_reading", delay.id))
}

/// The finding for data that cannot tell anything.
fn insufficient(why: EffectRefusal) -> Option<Finding> {
    Some(match why {
        // Said of each rotor.
        EffectRefusal::ReadingsTooSeldom { .. } => return None,
        EffectRefusal::TooFewSamples { samples, needed } => {
            Finding::new("too_few_samples", "").with("samples", samples).with("samples_needed", needed)
        }
        EffectRefusal::TorqueNotExciting => Finding::new("not_exciting", "torque"),
        // A finding of the logs.
        EffectRefusal::BodyHeldStill => return None,
        _ => Finding::new("not_exciting", "commands"),
    })
}

/// Whether a log has a body that was not held still.
fn has_free_body(log: &ScreenedLog) -> bool {
    log.raw().has(columns::BODY_RATE) && !log.body().is_some_and(ScreenedBody::is_held)
}

/// Parameters of the answer's effects that a fit would have taken further than their cards let them: such a number is no measurement.
fn at_bounds(found: &SearchResult) -> Vec<Finding> {
    let of_effect = |id: &String| {
        let parameters = find(id).map_or(&[][..], |card| card.parameters);
        let at_bound = parameters.iter().filter_map(|parameter| {
            let name = format!("{id}.{}", parameter.name);
            let value = found.answer.model.parameter(&name)?;
            let is = |bound: f64| {
                (value - bound).abs() <= 1e-6 * bound.abs() && bound != parameter.neutral && bound != 0.0
            };
            let is_free = found.answer.names.contains(&name);
            (is_free && (is(parameter.lower) || is(parameter.upper))).then_some((name, value))
        });
        at_bound.collect::<Vec<_>>()
    };
    let own = ran_off(&found.answer, &found.nominal.model).into_iter();
    let own = own.filter_map(|name| Some((name.to_owned(), found.answer.model.parameter(name)?)));
    let all = own.chain(found.answer.effects.iter().flat_map(of_effect));
    all.map(|(name, value)| Finding::new("parameter_at_bound", name).with("value", value)).collect()
}

/// Numbers of the answer's effects whose stated error reaches what stands for no effect, or half of a number that has none: that the
/// effect is there, the error that it takes off says; how large it is, nobody knows.
fn not_known(model: &Model, effects: &[String]) -> Vec<Finding> {
    let of_effect = |id: &String| {
        let parameters = find(id).map_or(&[][..], |card| card.parameters);
        let known_badly = parameters.iter().filter_map(|parameter| {
            let found = size(model, id, parameter).filter(|found| !found.is_known)?;
            let finding = Finding::new("parameter_not_known", format!("{id}.{}", parameter.name));
            Some(finding.with("value", found.value).with("standard_error", found.standard_error))
        });
        known_badly.collect::<Vec<_>>()
    };
    effects.iter().flat_map(of_effect).collect()
}

/// A rotor's rate that drifts with time, whatever the command: heat that makes it faster, or a battery that gives way upwards,
/// no physics explains, and a catalogue with such laws would only name it wrongly.
fn slow_drift(logs: &[ScreenedLog], found: &SearchResult) -> Option<Finding> {
    let Runs::Rotor(runs) = &found.split.train.runs else { return None };
    let sigma = found.split.train.sigma[0];
    let residuals = found.answer.fit.residuals.all();
    let mut whose: Vec<(usize, usize)> = runs.iter().map(|run| (run.log, run.rotor)).collect();
    whose.sort_unstable();
    whose.dedup();
    let (mut explained, mut total, mut steepest) = (0.0, 0.0, (0.0_f64, 0));
    for who in whose {
        let of = runs.iter().zip(found.split.train.units()).filter(|(run, _)| (run.log, run.rotor) == who);
        let (time, left): (Vec<f64>, Vec<f64>) = of
            .flat_map(|(run, unit)| run.time.iter().zip(&residuals[unit.clone()]))
            .filter(|(_, residual)| **residual != 0.0)
            .map(|(time, residual)| (*time, residual * sigma))
            .unzip();
        let (slope, spread) = slope(&time, &left);
        total += left.iter().map(|residual| residual * residual).sum::<f64>();
        explained += slope * slope * spread;
        steepest = if slope.abs() > steepest.0.abs() { (slope, who.0) } else { steepest };
    }
    let share = if total > 0.0 { explained / total } else { 0.0 };
    let log = logs.get(steepest.1).map_or("", |log| log.source_name());
    (share >= THRESHOLDS.drift_share).then(|| {
        Finding::new("slow_drift", "rotors")
            .of(log)
            .with("rad_s_each_second", steepest.0)
            .with("share", share)
    })
}

/// A battery, or heat, that is taken for what is missing in part, where the battery falls steadily with the time of every log: what
/// comes with the one comes with the other, and with any drift.
fn battery_or_time(logs: &[ScreenedLog], found: &SearchResult) -> Option<Finding> {
    let is_slow = |id: &&String| {
        let reads = |card: &crate::effect::Card| card.needs.contains(&columns::BATTERY_VOLTAGE);
        let heats = |card: &crate::effect::Card| matches!(card.law, Law::Memory(memory) if memory.slow);
        find(id).is_some_and(|card| card.site.is_rotor() && (reads(card) || heats(card)))
    };
    let gain = found.changed.iter().find(|name| *name == "voltage_gain");
    let subject = found.answer.effects.iter().find(is_slow).or(gain)?;
    let (mut time, mut volts) = (Vec::new(), Vec::new());
    for log in logs.iter().map(ScreenedLog::dataset) {
        let read = log.column(columns::BATTERY_VOLTAGE)?.iter().zip(log.time());
        for (value, at) in read.filter(|(value, _)| value.is_finite()) {
            time.push(at - log.time()[0]);
            volts.push(*value);
        }
    }
    let (slope, spread) = slope(&time, &volts);
    let (_, all) = squares_about_mean(volts.iter().copied());
    let share = if all > 0.0 { slope * slope * spread / all } else { 0.0 };
    (share >= THRESHOLDS.battery_with_time).then(|| {
        let finding = Finding::new("battery_or_time", subject.as_str()).with("logs", logs.len());
        finding.with("share", share).with("v_each_minute", 60.0 * slope)
    })
}

/// What the logs fitted on show and the held-out ones do not: no effect can be validated by it.
fn only_in_training(found: &SearchResult) -> Option<Finding> {
    let (channel, [fitted, held_out]) = fails_in_training_only(found)?;
    let name = found.split.train.channels()[channel].name;
    Some(
        Finding::new("only_in_training", name)
            .with("times_floor", fitted)
            .with("held_out_times_floor", held_out),
    )
}

/// Rotors, or logs, that turn faster than others at the same commands: the model has one law for all, and no effect of its
/// catalogue is a rotor of another make.
fn rotors_differ(logs: &[ScreenedLog], found: &SearchResult) -> Option<Finding> {
    let Runs::Rotor(_) = &found.split.train.runs else { return None };
    let over = found.answer.channel_error(&found.split, 0, false) / found.floors[0];
    if over <= THRESHOLDS.plain_error {
        return None;
    }
    let levels = levels(&found.split.train, &found.answer.fit.residuals.all());
    let slowest = levels.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let fastest = levels.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let apart = fastest.1 - slowest.1;
    let errors = fastest.2.hypot(slowest.2);
    if apart <= THRESHOLDS.rotors_differ || apart <= THRESHOLDS.rotors_differ_errors * errors {
        return None;
    }
    let source = |log: usize| logs.get(log).map_or("", |log| log.source_name());
    let ((fast_log, fast), (slow_log, slow)) = (fastest.0, slowest.0);
    Some(
        Finding::new("rotors_differ", "rotors")
            .with("faster_rotor", fast + 1)
            .with("faster_log", source(fast_log))
            .with("slower_rotor", slow + 1)
            .with("slower_log", source(slow_log))
            .with("share", apart),
    )
}

/// Of each rotor of each log the share of its rate that the model lacks, and its standard error.
fn levels(data: &BlockData, residuals: &[f64]) -> Vec<((usize, usize), f64, f64)> {
    let Runs::Rotor(runs) = &data.runs else { return Vec::new() };
    let mut whose: Vec<(usize, usize)> = runs.iter().map(|run| (run.log, run.rotor)).collect();
    whose.sort_unstable();
    whose.dedup();
    let level = |who: (usize, usize)| {
        let (mut cross, mut power, mut error, mut count) = (0.0, 0.0, 0.0, 0.0);
        for (run, unit) in runs.iter().zip(data.units()).filter(|(run, _)| (run.log, run.rotor) == who) {
            let pairs = run.measured.iter().zip(&residuals[unit.clone()]);
            for (measured, residual) in pairs.filter(|(_, residual)| **residual != 0.0) {
                let lacks = residual * data.sigma[0];
                let modelled = measured - lacks;
                cross += lacks * modelled;
                power += modelled * modelled;
                error += lacks * lacks;
                count += 1.0;
            }
        }
        let independent = (count / THRESHOLDS.correlated_samples).max(1.0);
        (power > 0.0).then(|| (who, cross / power, (error / power / independent).sqrt()))
    };
    whose.into_iter().filter_map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::model::SeenRows;

    #[test]
    fn numbers_within_two_standard_errors_of_no_effect_are_said() {
        let known = Model::paper().known_effects().expect("the catalogue");
        let said = |id: &str, numbers: &[(&str, f64, f64)]| -> Vec<String> {
            let mut model = Model::paper().with(known.iter().find(|effect| effect.id == id).expect("known"));
            for (name, value, error) in numbers {
                let name = format!("{id}.{name}");
                model.set_parameter(&name, *value);
                model.standard_errors.insert(name, *error);
            }
            not_known(&model, &[id.to_owned()]).into_iter().map(|finding| finding.subject).collect()
        };
        let heat = |gain: f64, time: f64| {
            said("motor_heating", &[("gain", 0.02, gain), ("time_constant", 30.0, time)])
        };
        assert_eq!(heat(0.009, 14.0), Vec::<String>::new());
        assert_eq!(heat(0.011, 14.0), ["motor_heating.gain"]);
        assert_eq!(heat(0.009, 16.0), ["motor_heating.time_constant"]);
        // A scale is away from one, a pole from the infinitely fast one by its time, an angle from nowhere.
        assert_eq!(said("gyro_scale", &[("scale", 1.03, 0.02)]), ["gyro_scale.scale"]);
        assert_eq!(said("rotor_lag", &[("pole", 50.0, 24.0)]), Vec::<String>::new());
        assert_eq!(said("rotor_lag", &[("pole", 50.0, 26.0)]), ["rotor_lag.pole"]);
        let pendulum = [("moment", 0.4, 0.01), ("angle_offset", 0.0, 0.1)];
        assert_eq!(said("gravity_pendulum", &pendulum), Vec::<String>::new());
    }

    #[test]
    fn rows_that_a_model_was_identified_from_are_found_where_they_are_held_out() {
        let log = |hash: &str, from: f64| {
            let time = (0..100).map(|row| from + 0.01 * f64::from(row)).collect();
            ScreenedLog::from(Dataset::new("a.csv", hash, time).expect("time rises"))
        };
        let mut model = Model::paper();
        let seen = |sha256: &str| SeenRows {
            file: "a.csv".to_owned(),
            sha256: sha256.to_owned(),
            from_s: 0.0,
            to_s: 1.0,
        };
        model.identified_from = vec![seen("1"), seen("")];
        let found =
            |train: &[ScreenedLog], validate: &[ScreenedLog]| seen_by_base(&model, train, validate).len();
        assert_eq!(found(&[log("1", 0.0)], &[]), 1, "in thirds");
        assert_eq!(found(&[log("1", 0.0)], &[log("2", 0.0)]), 0, "another log is held out");
        assert_eq!(found(&[log("2", 0.0)], &[log("1", 0.5)]), 1, "the other way round, in part");
        assert_eq!(found(&[log("1", 2.0)], &[]), 0, "another part of it");
        assert_eq!(found(&[log("", 0.0)], &[]), 0, "no file");
    }
}
