//! A formula as it is searched: terms at a site, each linear in its coefficients, and the user's effect that it becomes.

use std::borrow::Cow;

use super::channels::LawInput;
use super::thresholds::THRESHOLDS;
use crate::effect::Site;
use crate::model::{Model, UserEffect, UserParameter};

/// A number inside a term that is not linear: a threshold, a width, a wave number.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Inner {
    /// The letter that stands for it in the term's parts, behind a `$`.
    pub letter: char,
    /// In the unit of the channel (or over it).
    pub value: f64,
    /// In the same: half of how far apart values are tried.
    pub step: f64,
    pub bounds: (f64, f64),
    /// Its SI unit.
    pub unit: String,
}

impl Inner {
    /// Whether it is a width or a time, and no place along a channel: it may be of any order of magnitude.
    pub fn is_size(&self) -> bool {
        self.bounds.0 > 0.0 && self.bounds.1 > THRESHOLDS.scale_span * self.bounds.0
    }
}

/// A part of a term: a function of its channels, with the powers of their units that it has.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TermPart {
    /// `$x` and `$y` stand for the channels, `$a` and others for inner numbers.
    pub text: Cow<'static, str>,
    pub powers: [f64; 2],
}

/// A term: parts with a coefficient each.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LawTerm {
    /// What kind of function it is.
    pub form: &'static str,
    pub parts: Vec<TermPart>,
    pub inner: Vec<Inner>,
    pub channels: Vec<LawInput>,
    /// A factor in front of all parts, written as they are; `None` = one. Of an expression one function may remember.
    pub times: Option<String>,
}

/// A formula at a site.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CandidateLaw {
    pub site: Site,
    pub terms: Vec<LawTerm>,
}

/// The SI unit of what a law adds at a site.
pub(crate) fn unit_at(site: Site) -> &'static str {
    match site {
        Site::Command => "-",
        Site::SteadyRate | Site::RotorRateSensor | Site::BodyRateSensor => "rad/s",
        Site::RotorAcceleration => "rad/s^2",
        Site::Thrust => "N",
        Site::Torque => "N m",
    }
}

/// The size that a law at a site may usually have, in its unit: a percent of what acts there.
pub(crate) fn usual_size(site: Site, model: &Model) -> f64 {
    let actuator = &model.actuator;
    let thrust = actuator.thrust_coefficient * actuator.hover_rate.powi(2);
    THRESHOLDS.usual_share
        * match site {
            Site::Command | Site::BodyRateSensor => 1.0,
            Site::SteadyRate | Site::RotorRateSensor => actuator.hover_rate,
            Site::RotorAcceleration => actuator.pole * actuator.hover_rate,
            Site::Thrust => thrust,
            Site::Torque => model.body.arm * thrust,
        }
}

/// `unit` over powers of others.
pub(crate) fn over(unit: &str, divisors: &[(&str, f64)]) -> String {
    let powers = divisors.iter().filter(|(unit, power)| *power != 0.0 && *unit != "-");
    powers.fold(unit.to_owned(), |text, (unit, power)| {
        // A unit of several parts stands in brackets, unless nothing stands beside it.
        let is_alone = text == "-" && *power == -1.0;
        let is_sum = unit.contains(['/', ' ']) && !is_alone;
        let bare = if is_sum { format!("({unit})") } else { (*unit).to_owned() };
        let powered = if power.abs() == 1.0 { bare } else { format!("{bare}^{}", power.abs()) };
        match (*power > 0.0, text.as_str()) {
            (true, "-") => format!("1/{powered}"),
            (true, _) => format!("{text}/{powered}"),
            (false, "-") => powered,
            (false, _) => format!("{text} {powered}"),
        }
    })
}

/// Letters of the coefficients of a term's parts.
const COEFFICIENTS: [&str; 3] = ["k", "q", "r"];

impl LawTerm {
    /// The name of a number in the formula's term `index`.
    fn name(letter: &str, index: usize) -> String {
        if index == 0 { letter.to_owned() } else { format!("{letter}{}", index + 1) }
    }

    /// Names of its coefficients in term `index`: a letter each, of many numbered ones.
    fn coefficient_names(&self, index: usize) -> Vec<String> {
        let count = self.parts.len();
        if count <= COEFFICIENTS.len() {
            return COEFFICIENTS.iter().take(count).map(|letter| Self::name(letter, index)).collect();
        }
        let letter = if index == 0 { "c" } else { "d" };
        (1..=count).map(|number| format!("{letter}{number}")).collect()
    }

    /// A part as an expression in term `index`.
    fn written(&self, text: &str, index: usize) -> String {
        let mut text = text.to_owned();
        for (letter, channel) in ["$x", "$y"].iter().zip(&self.channels) {
            text = text.replace(letter, channel.signal);
        }
        self.inner.iter().fold(text, |text, inner| {
            text.replace(&format!("${}", inner.letter), &Self::name(&inner.letter.to_string(), index))
        })
    }

    /// Whether it remembers.
    pub fn remembers(&self) -> bool {
        ["play", "creep", "hysteresis", "relay"].contains(&self.form) || self.times.is_some()
    }

    /// Whether it jumps at its inner numbers: no slope leads a fit to them.
    pub fn jumps(&self) -> bool {
        self.form == "relay"
    }

    /// Whether it swings along its channel.
    pub fn is_wave(&self) -> bool {
        ["wave", "sine", "cosine"].contains(&self.form)
    }

    /// What kind of function the data show: of a wave that they hold less than a period of, a bend.
    pub fn shown_form(&self) -> &'static str {
        let number = self.inner.first().map_or(0.0, |inner| inner.value.abs());
        let range = self.channels.first().map_or(0.0, LawInput::range);
        let is_whole = number * range >= std::f64::consts::TAU;
        if self.is_wave() && !is_whole { "bend" } else { self.form }
    }

    /// Its expression in term `index`.
    fn expression(&self, index: usize) -> String {
        let part = |(part, name): (&TermPart, String)| format!("{name}*{}", self.written(&part.text, index));
        let sum = self.parts.iter().zip(self.coefficient_names(index)).map(part).collect::<Vec<_>>();
        let sum = sum.join(" + ");
        self.times.as_ref().map_or(sum.clone(), |times| format!("{}*({sum})", self.written(times, index)))
    }

    /// Its parameters in term `index`: coefficients, then inner numbers.
    fn parameters(&self, site: Site, index: usize, coefficients: &[f64]) -> Vec<UserParameter> {
        let of_part = |((part, name), value): ((&TermPart, String), &f64)| {
            let units: Vec<(&str, f64)> =
                self.channels.iter().map(|channel| channel.unit).zip(part.powers).collect();
            let most = three_digits(1e3 * value.abs().max(f64::MIN_POSITIVE));
            UserParameter {
                name,
                unit: over(unit_at(site), &units),
                start: *value,
                lower: -most,
                upper: most,
            }
        };
        let coefficients =
            self.parts.iter().zip(self.coefficient_names(index)).zip(coefficients).map(of_part);
        let inner = self.inner.iter().map(|inner| UserParameter {
            name: Self::name(&inner.letter.to_string(), index),
            unit: inner.unit.clone(),
            start: inner.value,
            lower: three_digits(inner.bounds.0),
            upper: three_digits(inner.bounds.1),
        });
        coefficients.chain(inner).collect()
    }
}

/// A bound with three digits: with fewer a narrow range loses what lies in it.
fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

impl CandidateLaw {
    /// How many coefficients it has.
    #[cfg(test)]
    pub fn coefficients(&self) -> usize {
        self.terms.iter().map(|term| term.parts.len()).sum()
    }

    /// How many numbers it has.
    pub fn numbers(&self) -> usize {
        self.terms.iter().map(|term| term.parts.len() + term.inner.len()).sum()
    }

    /// The channels that it looks at, each once.
    pub fn channels(&self) -> Vec<&LawInput> {
        let mut channels: Vec<&LawInput> = Vec::new();
        for channel in self.terms.iter().flat_map(|term| &term.channels) {
            if !channels.iter().any(|known| known.signal == channel.signal) {
                channels.push(channel);
            }
        }
        channels
    }

    /// Whether it looks at the same channels at the same site.
    pub fn shares_place(&self, other: &Self) -> bool {
        let signals = |law: &Self| law.channels().iter().map(|it| it.signal).collect::<Vec<_>>();
        self.site == other.site && signals(self) == signals(other)
    }

    /// Whether it acts on the body by nothing but the torque that the rotors make.
    pub fn is_by_torque(&self) -> bool {
        self.site == Site::Torque && self.channels().iter().all(|channel| channel.signal == "torque")
    }

    /// What it adds, as an expression.
    pub fn expression(&self) -> String {
        let terms = self.terms.iter().enumerate().map(|(index, term)| term.expression(index));
        terms.collect::<Vec<_>>().join(" + ")
    }

    /// Names of its coefficients.
    pub fn coefficient_names(&self) -> Vec<String> {
        self.terms.iter().enumerate().flat_map(|(index, term)| term.coefficient_names(index)).collect()
    }

    /// The user's effect that it is, its coefficients at these values.
    pub fn user_effect(&self, id: &str, coefficients: &[f64]) -> UserEffect {
        let mut parameters = Vec::new();
        let mut from = 0;
        for (index, term) in self.terms.iter().enumerate() {
            let own = &coefficients[from..from + term.parts.len()];
            parameters.extend(term.parameters(self.site, index, own));
            from += term.parts.len();
        }
        UserEffect {
            id: id.to_owned(),
            site: self.site,
            expression: self.expression(),
            parameters,
            meaning: String::new(),
        }
    }

    /// The same with its inner numbers as a model has them.
    pub fn at(&self, model: &Model, id: &str) -> Self {
        let mut law = self.clone();
        for (index, term) in law.terms.iter_mut().enumerate() {
            for inner in &mut term.inner {
                let name = format!("{id}.{}", LawTerm::name(&inner.letter.to_string(), index));
                inner.value = model.parameter(&name).unwrap_or(inner.value);
            }
        }
        law
    }

    /// Its coefficients as a model has them.
    pub fn coefficients_in(&self, model: &Model, id: &str) -> Vec<f64> {
        let names = self.coefficient_names();
        names.iter().map(|name| model.parameter(&format!("{id}.{name}")).unwrap_or(0.0)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frequency that is known to a tenth lies within its bounds.
    #[test]
    fn bounds_hold_what_they_are_about() {
        for value in [19.93, 11.2, 0.0316, 5120.0] {
            assert!(
                three_digits(0.9 * value) < 0.95 * value && three_digits(1.1 * value) > 1.05 * value,
                "{value}"
            );
        }
    }

    #[test]
    fn units_of_coefficients_are_those_of_the_site_over_the_channels() {
        assert_eq!(over("N m", &[("rad", 1.0)]), "N m/rad");
        assert_eq!(over("N m", &[("rad/s", 2.0)]), "N m/(rad/s)^2");
        assert_eq!(over("rad/s", &[("-", 3.0)]), "rad/s");
        assert_eq!(over("-", &[("rad", -1.0)]), "rad");
        assert_eq!(over("-", &[("rad", 1.0)]), "1/rad");
        assert_eq!(over("-", &[("rad/s", -1.0)]), "rad/s");
        assert_eq!(over("-", &[("rad/s", 1.0)]), "1/(rad/s)");
        assert_eq!(over("N m", &[("rad", 1.0), ("rad/s", 1.0)]), "N m/rad/(rad/s)");
    }
}
