//! What the last step of the ladder changed, and the way back.

use std::collections::BTreeMap;

use super::{Change, Model};

impl Model {
    /// Every parameter a fit may change, by name.
    #[must_use]
    pub fn parameters(&self) -> BTreeMap<String, f64> {
        let base = self.rotor_parameters().into_iter().chain(self.body_parameters()).map(str::to_owned);
        let effects = self
            .effects
            .iter()
            .flat_map(|added| added.parameters.keys().map(move |name| format!("{}.{name}", added.id)));
        base.chain(effects).filter_map(|name| self.parameter(&name).map(|value| (name, value))).collect()
    }

    /// The base's own numbers that the last step of the ladder changed.
    #[must_use]
    pub fn last_changes(&self) -> Vec<Change> {
        let Some(step) = self.ladder.last() else { return Vec::new() };
        let changed =
            step.before.iter().filter(|(name, _)| !name.contains('.')).filter_map(|(name, from)| {
                let to = self.parameter(name).filter(|to| to != from)?;
                let standard_error = self.standard_errors.get(name).copied();
                Some(Change { name: name.clone(), from: *from, to, standard_error })
            });
        changed.collect()
    }

    /// Undoes the last step of the ladder; `None` when there is none.
    #[must_use]
    pub fn step_back(&self) -> Option<Self> {
        let mut model = self.clone();
        let step = model.ladder.pop()?;
        model.effects.retain(|added| !step.added.contains(&added.id));
        // Of what the step did not move the errors stand, too; of what it added they go with it.
        let is_moved = |name: &str| match step.before.get(name) {
            Some(before) => self.parameter(name) != Some(*before),
            None => name.contains('.'),
        };
        model.standard_errors.retain(|name, _| !is_moved(name));
        model.standard_errors.extend(step.standard_errors_before);
        for (name, value) in &step.before {
            model.set_parameter(name, *value);
        }
        // Of the model with the step.
        model.rotor_error = None;
        Some(model)
    }
}
