//! The steps of section III, each as far as the logs reach: what it found, or why it found nothing.

use super::dead_time::{self, Delay, LateFit};
use super::inertia::{self, Body};
use super::joint_fit::{self, JointFit};
use super::lag_order;
use super::pipeline::Work;
use super::pole;
use super::ramp_lag::KnownLag;
use super::regressors::record_of;
use super::result::PoleFit;
use super::significance;
use super::static_curve;
use super::steady_rows;
use super::thrust_curve;
use super::voltage_gain;
use super::{Estimate, IdentifiedActuator};
use crate::log::Dataset;
use crate::model::polynomial;
use crate::screening::excitation::FEWEST_JUMPS;
use crate::screening::rotor_data::{Foretold, RotorLog};

/// Scored samples from which anything may be fitted.
const FEWEST_SAMPLES: usize = 100;

/// Standard deviation of a k_V that is taken from the template, as a share of it.
const ASSUMED: f64 = 0.5;

impl Work<'_> {
    pub(crate) fn battery(&mut self) {
        const STEP: &str = "k_V from constant commands, Eq. (6)";
        if !self.use_battery {
            let why = match (self.settings.battery, self.rotors.is_empty()) {
                (false, _) => {
                    "left out, as asked for: g(u) holds for the charge of these logs, and p takes up how the battery gives \
                     way under load"
                }
                (true, true) => "no rotor that can be identified",
                (true, false) => "no battery voltage to identify it from",
            };
            return self.note(STEP, false, why);
        }
        let (gain, left_out) = voltage_gain::identify(&self.rotors);
        if let Some((gain, why)) =
            gain.as_ref().and_then(|it| Some((it.gain, significance::no_gain(&it.gain)?)))
        {
            self.hardly = Some(gain);
            return self.note(STEP, false, why);
        }
        match &gain {
            Some(gain) => {
                let outcome = format!("{}, {left_out} left out", counted(gain.levels.len(), "level"));
                self.note(STEP, true, outcome);
            }
            None if left_out > 0 => self.note(
                STEP,
                false,
                format!(
                    "{}, but the voltage hardly moved over its noise; hold longer",
                    counted(left_out, "constant level")
                ),
            ),
            None => self.note(STEP, false, "no command was held constant for five seconds after settling"),
        }
        self.battery = gain;
    }

    pub(crate) fn joint(&mut self) {
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
        let mut told = Vec::new();
        let fit = joint_fit::identify(&self.lively, full_voltage, parts, degree, &mut told);
        if let Some(why) = fit.as_ref().and_then(|fit| significance::no_pole(&fit.pole)) {
            return self.note(STEP, false, why);
        }
        if !self.unlike {
            self.findings.append(&mut told);
        }
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
    pub(crate) fn voltage_gain(&self) -> Option<Estimate> {
        let steady = self.battery.as_ref().map(|battery| battery.gain);
        let lively = self.joint.as_ref().and_then(|joint| joint.voltage_gain);
        match (steady, lively) {
            (Some(a), Some(b)) => Some(if a.standard_error <= b.standard_error { a } else { b }),
            (a, b) => a.or(b),
        }
    }

    /// A k_V that is known to be next to nothing, though not how much it is.
    pub(crate) fn no_voltage_gain(&self) -> Option<&Estimate> {
        let template = self.settings.template.actuator.voltage_gain;
        let hardly = self.hardly.as_ref().filter(|_| self.use_battery && self.voltage_gain().is_none());
        hardly.filter(|gain| significance::is_none(gain, template))
    }

    /// What k_V is taken as where no log shows it. Nobody knows by how much a bench differs from its template: half of it
    /// is what the curve's errors allow for. One that is taken as none is off by what shows of it, and by the error of that.
    fn assumed_voltage_gain(&self) -> Estimate {
        if let Some(shown) = self.no_voltage_gain() {
            return Estimate { value: 0.0, standard_error: shown.standard_error.hypot(shown.value) };
        }
        let taken = Estimate { value: self.settings.template.actuator.voltage_gain, standard_error: 0.0 };
        let unknown = Estimate { standard_error: ASSUMED * taken.value.abs(), ..taken };
        if self.use_battery { unknown } else { taken.scaled(0.0) }
    }

    pub(crate) fn static_curve(&mut self) {
        const STEP: &str = "g(u) from ramps, Eq. (9)";
        let gain = self.voltage_gain().unwrap_or_else(|| self.assumed_voltage_gain());
        let Some(rows) = steady_rows::steady_rows(&self.rotors, gain.value, self.full_voltage()) else {
            return self.note(
                STEP,
                false,
                "no slow ramps, and no constant levels that span a range of commands",
            );
        };
        let known = self.joint.as_ref().map(|joint| KnownLag {
            pole: joint.pole,
            delay: joint.delay.as_ref().map_or(0.0, |told| told.delay.value),
        });
        let curve = static_curve::identify(&rows, gain.standard_error, self.settings.degree, known);
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
                    let then = if check.lag_fitted {
                        "; g(u) was fitted beside that lag, slower ramps have less of it"
                    } else {
                        "; slow them down"
                    };
                    self.findings.push(format!("{sentence}{then}").into());
                }
                self.note(STEP, true, outcome);
            }
            None => {
                self.note(STEP, false, "the levels of the command do not determine a curve of that degree")
            }
        }
        self.static_curve = curve;
    }

    pub(crate) fn pole(&mut self) {
        const STEP: &str = "p from z by output error, section III.B";
        if self.static_curve.is_none() || self.lively.is_empty() {
            let why = match (self.joint.is_some(), self.lively.is_empty()) {
                (true, _) => "taken from the fit of all at once",
                (false, true) => "no lively commands",
                (false, false) => "no g(u) to make z of",
            };
            return self.note(STEP, false, why);
        }
        let actuator = self.actuator();
        let steady =
            |u: f64, drop: f64| u * polynomial(&actuator.coefficients, u) - actuator.voltage_gain * drop;
        // The voltage moves as the rotor does, which is known by now.
        let pole = self.joint.as_ref().map(|joint| joint.pole.value);
        let moves = |rotor: &RotorLog| RotorLog {
            foretold: pole.map(|pole| Foretold { pole, noise: 0.0 }),
            ..rotor.clone()
        };
        let lively: Vec<RotorLog> = self.lively.iter().map(moves).collect();
        let record = |rotors: &[RotorLog], delay: f64| {
            record_of(rotors, actuator.full_voltage, delay, |u, drop| [steady(u, drop), 1.0])
        };
        let Some(fit) = pole::fit(&record(&lively, 0.0)) else {
            return self.note(STEP, false, "the commands do not move z enough");
        };
        let found = Estimate { value: fit.pole, standard_error: fit.pole_error() };
        if let Some(why) = significance::no_pole(&found) {
            return self.note(STEP, false, why);
        }
        let rivals = lag_order::both(&fit, &lively, record);
        let interval = self.lively.first().map_or(0.0, |rotor| rotor.interval);
        let late = self
            .settings
            .delay
            .then(|| dead_time::identify(&fit, &rivals, interval, |delay| record(&lively, delay)));
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

    pub(crate) fn thrust(&mut self) {
        const STEP: &str = "thrust curve and its tangent, Eq. (13)";
        let hover = self.settings.template.actuator.hover_rate;
        self.thrust = thrust_curve::identify(&self.rotors, hover, &mut self.findings);
        match &self.thrust {
            Some(thrust) => self.note(STEP, true, format!("{} samples", thrust.samples)),
            None => self.note(STEP, false, "no thrust in the logs; the template's curve is kept"),
        }
    }

    pub(crate) fn body(&mut self, logs: &[Dataset], actuator: &IdentifiedActuator) {
        const STEP: &str = "J from an attitude log, Eq. (1)";
        let arm = self.settings.template.body.arm;
        let mut fits: Vec<Body> = Vec::new();
        let mut in_vain = Vec::new();
        for log in logs {
            let mut told = Vec::new();
            match inertia::identify(log, actuator, arm, &mut told) {
                Some(fit) => {
                    fits.push(fit);
                    self.findings.append(&mut told);
                }
                None => in_vain.append(&mut told),
            }
        }
        self.bodies = (fits.iter().map(|fit| fit.source.clone()).collect(), in_vain.clone());
        // A log made for the rotors need not move the body where another one does.
        if fits.is_empty() {
            self.findings.append(&mut in_vain);
        }
        // The log that says most decides; the others are in agreement or are warned of.
        let best =
            fits.iter().min_by(|a, b| a.inertia.standard_error.total_cmp(&b.inertia.standard_error)).cloned();
        if let Some(best) = &best {
            for other in &fits {
                let sigma = other.inertia.standard_error.hypot(best.inertia.standard_error);
                if (other.inertia.value - best.inertia.value).abs() > 4.0 * sigma {
                    self.findings.push(format!(
                        "{} says J = {:.5} kg m², {} says {:.5}: not the same bench, or something is missing in the \
                         body's model",
                        best.source, best.inertia.value, other.source, other.inertia.value
                    ).into());
                }
            }
        }
        if let Some(why) = best.as_ref().and_then(significance::no_inertia) {
            return self.note(STEP, false, why);
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

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
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
