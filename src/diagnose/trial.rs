//! One set of effects, everything refitted, judged on data it has not seen.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::problem::{BlockData, Problem, Runs};
use super::scan;
use crate::effect::Law;
use crate::identify::fit::{Fit, FitConfig, Free, OutputError, fit, judge};
use crate::model::{Effect, EffectParameter, Model};

/// Fewer training samples than this cannot tell.
const FEWEST_SAMPLES: usize = 100;
/// [-] commands that stay within this of each other excite nothing.
const LEAST_COMMAND: f64 = 1e-3;

/// The data of one block: to fit on, to judge on.
#[derive(Debug, Clone)]
pub struct Stage {
    /// To fit on.
    pub train: BlockData,
    /// Held out.
    pub validate: BlockData,
}

impl Stage {
    /// Tells both parts how large the noise of each channel is.
    pub fn set_sigma(&mut self, sigma: [f64; 2]) {
        // A channel without noise would weigh everything.
        let sigma = sigma.map(|sigma| if sigma.is_finite() && sigma > 0.0 { sigma } else { f64::EPSILON });
        self.train.sigma = sigma;
        self.validate.sigma = sigma;
    }

    /// Why the training data cannot tell anything about this block; `None` when they can.
    #[must_use]
    pub fn too_poor(&self) -> Option<String> {
        let spread = |values: &mut dyn Iterator<Item = f64>| {
            let finite = values.filter(|value| value.is_finite());
            let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
            high - low
        };
        let (samples, moved, what) = match &self.train.runs {
            Runs::Rotor(runs) => {
                let samples = runs.iter().map(|run| run.time.len()).sum::<usize>();
                let moved =
                    spread(&mut runs.iter().flat_map(|run| run.command.iter().copied())) > LEAST_COMMAND;
                (samples, moved, "the rotors' commands")
            }
            Runs::Body(runs) => {
                let samples = runs.iter().map(|run| run.rate.len()).sum::<usize>();
                let torque = spread(&mut runs.iter().flat_map(|run| run.input.torque.iter().copied()));
                (samples, torque > 0.0, "the torque on the body")
            }
        };
        if samples < FEWEST_SAMPLES {
            return Some(format!(
                "{samples} samples are too few to tell anything, {FEWEST_SAMPLES} are the least"
            ));
        }
        (!moved).then(|| format!("{what} hardly changed: these data excite nothing"))
    }

    /// Whether the rotors' runs have a battery voltage.
    fn has_voltage(&self) -> bool {
        match &self.train.runs {
            Runs::Rotor(runs) => runs.iter().all(|run| run.voltage.is_some()),
            Runs::Body(_) => true,
        }
    }

    /// Base parameters of this block that a fit may change.
    #[must_use]
    pub fn base_parameters(&self, model: &Model) -> Vec<String> {
        let names = if self.train.is_rotor() { model.rotor_parameters() } else { model.body_parameters() };
        let usable = |name: &&str| *name != "voltage_gain" || self.has_voltage();
        names.into_iter().filter(usable).map(str::to_owned).collect()
    }

    /// Whether an effect acts in this block.
    #[must_use]
    pub fn holds(&self, effect: &Effect) -> bool {
        effect.site.is_rotor() == self.train.is_rotor()
    }
}

/// A set of effects after its fit.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Ids of the effects added to the base, in order.
    pub effects: Vec<String>,
    /// The fitted model.
    pub model: Model,
    /// Names of the parameters that were free.
    pub names: Vec<String>,
    /// The fit on the training part.
    pub fit: Fit,
    /// The same parameters on the held-out part, only initial states refitted.
    pub judged: Fit,
}

/// Number of stretches the held-out residuals are compared by.
pub const CHUNKS: usize = 24;

impl Trial {
    /// Mean square of the held-out residuals over the noise's, the freedom of initial states taken off.
    #[must_use]
    pub fn validate(&self, stage: &Stage) -> f64 {
        mean_square(&self.judged, &stage.validate)
    }

    /// The same on the training part.
    #[must_use]
    pub fn train(&self, stage: &Stage) -> f64 {
        mean_square(&self.fit, &stage.train)
    }

    /// Root mean square of one channel in its unit, on the training or the held-out part.
    #[must_use]
    pub fn channel_error(&self, stage: &Stage, channel: usize, held_out: bool) -> f64 {
        let (fit, data) = if held_out { (&self.judged, &stage.validate) } else { (&self.fit, &stage.train) };
        let pieces = data.pieces(channel);
        let values =
            pieces.iter().flat_map(|piece| &fit.residuals[piece.clone()]).filter(|value| **value != 0.0);
        let (count, sum) = values.fold((0usize, 0.0), |(count, sum), value| (count + 1, sum + value * value));
        let free = count.saturating_sub(live_units(fit, data)).max(1);
        (sum / free as f64).sqrt() * data.sigma[channel]
    }

    /// By how much the held-out squared error falls from `self` to `after`, over the standard error of that fall
    /// from stretch to stretch: simulation errors are correlated, so samples do not count, stretches do.
    #[must_use]
    pub fn steadiness(&self, after: &Self) -> f64 {
        let size = self.judged.residuals.len().div_ceil(CHUNKS).max(1);
        let pairs = self.judged.residuals.chunks(size).zip(after.judged.residuals.chunks(size));
        let falls: Vec<f64> = pairs
            .filter(|(before, _)| before.iter().any(|value| *value != 0.0))
            .map(|(before, after)| power(before) - power(after))
            .collect();
        let count = falls.len() as f64;
        if falls.len() < 4 {
            return 0.0;
        }
        let mean = falls.iter().sum::<f64>() / count;
        let scatter = falls.iter().map(|fall| (fall - mean).powi(2)).sum::<f64>() / (count - 1.0);
        mean / (scatter / count).sqrt().max(f64::MIN_POSITIVE)
    }

    /// Whether two of its effects work against each other and little is left of both: then they are no physics but
    /// a curve bent to the data.
    #[must_use]
    pub fn cancels(&self, stage: &Stage, known: &[Effect]) -> bool {
        let traces: Vec<Vec<f64>> = self.effects.iter().map(|id| self.trace(stage, id, known)).collect();
        let pairs = traces.iter().enumerate().flat_map(|(at, one)| traces[at + 1..].iter().map(move |two| (one, two)));
        pairs.into_iter().any(|(one, two)| {
            let left: f64 = one.iter().zip(two).map(|(one, two)| (one + two).powi(2)).sum();
            left < LEFT_OF_BOTH * power(one).min(power(two))
        })
    }

    /// What the effect adds to the fitted simulation on the training part, all else held.
    fn trace(&self, stage: &Stage, id: &str, known: &[Effect]) -> Vec<f64> {
        let inside: Vec<&Effect> = known.iter().filter(|effect| self.model.has(&effect.id)).collect();
        let without = Problem::new(&stage.train, self.model.without(id), Vec::new(), &inside);
        let mut residuals = vec![0.0; self.fit.residuals.len()];
        without.residuals(&[], &self.fit.locals, &mut residuals);
        residuals.iter().zip(&self.fit.residuals).map(|(without, with)| without - with).collect()
    }
}

/// Of two effects that cancel, less than this share of the power of either is left.
const LEFT_OF_BOTH: f64 = 0.2;

fn power(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// Units in which anything was measured.
fn live_units(fit: &Fit, data: &BlockData) -> usize {
    data.units()
        .iter()
        .filter(|unit| fit.residuals[(*unit).clone()].iter().any(|value| *value != 0.0))
        .count()
}

fn mean_square(fit: &Fit, data: &BlockData) -> f64 {
    let used = fit.residuals.iter().filter(|value| **value != 0.0).count();
    let locals = fit.locals.len().checked_div(data.units().len()).unwrap_or(0);
    let free = used.saturating_sub(live_units(fit, data) * locals).max(1);
    fit.cost / free as f64
}

/// What a trial may change, and where it starts.
#[derive(Debug, Clone)]
pub struct Plan<'a> {
    /// The model it starts from, with fitted parameters.
    pub from: &'a Model,
    /// The model whose base numbers nobody has refitted: a fit that starts far from them starts from them, too.
    pub home: &'a Model,
    /// Effects to add, in order; those at the end that `from` lacks are started from their cards.
    pub effects: Vec<&'a Effect>,
    /// Base parameters that are free.
    pub base: Vec<String>,
    /// Every effect the model may hold, to look up.
    pub known: &'a [Effect],
}

/// Steps of the first look at each start.
const LOOK: FitConfig = FitConfig { iterations: 4, tolerance: 1e-3 };
/// The way to the end: a change of the cost by a hundred-thousandth decides nothing.
const FOLLOW: FitConfig = FitConfig { iterations: 25, tolerance: 1e-5 };
/// Starts that are followed to the end.
const FOLLOWED: usize = 2;
/// Most starts of one trial, from the same base numbers.
const MOST_STARTS: usize = 12;
/// A base number refitted by more than this share may have been driven into another valley by what is missing.
const STRAYED: f64 = 0.25;

impl Plan<'_> {
    /// Fits and judges.
    #[must_use]
    pub fn run(&self, stage: &Stage) -> Trial {
        let mut template = self.from.clone();
        let mut fresh = Vec::new();
        for effect in &self.effects {
            if !template.has(&effect.id) {
                template = template.with(effect);
                fresh.push(*effect);
            }
        }
        let inside: Vec<&Effect> = self.known.iter().filter(|effect| template.has(&effect.id)).collect();
        let in_block: Vec<&Effect> = inside.iter().copied().filter(|effect| stage.holds(effect)).collect();
        let mut names = self.base.clone();
        names.extend(in_block.iter().flat_map(|effect| {
            effect.parameters.iter().map(move |parameter| format!("{}.{}", effect.id, parameter.name))
        }));
        let problem = Problem::new(&stage.train, template.clone(), names.clone(), &inside);
        let mut best = self.starts(&template, &fresh, &names, stage, &problem);
        for (index, name) in names.iter().enumerate() {
            if self.in_stairs(name) {
                scan::polish(&problem, &stage.train, index, &mut best);
            }
        }
        let judged_on = Problem::new(&stage.validate, template, names.clone(), &inside);
        let judged = judge(&judged_on, &best.globals);
        let mut model = problem.model(&best.globals);
        for (name, error) in names.iter().zip(&best.standard_errors) {
            if error.is_finite() {
                model.standard_errors.insert(name.clone(), *error);
            }
        }
        Trial {
            effects: self.effects.iter().map(|effect| effect.id.clone()).collect(),
            model,
            names,
            fit: best,
            judged,
        }
    }

    /// Looks at every start of the fresh effects, and follows the best to the end.
    fn starts(
        &self,
        template: &Model,
        fresh: &[&Effect],
        names: &[String],
        stage: &Stage,
        problem: &Problem,
    ) -> Fit {
        let inside: Vec<&Effect> = self.known.iter().filter(|effect| template.has(&effect.id)).collect();
        let mut starts = vec![template.clone()];
        for effect in fresh {
            for parameter in &effect.parameters {
                let name = format!("{}.{}", effect.id, parameter.name);
                let values = if self.in_stairs(&name) {
                    scan::values(&stage.train, template, &name, parameter.bounds, &inside)
                } else {
                    parameter.starts.iter().skip(1).copied().collect()
                };
                let others: Vec<Model> = starts
                    .iter()
                    .flat_map(|model| values.iter().map(move |value| (model, *value)))
                    .map(|(model, value)| {
                        let mut other = model.clone();
                        other.set_parameter(&name, value);
                        other
                    })
                    .collect();
                starts.extend(others);
            }
        }
        starts.truncate(MOST_STARTS);
        if !fresh.is_empty() && self.strayed(template) {
            let at_home: Vec<Model> = starts.iter().map(|model| self.at_home(model)).collect();
            starts.extend(at_home);
        }
        let free = |model: &Model| -> Vec<Free> { names.iter().map(|name| self.free(model, name)).collect() };
        if starts.len() == 1 {
            return fit(problem, &free(template), None, &FOLLOW);
        }
        let mut looks: Vec<Fit> =
            starts.iter().map(|model| fit(problem, &free(model), None, &LOOK)).collect();
        looks.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        looks.truncate(FOLLOWED);
        let ends = looks.iter().map(|look| {
            let from = problem.model(&look.globals);
            fit(problem, &free(&from), Some(&look.locals), &FOLLOW)
        });
        let ends: Vec<Fit> = ends.collect();
        let best = (0..ends.len()).min_by(|a, b| ends[*a].cost.total_cmp(&ends[*b].cost)).unwrap_or(0);
        ends.into_iter().nth(best).unwrap_or_else(|| fit(problem, &free(template), None, &FOLLOW))
    }

    /// Whether a parameter is one of a law without slope.
    fn in_stairs(&self, name: &str) -> bool {
        let id = name.split_once('.').map_or("", |(id, _)| id);
        self.known.iter().any(|effect| effect.id == id && matches!(effect.law, Law::Stairs(_)))
    }

    /// Whether a free base number is far from where it was.
    fn strayed(&self, model: &Model) -> bool {
        self.base.iter().any(|name| match (model.parameter(name), self.home.parameter(name)) {
            (Some(now), Some(home)) => (now - home).abs() > STRAYED * home.abs(),
            _ => false,
        })
    }

    /// The model with its free base numbers where they were.
    fn at_home(&self, model: &Model) -> Model {
        let mut home = model.clone();
        for name in &self.base {
            if let Some(value) = self.home.parameter(name) {
                home.set_parameter(name, value);
            }
        }
        home
    }

    fn free(&self, model: &Model, name: &str) -> Free {
        let start = model.parameter(name).unwrap_or(0.0);
        let Some((id, parameter)) = name.split_once('.') else {
            return base_free(name, start);
        };
        let effect = self.known.iter().find(|effect| effect.id == id);
        let parameter =
            effect.and_then(|effect| effect.parameters.iter().find(|known| known.name == parameter));
        // A law in jumps is held where it was found.
        parameter.filter(|_| !self.in_stairs(name)).map_or(Free { start, bounds: (start, start), scale: 1.0 }, |parameter| Free {
            start,
            bounds: parameter.bounds,
            scale: typical(parameter),
        })
    }
}

/// The size a parameter typically has.
fn typical(parameter: &EffectParameter) -> f64 {
    let largest = parameter.starts.iter().fold(0.0, |largest: f64, start| largest.max(start.abs()));
    if largest > 0.0 { largest } else { 0.1 }
}

/// How far the base's own parameters may move in a fit.
fn base_free(name: &str, start: f64) -> Free {
    let bounds = match name {
        // Faster than a sample, or slower than a log, no fit can see.
        "pole" => (0.05, 400.0),
        "inertia" => (1e-4 * start, 1e4 * start),
        "voltage_gain" => (-1e3, 1e3),
        _ => (-1e6, 1e6),
    };
    Free { start, bounds, scale: start.abs().max(1e-9) }
}

/// Runs plans on every core; `done` is told after each.
pub fn run_all(plans: &[Plan], stage: &Stage, done: &(dyn Fn() + Sync)) -> Vec<Trial> {
    let next = AtomicUsize::new(0);
    let trials: Mutex<Vec<(usize, Trial)>> = Mutex::new(Vec::with_capacity(plans.len()));
    let cores =
        std::thread::available_parallelism().map_or(1, std::num::NonZero::get).min(plans.len().max(1));
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                while let Some((index, plan)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    plans.get(index).map(|plan| (index, plan))
                } {
                    let trial = plan.run(stage);
                    trials.lock().unwrap_or_else(PoisonError::into_inner).push((index, trial));
                    done();
                }
            });
        }
    });
    let mut trials = trials.into_inner().unwrap_or_else(PoisonError::into_inner);
    trials.sort_by_key(|(index, _)| *index);
    trials.into_iter().map(|(_, trial)| trial).collect()
}
