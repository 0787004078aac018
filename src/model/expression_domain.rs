//! A user's expression must be a number wherever the logs put it.

use super::{Effect, EffectParameter, Model, ModelError};
use crate::effect::Law;
use crate::unit::short;

/// The first row of a log where an expression is not a number.
pub(crate) struct UndefinedRow {
    /// Id of the user's effect.
    pub effect: String,
    /// [s] when.
    pub time: f64,
    /// What the expression looks at there, name and value.
    pub signals: Vec<String>,
}

impl Model {
    /// The first row at which one of the expressions among `effects` is not a number: with the model's own values where it
    /// has the effect, else where a fit would start. `time` [s] and `column` are the log's.
    ///
    /// # Errors
    /// [`ModelError`] when the model cannot be used.
    pub(crate) fn first_undefined_row<'a>(
        &self,
        effects: &[Effect],
        time: &[f64],
        column: &dyn Fn(&str) -> Option<&'a [f64]>,
    ) -> Result<Option<UndefinedRow>, ModelError> {
        let equations = self.equations()?;
        for effect in effects {
            let Law::Expression(expression) = &effect.law else { continue };
            let value = |parameter: &EffectParameter| {
                let own = self.parameter(&format!("{}.{}", effect.id, parameter.name));
                own.or(parameter.starts.first().copied()).unwrap_or(0.0)
            };
            let parameters: Vec<f64> = effect.parameters.iter().map(value).collect();
            for (row, &time) in time.iter().enumerate() {
                let at = |name: &str| column(name).and_then(|values| values.get(row)).copied();
                let point = equations.point_at(time, &at);
                if !expression.value(&parameters, &point).is_finite() {
                    let signals = expression.seen(&point).into_iter();
                    let signals = signals.map(|(name, value)| format!("{name} = {}", short(value))).collect();
                    return Ok(Some(UndefinedRow { effect: effect.id.clone(), time, signals }));
                }
            }
        }
        Ok(None)
    }
}
