//! A user's own law: an expression in signal names and parameters, no compiler needed.

use super::program::{Operation, Program, ReadSignal};
use super::thresholds::THRESHOLDS;
use super::{Point, Site, signals, syntax};
use crate::signal::Sensor;

/// Why an expression cannot be a law.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ExpressionError {
    /// It does not parse.
    #[error("the expression has an error here:\n  {text}\n  {blank}^ {reason}", blank = " ".repeat(*.column))]
    Syntax {
        /// The expression, or where it is long its part about that place, on one line.
        text: String,
        /// Character of `text` where it goes wrong, from 0.
        column: usize,
        /// What is wrong.
        reason: String,
    },
}

/// A compiled expression, its variables bound to signals and parameters.
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    program: Program,
    /// The signals and parameters it reads, as written, and where each came first, in characters.
    names: Vec<(String, usize)>,
}

/// Signals an expression may name: with the unit as in a log, or without.
#[rustfmt::skip]
const SIGNALS: &[(&str, &str, ReadSignal)] = &[
    (signals::TIME, "_s", |point| point.time),
    (signals::COMMAND, "", |point| point.command),
    (signals::BATTERY_VOLTAGE, Sensor::BatteryVoltage.suffix(), |point| point.battery_voltage),
    ("full_voltage", Sensor::BatteryVoltage.suffix(), |point| point.full_voltage),
    ("steady_rate", Sensor::PropellerRate.suffix(), |point| point.steady_rate),
    (signals::PROPELLER_RATE, Sensor::PropellerRate.suffix(), |point| point.propeller_rate),
    (signals::PROPELLER_RATES[0], Sensor::PropellerRate.suffix(), |point| point.propeller_rate_1),
    (signals::PROPELLER_RATES[1], Sensor::PropellerRate.suffix(), |point| point.propeller_rate_2),
    ("hover_rate", Sensor::PropellerRate.suffix(), |point| point.hover_rate),
    ("thrust", Sensor::Thrust.suffix(), |point| point.thrust),
    (signals::TORQUE, "_nm", |point| point.torque),
    (signals::BODY_ANGLE, Sensor::BodyAngle.suffix(), |point| point.body_angle),
    (signals::BODY_RATE, Sensor::BodyRate.suffix(), |point| point.body_rate),
    ("side", "", |point| point.side),
];

impl ExpressionError {
    /// Of a text about one of its characters, each of its lines behind the one before: what is wrong may stand in a very long one.
    fn about(text: &str, column: usize, reason: String) -> Self {
        let shown = THRESHOLDS.shown_characters;
        let (first, count) = (column.saturating_sub(shown), text.chars().count());
        let one_line = text.chars().map(|it| if it.is_control() { ' ' } else { it });
        let part: String = one_line.skip(first).take(2 * shown).collect();
        let before = if first > 0 { "..." } else { "" };
        let behind = if first + 2 * shown < count { "..." } else { "" };
        let text = format!("{before}{part}{behind}");
        Self::Syntax { text, column: column - first + before.len(), reason }
    }
}

impl Expression {
    /// Parses `text` over the signals and the `parameters`.
    ///
    /// # Errors
    /// [`ExpressionError`] with the place marked.
    pub fn parse(text: &str, parameters: &[&str]) -> Result<Self, ExpressionError> {
        let error = |column, reason: String| ExpressionError::about(text, column, reason);
        if let Some(place) = parameters.iter().find(|name| bind(name, &[]).is_some()) {
            return Err(error(0, format!("the parameter `{place}` has the name of a signal")));
        }
        let compiled = syntax::compile(text, &|name| bind(name, parameters))
            .map_err(|(column, reason)| error(column, reason))?;
        let is_bound = |name: &str| compiled.names.iter().any(|(it, _)| it == name);
        if let Some(idle) = parameters.iter().find(|name| !is_bound(name)) {
            let reason = format!("the parameter `{idle}` does not appear in it: nothing could be fitted");
            return Err(error(text.chars().count(), reason));
        }
        Ok(Self { text: text.to_owned(), program: compiled.program, names: compiled.names })
    }

    /// Its value; not-a-number where it has none.
    #[must_use]
    #[inline]
    pub fn value(&self, parameters: &[f64], point: &Point) -> f64 {
        self.program.value(parameters, point)
    }

    /// Whether it remembers: its value then hangs on [`Point::memory`].
    #[must_use]
    pub fn remembers(&self) -> bool {
        self.program.remembers()
    }

    /// What it remembers in the steady state.
    #[must_use]
    pub fn memory_at_rest(&self, parameters: &[f64], point: &Point) -> f64 {
        self.program.memory_at_rest(parameters, point)
    }

    /// What it remembers `span` [s] after it remembered `held`, the point held.
    #[must_use]
    pub fn memory_after(&self, parameters: &[f64], held: f64, point: &Point, span: f64) -> f64 {
        self.program.memory_after(parameters, held, point, span)
    }

    /// [1/s] the fastest rate that a simulation has to resolve.
    #[must_use]
    pub fn memory_rate(&self, parameters: &[f64]) -> f64 {
        self.program.memory_rate(parameters)
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

    /// The same expression, should it look only at what is known where it acts.
    ///
    /// # Errors
    /// [`ExpressionError`] with the signal marked that nobody knows there.
    pub fn at(self, site: Site) -> Result<Self, ExpressionError> {
        if self.remembers() && !site.lets_expressions_remember() {
            let reason = format!(
                "`play`, `lag` and `relay` are known at `command`, `steady_rate` and `torque`, and not at `{}`",
                site.name()
            );
            return Err(ExpressionError::about(&self.text, 0, reason));
        }
        let known = site.signals();
        let stranger = SIGNALS.iter().find(|(bare, ..)| self.names(bare) && !known.contains(bare));
        let Some((bare, unit, _)) = stranger else { return Ok(self) };
        let place = self.names.iter().find(|(name, _)| name == bare || name.strip_prefix(bare) == Some(unit));
        let reason = format!("`{bare}` is not known at `{}`; there are {}", site.name(), known.join(", "));
        Err(ExpressionError::about(&self.text, place.map_or(0, |(_, column)| *column), reason))
    }

    /// Whether it looks at `signal` (without unit).
    #[must_use]
    pub fn names(&self, signal: &str) -> bool {
        self.names.iter().any(|(name, _)| {
            name == signal
                || SIGNALS.iter().any(|(bare, unit, _)| *bare == signal && name == &format!("{bare}{unit}"))
        })
    }
}

fn bind(name: &str, parameters: &[&str]) -> Option<Operation> {
    if let Some(index) = parameters.iter().position(|parameter| *parameter == name) {
        return Some(Operation::Parameter(index));
    }
    SIGNALS
        .iter()
        .find(|(bare, unit, _)| name == *bare || name.strip_prefix(bare) == Some(unit))
        .map(|(_, _, read)| Operation::Signal(*read))
}

#[cfg(test)]
mod tests;
