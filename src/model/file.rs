//! The model file: TOML, checked at the door, written complete or not at all.

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

use super::{MOST_COEFFICIENTS, Model};
use crate::effect::{CATALOGUE, ExpressionError};
use crate::file::{read_settings_text, toml_error, write_atomically};

/// Why a model cannot be read, written or used.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file system said no.
    #[error("model file {path}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Not the TOML of a model.
    #[error("{path}: {reason}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, column and reason.
        reason: String,
    },
    /// It names an effect that does not exist.
    #[error("unknown effect `{id}`{}", nearest.as_ref().map_or_else(|| "; `rotorbench effects` lists those there are".to_owned(), |id| format!("; did you mean `{id}`?")))]
    UnknownEffect {
        /// What was written.
        id: String,
        /// The id that looks most like it.
        nearest: Option<String>,
    },
    /// The expression of a user's effect does not parse.
    #[error("effect `{effect}`: {source}")]
    Expression {
        /// Id of the effect.
        effect: String,
        /// What is wrong with it.
        source: ExpressionError,
    },
    /// A value is missing, superfluous or out of range.
    #[error("{what}")]
    Value {
        /// A sentence that names the value.
        what: String,
    },
}

fn value_error<T>(what: String) -> Result<T, ModelError> {
    Err(ModelError::Value { what })
}

impl Model {
    /// Reads a model file; `paper` is built in.
    ///
    /// # Errors
    /// [`ModelError`] naming the file and the place.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        if path.as_os_str() == "paper" {
            return Ok(Self::paper());
        }
        let text =
            read_settings_text(path).map_err(|source| ModelError::File { path: path.to_owned(), source })?;
        Self::parse(&text, path)
    }

    /// The model in `text`; `path` is for the errors.
    ///
    /// # Errors
    /// [`ModelError`] naming the place.
    pub fn parse(text: &str, path: &Path) -> Result<Self, ModelError> {
        let in_file = |reason: String| ModelError::Syntax { path: path.to_owned(), reason };
        let model: Self = toml::from_str(text).map_err(|error| in_file(toml_error(text, &error)))?;
        model.check().map_err(|error| in_file(error.to_string()))?;
        Ok(model)
    }

    /// Writes a model file.
    ///
    /// # Errors
    /// [`ModelError`] when the system refuses; what was there before is then still there.
    pub fn save(&self, path: &Path) -> Result<(), ModelError> {
        let text = self.emit()?;
        write_atomically(path, text.as_bytes())
            .map_err(|source| ModelError::File { path: path.to_owned(), source })
    }

    /// The text of the model file.
    ///
    /// # Errors
    /// [`ModelError::Value`] when a value has no spelling in TOML.
    pub fn emit(&self) -> Result<String, ModelError> {
        toml::to_string(self).map_err(|error| ModelError::Value { what: error.to_string() })
    }

    /// Checks everything that the types do not.
    ///
    /// # Errors
    /// [`ModelError`] naming the value.
    pub fn check(&self) -> Result<(), ModelError> {
        self.check_base()?;
        let mut seen = BTreeSet::new();
        for user in &self.user_effects {
            if CATALOGUE.iter().any(|card| card.id == user.id)
                || !seen.insert(&user.id)
                || user.id.contains('.')
            {
                return value_error(format!("user effect `{}`: the id is taken or holds a dot", user.id));
            }
            for parameter in &user.parameters {
                let UserRange { start, lower, upper } = UserRange::of(parameter);
                if !(lower <= start && start <= upper && lower < upper) {
                    return value_error(format!(
                        "parameter `{}` of `{}`: start {start} is not between lower {lower} and upper {upper}",
                        parameter.name, user.id
                    ));
                }
            }
            self.effect(&user.id)?;
        }
        let mut added_ids = BTreeSet::new();
        for added in &self.effects {
            let effect = self.effect(&added.id)?;
            if !added_ids.insert(&added.id) {
                return value_error(format!("effect `{}` is there twice", added.id));
            }
            for parameter in &effect.parameters {
                match added.parameters.get(&parameter.name) {
                    Some(value) if value.is_finite() => {}
                    _ => {
                        return value_error(format!(
                            "effect `{}` lacks its parameter `{}`",
                            added.id, parameter.name
                        ));
                    }
                }
            }
            let known = |name: &String| effect.parameters.iter().any(|parameter| parameter.name == *name);
            if let Some(name) = added.parameters.keys().find(|name| !known(name)) {
                return value_error(format!("effect `{}` has no parameter `{name}`", added.id));
            }
        }
        Ok(())
    }

    fn check_base(&self) -> Result<(), ModelError> {
        let actuator = &self.actuator;
        if !(1..=MOST_COEFFICIENTS).contains(&actuator.steady_rate.len()) {
            return value_error(format!(
                "actuator.steady_rate has {} coefficients, 1 to {MOST_COEFFICIENTS} can be",
                actuator.steady_rate.len()
            ));
        }
        if actuator.steady_rate.iter().chain([&actuator.voltage_gain]).any(|value| !value.is_finite()) {
            return value_error("actuator.steady_rate and voltage_gain must be finite numbers".to_owned());
        }
        let positive = [
            ("actuator.full_voltage", actuator.full_voltage),
            ("actuator.pole", actuator.pole),
            ("actuator.thrust_coefficient", actuator.thrust_coefficient),
            ("actuator.hover_rate", actuator.hover_rate),
            ("body.inertia", self.body.inertia),
            ("body.arm", self.body.arm),
        ];
        match positive.iter().find(|(_, value)| !(value.is_finite() && *value > 0.0)) {
            Some((name, value)) => value_error(format!("{name} is {value}; it must be above zero")),
            None => Ok(()),
        }
    }
}

/// The numbers of a user's parameter.
struct UserRange {
    start: f64,
    lower: f64,
    upper: f64,
}

impl UserRange {
    fn of(parameter: &super::UserParameter) -> Self {
        Self { start: parameter.start, lower: parameter.lower, upper: parameter.upper }
    }
}

/// The known id that shares the longest run of letters pairs with `id`.
pub(super) fn nearest_id<'a>(id: &str, own: impl Iterator<Item = &'a str>) -> Option<String> {
    let pairs = |text: &str| text.as_bytes().windows(2).map(<[u8]>::to_vec).collect::<BTreeSet<_>>();
    let wanted = pairs(id);
    let similarity = |other: &str| {
        let other = pairs(other);
        let shared = wanted.intersection(&other).count();
        (200 * shared).checked_div(wanted.len() + other.len()).unwrap_or(0)
    };
    let known = CATALOGUE.iter().map(|card| card.id).chain(own);
    let (best, share) = known.map(|known| (known, similarity(known))).max_by_key(|(_, share)| *share)?;
    // Below a third of shared letter pairs it would be a guess.
    (share > 33).then(|| best.to_owned())
}
