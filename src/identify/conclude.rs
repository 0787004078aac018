//! From the steps of section III to one answer: the rotor, the model file, and what contradicts itself.

use super::frequency;
use super::outcome::Identification;
use super::procedure::{Work, rotor_logs};
use super::rotor_log::{RotorLog, bounds};
use super::static_curve::HIGHEST_DEGREE;
use super::validate::{self, Validation};
use super::{Estimate, IdentifiedActuator, IdentifyError};
use crate::model::Model;
use crate::record::Dataset;

/// Residual correlation above which the first-order lag leaves something unexplained.
const CORRELATED: f64 = 0.5;
/// Share of the body's motion from which a correlated rest counts. Below it the noise of the measured rotor rates,
/// summed up over a window, looks the same.
const UNEXPLAINED: f64 = 0.2;

impl Work<'_> {
    /// The rotor as known so far.
    pub(super) fn actuator(&self) -> IdentifiedActuator {
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
        if let Some(thrust) = &self.thrust {
            error("thrust_coefficient", thrust.coefficient.standard_error);
        }
        if let Some(body) = &self.body {
            error("inertia", body.inertia.standard_error);
            model.body.inertia = body.inertia.value;
        }
        model
    }

    pub(super) fn finish(
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
            let needed: Vec<String> = rivals
                .iter()
                .filter(|rival| rival.needed)
                .map(|rival| {
                    let (time, error) = (1e3 * rival.time.value, 1e3 * rival.time.standard_error);
                    let left = rival.residual_rms;
                    format!(
                        "`{}` of {time:.1} ± {error:.1} ms lowers the error to {left:.2} rad/s",
                        rival.effect
                    )
                })
                .collect();
            if !needed.is_empty() {
                say.push(format!(
                    "a first-order lag is not enough: {}; `diagnose` tells which effect it is, `extend` adds it",
                    needed.join(", ")
                ));
            }
            if correlation > CORRELATED {
                say.push(format!(
                    "the residual is far from noise (lag-one correlation {correlation:.2}): something is missing \
                     in the model; standard errors allow for it, `diagnose` looks for it"
                ));
            }
        }
        if let Some(body) = self.body.as_ref().filter(|body| {
            body.residual_correlation > CORRELATED && body.residual_rms > UNEXPLAINED * body.motion_rms
        }) {
            say.push(format!(
                "{}: J alone leaves {:.3} rad/s of the body rate's {:.3} unexplained over windows of half a second, \
                 and that is far from noise (lag-one correlation {:.2}): something is missing in the body's model, \
                 and J carries part of it; `diagnose` looks for it",
                body.source, body.residual_rms, body.motion_rms, body.residual_correlation
            ));
        }
        self.check_template(&mut say);
        if let Some((low, high)) = self.lively_range().filter(|(low, high)| high - low < 0.05) {
            say.push(format!("lively commands span only {low:.3} to {high:.3}: g(u) holds near there only"));
        }
        self.warnings.extend(say);
    }

    /// Says where the template's numbers are not those of this bench.
    fn check_template(&self, say: &mut Vec<String>) {
        let template = &self.settings.template.actuator;
        let over = |pick: &dyn Fn(&RotorLog) -> Option<(f64, f64)>| {
            let all: Vec<(f64, f64)> = self.rotors.iter().filter_map(pick).collect();
            let low = all.iter().map(|range| range.0).reduce(f64::min)?;
            Some((low, all.iter().map(|range| range.1).fold(low, f64::max)))
        };
        let rates = over(&|rotor| rotor.thrust.as_ref().map(|_| bounds(&rotor.rate)));
        if let Some((low, high)) = rates.filter(|_| self.thrust.is_some())
            && !(low..=high).contains(&template.hover_rate)
        {
            say.push(format!(
                "the tangent of the thrust curve is taken at {:.0} rad/s, where the template hovers, but the rates with \
                 a measured thrust reach from {low:.0} to {high:.0}; say where this bench hovers with --hover-rate",
                template.hover_rate
            ));
        }
        let volts = over(&|rotor| rotor.voltage.as_deref().map(bounds));
        if let Some((low, high)) = volts
            && !(0.7 * template.full_voltage..1.05 * template.full_voltage).contains(&high)
        {
            say.push(format!(
                "the battery had {low:.1} to {high:.1} V, but the template's is full at {:.1} V: g(u) and k_V are \
                 drawn out to a battery that this bench does not have; give its full voltage with --full-voltage-v",
                template.full_voltage
            ));
        }
    }

    fn lively_range(&self) -> Option<(f64, f64)> {
        let ranges: Vec<(f64, f64)> = self.lively.iter().map(|rotor| bounds(&rotor.command)).collect();
        let low = ranges.iter().map(|range| range.0).reduce(f64::min)?;
        Some((low, ranges.iter().map(|range| range.1).fold(low, f64::max)))
    }
}
