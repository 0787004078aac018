//! The model file: TOML, checked at the door, written complete or not at all.

use std::collections::BTreeSet;
use std::path::Path;

use super::error::ModelError;
use super::{MOST_COEFFICIENTS, Model};
use crate::effect::CATALOGUE;
use crate::file::{
    MappingPlace, SettingsKind, read_settings_text, settings_kind as kind, toml_error, write_atomically,
};

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
    /// ```
    /// use rotorbench::model::Model;
    ///
    /// let mut model = Model::paper();
    /// model.body.inertia *= 1.1; // [kg m²]
    /// let again = Model::parse(&model.emit()?, "heavier.toml".as_ref())?;
    /// assert_eq!(again, model);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`ModelError`] naming the place.
    pub fn parse(text: &str, path: &Path) -> Result<Self, ModelError> {
        let in_file = |reason: String| ModelError::Syntax { path: path.to_owned(), reason };
        let model: Self = toml::from_str(text).map_err(|error| match kind(text) {
            Some(SettingsKind::Bench) => ModelError::IsBench { path: path.to_owned() },
            Some(SettingsKind::Mapping) => {
                ModelError::IsMapping { path: path.to_owned(), place: MappingPlace::default() }
            }
            Some(SettingsKind::Log) => ModelError::IsLog { path: path.to_owned() },
            _ => in_file(toml_error(text, &error)),
        })?;
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
        if self.rotor_error.is_some_and(|error| !error.is_sound()) {
            return value_error(
                "rotor_error: rms, largest (not below it) and samples must be above zero, the commands from 0 to 1"
                    .to_owned(),
            );
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
