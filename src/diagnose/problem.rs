//! A block of the model beside its data, as something that can be fitted.

use std::ops::Range;

use super::block_data::{BlockData, Runs};
use super::thresholds::THRESHOLDS;
use super::{body_block, rotor_block};
use crate::cancel;
use crate::estimation::normal_equations::sum_of_squares;
use crate::estimation::output_error::OutputError;
use crate::model::{BodyTrace, Effect, Model, RotorTrace};

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

    fn residuals(&self, globals: &[f64], locals: &[f64], out: &mut [f64]) {
        // The effects of the template were looked up before; an error here cannot happen, and would lose.
        let Ok(equations) = self.model(globals).equations() else {
            out.fill(f64::INFINITY);
            return;
        };
        let sigma = self.data.sigma;
        match &self.data.runs {
            Runs::Rotor(runs) => {
                let mut trace = RotorTrace::default();
                for (unit, run) in runs.iter().enumerate() {
                    cancel::check();
                    // Where the fit finds each run's start, the runs must not see each other.
                    let last = runs[..unit].last().filter(|_| self.locals == 1);
                    let before =
                        last.and_then(|last| run.goes_on_after(last)).map(|hole| trace.remembered(hole));
                    rotor_block::simulate(&equations, run, before, self.local(locals, unit), &mut trace);
                    rotor_block::residuals(run, &trace, sigma[0], &mut out[self.data.units()[unit].clone()]);
                }
            }
            Runs::Body(runs) => {
                let mut trace = BodyTrace::default();
                let mut unit = 0;
                for run in runs {
                    let under = body_block::input_under(&equations, run);
                    let input = under.as_ref().unwrap_or(&run.input);
                    for window in 0..run.windows.len() {
                        cancel::check();
                        let out = &mut out[self.data.units()[unit].clone()];
                        let own = self.local(locals, unit);
                        body_block::window_residuals(
                            &equations,
                            (run, input),
                            window,
                            own,
                            sigma,
                            &mut trace,
                            out,
                        );
                        unit += 1;
                    }
                }
            }
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
