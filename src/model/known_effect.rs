//! An effect as a fit knows it, from the catalogue or of the user's own.

use super::error::ModelError;
use super::user_effect::UserEffect;
use crate::effect::{Card, Expression, Law, Site};
use crate::signal::{Channel, columns};

/// An effect as the fitter sees it, from the catalogue or of the user's own.
#[derive(Debug, Clone)]
pub struct Effect {
    /// Its id.
    pub id: String,
    /// Where it acts.
    pub site: Site,
    /// How it acts.
    pub law: Law,
    /// Its parameters.
    pub parameters: Vec<EffectParameter>,
    /// Log columns it cannot be judged without.
    pub needs: Vec<String>,
    /// Its card, unless it is the user's own.
    pub card: Option<&'static Card>,
}

/// A parameter of an [`Effect`].
#[derive(Debug, Clone, PartialEq)]
pub struct EffectParameter {
    /// Name in files.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// Bounds of a fit.
    pub bounds: (f64, f64),
    /// Where fits start: the first is the card's start.
    pub starts: Vec<f64>,
    /// The value at which the effect is not there; not-a-number = none.
    pub neutral: f64,
}

impl Effect {
    /// Whether its law is a grid, to which a fit finds no slope.
    #[must_use]
    pub fn is_grid(&self) -> bool {
        matches!(self.law, Law::PiecewiseConstant(_))
    }

    pub(super) fn from_card(card: &'static Card) -> Self {
        let parameters = card.parameters.iter().map(|parameter| EffectParameter {
            name: parameter.name.to_owned(),
            unit: parameter.unit.to_owned(),
            bounds: (parameter.lower, parameter.upper),
            starts: std::iter::once(parameter.start).chain(parameter.others.iter().copied()).collect(),
            neutral: parameter.neutral,
        });
        Self {
            id: card.id.to_owned(),
            site: card.site,
            law: card.law.clone(),
            parameters: parameters.collect(),
            needs: card.needs.iter().map(|name| (*name).to_owned()).collect(),
            card: Some(card),
        }
    }

    pub(super) fn from_user(user: &UserEffect) -> Result<Self, ModelError> {
        let names: Vec<&str> = user.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
        let expression = Expression::parse(&user.expression, &names)
            .and_then(|expression| expression.at(user.site))
            .map_err(|error| ModelError::Expression { effect: user.id.clone(), error })?;
        let own: &[&str] = if user.site.is_rotor() {
            &[columns::ANY_COMMAND, columns::ANY_PROPELLER_RATE]
        } else {
            &[columns::BODY_RATE]
        };
        let looked_at = LOGGED.iter().filter(|channel| expression.names(channel.name()));
        let mut needs: Vec<String> = own.iter().map(|name| (*name).to_owned()).collect();
        needs.extend(looked_at.map(|channel| channel.column().to_owned()));
        let parameters = user.parameters.iter().map(|parameter| EffectParameter {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            bounds: (parameter.lower, parameter.upper),
            starts: user_starts(parameter.start, (parameter.lower, parameter.upper)),
            neutral: f64::NAN,
        });
        Ok(Self {
            id: user.id.clone(),
            site: user.site,
            law: Law::Expression(std::sync::Arc::new(expression)),
            parameters: parameters.collect(),
            needs,
            card: None,
        })
    }
}

/// What a log must have where an expression of the body looks at these, or one of a rotor at its battery.
const LOGGED: &[Channel] =
    &[Channel::BatteryVoltage, Channel::BodyAngle, Channel::PropellerRate1, Channel::PropellerRate2];

/// Where fits of a user's parameter start: where he says, with the other sign, and ten times as strong. He does not know how
/// strong his law is on this bench, and a law that begins too weak or the wrong way round may never come home.
fn user_starts(start: f64, (lower, upper): (f64, f64)) -> Vec<f64> {
    let others =
        [10.0 * start, -start].into_iter().filter(|other| *other != start && (lower..=upper).contains(other));
    std::iter::once(start).chain(others).collect()
}
