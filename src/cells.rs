//! The cells of a column. A log, what is judged of it and what is fitted to it hold the same numbers: copies and parts share them
//! until one is changed.

use std::ops::{Deref, DerefMut, Range};
use std::sync::{Arc, OnceLock};

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
    all: Held,
    rows: Range<usize>,
}

/// How the cells of a column are held.
#[derive(Debug, Clone)]
enum Held {
    Each(Arc<Vec<f64>>),
    Few(Arc<FewCells>),
}

/// A long column of which most cells are missing.
#[derive(Debug)]
struct FewCells {
    /// Those that are not, ascending.
    rows: Vec<u32>,
    values: Vec<f64>,
    len: usize,
    /// Each of them, once somebody asks for cells that stay.
    each: OnceLock<Vec<f64>>,
}

impl FewCells {
    fn of(cells: &[f64]) -> Self {
        let there = || (0..).zip(cells).filter(|(_, value)| !value.is_nan());
        let count = there().count();
        let (mut rows, mut values) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for (row, value) in there() {
            rows.push(row);
            values.push(*value);
        }
        Self { rows, values, len: cells.len(), each: OnceLock::new() }
    }

    fn each(&self) -> Vec<f64> {
        let mut each = vec![f64::NAN; self.len];
        self.rows.iter().zip(&self.values).for_each(|(row, value)| each[*row as usize] = *value);
        each
    }
}

impl Held {
    fn len(&self) -> usize {
        match self {
            Self::Each(each) => each.len(),
            Self::Few(few) => few.len,
        }
    }

    fn each(&self) -> &[f64] {
        match self {
            Self::Each(each) => each,
            Self::Few(few) => few.each.get_or_init(|| few.each()),
        }
    }
}

impl Cells {
    /// Rows from which on a column is long: shorter ones take no memory that anybody would miss.
    pub const LONG: usize = 1 << 19;

    /// The cells of some of the rows, clipped to what is there.
    #[must_use]
    pub fn part(&self, rows: Range<usize>) -> Self {
        let end = self.rows.end.min(self.rows.start.saturating_add(rows.end));
        let start = end.min(self.rows.start.saturating_add(rows.start));
        Self { all: self.all.clone(), rows: start..end }
    }

    /// The cells alone; copied only where others hold them, too, or more than these.
    #[must_use]
    pub fn into_vec(self) -> Vec<f64> {
        match self.all {
            Held::Each(each) if self.rows == (0..each.len()) => {
                Arc::try_unwrap(each).unwrap_or_else(|shared| shared.to_vec())
            }
            _ => self.to_vec(),
        }
    }

    /// How many there are in memory: of a long column of few, those.
    pub(crate) fn held(&self) -> usize {
        match &self.all {
            Held::Few(few) => few.values.len(),
            Held::Each(_) => self.rows.len(),
        }
    }

    /// Whether any of them is a number.
    #[must_use]
    pub fn has_any(&self) -> bool {
        match &self.all {
            Held::Few(few) if self.rows.len() == few.len => few.values.iter().any(|value| value.is_finite()),
            _ => self.iter().any(|value| value.is_finite()),
        }
    }

    /// The same for who asks for them once: of a long column of few they are let go of with what this gives.
    #[must_use]
    pub fn for_once(&self) -> Self {
        match &self.all {
            Held::Few(few) if few.each.get().is_none() => {
                Self { all: Held::Each(Arc::new(few.each())), rows: self.rows.clone() }
            }
            _ => self.clone(),
        }
    }

    /// Keeps of a long column of which most cells are missing only those that are not, where no more than so many hold it; whether it
    /// did.
    pub(crate) fn keep_few(&mut self, holders: usize) -> bool {
        let Held::Each(each) = &self.all else { return false };
        let is_alone = Arc::strong_count(each) <= holders && self.rows == (0..each.len());
        let there = || each.iter().filter(|value| !value.is_nan()).count();
        let is_sparse = each.len() >= Self::LONG
            && u32::try_from(each.len()).is_ok()
            && is_alone
            && 2 * there() < each.len();
        if is_sparse {
            self.all = Held::Few(Arc::new(FewCells::of(each)));
        }
        is_sparse
    }

    /// Whether both hold the same cells, and not only equal ones.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let is_held_together = match (&self.all, &other.all) {
            (Held::Each(one), Held::Each(other)) => Arc::ptr_eq(one, other),
            (Held::Few(one), Held::Few(other)) => Arc::ptr_eq(one, other),
            _ => false,
        };
        is_held_together && self.rows == other.rows
    }
}

impl Default for Cells {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl From<Vec<f64>> for Cells {
    fn from(cells: Vec<f64>) -> Self {
        Self { rows: 0..cells.len(), all: Held::Each(Arc::new(cells)) }
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
        self.all.each().get(self.rows.clone()).unwrap_or_default()
    }
}

impl DerefMut for Cells {
    fn deref_mut(&mut self) -> &mut [f64] {
        if self.rows.len() < self.all.len() || matches!(self.all, Held::Few(_)) {
            *self = self.to_vec().into();
        }
        match &mut self.all {
            Held::Each(each) => Arc::make_mut(each).as_mut_slice(),
            // Made one of each just now.
            Held::Few(_) => &mut [],
        }
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

    /// A long column of one value in three, and the same cells held by themselves.
    fn sparse() -> (Cells, Cells) {
        let value = |row: usize| if row % 3 == 1 { row as f64 } else { f64::NAN };
        let each: Cells = (0..Cells::LONG).map(value).collect();
        let mut few = each.to_vec().into();
        assert!(Cells::keep_few(&mut few, 1));
        (each, few)
    }

    fn bits(cells: &[f64]) -> Vec<Option<u64>> {
        cells.iter().map(|cell| (!cell.is_nan()).then(|| cell.to_bits())).collect()
    }

    #[test]
    fn a_column_of_few_cells_reads_as_one_of_each() {
        let (each, few) = sparse();
        for view in [few.for_once(), few.part(0..Cells::LONG), few.clone()] {
            assert_eq!(bits(&view), bits(&each));
        }
        assert_eq!(bits(&few.part(5..9)), bits(&each[5..9]));
        assert_eq!(bits(&few.part(7..99).for_once().part(1..4)), bits(&each[8..11]));
        assert_eq!(bits(&few.into_vec()), bits(&each));
    }

    #[test]
    fn few_cells_take_no_room_for_the_others_until_they_are_asked_for() {
        let (_, few) = sparse();
        let is_spread = || matches!(&few.all, Held::Few(few) if few.each.get().is_some());
        assert!(few.has_any() && few.for_once().has_any() && few.part(0..3).for_once().len() == 3);
        assert!(!is_spread());
        assert!(few[4] == 4.0 && is_spread());
    }

    #[test]
    fn a_copy_of_few_cells_that_is_written_to_is_its_own() {
        let (_, few) = sparse();
        let mut copy = few.clone();
        copy[0] = 7.0;
        assert_eq!((copy[0], copy[1]), (7.0, 1.0));
        assert!(few[0].is_nan() && !copy.is_same(&few) && few.is_same(&few.clone()));
    }

    #[test]
    fn cells_that_others_hold_and_columns_mostly_there_stay_as_they_are() {
        let (mut each, _) = sparse();
        let other = each.clone();
        assert!(!each.keep_few(1) && each.is_same(&other), "held by another");
        assert!(each.keep_few(2) && !each.is_same(&other));
        let half = |row: usize| if row.is_multiple_of(2) { 1.0 } else { f64::NAN };
        assert!(!(0..Cells::LONG).map(half).collect::<Cells>().keep_few(1), "half of it is there");
        assert!(!vec![f64::NAN; Cells::LONG - 1].into_iter().collect::<Cells>().keep_few(1), "short");
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
