//! A hidden law that only an expression knows.

use crate::effect::{Expression, Point, Site};

use super::error::EmulateError;
use super::hidden_config::HiddenConfig;

/// A law that only an expression knows.
#[derive(Debug, Clone)]
pub(super) struct OwnLaw {
    pub site: Site,
    expression: Expression,
    parameters: Vec<f64>,
}

impl OwnLaw {
    pub fn build(config: &HiddenConfig, text: &str) -> Result<Self, EmulateError> {
        let fault = |reason: String| EmulateError::Hidden { effect: config.effect.clone(), reason };
        let site = config.site.ok_or_else(|| fault("an expression needs its `site`".to_owned()))?;
        let names: Vec<&str> = config.parameters.keys().map(String::as_str).collect();
        let expression = Expression::parse(text, &names).and_then(|it| it.at(site));
        let expression = expression.map_err(|error| fault(error.to_string()))?;
        Ok(Self { site, expression, parameters: config.parameters.values().copied().collect() })
    }

    /// What it remembers `span` [s] after it remembered `held`; `None` of one that does not.
    pub fn remembered(&self, held: Option<f64>, point: &Point, span: f64) -> Option<f64> {
        let at_rest = || self.expression.memory_at_rest(&self.parameters, point);
        let held = held.unwrap_or_else(at_rest);
        self.expression.remembers().then(|| self.expression.memory_after(&self.parameters, held, point, span))
    }

    /// What it adds at `point`, where the expression has a value there.
    pub fn value(&self, point: &Point) -> Option<f64> {
        Some(self.expression.value(&self.parameters, point)).filter(|value| value.is_finite())
    }
}
