//! Tuning: PID gains by margins, and the simplest advice for γ_0, α and α_c.

use std::f64::consts::PI;

use nalgebra::Complex;

use super::{Compensator, DiscreteLoop, LoopPlant, Margins};
use crate::control::thresholds::THRESHOLDS;
use crate::control::{Compensation, ControlError, EmcConfig, PidConfig, PlantParameters};

/// Gains of the PID with this phase margin [rad] and gain margin [-] that rejects constant torques best: of all
/// crossover frequencies the one with the largest k_I. The fastest one would not do: its phase leaves no room for
/// anything but damping, and the angle comes back after minutes.
///
/// # Errors
/// [`ControlError::Unreachable`] when no crossover frequency has both.
pub fn pid_by_margins(
    plant: &PlantParameters,
    loop_plant: &LoopPlant,
    period_s: f64,
    phase_margin: f64,
    gain_margin: f64,
) -> Result<PidConfig, ControlError> {
    let sampled = loop_plant.sampled(period_s)?;
    let nyquist = PI / period_s;
    let at_crossover = |step: i32| {
        let (first, ratio) = THRESHOLDS.crossover_grid;
        let crossover = first * nyquist * ratio.powi(step);
        let z = Complex::from_polar(1.0, crossover * period_s);
        // -C P = e^(i (margin - π)) at the crossover, with -C = k_D + k_P a and a = T/(z-1) (1 + r T/(z-1)).
        let target = Complex::from_polar(1.0, phase_margin - PI) / sampled.response(z);
        let sum = (z - 1.0).inv() * period_s;
        let a = sum * (sum * (THRESHOLDS.integral_share * crossover) + 1.0);
        let k_p = target.im / a.im;
        PidConfig { k_p, k_i: THRESHOLDS.integral_share * crossover * k_p, k_d: target.re - k_p * a.re }
    };
    let mut candidates: Vec<PidConfig> =
        (0..THRESHOLDS.crossovers_tried).map(at_crossover).filter(|gains| gains.validate().is_ok()).collect();
    candidates.sort_by(|a, b| b.k_i.total_cmp(&a.k_i));
    for gains in candidates {
        let compensator = Compensator::Pid(gains);
        let Ok(closed) =
            DiscreteLoop::build(plant, loop_plant, &compensator, &Compensation::default(), 0.0, period_s)
        else {
            continue;
        };
        let margins = closed.margins();
        if margins.phase_rad >= phase_margin - 1e-3 && margins.gain_up >= gain_margin {
            return Ok(gains);
        }
    }
    Err(ControlError::Unreachable { phase_margin_deg: phase_margin.to_degrees(), gain_margin })
}

/// Turns one knob.
type Turn = fn(&mut EmcConfig, f64);

/// One change of one knob, and what it would do.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// Symbol of the knob.
    pub knob: &'static str,
    /// [-] its value now.
    pub from: f64,
    /// [-] its value then.
    pub to: f64,
    /// What becomes better.
    pub improvement: Improvement,
    /// The settings it would lead to.
    pub config: EmcConfig,
}

/// What a changed loop does better.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Improvement {
    /// [-] the sensitivity peak falls.
    SensitivityPeak {
        /// Now.
        from: f64,
        /// Then.
        to: f64,
    },
    /// The bandwidth grows.
    Bandwidth {
        /// [rad/s] now.
        from_rad_s: f64,
        /// [rad/s] then.
        to_rad_s: f64,
        /// [-] the sensitivity peak then.
        sensitivity_peak: f64,
    },
}

/// The one change of γ_0, α or α_c that helps most; `None` where the loop is well as it is.
#[must_use]
pub fn advise(
    config: &EmcConfig,
    margins: &Margins,
    pole: f64,
    period_s: f64,
    look: impl Fn(&EmcConfig) -> Option<Margins>,
) -> Option<Advice> {
    let gamma_0 = config.gamma_0.unwrap_or_else(|| config.beta.value(pole, period_s));
    let both_ways = |alpha: f64| [alpha - THRESHOLDS.alpha_turn, alpha + THRESHOLDS.alpha_turn];
    let knobs: [(&'static str, f64, [f64; 2], Turn); 3] = [
        ("γ_0", gamma_0, THRESHOLDS.gamma_turn.map(|turn| turn * gamma_0), |config, value| {
            config.gamma_0 = Some(value);
        }),
        ("α", config.alpha, both_ways(config.alpha), |config, value| config.alpha = value),
        ("α_c", config.alpha_c, both_ways(config.alpha_c), |config, value| config.alpha_c = value),
    ];
    let mut best: Option<(f64, Advice)> = None;
    for (knob, from, values, set) in knobs {
        for to in values {
            let mut changed = *config;
            set(&mut changed, to);
            let Some(then) = look(&changed) else { continue };
            let Some((gain, improvement)) = improvement(margins, &then) else { continue };
            if best.as_ref().is_none_or(|(most, _)| gain > *most) {
                best = Some((gain, Advice { knob, from, to, improvement, config: changed }));
            }
        }
    }
    best.map(|(_, advice)| advice)
}

/// How much better a changed loop is, and in what; `None` = not at all.
fn improvement(now: &Margins, then: &Margins) -> Option<(f64, Improvement)> {
    let peaks = (now.sensitivity_peak, then.sensitivity_peak);
    let bands = (now.bandwidth_rad_s, then.bandwidth_rad_s);
    if peaks.0 > THRESHOLDS.nervous_peak && peaks.1 < peaks.0 {
        return Some((peaks.0 - peaks.1, Improvement::SensitivityPeak { from: peaks.0, to: peaks.1 }));
    }
    let is_calm = peaks.0 <= THRESHOLDS.calm_peak && peaks.1 <= THRESHOLDS.calm_peak;
    if is_calm && bands.1 > THRESHOLDS.bandwidth_gain * bands.0 {
        let (from_rad_s, to_rad_s) = bands;
        let grows = Improvement::Bandwidth { from_rad_s, to_rad_s, sensitivity_peak: peaks.1 };
        return Some((bands.1 / bands.0 - 1.0, grows));
    }
    None
}
