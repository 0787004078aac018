//! What the columns of a foreign table may mean, guessed from their names, units and values. A guess is shown and mended, and
//! becomes a mapping file; nothing is fitted on one that nobody saw.

mod command;
mod meanings;
mod near;
mod words;

use serde::Serialize;

use command::asked_voltage;
use meanings::{ASKED, GROWING, MEANINGS, Meaning};
pub use near::{is_divided_by_poles, may_be_command, meant_by, possible_commands};
use words::{Words, measures, number_sides, weight};

use super::mapping::SignalMapping;
use super::signals::{MOST_ROTORS, log_signal};
use super::sniff::SampledColumn;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::{extremes, median, quantile};
use crate::signal::columns;
use crate::unit::Unit;

/// Values of a column that are shown beside the guess.
const SHOWN: usize = 5;

/// How sure a guess is.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Certainty {
    /// The name says what it is, and its unit.
    Named,
    /// The name says what it is; the unit is guessed from the values.
    UnitGuessed,
    /// The name says a rate of the motor's field: the rotor's times the pole pairs, whose number is assumed.
    Electrical,
    /// The name says a rate of the motor's field, of a stand whose software divides it by the poles that it was given.
    ByPoles,
    /// Nothing is known of it: it is carried along under its own name.
    Unknown,
    /// No number is seen in it: it is left out.
    Empty,
    /// Nothing is known of it, and text is in it: it is left out.
    Text,
    /// Somebody has said so.
    Said,
    /// Somebody has said that it is left out.
    LeftOut,
}

impl Certainty {
    /// Whether the column becomes a signal.
    #[must_use]
    pub fn is_read(self) -> bool {
        !matches!(self, Self::Empty | Self::Text | Self::LeftOut)
    }
}

/// What a column may mean.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GuessedColumn {
    /// Its name in the file.
    pub column: String,
    /// The signal that it becomes, `time_s` among them; its own name where nothing is known of it.
    pub signal: String,
    /// Unit of its values; empty where nothing is known of it.
    pub unit: String,
    /// Factor and offset before the unit.
    pub scale: f64,
    /// Added after the factor.
    pub offset: f64,
    /// How sure that is.
    pub certainty: Certainty,
    /// The first values that are there.
    pub samples: Vec<f64>,
    /// Whether all values that were looked at are 0, as of a sensor that is not connected.
    pub reads_zero: bool,
    /// The greatest size of a voltage that goes to 0 or in steps, as one that a motor is given and no battery's; `null` of any other.
    pub asked_volts: Option<f64>,
    /// Cells that are no numbers, of those that were looked at, each once: where the column is read they count as missing.
    pub texts: Vec<String>,
}

/// Guesses what each column means. A signal is given once: to the first column that means it, to one that reads nothing but zero
/// only where no other does, and to an electrical rate likewise; to one that a stand divided by poles only where what counts the
/// rotor's own turns reads nothing but zero.
#[must_use]
pub fn guess(columns: &[SampledColumn]) -> Vec<GuessedColumn> {
    let mut words: Vec<Words> = columns.iter().map(|column| Words::of(&column.name)).collect();
    let first = usize::from(words.iter().all(|words| words.number != Some(0)));
    number_sides(&mut words, first);
    let of = |(column, own): (&SampledColumn, &Words)| {
        let is_same_kind = |(_, other): &(&SampledColumn, &Words)| own.is_like(other);
        let same_kind =
            || columns.iter().zip(&words).filter(is_same_kind).map(|(column, _)| column).collect();
        let meant = meant(column, own, first, &same_kind);
        meant.filter(|_| !words.iter().any(|other| own.is_letter_and(other)))
    };
    let mut meant: Vec<_> = columns.iter().zip(&words).map(of).collect();
    leave_out_idle(&mut meant);
    let asked = leave_out_asked(&mut meant, columns);
    let both = || meant.iter().flatten();
    let reads = |signal: &str| both().any(|it| it.signal == signal && !it.reads_zero);
    let has_other = |signal: &str, reads: bool| {
        let counts = |it: &GuessedColumn| it.certainty != Certainty::Electrical && !(reads && it.reads_zero);
        both().any(|it| it.signal == signal && counts(it))
    };
    let mut found: Vec<GuessedColumn> = Vec::new();
    for ((column, meant), asked_volts) in columns.iter().zip(&meant).zip(asked) {
        if column.name.is_empty() {
            continue;
        }
        let is_taken = |it: &GuessedColumn| {
            let reads = reads(&it.signal);
            let is_second = it.certainty == Certainty::Electrical && has_other(&it.signal, reads);
            let is_dead = reads && it.reads_zero;
            is_second || is_dead || found.iter().any(|other| other.signal == it.signal)
        };
        let guessed = meant.clone().filter(|it| !is_taken(it)).unwrap_or_else(|| unknown(column, &found));
        found.push(GuessedColumn { asked_volts, ..guessed });
    }
    found
}

/// Leaves out the rates that a stand divided by poles, but for those that stand in for a sensor that is not connected.
fn leave_out_idle(meant: &mut [Option<GuessedColumn>]) {
    let counted = |it: &&GuessedColumn| !matches!(it.certainty, Certainty::Electrical | Certainty::ByPoles);
    let dead: Vec<String> = {
        let all = || meant.iter().flatten().filter(counted);
        let is_dead = |signal: &str| all().filter(|it| it.signal == signal).all(|it| it.reads_zero);
        all().filter(|it| is_dead(&it.signal)).map(|it| it.signal.clone()).collect()
    };
    for it in meant {
        let is_idle = |it: &mut GuessedColumn| {
            it.certainty == Certainty::ByPoles && (it.reads_zero || !dead.contains(&it.signal))
        };
        it.take_if(is_idle);
    }
}

/// The greatest sizes of voltages that move as what is asked for does; those that go to 0 are left out: they are no battery's.
fn leave_out_asked(meant: &mut [Option<GuessedColumn>], columns: &[SampledColumn]) -> Vec<Option<f64>> {
    let of = |(meant, column): (&mut Option<GuessedColumn>, &SampledColumn)| {
        let asked = asked_voltage(&meant.as_ref()?.signal, column)?;
        meant.take_if(|_| asked.goes_to_zero);
        Some(asked.greatest)
    };
    meant.iter_mut().zip(columns).map(of).collect()
}

/// Whether it reads nothing but zero: a sensor that is not connected.
fn is_zero(column: &SampledColumn) -> bool {
    column.values.iter().all(|value| value.is_nan() || *value == 0.0)
}

/// [s] from row to row, by the first values of the time; `None` where no column is the time.
#[must_use]
pub fn rows_apart(guessed: &[GuessedColumn]) -> Option<f64> {
    let time = guessed.iter().find(|it| it.signal == columns::TIME)?;
    let unit = Unit::parse(&time.unit, "s").ok()?;
    median(time.samples.windows(2).map(|pair| unit.to_si(pair[1]) - unit.to_si(pair[0])))
}

/// The signals of a guess as a mapping has them, time apart; where a body's angle is there and no rate, its rate is the angle's slope,
/// unless the rows are so far apart that none shows: the table of a thrust stand names its propeller's pitch.
#[must_use]
pub fn signals(guessed: &[GuessedColumn]) -> Vec<SignalMapping> {
    // A name that is there twice names no column.
    let is_one =
        |it: &GuessedColumn| guessed.iter().filter(|other| other.column == it.column).nth(1).is_none();
    let is_read = |it: &&GuessedColumn| it.signal != columns::TIME && it.certainty.is_read() && is_one(it);
    let signals = guessed.iter().filter(is_read);
    let mapped = signals.map(|it| SignalMapping {
        name: it.signal.clone(),
        column: Some(it.column.clone()),
        columns: Vec::new(),
        combine: None,
        weights: Vec::new(),
        slope: false,
        time_column: None,
        unit: log_signal(&it.signal).map(|_| it.unit.clone()),
        scale: it.scale,
        offset: it.offset,
        clamp: columns::is_command(&it.signal).then_some([0.0, 1.0]),
        valid: None,
        rows_later: 0,
        optional: false,
        instead: false,
    });
    let mut mapped: Vec<SignalMapping> = mapped.collect();
    let is_slow = rows_apart(guessed).is_some_and(|step| step > THRESHOLDS.guess_interval.1);
    let angle = mapped.iter().find(|it| it.name == columns::BODY_ANGLE && !is_slow);
    if let Some(angle) = angle.filter(|_| mapped.iter().all(|it| it.name != columns::BODY_RATE)) {
        let unit = angle.unit.as_ref().map(|unit| format!("{unit}/s"));
        mapped.push(SignalMapping {
            name: columns::BODY_RATE.to_owned(),
            unit,
            slope: true,
            ..angle.clone()
        });
    }
    mapped
}

impl Meaning {
    /// Whether a name says this.
    fn is_named_by(&self, words: &Words) -> bool {
        let more = self.with.is_empty() || self.with.iter().any(|word| words.has(word));
        more && self.words.iter().any(|word| words.has(word)) && !self.is_excluded_by(words)
    }

    /// Whether a name says that it is something else.
    fn is_excluded_by(&self, words: &Words) -> bool {
        let is_asked = self.is_measured() && ASKED.iter().any(|word| words.has(word));
        is_asked || self.without.iter().any(|word| words.has(word) && !words.is_electrical_by(word))
    }

    /// Whether a sensor gives it, not whoever asks for something.
    fn is_measured(&self) -> bool {
        ![columns::TIME, columns::ANY_COMMAND, columns::TORQUE_COMMAND].contains(&self.signal)
    }
}

/// The unit that a column's name says it has, of those that measure the SI unit `si`.
#[must_use]
pub fn said_unit(column: &str, si: &str) -> Option<&'static str> {
    let unit = Words::of(column).unit?;
    let unit = if si == "N" { weight(unit) } else { unit };
    measures(unit, si).then_some(unit)
}

/// The first meaning that a name has.
fn meaning_of(words: &Words) -> Option<&'static Meaning> {
    MEANINGS.iter().find(|meaning| {
        let fits =
            words.unit_for(meaning).is_none_or(|unit| measures(unit, meaning.si) || is_pulse(meaning, unit));
        let by_unit = meaning.by_unit && words.unit.is_some() && !meaning.is_excluded_by(words);
        fits && (meaning.is_named_by(words) || by_unit)
    })
}

/// What a column means, of those that count rotors from `first` on; `same_kind` are those of the same name for all rotors.
fn meant<'a>(
    column: &SampledColumn,
    words: &Words,
    first: usize,
    same_kind: &dyn Fn() -> Vec<&'a SampledColumn>,
) -> Option<GuessedColumn> {
    if let Some(known) = log_signal(&column.name) {
        return Some(guessed(column, column.name.clone(), known.unit, (1.0, 0.0), Certainty::Named));
    }
    let meaning = meaning_of(words)?;
    let number = words.number.map_or(1, |number| number + 1 - first);
    if !(1..=MOST_ROTORS).contains(&number) {
        return None;
    }
    let signal = columns::of_number(meaning.signal, number);
    let is_of_rotor = signal != meaning.signal;
    if is_of_rotor && words.has_part_name || meaning.signal != columns::TIME && words.is_of_unknown_unit {
        return None;
    }
    let is_no_number =
        column.values.iter().all(|value| value.is_nan()) || column.texts.len() > THRESHOLDS.guess_texts;
    if is_no_number || is_named_time_alone(meaning, words, column) {
        return None;
    }
    if meaning.signal == columns::ANY_COMMAND {
        let (unit, scale, offset, is_named) = command::comes_in(words, &same_kind())?;
        let certainty = if is_named { Certainty::Named } else { Certainty::UnitGuessed };
        return Some(guessed(column, signal, unit, (scale, offset), certainty));
    }
    if meaning.signal == columns::TIME && words.unit.is_none() {
        return Some(guessed(column, signal, time_unit(column)?, (1.0, 0.0), Certainty::UnitGuessed));
    }
    if meaning.signal == columns::ANY_PROPELLER_RATE && words.is_electrical() {
        let unit = words.unit.filter(|unit| measures(unit, meaning.si)).unwrap_or("rpm");
        let scale = 1.0 / THRESHOLDS.guess_pole_pairs;
        return Some(guessed(column, signal, unit, (scale, 0.0), Certainty::Electrical));
    }
    if meaning.signal == columns::ANY_PROPELLER_RATE && words.is_by_poles() {
        let unit = words.unit.filter(|unit| measures(unit, meaning.si))?;
        return Some(guessed(column, signal, unit, (1.0, 0.0), Certainty::ByPoles));
    }
    let size = quantile_of_size(column);
    let by_values = meaning.units.iter().find(|(most, _)| size <= *most).map(|(_, unit)| *unit);
    match (words.unit_for(meaning), by_values) {
        (Some(unit), _) => Some(guessed(column, signal, unit, (1.0, 0.0), Certainty::Named)),
        (None, Some(unit)) => Some(guessed(column, signal, unit, (1.0, 0.0), Certainty::UnitGuessed)),
        (None, None) => None,
    }
}

/// Whether a word that means time in one language and something else in another stands over values that do not grow.
fn is_named_time_alone(meaning: &Meaning, words: &Words, column: &SampledColumn) -> bool {
    let mut steps = column.values.windows(2).map(|pair| pair[1] - pair[0]);
    let falls = steps.clone().any(|step| step < 0.0);
    meaning.signal == columns::TIME
        && GROWING.iter().any(|word| words.has(word))
        && (falls || !steps.any(|step| step > 0.0))
}

/// Whether it is a command as the length of a pulse.
fn is_pulse(meaning: &Meaning, unit: &str) -> bool {
    meaning.signal == columns::ANY_COMMAND && measures(unit, "s")
}

fn guessed(
    column: &SampledColumn,
    signal: String,
    unit: &str,
    (scale, offset): (f64, f64),
    certainty: Certainty,
) -> GuessedColumn {
    let samples = column.values.iter().copied().filter(|value| value.is_finite()).take(SHOWN).collect();
    GuessedColumn {
        column: column.name.clone(),
        signal,
        unit: unit.to_owned(),
        scale,
        offset,
        certainty,
        samples,
        reads_zero: is_zero(column),
        asked_volts: None,
        texts: column.texts.clone(),
    }
}

/// A column of which nothing is known, under its own name.
fn unknown(column: &SampledColumn, before: &[GuessedColumn]) -> GuessedColumn {
    let name = own_name(&column.name, before.iter().map(|it| it.signal.as_str()));
    let is_empty = column.values.iter().all(|value| value.is_nan());
    let certainty = match (is_empty, column.texts.is_empty()) {
        (true, _) => Certainty::Empty,
        (false, false) => Certainty::Text,
        (false, true) => Certainty::Unknown,
    };
    guessed(column, name, "", (1.0, 0.0), certainty)
}

/// A column's own name with letters that a mapping takes, and that is not `taken`.
#[must_use]
pub fn own_name<'a>(column: &str, taken: impl Iterator<Item = &'a str> + Clone) -> String {
    let plain: String = column
        .chars()
        .map(|letter| if letter.is_ascii_alphanumeric() { letter.to_ascii_lowercase() } else { '_' })
        .collect();
    let plain = plain.split('_').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("_");
    let plain =
        if plain.is_empty() || log_signal(&plain).is_some() { format!("column_{plain}") } else { plain };
    let is_taken = |name: &String| name == columns::TIME || taken.clone().any(|it| it == name);
    let mut names = std::iter::once(plain.clone()).chain((2..).map(|number| format!("{plain}_{number}")));
    names.find(|name| !is_taken(name)).unwrap_or(plain)
}

/// Unit of a time that rises by so much each row.
fn time_unit(column: &SampledColumn) -> Option<&'static str> {
    let steps = column.values.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0);
    let step = median(steps)?;
    let (least, most) = THRESHOLDS.guess_interval;
    let units = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];
    let found = units.into_iter().find(|(_, scale)| (least..=most).contains(&(step * scale)));
    match found?.0 {
        "us" if is_coarse(column) => Some("ms"),
        unit => Some(unit),
    }
}

/// Whether stamps that could be microseconds are rather milliseconds of rows a second or so apart: no log is over in less than a second
/// and has round microseconds.
fn is_coarse(column: &SampledColumn) -> bool {
    let (start, end) = extremes(column.values.iter().copied());
    let is_round = |value: &f64| value.is_nan() || value % THRESHOLDS.guess_round_us == 0.0;
    end - start < THRESHOLDS.guess_short_us && column.values.iter().all(is_round)
}

/// The size that nearly all values stay below.
fn quantile_of_size(column: &SampledColumn) -> f64 {
    quantile(column.values.iter().map(|value| value.abs()), THRESHOLDS.guess_size).unwrap_or(0.0)
}

#[cfg(test)]
mod tests;
