//! Temperatures of ESCs and motors: they only show the load, nothing in the plant depends on them.

use crate::signal::ROTORS;

/// [K] of the air, and of everything at the start.
const AMBIENT: f64 = 293.15;

/// What warms up by its own losses: first order towards an end that lies above ambient.
struct Heated {
    /// [K] above ambient in the end, at hover.
    rise: f64,
    /// [s]
    time_constant: f64,
}

/// As of small ones without a heat sink.
const ESC: Heated = Heated { rise: 12.0, time_constant: 20.0 };
const MOTOR: Heated = Heated { rise: 20.0, time_constant: 60.0 };

/// How warm everything is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Temperatures {
    /// [K] of each ESC.
    pub esc: [f64; ROTORS],
    /// [K] of each motor.
    pub motor: [f64; ROTORS],
}

impl Default for Temperatures {
    fn default() -> Self {
        Self { esc: [AMBIENT; ROTORS], motor: [AMBIENT; ROTORS] }
    }
}

impl Temperatures {
    /// Goes on by `span` [s] at these rates over the one in hover. Losses grow with the power, the third power of the rate, and
    /// the wash that cools with the rate itself: what they end at grows with its square.
    pub fn advance(&mut self, rates: [f64; ROTORS], span: f64) {
        for (part, temperatures) in [(ESC, &mut self.esc), (MOTOR, &mut self.motor)] {
            for (ratio, temperature) in rates.iter().zip(temperatures) {
                let end = AMBIENT + part.rise * ratio * ratio;
                *temperature += span / part.time_constant * (end - *temperature);
            }
        }
    }
}
