//! Output-error fitting: the parameters with which a free run comes nearest to what was measured.
//!
//! A problem has global parameters, and local ones (initial states) of each unit (a stretch of a log between
//! holes, a window). The local ones are eliminated unit by unit, so that a thousand windows cost no more than
//! their simulation. Gauss-Newton steps with Levenberg-Marquardt damping; derivatives by differences of the
//! same simulation that serves every other purpose. Fits of very many short units keep no derivatives:
//! [`unit_fit`].

use std::ops::ControlFlow;

pub use super::fit_problem::{Fit, FitConfig, Free, OutputError, UnitResiduals};
pub use super::measured_rows::Residuals;
use super::normal_equations::Normal;
pub use super::normal_equations::Slopes;
pub use super::normal_equations::sum_of_squares;
use super::unit_fit;

mod gauss_newton;

use gauss_newton::{Descent, GaussNewton};

/// Fits a problem.
pub fn fit(problem: &dyn OutputError, free: &[Free], locals: Option<&[f64]>, config: &FitConfig) -> Fit {
    fit_from(problem, free, locals, config, None).0
}

/// Fits a problem that starts where another one ended whose residuals have the same layout, with its `slopes`: those of residuals
/// that do not count here are left out. Gives the slopes at the end, too, where they are kept: not of very many short units.
pub fn fit_from(
    problem: &dyn OutputError,
    free: &[Free],
    locals: Option<&[f64]>,
    config: &FitConfig,
    slopes: Option<&Slopes>,
) -> (Fit, Slopes) {
    if let Some(fit) = unit_fit::fit(problem, free, locals, config) {
        return (fit, Slopes::default());
    }
    let mut search = GaussNewton::start(problem, free, locals);
    let counts = |slopes: &Slopes| slopes.counting(&search.residuals, free.len(), problem.locals());
    let normal = match slopes.and_then(counts) {
        Some(slopes) => search.assembled(slopes),
        None => search.normal(None),
    };
    let end = search.go_on(Descent::from(normal), config);
    rescued(search, end, config)
}

/// The end of a search, or of where it goes on with units fitted by themselves that left much.
fn rescued(
    mut search: GaussNewton,
    (mut normal, mut iterations): (Normal, usize),
    config: &FitConfig,
) -> (Fit, Slopes) {
    let is_given_up = config.goal.is_some_and(|goal| search.cost > goal);
    if config.rescues_units && !is_given_up && search.rescue_units() {
        let from = Descent::from(search.normal(None));
        let more;
        (normal, more) = search.go_on(from, config);
        iterations += more;
    }
    search.finish(iterations, normal)
}

/// Fits a problem from several starts: from each for one step, and from the `most` that are best then as far as `config` says; these, best
/// first.
pub fn fit_best(
    problem: &dyn OutputError,
    starts: &[Vec<Free>],
    config: &FitConfig,
    most: usize,
) -> Vec<Fit> {
    let mut fits: Vec<Fit> = if starts.len() <= most || unit_fit::takes(problem) {
        starts.iter().map(|free| fit(problem, free, None, config)).collect()
    } else {
        let mut begun: Vec<_> = starts.iter().map(|free| one_step(problem, free, config)).collect();
        begun.sort_by(|(a, _), (b, _)| a.cost.total_cmp(&b.cost));
        begun.truncate(most);
        let finished = begun.into_iter().map(|(mut search, at)| {
            let end = match at {
                ControlFlow::Continue(at) => search.go_on(at, config),
                ControlFlow::Break(end) => end,
            };
            rescued(search, end, config).0
        });
        finished.collect()
    };
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    fits.truncate(most);
    fits
}

/// A search behind its first step that lowers the cost, and where it stands.
fn one_step<'a>(
    problem: &'a dyn OutputError,
    free: &'a [Free],
    config: &FitConfig,
) -> (GaussNewton<'a>, ControlFlow<(Normal, usize), Descent>) {
    let mut search = GaussNewton::start(problem, free, None);
    let cost = search.cost;
    let mut at = Descent::from(search.normal(None));
    loop {
        match search.advance(at, config) {
            ControlFlow::Continue(next) if search.cost >= cost => at = next,
            stands => return (search, stands),
        }
    }
}

/// Fits the local parameters alone, the globals held: the cost then validates the globals on other data.
pub fn validate(problem: &dyn OutputError, globals: &[f64]) -> Fit {
    validate_from(problem, globals, None)
}

/// The same from the locals and with the slopes of a fit of residuals that have the same layout.
pub fn validate_from(problem: &dyn OutputError, globals: &[f64], from: Option<(&[f64], &Slopes)>) -> Fit {
    let held: Vec<Free> =
        globals.iter().map(|value| Free { start: *value, bounds: (*value, *value), scale: 1.0 }).collect();
    // Locals enter almost linearly: a few steps suffice.
    let config =
        FitConfig { iterations: 6, tolerance: 1e-6, goal: None, reuses_slopes: false, rescues_units: true };
    let (locals, slopes) = from.map_or((None, None), |(locals, slopes)| (Some(locals), Some(slopes)));
    fit_from(problem, &held, locals, &config, slopes).0
}

#[cfg(test)]
mod tests;
