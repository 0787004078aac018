//! How much of a residual is sensor noise, which no model explains; and a smoother for noisy inputs.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use crate::diagnose::block_data::BlockData;
use crate::estimation::quantile::median;

/// The median of absolute values of normal noise, over its standard deviation.
const MEDIAN_OF_NORMAL: f64 = 0.674_489_75;
/// Values that are there, one in so many, from which on there are enough of four in a row.
const IN_A_ROW: usize = 4;
/// Sum of squares of the third difference 1, -3, 3, -1.
const THIRD_DIFFERENCE: f64 = 20.0;

/// Third differences, zeros and what is not a number left out.
fn differences(values: &[f64], pieces: &[std::ops::Range<usize>]) -> Vec<f64> {
    let is_there = |value: &f64| *value != 0.0 && value.is_finite();
    let difference = |four: &[f64]| (four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]).abs();
    let mut differences = Vec::with_capacity(values.len());
    for piece in pieces {
        let fours = values[piece.clone()].windows(4).filter(|four| four.iter().all(is_there));
        differences.extend(fours.map(difference));
    }
    let there = || pieces.iter().map(|piece| values[piece.clone()].iter().copied().filter(is_there));
    // A sensor slower than the rows hardly ever has four values in a row: then its own rows count.
    if IN_A_ROW * differences.len() < there().map(Iterator::count).sum() {
        let own = there().map(|values| values.collect::<Vec<f64>>());
        differences = own.flat_map(|own| own.windows(4).map(difference).collect::<Vec<f64>>()).collect();
    }
    differences
}

/// Standard deviation of what changes from sample to sample: third differences forget what moves slowly, and
/// their median forgets a spike here and there. `pieces` are cut at holes; zeros and what is not a number are missing.
#[must_use]
pub fn white_noise(values: &[f64], pieces: &[std::ops::Range<usize>]) -> f64 {
    let differences = differences(values, pieces);
    let Some(middle) = median(differences.iter().copied()) else { return 0.0 };
    let middle = middle / (MEDIAN_OF_NORMAL * THIRD_DIFFERENCE.sqrt());
    if middle > 0.0 {
        return middle;
    }
    // More than half of them are nothing at all: a coarse grid. Then every one of them counts.
    all_alike(&differences)
}

/// Standard deviation from third differences, each of which counts.
fn all_alike(differences: &[f64]) -> f64 {
    let sum: f64 = differences.iter().map(|value| value * value).sum();
    (sum / (THIRD_DIFFERENCE * differences.len().max(1) as f64)).sqrt()
}

/// The same of a reading in steps of `step`. Where the noise does not reach over a step, neighbours read alike and what the
/// steps take away, step/√12 rms, does not change from sample to sample: what changes is too small for it.
fn of_reading(values: &[f64], pieces: &[std::ops::Range<usize>], step: f64) -> f64 {
    let noise = white_noise(values, pieces);
    if !(step.is_finite() && DITHERED * step > noise) {
        return noise;
    }
    let steps = step / 12.0_f64.sqrt();
    let at_most = (DITHERED * step).hypot(steps);
    let each = all_alike(&differences(values, pieces));
    noise.max(steps).max(each.min(at_most))
}

/// The step that readings are told in: all of them lie on a grid of it; 0 where they do not.
#[must_use]
pub fn reading_step(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_unstable_by(f64::total_cmp);
    let of_range = values.last().zip(values.first()).map_or(0.0, |(last, first)| SAME * (last - first));
    let gaps = || values.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > of_range);
    let step = gaps().fold(f64::INFINITY, f64::min);
    let is_whole = |gap: &f64| (gap / step - (gap / step).round()).abs() < OFF_GRID;
    let (whole, all) = (gaps().filter(is_whole).count(), gaps().count());
    if all >= FEWEST_GAPS && whole as f64 > ON_GRID * all as f64 { step } else { 0.0 }
}

/// Steps that noise must reach over, as its standard deviation, to be seen for what it is.
pub const DITHERED: f64 = 0.5;
/// Share of the range below which two readings are one, and of a step by which one may lie beside the grid: decimals.
const SAME: f64 = 1e-7;
const OFF_GRID: f64 = 0.05;
/// Share of the gaps between readings that must be whole steps, and the fewest gaps that show a grid.
const ON_GRID: f64 = 0.95;
const FEWEST_GAPS: usize = 5;

/// The noise floor of each channel in its unit, from residuals over the data's own sigma: the sensor's noise, and
/// what the noise of the rotors' sensors does to a body of `inertia` [kg m²] that they drive.
#[must_use]
pub fn floors(data: &BlockData, residuals: &[f64], inertia: f64) -> [f64; 2] {
    let mut floors = data.sigma;
    let carried = data.carried();
    for (channel, floor) in floors.iter_mut().enumerate().take(data.channels().len()) {
        let step = data.reading_step(channel) / *floor;
        *floor *= of_reading(residuals, &data.pieces(channel), step);
        *floor = floor.hypot(carried[channel] / inertia).max(RESOLUTION * data.spread(channel));
    }
    floors
}

/// [-] share of a signal's own spread below which no error says anything about physics: samples with straight lines
/// between them, and arithmetic, know no more. Without it data free of noise would have something missing for ever.
pub const RESOLUTION: f64 = 1e-3;

/// Standard deviation of the values that are there; 0 of none.
#[must_use]
pub fn spread(values: impl Iterator<Item = f64>) -> f64 {
    // Welford: exact for values that are all the same, however large.
    let (mut count, mut mean, mut squares) = (0.0, 0.0, 0.0);
    for value in values.filter(|value| value.is_finite()) {
        count += 1.0;
        let from_mean = value - mean;
        mean += from_mean / count;
        squares += from_mean * (value - mean);
    }
    f64::sqrt(squares / f64::max(count, 1.0))
}

/// Candidates for the wandering of a level from sample to sample, over the noise.
const WANDERINGS: [f64; 12] = [0.0, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0];

/// A level wanders only when the log-likelihood says so clearly: a wandering one carries noise along.
const WANDERING_PENALTY: f64 = 5.0;

/// The level under noisy values: a random walk, its wandering chosen by likelihood, smoothed forwards and
/// backwards (Kalman, Rauch-Tung-Striebel). Not-a-number = missing. With it an example of the noise that the level
/// still carries: white noise of the same size, smoothed in the same way.
#[must_use]
pub fn smooth(values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let wandering = wandering(values);
    if wandering == 0.0 {
        // The mean of many values carries next to none.
        return (vec![constant(values); values.len()], vec![0.0; values.len()]);
    }
    let mut noise = white(values.len(), white_noise(values, std::slice::from_ref(&(0..values.len()))));
    missing_alike(&mut noise, values);
    (smoothed(values, wandering), smoothed(&noise, wandering))
}

/// Takes as missing in an example what is missing in the values that it is one of.
pub fn missing_alike(example: &mut [f64], values: &[f64]) {
    let missing = example.iter_mut().zip(values).filter(|(_, value)| !value.is_finite());
    missing.for_each(|(example, _)| *example = f64::NAN);
}

/// White noise of a size, the same each time.
#[must_use]
pub fn white(count: usize, size: f64) -> Vec<f64> {
    let mut generator = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    (0..count).map(|_| size * Distribution::<f64>::sample(&StandardNormal, &mut generator)).collect()
}

/// How much the level wanders from sample to sample, over the noise.
fn wandering(values: &[f64]) -> f64 {
    let likelihood = |wandering: &f64| {
        let penalty = if *wandering > 0.0 { WANDERING_PENALTY } else { 0.0 };
        filter(values, *wandering).0 - penalty
    };
    let best = WANDERINGS.iter().copied().map(|wandering| (likelihood(&wandering), wandering));
    best.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, wandering)| wandering)
}

fn smoothed(values: &[f64], wandering: f64) -> Vec<f64> {
    let (_, levels, variances) = filter(values, wandering);
    let mut smooth = levels.clone();
    for row in (0..values.len().saturating_sub(1)).rev() {
        let gain = variances[row] / (variances[row] + wandering * wandering);
        smooth[row] = levels[row] + gain * (smooth[row + 1] - levels[row]);
    }
    smooth
}

/// The mean where it is plainly not zero: a mean within its own scatter is noise, and noise would drive what
/// follows.
fn constant(values: &[f64]) -> f64 {
    let count = values.iter().filter(|value| value.is_finite()).count().max(1) as f64;
    let finite = || values.iter().filter(|value| value.is_finite());
    let mean = finite().sum::<f64>() / count;
    let scatter = finite().map(|value| (value - mean).powi(2)).sum::<f64>().sqrt() / count;
    if mean.abs() > PLAINLY * scatter { mean } else { 0.0 }
}

/// Standard errors beyond which a mean is not an accident.
const PLAINLY: f64 = 4.0;

/// The log-likelihood with the noise's size concentrated out, and level and variance (over noise) at each sample.
fn filter(values: &[f64], wandering: f64) -> (f64, Vec<f64>, Vec<f64>) {
    let first = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    // A start as uncertain as a few samples of noise, so that the first sample does not stand for the level.
    let (mut level, mut variance) = (first, 1.0);
    let (mut squares, mut logs, mut count) = (0.0, 0.0, 0.0_f64);
    let mut levels = Vec::with_capacity(values.len());
    let mut variances = Vec::with_capacity(values.len());
    for (row, value) in values.iter().enumerate() {
        if row > 0 {
            variance += wandering * wandering;
        }
        if value.is_finite() {
            let total = variance + 1.0;
            let surprise = value - level;
            if row > 0 {
                squares += surprise * surprise / total;
                logs += total.ln();
                count += 1.0;
            }
            let gain = variance / total;
            level += gain * surprise;
            variance *= 1.0 - gain;
        }
        levels.push(level);
        variances.push(variance);
    }
    let count = count.max(1.0);
    (-0.5 * (count * (squares / count).max(f64::MIN_POSITIVE).ln() + logs), levels, variances)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::Normal;

    fn noise(count: usize, sigma: f64) -> Vec<f64> {
        let mut generator = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let normal = Normal::new(0.0, sigma).expect("a normal distribution");
        (0..count).map(|_| normal.sample(&mut generator)).collect()
    }

    /// White noise of size 2 on a slow wave ten times as large, with spikes: the noise is found.
    #[test]
    fn noise_is_seen_through_a_wave_and_spikes() {
        let mut values = noise(6000, 2.0);
        for (row, value) in values.iter_mut().enumerate() {
            *value += 20.0 * (row as f64 * 0.02).sin() + if row % 100 == 0 { 100.0 } else { 0.0 };
        }
        // The median over 6000 third differences scatters by 2 %; spikes in 4 % of them add 5 %.
        let found = white_noise(&values, std::slice::from_ref(&(0..6000)));
        assert!((found - 2.0).abs() < 0.2, "{found}");
    }

    /// Of a sensor that tells in every second or third row only, the noise is the same.
    #[test]
    fn noise_of_a_sensor_slower_than_the_rows_is_seen() {
        for (stride, missing) in [(2, 0.0), (2, f64::NAN), (3, 0.0)] {
            let mut values = noise(6000, 2.0);
            let slow = values.iter_mut().enumerate().filter(|(row, _)| row % stride != 0);
            slow.for_each(|(_, value)| *value = missing);
            let found = white_noise(&values, std::slice::from_ref(&(0..6000)));
            // The median over 2000 third differences scatters by 4 %.
            assert!((found - 2.0).abs() < 0.25, "{stride}: {found}");
            let (level, carried) = smooth(&values);
            assert!(level.iter().chain(&carried).all(|value| value.is_finite()), "{stride}");
        }
    }

    /// A signal that moves by a few steps from sample to sample, read in steps larger than its noise: noise and steps together
    /// are what a perfect model leaves.
    #[test]
    fn the_floor_of_a_coarse_reading_has_its_steps_in_it() {
        let whole = std::slice::from_ref(&(0..6000));
        for (step, sigma) in [(5.0, 1.5), (3.0, 0.45), (1.5, 0.45), (10.0, 1.5), (0.1, 1.5)] {
            let truth: Vec<f64> = (0..6000).map(|row| 600.0 + 100.0 * (row as f64 * 0.2).sin()).collect();
            let read: Vec<f64> = noise(6000, sigma)
                .iter()
                .zip(&truth)
                .map(|(noise, truth)| ((truth + noise) / step).round() * step)
                .collect();
            let found = reading_step(read.iter().copied());
            assert!((found / step - 1.0).abs() < 1e-3, "{step}: {found}");
            let left: Vec<f64> = read.iter().zip(&truth).map(|(read, truth)| read - truth).collect();
            let rms = spread(left.iter().copied());
            let floor = of_reading(&left, whole, found);
            // 10 % over the floor is what counts as something missing. What steps do to a smooth signal changes sign more often
            // than noise would, which third differences take for more, by 14 % here.
            assert!((0.92..1.2).contains(&(floor / rms)), "{step}, {sigma}: {floor} of {rms}");
        }
        assert_eq!(reading_step(noise(6000, 1.0).into_iter()), 0.0, "no steps");
    }

    #[test]
    fn a_constant_under_noise_is_smoothed_to_a_constant() {
        let (level, _) = smooth(&noise(2000, 1.0));
        // The mean of 2000 values of noise 1 lies within four times 0.022.
        assert!(level.iter().all(|level| level.abs() < 0.1));
    }

    #[test]
    fn a_wave_under_noise_stays() {
        let mut values = noise(2000, 0.1);
        values.iter_mut().enumerate().for_each(|(row, value)| *value += (row as f64 * 0.02).sin());
        let (level, _) = smooth(&values);
        let wrong = level
            .iter()
            .enumerate()
            .map(|(row, level)| (level - (row as f64 * 0.02).sin()).powi(2))
            .sum::<f64>();
        // Less than half of the noise remains.
        assert!((wrong / 2000.0).sqrt() < 0.05);
    }
}
