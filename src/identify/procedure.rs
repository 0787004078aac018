//! The whole of section III, as far as the logs reach.

use serde::Serialize;

use super::battery::{self, BatteryGain};
use super::body::{self, Body};
use super::frequency::{self, ResponsePoint};
use super::joint::{self, JointFit};
use super::pole;
use super::record_of::record_of;
use super::rivals::{self, Rival};
use super::rotor_log::{RotorLog, bounds};
use super::static_curve::{self, HIGHEST_DEGREE, StaticCurve};
use super::thrust::{self, ThrustCurve};
use super::validate::{self, Validation};
use super::{Estimate, IdentifiedActuator, IdentifyError};
use crate::model::Model;
use crate::record::Dataset;
use crate::signal::ROTORS;

/// Jumps of the command from which a pole may be fitted.
const FEWEST_JUMPS: usize = 8;
/// Scored samples from which anything may be fitted.
const FEWEST_SAMPLES: usize = 100;
/// Residual correlation above which the first-order lag leaves something unexplained.
const CORRELATED: f64 = 0.5;

/// What to identify from the logs, and what to take as given.
#[derive(Debug, Clone)]
pub struct IdentifySettings {
    /// Gives the full-battery voltage, the hover rate, the arm, and all that the logs do not show.
    pub template: Model,
    /// Degree of g(u); `None` = cross-validation chooses.
    pub degree: Option<usize>,
    /// Whether the battery takes part (where its voltage was logged).
    pub battery: bool,
    /// Which rotors' columns to use, from 1; they are taken as identical, as the paper does.
    pub rotors: Vec<usize>,
}

impl Default for IdentifySettings {
    fn default() -> Self {
        Self { template: Model::paper(), degree: None, battery: true, rotors: (1..=ROTORS).collect() }
    }
}

/// The pole from z to ω_p, [LPC16] section III.B.
///
/// **Deviation:** a gain and an offset are fitted beside the pole, so that a small error of the static curve does
/// not move it; both are shown, and the model keeps gain 1.
#[derive(Debug, Clone, Serialize)]
pub struct PoleFit {
    /// [rad/s]
    pub pole: Estimate,
    /// [-] gain from z to ω_p: 1 when the static curve holds in motion.
    pub gain: Estimate,
    /// [rad/s] offset fitted beside.
    pub offset: Estimate,
    /// [rad/s] rms of the residual.
    pub residual_rms: f64,
    /// Lag-one correlation of the residual: near zero when nothing is missing.
    pub residual_correlation: f64,
    /// Samples used.
    pub samples: usize,
    /// A delay and a second pole, tried.
    pub rivals: Vec<Rival>,
}

/// One step of section III: done, or why not.
#[derive(Debug, Clone, Serialize)]
pub struct Part {
    /// The step and its equation.
    pub step: &'static str,
    /// What was done, or what is missing.
    pub outcome: String,
    /// Whether it was done.
    pub done: bool,
}

/// All that the logs say.
#[derive(Debug, Clone, Serialize)]
pub struct Identification {
    /// The steps of section III, and which of them the logs permit.
    pub parts: Vec<Part>,
    /// k_V by Eq. (6).
    pub battery: Option<BatteryGain>,
    /// g(u) by Eq. (9).
    pub static_curve: Option<StaticCurve>,
    /// p by output error from z.
    pub pole: Option<PoleFit>,
    /// Everything at once.
    pub joint: Option<JointFit>,
    /// The rotor as the model file gets it.
    pub actuator: IdentifiedActuator,
    /// Frequency response from z to the measured rate.
    pub frequency_response: Vec<ResponsePoint>,
    /// [s] median sampling interval of the logs with lively commands.
    pub interval: f64,
    /// Thrust curve.
    pub thrust: Option<ThrustCurve>,
    /// Body.
    pub body: Option<Body>,
    /// How the result does on the logs it was fitted to.
    pub training: Vec<Validation>,
    /// How it does on other logs.
    pub validation: Vec<Validation>,
    /// What the reader must know.
    pub warnings: Vec<String>,
    /// The model: the template with all that was identified.
    #[serde(skip)]
    pub model: Model,
}

/// Identifies what the logs permit; `validation` logs are only compared.
///
/// # Errors
/// [`IdentifyError`] when the logs permit nothing at all, with what each step lacks.
pub fn identify(
    logs: &[Dataset],
    validation: &[Dataset],
    settings: &IdentifySettings,
) -> Result<Identification, IdentifyError> {
    if let Some(degree) = settings.degree.filter(|degree| !(1..=HIGHEST_DEGREE).contains(degree)) {
        return Err(IdentifyError::Degree(degree));
    }
    if logs.is_empty() {
        return Err(IdentifyError::NoLog);
    }
    let mut work = Work::new(logs, settings)?;
    work.battery();
    work.joint();
    work.static_curve();
    work.pole();
    work.thrust();
    let actuator = work.actuator();
    work.body(logs, &actuator);
    work.finish(logs, validation, actuator)
}

/// What is known so far.
struct Work<'a> {
    settings: &'a IdentifySettings,
    rotors: Vec<RotorLog>,
    lively: Vec<RotorLog>,
    use_battery: bool,
    parts: Vec<Part>,
    warnings: Vec<String>,
    battery: Option<BatteryGain>,
    joint: Option<JointFit>,
    static_curve: Option<StaticCurve>,
    pole: Option<PoleFit>,
    thrust: Option<ThrustCurve>,
    body: Option<Body>,
}

impl<'a> Work<'a> {
    fn new(logs: &[Dataset], settings: &'a IdentifySettings) -> Result<Self, IdentifyError> {
        let mut warnings = Vec::new();
        let rotors = rotor_logs(logs, settings, &mut warnings)?;
        let lively: Vec<RotorLog> =
            rotors.iter().filter(|rotor| rotor.jumps().len() >= FEWEST_JUMPS).cloned().collect();
        let with_voltage = rotors.iter().filter(|rotor| rotor.voltage.is_some()).count();
        let use_battery = settings.battery && with_voltage == rotors.len() && with_voltage > 0;
        if settings.battery && with_voltage < rotors.len() {
            let without: Vec<&str> = rotors
                .iter()
                .filter(|rotor| rotor.voltage.is_none())
                .map(|rotor| rotor.source.as_str())
                .collect();
            warnings.push(format!(
                "no column `battery_voltage_v` in {}: k_V cannot be identified, and g(u) and p are fitted without \
                 the battery's part, so they hold for the charge at which the log was made",
                without.join(", ")
            ));
        }
        let mut work = Self {
            settings,
            rotors,
            lively,
            use_battery,
            parts: Vec::new(),
            warnings,
            battery: None,
            joint: None,
            static_curve: None,
            pole: None,
            thrust: None,
            body: None,
        };
        if !use_battery {
            work.rotors.iter_mut().chain(&mut work.lively).for_each(|rotor| rotor.voltage = None);
        }
        Ok(work)
    }

    fn note(&mut self, step: &'static str, done: bool, outcome: impl Into<String>) {
        self.parts.push(Part { step, outcome: outcome.into(), done });
    }

    fn full_voltage(&self) -> f64 {
        self.settings.template.actuator.full_voltage
    }

    fn battery(&mut self) {
        const STEP: &str = "k_V from constant commands, Eq. (6)";
        if !self.use_battery {
            let why = if self.settings.battery { "no battery voltage in the logs" } else { "not asked for" };
            return self.note(STEP, false, why);
        }
        let (gain, left_out) = battery::identify(&self.rotors);
        match &gain {
            Some(gain) => self.note(STEP, true, format!("{} levels, {left_out} left out", gain.levels.len())),
            None if left_out > 0 => self.note(
                STEP,
                false,
                format!("{left_out} constant levels, but the voltage hardly moved over its noise; hold them longer"),
            ),
            None => self.note(STEP, false, "no command was held constant for five seconds after settling"),
        }
        self.battery = gain;
    }

    fn joint(&mut self) {
        const STEP: &str = "g(u), k_V and p at once, by output error";
        let samples: usize = self.lively.iter().map(|rotor| rotor.scored().count()).sum();
        if self.lively.is_empty() {
            let why = format!(
                "no log has at least {FEWEST_JUMPS} jumps of the command: steps or a PRBS excite the pole"
            );
            return self.note(STEP, false, why);
        }
        if samples < FEWEST_SAMPLES {
            let why =
                format!("only {samples} usable samples of command and rate, {FEWEST_SAMPLES} are the least");
            return self.note(STEP, false, why);
        }
        let (full_voltage, degree) = (self.full_voltage(), self.settings.degree);
        let fit = joint::identify(&self.lively, full_voltage, self.use_battery, degree, &mut self.warnings);
        match &fit {
            Some(fit) => self.note(STEP, true, format!("{} samples", fit.samples)),
            None => self.note(
                STEP,
                false,
                "the commands do not determine a curve of that degree: use more than two command levels, or ramps",
            ),
        }
        self.joint = fit;
    }

    /// The better of both estimates of k_V.
    fn voltage_gain(&self) -> Option<Estimate> {
        let steady = self.battery.as_ref().map(|battery| battery.gain);
        let lively = self.joint.as_ref().and_then(|joint| joint.voltage_gain);
        match (steady, lively) {
            (Some(a), Some(b)) => Some(if a.standard_error <= b.standard_error { a } else { b }),
            (a, b) => a.or(b),
        }
    }

    fn static_curve(&mut self) {
        const STEP: &str = "g(u) from ramps, Eq. (9)";
        let gain = self.voltage_gain().unwrap_or(if self.use_battery {
            Estimate { value: self.settings.template.actuator.voltage_gain, standard_error: 0.0 }
        } else {
            Estimate { value: 0.0, standard_error: 0.0 }
        });
        let Some(rows) = static_curve::steady_rows(&self.rotors, gain.value, self.full_voltage()) else {
            return self.note(
                STEP,
                false,
                "no slow ramps, and no constant levels that span a range of commands",
            );
        };
        let curve = static_curve::identify(&rows, gain.standard_error, self.settings.degree);
        match &curve {
            Some(curve) => {
                let from = if curve.from_ramps { "ramps" } else { "constant levels" };
                let (low, high) = curve.range;
                let outcome = format!("{} samples of {from}, commands {low:.3} to {high:.3}", curve.samples);
                if let Some(check) = curve.ramp_check.as_ref().filter(|check| !check.slow_enough) {
                    self.warnings.push(format!(
                        "the ramps are too fast for Eq. (4): at {:.3} 1/s the rate lags {:.0} ms, an error of \
                         {:.1} rad/s; slow them down",
                        check.fastest_slope,
                        1e3 * check.lag.value,
                        check.error
                    ));
                }
                self.note(STEP, true, outcome);
            }
            None => {
                self.note(STEP, false, "the levels of the command do not determine a curve of that degree")
            }
        }
        self.static_curve = curve;
    }

    fn pole(&mut self) {
        const STEP: &str = "p from z by output error, section III.B";
        if self.static_curve.is_none() || self.lively.is_empty() {
            let why =
                if self.joint.is_some() { "taken from the fit of all at once" } else { "no lively commands" };
            return self.note(STEP, false, why);
        }
        let actuator = self.actuator();
        let steady = |u: f64, drop: f64| {
            static_curve::polynomial(&actuator.coefficients, u) - actuator.voltage_gain * drop
        };
        let record = |rotors: &[RotorLog], delay: f64| {
            record_of(rotors, actuator.full_voltage, delay, |u, drop| [steady(u, drop), 1.0])
        };
        let Some(fit) = pole::fit(&record(&self.lively, 0.0)) else {
            return self.note(STEP, false, "the commands do not move z enough");
        };
        let rivals = rivals::both(&fit, &self.lively, record);
        self.note(STEP, true, format!("{} samples", fit.samples));
        let estimate =
            |index: usize| Estimate { value: fit.coefficients[index], standard_error: fit.error(index) };
        self.pole = Some(PoleFit {
            pole: Estimate { value: fit.pole, standard_error: fit.pole_error() },
            gain: estimate(0),
            offset: estimate(1),
            residual_rms: fit.residual_rms,
            residual_correlation: fit.residual_correlation,
            samples: fit.samples,
            rivals,
        });
    }

    fn thrust(&mut self) {
        const STEP: &str = "thrust curve and its tangent, Eq. (13)";
        let hover = self.settings.template.actuator.hover_rate;
        self.thrust = thrust::identify(&self.rotors, hover, &mut self.warnings);
        match &self.thrust {
            Some(thrust) => self.note(STEP, true, format!("{} samples", thrust.samples)),
            None => self.note(STEP, false, "no thrust in the logs; the template's curve is kept"),
        }
    }

    fn body(&mut self, logs: &[Dataset], actuator: &IdentifiedActuator) {
        const STEP: &str = "J from an attitude log, Eq. (1)";
        let arm = self.settings.template.body.arm;
        let warnings = &mut self.warnings;
        let fits: Vec<Body> =
            logs.iter().filter_map(|log| body::identify(log, actuator, arm, warnings)).collect();
        // The log that says most decides; the others are in agreement or are warned of.
        let best =
            fits.iter().min_by(|a, b| a.inertia.standard_error.total_cmp(&b.inertia.standard_error)).cloned();
        if let Some(best) = &best {
            for other in &fits {
                let sigma = other.inertia.standard_error.hypot(best.inertia.standard_error);
                if (other.inertia.value - best.inertia.value).abs() > 4.0 * sigma {
                    self.warnings.push(format!(
                        "{} says J = {:.5} kg m², {} says {:.5}: not the same bench, or something is missing in the \
                         body's model",
                        best.source, best.inertia.value, other.source, other.inertia.value
                    ));
                }
            }
        }
        match &best {
            Some(best) => self.note(STEP, true, format!("{} samples, {}", best.samples, best.driven_by)),
            None => {
                self.note(STEP, false, "no log in which a torque moves the body; the template's J is kept")
            }
        }
        self.body = best;
    }

    /// The rotor as known so far.
    fn actuator(&self) -> IdentifiedActuator {
        let template = &self.settings.template.actuator;
        let values = |estimates: &[Estimate]| estimates.iter().map(|estimate| estimate.value).collect();
        let coefficients = match (&self.static_curve, &self.joint) {
            (Some(curve), _) => values(&curve.coefficients),
            (None, Some(joint)) => values(&joint.coefficients),
            (None, None) => template.steady_rate.get(1..).unwrap_or_default().to_vec(),
        };
        // With the curve of the joint fit goes the gain of the joint fit: they belong together.
        let gain = match (&self.static_curve, &self.joint) {
            (None, Some(joint)) => joint.voltage_gain,
            _ => self.voltage_gain(),
        };
        let kept = if self.use_battery { template.voltage_gain } else { 0.0 };
        IdentifiedActuator {
            coefficients,
            voltage_gain: gain.map_or(kept, |gain| gain.value),
            full_voltage: template.full_voltage,
            pole: self.pole_estimate().map_or(template.pole, |pole| pole.value),
            thrust_coefficient: self
                .thrust
                .as_ref()
                .map_or(template.thrust_coefficient, |thrust| thrust.coefficient.value),
        }
    }

    fn pole_estimate(&self) -> Option<Estimate> {
        let alone = self.pole.as_ref().map(|fit| fit.pole);
        alone.or(self.joint.as_ref().map(|joint| joint.pole))
    }

    fn model(&self, actuator: &IdentifiedActuator) -> Model {
        let mut model = self.settings.template.clone();
        model.name = "identified".to_owned();
        model.ladder.clear();
        model.standard_errors.clear();
        model.actuator.steady_rate =
            std::iter::once(0.0).chain(actuator.coefficients.iter().copied()).collect();
        model.actuator.voltage_gain = actuator.voltage_gain;
        model.actuator.pole = actuator.pole;
        model.actuator.thrust_coefficient = actuator.thrust_coefficient;
        let mut error = |name: &str, value: f64| {
            if value.is_finite() && value > 0.0 {
                model.standard_errors.insert(name.to_owned(), value);
            }
        };
        let coefficients = match (&self.static_curve, &self.joint) {
            (Some(curve), _) => curve.coefficients.as_slice(),
            (None, Some(joint)) => joint.coefficients.as_slice(),
            (None, None) => &[],
        };
        const NAMES: [&str; HIGHEST_DEGREE] =
            ["steady_rate_linear", "steady_rate_quadratic", "steady_rate_cubic", "steady_rate_quartic"];
        coefficients.iter().zip(NAMES).for_each(|(estimate, name)| error(name, estimate.standard_error));
        if let Some(pole) = self.pole_estimate() {
            error("pole", pole.standard_error);
        }
        if let Some(gain) = self.voltage_gain().filter(|gain| gain.value == actuator.voltage_gain) {
            error("voltage_gain", gain.standard_error);
        }
        if let Some(body) = &self.body {
            error("inertia", body.inertia.standard_error);
            model.body.inertia = body.inertia.value;
        }
        model
    }

    fn finish(
        mut self,
        logs: &[Dataset],
        validation: &[Dataset],
        actuator: IdentifiedActuator,
    ) -> Result<Identification, IdentifyError> {
        if self.parts.iter().all(|part| !part.done) {
            let mut reasons: Vec<String> =
                self.parts.iter().map(|part| format!("{}: {}", part.step, part.outcome)).collect();
            if self.rotors.is_empty() {
                let names: Vec<&str> = logs.iter().flat_map(Dataset::names).collect();
                let found = if names.is_empty() { "nothing but time".to_owned() } else { names.join(", ") };
                reasons
                    .insert(0, format!("no log holds command_N and propeller_rate_N_rad_s; found {found}"));
            }
            reasons.extend(self.warnings);
            return Err(IdentifyError::Nothing { reasons });
        }
        self.check_results();
        let response = frequency::response(&self.lively, |rotor, row| {
            actuator.steady_rate(rotor.command[row], rotor.voltage.as_ref().map(|voltage| voltage[row]))
        });
        let validate = |rotors: &[RotorLog]| -> Vec<Validation> {
            rotors.iter().filter_map(|rotor| validate::validate(rotor, &actuator)).collect()
        };
        let mut other = rotor_logs(validation, self.settings, &mut self.warnings)?;
        if !self.use_battery {
            other.iter_mut().for_each(|rotor| rotor.voltage = None);
        }
        Ok(Identification {
            model: self.model(&actuator),
            frequency_response: response,
            interval: self.lively.first().map_or(0.0, |rotor| rotor.interval),
            training: validate(&self.rotors),
            validation: validate(&other),
            parts: self.parts,
            battery: self.battery,
            static_curve: self.static_curve,
            pole: self.pole,
            joint: self.joint,
            actuator,
            thrust: self.thrust,
            body: self.body,
            warnings: self.warnings,
        })
    }

    /// Says where the results contradict each other or leave something over.
    fn check_results(&mut self) {
        let mut say = Vec::new();
        if let (Some(battery), Some(joint)) = (&self.battery, &self.joint)
            && let Some(gain) = joint.voltage_gain
        {
            let sigma = battery.gain.standard_error.hypot(gain.standard_error);
            if (battery.gain.value - gain.value).abs() > 4.0 * sigma {
                say.push(format!(
                    "k_V is {:.2} from constant commands and {:.2} from lively ones: the battery does not act as \
                     a plain subtraction (see `diagnose`)",
                    battery.gain.value, gain.value
                ));
            }
        }
        if let Some(fit) = &self.pole
            && (fit.gain.value - 1.0).abs() > 0.02
            && fit.gain.distance(1.0) > 4.0
        {
            say.push(format!(
                "the gain from z to the rate is {:.3} in motion: the static curve does not hold there",
                fit.gain.value
            ));
        }
        let rivals = self.pole.as_ref().map(|fit| (&fit.rivals, fit.residual_correlation));
        let rivals = rivals.or(self.joint.as_ref().map(|fit| (&fit.rivals, fit.residual_correlation)));
        if let Some((rivals, correlation)) = rivals {
            for rival in rivals.iter().filter(|rival| rival.needed) {
                say.push(format!(
                    "a first-order lag is not enough: {} of {:.1} ± {:.1} ms lowers the error to {:.2} rad/s; \
                     `diagnose` tells which effect it is, `extend` adds it",
                    rival.effect,
                    1e3 * rival.time.value,
                    1e3 * rival.time.standard_error,
                    rival.residual_rms
                ));
            }
            if correlation > CORRELATED {
                say.push(format!(
                    "the residual is far from noise (lag-one correlation {correlation:.2}): something is missing \
                     in the model; standard errors allow for it, `diagnose` looks for it"
                ));
            }
        }
        if let Some((low, high)) = self.lively_range().filter(|(low, high)| high - low < 0.05) {
            say.push(format!("lively commands span only {low:.3} to {high:.3}: g(u) holds near there only"));
        }
        self.warnings.extend(say);
    }

    fn lively_range(&self) -> Option<(f64, f64)> {
        let ranges: Vec<(f64, f64)> = self.lively.iter().map(|rotor| bounds(&rotor.command)).collect();
        let low = ranges.iter().map(|range| range.0).reduce(f64::min)?;
        Some((low, ranges.iter().map(|range| range.1).fold(low, f64::max)))
    }
}

/// Every log's part of every rotor asked for.
fn rotor_logs(
    logs: &[Dataset],
    settings: &IdentifySettings,
    warnings: &mut Vec<String>,
) -> Result<Vec<RotorLog>, IdentifyError> {
    let mut rotors = Vec::new();
    for log in logs {
        for &rotor in &settings.rotors {
            let found = RotorLog::of(log, rotor, warnings)?;
            // A rotor that stood all the time has nothing to say.
            rotors.extend(found.filter(|rotor| rotor.scored().next().is_some()));
        }
    }
    Ok(rotors)
}
