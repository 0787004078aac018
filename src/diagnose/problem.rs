//! A block of the model beside its data, as something that can be fitted.

use std::ops::Range;
use std::sync::Arc;

use super::block_data::{BlockData, Runs};
use super::body_block::BodyRun;
use super::rotor_block::RotorRun;
use super::thresholds::THRESHOLDS;
use super::{body_block, rotor_block};
use crate::cancel;
use crate::estimation;
use crate::estimation::measured_rows::MeasuredRows;
use crate::estimation::normal_equations::sum_of_squares;
use crate::estimation::output_error::{OutputError, UnitResiduals};
use crate::estimation::unit_fit;
use crate::model::{
    BodyInput, BodyTrace, Effect, Equations, LagInverse, LagPath, Model, Remembered, RotorTrace,
};
use crate::threads::spread_out;

/// Windows of the body that are simulated on one core.
const WINDOWS_OF_A_PIECE: usize = 64;

/// A block under a model, some parameters of which are free.
pub struct Problem<'a> {
    data: &'a BlockData,
    template: Model,
    names: Vec<String>,
    locals: usize,
}

impl<'a> Problem<'a> {
    /// The parameters `names` of `template` are free.
    #[must_use]
    pub fn new(data: &'a BlockData, template: Model, names: Vec<String>, effects: &[&Effect]) -> Self {
        let remembers = |effect: &&&Effect, slow: bool| matches!(&effect.law, crate::effect::Law::Memory(memory) if memory.slow == slow);
        let locals = if data.is_rotor() {
            let slow = effects.iter().any(|effect| effect.site.is_rotor() && remembers(&effect, true));
            1 + usize::from(slow && data.units().len() <= THRESHOLDS.most_slow_starts)
        } else {
            let sensor = |effect: &&&Effect| effect.site == crate::effect::Site::BodyRateSensor;
            data.channels().len()
                + usize::from(effects.iter().any(|effect| sensor(&effect) && remembers(&effect, false)))
        };
        Self { data, template, names, locals }
    }

    /// The model with the free parameters at `globals`.
    #[must_use]
    pub fn model(&self, globals: &[f64]) -> Model {
        let mut model = self.template.clone();
        for (name, value) in self.names.iter().zip(globals) {
            model.set_parameter(name, *value);
        }
        model
    }

    /// Sum of squares under a model, every unit started where it was measured.
    #[must_use]
    pub fn cost_of(&self, model: &Model) -> f64 {
        let start: Vec<f64> = self.names.iter().map(|name| model.parameter(name).unwrap_or(0.0)).collect();
        let locals = vec![0.0; self.data.units().len() * self.locals];
        if let Some(cost) = unit_fit::cost(self, &start, &locals) {
            return cost;
        }
        let mut residuals = vec![0.0; self.data.len()];
        self.residuals(&start, &locals, &mut residuals);
        sum_of_squares(&residuals)
    }

    /// [rad/s] what the rotors' sensors would tell, run by run, each started where it was measured; `None` for a body.
    #[must_use]
    pub fn simulated(&self) -> Option<Vec<Vec<f64>>> {
        let Runs::Rotor(runs) = &self.data.runs else { return None };
        let equations = self.template.equations().ok()?;
        let mut trace = RotorTrace::default();
        let rates = runs.iter().map(|run| {
            rotor_block::simulate(&equations, run, None, &[], &mut trace);
            trace.measured.clone()
        });
        Some(rates.collect())
    }

    /// The paths of the runs of rotors that are lags, for many numbers that move nothing but laws on the command; none where one is more.
    pub(super) fn lag_paths(&self, globals: &[f64]) -> Vec<LagPath> {
        let (Runs::Rotor(runs), Ok(equations)) = (&self.data.runs, self.model(globals).equations()) else {
            return Vec::new();
        };
        let paths: Option<Vec<LagPath>> =
            runs.iter().map(|run| rotor_block::lag_path(&equations, run)).collect();
        paths.unwrap_or_default()
    }

    /// The residuals as along these paths; as ever where there are none.
    pub(super) fn residuals_along(
        &self,
        paths: &[LagPath],
        (globals, locals): (&[f64], &[f64]),
        out: &mut [f64],
    ) {
        // The effects of the template were looked up before; an error here cannot happen, and would lose.
        let Ok(equations) = self.model(globals).equations() else {
            out.fill(f64::INFINITY);
            return;
        };
        match &self.data.runs {
            Runs::Rotor(runs) => self.rotor_residuals(&equations, (runs, paths), locals, out),
            Runs::Body(runs) => self.body_residuals(&BodyUnits::new(self, equations, runs), locals, out),
        }
    }

    /// Runs that go on with each other one after another, others side by side.
    fn rotor_residuals(
        &self,
        equations: &Equations,
        (runs, paths): (&[RotorRun], &[LagPath]),
        locals: &[f64],
        out: &mut [f64],
    ) {
        let mut unit = 0;
        let chains = runs.chunk_by(|before, next| (before.log, before.rotor) == (next.log, next.rotor));
        let chains = chains.map(|chain| {
            let first = unit;
            unit += chain.len();
            (first..unit, chain)
        });
        self.side_by_side(chains.collect(), out, |first, chain: &[RotorRun], out| {
            let start = self.data.units()[first].start;
            let mut end = None;
            for (place, run) in chain.iter().enumerate() {
                cancel::check();
                let unit = first + place;
                // Where the fit finds each run's start, the runs must not see each other.
                let last = chain[..place].last().filter(|_| self.locals == 1);
                let hole = last.and_then(|last| run.goes_on_after(last));
                let before = hole.zip(end).map(|(hole, end): (f64, Remembered)| end.across(hole));
                let rows = &self.data.units()[unit];
                let out = &mut out[rows.start - start..rows.end - start];
                let own = (self.local(locals, unit), self.data.sigma[0]);
                end = Some(rotor_block::residuals(equations, (run, paths.get(unit)), before, own, out));
            }
        });
    }

    fn body_residuals(&self, units: &BodyUnits, locals: &[f64], out: &mut [f64]) {
        let all = self.data.units().len();
        let pieces =
            (0..all).step_by(WINDOWS_OF_A_PIECE).map(|from| from..(from + WINDOWS_OF_A_PIECE).min(all));
        let pieces = pieces.map(|piece| (piece.clone(), piece)).collect();
        self.side_by_side(pieces, out, |_, piece: Range<usize>, out| {
            let own = locals.get(piece.start * self.locals..piece.end * self.locals).unwrap_or(&[]);
            units.write(piece, own, out);
        });
    }

    /// Writes the residuals of pieces, each of some units that follow each other, those of long ones on every core.
    fn side_by_side<P: Send>(
        &self,
        pieces: Vec<(Range<usize>, P)>,
        mut out: &mut [f64],
        write: impl Fn(usize, P, &mut [f64]) + Sync,
    ) {
        let is_long = out.len() >= estimation::thresholds::THRESHOLDS.parallel_residuals;
        let mut work = Vec::with_capacity(pieces.len());
        for (units, piece) in pieces.into_iter().filter(|(units, _)| !units.is_empty()) {
            let all = &self.data.units()[units.clone()];
            let length = all.iter().map(Range::len).sum();
            let Some((part, rest)) = std::mem::take(&mut out).split_at_mut_checked(length) else { return };
            out = rest;
            work.push((units.start, piece, part));
        }
        let one = |(first, piece, part): (usize, P, &mut [f64])| write(first, piece, part);
        if is_long {
            spread_out(work, one);
        } else {
            work.into_iter().for_each(one);
        }
    }

    fn local<'b>(&self, locals: &'b [f64], unit: usize) -> &'b [f64] {
        locals.get(unit * self.locals..(unit + 1) * self.locals).unwrap_or(&[])
    }
}

impl OutputError for Problem<'_> {
    fn units(&self) -> &[Range<usize>] {
        self.data.units()
    }

    fn locals(&self) -> usize {
        self.locals
    }

    fn len(&self) -> usize {
        self.data.len()
    }

    fn measured(&self) -> Option<&Arc<MeasuredRows>> {
        self.data.measured_rows()
    }

    fn by_units(&self, globals: &[f64]) -> Option<Box<dyn UnitResiduals + '_>> {
        let Runs::Body(runs) = &self.data.runs else { return None };
        let equations = self.model(globals).equations().ok()?;
        Some(Box::new(BodyUnits::new(self, equations, runs)))
    }

    fn residuals(&self, globals: &[f64], locals: &[f64], out: &mut [f64]) {
        self.residuals_along(&[], (globals, locals), out);
    }

    fn local_bounds(&self, unit: usize, index: usize) -> (f64, f64) {
        let all = (f64::NEG_INFINITY, f64::INFINITY);
        match &self.data.runs {
            Runs::Rotor(runs) if index == 0 => runs.get(unit).map_or(all, RotorRun::departures),
            _ => all,
        }
    }

    fn local_scale(&self, index: usize) -> f64 {
        match (&self.data.runs, index) {
            (Runs::Rotor(_), 0) => self.data.sigma[0],
            (Runs::Rotor(_), _) => 1.0,
            (Runs::Body(_), index) => self.data.sigma[index.min(1)],
        }
    }
}

/// The windows of a body under a model, which do not see each other.
struct BodyUnits<'a> {
    problem: &'a Problem<'a>,
    equations: Equations,
    /// Each with its inputs, where the model delays or lags them, how late its gyroscope is, and its first window.
    runs: Vec<(&'a BodyRun, Option<BodyInput>, LagInverse, usize)>,
}

impl<'a> BodyUnits<'a> {
    fn new(problem: &'a Problem<'a>, equations: Equations, runs: &'a [BodyRun]) -> Self {
        let mut first = 0;
        let runs = runs.iter().map(|run| {
            let own =
                (run, body_block::input_under(&equations, run), run.gyroscope_inverse(&equations), first);
            first += run.windows.len();
            own
        });
        let runs = runs.collect();
        Self { problem, equations, runs }
    }
}

impl UnitResiduals for BodyUnits<'_> {
    fn write(&self, units: Range<usize>, locals: &[f64], out: &mut [f64]) {
        let Problem { data, locals: count, .. } = *self.problem;
        let mut trace = BodyTrace::default();
        let start = data.units().get(units.start).map_or(0, |unit| unit.start);
        for (place, unit) in units.enumerate() {
            cancel::check();
            let run = self.runs.partition_point(|(.., first)| *first <= unit).saturating_sub(1);
            let Some((run, under, gyroscope, first)) = self.runs.get(run) else { return };
            let rows = &data.units()[unit];
            let out = &mut out[rows.start - start..rows.end - start];
            let own = locals.get(place * count..(place + 1) * count).unwrap_or(&[]);
            let run = (*run, under.as_ref().unwrap_or(&run.input));
            body_block::window_residuals(
                (&self.equations, gyroscope),
                run,
                unit - first,
                own,
                data.sigma,
                &mut trace,
                out,
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::rotor_block::rotor_runs;
    use super::*;
    use crate::estimation::output_error::validate;
    use crate::screening::tests::log_with_hole;

    /// What counts comes half a second after a run begins, and only a rate far off would move it.
    #[test]
    fn a_fit_begins_no_run_with_a_rate_that_no_rotor_has() {
        let mut run = rotor_runs(&[log_with_hole(300, &[], 900).into()]).remove(0);
        run.counts[..50].fill(false);
        let off = |row: usize| if row < 50 { 0.0 } else { 50.0 };
        run.measured = run.measured.iter().enumerate().map(|(row, rate)| rate + off(row)).collect();
        let (lowest, highest) = run.departures();
        assert!(lowest < 0.0 && highest > 0.0);
        let data = BlockData::new(Runs::Rotor(vec![run]));
        let problem = Problem::new(&data, Model::paper(), Vec::new(), &[]);
        assert_eq!(validate(&problem, &[]).locals, [highest]);
    }
}
