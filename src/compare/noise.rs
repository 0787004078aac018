//! The noise of each sensor, estimated from the data.

use std::collections::BTreeMap;

use super::block_run::BlockRun;
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::mean;
use crate::estimation::noise_floor::SensorNoise;
use crate::estimation::slope::slope;
use crate::log::Dataset;
use crate::model::Model;
use crate::screening::channel_noise::ChannelNoise;
use crate::signal::columns::PROPELLER_RATES;
use crate::threads::{spread, spread_longest_first};

/// What each channel of a log shows of its own noise, whatever a model says of it.
pub(crate) struct SignalNoise(BTreeMap<String, (ChannelNoise, f64)>);

impl SignalNoise {
    pub(crate) fn of(log: &Dataset) -> Self {
        let segments = log.segments();
        let names: Vec<&str> = log.names().collect();
        let held = |name: &&str| log.cells(name).map_or(0, |cells| cells.held());
        let channels = spread_longest_first(&names, held, |name| {
            let values = log.cells(name)?.for_once();
            let channel = ChannelNoise::of(values.iter().copied());
            Some(((*name).to_owned(), (channel, channel.in_signal(&values, &segments))))
        });
        Self(channels.into_iter().flatten().collect())
    }
}

/// Standard deviation of the noise of each measured signal, by column.
#[derive(Debug, Clone, Default)]
pub(crate) struct Noise(BTreeMap<String, f64>);

impl Noise {
    /// What the signal itself shows in its quiet stretches, unless what a model leaves says clearly otherwise: a model that follows a
    /// fast signal uncovers the noise below it, and where all that it leaves can be noise, coloured noise or bursts count with their rms.
    pub(crate) fn estimate(log: &Dataset, channels: &SignalNoise, runs: &[Vec<BlockRun>]) -> Self {
        let SignalNoise(channels) = channels;
        let shows_noise: Vec<&BlockRun> = runs.iter().flatten().filter(|run| run.shows_noise).collect();
        let left = spread(&shows_noise, |run| left_by(run, log, &channels.get(&run.signal)?.0));
        let of_signal = |(name, (_, alone)): (&String, &(ChannelNoise, f64))| {
            let own = shows_noise.iter().zip(&left).filter(|(run, _)| run.signal == *name);
            let own: Vec<SensorNoise> = own.filter_map(|(_, left)| *left).collect();
            let least = |is_all: bool| {
                let found = own.iter().filter(|left| left.is_all == is_all).map(|left| left.rms);
                found.reduce(f64::min)
            };
            // The smaller of two estimates of one noise would lie below both: only a clear difference counts.
            let is_less = |left: &f64| is_clearly_less(*left, *alone);
            let all = least(true).filter(|left| is_less(left) || is_clearly_less(*alone, *left));
            (name.clone(), all.or_else(|| least(false).filter(is_less)).unwrap_or(*alone))
        };
        Self(channels.iter().map(of_signal).collect())
    }

    /// Of a column; zero when it is not there.
    pub(crate) fn of(&self, column: &str) -> f64 {
        self.0.get(column).copied().unwrap_or(0.0)
    }
}

/// The noise in what a run leaves; `None` of short windows, or of few readings in each, which leave no differences, or too few to tell
/// anything.
fn left_by(run: &BlockRun, log: &Dataset, channel: &ChannelNoise) -> Option<SensorNoise> {
    let mut residual = run.residual(log);
    if run.is_in_windows() {
        let there = |four: &&[f64]| four.iter().all(|value| value.is_finite());
        let known = run.pieces.iter().map(|piece| residual[piece.clone()].windows(4).filter(there).count());
        if known.sum::<usize>() < THRESHOLDS.fewest_differences {
            return None;
        }
        // The noisy start of a window moves all of it along a line.
        run.pieces.iter().for_each(|piece| level(&mut residual[piece.clone()]));
    }
    let white = channel.in_signal(&residual, &run.pieces);
    let all = channel.in_residual((&residual, &|row| run.modelled[row]), &run.pieces, 0.0, 1.0);
    let is_more = all.is_all && is_clearly_less(white, all.rms);
    Some(if is_more { all } else { SensorNoise::white(white) })
}

fn is_clearly_less(one: f64, other: f64) -> bool {
    one < THRESHOLDS.clearly_less_noise * other
}

/// Takes the straight line through them off the values that are there.
fn level(values: &mut [f64]) {
    let there: Vec<(f64, f64)> =
        (0..).map(f64::from).zip(values.iter().copied()).filter(|(_, value)| value.is_finite()).collect();
    let (at, known): (Vec<f64>, Vec<f64>) = there.into_iter().unzip();
    let ((rise, _), middle, mean) = (slope(&at, &known), mean(&at), mean(&known));
    for (row, value) in (0..).map(f64::from).zip(values.iter_mut()) {
        *value -= mean + rise * (row - middle);
    }
}

/// [rad/s²] noise that the measured rates of both rotors put on the body's acceleration.
pub(crate) fn rotor_noise(model: &Model, noise: &Noise) -> f64 {
    let actuator = &model.actuator;
    let slope = 2.0 * model.body.arm * actuator.thrust_coefficient * actuator.hover_rate / model.body.inertia;
    slope * noise.of(PROPELLER_RATES[0]).hypot(noise.of(PROPELLER_RATES[1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    /// A gyro at 50 Hz on a body that swings three times a second: its own differences show the swing. Windows of a model that
    /// follows it, each begun at a noisy sample, do not.
    #[test]
    fn windows_show_the_noise_below_a_fast_signal() {
        use super::super::block_run::{BehindSensors, NoisePath};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(6);
        let normal = Normal::new(0.0, 0.004).unwrap();
        let time: Vec<f64> = (0..6_000).map(|k| 0.02 * f64::from(k)).collect();
        let swing: Vec<f64> = time.iter().map(|t| (6.0 * std::f64::consts::PI * t).sin()).collect();
        let rate: Vec<f64> = swing.iter().map(|rate| rate + normal.sample(&mut rng)).collect();
        let log = Dataset::made(time, [("body_rate_rad_s", rate.clone())]);
        let behind = BehindSensors { start: 1.0, rotors_s: 0.0 };
        let floor = NoisePath::Window { rotors: false, angle: false, behind };
        let mut run = BlockRun::new("body", "body_rate_rad_s", "rad/s", &[], floor);
        for start in (0..5_985).step_by(15) {
            let rows = start + 1..start + 16;
            let begun = rate[start] - swing[start];
            let modelled: Vec<f64> = swing[rows.clone()].iter().map(|rate| rate + begun).collect();
            run.add(rows, &modelled);
        }
        // Three readings in each window: they tell nothing.
        let mut sparse = BlockRun::new("body", "body_rate_rad_s", "rad/s", &[], floor);
        for start in (0..5_985).step_by(15) {
            let rows = start + 1..start + 16;
            let seldom = |row: usize| if row.is_multiple_of(5) { rate[row] } else { f64::NAN };
            let measured: Vec<f64> = rows.clone().map(seldom).collect();
            sparse.add_scored(rows.clone(), &measured, &swing[rows]);
        }
        let alone = Noise::estimate(&log, &SignalNoise::of(&log), &[]).of("body_rate_rad_s");
        let of_few = Noise::estimate(&log, &SignalNoise::of(&log), &[vec![sparse]]).of("body_rate_rad_s");
        let found = Noise::estimate(&log, &SignalNoise::of(&log), &[vec![run]]).of("body_rate_rad_s");
        assert_eq!(of_few, alone);
        assert!(alone > 0.008, "{alone}");
        // 4,800 correlated differences know it to about 1.7 %.
        assert!((found / 0.004 - 1.0).abs() < 0.06, "{found}");
    }

    /// A speed that moves slowly, read through a filter of three rows: differences of the signal show a fraction of its noise, what the
    /// true model leaves shows all. Of a model that misses something that is no noise, the fraction stays.
    #[test]
    fn filtered_noise_counts_with_its_rms_where_it_is_all_that_is_left() {
        use super::super::block_run::NoisePath;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(9);
        let normal = Normal::new(0.0, 1.0).unwrap();
        let keep = f64::exp(-1.0 / 3.0);
        let mut filtered = 0.0;
        let mut next = || {
            filtered = keep * filtered + (1.0 - keep * keep).sqrt() * normal.sample(&mut rng);
            2.0 * filtered
        };
        let time: Vec<f64> = (0..6_000).map(|k| 0.01 * f64::from(k)).collect();
        let speed: Vec<f64> =
            time.iter().map(|t| 600.0 + 100.0 * (0.7 * t).sin() * (1.9 * t).cos()).collect();
        let read: Vec<f64> = speed.iter().map(|speed| speed + next()).collect();
        let wrong: Vec<f64> =
            speed.iter().zip(&time).map(|(speed, t)| speed + 8.0 * (6.0 * t).sin()).collect();
        let log = Dataset::made(time, [(PROPELLER_RATES[0], read)]);
        let found = |modelled: &[f64]| {
            let mut run = BlockRun::new("actuator_1", PROPELLER_RATES[0], "rad/s", &[], NoisePath::Sensor);
            run.add(0..6_000, modelled);
            Noise::estimate(&log, &SignalNoise::of(&log), &[vec![run]]).of(PROPELLER_RATES[0])
        };
        // 6,000 readings with a memory of three rows know it to about 3 %.
        assert!((found(&speed) / 2.0 - 1.0).abs() < 0.1, "{}", found(&speed));
        assert!(found(&wrong) < 1.2, "{}", found(&wrong));
    }
}
