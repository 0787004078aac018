//! The cells of a column. A log, what is judged of it and what is fitted to it hold the same numbers: copies and parts share them
//! until one is changed.

use std::ops::{Deref, DerefMut, Range};
use std::sync::Arc;

/// Cells of a column, one for each row; not-a-number = missing. A copy, and a part, costs nothing: it takes cells of its own when
/// it is written to.
///
/// ```
/// use rotorbench::cells::Cells;
///
/// let column = Cells::from(vec![1.0, 2.0, 3.0]);
/// let mut part = column.part(1..3);
/// part[0] = 7.0;
/// assert_eq!((&part[..], &column[..]), (&[7.0, 3.0][..], &[1.0, 2.0, 3.0][..]));
/// ```
#[derive(Debug, Clone)]
pub struct Cells {
    all: Arc<Vec<f64>>,
    rows: Range<usize>,
}

impl Cells {
    /// The cells of some of the rows, clipped to what is there.
    #[must_use]
    pub fn part(&self, rows: Range<usize>) -> Self {
        let end = self.rows.end.min(self.rows.start.saturating_add(rows.end));
        let start = end.min(self.rows.start.saturating_add(rows.start));
        Self { all: Arc::clone(&self.all), rows: start..end }
    }

    /// The cells alone; copied only where others hold them, too, or more than these.
    #[must_use]
    pub fn into_vec(self) -> Vec<f64> {
        if self.rows != (0..self.all.len()) {
            return self.to_vec();
        }
        Arc::try_unwrap(self.all).unwrap_or_else(|shared| shared.to_vec())
    }
}

impl Default for Cells {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl From<Vec<f64>> for Cells {
    fn from(cells: Vec<f64>) -> Self {
        Self { rows: 0..cells.len(), all: Arc::new(cells) }
    }
}

impl FromIterator<f64> for Cells {
    fn from_iter<I: IntoIterator<Item = f64>>(cells: I) -> Self {
        cells.into_iter().collect::<Vec<f64>>().into()
    }
}

impl Deref for Cells {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        // Its rows are never beyond the end.
        self.all.get(self.rows.clone()).unwrap_or_default()
    }
}

impl DerefMut for Cells {
    fn deref_mut(&mut self) -> &mut [f64] {
        if self.rows.len() < self.all.len() {
            *self = self.to_vec().into();
        }
        Arc::make_mut(&mut self.all).as_mut_slice()
    }
}

impl PartialEq for Cells {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

impl<'a> IntoIterator for &'a Cells {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_share_what_is_not_written_to() {
        let column = Cells::from(vec![0.0, 1.0, 2.0, 3.0]);
        let (part, mut copy) = (column.part(1..9), column.clone());
        assert_eq!(part[..], [1.0, 2.0, 3.0]);
        assert_eq!(part.part(1..2)[..], [2.0]);
        assert!(part.part(7..9).is_empty());
        assert!(std::ptr::eq(&column[1], &part[0]));
        copy[1] = 5.0;
        assert_eq!((column[1], copy[1], part[0]), (1.0, 5.0, 1.0));
        assert!(std::ptr::eq(&column[1], &part[0]));
    }

    #[test]
    fn cells_that_nobody_else_holds_are_not_copied() {
        let column = Cells::from(vec![0.0, 1.0, 2.0]);
        let first: *const f64 = &column[0];
        let part = column.part(1..3);
        assert_eq!((column.clone().into_vec(), part.into_vec()), (vec![0.0, 1.0, 2.0], vec![1.0, 2.0]));
        assert!(std::ptr::eq(&column.into_vec()[0], first));
    }
}
