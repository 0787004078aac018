//! The model: actuator and body equations, the effects added to them, and the ladder of how it got there.
//!
//! ```text
//! z    = g(u) - k_V (v_bmax - v_b)              [LPC16] Eq. (2), sign of Eq. (6)
//! ω_p' = p (z - ω_p)                            [LPC16] Eq. (2)
//! f    = c ω_p²
//! J ω_b' = d (f_1 - f_2),  θ' = ω_b             [LPC16] Eq. (1), sign of Eq. (12)
//! ```
//!
//! **Deviation:** [LPC16] Eq. (2) prints `+ k_V`, which would speed the rotor up as the battery drops. Below (2) it
//! calls ω_b the propeller's rate: that is ω_p, and ω_b the body's.
//!
//! **Deviation:** [LPC16] gives only the tangent of the thrust curve of its Fig. 4, Eq. (13); c is the parabola
//! through the origin with that tangent.
//!
//! A model with an effect of one's own, made by a program: `examples/own_effect.rs`.

mod body;
mod body_stride;
mod body_trace;
mod equations;
mod error;
mod expression_domain;
mod file;
mod known_effect;
mod ladder;
mod lag_path;
mod measure;
mod rotor;
mod rotor_error;
mod rotor_inputs;
mod rotor_state;
mod rotor_step;
mod rotor_stride;
mod rotor_trace;
mod runge_kutta;
mod sensors;
mod step_back;
pub mod thresholds;
mod user_effect;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::effect::{self, Site, Term};

pub use body_trace::{BodyInput, BodyStart, BodyTrace};
pub use equations::Equations;
pub use error::ModelError;
pub(crate) use expression_domain::UndefinedRow;
pub use known_effect::{Effect, EffectParameter};
pub use ladder::{Change, ErrorFall, LogReference, ModelStep, SeenRows};
pub(crate) use lag_path::LagPath;
pub use measure::Measure;
pub use rotor_error::RotorError;
pub use rotor_step::{Member, MemberState};
pub use rotor_trace::{Remembered, RotorInput, RotorStart, RotorTrace};
pub use sensors::LagInverse;
pub use user_effect::{UserEffect, UserParameter};

/// Rotor: from command and battery to rate and thrust.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Actuator {
    /// [rad/s] g(u): coefficients by ascending power of the command. A zero is a term the model does not have.
    pub steady_rate: Vec<f64>,
    /// [rad/(s V)] k_V; zero: the model does not have it.
    pub voltage_gain: f64,
    /// [V] v_bmax, the full battery.
    pub full_voltage: f64,
    /// [rad/s] p.
    pub pole: f64,
    /// [N s²/rad²] c in f = c ω_p².
    pub thrust_coefficient: f64,
    /// [rad/s] ω_0, the rotor's rate in hover.
    pub hover_rate: f64,
}

/// Body about its one axis.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// [kg m²] J. From rotor rates only d c / J can be found: J is then what fits with the given d and c.
    pub inertia: f64,
    /// [m] d, the lever arm of each rotor.
    ///
    /// **Deviation:** [LPC16] Eq. (1) and Table IV call d the distance between the propellers' axes, and the arm's
    /// length; Eq. (1) uses it as the lever arm of each rotor.
    pub arm: f64,
}

/// An effect that the model has.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AddedEffect {
    /// Id in the catalogue, or of an effect of the user's own.
    pub id: String,
    /// Values by parameter name, in the SI units of the card.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
}

/// A model file. Changed and kept by a program: [`Model::parse`]; extended: `examples/diagnose.rs`.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// What people call it.
    pub name: String,
    /// Rotor.
    pub actuator: Actuator,
    /// Body.
    pub body: Body,
    /// Standard errors by parameter name (`pole`, `<effect>.<parameter>`), where a fit found them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub standard_errors: BTreeMap<String, f64>,
    /// Effects of the user's own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub user_effects: Vec<UserEffect>,
    /// Effects the model has, in the order added.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<AddedEffect>,
    /// How it got there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ladder: Vec<ModelStep>,
    /// The rows that its own numbers were identified from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub identified_from: Vec<SeenRows>,
    /// How far the rotors of those logs were from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotor_error: Option<RotorError>,
}

/// Names of the coefficients of g(u) by power, and their symbols in the paper.
const CURVE: [(&str, &str); 6] = [
    ("steady_rate_constant", "c_g0"),
    ("steady_rate_linear", "c_g2"),
    ("steady_rate_quadratic", "c_g1"),
    ("steady_rate_cubic", "c_g3"),
    ("steady_rate_quartic", "c_g4"),
    ("steady_rate_quintic", "c_g5"),
];

/// The highest degree of g(u) plus one.
pub const MOST_COEFFICIENTS: usize = CURVE.len();

/// Σ c_j u^j, `coefficients` by ascending power from u^0 on (Horner).
#[must_use]
#[inline]
pub fn polynomial(coefficients: &[f64], u: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * u + coefficient)
}

impl Model {
    /// Tables I and IV of the paper.
    #[must_use]
    pub fn paper() -> Self {
        // **Deviation:** the thrust curve is the parabola through the origin with the tangent of Table IV:
        // c = c_p1² / (4 |c_p0|), touching at ω_0 = 2 |c_p0| / c_p1.
        let (c_p1, c_p0) = (0.0197, 6.0771);
        Self {
            name: "paper".to_owned(),
            actuator: Actuator {
                steady_rate: vec![0.0, 1124.5, 447.1],
                voltage_gain: 40.0,
                full_voltage: 12.6,
                pole: 16.0,
                thrust_coefficient: c_p1 * c_p1 / (4.0 * c_p0),
                hover_rate: 2.0 * c_p0 / c_p1,
            },
            body: Body { inertia: 0.032, arm: 0.25 },
            standard_errors: BTreeMap::new(),
            user_effects: Vec::new(),
            effects: Vec::new(),
            ladder: Vec::new(),
            identified_from: Vec::new(),
            rotor_error: None,
        }
    }

    /// The effect with this id, from the catalogue or of the user's own.
    ///
    /// # Errors
    /// [`ModelError`] when there is none, or its expression does not parse.
    pub fn effect(&self, id: &str) -> Result<Effect, ModelError> {
        if let Some(card) = effect::find(id) {
            return Ok(Effect::from_card(card));
        }
        match self.user_effect(id) {
            Some(user) => Effect::from_user(user),
            None => Err(ModelError::UnknownEffect {
                id: id.to_owned(),
                nearest: error::nearest_id(id, self.user_effects.iter().map(|user| user.id.as_str())),
            }),
        }
    }

    /// What the user wrote of an effect.
    #[must_use]
    pub fn user_effect(&self, id: &str) -> Option<&UserEffect> {
        self.user_effects.iter().find(|user| user.id == id)
    }

    /// Every effect that could be added: the user's own, then the catalogue.
    ///
    /// # Errors
    /// [`ModelError`] when a user's expression does not parse.
    pub fn known_effects(&self) -> Result<Vec<Effect>, ModelError> {
        let own = self.user_effects.iter().map(Effect::from_user);
        own.chain(effect::CATALOGUE.iter().map(|card| Ok(Effect::from_card(card)))).collect()
    }

    /// Whether the model has the effect.
    #[must_use]
    pub fn has(&self, id: &str) -> bool {
        self.effects.iter().any(|added| added.id == id)
    }

    /// The parameters, in the order of the card, of the effect that the model has as `term` at `site`.
    #[must_use]
    pub fn term(&self, site: Site, term: Term) -> Option<Vec<f64>> {
        let card = effect::acting_as(site, term)?;
        let added = self.effects.iter().find(|added| added.id == card.id)?;
        let value = |parameter: &effect::Parameter| added.parameters.get(parameter.name).copied();
        Some(card.parameters.iter().map(|parameter| value(parameter).unwrap_or(f64::NAN)).collect())
    }

    /// [-] The command beyond which a greater one does nothing, as it is sent: what the speed controller cuts off is what its dead zone
    /// has left of it. `None` where the model knows no such limit.
    #[must_use]
    pub fn greatest_command(&self) -> Option<f64> {
        let first = |term: Term| self.term(Site::Command, term).and_then(|values| values.first().copied());
        let zone = first(Term::DeadZone).unwrap_or(0.0);
        first(Term::Saturation).map(|limit| zone + (1.0 - zone) * limit)
    }

    /// Whether one of its effects cannot be judged without this column of a log.
    #[must_use]
    pub fn needs(&self, column: &str) -> bool {
        let needs = |effect: Effect| effect.needs.iter().any(|need| need == column);
        self.effects.iter().any(|added| self.effect(&added.id).is_ok_and(needs))
    }

    /// The same model with the effect added, its parameters at their start.
    #[must_use]
    pub fn with(&self, effect: &Effect) -> Self {
        let mut model = self.clone();
        let start = |parameter: &EffectParameter| parameter.starts.first().copied().unwrap_or(0.0);
        let parameters = effect.parameters.iter().map(|parameter| (parameter.name.clone(), start(parameter)));
        model.effects.push(AddedEffect { id: effect.id.clone(), parameters: parameters.collect() });
        model
    }

    /// The same model without the effect.
    #[must_use]
    pub fn without(&self, id: &str) -> Self {
        let mut model = self.clone();
        model.effects.retain(|added| added.id != id);
        model.standard_errors.retain(|name, _| name.split_once('.').is_none_or(|(effect, _)| effect != id));
        model
    }

    /// A parameter of the base (`pole`, `inertia`, ...) or of an effect (`<effect>.<parameter>`), in SI.
    #[must_use]
    pub fn parameter(&self, name: &str) -> Option<f64> {
        if let Some((id, parameter)) = name.split_once('.') {
            return self.effects.iter().find(|added| added.id == id)?.parameters.get(parameter).copied();
        }
        let curve = CURVE.iter().position(|(curve, _)| *curve == name);
        match name {
            "voltage_gain" => Some(self.actuator.voltage_gain),
            "pole" => Some(self.actuator.pole),
            "inertia" => Some(self.body.inertia),
            _ => self.actuator.steady_rate.get(curve?).copied(),
        }
    }

    /// Sets a parameter by the name [`Model::parameter`] takes; a name that is not there changes nothing.
    pub fn set_parameter(&mut self, name: &str, value: f64) {
        let place = if let Some((id, parameter)) = name.split_once('.') {
            let added = self.effects.iter_mut().find(|added| added.id == id);
            added.and_then(|added| added.parameters.get_mut(parameter))
        } else {
            match name {
                "voltage_gain" => Some(&mut self.actuator.voltage_gain),
                "pole" => Some(&mut self.actuator.pole),
                "inertia" => Some(&mut self.body.inertia),
                _ => CURVE
                    .iter()
                    .position(|(curve, _)| *curve == name)
                    .and_then(|power| self.actuator.steady_rate.get_mut(power)),
            }
        };
        if let Some(place) = place {
            *place = value;
        }
    }

    /// Names of the base's parameters that a fit of the rotors may change: those the model has.
    #[must_use]
    pub fn rotor_parameters(&self) -> Vec<&'static str> {
        let curve = CURVE.iter().zip(&self.actuator.steady_rate).filter(|(_, value)| **value != 0.0);
        let mut names: Vec<&'static str> = curve.map(|((name, _), _)| *name).collect();
        if self.actuator.voltage_gain != 0.0 {
            names.push("voltage_gain");
        }
        names.push("pole");
        names
    }

    /// Names of the base's parameters that a fit of the body may change.
    #[must_use]
    pub fn body_parameters(&self) -> Vec<&'static str> {
        vec!["inertia"]
    }

    /// Unit and symbol of a base parameter.
    #[must_use]
    pub fn base_parameter_unit(name: &str) -> (&'static str, &'static str) {
        match name {
            "voltage_gain" => ("rad/(s V)", "k_V"),
            "pole" => ("rad/s", "p"),
            "inertia" => ("kg m^2", "J"),
            _ => ("rad/s", CURVE.iter().find(|(curve, _)| *curve == name).map_or("", |(_, symbol)| symbol)),
        }
    }

    /// [rad/s] g(u), the static curve at full battery. [LPC16] Eq. (7).
    #[must_use]
    pub fn steady_rate(&self, command: f64) -> f64 {
        polynomial(&self.actuator.steady_rate, command)
    }

    /// [-] u_0, the command that holds the hover rate at full battery.
    #[must_use]
    pub fn hover_command(&self) -> f64 {
        let (mut low, mut high) = (0.0, 1.0);
        // Bisection: g rises with the command, whatever its degree.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.steady_rate(middle) < self.actuator.hover_rate { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests;
