//! The numbers without a slope in a fit: the step of a grid, and those of laws ahead of it. What stays of the grid where one of those
//! moves.

use super::block_data::{BlockData, Runs};
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::extremes;

/// A number among those of a problem.
#[derive(Debug, Clone)]
pub(crate) struct BoundedNumber {
    pub index: usize,
    /// Its smallest and largest value.
    pub bounds: (f64, f64),
}

/// The numbers without a slope among those of a problem.
#[derive(Debug, Clone)]
pub(crate) struct WithoutSlope {
    /// The step of the grid.
    pub grid: BoundedNumber,
    /// Numbers of laws ahead of it.
    pub ahead: Vec<BoundedNumber>,
    /// Ids of those laws.
    pub laws_ahead: Vec<String>,
}

impl WithoutSlope {
    /// All of them, the grid last.
    pub fn all(&self) -> impl Iterator<Item = &BoundedNumber> {
        self.ahead.iter().chain([&self.grid])
    }

    /// The same numbers with another one at a place, within its bounds; `constraint` says what stays of the grid.
    pub fn moved(
        &self,
        problem: &Problem,
        globals: &[f64],
        (place, value): (&BoundedNumber, f64),
        constraint: Option<&GridConstraint>,
    ) -> Vec<f64> {
        let mut moved = globals.to_vec();
        moved[place.index] = value.max(place.bounds.0).min(place.bounds.1);
        if let Some(constraint) = constraint {
            let step = self.command_at_grid(problem, &moved, constraint).map(|kept| kept / constraint.steps);
            let (least, most) = self.grid.bounds;
            moved[self.grid.index] = step.map_or(moved[self.grid.index], |step| step.max(least).min(most));
        }
        moved
    }

    /// Steps of the grid from nothing to what comes to it of the constraint's command.
    pub fn steps_at(&self, problem: &Problem, globals: &[f64], constraint: &GridConstraint) -> Option<f64> {
        Some(self.command_at_grid(problem, globals, constraint)? / globals[self.grid.index])
    }

    /// [-] what comes to the grid of the constraint's command, or how much more of one that is more.
    fn command_at_grid(
        &self,
        problem: &Problem,
        globals: &[f64],
        constraint: &GridConstraint,
    ) -> Option<f64> {
        let of = self.laws_ahead(problem, globals)?;
        let (command, reach) = (constraint.command, constraint.reach);
        Some(if reach > 0.0 { of(command + reach) - of(command - reach) } else { of(command) })
    }

    /// What the laws ahead of the grid make of a command: a limit behind the grid says nothing of where that lies.
    fn laws_ahead(&self, problem: &Problem, globals: &[f64]) -> Option<impl Fn(f64) -> f64> {
        let mut model = problem.model(globals);
        let ids: Vec<String> = model.effects.iter().map(|effect| effect.id.clone()).collect();
        for id in ids.iter().filter(|id| !self.laws_ahead.contains(id)) {
            model = model.without(id);
        }
        let equations = model.equations().ok()?;
        Some(move |command: f64| equations.command_behind_laws(command))
    }
}

/// What stays of a grid where a law ahead of it moves, at a command in the middle of those that come through.
pub(crate) struct GridConstraint {
    command: f64,
    /// [-] commands to each side between which a slope is taken; zero where the place on the grid stays, and not its spacing.
    reach: f64,
    /// What stays, in steps.
    steps: f64,
}

impl GridConstraint {
    /// What stays of it, in steps.
    pub fn steps(&self) -> f64 {
        self.steps
    }

    /// The place on the grid as `globals` have it; `None` where nothing is ahead of the grid, or nothing comes through.
    pub fn place(
        problem: &Problem,
        data: &BlockData,
        places: &WithoutSlope,
        globals: &[f64],
    ) -> Option<Self> {
        Self::of(problem, data, places, globals, 0.0)
    }

    /// How many commands as they are sent lie between two steps: so many whole steps further the grid lies as before.
    pub fn spacing(
        problem: &Problem,
        data: &BlockData,
        places: &WithoutSlope,
        globals: &[f64],
    ) -> Option<Self> {
        Self::of(problem, data, places, globals, THRESHOLDS.spacing_reach)
    }

    fn of(
        problem: &Problem,
        data: &BlockData,
        places: &WithoutSlope,
        globals: &[f64],
        reach: f64,
    ) -> Option<Self> {
        let Runs::Rotor(runs) = &data.runs else { return None };
        if places.ahead.is_empty() {
            return None;
        }
        let (low, high) = extremes(runs.iter().flat_map(|run| run.command.iter().copied()));
        let of = places.laws_ahead(problem, globals)?;
        let asked = |part: usize| low + (high - low) * part as f64 / THRESHOLDS.commands_asked as f64;
        let low = (0..THRESHOLDS.commands_asked).map(asked).find(|command| of(*command) > 0.0)?;
        let constraint = Self { command: 0.5 * (low + high), reach: reach * (high - low), steps: 1.0 };
        let steps = places.steps_at(problem, globals, &constraint)?;
        (steps.is_finite() && steps > 0.0).then_some(Self { steps, ..constraint })
    }
}

#[cfg(test)]
mod tests {
    use super::super::candidate_set::Candidate;
    use super::super::tests::{at_once, behind_a_dead_zone};
    use super::*;
    use crate::effect::Site;
    use crate::model::{Effect, Model, UserEffect};

    fn added(ids: &[&str]) -> (Model, Vec<Effect>) {
        let known = Model::paper().known_effects().expect("the catalogue");
        let effect = |id: &&str| known.iter().find(|effect| effect.id == *id).expect("known");
        (ids.iter().map(effect).fold(Model::paper(), |model, effect| model.with(effect)), known)
    }

    /// Whatever stands behind the grid: so many commands as they are sent lie between two steps as before.
    #[test]
    fn a_step_follows_the_width_of_a_dead_zone_behind_which_it_is_cut_off() {
        let (mut model, known) = added(&["command_dead_zone", "command_quantization", "command_saturation"]);
        model.set_parameter("command_saturation.limit", 0.4);
        let names = ["command_quantization.step", "command_dead_zone.width"].map(str::to_owned);
        let inside: Vec<&Effect> = known.iter().filter(|effect| model.has(&effect.id)).collect();
        let places = behind_a_dead_zone();
        // The middle of the range is in the dead zone, or far beyond the limit.
        for (highest, width) in [(1.0, 0.05), (0.5, 0.3)] {
            let data = at_once((0..400).map(|row| highest * f64::from(row) / 399.0));
            let problem = Problem::new(&data, model.clone(), names.to_vec(), &inside);
            let numbers = [0.03, width];
            let same = GridConstraint::spacing(&problem, &data, &places, &numbers).expect("it comes through");
            let moved = places.moved(&problem, &numbers, (&places.ahead[0], width + 0.01), Some(&same));
            let expected = 0.03 * (1.0 - width) / (1.0 - width - 0.01);
            assert_eq!(moved[1], width + 0.01);
            assert!((moved[0] - expected).abs() < 1e-9, "{highest}: {} and {expected}", moved[0]);
        }
    }

    #[test]
    fn a_number_moves_within_its_own_bounds() {
        let (model, known) = added(&["command_dead_zone", "command_quantization"]);
        let names = ["command_quantization.step", "command_dead_zone.width"].map(str::to_owned);
        let inside: Vec<&Effect> = known.iter().filter(|effect| model.has(&effect.id)).collect();
        let data = at_once((0..400).map(|row| f64::from(row) / 399.0));
        let problem = Problem::new(&data, model, names.to_vec(), &inside);
        let places = behind_a_dead_zone();
        let signed = BoundedNumber { index: 1, bounds: (-0.5, 0.5) };
        for (value, expected) in [(-0.08, -0.08), (-0.9, -0.5), (0.6, 0.5)] {
            assert_eq!(places.moved(&problem, &[0.03, 0.1], (&signed, value), None), [0.03, expected]);
        }
    }

    /// It moves no level, and its slope is there behind a grid, too.
    #[test]
    fn a_dead_time_is_not_looked_for_with_a_grid() {
        let (model, known) = added(&["transport_delay", "command_dead_zone", "command_quantization"]);
        let base = Vec::new();
        let candidate = Candidate {
            from: &model,
            nominal: &model,
            effects: Vec::new(),
            base,
            known: &known,
            without: None,
        };
        let inside = candidate.inside(&model);
        let names = candidate.names_in(&inside, true);
        let grid = names.iter().position(|name| name == "command_quantization.step").expect("the step");
        let places = candidate.without_slope(grid, &names, &model);
        assert_eq!(places.laws_ahead, ["command_dead_zone"]);
        assert_eq!(names[places.ahead[0].index], "command_dead_zone.width");
        for number in places.all() {
            let parameter = candidate.parameter(&names[number.index]).expect("of the catalogue");
            assert_eq!(number.bounds, parameter.bounds, "{}", parameter.name);
        }
    }

    /// A law of one's own that has no number moves the command ahead of a grid as well.
    #[test]
    fn a_law_without_a_number_acts_ahead_of_a_grid_too() {
        let mut model = Model::paper();
        model.user_effects.push(UserEffect {
            id: "mine".to_owned(),
            site: Site::Command,
            expression: "-0.05*command".to_owned(),
            parameters: Vec::new(),
            meaning: String::new(),
        });
        let known = model.known_effects().expect("the catalogue and mine");
        for id in ["mine", "command_quantization"] {
            model = model.with(known.iter().find(|effect| effect.id == id).expect("known"));
        }
        let (effects, base) = (Vec::new(), Vec::new());
        let candidate =
            Candidate { from: &model, nominal: &model, effects, base, known: &known, without: None };
        let places = candidate.without_slope(0, &["command_quantization.step".to_owned()], &model);
        assert!(places.ahead.is_empty());
        assert_eq!(places.laws_ahead, ["mine"]);
    }
}
