//! Rates that move while the command stands still: it is not this command that moved the rotor.

use std::ops::Range;

use nalgebra::DVector;

use crate::estimation::autocorrelation::lag_one_correlation;
use crate::estimation::finite::finite_rows;
use crate::estimation::least_squares;
use crate::estimation::quantile::distinct;
use crate::screening::channel::Judgement;
use crate::screening::excitation::SteadyCommand;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::RotorLog;
use crate::screening::thresholds::THRESHOLDS;

/// Takes out of the score where the command stands still and the rate does not.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    rotor.data.leave_out_unmoved()
}

impl RotorLog {
    fn leave_out_unmoved(&mut self) -> Option<Judgement> {
        let mut left: Vec<usize> = Vec::new();
        let mut shown: Option<(f64, f64, f64)> = None;
        let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
        for (kind, rows) in self.steady() {
            if kind != SteadyCommand::Constant {
                continue;
            }
            let Some((scatter, mean)) = self.scatter(&rows).filter(|it| it.0 > self.finest_step()) else {
                continue;
            };
            if shown.is_none_or(|(most, ..)| scatter > most) {
                shown = Some((scatter, mean, self.command[rows.start]));
            }
            let rows = self.since_change(&rows)..rows.end;
            (first, last) = (first.min(self.time[rows.start]), last.max(self.time[rows.end - 1]));
            for row in rows.clone().filter(|&row| self.rate[row].is_finite()).collect::<Vec<_>>() {
                self.rate[row] = f64::NAN;
                left.push(row);
            }
            self.cut(&rows);
        }
        left.sort_unstable();
        let (scatter, mean, command) = shown?;
        let finding = self.finding("uncommanded_motion").with("command", command);
        let finding = finding.with("scatter_rad_s", scatter).with("mean_rad_s", mean);
        Some(Judgement::new(finding.with("from_s", first).with("to_s", last), left))
    }

    /// [rad/s] the least difference between two readings: a rate on the edge of such a step scatters by up to half of it, and a sensor that
    /// counts by another half.
    fn finest_step(&self) -> f64 {
        let readings = distinct(&self.rate);
        readings.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min)
    }

    /// The first row since which the command is what it is in `rows`: it settles for a while before it counts as steady, but
    /// what froze was frozen meanwhile, too.
    fn since_change(&self, rows: &Range<usize>) -> usize {
        let whole = self.whole();
        let begins = whole.iter().find(|whole| whole.contains(&rows.start)).map_or(rows.start, |it| it.start);
        let command = self.command[rows.start];
        (begins..rows.start)
            .rev()
            .take_while(|&row| self.command[row] == command)
            .last()
            .unwrap_or(rows.start)
    }

    /// [rad/s] scatter of the rate about its smooth course and its mean, where that is too much for a constant command.
    fn scatter(&self, rows: &Range<usize>) -> Option<(f64, f64)> {
        let rows: Vec<usize> = finite_rows(&self.rate, rows.clone());
        if rows.len() < THRESHOLDS.scatter_fewest {
            return None;
        }
        let time: Vec<f64> = rows.iter().map(|&row| self.time[row]).collect();
        let course = least_squares::smooth_course(&time, THRESHOLDS.scatter_course);
        let rate = DVector::from_iterator(rows.len(), rows.iter().map(|&row| self.rate[row]));
        let fit = least_squares::least_squares(&course, &rate)?;
        let share = fit.residual_rms / rate.mean().abs().max(f64::MIN_POSITIVE);
        let is_correlated = lag_one_correlation(fit.residuals.as_slice()) > THRESHOLDS.scatter_lag_one;
        (share > THRESHOLDS.scatter || (share > THRESHOLDS.scatter_correlated && is_correlated))
            .then_some((fit.residual_rms, rate.mean().abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::tests::noise_of;
    use crate::screening::{Finding, ScreenedLog};

    /// Two minutes at 50 Hz; `command` is what the log says, `moved` what the rotor is commanded, from `froze` [s] on.
    fn log(froze: f64, noise: f64) -> Dataset {
        let time: Vec<f64> = (0..6000).map(|row| f64::from(row) * 0.02).collect();
        let binary = |row: usize| if row.wrapping_mul(2_654_435_761) >> 7 & 1 == 1 { 0.5 } else { 0.4 };
        let stands = |row: usize| time[row] >= froze;
        let command = (0..6000).map(|row| if stands(row) { 0.45 } else { binary(row) }).collect();
        let mut rate = 600.0;
        let mut rates = Vec::new();
        for row in 0..6000_usize {
            // Mixed twice: the digits of one product tell of each other, and a controller's command would know of the noise, too.
            let scatter = noise * noise_of(row, 0);
            rates.push(rate + scatter);
            let commanded = if froze.is_finite() || !stands(row) { binary(row) } else { 0.45 };
            rate += 0.27 * (1400.0 * commanded - rate);
        }
        Dataset::made(time, [("command_1", command), ("propeller_rate_1_rad_s", rates)])
    }

    fn rotor(log: &Dataset) -> (RotorLog, Vec<Finding>) {
        let screened = ScreenedLog::of(log);
        let rotor = screened.rotor(1).unwrap();
        (rotor.data().clone(), rotor.findings().cloned().collect())
    }

    #[test]
    fn a_frozen_command_says_so_and_is_left_out() {
        let (whole, warnings) = rotor(&log(0.0, 2.0));
        assert_eq!(whole.scored().count(), 0, "{warnings:?}");
        let is_found = |it: &Finding| it.code == "uncommanded_motion" && it.number("command") == 0.45;
        assert!(warnings.iter().any(is_found), "{warnings:?}");
        let (part, warnings) = rotor(&log(60.0, 2.0));
        // Back to the last change of the command, from which on the log does not say what the rotor was commanded.
        assert!((2995..=3005).contains(&part.scored().count()), "{warnings:?}");
        let span = [warnings[0].number("from_s"), warnings[0].number("to_s")];
        assert!((span[0] - 60.0).abs() < 0.05 && (span[1] - 120.0).abs() < 0.05, "{warnings:?}");
        assert_eq!(part.stretches, vec![0..3000]);
        assert_eq!(rotor(&log(f64::INFINITY, 2.0)).1, [], "commands that move the rotor");
    }

    /// Behind a command that comes back the rotor's state is not known: a stretch of its own begins.
    #[test]
    fn a_command_that_comes_back_begins_a_new_stretch() {
        let (mut log, excited) = (log(60.0, 2.0), log(f64::INFINITY, 2.0));
        let column = |log: &Dataset| log.column("command_1").unwrap().to_vec();
        let (frozen, commanded) = (column(&log), column(&excited));
        let commands = (0..6000).map(|row| if row < 4000 { frozen[row] } else { commanded[row] });
        log.replace("command_1", commands.collect()).unwrap();
        let (part, warnings) = rotor(&log);
        assert_eq!(part.stretches, [0..3000, 4000..6000], "{warnings:?}");
        assert_eq!((warnings[0].code, warnings[0].rows), ("uncommanded_motion", 1000));
        let span = [warnings[0].number("from_s"), warnings[0].number("to_s")];
        assert!((span[0] - 60.0).abs() < 0.05 && (span[1] - 80.0).abs() < 0.05, "{warnings:?}");
    }

    /// A slow rotor whose encoder counts few lines: 9 rad/s in steps of 0.9, that a slow ripple takes over the edge of a step and back.
    #[test]
    fn a_reading_in_coarse_steps_that_scatters_by_one_is_no_motion() {
        let of = |size: f64| {
            let mut calm = log(0.0, 0.0);
            let ripple = |row: usize| size * (0.04 * row as f64).sin() + 0.3 * noise_of(row, 0);
            let rates = (0..6000).map(|row| ((9.0 + ripple(row)) / 0.9).round() * 0.9);
            calm.replace("propeller_rate_1_rad_s", rates.collect()).unwrap();
            rotor(&calm)
        };
        let (calm, warnings) = of(0.5);
        assert_eq!((calm.scored().count(), warnings), (6000, vec![]));
        assert_eq!(of(3.0).1[0].code, "uncommanded_motion", "three steps up and down");
    }

    #[test]
    fn noise_and_drift_under_a_constant_command_are_no_motion() {
        let mut calm = log(0.0, 0.0);
        let wander = |row: usize| {
            // 1 % of white noise, a battery that gives way, and half a percent of slow wandering.
            let noise = f64::from((row.wrapping_mul(2_654_435_761) >> 24 & 255) as u8) / 128.0 - 1.0;
            let time = row as f64 * 0.02;
            600.0 + 10.0 * noise - 0.2 * time + 3.0 * (0.3 * time).sin()
        };
        calm.replace("propeller_rate_1_rad_s", (0..6000).map(wander).collect()).unwrap();
        let (calm, warnings) = rotor(&calm);
        assert_eq!((calm.scored().count(), warnings), (6000, vec![]));
    }
}
