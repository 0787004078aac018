//! Several columns that one signal may come from: of exports of other years, or of a sensor that is not always connected.

use super::signal::SignalMapping;
use crate::log::thresholds::THRESHOLDS;

/// The signals of this name, in their order: the first, and those that are read instead.
pub(super) fn of_name<'a>(
    all: &'a [SignalMapping],
    name: &'a str,
) -> impl Iterator<Item = (usize, &'a SignalMapping)> {
    all.iter().enumerate().filter(move |(_, it)| it.name == name)
}

/// Whether a file must have the columns of this signal: it is not optional, and nothing may be read instead.
pub(super) fn is_needed(all: &[SignalMapping], signal: &SignalMapping) -> bool {
    !signal.optional && of_name(all, &signal.name).count() == 1
}

/// The signals of which a file must have one of several columns, each by its first.
pub(super) fn one_of_several(all: &[SignalMapping]) -> impl Iterator<Item = &SignalMapping> {
    all.iter().filter(|it| !it.optional && !it.instead && !is_needed(all, it))
}

/// Whether a file with these columns has all that is needed.
pub(super) fn fit(all: &[SignalMapping], names: &[&str]) -> bool {
    let is_there = |it: &SignalMapping| it.columns().iter().all(|column| names.contains(column));
    let has_one = |first: &SignalMapping| of_name(all, &first.name).any(|(_, other)| is_there(other));
    all.iter().filter(|it| is_needed(all, it)).all(is_there) && one_of_several(all).all(has_one)
}

/// Whether the column of a guess is taken as the guess takes it, if it is taken for the same signal.
pub(super) fn agree(all: &[SignalMapping], guessed: &SignalMapping) -> bool {
    let is_same = |it: &SignalMapping| it.columns() == guessed.columns() && it.unit == guessed.unit;
    let mut same = of_name(all, &guessed.name).filter(|(_, it)| is_same(it));
    // A guess of a scale is a round number; two scales that are meant to differ do so by far more.
    same.all(|(_, it)| (guessed.scale / it.scale - 1.0).abs() < THRESHOLDS.same_scale)
}
