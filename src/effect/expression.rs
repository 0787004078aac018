//! A user's own law: an expression in signal names and parameters, no compiler needed.

use exmex::{Express, FlatEx, FloatOpsFactory, MakeOperators};

use super::Point;

/// Why an expression cannot be a law.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExpressionError {
    /// It does not parse.
    #[error("the expression has an error here:\n  {text}\n  {blank}^ {reason}", blank = " ".repeat(*.column))]
    Syntax {
        /// The expression.
        text: String,
        /// Character where it goes wrong, from 0.
        column: usize,
        /// What is wrong.
        reason: String,
    },
}

/// Reads one signal.
type Reader = fn(&Point) -> f64;

/// What reads one variable.
#[derive(Debug, Clone, Copy)]
enum Source {
    Signal(Reader),
    Parameter(usize),
}

/// A parsed expression, its variables bound to signals and parameters.
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    flat: FlatEx<f64>,
    sources: Vec<Source>,
}

/// Signals an expression may name: with the unit as in a log, or without.
#[rustfmt::skip]
const SIGNALS: &[(&str, &str, Reader)] = &[
    ("time", "_s", |point| point.time),
    ("command", "", |point| point.command),
    ("battery_voltage", "_v", |point| point.battery_voltage),
    ("full_voltage", "_v", |point| point.full_voltage),
    ("steady_rate", "_rad_s", |point| point.steady_rate),
    ("propeller_rate", "_rad_s", |point| point.propeller_rate),
    ("propeller_rate_1", "_rad_s", |point| point.propeller_rate_1),
    ("propeller_rate_2", "_rad_s", |point| point.propeller_rate_2),
    ("hover_rate", "_rad_s", |point| point.hover_rate),
    ("thrust", "_n", |point| point.thrust),
    ("torque", "_nm", |point| point.torque),
    ("body_angle", "_rad", |point| point.body_angle),
    ("body_rate", "_rad_s", |point| point.body_rate),
    ("side", "", |point| point.side),
];

/// Most variables of one expression; a fixed array keeps evaluation free of allocation.
const MOST_VARIABLES: usize = 16;

impl Expression {
    /// Parses `text` over the signals and the `parameters`.
    ///
    /// # Errors
    /// [`ExpressionError`] with the place marked.
    pub fn parse(text: &str, parameters: &[&str]) -> Result<Self, ExpressionError> {
        let error =
            |column, reason: String| ExpressionError::Syntax { text: text.to_owned(), column, reason };
        if let Some((column, reason)) = first_slip(text).or_else(|| unknown_function(text)) {
            return Err(error(column, reason));
        }
        let parsed = std::panic::catch_unwind(|| FlatEx::<f64>::parse(text));
        let flat = match parsed {
            Ok(Ok(flat)) => flat,
            Ok(Err(slip)) => {
                let column = text.chars().count();
                return Err(error(column, format!("not an expression: {}", slip.msg())));
            }
            Err(_) => return Err(error(0, "not an expression".to_owned())),
        };
        let mut sources = Vec::new();
        for name in flat.var_names() {
            sources.push(bind(name, parameters).ok_or_else(|| {
                let column = word_column(text, name);
                error(column, format!("`{name}` is neither a signal nor a parameter"))
            })?);
        }
        let is_bound = |index: usize| {
            sources.iter().any(|source| matches!(source, Source::Parameter(it) if *it == index))
        };
        if let Some(idle) = (0..parameters.len()).find(|index| !is_bound(*index)) {
            let reason = format!(
                "the parameter `{}` does not appear in it: nothing could be fitted",
                parameters[idle]
            );
            return Err(error(text.chars().count(), reason));
        }
        if sources.len() > MOST_VARIABLES {
            return Err(error(0, format!("more than {MOST_VARIABLES} variables")));
        }
        Ok(Self { text: text.to_owned(), flat, sources })
    }

    /// Its value; not-a-number where it has none.
    #[must_use]
    pub fn value(&self, parameters: &[f64], point: &Point) -> f64 {
        let mut values = [0.0; MOST_VARIABLES];
        for (value, source) in values.iter_mut().zip(&self.sources) {
            *value = match source {
                Source::Signal(read) => read(point),
                Source::Parameter(index) => parameters.get(*index).copied().unwrap_or(f64::NAN),
            };
        }
        let used = values.get(..self.sources.len()).unwrap_or(&[]);
        self.flat.eval(used).unwrap_or(f64::NAN)
    }

    /// The signals it looks at, by name without unit, and their values at a point.
    #[must_use]
    pub fn seen(&self, point: &Point) -> Vec<(&'static str, f64)> {
        let looked_at = SIGNALS.iter().filter(|(bare, ..)| self.names(bare));
        looked_at.map(|(bare, _, read)| (*bare, read(point))).collect()
    }

    /// The text it was parsed from.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Whether it looks at `signal` (without unit).
    #[must_use]
    pub fn names(&self, signal: &str) -> bool {
        self.flat.var_names().iter().any(|name| {
            name == signal
                || SIGNALS.iter().any(|(bare, unit, _)| *bare == signal && name == &format!("{bare}{unit}"))
        })
    }
}

fn bind(name: &str, parameters: &[&str]) -> Option<Source> {
    if let Some(index) = parameters.iter().position(|parameter| *parameter == name) {
        return Some(Source::Parameter(index));
    }
    SIGNALS
        .iter()
        .find(|(bare, unit, _)| name == *bare || name.strip_prefix(bare) == Some(unit))
        .map(|(_, _, read)| Source::Signal(*read))
}

/// A word before a bracket that is no function; the parser would only say that something is wrong.
fn unknown_function(text: &str) -> Option<(usize, String)> {
    let operators = FloatOpsFactory::<f64>::make();
    let is_letter = |letter: &char| letter.is_alphabetic() || *letter == '_';
    let known: Vec<&str> = operators
        .iter()
        .map(|operator| operator.repr())
        .filter(|name| name.chars().all(|it| is_letter(&it)))
        .collect();
    let letters: Vec<char> = text.chars().collect();
    let brackets = letters.iter().enumerate().filter(|(_, letter)| **letter == '(');
    for (bracket, _) in brackets {
        let before = &letters[..bracket];
        let end = before.iter().rposition(|letter| !letter.is_whitespace()).map_or(0, |last| last + 1);
        let in_word = |letter: &char| letter.is_alphanumeric() || *letter == '_';
        let start = before[..end].iter().rposition(|letter| !in_word(letter)).map_or(0, |last| last + 1);
        let word: String = before[start..end].iter().collect();
        if word.starts_with(|letter| is_letter(&letter)) && !known.contains(&word.as_str()) {
            return Some((start, format!("`{word}` is no function; there are {}", known.join(", "))));
        }
    }
    None
}

/// Where `name` stands in `text` as a word, in characters.
fn word_column(text: &str, name: &str) -> usize {
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    let found = text.match_indices(name).find(|(at, _)| {
        let before = text.get(..*at).and_then(|left| left.chars().next_back());
        let after = text.get(at + name.len()..).and_then(|right| right.chars().next());
        !before.is_some_and(is_word) && !after.is_some_and(is_word)
    });
    text.get(..found.map_or(0, |(at, _)| at)).map_or(0, |left| left.chars().count())
}

/// The first place that cannot be right, which the parser itself does not point at.
fn first_slip(text: &str) -> Option<(usize, String)> {
    let mut open = Vec::new();
    let mut last_operator = None;
    let mut seen = false;
    for (column, letter) in text.chars().enumerate() {
        match letter {
            '(' => {
                open.push(column);
                last_operator = None;
                continue;
            }
            ')' => {
                if open.pop().is_none() {
                    return Some((column, "this bracket closes nothing".to_owned()));
                }
                if last_operator.is_some() {
                    return Some((column, "a value is missing before this bracket".to_owned()));
                }
            }
            '*' | '/' | '^' if last_operator.is_some() || !seen => {
                return Some((column, "a value is missing before this operator".to_owned()));
            }
            '+' | '-' | '*' | '/' | '^' => {
                last_operator = Some(column);
                seen = true;
                continue;
            }
            letter if letter.is_whitespace() => continue,
            letter if letter.is_alphanumeric() || "_.,{}%<>=!&|".contains(letter) => {}
            letter => return Some((column, format!("`{letter}` means nothing here"))),
        }
        seen = true;
        last_operator = None;
    }
    if let Some(column) = open.pop() {
        return Some((column, "this bracket is never closed".to_owned()));
    }
    if let Some(column) = last_operator {
        return Some((column, "a value is missing after this operator".to_owned()));
    }
    (!seen).then(|| (0, "it is empty".to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evaluates_signals_and_parameters() {
        let expression =
            Expression::parse("-b*body_rate_rad_s*abs(body_rate) + k", &["b", "k"]).expect("parses");
        let point = Point { body_rate: -2.0, ..Point::default() };
        assert_eq!(expression.value(&[3.0, 0.5], &point), 12.5);
        assert!(expression.names("body_rate") && !expression.names("body_angle"));
    }

    #[test]
    fn marks_the_place() {
        let cases = [
            ("-b*body_rat", 3, "`body_rat` is neither"),
            ("-b*(body_rate", 3, "never closed"),
            ("b*body_rate)", 11, "closes nothing"),
            ("b*/body_rate", 2, "missing before this operator"),
            ("b*body_rate*", 11, "missing after"),
            ("b*body_rate # 2", 12, "means nothing"),
            ("", 0, "empty"),
            ("sin(+)", 5, "missing before this bracket"),
            ("b*foo(body_rate)", 2, "`foo` is no function; there are"),
            ("b (body_rate)", 0, "`b` is no function"),
            ("2*body_rate", 11, "`b` does not appear in it"),
        ];
        for (text, place, words) in cases {
            let error = Expression::parse(text, &["b"]).unwrap_err();
            let ExpressionError::Syntax { column, reason, .. } = &error;
            assert_eq!(*column, place, "{error}");
            assert!(reason.contains(words), "{error}");
        }
    }
}
