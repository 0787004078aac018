//! Sensors: how much they are off, and how. Real ones are seldom white.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::catalogue::Kind;
use crate::motion::Row;

/// Standard deviations of the sensors: rotor rate [rad/s], gyroscope [rad/s], angle [rad], battery [V]; in how many steps a volt
/// is read; and what else is wrong with them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    pub rate: f64,
    pub gyro: f64,
    pub angle: f64,
    pub battery: f64,
    pub steps_per_volt: f64,
    pub flaw: Flaw,
}

impl Noise {
    /// Of the development cases.
    pub const USUAL: Self = Self {
        rate: 1.5,
        gyro: 0.004,
        angle: 0.001,
        battery: 0.004,
        steps_per_volt: 100.0,
        flaw: Flaw::White,
    };
}

/// What readings have beside white noise. None of it is a law of the bench: nobody can name it, and nobody should.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Flaw {
    /// Nothing.
    White,
    /// The noise of rates has been through a filter of its own: so many rows of memory.
    Filtered { memory: f64 },
    /// For part of each period [rows] it is that many times as strong.
    Bursts { period: f64, part: f64, factor: f64 },
    /// Each reading of a rotor's rate is of another instant than its row, by up to that many rows before or after.
    Late { rows: f64 },
    /// The clock of the rows goes unevenly, by that many rows (standard deviation).
    Jitter { rows: f64 },
    /// A rotor's rate is new in each of so many rows only, and shown until the next.
    Held { rows: usize },
    /// Each reading is rounded to so many times its noise.
    Steps { size: f64 },
    /// The gyro's bias wanders: by so many times its noise, once to and fro in so many rows.
    Drift { size: f64, period: f64 },
}

impl Flaw {
    /// One of them in turn, of those that a bench can have.
    pub fn draw(number: u64, kind: Kind, rng: &mut ChaCha8Rng) -> Self {
        let mut between = |low: f64, high: f64| rng.random_range(low..high);
        match number % if kind == Kind::Attitude { 5 } else { 4 } {
            0 => Self::Filtered { memory: between(1.0, 6.0) },
            1 => Self::Bursts {
                period: between(150.0, 900.0),
                part: between(0.05, 0.3),
                factor: between(2.0, 5.0),
            },
            2 => Self::Late { rows: between(0.03, 0.2) },
            3 => Self::Jitter { rows: between(0.02, 0.1) },
            _ => Self::Drift { size: between(0.3, 1.5), period: between(2_000.0, 12_000.0) },
        }
    }

    /// One in turn of those that make a log as poor as telemetry is.
    pub fn poor(number: u64, rng: &mut ChaCha8Rng) -> Self {
        let mut between = |low: f64, high: f64| rng.random_range(low..high);
        match number % 4 {
            0 => Self::Held { rows: between(2.0, 5.0) as usize },
            1 => Self::Steps { size: between(1.0, 4.0) },
            2 => Self::Jitter { rows: between(0.02, 0.1) },
            _ => Self::Filtered { memory: between(1.0, 6.0) },
        }
    }

    /// \[-\] by how much it makes white noise larger.
    pub fn noise_grows(self) -> f64 {
        match self {
            Self::Steps { size } => (1.0 + size * size / 12.0).sqrt(),
            _ => 1.0,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white noise",
            Self::Filtered { .. } => "filtered noise",
            Self::Bursts { .. } => "noise that comes and goes",
            Self::Late { .. } => "telemetry of another instant",
            Self::Jitter { .. } => "an uneven clock",
            Self::Held { .. } => "telemetry that is held",
            Self::Steps { .. } => "readings in steps",
            Self::Drift { .. } => "a drifting bias",
        }
    }
}

/// A sensor whose noise may be filtered, and whose readings may be late.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    Rate1,
    Rate2,
    Gyro,
    Angle,
}

/// Reads the rows of one log.
pub struct Reader<'a> {
    rows: &'a [Row],
    noise: Noise,
    /// Where the filtered noise of each channel is.
    filtered: [f64; 4],
    /// What each channel showed when it was new.
    shown: [f64; 4],
    /// [rows] by which the clock is off in this row.
    off: f64,
}

impl<'a> Reader<'a> {
    pub fn new(rows: &'a [Row], noise: Noise) -> Self {
        Self { rows, noise, filtered: [0.0; 4], shown: [0.0; 4], off: 0.0 }
    }

    /// To be called once for each row.
    pub fn begin(&mut self, rng: &mut ChaCha8Rng) {
        if let Flaw::Jitter { rows } = self.noise.flaw {
            let kick: f64 = StandardNormal.sample(rng);
            self.off = (rows * kick).clamp(-0.45, 0.45);
        }
    }

    /// What a channel shows in row `k`.
    pub fn read(&mut self, channel: Channel, k: usize, rng: &mut ChaCha8Rng) -> f64 {
        let is_rotor = matches!(channel, Channel::Rate1 | Channel::Rate2);
        let off = match self.noise.flaw {
            Flaw::Late { rows } if is_rotor => rng.random_range(-rows..rows),
            _ => self.off,
        };
        let white: f64 = StandardNormal.sample(rng);
        let (size, value): (f64, fn(&Row) -> f64) = match channel {
            Channel::Rate1 => (self.noise.rate, |row| row.rate[0]),
            Channel::Rate2 => (self.noise.rate, |row| row.rate[1]),
            Channel::Gyro => (self.noise.gyro, |row| row.body_rate),
            Channel::Angle => (self.noise.angle, |row| row.angle),
        };
        let at = k as f64;
        let error = match self.noise.flaw {
            Flaw::Filtered { memory } if channel != Channel::Angle => {
                let keep = (-1.0 / memory).exp();
                let state = &mut self.filtered[channel as usize];
                // From the first row on as large as later.
                *state = if k == 0 { white } else { keep * *state + (1.0 - keep * keep).sqrt() * white };
                size * *state
            }
            Flaw::Bursts { period, part, factor } if (at / period).fract() < part => factor * size * white,
            Flaw::Drift { size: drift, period } if channel == Channel::Gyro => {
                size * (white + drift * (TAU * at / period).sin())
            }
            _ => size * white,
        };
        let read = self.between(k, off, value) + error;
        match self.noise.flaw {
            Flaw::Held { rows } if is_rotor && !k.is_multiple_of(rows) => self.shown[channel as usize],
            Flaw::Held { .. } => {
                self.shown[channel as usize] = read;
                read
            }
            Flaw::Steps { size: steps } => (read / (steps * size)).round() * steps * size,
            _ => read,
        }
    }

    /// A value `off` rows beside row `k`, on the cubic through four rows.
    fn between(&self, k: usize, off: f64, value: fn(&Row) -> f64) -> f64 {
        if off == 0.0 {
            return value(&self.rows[k]);
        }
        let last = self.rows.len() as i64 - 1;
        let at = |by: i64| value(&self.rows[(k as i64 + by).clamp(0, last) as usize]);
        let first = if off < 0.0 { -1 } else { 0 };
        let [a, b, c, d] = [first - 1, first, first + 1, first + 2].map(at);
        let x = off - first as f64;
        let (slope_b, slope_c) = ((c - a) / 2.0, (d - b) / 2.0);
        let (square, cube) = (x * x, x * x * x);
        b * (2.0 * cube - 3.0 * square + 1.0)
            + slope_b * (cube - 2.0 * square + x)
            + c * (3.0 * square - 2.0 * cube)
            + slope_c * (cube - square)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn rows() -> Vec<Row> {
        let row = |k: usize| {
            let at = 0.01 * k as f64;
            Row {
                rate: [600.0 + at * at, 600.0],
                body_rate: at,
                angle: 0.0,
                true_rate: [600.0; 2],
                true_body_rate: at,
            }
        };
        (0..20_000).map(row).collect()
    }

    /// Readings of a channel less the truth, in standard deviations of the usual noise.
    fn errors(flaw: Flaw, channel: Channel) -> Vec<f64> {
        let (rows, mut rng) = (rows(), ChaCha8Rng::seed_from_u64(7));
        let mut reader = Reader::new(&rows, Noise { flaw, ..Noise::USUAL });
        let read = |k: usize| {
            reader.begin(&mut rng);
            match channel {
                Channel::Gyro => (reader.read(channel, k, &mut rng) - rows[k].body_rate) / Noise::USUAL.gyro,
                _ => (reader.read(channel, k, &mut rng) - rows[k].rate[0]) / Noise::USUAL.rate,
            }
        };
        (0..rows.len()).map(read).collect()
    }

    fn rms(values: &[f64]) -> f64 {
        (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
    }

    fn correlation(values: &[f64]) -> f64 {
        let products: f64 = values.windows(2).map(|pair| pair[0] * pair[1]).sum();
        products / values.iter().map(|value| value * value).sum::<f64>()
    }

    #[test]
    fn filtered_noise_has_its_size_and_its_memory() {
        let filtered = errors(Flaw::Filtered { memory: 4.0 }, Channel::Gyro);
        // 20,000 readings, of which some 2,500 are independent: 2 % of the size.
        assert!((rms(&filtered) - 1.0).abs() < 0.06, "{}", rms(&filtered));
        assert!((correlation(&filtered) - (-0.25_f64).exp()).abs() < 0.02, "{}", correlation(&filtered));
        assert!(correlation(&errors(Flaw::White, Channel::Gyro)).abs() < 0.03);
    }

    #[test]
    fn bursts_are_as_strong_and_as_long_as_drawn() {
        let loud = errors(Flaw::Bursts { period: 100.0, part: 0.2, factor: 3.0 }, Channel::Rate1);
        let (inside, outside): (Vec<_>, Vec<_>) = loud.iter().enumerate().partition(|(k, _)| k % 100 < 20);
        let values = |of: Vec<(usize, &f64)>| of.into_iter().map(|(_, value)| *value).collect::<Vec<f64>>();
        let (inside, outside) = (values(inside), values(outside));
        assert!((rms(&inside) - 3.0).abs() < 0.15 && (rms(&outside) - 1.0).abs() < 0.03);
    }

    #[test]
    fn a_late_reading_follows_the_slope_and_an_uneven_clock_moves_the_gyro_too() {
        // At the end the rate rises by 4 rad/s a row, and the cubic through four rows of a parabola is the parabola.
        let late = errors(Flaw::Late { rows: 0.4 }, Channel::Rate1);
        let expected = 4.0 / 1.5 * 0.4 / 3.0_f64.sqrt();
        let end = rms(&late[19_000..]);
        assert!((end - expected.hypot(1.0)).abs() < 0.1, "{end} {expected}");
        let uneven = errors(Flaw::Jitter { rows: 0.4 }, Channel::Gyro);
        // Clipped at 0.45 rows.
        assert!(rms(&uneven) > 1.1, "{}", rms(&uneven));
        assert!((rms(&errors(Flaw::Late { rows: 0.4 }, Channel::Gyro)) - 1.0).abs() < 0.03);
    }

    #[test]
    fn a_held_reading_is_a_rotors_and_as_old_as_its_last_new_one() {
        let held = errors(Flaw::Held { rows: 4 }, Channel::Rate1);
        // At the end the rate rises by 4 rad/s a row: 0, 1, 2 and 3 rows late.
        let mean = held[19_000..].iter().sum::<f64>() / 1_000.0;
        assert!((mean + 1.5 * 4.0 / 1.5).abs() < 0.2, "{mean}");
        assert!((rms(&errors(Flaw::Held { rows: 4 }, Channel::Gyro)) - 1.0).abs() < 0.03);
    }

    #[test]
    fn steps_add_a_twelfth_of_their_square() {
        let rounded = errors(Flaw::Steps { size: 3.0 }, Channel::Gyro);
        let expected = Flaw::Steps { size: 3.0 }.noise_grows();
        assert!((rms(&rounded) - expected).abs() < 0.04, "{} {expected}", rms(&rounded));
    }

    #[test]
    fn a_drift_is_the_gyros_only() {
        let drift = Flaw::Drift { size: 1.0, period: 20_000.0 };
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        assert!(mean(&errors(drift, Channel::Gyro)[..10_000]) > 0.55);
        assert!(mean(&errors(drift, Channel::Rate1)[..10_000]).abs() < 0.05);
    }
}
