//! The noise of a sensor, which no model explains: its rms, and how long it remembers.
//!
//! Of a signal that moves, or of what a model leaves that misses something, only what changes from sample to sample and all the time
//! is surely noise: [`white_noise`] and [`noise_by_blocks`](super::noise_by_blocks::noise_by_blocks) see that. Of what a model leaves
//! that misses nothing all is noise, and may be coloured, or come and go: [`noise_left`] asks whether it can be that.

use std::ops::Range;

use super::dependence::Bins;
use super::moments::mean_square;
use super::quantile::{MEDIAN_OF_NORMAL, median};
use super::third_differences::{THIRD_DIFFERENCE, third_differences};
use super::thresholds::THRESHOLDS;

/// Zeros and what is not a number are missing.
fn is_there(value: &f64) -> bool {
    *value != 0.0 && value.is_finite()
}

/// Third differences of samples `stride` apart.
fn differences(values: &[f64], pieces: &[Range<usize>], stride: usize) -> Vec<f64> {
    third_differences(pieces.iter().map(|piece| &values[piece.clone()]), is_there, stride)
}

/// Standard deviation of what changes from sample to sample: third differences forget what moves slowly, and
/// their median forgets a spike here and there. `pieces` are cut at holes; zeros and what is not a number are missing.
#[must_use]
pub fn white_noise(values: &[f64], pieces: &[Range<usize>]) -> f64 {
    White::of(differences(values, pieces, 1)).typical
}

/// The standard deviation of white noise with these third differences.
#[derive(Clone, Copy)]
struct White {
    /// By their median.
    typical: f64,
    /// By their mean square.
    altogether: f64,
}

impl White {
    /// Uses the differences up: of a long record they are long, and a median sorts them where they are.
    fn of(differences: Vec<f64>) -> Self {
        let altogether = pooled(&differences);
        let Some(middle) = median(differences) else { return Self { typical: 0.0, altogether } };
        let middle = middle / (MEDIAN_OF_NORMAL * THIRD_DIFFERENCE.sqrt());
        // Where more than half of them are nothing at all, on a coarse grid, every one of them counts.
        Self { typical: if middle > 0.0 { middle } else { altogether }, altogether }
    }

    /// Rms of what surely is noise of a reading in steps.
    fn part(self, step: f64) -> f64 {
        if is_coarse(self.typical, step) {
            with_steps(self.typical, self.altogether, step)
        } else {
            self.typical
        }
    }
}

/// The same by their mean square: noise that comes and goes counts with its rms.
fn pooled(differences: &[f64]) -> f64 {
    (mean_square(differences) / THIRD_DIFFERENCE).sqrt()
}

/// Noise of a reading in steps of `step`, from what changes from sample to sample: typically and, in squares, altogether. Where the noise
/// does not reach over a step, neighbours read the same and what the steps take away, step/√12 rms, does not change from sample
/// to sample: what changes is too small for it.
#[must_use]
pub fn with_steps(typical: f64, altogether: f64, step: f64) -> f64 {
    if !is_coarse(typical, step) {
        return typical;
    }
    let steps = step / 12.0_f64.sqrt();
    let at_most = (THRESHOLDS.dithered * step).hypot(steps);
    typical.max(steps).max(altogether.min(at_most))
}

/// Whether noise does not reach over the steps of its reading.
fn is_coarse(noise: f64, step: f64) -> bool {
    step.is_finite() && THRESHOLDS.dithered * step > noise
}

/// Noise of one sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorNoise {
    /// Rms, in the unit of the values.
    pub rms: f64,
    /// [-] factor by which it is remembered from one reading to the next, as behind a low-pass filter of first order; 0 where it is
    /// white.
    pub memory: f64,
    /// Whether it is all that is left.
    pub is_all: bool,
}

impl SensorNoise {
    /// White and steady, beside what else may be left.
    #[must_use]
    pub const fn white(rms: f64) -> Self {
        Self { rms, memory: 0.0, is_all: false }
    }
}

/// What a model leaves of a channel.
#[derive(Clone, Copy)]
pub struct Left<'a> {
    /// Measured minus modelled; zeros and what is not a number are missing.
    pub residual: &'a [f64],
    /// The modelled channel in a row in which there is a residual, in any unit. Few of many rows are asked for.
    pub modelled: &'a dyn Fn(usize) -> f64,
    /// Parts without a hole.
    pub pieces: &'a [Range<usize>],
    /// The step of the reading, in the residual's unit; 0 where it has none.
    pub step: f64,
    /// Rms of what noise of other sensors leaves in it, in the residual's unit.
    pub propagated: f64,
}

/// Rms of what surely is noise in residuals, in their unit: the white and steady part, with the steps of the reading.
#[must_use]
pub fn white_left(residual: &[f64], pieces: &[Range<usize>], step: f64) -> f64 {
    White::of(differences(residual, pieces, 1)).part(step)
}

/// The noise in what a model leaves of a channel. Where all of it can be noise, low-passed or coming and going, it is its rms: seen from
/// sample to sample, in squares, and extrapolated by the memory that differences over several rows show. Noise must then be all that is left,
/// have the memory of a few rows, and know nothing of what the model does. Else only the white and steady part surely is noise.
#[must_use]
pub fn noise_left(left: &Left) -> SensorNoise {
    let next = White::of(differences(left.residual, left.pieces, 1));
    let white = next.part(left.step);
    if is_coarse(next.typical, left.step) {
        return SensorNoise::white(white);
    }
    let part = part_of(left.pieces);
    let of_part = Left { pieces: &part, ..*left };
    let memory = memory(&of_part);
    let rms = memory.map_or(0.0, |memory| next.altogether / visible(memory, 1).sqrt());
    let own = left.pieces.iter().flat_map(|piece| &left.residual[piece.clone()]);
    let all = mean_square(own.copied().filter(is_there)).sqrt();
    let is_all = all <= THRESHOLDS.all_noise * rms.hypot(left.propagated);
    match memory {
        Some(memory) if is_all && (memory == 0.0 || !depends(&of_part, memory)) => {
            SensorNoise { rms: rms.max(white), memory, is_all }
        }
        _ => SensorNoise::white(white),
    }
}

/// Share of the variance of noise with this memory that third differences of readings `stride` apart show.
fn visible(memory: f64, stride: i32) -> f64 {
    let kept = memory.powi(stride);
    // Of the weights 1, -3, 3, -1: the sums of products of weights 0, 1, 2 and 3 apart, twice but for the first.
    (20.0 - 30.0 * kept + 12.0 * kept.powi(2) - 2.0 * kept.powi(3)) / 20.0
}

/// Pieces, or of very many rows stretches of them from all over: how long noise is remembered, and whether it has to do with the model, they
/// know as well.
fn part_of(pieces: &[Range<usize>]) -> Vec<Range<usize>> {
    let rows: usize = pieces.iter().map(Range::len).sum();
    let share = rows.div_ceil(THRESHOLDS.memory_rows).max(1);
    let stretch = if share > 1 { THRESHOLDS.memory_stretch } else { rows.max(1) };
    let cut = |piece: &Range<usize>| {
        let end = piece.end;
        piece.clone().step_by(stretch).map(move |start| start..(start + stretch).min(end))
    };
    pieces.iter().flat_map(cut).step_by(share).collect()
}

/// The memory of first order with which noise shows as much over each of several strides as is there; 0 where it is hardly any; `None` where none
/// does.
fn memory(left: &Left) -> Option<f64> {
    let size = |stride: &i32| {
        let differences = differences(left.residual, left.pieces, *stride as usize);
        (*stride, differences.len() as f64, without_outliers(&differences).ln())
    };
    let sizes: Vec<(i32, f64, f64)> = THRESHOLDS.noise_strides.iter().map(size).collect();
    let next = sizes.first().map_or(0.0, |(_, count, _)| *count);
    if next == 0.0 {
        return None;
    }
    let sizes: Vec<(i32, f64, f64)> = sizes.into_iter().filter(|(.., size)| size.is_finite()).collect();
    let misfit = |memory: f64| {
        let over = |(stride, count, size): &(i32, f64, f64)| (*count, size - visible(memory, *stride).ln());
        let all: f64 = sizes.iter().map(|(_, count, _)| count).sum();
        let mean = sizes.iter().map(over).map(|(count, over)| count * over).sum::<f64>() / all;
        (sizes.iter().map(over).map(|(count, over)| count * (over - mean).powi(2)).sum::<f64>() / all).sqrt()
    };
    let longest = (-1.0 / THRESHOLDS.longest_noise_memory).exp();
    let tried = (0..=TRIED).map(|part| f64::from(part) / f64::from(TRIED) * longest);
    let best = tried.min_by(|a, b| misfit(*a).total_cmp(&misfit(*b)))?;
    // The scatter of the memory that white noise shows.
    let chance = THRESHOLDS.memory_errors * THIRD_DIFFERENCE_SCATTER / next.sqrt();
    if best < chance {
        return Some(0.0);
    }
    (misfit(best) <= THRESHOLDS.memory_misfit).then_some(best)
}

/// Memories that are tried, from none to the longest: a hundredth is below what any record shows.
const TRIED: u32 = 100;

/// Standard deviation of the memory that white noise shows, times the root of the readings: their third differences resemble each
/// other, 1 + 2 (0.75² + 0.3² + 0.05²) = 2.3 times as few are independent.
const THIRD_DIFFERENCE_SCATTER: f64 = 1.5;

/// Mean square of third differences but for outliers, over the variance of white noise's.
fn without_outliers(differences: &[f64]) -> f64 {
    let most =
        THRESHOLDS.outlying_differences * White::of(differences.to_vec()).typical * THIRD_DIFFERENCE.sqrt();
    mean_square(differences.iter().filter(|size| **size <= most)) / THIRD_DIFFERENCE
}

/// Whether what is left has to do with what the model does: itself, or the size of what is new in it, with the modelled channel or its
/// change. Noise of a sensor has to do with neither.
fn depends(left: &Left, memory: f64) -> bool {
    let (mut errors, mut news) = (Vec::new(), Vec::new());
    let (mut levels, mut changes) = (Vec::new(), Vec::new());
    for piece in left.pieces {
        let pairs = piece.clone().filter(|row| is_there(&left.residual[*row]));
        let pairs: Vec<(f64, f64)> = pairs.map(|row| (left.residual[row], (left.modelled)(row))).collect();
        for pair in pairs.windows(2) {
            let [(before, from), (now, to)] = [pair[0], pair[1]];
            errors.push(now);
            news.push((now - memory * before).abs());
            levels.push(to);
            changes.push(to - from);
        }
    }
    let is_one = |channel: &[f64], error: &[f64]| {
        Bins::of(channel, error, THRESHOLDS.bins).is_some_and(|bins| {
            let found = bins.dependence(error, THRESHOLDS.noise_surrogates);
            found.explained > found.surrogate
        })
    };
    [&levels, &changes].iter().any(|channel| is_one(channel, &errors) || is_one(channel, &news))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::moments::deviation;
    use crate::estimation::quantization_step::quantization_step;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    const COUNT: usize = 6000;
    const WHOLE: &[Range<usize>] = std::slice::from_ref(&(0..COUNT));

    fn noise(count: usize, sigma: f64) -> Vec<f64> {
        seeded(3, count, sigma)
    }

    fn seeded(seed: u64, count: usize, sigma: f64) -> Vec<f64> {
        let mut generator = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let normal = Normal::new(0.0, sigma).expect("a normal distribution");
        (0..count).map(|_| normal.sample(&mut generator)).collect()
    }

    /// What follows a signal with this memory [rows].
    fn filtered(values: &[f64], rows: f64) -> Vec<f64> {
        let keep = (-1.0 / rows).exp();
        let mut at = 0.0;
        let mut step = |value: &f64| {
            at = keep * at + (1.0 - keep) * value;
            at
        };
        values.iter().map(&mut step).collect()
    }

    /// Of a given rms.
    fn sized(values: Vec<f64>, rms: f64) -> Vec<f64> {
        let factor = rms / deviation(values.iter().copied());
        values.into_iter().map(|value| factor * value).collect()
    }

    fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| a + b).collect()
    }

    /// A rotor on levels of two random sizes, held for 3 to 25 rows, with a time constant of four rows.
    fn driven() -> Vec<f64> {
        let mut levels = Vec::new();
        for (index, size) in noise(COUNT, 1.0).iter().enumerate() {
            levels.extend(std::iter::repeat_n(size.signum(), 3 + 7 * index % 23));
        }
        filtered(&levels[..COUNT], 4.0)
    }

    fn left(residual: &[f64], modelled: &[f64]) -> SensorNoise {
        noise_left(&Left {
            residual,
            modelled: &|row| modelled[row],
            pieces: WHOLE,
            step: 0.0,
            propagated: 0.0,
        })
    }

    fn rms(values: &[f64]) -> f64 {
        mean_square(values).sqrt()
    }

    /// White noise of size 2 on a slow wave ten times as large, with spikes: the noise is found.
    #[test]
    fn noise_is_seen_through_a_wave_and_spikes() {
        let mut values = noise(6000, 2.0);
        for (row, value) in values.iter_mut().enumerate() {
            *value += 20.0 * (row as f64 * 0.02).sin() + if row % 100 == 0 { 100.0 } else { 0.0 };
        }
        // The median over 6000 third differences scatters by 2 %; spikes in 4 % of them add 5 %.
        let found = white_noise(&values, WHOLE);
        assert!((found - 2.0).abs() < 0.2, "{found}");
        assert!(!left(&values, &driven()).is_all);
    }

    /// Of a sensor that reads in every second or third row only, the noise is the same.
    #[test]
    fn noise_of_a_sensor_slower_than_the_rows_is_seen() {
        for (stride, missing) in [(2, 0.0), (2, f64::NAN), (3, 0.0)] {
            let mut values = noise(6000, 2.0);
            let slow = values.iter_mut().enumerate().filter(|(row, _)| row % stride != 0);
            slow.for_each(|(_, value)| *value = missing);
            // The median over 2000 third differences scatters by 4 %.
            for found in [white_noise(&values, WHOLE), left(&values, &driven()).rms] {
                assert!((found - 2.0).abs() < 0.25, "{stride}: {found}");
            }
        }
    }

    /// A signal that moves by a few steps from sample to sample, read in steps larger than its noise: noise and steps together
    /// are what a perfect model leaves.
    #[test]
    fn the_floor_of_a_coarse_reading_has_its_steps_in_it() {
        for (step, sigma) in [(5.0, 1.5), (3.0, 0.45), (1.5, 0.45), (10.0, 1.5), (0.1, 1.5)] {
            let truth: Vec<f64> = (0..6000).map(|row| 600.0 + 100.0 * (row as f64 * 0.2).sin()).collect();
            let read: Vec<f64> = noise(6000, sigma)
                .iter()
                .zip(&truth)
                .map(|(noise, truth)| ((truth + noise) / step).round() * step)
                .collect();
            let found = quantization_step(read.iter().copied());
            assert!((found / step - 1.0).abs() < 1e-3, "{step}: {found}");
            let residual: Vec<f64> = read.iter().zip(&truth).map(|(read, truth)| read - truth).collect();
            let rms = deviation(residual.iter().copied());
            let modelled = |row: usize| truth[row];
            let left = Left {
                residual: &residual,
                modelled: &modelled,
                pieces: WHOLE,
                step: found,
                propagated: 0.0,
            };
            let floor = noise_left(&left).rms;
            // 10 % over the floor is what counts as something missing. What steps do to a smooth signal changes sign more often
            // than noise would, which third differences take for more, by 14 % here.
            assert!((0.92..1.2).contains(&(floor / rms)), "{step}, {sigma}: {floor} of {rms}");
        }
        assert_eq!(quantization_step(noise(6000, 1.0).into_iter()), 0.0, "no steps");
    }

    #[test]
    fn noise_behind_a_filter_of_its_own_counts_with_its_rms() {
        for (seed, rows) in [1.0, 2.0, 4.0, 6.0].into_iter().enumerate() {
            let values = sized(filtered(&seeded(seed as u64, COUNT, 1.0), rows), 2.0);
            let found = left(&values, &driven());
            // Of 6,000 readings with a memory of six rows 500 are independent, and 60 drawn sets scattered by 5 %.
            assert!(found.is_all && (found.rms / 2.0 - 1.0).abs() < 0.12, "{rows}: {found:?}");
            let white = white_noise(&values, WHOLE);
            assert!(white < 1.5, "and by third differences alone with less: {white}");
        }
    }

    #[test]
    fn noise_that_comes_and_goes_counts_with_its_rms() {
        let mut values = noise(COUNT, 1.0);
        values.iter_mut().enumerate().filter(|(row, _)| row % 300 < 40).for_each(|(_, value)| *value *= 4.0);
        let found = left(&values, &driven());
        // Third differences know it to 2 %, the bursts' share of it to 3 %.
        assert!(found.is_all && (found.rms / rms(&values) - 1.0).abs() < 0.06, "{found:?}");
        assert!(white_noise(&values, WHOLE) < 0.8 * found.rms);
        // What stands beside its pieces is of another channel.
        let beside = [values, vec![100.0; COUNT]].concat();
        assert_eq!(left(&beside, &[driven(), driven()].concat()), found);
    }

    /// Of very many rows a part tells how long noise is remembered: stretches from all over, and no more than asked for.
    #[test]
    fn the_memory_of_a_long_record_is_that_of_its_stretches() {
        let pieces = [0..1_000_000, 1_000_010..1_000_030, 1_200_000..1_500_000];
        let part = part_of(&pieces);
        let rows: usize = part.iter().map(Range::len).sum();
        assert!((200_000..=250_000).contains(&rows), "{rows}");
        assert!(part.iter().all(|rows| pieces.iter().any(|it| it.start <= rows.start && rows.end <= it.end)));
        assert!(part.iter().any(|rows| rows.start < 100_000) && part.iter().any(|rows| rows.end > 1_400_000));
        assert_eq!(part_of(&pieces[1..2]), pieces[1..2], "a short one is taken as it is");
        let values = sized(filtered(&seeded(3, 300_000, 1.0), 3.0), 2.0);
        let whole = 0..values.len();
        let pieces = std::slice::from_ref(&whole);
        let found =
            noise_left(&Left { residual: &values, modelled: &|_| 0.0, pieces, step: 0.0, propagated: 0.0 });
        // 150,000 of the readings, a sixth of them independent, know it to 1 %.
        assert!(found.is_all && (found.rms / 2.0 - 1.0).abs() < 0.03, "{found:?}");
    }

    /// A path of chance that is slower than noise, a wave, and short dips are no noise of a sensor, however strong.
    #[test]
    fn what_is_slower_than_noise_or_comes_in_dips_is_not_taken_for_it() {
        let wander = filtered(&seeded(8, COUNT, 1.0), 40.0);
        let through_a_rotor = filtered(&filtered(&seeded(9, COUNT, 1.0), 25.0), 4.0);
        let wave: Vec<f64> = (0..COUNT).map(|row| (0.1 * row as f64).sin()).collect();
        let dips: Vec<f64> = (0..COUNT).map(|row| if row % 97 < 5 { -1.0 } else { 0.0 }).collect();
        for (law, name) in [wander, through_a_rotor, wave, filtered(&dips, 4.0)]
            .iter()
            .zip(["wander", "rotor", "wave", "dips"])
        {
            for size in [1.0, 1.5, 5.0, 20.0] {
                let residual = sum(&noise(COUNT, 1.0), &sized(law.clone(), size));
                let found = left(&residual, &driven());
                assert!(rms(&residual) > 1.2 * found.rms, "{name}, {size}: {found:?}");
                // Nothing but what is surely noise counts then.
                assert_eq!(found, SensorNoise::white(white_noise(&residual, WHOLE)), "{name}, {size}");
            }
        }
    }

    /// A rotor of another time constant or a row late leaves what is as short as noise, and follows the model.
    #[test]
    fn what_follows_the_model_is_not_taken_for_noise() {
        let modelled = driven();
        let late: Vec<f64> =
            modelled.iter().zip(&modelled[1..]).map(|(now, next)| next - now).chain([0.0]).collect();
        let slower: Vec<f64> = filtered(&modelled, 1.5).iter().zip(&modelled).map(|(a, b)| a - b).collect();
        for (law, name) in [late, slower].iter().zip(["late", "slower"]) {
            for size in [1.0, 1.5, 5.0, 20.0] {
                let residual = sum(&noise(COUNT, 1.0), &sized(law.clone(), size));
                let found = left(&residual, &modelled);
                assert!(!found.is_all && rms(&residual) > 1.2 * found.rms, "{name}, {size}: {found:?}");
            }
        }
        // Coloured noise of such a shape, which knows nothing of the model.
        let noise = sized(filtered(&seeded(5, COUNT, 1.0), 3.0), 2.0);
        assert!(left(&noise, &modelled).is_all);
        let follows: Vec<f64> =
            noise.iter().zip(&modelled).map(|(noise, level)| noise * (1.0 + 0.5 * level)).collect();
        assert!(!left(&follows, &modelled).is_all, "its size follows the level");
    }
}
