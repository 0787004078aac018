//! The values at given places in ascending order, of very many, without sorting them.

use super::quantile::extremes;

/// Cells of equal width between the least and the greatest value.
const CELLS: usize = 1 << 14;
/// Values below which sorting is as quick.
const FEW: usize = 1 << 11;

/// Values counted by cells.
pub(crate) struct Ranks<'a> {
    values: &'a [f64],
    cells: RankCells,
    /// Values in all cells below each.
    below: Vec<usize>,
}

/// Which cell a value lies in; a greater value never in a lower one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RankCells {
    low: f64,
    scale: f64,
    count: usize,
}

impl RankCells {
    fn between(low: f64, high: f64, values: usize) -> Self {
        let count = if values < FEW { 1 } else { CELLS };
        let scale = count as f64 / (high - low);
        // A range that is too narrow or too wide for it: one cell.
        if scale.is_finite() && scale > 0.0 {
            Self { low, scale, count }
        } else {
            Self { low, scale: 0.0, count: 1 }
        }
    }

    pub fn count(&self) -> usize {
        self.count
    }

    pub fn of(&self, value: f64) -> usize {
        (((value - self.low) * self.scale) as usize).min(self.count - 1)
    }
}

impl<'a> Ranks<'a> {
    /// Of finite values.
    pub fn of(values: &'a [f64]) -> Self {
        let (low, high) = extremes(values.iter().copied());
        let cells = RankCells::between(low, high, values.len());
        let mut below = vec![0; cells.count + 1];
        values.iter().for_each(|value| below[cells.of(*value) + 1] += 1);
        for cell in 0..cells.count {
            below[cell + 1] += below[cell];
        }
        Self { values, cells, below }
    }

    pub fn cells(&self) -> RankCells {
        self.cells
    }

    /// The values at these places, from 0, themselves ascending, in the ascending order of all.
    pub fn at(&self, places: &[usize]) -> Vec<f64> {
        let cell_of = |place: usize| self.below.partition_point(|below| *below <= place) - 1;
        let mut wanted = vec![false; self.cells.count];
        places.iter().for_each(|place| wanted[cell_of(*place)] = true);
        // Of each cell that is wanted the values, one cell behind the other.
        let mut starts = vec![0; self.cells.count];
        let mut room = 0;
        for cell in (0..self.cells.count).filter(|cell| wanted[*cell]) {
            starts[cell] = room;
            room += self.below[cell + 1] - self.below[cell];
        }
        let (mut ends, mut inside) = (starts.clone(), vec![0.0; room]);
        for value in self.values {
            let cell = self.cells.of(*value);
            if wanted[cell] {
                inside[ends[cell]] = *value;
                ends[cell] += 1;
            }
        }
        for cell in (0..self.cells.count).filter(|cell| wanted[*cell]) {
            inside[starts[cell]..ends[cell]].sort_unstable_by(f64::total_cmp);
        }
        let value = |place: &usize| {
            let cell = cell_of(*place);
            inside[starts[cell] + place - self.below[cell]]
        };
        places.iter().map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::quantile::sorted;

    #[test]
    fn they_are_those_of_the_sorted_values() {
        let noise = |k: u64| ((k * 2_654_435_761) % 1_000_003) as f64;
        let spread: Vec<f64> = (0..20_000).map(noise).collect();
        let coarse: Vec<f64> = (0..20_000).map(|k| (noise(k) / 3e5).round() - 1.0).collect();
        let outlier: Vec<f64> = spread.iter().copied().chain([1e300, -1e300]).collect();
        for values in [&spread, &coarse, &outlier, &spread[..7].to_vec(), &vec![-2.0; 9_000], &vec![0.0]] {
            let places: Vec<usize> = (0..values.len()).step_by(1 + values.len() / 47).collect();
            let ordered = sorted(values.iter().copied());
            let expected: Vec<f64> = places.iter().map(|place| ordered[*place]).collect();
            assert_eq!(Ranks::of(values).at(&places), expected);
        }
    }
}
