//! A user's own law: an expression in signal names and parameters, no compiler needed.

use exmex::{Express, FlatEx};

use super::{Point, Site, syntax};

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
    /// As it was written, of each source, and where it came first, in characters.
    names: Vec<(String, usize)>,
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
        if let Some(place) = parameters.iter().find(|name| bind(name, &[]).is_some()) {
            return Err(error(0, format!("the parameter `{place}` has the name of a signal")));
        }
        let written = syntax::read(text, &|name| bind(name, parameters).is_some())
            .map_err(|(column, reason)| error(column, reason))?;
        // The library is given nothing that it could refuse; should it all the same, it is said rather than suffered.
        let parsed = std::panic::catch_unwind(|| FlatEx::<f64>::parse(&written.text));
        let flat = match parsed {
            Ok(Ok(flat)) => flat,
            Ok(Err(slip)) => return Err(error(0, format!("not an expression: {}", slip.msg()))),
            Err(_) => return Err(error(0, "not an expression".to_owned())),
        };
        let mut sources = Vec::new();
        let mut names = Vec::new();
        for variable in flat.var_names() {
            let index = variable.get(1..).and_then(|digits| digits.parse::<usize>().ok());
            let (name, column) =
                index.and_then(|index| written.names.get(index)).cloned().unwrap_or_default();
            sources.push(bind(&name, parameters).ok_or_else(|| error(column, format!("`{name}` is lost")))?);
            names.push((name, column));
        }
        let is_bound = |name: &str| written.names.iter().any(|(it, _)| it == name);
        if let Some(idle) = parameters.iter().find(|name| !is_bound(name)) {
            let reason = format!("the parameter `{idle}` does not appear in it: nothing could be fitted");
            return Err(error(text.chars().count(), reason));
        }
        if sources.len() > MOST_VARIABLES {
            return Err(error(0, format!("more than {MOST_VARIABLES} variables")));
        }
        Ok(Self { text: text.to_owned(), flat, sources, names })
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

    /// The same expression, should it look only at what is known where it acts.
    ///
    /// # Errors
    /// [`ExpressionError`] with the signal marked that nobody knows there.
    pub fn at(self, site: Site) -> Result<Self, ExpressionError> {
        let known = site.signals();
        let stranger = SIGNALS.iter().find(|(bare, ..)| self.names(bare) && !known.contains(bare));
        let Some((bare, unit, _)) = stranger else { return Ok(self) };
        let place = self.names.iter().find(|(name, _)| name == bare || name.strip_prefix(bare) == Some(unit));
        Err(ExpressionError::Syntax {
            text: self.text.clone(),
            column: place.map_or(0, |(_, column)| *column),
            reason: format!("`{bare}` is not known at `{}`; there are {}", site.name(), known.join(", ")),
        })
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

fn bind(name: &str, parameters: &[&str]) -> Option<Source> {
    if let Some(index) = parameters.iter().position(|parameter| *parameter == name) {
        return Some(Source::Parameter(index));
    }
    SIGNALS
        .iter()
        .find(|(bare, unit, _)| name == *bare || name.strip_prefix(bare) == Some(unit))
        .map(|(_, _, read)| Source::Signal(*read))
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

    /// As on paper, whatever the library would make of it.
    #[test]
    fn means_what_it_says() {
        let point = Point { body_rate: 3.0, ..Point::default() };
        let value = |text: &str| {
            let (b, k) = (2.0_f64, 5.0_f64);
            Expression::parse(&format!("{text}+0*(b+k)"), &["b", "k"]).expect("parses").value(&[b, k], &point)
        };
        for (text, expected) in [
            ("-body_rate^2*b", -18.0),
            ("exp(-(body_rate/b)^2)", (-2.25_f64).exp()),
            ("b*exp(-body_rate^2)", 2.0 * (-9.0_f64).exp()),
            ("2^b^3", 256.0),
            ("2^-b", 0.25),
            ("k-b-1", 2.0),
            ("k/b/2", 1.25),
            ("--b", 2.0),
            ("b*-k", -10.0),
            ("1e-3*b + 2.5E+1", 25.002),
            (".5*b", 1.0),
            ("min(max(b,1),max(k,1))", 2.0),
            ("max(-b, min(k, 3))", 3.0),
            ("atan2(b, b)", std::f64::consts::FRAC_PI_4),
            ("log10(100)*log2(8)", 6.0),
            ("2*pi + 0*e", std::f64::consts::TAU),
            ("1-(b-k)", 4.0),
            ("2*(b+\tk)", 14.0),
        ] {
            let found = value(text);
            assert!(
                (found - expected).abs() <= 1e-12 * expected.abs().max(1.0),
                "{text}: {found}, not {expected}"
            );
        }
    }

    /// Whatever a parameter is called, it is that parameter.
    #[test]
    fn a_parameter_may_have_the_name_of_a_constant_or_begin_like_a_function() {
        let names = ["e", "PI", "max_rate", "minimum", "atan2x", "τ"];
        let text = names.join("+");
        let expression = Expression::parse(&text, &names).expect("parses");
        assert_eq!(expression.value(&[1.0, 2.0, 4.0, 8.0, 16.0, 32.0], &Point::default()), 63.0);
    }

    #[test]
    fn nothing_is_too_long_or_too_deep_to_be_refused() {
        let deep = |open: &str| format!("{}b", open.repeat(100_000));
        for text in [deep("("), deep("-"), deep("sin("), deep("2^"), "b+".repeat(100_000)] {
            let error = Expression::parse(&text, &["b"]).unwrap_err();
            let ExpressionError::Syntax { reason, .. } = error;
            assert!(reason.contains("more than 1000 words and signs"), "{reason}");
        }
        for text in ["(", "-", "sin(", "2^"].map(|open| format!("{}b", open.repeat(200))) {
            let error = Expression::parse(&text, &["b"]).unwrap_err();
            assert!(error.to_string().contains("within each other"), "{error}");
        }
        let long = format!("b{}", "+b".repeat(499));
        assert_eq!(Expression::parse(&long, &["b"]).expect("parses").value(&[1.0], &Point::default()), 500.0);
    }

    #[test]
    fn looks_only_at_what_is_known_where_it_acts() {
        let of = |text: &str, site| Expression::parse(text, &["k"]).expect("parses").at(site);
        assert!(of("k*time", Site::SteadyRate).is_ok());
        let error = of("k + k*torque_nm", Site::BodyRateSensor).unwrap_err();
        let ExpressionError::Syntax { column, reason, .. } = &error;
        assert_eq!(*column, 6, "{error}");
        assert!(reason.contains("`torque` is not known at `body_rate_sensor`; there are time"), "{error}");
        assert!(of("k*hover_rate/propeller_rate", Site::Command).is_err());
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
            ("b body_rate", 2, "an operator is missing before this"),
            ("b*1e", 2, "`1e` is no number"),
            ("1.2.3*b", 0, "`1.2.3` is no number"),
            ("log(b)", 0, "write `ln` or `log10`"),
            ("b*sin", 2, "a bracket is missing behind it"),
            ("sin(b, 1)", 5, "takes one value"),
            ("max(b)", 0, "takes two values"),
            ("max(b, 1, 2)", 8, "takes two values"),
            ("b, 1", 1, "a comma stands between"),
            ("b > 1", 2, "`>` means nothing here"),
            ("(b b)", 3, "an operator is missing"),
            ("()*b", 1, "a value is missing before this bracket"),
            ("é*b + ü", 0, "`é` is neither"),
        ];
        for (text, place, words) in cases {
            let error = Expression::parse(text, &["b"]).unwrap_err();
            let ExpressionError::Syntax { column, reason, .. } = &error;
            assert_eq!(*column, place, "{error}");
            assert!(reason.contains(words), "{error}");
        }
    }
}
