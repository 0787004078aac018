//! What is said beside the answer.

use super::block_data::{BlockData, Runs};
use super::search_result::Found;
use super::verdict::{PLAINLY, strays, turns_against_torque};
use crate::log::Dataset;
use crate::screening::Finding;
use crate::screening::summary::LogSummary;

/// Share of the rate, and standard errors, by which rotors must differ to be told as different.
const UNLIKE: (f64, f64) = (3e-3, 5.0);
/// Samples, one in so many, that count as independent ones of an error that no model explains.
const INDEPENDENT: f64 = 20.0;

/// What the logs are found to hold, what is not judged, what stays unexplained.
pub(crate) fn warnings(logs: &[&Dataset], blocks: &[Found]) -> Vec<Finding> {
    let mut warnings: Vec<Finding> = Vec::new();
    for log in logs {
        warnings.extend(LogSummary::of(log).findings);
    }
    if blocks.iter().all(|found| found.stage.train.is_rotor())
        && logs.iter().any(|log| log.column("body_rate_rad_s").is_some())
    {
        warnings.push(
            "the body is not judged: not every set of logs holds its rate, what drives it, and enough of both".into(),
        );
    }
    for found in blocks {
        if let Some(why) = found.stage.too_poor() {
            warnings.push(why.into());
        }
        let (over, channel) = found.over_floor(&found.answer);
        if over > found.at_floor() {
            let name = found.stage.train.channels()[channel].name;
            warnings.push(format!("{name}: the error stays at {over:.2} times the noise floor").into());
        }
        if turns_against_torque(found) {
            warnings.push(
                "the body moves, but not as the torque on it would have it: look whether the gyro's sign is that of the torque, \
                 and whether rotors 1 and 2 are exchanged, before anything else"
                    .into(),
            );
        }
        warnings.extend(only_in_training(found).map(Finding::from));
        warnings.extend(unlike(logs, found).map(Finding::from));
    }
    warnings
}

/// What the logs fitted on show and the held-out ones do not: no effect can be judged by it.
fn only_in_training(found: &Found) -> Option<String> {
    let (channel, [fitted, held_out]) = strays(found)?;
    Some(format!(
        "{}: the error is {fitted:.2} times the noise floor where it was fitted and {held_out:.2} times held out: these logs go \
         where the held-out ones do not, or something happened in them; record more of it, or diagnose all logs without \
         `--validate`",
        found.stage.train.channels()[channel].name,
    ))
}

/// Rotors, or logs, that turn faster than others at the same commands: the model has one law for all, and no effect of its
/// catalogue is a rotor of another make.
fn unlike(logs: &[&Dataset], found: &Found) -> Option<String> {
    let Runs::Rotor(_) = &found.stage.train.runs else { return None };
    let over = found.answer.channel_error(&found.stage, 0, false) / found.floors[0];
    if over <= PLAINLY {
        return None;
    }
    let levels = levels(&found.stage.train, &found.answer.fit.residuals);
    let slowest = levels.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let fastest = levels.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let apart = fastest.1 - slowest.1;
    if apart <= UNLIKE.0 || apart <= UNLIKE.1 * fastest.2.hypot(slowest.2) {
        return None;
    }
    let name = |(log, rotor): (usize, usize)| {
        let source = logs.get(log).map_or("", |log| log.source_name());
        format!("rotor {} of {source}", rotor + 1)
    };
    Some(format!(
        "{} turns {:.1} % faster at the same commands than {}: rotors that are not alike, or a day on which all turned \
         faster, are no effect of the catalogue; identify each by itself (`identify --rotor`), or diagnose the logs apart",
        name(fastest.0),
        100.0 * apart,
        name(slowest.0)
    ))
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
        let independent = (count / INDEPENDENT).max(1.0);
        (power > 0.0).then(|| (who, cross / power, (error / power / independent).sqrt()))
    };
    whose.into_iter().filter_map(level).collect()
}
