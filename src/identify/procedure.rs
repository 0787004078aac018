//! The whole of section III, as far as the logs reach.

use super::battery::{self, BatteryGain};
use super::body::{self, Body};
use super::joint::{self, JointFit};
use super::late::{self, Delay, LateFit};
use super::outcome::{Identification, IdentifySettings, Part, PoleFit};
use super::pole;
use super::record_of::record_of;
use super::rivals;
use super::rotor_log::{LEAST_COMMAND, RotorLog, bounds};
use super::static_curve::{self, HIGHEST_DEGREE, StaticCurve};
use super::thrust::{self, ThrustCurve};
use super::used;
use super::{Estimate, IdentifiedActuator, IdentifyError};
use crate::record::Dataset;

/// Jumps of the command from which a pole may be fitted.
pub(super) const FEWEST_JUMPS: usize = 8;
/// Scored samples from which anything may be fitted.
const FEWEST_SAMPLES: usize = 100;

/// Steps that [`identify_telling`] tells of.
pub const STEPS: usize = 7;

/// Identifies what the logs permit; `validation` logs are only compared.
///
/// # Errors
/// [`IdentifyError`] when the logs permit nothing at all, with what each step lacks.
pub fn identify(
    logs: &[Dataset],
    validation: &[Dataset],
    settings: &IdentifySettings,
) -> Result<Identification, IdentifyError> {
    identify_telling(logs, validation, settings, &mut |_| ())
}

/// The same; `tell` hears the name of each of the [`STEPS`] as it begins.
///
/// # Errors
/// As [`identify`].
pub fn identify_telling(
    logs: &[Dataset],
    validation: &[Dataset],
    settings: &IdentifySettings,
    tell: &mut dyn FnMut(&'static str),
) -> Result<Identification, IdentifyError> {
    if let Some(degree) = settings.degree.filter(|degree| !(1..=HIGHEST_DEGREE).contains(degree)) {
        return Err(IdentifyError::Degree(degree));
    }
    if logs.is_empty() {
        return Err(IdentifyError::NoLog);
    }
    let mut copies = Vec::new();
    let distinct = used::without_copies(logs, &mut copies);
    let logs = distinct.as_ref();
    let fuller = fuller_battery(logs, settings);
    let mut own = settings.clone();
    own.template.actuator.full_voltage = fuller.unwrap_or(settings.template.actuator.full_voltage);
    let mut work = Work::new(logs, &own)?;
    work.warnings.append(&mut copies);
    used::tell_of_seen(logs, validation, &mut work.warnings);
    if let Some(volts) = fuller {
        work.warnings.push(format!(
            "the battery had {volts:.1} V, more than the template's full {:.1} V: {volts:.1} V is taken as full, so that \
             no command counts as more than all; say what this bench's battery has with --full-voltage-v",
            settings.template.actuator.full_voltage
        ));
    }
    tell("k_V from constant commands");
    work.battery();
    tell("g(u), k_V and p at once");
    work.joint();
    tell("g(u) from ramps");
    work.static_curve();
    tell("p from lively commands");
    work.pole();
    tell("thrust curve");
    work.thrust();
    tell("body");
    let actuator = work.actuator();
    work.body(logs, &actuator);
    tell("validation");
    work.finish(logs, validation, actuator)
}

/// A battery above its full voltage by this share is another battery.
const FULLER: f64 = 1.05;

/// [V] what the battery had at its best, where that is more than the template's has when full.
fn fuller_battery(logs: &[Dataset], settings: &IdentifySettings) -> Option<f64> {
    let columns = logs.iter().filter_map(|log| log.column("battery_voltage_v"));
    let mut volts: Vec<f64> = columns.flatten().copied().filter(|volts| volts.is_finite()).collect();
    volts.sort_by(f64::total_cmp);
    // A glitch of the reading is not the battery.
    let best = *volts.get(volts.len().checked_sub(1)? * 99 / 100)?;
    (best > FULLER * settings.template.actuator.full_voltage).then_some((10.0 * best).round() / 10.0)
}

/// What is known so far.
pub(super) struct Work<'a> {
    pub settings: &'a IdentifySettings,
    pub rotors: Vec<RotorLog>,
    pub lively: Vec<RotorLog>,
    pub use_battery: bool,
    pub parts: Vec<Part>,
    pub warnings: Vec<String>,
    pub battery: Option<BatteryGain>,
    pub joint: Option<JointFit>,
    pub static_curve: Option<StaticCurve>,
    pub pole: Option<PoleFit>,
    pub thrust: Option<ThrustCurve>,
    pub body: Option<Body>,
    /// Logs in which the body was seen, and what kept it from being seen in others.
    pub bodies: [Vec<String>; 2],
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
                "no column `battery_voltage_v` with a battery's voltage in {}: k_V cannot be identified, and g(u) and p are fitted without \
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
            bodies: [Vec::new(), Vec::new()],
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
            let why = if self.settings.battery {
                "no battery voltage in the logs"
            } else {
                "left out, as asked for"
            };
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
        let parts = (self.use_battery, self.settings.delay);
        let fit = joint::identify(&self.lively, full_voltage, parts, degree, &mut self.warnings);
        match &fit {
            Some(fit) => self.note(STEP, true, outcome(fit.samples, fit.delay.as_ref())),
            None => self.note(
                STEP,
                false,
                "the commands do not determine a curve of that degree: use more than two command levels, or ramps",
            ),
        }
        self.joint = fit;
    }

    /// The better of both estimates of k_V.
    pub fn voltage_gain(&self) -> Option<Estimate> {
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
                    let sentence = format!(
                        "the ramps are too fast for Eq. (4): at {:.3} 1/s the rate lags {:.0} ms, an error of {:.1} rad/s",
                        check.fastest_slope,
                        1e3 * check.lag.value,
                        check.error
                    );
                    // Nothing of that kind is in the fit of all at once.
                    let first =
                        |curve: &[Estimate]| curve.first().map_or(f64::INFINITY, |it| it.standard_error);
                    let better = |joint: &JointFit| first(&joint.coefficients) < first(&curve.coefficients);
                    if self.joint.as_ref().is_some_and(better) {
                        return self.note(
                            STEP,
                            false,
                            format!("{sentence}; taken from the fit of all at once"),
                        );
                    }
                    self.warnings.push(format!("{sentence}; slow them down"));
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
        let interval = self.lively.first().map_or(0.0, |rotor| rotor.interval);
        let late = self
            .settings
            .delay
            .then(|| late::identify(&fit, &rivals, interval, |delay| record(&self.lively, delay)));
        let (fit, delay) = match late.flatten() {
            Some(LateFit { fit, told }) => (fit, Some(told)),
            None => (fit, None),
        };
        self.note(STEP, true, outcome(fit.samples, delay.as_ref()));
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
            delay,
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
        let mut fits: Vec<Body> = Vec::new();
        let mut in_vain = Vec::new();
        for log in logs {
            let mut told = Vec::new();
            match body::identify(log, actuator, arm, &mut told) {
                Some(fit) => {
                    fits.push(fit);
                    self.warnings.append(&mut told);
                }
                None => in_vain.append(&mut told),
            }
        }
        self.bodies = [fits.iter().map(|fit| fit.source.clone()).collect(), in_vain.clone()];
        // A log made for the rotors need not move the body where another one does.
        if fits.is_empty() {
            self.warnings.append(&mut in_vain);
        }
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
}

/// What a fit of the pole came to, in words.
fn outcome(samples: usize, delay: Option<&Delay>) -> String {
    match delay {
        Some(told) => {
            let (delay, error) = (1e3 * told.delay.value, 1e3 * told.delay.standard_error);
            format!("{samples} samples, beside a delay of {delay:.2} ± {error:.2} ms")
        }
        None => format!("{samples} samples"),
    }
}

/// Every log's part of every rotor asked for.
pub(super) fn rotor_logs(
    logs: &[Dataset],
    settings: &IdentifySettings,
    warnings: &mut Vec<String>,
) -> Result<Vec<RotorLog>, IdentifyError> {
    let mut rotors = Vec::new();
    let mut of_standing = Vec::new();
    for log in logs {
        used::tell_of_units(log, warnings);
        for &rotor in &settings.rotors {
            let mut told = Vec::new();
            let found = RotorLog::of(log, rotor, &mut told)?;
            // A rotor that stood all the time has nothing to say, and nothing is to be said of it beside others.
            let stood = found.as_ref().is_some_and(|found| bounds(&found.command).1 < LEAST_COMMAND);
            if let Some(found) = found.as_ref().filter(|_| !stood) {
                found.hold_against(&settings.template, &mut told);
            }
            if stood {
                of_standing.append(&mut told)
            } else {
                warnings.append(&mut told)
            }
            rotors.extend(found.filter(|rotor| rotor.scored().next().is_some()));
        }
    }
    if rotors.is_empty() {
        warnings.append(&mut of_standing);
    }
    Ok(rotors)
}
