//! How much of an error is a function of a channel: the mean error in bins of the channel, of equal count.

use std::borrow::Cow;

use super::moments::{mean, mean_square, squares_about_mean};
use super::quantile::extremes;
use super::ranks::{RankCells, Ranks};
use super::thresholds::THRESHOLDS;
use crate::cancel;

/// Shifts that are summed up in one pass.
const SIDE_BY_SIDE: usize = 4;

/// Mean square of the error's mean by bin of the channel, less what chance alone would give, in the square of the error's unit;
/// a constant error is an error too. Rows where the channel is missing are left out; zero of too few.
#[must_use]
pub fn explained(error: &[f64], channel: &[f64]) -> f64 {
    let count = THRESHOLDS.bins;
    let mut order: Vec<usize> = (0..error.len()).filter(|row| channel[*row].is_finite()).collect();
    order.sort_by(|a, b| channel[*a].total_cmp(&channel[*b]));
    if order.len() < THRESHOLDS.fewest_in_bin * count {
        return 0.0;
    }
    let size = order.len().div_ceil(count);
    let bins = order.chunks(size).map(|bin| {
        let level = mean(&bin.iter().map(|row| error[*row]).collect::<Vec<f64>>());
        level * level * bin.len() as f64
    });
    let explained = bins.sum::<f64>() / order.len() as f64;
    let chance = (mean_square(error) - explained) * count as f64 / (order.len() - count) as f64;
    (explained - chance).max(0.0)
}

/// The share of an error's variance that is a function of a channel, beside what the channel's surrogates reach.
#[derive(Debug, Clone, PartialEq)]
pub struct BinnedDependence {
    /// [-] share of the error's variance that the mean over the channel's bins carries.
    pub explained: f64,
    /// [-] the largest share that the same channel reached, shifted in time so that it means nothing.
    pub surrogate: f64,
    /// Middle of each bin, in the channel's unit, and mean error there, in the error's unit.
    pub curve: Vec<(f64, f64)>,
}

/// A channel parted into bins of equal count, over the rows where an error is there, too.
pub struct Bins {
    /// Rows that count; `None` = all.
    kept: Option<Vec<u32>>,
    /// The bin of each of them.
    bin_of: Vec<u8>,
    /// Rows in each bin.
    counts: Vec<usize>,
    /// The channel's middle value in each bin that is not empty.
    middles: Vec<Option<f64>>,
}

impl Bins {
    /// So many, 256 at most, of a channel, for errors that are finite where `error` is; `None` when the channel hardly moves or
    /// is mostly missing.
    #[must_use]
    pub fn of(channel: &[f64], error: &[f64], bins: usize) -> Option<Self> {
        let is_there = |row: &usize| channel[*row].is_finite() && error[*row].is_finite();
        let count = (0..error.len()).filter(is_there).count();
        let known = error.iter().filter(|error| error.is_finite()).count();
        if count < THRESHOLDS.fewest_in_bin * bins || 2 * count < known {
            return None;
        }
        let kept = (count < error.len()).then(|| {
            (0..error.len()).filter(is_there).filter_map(|row| u32::try_from(row).ok()).collect::<Vec<u32>>()
        });
        let values = compressed(channel, kept.as_deref());
        let (low, high) = extremes(values.iter().copied());
        if low == high {
            return None;
        }
        let ranks = Ranks::of(&values);
        let edges = Edges::of(&ranks, count, bins);
        let bin_of: Vec<u8> = values.iter().map(|value| edges.bin(*value)).collect();
        let mut counts = vec![0; bins];
        bin_of.iter().for_each(|bin| counts[usize::from(*bin)] += 1);
        // Bins follow each other in size: the middle of one is a place among all values.
        let mut start = 0;
        let mut places = Vec::new();
        for count in counts.iter().filter(|count| **count > 0) {
            places.push(start + count / 2);
            start += count;
        }
        let mut found = ranks.at(&places).into_iter();
        let middles = counts.iter().map(|count| if *count > 0 { found.next() } else { None }).collect();
        Some(Self { kept, bin_of, counts, middles })
    }

    /// What of an error is a function of the channel, beside so many surrogates.
    #[must_use]
    pub fn dependence(&self, error: &[f64], surrogates: usize) -> BinnedDependence {
        let errors = compressed(error, self.kept.as_deref());
        let shifts = (0..=surrogates).map(|number| {
            let least = THRESHOLDS.least_shift;
            let part = least + (1.0 - 2.0 * least) * number as f64 / (surrogates + 1) as f64;
            if number == 0 { 0 } else { (part * errors.len() as f64) as usize }
        });
        let sums = shifted_sums(&self.bin_of, &errors, &shifts.collect::<Vec<usize>>());
        let variance = Variance::of(&errors);
        let shares = sums.iter().map(|sums| variance.share(sums, &self.counts));
        let shares: Vec<f64> = shares.collect();
        let own = sums.first().map_or(&[][..], |sums| &sums[..]);
        let curve = self.middles.iter().zip(own).zip(&self.counts);
        let curve = curve.filter_map(|((middle, sum), count)| Some(((*middle)?, sum / *count as f64)));
        BinnedDependence {
            explained: shares.first().copied().unwrap_or(0.0),
            surrogate: shares.iter().skip(1).copied().fold(0.0, f64::max),
            curve: curve.collect(),
        }
    }
}

fn compressed<'a>(values: &'a [f64], kept: Option<&[u32]>) -> Cow<'a, [f64]> {
    match kept {
        Some(kept) => kept.iter().map(|row| values[*row as usize]).collect(),
        None => Cow::Borrowed(values),
    }
}

/// Where one bin ends and the next begins.
struct Edges {
    cells: RankCells,
    /// Values that a row of each bin but the first lies above, ascending, and the cell of each.
    edges: Vec<(usize, f64)>,
    /// Edges in all cells below each cell, and in it.
    in_cell: Vec<(u8, u8)>,
}

impl Edges {
    /// Bins of equal count; samples of one value share one, or the order of the file would decide.
    fn of(ranks: &Ranks, count: usize, bins: usize) -> Self {
        let cells = ranks.cells();
        let last_below: Vec<usize> = (1..bins).map(|bin| (bin * count).div_ceil(bins) - 1).collect();
        let edges: Vec<(usize, f64)> =
            ranks.at(&last_below).into_iter().map(|edge| (cells.of(edge), edge)).collect();
        let mut in_cell = vec![(0, 0); cells.count()];
        for (cell, _) in &edges {
            in_cell[*cell].1 += 1;
        }
        let mut below = 0;
        for (before, inside) in &mut in_cell {
            *before = below;
            below += *inside;
        }
        Self { cells, edges, in_cell }
    }

    fn bin(&self, value: f64) -> u8 {
        let (below, inside) = self.in_cell[self.cells.of(value)];
        if inside == 0 {
            return below;
        }
        let edges = &self.edges[usize::from(below)..usize::from(below + inside)];
        below + edges.iter().map(|(_, edge)| u8::from(*edge < value)).sum::<u8>()
    }
}

/// The sum of the errors in each bin, with the channel as many samples aside as each shift says. Several shifts go side by
/// side: one would wait for its own sum at every step.
fn shifted_sums(bin_of: &[u8], errors: &[f64], shifts: &[usize]) -> Vec<[f64; 256]> {
    let mut sums = vec![[0.0; 256]; shifts.len()];
    for (shifts, sums) in shifts.chunks(SIDE_BY_SIDE).zip(sums.chunks_mut(SIDE_BY_SIDE)) {
        // From one end of the record to the next at which a shifted channel begins anew.
        let mut ends: Vec<usize> =
            shifts.iter().map(|shift| errors.len() - shift).chain([errors.len()]).collect();
        ends.sort_unstable();
        let mut from = 0;
        for to in ends {
            let part = &errors[from..to];
            let bins = |shift: &usize| {
                let start = (from + shift) % bin_of.len().max(1);
                &bin_of[start..start + part.len()]
            };
            add_up(part, &shifts.iter().map(bins).collect::<Vec<&[u8]>>(), sums);
            cancel::check();
            from = to;
        }
    }
    sums
}

fn add_up(errors: &[f64], bins: &[&[u8]], sums: &mut [[f64; 256]]) {
    if let ([a, b, c, d], [sum_a, sum_b, sum_c, sum_d]) = (bins, &mut *sums) {
        for ((((error, a), b), c), d) in errors.iter().zip(*a).zip(*b).zip(*c).zip(*d) {
            sum_a[usize::from(*a)] += error;
            sum_b[usize::from(*b)] += error;
            sum_c[usize::from(*c)] += error;
            sum_d[usize::from(*d)] += error;
        }
        return;
    }
    for (bins, sums) in bins.iter().zip(sums) {
        errors.iter().zip(*bins).for_each(|(error, bin)| sums[usize::from(*bin)] += error);
    }
}

/// The variance of an error, as the share of the bins' means is measured by it.
struct Variance {
    count: f64,
    mean: f64,
    total: f64,
}

impl Variance {
    fn of(errors: &[f64]) -> Self {
        let (mean, total) = squares_about_mean(errors.iter().copied());
        Self { count: errors.len() as f64, mean, total }
    }

    /// Share of the variance that the bins' means carry; corrected for what that many means carry of anything.
    fn share(&self, sums: &[f64], counts: &[usize]) -> f64 {
        if self.total <= 0.0 {
            return 0.0;
        }
        let used = || {
            sums.iter().zip(counts).filter(|(_, count)| **count > 0).map(|(sum, count)| (sum, *count as f64))
        };
        let between: f64 = used().map(|(sum, count)| count * (sum / count - self.mean).powi(2)).sum();
        let within = (self.total - between) / (self.count - used().count() as f64);
        (1.0 - within / (self.total / (self.count - 1.0))).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(channel: &[f64], error: &[f64]) -> Option<BinnedDependence> {
        Some(Bins::of(channel, error, 24)?.dependence(error, 19))
    }

    /// Of a law every share, of what is free of one none that its surrogates do not reach.
    #[test]
    fn a_law_is_found_in_its_channel_and_chance_is_called_chance() {
        let channel: Vec<f64> = (0..3_000).map(|k| (0.013 * f64::from(k)).sin()).collect();
        let law: Vec<f64> = channel.iter().map(|value| -0.4 * value * value).collect();
        let found = of(&channel, &law).expect("enough of both");
        assert!(found.explained > 0.95 && found.surrogate < 0.5 * found.explained, "{found:?}");
        let noise: Vec<f64> = (0..3_000).map(|k| f64::from(k * 7_919 % 1_000) / 1_000.0 - 0.5).collect();
        let found = of(&channel, &noise).expect("enough of both");
        assert!(found.explained < found.surrogate + 0.02, "{found:?}");
        assert_eq!(of(&[1.0; 3_000], &noise), None, "a channel that does not move");
    }

    /// Bins, means and shares by sorting and by one pass for each shift, as they are defined: coarse readings, missing cells.
    #[test]
    fn bins_and_shares_are_those_of_the_definition() {
        let noise = |k: usize| (k * 7_919 % 1_009) as f64 / 504.5 - 1.0;
        for (step, every) in [(1e-9, 1), (0.21, 1), (0.21, 2), (0.4, 3)] {
            let smooth = |k: usize| ((0.013 * k as f64).sin() + 0.3 * noise(k)) / step;
            let channel: Vec<f64> =
                (0..9_000).map(|k| if k % 7 == 5 { f64::NAN } else { smooth(k).round() * step }).collect();
            let error: Vec<f64> = (0..9_000)
                .map(|k| {
                    if k % every == 0 { noise(3 * k + 1) + 0.5 * (0.013 * k as f64).cos() } else { f64::NAN }
                })
                .collect();
            let kept: Vec<usize> =
                (0..9_000).filter(|k| channel[*k].is_finite() && error[*k].is_finite()).collect();
            let below = |k: &usize| kept.iter().filter(|other| channel[**other] < channel[*k]).count();
            let bin_of: Vec<usize> = kept.iter().map(|k| below(k) * 24 / kept.len()).collect();
            let share = |shift: usize| {
                let pairs = || {
                    kept.iter()
                        .enumerate()
                        .map(|(place, k)| (bin_of[(place + shift) % kept.len()], error[*k]))
                };
                let mean = pairs().map(|(_, error)| error).sum::<f64>() / kept.len() as f64;
                let total: f64 = pairs().map(|(_, error)| (error - mean).powi(2)).sum();
                let own = |bin: usize| pairs().filter(move |pair| pair.0 == bin).map(|pair| pair.1);
                let used: Vec<usize> = (0..24).filter(|bin| own(*bin).next().is_some()).collect();
                let level = |bin: usize| own(bin).sum::<f64>() / own(bin).count() as f64;
                let between: f64 =
                    used.iter().map(|bin| own(*bin).count() as f64 * (level(*bin) - mean).powi(2)).sum();
                let (within, count) = (total - between, kept.len() as f64);
                (1.0 - within / (count - used.len() as f64) / (total / (count - 1.0))).max(0.0)
            };
            let best = (1..=19)
                .map(|number| share(((0.05 + 0.9 * f64::from(number) / 20.0) * kept.len() as f64) as usize));
            let (found, best) = (of(&channel, &error).expect("enough"), best.fold(0.0, f64::max));
            assert_eq!((found.explained, found.surrogate), (share(0), best));
            // The last bin that is not empty: readings of one value share the first of theirs.
            let highest = bin_of.iter().copied().max().expect("rows");
            let in_it = (0..kept.len()).filter(|place| bin_of[*place] == highest);
            let mut inside: Vec<f64> = in_it.map(|place| channel[kept[place]]).collect();
            inside.sort_by(f64::total_cmp);
            let last = found.curve.last().expect("bins");
            assert_eq!(last.0, inside[inside.len() / 2]);
        }
    }
}
