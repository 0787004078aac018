//! Residuals of rows in which something was measured: of a sensor slower than the rows they are few, and the others, which are
//! zero, need not be kept.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use super::thresholds::THRESHOLDS;

/// The rows of a residual vector in which something was measured.
#[derive(Debug, PartialEq, Eq)]
pub struct MeasuredRows {
    /// Ascending.
    rows: Vec<u32>,
    /// Length of the whole vector.
    len: usize,
    /// The units of the vector, counted in measured rows.
    units: Vec<Range<usize>>,
}

impl MeasuredRows {
    /// Those of a vector with these units, of `measured` values for each row; `None` where they are most of it.
    #[must_use]
    pub fn of(measured: impl Iterator<Item = bool> + Clone, units: &[Range<usize>]) -> Option<Arc<Self>> {
        let (len, count) = (measured.clone().count(), measured.clone().filter(|is| *is).count());
        if u32::try_from(len).is_err() || count as f64 > THRESHOLDS.mostly_measured * len as f64 {
            return None;
        }
        let mut rows = Vec::with_capacity(count);
        rows.extend(measured.zip(0..).filter_map(|(is_measured, row)| is_measured.then_some(row)));
        let mut found = Self { rows, len, units: Vec::new() };
        found.units = units.iter().map(|unit| found.within(unit)).collect();
        Some(Arc::new(found))
    }

    /// The units of the vector, counted in measured rows.
    #[must_use]
    pub fn units(&self) -> &[Range<usize>] {
        &self.units
    }

    /// How many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// The places of a part of the vector among the measured rows.
    #[must_use]
    pub fn within(&self, part: &Range<usize>) -> Range<usize> {
        let place = |at: usize| self.rows.partition_point(|row| (*row as usize) < at);
        place(part.start)..place(part.end)
    }

    /// What stands in the measured rows at these `places` of a part of a whole vector that begins at `start`.
    pub(crate) fn take_part(&self, places: Range<usize>, (start, part): (usize, &[f64]), taken: &mut [f64]) {
        for (taken, row) in taken.iter_mut().zip(&self.rows[places]) {
            *taken = part[*row as usize - start];
        }
    }

    /// What stands in these rows of a whole vector.
    pub(crate) fn take(&self, whole: &[f64], taken: &mut Vec<f64>) {
        taken.clear();
        taken.extend(self.rows.iter().map(|row| whole[*row as usize]));
    }
}

/// A residual vector: measured minus simulated over its standard deviation, zero where nothing was measured. Copies share it.
#[derive(Debug, Clone)]
pub struct Residuals {
    measured: Arc<Vec<f64>>,
    rows: Option<Arc<MeasuredRows>>,
}

impl Residuals {
    /// Of the values in these rows, or in all.
    pub(crate) fn of_measured(measured: Vec<f64>, rows: Option<Arc<MeasuredRows>>) -> Self {
        Self { measured: Arc::new(measured), rows }
    }

    /// Of a whole vector, of which these rows are kept.
    #[must_use]
    pub fn of(whole: Vec<f64>, rows: Option<&Arc<MeasuredRows>>) -> Self {
        let Some(rows) = rows else { return whole.into() };
        let mut measured = Vec::with_capacity(rows.count());
        rows.take(&whole, &mut measured);
        Self::of_measured(measured, Some(Arc::clone(rows)))
    }

    /// The whole vector.
    #[must_use]
    pub fn all(&self) -> Cow<'_, [f64]> {
        let Some(rows) = &self.rows else { return Cow::Borrowed(&self.measured) };
        let mut whole = vec![0.0; rows.len];
        rows.rows.iter().zip(self.measured.iter()).for_each(|(row, value)| whole[*row as usize] = *value);
        Cow::Owned(whole)
    }

    /// A vector of zeros, of which these rows are kept.
    pub(crate) fn zero(len: usize, rows: Option<&Arc<MeasuredRows>>) -> Self {
        let kept = rows.map_or(len, |rows| rows.count());
        Self::of_measured(vec![0.0; kept], rows.map(Arc::clone))
    }

    /// Adds another one, of the same length, in the rows that are kept.
    pub(crate) fn add(&mut self, other: &Self) {
        let sums = Arc::make_mut(&mut self.measured);
        let values = other.measured.iter();
        match (&self.rows, &other.rows) {
            (None, None) => sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value),
            (None, Some(theirs)) => {
                theirs.rows.iter().zip(values).for_each(|(row, value)| sums[*row as usize] += value);
            }
            (Some(own), None) => {
                let pairs = sums.iter_mut().zip(&own.rows);
                pairs.for_each(|(sum, row)| *sum += other.measured[*row as usize]);
            }
            (Some(own), Some(theirs)) => {
                let mut own = sums.iter_mut().zip(&own.rows).peekable();
                for (row, value) in theirs.rows.iter().zip(values) {
                    while own.next_if(|(_, kept)| *kept < row).is_some() {}
                    if let Some((sum, _)) = own.next_if(|(_, kept)| *kept == row) {
                        *sum += value;
                    }
                }
            }
        }
    }

    /// The whole vector minus another one, of the same length.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Vec<f64> {
        let difference = |one: &[f64], other: &[f64]| -> Vec<f64> {
            one.iter().zip(other).map(|(one, other)| one - other).collect()
        };
        if self.rows != other.rows {
            return difference(&self.all(), &other.all());
        }
        let of_measured = difference(&self.measured, &other.measured);
        Self::of_measured(of_measured, self.rows.clone()).all().into_owned()
    }

    /// What stands in these parts of the whole vector, one behind the other, and where each of them stands there.
    #[must_use]
    pub fn of_parts(&self, parts: &[Range<usize>]) -> (Vec<f64>, Vec<Range<usize>>) {
        let mut end = 0;
        let places = parts.iter().map(|part| {
            let start = end;
            end += part.len();
            start..end
        });
        let places: Vec<Range<usize>> = places.collect();
        let mut joined = vec![0.0; end];
        for (part, place) in parts.iter().zip(&places) {
            let (to, Some(rows)) = (&mut joined[place.clone()], &self.rows) else {
                joined[place.clone()].copy_from_slice(&self.measured[part.clone()]);
                continue;
            };
            let kept = rows.within(part);
            let pairs = rows.rows[kept.clone()].iter().zip(&self.measured[kept]);
            pairs.for_each(|(row, value)| to[*row as usize - part.start] = *value);
        }
        (joined, places)
    }

    /// The same without rows in which nothing was measured, as far as these are left out; in order.
    #[must_use]
    pub fn measured(&self) -> &[f64] {
        &self.measured
    }

    /// Length of the whole vector.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.as_ref().map_or(self.measured.len(), |rows| rows.len)
    }

    /// Whether the whole vector is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What is kept of a part of the whole vector.
    #[must_use]
    pub fn part(&self, part: &Range<usize>) -> &[f64] {
        &self.measured[self.rows.as_ref().map_or_else(|| part.clone(), |rows| rows.within(part))]
    }
}

impl From<Vec<f64>> for Residuals {
    fn from(whole: Vec<f64>) -> Self {
        Self { measured: Arc::new(whole), rows: None }
    }
}

impl PartialEq for Residuals {
    fn eq(&self, other: &Self) -> bool {
        self.all() == other.all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_are_left_out_come_back_as_zeros() {
        let measured = (0..20).map(|row| row % 5 == 2);
        let rows = MeasuredRows::of(measured, &[0..7, 7..7, 7..20]).expect("few");
        assert_eq!((rows.count(), rows.units()), (4, &[0..1, 1..1, 1..4][..]));
        let whole: Vec<f64> = (0..20).map(|row| if row % 5 == 2 { f64::from(row) } else { 0.0 }).collect();
        let found = Residuals::of(whole.clone(), Some(&rows));
        assert_eq!((found.measured(), found.len()), (&[2.0, 7.0, 12.0, 17.0][..], 20));
        assert_eq!(found.all(), whole);
        assert_eq!((found.part(&(7..20)), found.part(&(8..12))), (&[7.0, 12.0, 17.0][..], &[][..]));
        let whole: Residuals = whole.into();
        let twice: Residuals = whole.all().iter().map(|value| 2.0 * value).collect::<Vec<f64>>().into();
        assert_eq!(Residuals::from(twice.minus(&found)), found);
        assert_eq!(Residuals::of(twice.all().into_owned(), Some(&rows)).minus(&found), *whole.all());
        for residuals in [&found, &whole] {
            let (joined, places) = residuals.of_parts(&[11..14, 3..3, 0..8]);
            assert_eq!(joined, [0.0, 12.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 7.0]);
            assert_eq!(places, [0..3, 3..3, 3..11]);
        }
        assert_eq!(found, whole);
    }

    #[test]
    fn a_sum_is_that_of_the_whole_vectors_in_the_rows_that_are_kept() {
        let unit = std::slice::from_ref(&(0..20));
        let each =
            |every: usize| MeasuredRows::of((0..20).map(move |row| row % every == 2), unit).expect("few");
        // Of each pair some rows are in both, behind some that are in one alone.
        let few = [Some(each(8)), None, Some(each(4)), Some(each(5)), None];
        let whole: Vec<f64> = (0..20).map(|row| f64::from(row) + 0.5).collect();
        for own in &few {
            let mut sum = Residuals::zero(20, own.as_ref());
            let mut expected = vec![0.0; 20];
            for other in &few {
                let other = Residuals::of(whole.clone(), other.as_ref());
                sum.add(&other);
                expected.iter_mut().zip(&*other.all()).for_each(|(sum, value)| *sum += value);
            }
            assert_eq!(sum, Residuals::of(expected, own.as_ref()), "{own:?}");
        }
    }

    #[test]
    fn where_most_is_measured_all_is_kept() {
        assert!(MeasuredRows::of((0..20).map(|row| row != 3), std::slice::from_ref(&(0..20))).is_none());
    }
}
