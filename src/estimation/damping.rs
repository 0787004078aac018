//! Levenberg-Marquardt damping of the steps of a search, and when they have become slow.

use super::fit_problem::FitConfig;
use super::thresholds::THRESHOLDS;
use crate::cancel;

/// How much the next step is held back, and how the last ones went.
#[derive(Debug)]
pub(super) struct Damping {
    size: f64,
    /// Slow steps in a row.
    slow: usize,
    /// Steps tried.
    tried: usize,
}

impl Damping {
    pub(super) fn new() -> Self {
        Self { size: 1e-4, slow: 0, tried: 0 }
    }

    /// Steps tried.
    pub(super) fn tried(&self) -> usize {
        self.tried
    }

    /// Whether all steps are tried that may be.
    pub(super) fn is_spent(&self, config: &FitConfig) -> bool {
        self.tried >= config.iterations
    }

    /// The first step that lowers the cost, with more damping each time that one does not, where it `may_shorten`. `step` tries one
    /// with a damping, and answers `None` where the cost did not fall.
    pub(super) fn descend<T>(
        &mut self,
        config: &FitConfig,
        may_shorten: bool,
        mut step: impl FnMut(f64) -> Option<T>,
    ) -> Option<T> {
        while self.size < THRESHOLDS.most_damping && !self.is_spent(config) {
            cancel::check();
            self.tried += 1;
            let (less, more) = THRESHOLDS.damping_turn;
            let taken = step(self.size);
            if taken.is_some() {
                self.size = (self.size * less).max(1e-12);
                return taken;
            }
            if !may_shorten {
                break;
            }
            self.size *= more;
        }
        None
    }

    /// Whether a search goes on too slowly to come to its goal, behind a step that lowered the cost to this one by a share `fall`; `None` =
    /// no step did.
    pub(super) fn is_given_up(&mut self, fall: Option<f64>, cost: f64, config: &FitConfig) -> bool {
        self.slow = if fall.is_some_and(|fall| fall > THRESHOLDS.slow_fall) { 0 } else { self.slow + 1 };
        self.slow >= THRESHOLDS.slow_steps && config.goal.is_some_and(|goal| cost > goal)
    }

    /// Whether steps are not held back: one that is short because it was says nothing about how far the valley goes on.
    pub(super) fn is_low(&self) -> bool {
        self.size < THRESHOLDS.held_back
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONFIG: FitConfig = FitConfig {
        iterations: 100,
        tolerance: 1e-6,
        goal: Some(1.0),
        reuses_slopes: false,
        rescues_units: false,
    };

    #[test]
    fn a_step_is_held_back_until_it_lowers_the_cost() {
        let mut damping = Damping::new();
        assert!(damping.is_low());
        let held_back = |size: f64| (size > 1e2 * THRESHOLDS.held_back).then_some(size);
        let taken = damping.descend(&CONFIG, true, held_back).expect("in the end");
        assert!(taken < THRESHOLDS.most_damping && damping.tried() > 1, "{taken} after {}", damping.tried());
        assert!(!damping.is_low(), "the next one is, too");
        // Where a shorter step is not what is wanting, one is tried.
        let before = damping.tried();
        assert_eq!(damping.descend(&CONFIG, false, |_| None::<()>), None);
        assert_eq!(damping.tried(), before + 1);
        let once = FitConfig { iterations: before + 2, ..CONFIG };
        assert_eq!(damping.descend(&once, true, |_| None::<()>), None);
        assert!(damping.is_spent(&once));
    }

    #[test]
    fn slow_steps_in_a_row_far_from_the_goal_are_given_up() {
        let mut damping = Damping::new();
        let slow = Some(0.5 * THRESHOLDS.slow_fall);
        let mut steps = |fall: Option<f64>, cost: f64| -> Vec<bool> {
            (0..THRESHOLDS.slow_steps).map(|_| damping.is_given_up(fall, cost, &CONFIG)).collect()
        };
        let gives_up_last = |steps: &[bool]| steps.iter().position(|it| *it) == Some(steps.len() - 1);
        assert!(gives_up_last(&steps(slow, 2.0)));
        assert!(!steps(slow, 0.5).contains(&true), "it is at the goal");
        assert!(!steps(Some(2.0 * THRESHOLDS.slow_fall), 2.0).contains(&true));
        assert!(gives_up_last(&steps(None, 2.0)), "a step that is none is slow");
    }
}
