//! Rates that come too seldom to show how a rotor follows its commands, as the telemetry of ESCs at a few Hz: between two of them a
//! rotor has settled. Where it settles they show all the same.

use super::rotor_data::RotorLog;
use super::thresholds::THRESHOLDS;
use super::{Finding, ScreenedLog};
use crate::estimation::quantile::median_step;

/// Whether rates that are `interval` [s] apart are too far apart for a rotor with this pole [rad/s].
#[must_use]
pub fn is_too_seldom(interval: f64, pole: f64) -> bool {
    interval * pole > THRESHOLDS.seldom_readings
}

/// [Hz] the least rate of readings that shows how a rotor with this pole [rad/s] follows.
#[must_use]
pub fn rate_needed(pole: f64) -> f64 {
    pole / THRESHOLDS.seldom_readings
}

/// [s] median time between two readings; `None` with fewer than two.
#[must_use]
pub fn reading_interval(time: &[f64], readings: &[f64]) -> Option<f64> {
    let read = time.iter().zip(readings).filter(|(_, reading)| reading.is_finite());
    median_step(read.map(|(time, _)| *time))
}

impl RotorLog {
    /// Says that its rates come too seldom for a rotor with this pole [rad/s], where its own steps do not say that it is a slower one.
    pub(crate) fn too_seldom(&self, pole: f64) -> Option<Finding> {
        let interval = reading_interval(&self.time, &self.rate).filter(|it| is_too_seldom(*it, pole))?;
        let rise = self.rise(interval);
        if rise.pole.is_some_and(|own| !is_too_seldom(interval, own)) {
            return None;
        }
        let found = self.finding("readings_too_seldom").with("rate_hz", interval.recip());
        let found = found.with("steps", rise.steps);
        Some(found.with("needed_hz", rate_needed(pole)).with("pole_rad_s", pole))
    }
}

/// Those of these rotors of the logs whose rates come too seldom for a rotor with this pole [rad/s]. Where the columns themselves cannot be
/// what they are said to be, their time may not either.
pub(crate) fn too_seldom(logs: &[ScreenedLog], rotors: &[usize], pole: f64) -> Vec<Finding> {
    let measured = logs.iter().flat_map(ScreenedLog::rotors).filter(|it| rotors.contains(&it.number()));
    let credible = measured.filter(|rotor| rotor.turns() && !rotor.stops_fits());
    // Of rows that are levels each more than that is said.
    let credible = credible.filter(|rotor| !rotor.data().rows_are_levels());
    credible.filter_map(|rotor| rotor.data().too_seldom(pole)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::log_with_hole;
    use super::*;

    /// Every 20th of rows at 100 Hz: 5 Hz.
    #[test]
    fn telemetry_at_five_hertz_shows_no_rotor_of_sixty_milliseconds() {
        let mut log = log_with_hole(1000, &[200, 400, 600], 2000);
        let rates = log.column("propeller_rate_1_rad_s").expect("measured").to_vec();
        let seldom = |every: usize| -> Vec<f64> {
            rates
                .iter()
                .enumerate()
                .map(|(row, rate)| if row % every == 0 { *rate } else { f64::NAN })
                .collect()
        };
        for (every, is_found) in [(1, false), (15, false), (20, true)] {
            log.replace("propeller_rate_1_rad_s", seldom(every)).expect("fits");
            let found = too_seldom(&[log.clone().into()], &[1], 16.0);
            assert_eq!(found.len(), usize::from(is_found), "every {every}");
            for found in found {
                assert!((found.number("rate_hz") - 5.0).abs() < 1e-9, "{found}");
                assert_eq!(found.number("needed_hz"), 6.4);
            }
        }
    }
}
