//! The loop in the frequency domain: margins, sensitivity peaks, bandwidth.

use std::f64::consts::{PI, TAU};

use nalgebra::Complex;
use serde::Serialize;

use super::DiscreteLoop;
use crate::control::thresholds::THRESHOLDS;

/// The loop at one frequency, opened at the plant's input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopResponse {
    /// [rad/s]
    pub frequency: f64,
    /// L, open loop; the closed loop has 1 + L.
    pub open: Complex<f64>,
}

impl LoopResponse {
    /// S = 1 / (1 + L): from a torque added to the command, to the torque that the plant gets.
    #[must_use]
    pub fn sensitivity(&self) -> Complex<f64> {
        (self.open + 1.0).inv()
    }

    /// T = L / (1 + L): from a torque added to the command, to minus the torque that the controller commands.
    #[must_use]
    pub fn complementary(&self) -> Complex<f64> {
        self.open * self.sensitivity()
    }
}

/// Robustness of a stable loop.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Margins {
    /// [-] factor by which the loop gain may grow; infinite where no growth makes it unstable.
    pub gain_up: f64,
    /// [-] factor to which it may fall; 0 where no fall makes it unstable.
    pub gain_down: f64,
    /// [rad] smallest distance from -180° where |L| = 1.
    pub phase_rad: f64,
    /// [rad/s] where that is.
    pub crossover_rad_s: f64,
    /// [s] further delay that makes it unstable.
    pub delay_s: f64,
    /// [-] peak of |S|.
    pub sensitivity_peak: f64,
    /// [-] peak of |T|.
    pub complementary_peak: f64,
    /// [rad/s] highest frequency at which |T| is at least 1/√2.
    pub bandwidth_rad_s: f64,
}

impl DiscreteLoop {
    /// The loop at `frequency` [rad/s].
    #[must_use]
    pub fn response(&self, frequency: f64) -> LoopResponse {
        let z = Complex::from_polar(1.0, frequency * self.period_s);
        LoopResponse { frequency, open: -self.compensator.response(z) * self.plant.response(z) }
    }

    /// The loop on a logarithmic grid up to the Nyquist frequency.
    #[must_use]
    pub fn sweep(&self) -> Vec<LoopResponse> {
        let nyquist = PI / self.period_s;
        let (points, decades) = THRESHOLDS.frequency_grid;
        let below = |index: usize| decades * (1.0 - index as f64 / (points - 1) as f64);
        (0..points).map(|index| self.response(nyquist * 10f64.powf(-below(index)))).collect()
    }

    /// Margins of the closed loop; they mean something only where it is stable.
    #[must_use]
    pub fn margins(&self) -> Margins {
        let sweep = self.sweep();
        let mut margins = Margins {
            gain_up: f64::INFINITY,
            gain_down: 0.0,
            phase_rad: PI,
            crossover_rad_s: 0.0,
            delay_s: f64::INFINITY,
            sensitivity_peak: 0.0,
            complementary_peak: 0.0,
            bandwidth_rad_s: 0.0,
        };
        for point in &sweep {
            margins.sensitivity_peak = margins.sensitivity_peak.max(point.sensitivity().norm());
            let complementary = point.complementary().norm();
            margins.complementary_peak = margins.complementary_peak.max(complementary);
            if complementary >= std::f64::consts::FRAC_1_SQRT_2 {
                margins.bandwidth_rad_s = point.frequency;
            }
        }
        for pair in sweep.windows(2) {
            let [low, high] = pair else { continue };
            if let Some(at) = self.crossing(low, high, |open| open.norm() - 1.0) {
                margins.at_unit_gain(&at);
            }
            if let Some(at) = self.crossing(low, high, |open| open.im) {
                margins.at_real_axis(at.open.re);
            }
        }
        // At the Nyquist frequency L is real: it ends on the axis without crossing it.
        if let Some(last) = sweep.last() {
            margins.at_real_axis(last.open.re);
        }
        margins
    }

    /// Where `measure` changes sign between two points of the grid.
    fn crossing(
        &self,
        low: &LoopResponse,
        high: &LoopResponse,
        measure: impl Fn(Complex<f64>) -> f64,
    ) -> Option<LoopResponse> {
        let (mut low, mut high) = (*low, *high);
        if (measure(low.open) > 0.0) == (measure(high.open) > 0.0) {
            return None;
        }
        for _ in 0..THRESHOLDS.crossing_halvings {
            let middle = self.response((low.frequency * high.frequency).sqrt());
            if (measure(middle.open) > 0.0) == (measure(low.open) > 0.0) {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(high)
    }
}

impl Margins {
    /// Takes in a frequency at which |L| = 1.
    fn at_unit_gain(&mut self, at: &LoopResponse) {
        // [rad] by which more delay may turn L clockwise before it is at -1.
        let turn = (at.open.arg() + PI).rem_euclid(TAU);
        let distance = turn.min(TAU - turn);
        if distance < self.phase_rad {
            (self.phase_rad, self.crossover_rad_s) = (distance, at.frequency);
        }
        self.delay_s = self.delay_s.min(turn / at.frequency);
    }

    /// Takes in a value of L on the real axis.
    fn at_real_axis(&mut self, open: f64) {
        if open <= -1.0 {
            self.gain_down = self.gain_down.max(-1.0 / open);
        } else if open < 0.0 {
            self.gain_up = self.gain_up.min(-1.0 / open);
        }
    }
}
