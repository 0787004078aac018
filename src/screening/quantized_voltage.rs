//! A battery that is read in steps as coarse as its noise, or coarser: over a few steps what is read is a quantized curve, which
//! no fit averages out. It bends with time as a battery does, and is taken for one.
//!
//! When a plateau ends is known far better than where on the plateau the voltage is. So what is read is taken for what it is, an
//! interval of one step around it, in which the voltage lies with its noise: the course over time, and what the load takes
//! with the cube of the rate, are those of greatest likelihood. Where steps are fine against the noise that is least squares.

mod columns;

use super::Finding;
use super::battery_plateaus::step_of;
use super::rotor_data::RotorLog;
use super::thresholds::THRESHOLDS;
use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::estimation::censored_normal::CensoredNormal;
use crate::estimation::moments::mean;
use crate::estimation::ridge::{RIDGE, RidgeSums};
use crate::log::segments::held_or;
use crate::threads::spread;
use columns::VoltageColumns;

/// Puts readings without plateaus in the place of a quantized reading, as noisy as what is known of the voltage. Says so where the
/// edges do not determine how it fell.
pub(crate) fn mend(rotor: &mut RotorLog) -> Option<Finding> {
    let voltage = rotor.voltage.as_deref()?;
    let step = step_of(voltage)?;
    let quantized = QuantizedVoltage {
        time: &rotor.time,
        voltage,
        step,
        edges: edges(voltage, step),
        course: Course::DETERMINED,
    };
    let with_load = load(rotor).and_then(|load| quantized.fit(Some(load)));
    let fit = with_load.or_else(|| quantized.fit(None))?;
    if fit.noise > THRESHOLDS.most_step_noise * step {
        return None;
    }
    let is_known = quantized.determines(&fit);
    // What the load takes and what time takes are one where no two edges lie under one load; a load that nothing asks for is
    // none.
    let has_load = fit.columns.load.is_some();
    let alone = |likelihood: f64| {
        quantized
            .fit(None)
            .filter(|it| quantized.determines(it) && it.likelihood + THRESHOLDS.load_likelihood > likelihood)
    };
    let taken = if is_known { Some(fit) } else { alone(fit.likelihood).or(Some(fit).filter(|_| has_load)) };
    let mended = taken.map(|fit| quantized.without_plateaus(&fit));
    if mended.is_some() {
        rotor.voltage = mended.map(Into::into);
    }
    (!is_known).then(|| rotor.finding("battery_quantized").with("step_v", (1e6 * step).round() / 1e6))
}

/// [V] What a quantized reading steps over, for what it drives: the course over time and under load, by more knots than a fit has use
/// for, and what is left beside it for longer than noise is. `None` of a fine reading, of one that never moves, and where no such
/// course is found.
pub(crate) fn seen_through(rotor: &RotorLog) -> Option<Vec<f64>> {
    let voltage = rotor.voltage.as_deref()?;
    let step = step_of(voltage)?;
    let edges = edges(voltage, step);
    let quantized = QuantizedVoltage { time: &rotor.time, voltage, step, edges, course: Course::FOLLOWED };
    let loads = load(rotor).map(Some).into_iter().chain([None]);
    let fits = loads.filter_map(|load| quantized.fit(load));
    let fit = fits.max_by(|a, b| a.likelihood.total_cmp(&b.likelihood))?;
    (fit.noise <= THRESHOLDS.most_step_noise * step).then(|| {
        let beside: Vec<f64> =
            (0..voltage.len()).map(|row| fit.noise * quantized.cut(&fit, row).mean).collect();
        let beside = averaged(&rotor.time, &beside, THRESHOLDS.averaged_beside);
        beside.into_iter().enumerate().map(|(row, beside)| fit.value(row) + beside).collect()
    })
}

/// Means over the time around each row, so long to either side.
fn averaged(time: &[f64], values: &[f64], reach: f64) -> Vec<f64> {
    let sums: Vec<f64> = std::iter::once(0.0)
        .chain(values.iter().scan(0.0, |sum, value| {
            *sum += value;
            Some(*sum)
        }))
        .collect();
    // Time rises, and with it where the mean begins and ends.
    let (mut from, mut to) = (0, 0);
    let mean = |at: &f64| {
        while time.get(from).is_some_and(|other| *other < at - reach) {
            from += 1;
        }
        while time.get(to).is_some_and(|other| *other <= at + reach) {
            to += 1;
        }
        (sums[to] - sums[from]) / (to - from) as f64
    };
    time.iter().map(mean).collect()
}

/// How finely a voltage's course over time is followed.
#[derive(Debug, Clone, Copy)]
struct Course {
    /// Steps for each knot.
    knot_steps: f64,
    /// [s] between two knots, at the least.
    shortest_bend: f64,
    /// In steps: how much it may bend at a knot, one standard deviation; infinite where the reading alone says.
    bend: f64,
}

impl Course {
    /// No more than the edges determine: for a fit that must know what they do not.
    const DETERMINED: Self = Self {
        knot_steps: THRESHOLDS.knot_steps,
        shortest_bend: THRESHOLDS.shortest_bend,
        bend: f64::INFINITY,
    };
    /// As near as it goes: between two edges a smooth way.
    const FOLLOWED: Self = Self {
        knot_steps: THRESHOLDS.followed_knot_steps,
        shortest_bend: THRESHOLDS.followed_bend,
        bend: THRESHOLDS.followed_smooth,
    };
}

/// Rows behind which the next plateau begins: there the voltage is in the middle between both.
fn edges(voltage: &[f64], step: f64) -> Vec<usize> {
    let is_edge = |row: &usize| {
        ((voltage[row + 1] - voltage[*row]).abs() / step - 1.0).abs() < THRESHOLDS.step_tolerance
    };
    (0..voltage.len() - 1).filter(is_edge).collect()
}

/// [V]
fn between(voltage: &[f64], row: usize) -> f64 {
    0.5 * (voltage[row] + voltage[row + 1])
}

/// A voltage as it is read.
struct QuantizedVoltage<'a> {
    /// [s]
    time: &'a [f64],
    /// [V]
    voltage: &'a [f64],
    /// [V]
    step: f64,
    /// Rows behind which the next plateau begins.
    edges: Vec<usize>,
    course: Course,
}

/// What it steps over.
struct Fit<'a> {
    columns: VoltageColumns<'a>,
    weights: DVector<f64>,
    /// [V]
    noise: f64,
    /// Logarithm.
    likelihood: f64,
}

/// What one pass over rows sums up.
struct Pass {
    sums: RidgeSums,
    /// [V²]
    variance: f64,
    /// Logarithm.
    likelihood: f64,
}

impl Fit<'_> {
    fn value(&self, row: usize) -> f64 {
        self.columns.at(row).map(|(at, x)| self.weights[at] * x).sum()
    }

    /// [V] over the log.
    fn fall(&self) -> f64 {
        (self.weights[self.columns.bends] - self.weights[0]).abs()
    }
}

impl<'a> QuantizedVoltage<'a> {
    fn fit(&self, load: Option<Vec<f64>>) -> Option<Fit<'a>> {
        let mut fit = self.by_edges(VoltageColumns { time: self.time, load, bends: 1 })?;
        let bends = (fit.fall() / (self.course.knot_steps * self.step))
            .min(fit.columns.span() / self.course.shortest_bend) as usize;
        if bends > 1 {
            fit = self.by_edges(VoltageColumns { bends, ..fit.columns })?;
        }
        for _ in 0..THRESHOLDS.most_passes {
            let Pass { mut sums, variance, likelihood } = self.pass(&fit);
            fit.likelihood = likelihood;
            self.smooth(&mut sums, &fit.columns, fit.noise, Some(&fit.weights));
            let change = sums.solve(self.voltage.len())?;
            fit.weights += &change;
            fit.noise =
                (variance / self.voltage.len() as f64).sqrt().max(THRESHOLDS.least_step_noise * self.step);
            if change.amax() < THRESHOLDS.pass_ended * self.step {
                break;
            }
        }
        Some(fit)
    }

    /// One pass over all rows; of many on every core, in parts whose number does not depend on that of the cores.
    fn pass(&self, fit: &Fit) -> Pass {
        let rows = self.voltage.len();
        let parts = if rows < THRESHOLDS.spread_rows { 1 } else { THRESHOLDS.spread_parts };
        let parts: Vec<Range<usize>> =
            (0..parts).map(|part| part * rows / parts..(part + 1) * rows / parts).collect();
        let mut done = spread(&parts, |rows| self.pass_over(fit, rows.clone())).into_iter();
        let first = done.next().unwrap_or_else(|| self.pass_over(fit, 0..0));
        done.fold(first, |all, part| Pass {
            sums: all.sums.and(&part.sums),
            variance: all.variance + part.variance,
            likelihood: all.likelihood + part.likelihood,
        })
    }

    fn pass_over(&self, fit: &Fit, rows: Range<usize>) -> Pass {
        let mut pass = Pass { sums: RidgeSums::new(fit.columns.count()), variance: 0.0, likelihood: 0.0 };
        for row in rows {
            let CensoredNormal { mean, weight, share } = self.cut(fit, row);
            let columns = fit.columns.at(row);
            pass.sums.add(columns, weight.max(THRESHOLDS.least_row_weight), fit.noise * mean);
            pass.variance += fit.noise * fit.noise * (mean * mean + (1.0 - weight).clamp(0.0, 1.0));
            pass.likelihood += share.ln();
        }
        pass
    }

    /// Least squares on the edges, and a little on the plateaus.
    fn by_edges(&self, columns: VoltageColumns<'a>) -> Option<Fit<'a>> {
        let mut sums = RidgeSums::new(columns.count());
        let weight = THRESHOLDS.plateau_weight * self.edges.len() as f64 / self.voltage.len() as f64;
        (0..self.voltage.len()).for_each(|row| sums.add(columns.at(row), weight, weight * self.voltage[row]));
        for &row in &self.edges {
            // Half on either side.
            let middle = 0.5 * between(self.voltage, row);
            [row, row + 1].into_iter().for_each(|row| sums.add(columns.at(row), 0.5, middle));
        }
        self.smooth(&mut sums, &columns, THRESHOLDS.edge_error * self.step, None);
        let weights = sums.solve(self.voltage.len())?;
        let mut fit = Fit { columns, weights, noise: 0.0, likelihood: 0.0 };
        let missed = self.edges.iter().map(|row| (between(self.voltage, *row) - fit.value(*row)).powi(2));
        let scatter = (missed.sum::<f64>() / self.edges.len() as f64).sqrt();
        fit.noise =
            scatter.clamp(THRESHOLDS.least_step_noise * self.step, THRESHOLDS.most_step_noise * self.step);
        Some(fit)
    }

    /// Where the course may bend no more than so much: as if that had been read at each knot, beside rows with this noise. With
    /// `weights` the rows ask for their change.
    fn smooth(
        &self,
        sums: &mut RidgeSums,
        columns: &VoltageColumns,
        noise: f64,
        weights: Option<&DVector<f64>>,
    ) {
        if self.course.bend.is_infinite() {
            return;
        }
        let weight = (noise / (self.course.bend * self.step)).powi(2);
        for knot in 1..columns.bends {
            let bend = [(knot - 1, 1.0), (knot, -2.0), (knot + 1, 1.0)];
            let now = weights.map_or(0.0, |weights| bend.iter().map(|(at, x)| x * weights[*at]).sum::<f64>());
            sums.add(bend.into_iter(), weight, -weight * now);
        }
    }

    fn cut(&self, fit: &Fit, row: usize) -> CensoredNormal {
        CensoredNormal::of(self.voltage[row] - fit.value(row), self.step, fit.noise)
    }

    /// Whether the edges determine how the voltage fell: all that lie near each other on one edge count as one.
    fn determines(&self, fit: &Fit) -> bool {
        let columns = &fit.columns;
        let mut places: BTreeMap<[i64; 2], (DVector<f64>, f64)> = BTreeMap::new();
        for &row in &self.edges {
            let place = [
                (between(self.voltage, row) / self.step).floor(),
                ((self.time[row] - self.time[0]) / THRESHOLDS.shortest_bend).floor(),
            ];
            let none = || (DVector::zeros(columns.count()), 0.0);
            let (sum, rows) = places.entry(place.map(|place| place as i64)).or_insert_with(none);
            columns.at(row).for_each(|(at, x)| sum[at] += x);
            *rows += 1.0;
        }
        let mut squares = DMatrix::identity(columns.count(), columns.count()) * RIDGE;
        for (sum, rows) in places.values() {
            squares += sum * sum.transpose() / (rows * rows);
        }
        let mut fall = DVector::zeros(columns.count());
        (fall[0], fall[columns.bends]) = (-1.0, 1.0);
        let Some(squares) = squares.cholesky() else { return false };
        let error = THRESHOLDS.edge_error * self.step * fall.dot(&squares.solve(&fall)).sqrt();
        error < THRESHOLDS.known_fall * fit.fall().max(self.step)
    }

    /// [V] What is left of the likelihood's slope has no part in the columns. With it, and as strong as what the plateaus say
    /// is weak, least squares on what is given here finds the same course, and with the errors that it has.
    fn without_plateaus(&self, fit: &Fit) -> Vec<f64> {
        let rows = || 0..self.voltage.len();
        let weight =
            rows().map(|row| self.cut(fit, row).mean.powi(2)).sum::<f64>() / self.voltage.len() as f64;
        let scale = fit.noise / weight.max(THRESHOLDS.least_row_weight);
        rows().map(|row| fit.value(row) + scale * self.cut(fit, row).mean).collect()
    }
}

/// [-] cubes of the rates of all that draws on the battery, over their mean, where they move.
fn load(rotor: &RotorLog) -> Option<Vec<f64>> {
    let cubes =
        |rate: &[f64]| -> Vec<f64> { held_or(rate, f64::NAN).iter().map(|rate| rate.powi(3)).collect() };
    let mut load = cubes(&rotor.rate);
    let beside = rotor.beside.as_ref().and_then(|beside| beside.rate.as_deref());
    if let Some(rate) = beside.filter(|rate| rate.iter().any(|rate| rate.is_finite())) {
        load.iter_mut().zip(cubes(rate)).for_each(|(load, other)| *load += other);
    }
    let scale = mean(&load);
    load.iter_mut().for_each(|load| *load /= scale);
    let variance = load.iter().map(|load| (load - 1.0).powi(2)).sum::<f64>() / load.len() as f64;
    (variance.sqrt() > THRESHOLDS.load_spread).then_some(load)
}

#[cfg(test)]
mod tests;
