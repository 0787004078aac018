//! Commands that excite: constant levels, slow ramps, steps, PRBS, chirp, on one rotor or on both.
//!
//! An [`Experiment`] is a function of the slot number alone. It runs open loop (controller code 3), or its
//! differential part is added to a closed loop. Before it starts it is held against the guard's limits: an
//! experiment that the guard would clip identifies the guard, not the rotor.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use self::thresholds::THRESHOLDS;
use crate::guard::Limits;
use crate::signal::ROTORS;

mod error;
mod limit;
mod prbs;
pub mod thresholds;

pub use error::ExperimentError;
pub use limit::LimitError;
#[doc(hidden)]
pub use limit::LimitError as Refusal;

/// What the command does over time.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", deny_unknown_fields)]
pub enum Waveform {
    /// Levels, one after another. [LPC16] section III.A, Eq. (3).
    Constant {
        /// [-] commands.
        levels: Vec<f64>,
        /// [s] at each.
        hold_s: f64,
    },
    /// Slow ramps up and down. [LPC16] section III.A, Eq. (8).
    Ramp {
        /// [-] lowest command.
        low: f64,
        /// [-] highest command.
        high: f64,
        /// [1/s] slope; slow against the rotor's pole.
        slope: f64,
        /// Times up and down.
        cycles: u32,
    },
    /// Up- and down-steps of several sizes around the operating point, in a fixed pattern.
    Steps {
        /// [-] largest step from the operating point.
        amplitude: f64,
        /// [s] at each level.
        hold_s: f64,
        /// Number of steps.
        count: u32,
    },
    /// Pseudo-random binary sequence of maximum length. [LPC16] section III.B.
    Prbs {
        /// [-] distance of both levels from the operating point.
        amplitude: f64,
        /// [Hz] up to which the power is flat within 3 dB; 0 = as high as the period allows.
        bandwidth_hz: f64,
        /// [s]
        duration_s: f64,
        /// Chooses where in its period the sequence begins.
        seed: u64,
    },
    /// A sine whose frequency rises exponentially.
    Chirp {
        /// [-]
        amplitude: f64,
        /// [Hz] at the start.
        from_hz: f64,
        /// [Hz] at the end.
        to_hz: f64,
        /// [s]
        duration_s: f64,
    },
}

/// Which rotors take part.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rotors {
    /// Rotor 1; the other one stands.
    #[default]
    One,
    /// Rotor 2; the other one stands.
    Two,
    /// Both the same.
    Both,
    /// Rotor 1 up when rotor 2 goes down: torque.
    Differential,
}

/// What people write.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExperimentConfig {
    /// What the command does.
    pub shape: Waveform,
    /// Which rotors take part.
    pub rotors: Rotors,
    /// [-] operating point.
    pub around: f64,
    /// [s] from standstill to the first command: a ramp over the first half, then waiting for the transient to go.
    pub lead_in_s: f64,
}

/// An experiment as built: a command for each slot.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    config: ExperimentConfig,
    period_s: f64,
    lead_in: u64,
    slots: u64,
    /// One whole period of the PRBS; empty for other shapes.
    chips: Vec<i8>,
    /// Slots that one chip lasts.
    chip_slots: u64,
}

/// A chip held for T has its power within 3 dB up to 0.443 / T: sinc²(0.443) = 1/2.
const FLAT_SHARE: f64 = 0.443;

impl ExperimentConfig {
    /// Checks the settings and builds the experiment for a control period of `period_s`.
    ///
    /// # Errors
    /// [`ExperimentError`] naming the setting that cannot be.
    pub fn build(&self, period_s: f64) -> Result<Experiment, ExperimentError> {
        range("period_s", period_s, 1e-4, 1.0)?;
        range("around", self.around, 0.0, 1.0)?;
        range("lead_in_s", self.lead_in_s, 0.0, THRESHOLDS.longest_lead_in_s)?;
        let duration = self.shape.check(period_s)?;
        let mut experiment = Experiment {
            config: self.clone(),
            period_s,
            lead_in: (self.lead_in_s / period_s).ceil() as u64,
            slots: (duration / period_s).round().max(1.0) as u64,
            chips: Vec::new(),
            chip_slots: 1,
        };
        if let Waveform::Prbs { bandwidth_hz, seed, .. } = self.shape {
            if bandwidth_hz > 0.0 {
                experiment.chip_slots = (FLAT_SHARE / (bandwidth_hz * period_s)).floor().max(1.0) as u64;
            }
            let needed = experiment.slots.div_ceil(experiment.chip_slots);
            if needed > prbs::LONGEST {
                return Err(ExperimentError::TooLong { needed, longest: prbs::LONGEST });
            }
            experiment.chips = prbs::maximum_length_sequence(needed, seed);
        }
        experiment.check_commands()?;
        Ok(experiment)
    }
}

fn range(name: &'static str, value: f64, low: f64, high: f64) -> Result<(), ExperimentError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ExperimentError::Range { name, value, low, high })
}

impl Waveform {
    /// [s] Duration; every setting checked on the way.
    fn check(&self, period_s: f64) -> Result<f64, ExperimentError> {
        let nyquist = 0.5 / period_s;
        match self {
            Self::Constant { levels, hold_s } => {
                range("levels (how many)", levels.len() as f64, 1.0, 1000.0)?;
                range("hold_s", *hold_s, period_s, THRESHOLDS.longest_s)?;
                Ok(levels.len() as f64 * hold_s)
            }
            Self::Ramp { low, high, slope, cycles } => {
                range("high", *high, 0.0, 1.0)?;
                range("low", *low, 0.0, 1.0)?;
                if low > high {
                    return Err(ExperimentError::Upside { low: *low, high: *high });
                }
                let fastest = (high - low) / (THRESHOLDS.fewest_ramp_periods * period_s);
                range("slope", *slope, THRESHOLDS.slowest_ramp, fastest)?;
                range("cycles", f64::from(*cycles), 1.0, 1000.0)?;
                Ok(2.0 * (high - low) / slope * f64::from(*cycles))
            }
            Self::Steps { amplitude, hold_s, count } => {
                range("amplitude", *amplitude, THRESHOLDS.least_amplitude, 1.0)?;
                range("hold_s", *hold_s, period_s, THRESHOLDS.longest_s)?;
                // The first level is the operating point itself.
                range("count", f64::from(*count), 2.0, 10_000.0)?;
                Ok(f64::from(*count) * hold_s)
            }
            Self::Prbs { amplitude, bandwidth_hz, duration_s, .. } => {
                range("amplitude", *amplitude, THRESHOLDS.least_amplitude, 1.0)?;
                range("bandwidth_hz", *bandwidth_hz, 0.0, nyquist)?;
                range("duration_s", *duration_s, period_s, THRESHOLDS.longest_s)?;
                Ok(*duration_s)
            }
            Self::Chirp { amplitude, from_hz, to_hz, duration_s } => {
                range("amplitude", *amplitude, THRESHOLDS.least_amplitude, 1.0)?;
                range("from_hz", *from_hz, 1e-4, nyquist)?;
                range("to_hz", *to_hz, *from_hz, nyquist)?;
                range("duration_s", *duration_s, period_s, THRESHOLDS.longest_s)?;
                Ok(*duration_s)
            }
        }
    }
}

impl Experiment {
    /// What it was built from.
    #[must_use]
    pub fn config(&self) -> &ExperimentConfig {
        &self.config
    }

    /// [s]
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Number of slots before the first excited one.
    #[must_use]
    pub fn lead_in(&self) -> u64 {
        self.lead_in
    }

    /// Number of slots, lead-in included.
    #[must_use]
    pub fn slots(&self) -> u64 {
        self.lead_in + self.slots
    }

    /// [-] Commands of both rotors in a slot; after the end, those of the last one.
    #[must_use]
    pub fn command(&self, slot: u64) -> [f64; ROTORS] {
        let deviation = self.deviation(slot);
        let around = self.config.around;
        let ramp = (2.0 * (slot + 1) as f64 / (self.lead_in.max(1)) as f64).min(1.0);
        let level = if slot < self.lead_in { ramp } else { 1.0 };
        match self.config.rotors {
            Rotors::One => [level * (around + deviation), 0.0],
            Rotors::Two => [0.0, level * (around + deviation)],
            Rotors::Both => [level * (around + deviation); ROTORS],
            Rotors::Differential => [level * (around + deviation), level * (around - deviation)],
        }
    }

    /// [-] Distance from the operating point in a slot; during the lead-in that of the first excited slot.
    #[must_use]
    pub fn deviation(&self, slot: u64) -> f64 {
        let slot = slot.saturating_sub(self.lead_in).min(self.slots - 1);
        let time = slot as f64 * self.period_s;
        let at = |duration: f64| (time / duration + 1e-9).floor() as usize;
        match &self.config.shape {
            Waveform::Constant { levels, hold_s } => {
                let level = levels.get(at(*hold_s)).or(levels.last());
                level.map_or(0.0, |level| level - self.config.around)
            }
            Waveform::Ramp { low, high, slope, .. } => {
                let half = (high - low) / slope;
                let phase = if half > 0.0 { (time / half) % 2.0 } else { 0.0 };
                let up = if phase < 1.0 { phase } else { 2.0 - phase };
                low + (high - low) * up - self.config.around
            }
            Waveform::Steps { amplitude, hold_s, .. } => {
                const PATTERN: [f64; 12] =
                    [0.0, 1.0, 0.0, -1.0, 1.0, -1.0, 0.5, -0.5, 0.25, -0.25, 0.75, -0.75];
                amplitude * PATTERN[at(*hold_s) % PATTERN.len()]
            }
            Waveform::Prbs { amplitude, .. } => {
                let chip = usize::try_from(slot / self.chip_slots).unwrap_or(usize::MAX);
                amplitude * self.chips.get(chip).copied().map_or(0.0, f64::from)
            }
            Waveform::Chirp { amplitude, from_hz, to_hz, duration_s } => {
                let growth = (to_hz / from_hz).ln();
                let share = time / duration_s;
                let turns = if growth < 1e-9 {
                    from_hz * time
                } else {
                    from_hz * duration_s / growth * ((growth * share).exp() - 1.0)
                };
                amplitude * (TAU * turns).sin()
            }
        }
    }

    /// Refuses what the guard would clip.
    ///
    /// # Errors
    /// [`LimitError`], naming the first limit that is met and where.
    pub fn check(&self, limits: &Limits) -> Result<(), LimitError> {
        // Rounding of slot times must not turn a slope that just fits into one that does not.
        const ROUNDING: f64 = 1e-9;
        let period_s = self.period_s();
        let mut before = [0.0; 2];
        for slot in 0..self.slots() {
            let time_s = slot as f64 * period_s;
            for (index, value) in self.command(slot).into_iter().enumerate() {
                let rotor = index + 1;
                if value > limits.maximum + ROUNDING {
                    let (limit, allowed) = ("rotor_maximum", limits.maximum);
                    return Err(LimitError::Level { limit, allowed, rotor, value, time_s });
                }
                let step = value - before[index];
                let rate = step.abs() / period_s;
                if rate > limits.slew_per_s * (1.0 + ROUNDING) {
                    let (limit, allowed) = ("slew_per_s", limits.slew_per_s);
                    return Err(LimitError::Slew { limit, allowed, rotor, step, rate, period_s, time_s });
                }
                before[index] = value;
            }
        }
        Ok(())
    }

    fn check_commands(&self) -> Result<(), ExperimentError> {
        for slot in 0..self.slots() {
            for (rotor, value) in self.command(slot).into_iter().enumerate() {
                if !(0.0..=1.0).contains(&value) {
                    let time_s = slot as f64 * self.period_s;
                    return Err(ExperimentError::Impossible { rotor: rotor + 1, value, time_s });
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
