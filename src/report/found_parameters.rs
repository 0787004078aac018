//! The numbers of a model's effects, as a search found them.

use crate::diagnose::diagnosis::FoundParameter;
use crate::model::{AddedEffect, Model};

/// Parameters of the effects that a model has, by `effect.parameter`.
pub(super) fn found_parameters(model: &Model) -> Vec<(String, FoundParameter)> {
    let of = |added: &AddedEffect| {
        let known = model.effect(&added.id).map(|effect| effect.parameters).unwrap_or_default();
        let found = known.into_iter().filter_map(|parameter| {
            let name = format!("{}.{}", added.id, parameter.name);
            let value = *added.parameters.get(&parameter.name)?;
            let standard_error = model.standard_errors.get(&name).copied();
            Some((name, FoundParameter { value, standard_error, unit: parameter.unit }))
        });
        found.collect::<Vec<_>>()
    };
    model.effects.iter().flat_map(of).collect()
}
