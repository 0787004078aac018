//! A block that was run: measured and modelled signal, and how noise reaches them.

use std::ops::Range;

use super::run::RunMode;
use super::trace::{MeasuredSignal, SampleRows, Trace};
use crate::estimation::slope::centred_slope_noise;
use crate::log::Dataset;
use crate::model::LagInverse;
use crate::signal::columns::{BODY_RATE, PROPELLER_RATES};

/// A block that was run, before it is scored.
pub(crate) struct BlockRun {
    pub name: String,
    pub signal: String,
    pub unit: &'static str,
    pub driven_by: Vec<String>,
    pub run: RunMode,
    /// Whether what a perfect model leaves changes from sample to sample by the sensor's noise alone, or by hardly more: the
    /// noisy start of a window moves all of it smoothly.
    pub shows_noise: bool,
    /// Rows of the log, those of pieces that follow each other as one.
    pub rows: Vec<Range<usize>>,
    /// What is scored where it is not the log's own column; not-a-number elsewhere.
    pub own: Option<Vec<f64>>,
    /// Which samples of the log's own column are scored; `None` = all.
    pub in_part: Option<Vec<bool>>,
    pub modelled: Vec<f64>,
    /// Parts without a hole: samples of the block, in order.
    pub pieces: Vec<Range<usize>>,
    pub one_step: Option<f64>,
    pub floor: NoisePath,
}

/// How the sensors' noise reaches the error of a block.
#[derive(Debug, Clone, Copy)]
pub(crate) enum NoisePath {
    /// Through the sensor of the signal alone.
    Sensor,
    /// Through thrust sensor and rotor rate, whose slope [N s/rad] is given.
    Thrust(f64),
    /// Through the start of each window and, where they drive the body, the rotors' rates.
    Window { rotors: bool, angle: bool, behind: BehindSensors },
    /// Through a slope over so many samples to both sides.
    Slope(usize),
}

/// [-] by how much more noise stays in a slope over a channel of which only one row in so many holds a reading.
pub(crate) fn thinned(log: &Dataset, name: &str) -> f64 {
    let there = log.column(name).unwrap_or(&[]).iter().filter(|value| value.is_finite()).count();
    (log.len() as f64 / there.max(1) as f64).sqrt()
}

/// How much noisier than a reading is what is behind a sensor that lags.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BehindSensors {
    /// [-] times the gyroscope's noise in the rate that a window starts with.
    pub start: f64,
    /// [s] times the noise of the rotors' acceleration of the body in what they have done since a window's start.
    pub rotors_s: f64,
}

impl BehindSensors {
    /// Behind gyroscope and telemetry, in a log of which each row may hold a reading, or few do.
    pub(crate) fn of((gyroscope, telemetry): (&LagInverse, &LagInverse), log: &Dataset) -> Self {
        let slope_noise = centred_slope_noise(gyroscope.half, log.median_interval());
        let start = (gyroscope.lag_s * slope_noise * thinned(log, BODY_RATE)).hypot(1.0);
        // What a slope adds, summed up over time, are the readings around both ends.
        let seldom = PROPELLER_RATES.map(|rates| thinned(log, rates)).into_iter().fold(1.0, f64::max);
        let rotors_s = telemetry.lag_s * seldom / (2.0 * telemetry.half as f64 + 1.0).sqrt();
        Self { start, rotors_s }
    }
}

impl BlockRun {
    /// An empty run of a block.
    pub(crate) fn new(
        name: &str,
        signal: &str,
        unit: &'static str,
        driven_by: &[&str],
        floor: NoisePath,
    ) -> Self {
        Self {
            name: name.to_owned(),
            signal: signal.to_owned(),
            unit,
            driven_by: driven_by.iter().map(|name| (*name).to_owned()).collect(),
            run: match floor {
                NoisePath::Sensor => RunMode::Free,
                NoisePath::Thrust(_) => RunMode::EachSample,
                _ => RunMode::Smoothed,
            },
            shows_noise: matches!(floor, NoisePath::Sensor | NoisePath::Window { .. }),
            rows: Vec::new(),
            own: None,
            in_part: None,
            modelled: Vec::new(),
            pieces: Vec::new(),
            one_step: None,
            floor,
        }
    }

    /// Adds a part without a hole: rows of the log, and the modelled signal there.
    pub(crate) fn add(&mut self, rows: Range<usize>, modelled: &[f64]) {
        let from = self.modelled.len();
        match self.rows.last_mut() {
            Some(last) if last.end == rows.start => last.end = rows.end,
            _ => self.rows.push(rows),
        }
        self.modelled.extend_from_slice(modelled);
        self.pieces.push(from..self.modelled.len());
    }

    /// Adds a part; `scored` is what is, of a channel that is scored in part only.
    pub(crate) fn add_part(&mut self, scored: Option<&[f64]>, rows: Range<usize>, modelled: &[f64]) {
        match scored {
            None => self.add(rows, modelled),
            Some(scored) => self.add_scored(rows, scored, modelled),
        }
    }

    /// The same where a part of the log's own column is scored: where `scored` is a number.
    pub(crate) fn add_scored(&mut self, rows: Range<usize>, scored: &[f64], modelled: &[f64]) {
        self.in_part.get_or_insert_default().extend(scored.iter().map(|value| value.is_finite()));
        self.add(rows, modelled);
    }

    /// The same where what is scored is not the log's own column.
    pub(crate) fn add_own(&mut self, rows: Range<usize>, scored: &[f64], modelled: &[f64]) {
        self.own.get_or_insert_default().extend_from_slice(scored);
        self.add(rows, modelled);
    }

    /// Gives back what its columns were given to grow, a quarter of a long one.
    pub(crate) fn end(mut self) -> Self {
        self.modelled.shrink_to_fit();
        self.own.iter_mut().for_each(Vec::shrink_to_fit);
        self.in_part.iter_mut().for_each(Vec::shrink_to_fit);
        self
    }

    /// Whether each piece is a window, started at a measurement.
    pub(crate) fn is_in_windows(&self) -> bool {
        matches!(self.floor, NoisePath::Window { .. })
    }

    /// What is scored, sample by sample; not-a-number elsewhere.
    pub(crate) fn scored<'a>(&'a self, log: &'a Dataset) -> impl Iterator<Item = f64> + 'a {
        let column = log.column(&self.signal).unwrap_or_default();
        let rows = self.rows.iter().filter(|_| self.own.is_none());
        let all = rows.flat_map(|rows| column.get(rows.clone()).unwrap_or_default());
        let in_part = self.in_part.as_deref();
        let is_scored = move |sample: usize| in_part.is_none_or(|in_part| in_part[sample]);
        let all = all.enumerate();
        let in_part = all.map(move |(sample, value)| if is_scored(sample) { *value } else { f64::NAN });
        self.own.iter().flatten().copied().chain(in_part)
    }

    /// Whether there is any sample to score.
    pub(crate) fn is_scored(&self, log: &Dataset) -> bool {
        self.scored(log).any(f64::is_finite)
    }

    /// Measured minus modelled, where it is scored.
    pub(crate) fn residual(&self, log: &Dataset) -> Vec<f64> {
        let mut residual = Vec::with_capacity(self.modelled.len());
        residual.extend(self.scored(log).zip(&self.modelled).map(|(y, m)| y - m));
        residual
    }

    /// The signals, with what the log has itself shared with it.
    pub(crate) fn into_trace(self, log: &Dataset) -> Trace {
        let column = || log.cells(&self.signal).unwrap_or_default();
        Trace {
            rows: SampleRows::of(self.rows),
            time: log.time_cells(),
            measured: self
                .own
                .map_or_else(|| MeasuredSignal::Column(column()), |own| MeasuredSignal::Own(own.into())),
            modelled: self.modelled.into(),
            in_part: self.in_part,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::slope::centred_slope;
    use crate::model::Model;

    /// What is behind a sensor is as much noisier as it says: the answer to one reading is that to noise.
    #[test]
    fn the_noise_behind_sensors_is_known() {
        let mut model = Model::paper();
        for (id, number) in [("gyro_lag", "gyro_lag.pole"), ("telemetry_lag", "telemetry_lag.pole")] {
            model = model.with(&model.effect(id).expect("known"));
            model.set_parameter(number, 25.0);
        }
        let equations = model.equations().expect("binds");
        let (gyroscope, telemetry) = (equations.gyroscope_inverse(0.01), equations.telemetry_inverse(0.01));
        assert!((gyroscope.lag_s - 0.04).abs() < 2e-4, "{gyroscope:?}");
        let time: Vec<f64> = (0..40).map(|row| 0.01 * f64::from(row)).collect();
        let everywhere =
            [BODY_RATE, PROPELLER_RATES[0], PROPELLER_RATES[1]].map(|name| (name, vec![0.0; 40]));
        let log = Dataset::made(time.clone(), everywhere);
        let behind = BehindSensors::of((&gyroscope, &telemetry), &log);
        let one: Vec<f64> = (0..40).map(|row| if row == 20 { 1.0 } else { 0.0 }).collect();
        let rate = |row: usize| {
            let shown = (time[row], 0.0, one[row]);
            equations.start_behind(&gyroscope, shown, |half| centred_slope(&time, &one, row, half)).rate
        };
        let power: f64 = (10..30).map(|row| rate(row).powi(2)).sum();
        assert!((power.sqrt() - behind.start).abs() < 1e-9, "{} {}", power.sqrt(), behind.start);
        let rates = equations.rates_behind(&telemetry, (&one).into(), |rates, half| {
            (0..40).map(|row| centred_slope(&time, rates, row, half)).collect()
        });
        // The readings themselves, summed up, are the walk: what is beside it ends where it began.
        let mut beside = 0.0;
        let sums = (0..40).map(|row| {
            beside += 0.01 * (rates[row] - one[row]);
            beside * beside
        });
        let power: f64 = sums.sum();
        // A window of straight weights holds 5/6 to 6/5 of a mean's noise.
        assert!((power.sqrt() / behind.rotors_s - 1.0).abs() < 0.2, "{} {}", power.sqrt(), behind.rotors_s);
        let none = BehindSensors::of((&LagInverse::NONE, &LagInverse::NONE), &log);
        assert_eq!((none.start, none.rotors_s), (1.0, 0.0));
    }
}
