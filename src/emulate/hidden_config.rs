//! What is to be hidden, as people write it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::effect::{Site, find};
use crate::model::{AddedEffect, Model};
use crate::unit::short;

use super::error::EmulateError;

/// One `[[emulator.hidden]]` table: an effect's id and its parameters.
///
/// A law that no catalogue has: `examples/own_effect.rs`.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HiddenConfig {
    /// Id of the effect in the catalogue, or any name for an expression.
    pub effect: String,
    /// Parameters by the catalogue's names, SI; one left out takes the middle of its usual range.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// Where an expression acts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub site: Option<Site>,
    /// What it adds there, in signal names and parameters: a law that no catalogue has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expression: Option<String>,
}

impl HiddenConfig {
    /// From the command line: `id` or `id:name=value,name=value`.
    ///
    /// ```
    /// use rotorbench::emulate::HiddenConfig;
    ///
    /// let hidden = HiddenConfig::parse("gravity_pendulum:moment=0.4")?; // [N m]
    /// assert_eq!((hidden.effect.as_str(), hidden.parameters["moment"]), ("gravity_pendulum", 0.4));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`EmulateError::Hidden`] with the part that could not be read.
    pub fn parse(text: &str) -> Result<Self, EmulateError> {
        let (effect, list) = text.split_once(':').unwrap_or((text, ""));
        let mut parameters = BTreeMap::new();
        for pair in list.split(',').filter(|pair| !pair.trim().is_empty()) {
            let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
            let number = value.trim().parse().map_err(|_| EmulateError::Hidden {
                effect: effect.to_owned(),
                reason: format!("`{pair}` is not name=number"),
            })?;
            parameters.insert(name.trim().to_owned(), number);
        }
        Ok(Self { effect: effect.trim().to_owned(), parameters, ..Self::default() })
    }

    /// Refuses a parameter beyond the bounds of the effect's card, which no fit would ever find.
    pub(super) fn check_ranges(&self) -> Result<(), EmulateError> {
        let Some(card) = find(&self.effect) else { return Ok(()) };
        let found = card.parameters.iter().filter_map(|it| Some((it, *self.parameters.get(it.name)?)));
        let mut outside = found.filter(|(it, value)| !(it.lower..=it.upper).contains(value));
        let Some((it, value)) = outside.next() else { return Ok(()) };
        let unit = if it.unit == "-" { String::new() } else { format!(" {}", it.unit) };
        let [lower, upper, value] = [it.lower, it.upper, value].map(short);
        let reason = format!("`{}` must lie in {lower}..{upper}{unit}, not {value}", it.name);
        Err(EmulateError::Hidden { effect: self.effect.clone(), reason })
    }

    /// The effects of a model file, by the emulator's own laws; the user's own expressions as they stand.
    #[must_use]
    pub fn of_model(model: &Model) -> Vec<Self> {
        let of = |added: &AddedEffect| {
            let own = model.user_effects.iter().find(|own| own.id == added.id);
            Self {
                effect: added.id.clone(),
                parameters: added.parameters.clone(),
                site: own.map(|own| own.site),
                expression: own.map(|own| own.expression.clone()),
            }
        };
        model.effects.iter().map(of).collect()
    }
}

impl std::fmt::Display for HiddenConfig {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.effect)?;
        for (index, (name, value)) in self.parameters.iter().enumerate() {
            write!(formatter, "{}{name}={value:.4}", if index == 0 { ":" } else { "," })?;
        }
        Ok(())
    }
}
