//! A candidate set of effects: which numbers its fit may change, and how far.

use super::grid_constraint::{BoundedNumber, WithoutSlope};
use super::grid_cost::MovableNumber;
use super::thresholds::THRESHOLDS;
use crate::effect::Law;
use crate::estimation::output_error::Free;
use crate::model::{Effect, EffectParameter, Model};

/// A candidate set: what its fit may change, and where it starts.
#[derive(Debug, Clone)]
pub struct Candidate<'a> {
    /// The model it starts from, with fitted parameters.
    pub from: &'a Model,
    /// The model whose base numbers nobody has refitted: a fit that starts far from them starts from them, too.
    pub nominal: &'a Model,
    /// Effects to add, in order; those at the end that `from` lacks are started from their cards.
    pub effects: Vec<&'a Effect>,
    /// Base parameters that are free.
    pub base: Vec<String>,
    /// Every effect the model may hold, to look up.
    pub known: &'a [Effect],
    /// Cost on the same data that the fit must come below to be fitted to the end, mostly of the set that one effect was
    /// added to; `None` where it does not matter.
    pub without: Option<f64>,
}

impl Candidate<'_> {
    /// Base numbers and parameters of the effects of a block that are free.
    pub(crate) fn names_in(&self, inside: &[&Effect], in_rotor: bool) -> Vec<String> {
        let mut names = self.base.clone();
        let in_block = inside.iter().filter(|effect| effect.site.is_rotor() == in_rotor);
        names.extend(in_block.flat_map(|effect| {
            effect.parameters.iter().map(move |parameter| format!("{}.{}", effect.id, parameter.name))
        }));
        names
    }

    /// The parameter of an effect, looked up.
    pub(crate) fn parameter(&self, name: &str) -> Option<&EffectParameter> {
        let (id, parameter) = name.split_once('.')?;
        let effect = self.known.iter().find(|effect| effect.id == id)?;
        effect.parameters.iter().find(|known| known.name == parameter)
    }

    /// Effects of a model, looked up.
    pub(crate) fn inside(&self, model: &Model) -> Vec<&Effect> {
        self.known.iter().filter(|effect| model.has(&effect.id)).collect()
    }

    pub(crate) fn frees(&self, names: &[String], model: &Model) -> Vec<Free> {
        names.iter().map(|name| self.free(model, name)).collect()
    }

    /// Whether a parameter is one of a law without slope.
    pub(crate) fn is_discontinuous(&self, name: &str) -> bool {
        let id = name.split_once('.').map_or("", |(id, _)| id);
        self.known.iter().any(|effect| effect.id == id && effect.is_grid())
    }

    /// Whether a number has no slope: that of a law in jumps, or of a law that acts on what such a one then takes to its grid.
    pub(crate) fn has_no_slope(&self, name: &str, model: &Model) -> bool {
        self.is_discontinuous(name) || self.is_ahead_of_grid(name, model)
    }

    /// The numbers without a slope beside the one of a law in jumps, at this index of `names`.
    pub(crate) fn without_slope(&self, grid: usize, names: &[String], model: &Model) -> WithoutSlope {
        let place = |index: usize| {
            let bounds = self.parameter(&names[index]).map_or((0.0, f64::INFINITY), |it| it.bounds);
            BoundedNumber { index, bounds }
        };
        let ahead: Vec<usize> =
            (0..names.len()).filter(|at| self.is_ahead_of_grid(&names[*at], model)).collect();
        let ids = self.inside(model).into_iter().filter(|law| self.acts_ahead_of_grid(law, model));
        let laws_ahead = ids.map(|law| law.id.clone()).collect();
        WithoutSlope { grid: place(grid), ahead: ahead.into_iter().map(place).collect(), laws_ahead }
    }

    /// Whether a number is that of a law ahead of one in jumps, in a model that has them both. A dead time moves no level: it has a
    /// slope behind a grid, too.
    pub(crate) fn is_ahead_of_grid(&self, name: &str, model: &Model) -> bool {
        let id = name.split_once('.').map_or("", |(id, _)| id);
        self.inside(model).iter().any(|law| law.id == id && self.acts_ahead_of_grid(law, model))
    }

    fn acts_ahead_of_grid(&self, law: &Effect, model: &Model) -> bool {
        let inside = self.inside(model);
        inside.iter().any(|grid| grid.is_grid() && acts_ahead_of(law, grid, model))
    }

    /// Of the numbers `names` of a model those that a fit may move beside a grid.
    pub(crate) fn beside_grid(&self, names: &[String], model: &Model) -> Vec<MovableNumber> {
        let movable = names.iter().filter(|name| !self.has_no_slope(name, model));
        movable
            .map(|name| MovableNumber { name: name.clone(), scale: self.free(model, name).scale })
            .collect()
    }

    fn free(&self, model: &Model, name: &str) -> Free {
        let start = model.parameter(name).unwrap_or(0.0);
        if !name.contains('.') {
            return base_free(name, start);
        }
        // Without a slope it is held where it was found.
        self.parameter(name).filter(|_| !self.has_no_slope(name, model)).map_or(
            Free { start, bounds: (start, start), scale: 1.0 },
            |parameter| Free { start, bounds: parameter.bounds, scale: typical(parameter) },
        )
    }
}

/// Whether a law moves the commands that come to a grid. A dead time moves no level.
pub(super) fn acts_ahead_of(law: &Effect, grid: &Effect, model: &Model) -> bool {
    !matches!(law.law, Law::Delay(_)) && model.acts_before(law, grid)
}

/// The size a parameter typically has.
fn typical(parameter: &EffectParameter) -> f64 {
    let largest = parameter.starts.iter().fold(0.0, |largest: f64, start| largest.max(start.abs()));
    if largest > 0.0 { largest } else { THRESHOLDS.unknown_size }
}

/// How far the base's own parameters may move in a fit.
fn base_free(name: &str, start: f64) -> Free {
    let bounds = match name {
        "pole" => THRESHOLDS.pole_bounds,
        "inertia" => {
            let (low, high) = THRESHOLDS.inertia_bounds;
            (low * start, high * start)
        }
        // A battery that gives way never makes a rotor faster; a model that says so is left as it is.
        "voltage_gain" => (start.min(0.0), THRESHOLDS.most_voltage_gain),
        _ => (-1e6, 1e6),
    };
    Free { start, bounds, scale: start.abs().max(1e-9) }
}
