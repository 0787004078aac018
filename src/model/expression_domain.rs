//! A user's expression must be a number wherever the logs put it.

use crate::effect::Law;
use crate::log::Dataset;
use crate::model::{Effect, Model, ModelError};
use crate::unit::short;

/// Where an expression is not a number.
pub(crate) struct Hitch {
    /// Id of the user's effect.
    pub effect: String,
    /// The log.
    pub log: String,
    /// [s] where.
    pub time: f64,
    /// What the expression saw there, name and value.
    pub signals: Vec<String>,
}

/// The first place of `log` where one of the expressions among `effects` is not a number: with the model's own values
/// where it has the effect, else where a fit would start.
///
/// # Errors
/// [`ModelError`] when the model cannot be used.
pub(crate) fn hitch(model: &Model, effects: &[Effect], log: &Dataset) -> Result<Option<Hitch>, ModelError> {
    let equations = model.equations()?;
    for effect in effects {
        let Law::Expression(expression) = &effect.law else { continue };
        let value = |parameter: &crate::model::EffectParameter| {
            let own = model.parameter(&format!("{}.{}", effect.id, parameter.name));
            own.or(parameter.starts.first().copied()).unwrap_or(0.0)
        };
        let parameters: Vec<f64> = effect.parameters.iter().map(value).collect();
        for (row, time) in log.time().iter().enumerate() {
            let at = |name: &str| log.column(name).and_then(|values| values.get(row)).copied();
            let point = equations.point_at(*time, &at);
            if !expression.value(&parameters, &point).is_finite() {
                let signals = expression.seen(&point).into_iter();
                return Ok(Some(Hitch {
                    effect: effect.id.clone(),
                    log: log.source_name().to_owned(),
                    time: *time,
                    signals: signals.map(|(name, value)| format!("{name} = {}", short(value))).collect(),
                }));
            }
        }
    }
    Ok(None)
}
