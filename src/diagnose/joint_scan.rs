//! The numbers of a grid and of a law ahead of it looked at together: wherever a command that was sent comes to another level the cost
//! has a step, and moved one by one they stay where they are.

use super::block_data::{BlockData, Runs};
use super::grid_constraint::{GridConstraint, WithoutSlope};
use super::grid_search::command_gaps;
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::estimation::output_error::OutputError;
use crate::estimation::quantile::{extremes, median};

/// Sets of numbers looked at, and their costs.
#[derive(Default)]
pub(super) struct JointScan {
    looked: Vec<(Vec<f64>, f64)>,
    /// By how much each of the numbers, all of the problem, differs from one look to the next.
    apart: Vec<f64>,
}

impl JointScan {
    /// Looks where each command still comes to the level at which it is, or to the one beside it, and closer about the best; nowhere
    /// unless just one number is ahead of the grid, and where one by one the numbers are no better known than to such a difference
    /// of commands: no single command decides there. On long data it looks at fewer places.
    pub fn around(
        problem: &Problem,
        data: &BlockData,
        places: &WithoutSlope,
        globals: &[f64],
        (cost, limit): (&mut impl FnMut(&[f64]) -> f64, impl Fn(f64) -> f64),
    ) -> Self {
        let (Runs::Rotor(runs), [ahead]) = (&data.runs, &places.ahead[..]) else { return Self::default() };
        let (low, high) = extremes(runs.iter().flat_map(|run| run.command.iter().copied()));
        let (Some(gap), false) = (median(command_gaps(runs)), problem.len() > THRESHOLDS.most_searched_rows)
        else {
            return Self::default();
        };
        let grid = places.grid.index;
        let mut all =
            Self { looked: vec![(globals.to_vec(), cost(globals))], apart: vec![0.0; globals.len()] };
        let [first, _] = THRESHOLDS.joint_scan_reach;
        let limit = limit(all.looked[0].1);
        let place = GridConstraint::place(problem, data, places, globals);
        let is_decided = [-1.0, 1.0].iter().any(|sign| {
            let value = globals[ahead.index] + sign * first * gap;
            cost(&places.moved(problem, globals, (ahead, value), place.as_ref())) > limit
        });
        if !is_decided {
            return Self::default();
        }
        let [shifts, stretches] = counts(problem.len());
        let side = |count: i32| (-count..=count).map(move |at| f64::from(at) / f64::from(count));
        for reach in THRESHOLDS.joint_scan_reach.map(|gaps| gaps * gap) {
            let Some(about) = all.best().cloned() else { break };
            let Some(spacing) = GridConstraint::spacing(problem, data, places, &about) else { break };
            let share = (reach / (high - low)).min(THRESHOLDS.most_grid_stretch);
            for shift in side(shifts) {
                let shifted = about[ahead.index] + reach * shift;
                let shifted = places.moved(problem, &about, (ahead, shifted), Some(&spacing));
                for stretch in side(stretches) {
                    let step = shifted[grid] * (1.0 + stretch * share);
                    let at = places.moved(problem, &shifted, (&places.grid, step), None);
                    let cost = cost(&at);
                    all.looked.push((at, cost));
                }
            }
            all.apart[ahead.index] = reach / f64::from(shifts);
            all.apart[grid] = about[grid] * share / f64::from(stretches);
        }
        all
    }

    /// The best of them.
    pub fn best(&self) -> Option<&Vec<f64>> {
        let finite = self.looked.iter().filter(|(_, cost)| cost.is_finite());
        finite.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(best, _)| best)
    }

    /// Those with a cost below a limit.
    pub fn below(&self, limit: f64) -> Vec<Vec<f64>> {
        self.looked.iter().filter(|(_, cost)| *cost <= limit).map(|(at, _)| at.clone()).collect()
    }

    /// By how much the number at `index` differs from `best` at most where the cost is below a limit: from one look to the next, at least.
    pub fn spread(&self, index: usize, best: &[f64], limit: f64) -> f64 {
        let near = self.looked.iter().filter(|(_, cost)| *cost <= limit);
        let apart = self.apart.get(index).copied().unwrap_or(0.0);
        near.map(|(at, _)| (at[index] - best[index]).abs()).fold(apart, f64::max)
    }
}

/// Looks to each side at so many rows: of more, as many fewer.
fn counts(rows: usize) -> [i32; 2] {
    let share = (THRESHOLDS.joint_scan_rows as f64 / rows.max(1) as f64).min(1.0).sqrt();
    THRESHOLDS.joint_scan_counts.map(|count| (f64::from(count) * share).ceil() as i32)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{at_once, behind_a_dead_zone};
    use super::*;
    use crate::model::{Effect, Model};

    /// They are half their range apart: so much longer and shorter a step would be none.
    #[test]
    fn over_three_levels_no_step_of_nothing_is_looked_at() {
        let data = at_once((0..600).map(|row| 0.3 + 0.3 * f64::from(row / 20 % 3)));
        let known = Model::paper().known_effects().expect("the catalogue");
        let ids = ["command_dead_zone", "command_quantization"];
        let inside: Vec<&Effect> = known.iter().filter(|effect| ids.contains(&effect.id.as_str())).collect();
        let template = inside.iter().fold(Model::paper(), |model, effect| model.with(effect));
        let names = ["command_quantization.step", "command_dead_zone.width"].map(str::to_owned);
        let problem = Problem::new(&data, template, names.to_vec(), &inside);
        let (mut steps, start) = (Vec::new(), [0.05, 0.02]);
        let mut cost = |numbers: &[f64]| {
            steps.push(numbers[0]);
            (numbers[0] - start[0]).abs() + (numbers[1] - start[1]).abs()
        };
        let scan =
            JointScan::around(&problem, &data, &behind_a_dead_zone(), &start, (&mut cost, |cost| cost));
        assert_eq!(scan.best(), Some(&start.to_vec()));
        // The width moves by 0.6 at most, up to its bound of 0.5: half of all commands are behind it, and the step follows.
        assert!(steps.len() > 100 && steps.iter().all(|step| *step > 0.3 * start[0]), "{steps:?}");
        // Up to the limit the best and those a look apart are the same.
        assert!(scan.spread(1, &start, 0.0) > 0.0);
    }

    #[test]
    fn of_four_times_the_rows_it_takes_a_quarter_of_the_looks() {
        let full = THRESHOLDS.joint_scan_counts;
        assert_eq!(counts(THRESHOLDS.joint_scan_rows / 2), full);
        assert_eq!(counts(4 * THRESHOLDS.joint_scan_rows), full.map(|count| count / 2));
    }
}
