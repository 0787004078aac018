//! Units whose own numbers stand in a wrong local minimum, fitted one by one: a step of all units together is taken or refused for all
//! of them. Dry friction, for one, makes two minima: of a start a little too fast, and of one a little too slow.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::fit_problem::{LOCAL_STEP, OutputError};
use super::normal_equations::sum_of_squares;
use super::quantile::median;
use super::thresholds::THRESHOLDS;
use super::unit_slopes::quotients;
use crate::cancel;
use crate::threads::spread;

/// Of a problem whose units do not see each other, those that leave many times what most leave, worst first: none where their
/// numbers are not their own, and not more than a small share of them.
fn stuck(squares: &[f64], lengths: &[usize]) -> Vec<usize> {
    let mean = |unit: usize| squares[unit] / lengths[unit].max(1) as f64;
    let mut counted: Vec<usize> = (0..squares.len()).filter(|unit| squares[*unit] > 0.0).collect();
    let means: Vec<f64> = counted.iter().map(|unit| mean(*unit)).collect();
    let Some(usual) = median(means.iter().copied()) else { return Vec::new() };
    let limit = THRESHOLDS.stuck_unit * usual;
    let most = (THRESHOLDS.most_stuck * counted.len() as f64).ceil() as usize;
    counted.retain(|unit| mean(*unit) > limit);
    counted.sort_by(|a, b| mean(*b).total_cmp(&mean(*a)));
    counted.truncate(most);
    counted
}

/// Fits the locals of units that leave much by themselves, from where they are and from zero; whether that lowered the cost
/// of all by a share that counts.
/// `squares` and `lengths` are the units' own.
pub(super) fn rescue(
    problem: &dyn OutputError,
    globals: &[f64],
    locals: &mut [f64],
    (squares, lengths): (&[f64], &[usize]),
) -> bool {
    let count = problem.locals();
    let units = stuck(squares, lengths);
    if count == 0 || units.is_empty() {
        return false;
    }
    let Some(at) = problem.by_units(globals) else { return false };
    let steps: Vec<f64> = (0..count).map(|index| LOCAL_STEP * problem.local_scale(index)).collect();
    let found = spread(&units, |unit| {
        cancel::check();
        let rows = problem.units()[*unit].len();
        let residuals = |own: &[f64]| {
            let mut out = vec![0.0; rows];
            at.write(*unit..*unit + 1, own, &mut out);
            out
        };
        let now = &locals[own(*unit, count)];
        let ends = [now.to_vec(), vec![0.0; count]].map(|start| descended(&residuals, start, &steps));
        ends.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))
    });
    let mut fall = 0.0;
    for (unit, end) in units.into_iter().zip(found) {
        if let Some((cost, end)) = end.filter(|(cost, _)| *cost < squares[unit]) {
            fall += squares[unit] - cost;
            locals[own(unit, count)].copy_from_slice(&end);
        }
    }
    fall > THRESHOLDS.rescued * squares.iter().sum::<f64>()
}

fn own(unit: usize, count: usize) -> Range<usize> {
    unit * count..(unit + 1) * count
}

/// Least cost, and the locals there, that steps held back as far as they must be lead to.
fn descended(residuals: &dyn Fn(&[f64]) -> Vec<f64>, mut locals: Vec<f64>, steps: &[f64]) -> (f64, Vec<f64>) {
    let mut left = residuals(&locals);
    let mut cost = sum_of_squares(&left);
    let mut damping = THRESHOLDS.rescue_damping;
    for _ in 0..THRESHOLDS.rescue_steps {
        let columns: Vec<Vec<f64>> = (0..locals.len())
            .map(|index| {
                let mut moved = locals.clone();
                moved[index] += steps[index];
                let mut column = residuals(&moved);
                quotients(&mut column, &left, steps[index]);
                column
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let gradient = DVector::from_fn(locals.len(), |row, _| dot(&columns[row], &left));
        let mut next = None;
        while next.is_none() && damping < THRESHOLDS.most_damping {
            let gram = DMatrix::from_fn(locals.len(), locals.len(), |row, column| {
                let product = dot(&columns[row], &columns[column]);
                // A local that shows nowhere stays where it is.
                if row == column { (1.0 + damping) * product + f64::MIN_POSITIVE } else { product }
            });
            let change = gram.lu().solve(&gradient);
            let moved = change.map(|change| locals.iter().zip(&change).map(|(a, b)| a - b).collect());
            let tried = moved.map(|moved: Vec<f64>| (residuals(&moved), moved));
            next = tried.filter(|(left, _)| sum_of_squares(left) < cost);
            let (less, more) = THRESHOLDS.damping_turn;
            damping *= if next.is_some() { less } else { more };
        }
        let Some((after, moved)) = next else { break };
        let fall = cost - sum_of_squares(&after);
        (left, locals, cost) = (after, moved, cost - fall);
        if fall < THRESHOLDS.rescue_tolerance * cost {
            break;
        }
    }
    (cost, locals)
}

#[cfg(test)]
mod tests {
    use crate::estimation::output_error::{Fit, FitConfig, Free, OutputError, UnitResiduals, fit};
    use std::ops::Range;

    /// Units of twenty readings of a global's line and of a step whose height turns with its local as an arc tangent does: from far
    /// away a whole step leads ever further.
    struct Turning {
        units: Vec<Range<usize>>,
        heights: Vec<f64>,
    }

    impl UnitResiduals for (&Turning, f64) {
        fn write(&self, units: Range<usize>, locals: &[f64], out: &mut [f64]) {
            let of_unit = units.clone().zip(locals).zip(out.chunks_mut(20));
            for ((unit, local), out) in of_unit {
                for (row, value) in out.iter_mut().enumerate() {
                    let line = (2.0 - self.1) * row as f64 / 20.0;
                    let wave = 0.01 * (7.0 * row as f64).sin();
                    *value = line + self.0.heights[unit] - (40.0 * local).atan() + wave;
                }
            }
        }
    }

    impl OutputError for Turning {
        fn units(&self) -> &[Range<usize>] {
            &self.units
        }
        fn locals(&self) -> usize {
            1
        }
        fn len(&self) -> usize {
            20 * self.units.len()
        }
        fn by_units(&self, globals: &[f64]) -> Option<Box<dyn UnitResiduals + '_>> {
            Some(Box::new((self, globals[0])))
        }
        fn residuals(&self, globals: &[f64], locals: &[f64], out: &mut [f64]) {
            (self, globals[0]).write(0..self.units.len(), locals, out);
        }
        fn local_scale(&self, _: usize) -> f64 {
            1e-3
        }
    }

    /// With so many units that start far away.
    fn fitted(far: usize, rescues_units: bool) -> Fit {
        let count = 60;
        let problem = Turning {
            units: (0..count).map(|unit| 20 * unit..20 * (unit + 1)).collect(),
            heights: (0..count).map(|unit| if unit % (count / far) == 0 { -1.45 } else { 0.3 }).collect(),
        };
        let free = [Free { start: 1.0, bounds: (-9.0, 9.0), scale: 1.0 }];
        let config = FitConfig { iterations: 6, tolerance: 1e-6, rescues_units, ..FitConfig::default() };
        fit(&problem, &free, None, &config)
    }

    #[test]
    fn units_in_a_wrong_local_minimum_are_led_out_of_it() {
        let noise: f64 = 60.0 * (0..20).map(|row| (0.01 * (7.0 * f64::from(row)).sin()).powi(2)).sum::<f64>();
        let (stuck, found) = (fitted(3, false), fitted(3, true));
        assert!(stuck.cost > 5.0 * noise, "else this shows nothing: {}", stuck.cost / noise);
        assert!(found.cost < 1.01 * noise, "{}", found.cost / noise);
        assert!((found.globals[0] - 2.0).abs() < 0.01, "{:?}", found.globals);
    }

    /// Where many units leave much the law is wrong, and not their starts; what was not measured leaves nothing.
    #[test]
    fn no_more_than_a_tenth_are_fitted_by_themselves() {
        let squares = |stuck: usize| -> Vec<f64> {
            (0..80)
                .map(|unit| {
                    if unit < 20 {
                        0.0
                    } else if unit < 20 + stuck {
                        50.0 + unit as f64
                    } else {
                        20.0
                    }
                })
                .collect()
        };
        assert_eq!(super::stuck(&squares(0), &[20; 80]), [0; 0]);
        assert_eq!(super::stuck(&squares(3), &[20; 80]), [22, 21, 20]);
        assert_eq!(super::stuck(&squares(20), &[20; 80]), [39, 38, 37, 36, 35, 34]);
        // As much in four times the readings is what most leave.
        assert_eq!(super::stuck(&squares(1), &[80; 80][..]), [20]);
        let long: Vec<usize> = (0..80).map(|unit| if unit == 20 { 80 } else { 20 }).collect();
        assert_eq!(super::stuck(&squares(1), &long), [0; 0]);
    }
}
