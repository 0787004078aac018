//! The loop that a controller closes about a model: gains, eigenvalues, margins, and what would make it better.

use nalgebra::Complex;
use serde::Serialize;

use super::thresholds::THRESHOLDS;
use crate::control::design::{Advice, Compensator, DiscreteLoop, LoopPlant, Margins, advise};
use crate::control::gains::{complementary_eigenvalues, feedback_matrix, predictor_matrix};
use crate::control::{
    Compensation, ControlError, ControllerConfig, ControllerKind, EmcConfig, EmcGains, PidConfig,
    PlantParameters,
};
use crate::model::Model;
use crate::runtime::{ProcessError, controller_plant};

/// A controller, and the plant that it closes a loop about.
#[derive(Debug, Clone)]
pub struct ControlLoop {
    /// Name of the model.
    pub model: String,
    /// What the controller knows of the plant.
    pub plant: PlantParameters,
    /// What the loop is closed about, the model's delays and lags in it.
    pub loop_plant: LoopPlant,
    /// What of the model's effects a controller can cancel.
    pub known: Compensation,
    /// The controller.
    pub config: ControllerConfig,
    /// [rad] angle at which the model's effects are linearized.
    pub angle: f64,
    /// [s] control period T_c.
    pub period_s: f64,
}

/// What comes of a [`ControlLoop`], as far as it goes.
#[derive(Debug)]
pub struct ControlDesign {
    /// Gains, if it is EMC.
    pub emc: Option<EmcDesign>,
    /// Gains, if it is a PID.
    pub pid: Option<PidConfig>,
    /// The loop, if there is a stable one.
    pub closed: Option<ClosedLoop>,
    /// Why there is none.
    pub refusal: Option<ControlError>,
}

/// A stable loop.
#[derive(Debug)]
pub struct ClosedLoop {
    /// Its response.
    pub response: DiscreteLoop,
    /// How much more it stands.
    pub margins: Margins,
    /// Where it is of little use: the time constant [s] with which what is left of a push fades, and the eigenvalue's modulus [-].
    pub sluggish: Option<(f64, f64)>,
    /// What would make it better.
    pub advice: Option<Advice>,
}

/// Eigenvalues and gains of EMC.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct EmcDesign {
    /// [-] β.
    pub beta: f64,
    /// [-] complementary eigenvalues of the predictor.
    pub gamma: [f64; 4],
    /// [-] those of the feedback.
    pub gamma_c: [f64; 3],
    /// [-] l_0 to l_3.
    pub observer_gain: [f64; 4],
    /// [-] k_1 to k_3.
    pub feedback_gain: [f64; 3],
    /// Eigenvalues of the predictor.
    pub predictor: Vec<Eigenvalue>,
    /// Eigenvalues of the feedback.
    pub feedback: Vec<Eigenvalue>,
}

/// An eigenvalue of a discrete loop.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Eigenvalue {
    /// [-] real part.
    pub real: f64,
    /// [-] imaginary part.
    pub imaginary: f64,
    /// [-] distance from 0; below 1 is stable.
    pub modulus: f64,
}

impl From<&Complex<f64>> for Eigenvalue {
    fn from(value: &Complex<f64>) -> Self {
        Self { real: value.re, imaginary: value.im, modulus: value.norm() }
    }
}

impl ControlLoop {
    /// The loop of `config` about `model` at rest at `angle` [rad], stepped each `period_s` [s].
    ///
    /// # Errors
    /// [`ProcessError::Plant`] when no controller can be built on the model.
    pub fn of(
        model: &Model,
        config: ControllerConfig,
        period_s: f64,
        angle: f64,
    ) -> Result<Self, ProcessError> {
        let (plant, known) = controller_plant::of_model(model)?;
        let loop_plant = controller_plant::loop_of_model(model, &plant, &known, angle);
        Ok(Self { model: model.name.clone(), plant, loop_plant, known, config, angle, period_s })
    }

    /// Gains, closed loop, margins and advice.
    ///
    /// # Errors
    /// [`ControlError`] for settings out of their range; a loop that is not stable is an answer.
    pub fn design(&self) -> Result<ControlDesign, ControlError> {
        let mut design = ControlDesign { emc: None, pid: None, closed: None, refusal: None };
        match self.close(&mut design) {
            Ok(closed) => design.closed = Some(closed),
            Err(error @ (ControlError::Unstable { .. } | ControlError::Unreachable { .. })) => {
                design.refusal = Some(error);
            }
            Err(error) => return Err(error),
        }
        Ok(design)
    }

    fn close(&self, design: &mut ControlDesign) -> Result<ClosedLoop, ControlError> {
        let compensator = match self.config.kind {
            ControllerKind::Emc => {
                let gains = self.config.emc.gains(self.plant.pole, self.period_s)?;
                design.emc = Some(emc_design(&self.config.emc, &gains));
                Compensator::Emc(gains)
            }
            ControllerKind::Pid => {
                self.config.pid.validate()?;
                design.pid = Some(self.config.pid);
                Compensator::Pid(self.config.pid)
            }
        };
        let response = self.closed(&compensator)?;
        let margins = response.margins();
        let advice = if self.config.kind == ControllerKind::Emc { self.advice(&margins) } else { None };
        Ok(ClosedLoop { sluggish: self.sluggish(&response), response, margins, advice })
    }

    fn closed(&self, compensator: &Compensator) -> Result<DiscreteLoop, ControlError> {
        let Self { plant, loop_plant, angle, period_s, .. } = self;
        let nothing = Compensation::default();
        let known = if self.config.compensate { &self.known } else { &nothing };
        DiscreteLoop::build(plant, loop_plant, compensator, known, *angle, *period_s)
    }

    /// Where a loop is stable and of no use.
    fn sluggish(&self, closed: &DiscreteLoop) -> Option<(f64, f64)> {
        let slowest = closed.eigenvalues().first()?.norm();
        let fades_s = -self.period_s / slowest.ln();
        (fades_s > THRESHOLDS.sluggish_s).then_some((fades_s, slowest))
    }

    fn advice(&self, margins: &Margins) -> Option<Advice> {
        advise(&self.config.emc, margins, self.plant.pole, self.period_s, |changed| {
            let gains = changed.gains(self.plant.pole, self.period_s).ok()?;
            Some(self.closed(&Compensator::Emc(gains)).ok()?.margins())
        })
    }
}

fn emc_design(config: &EmcConfig, gains: &EmcGains) -> EmcDesign {
    let gamma_0 = config.gamma_0.unwrap_or(gains.beta);
    let values = |eigenvalues: &[Complex<f64>]| eigenvalues.iter().map(Eigenvalue::from).collect();
    EmcDesign {
        beta: gains.beta,
        gamma: complementary_eigenvalues(gamma_0, config.alpha),
        gamma_c: complementary_eigenvalues(gamma_0, config.alpha_c),
        observer_gain: gains.l,
        feedback_gain: gains.k,
        predictor: values(predictor_matrix(gains.beta, gains.l).complex_eigenvalues().as_slice()),
        feedback: values(feedback_matrix(gains.beta, gains.k).complex_eigenvalues().as_slice()),
    }
}
