//! How far rotors were from a model: what a guard that holds them against it may allow.

use serde::{Deserialize, Serialize};

/// What was left between the measured rates of a model's own logs and its free run.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RotorError {
    /// [rad/s] rms of it, noise of the readings included.
    pub rms: f64,
    /// [rad/s] the largest of it.
    pub largest: f64,
    /// Readings that were held against it.
    pub samples: usize,
    /// [-] lowest command that a rotor of those logs turned at.
    pub lowest_command: f64,
    /// [-] highest one.
    pub highest_command: f64,
}

impl RotorError {
    /// [rad/s] the scale of a normal distribution whose tails are as long: the rms, or more where the largest error is larger than
    /// as many readings have by chance (the expected maximum of n normal numbers is below sqrt(2 ln 2n), of both signs).
    #[must_use]
    pub fn scale(&self) -> f64 {
        let readings = (2.0 * self.samples as f64).max(2.0);
        self.rms.max(self.largest / (2.0 * readings.ln()).sqrt())
    }

    /// Whether its numbers can be such.
    pub(super) fn is_sound(&self) -> bool {
        let Self { rms, largest, samples, lowest_command, highest_command } = *self;
        let is_range = 0.0 <= lowest_command && lowest_command <= highest_command && highest_command <= 1.0;
        rms > 0.0 && rms.is_finite() && largest >= rms && largest.is_finite() && samples > 0 && is_range
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_tail_widens_the_scale_and_a_short_one_does_not() {
        let of = |largest| RotorError {
            rms: 2.0,
            largest,
            samples: 5000,
            lowest_command: 0.2,
            highest_command: 0.6,
        };
        assert_eq!(of(8.0).scale(), 2.0, "four rms of 5000 readings are ordinary");
        // sqrt(2 ln 10000) = 4.292
        assert!((of(30.0).scale() - 30.0 / 4.2919).abs() < 1e-3);
        assert!(of(8.0).is_sound() && !of(1.0).is_sound() && !of(f64::INFINITY).is_sound());
    }
}
