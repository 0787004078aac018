//! From the steps of section III to one answer: the rotor, and the model file.

use super::consistency::unexplained;
use super::inputs::rotor_logs;
use super::lag_order::dead_time_effect;
use super::missed_level::missed_level;
use super::result::Identification;
use super::rotor_error::rotor_error;
use super::steady_rows::HIGHEST_DEGREE;
use super::validate::{self, Validation};
use super::work::Work;
use super::{IdentifiedActuator, IdentifyError};
use crate::estimation::frequency_response::{self, InputOutput};
use crate::estimation::moments::pooled_rms;
use crate::model::{AddedEffect, ErrorFall, LogReference, Measure, Model, ModelStep, SeenRows};
use crate::screening::duplicate_logs;
use crate::screening::excitation::FEWEST_JUMPS;
use crate::screening::rotor_data::RotorLog;
use crate::screening::{Finding, ScreenedLog};
use crate::signal::Sensor;

impl Work<'_> {
    /// The rotor as a first-order lag alone would have it, where a delay was taken in.
    fn without_delay(&self, actuator: &IdentifiedActuator) -> Option<IdentifiedActuator> {
        let taken = self.delay()?;
        let mut alone = IdentifiedActuator { pole: taken.pole_without.value, delay: 0.0, ..actuator.clone() };
        let joint = self.joint.as_ref().and_then(|joint| joint.without_delay.as_ref());
        if let Some((coefficients, gain)) = joint.filter(|_| self.static_curve.is_none()) {
            alone.coefficients.clone_from(coefficients);
            alone.voltage_gain = gain.unwrap_or(alone.voltage_gain);
        }
        Some(alone)
    }

    /// The model with a transport delay as its first step up.
    fn with_delay(
        &self,
        mut model: Model,
        actuator: &IdentifiedActuator,
        logs: [&[ScreenedLog]; 2],
        errors: [[f64; 2]; 2],
    ) -> Model {
        let Some((taken, alone)) = self.delay().zip(self.without_delay(actuator)) else { return model };
        let Some((card, [delay])) = dead_time_effect().map(|card| (card, card.parameters)) else {
            return model;
        };
        let reference = |log: &ScreenedLog| LogReference {
            file: log.source_name().to_owned(),
            sha256: log.raw().sha256().to_owned(),
        };
        let mut before = model.clone();
        before.actuator.steady_rate = powers(&alone.coefficients);
        before.actuator.voltage_gain = alone.voltage_gain;
        before.actuator.pole = alone.pole;
        let [[train_before, train_after], [validate_before, validate_after]] = errors;
        model.ladder.push(ModelStep {
            added: vec![card.id.to_owned()],
            logs: logs[0].iter().map(reference).collect(),
            validation: logs[1].iter().map(reference).collect(),
            error: ErrorFall {
                measure: Measure::of_fit(Sensor::PropellerRate.name_with_unit(), "rad/s"),
                // With the delay what is left is noise: that is why it was taken in.
                noise_floor: taken.residual_with,
                train_before,
                train_after,
                validate_before,
                validate_after,
            },
            before: before.parameters(),
            // Of the joint estimation with the delay: without it nobody has asked.
            standard_errors_before: std::collections::BTreeMap::new(),
        });
        model.effects.push(AddedEffect {
            id: card.id.to_owned(),
            parameters: [(delay.name.to_owned(), taken.delay.value)].into(),
        });
        model.standard_errors.insert(format!("{}.{}", card.id, delay.name), taken.delay.standard_error);
        model
    }

    fn model(&self, actuator: &IdentifiedActuator) -> Model {
        let mut model = self.settings.template.clone();
        model.name = "identified".to_owned();
        model.ladder.clear();
        model.standard_errors.clear();
        model.rotor_error = None;
        // What was identified now stands in for what the template knew of it.
        if let Some(card) = dead_time_effect().filter(|_| self.pole_estimate().is_some()) {
            model.effects.retain(|added| added.id != card.id);
        }
        model.actuator.steady_rate = powers(&actuator.coefficients);
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

    /// The model, what it was identified from, and a delay that was taken in as its first step up; `other` are the rotors of the
    /// validation logs, and `validated` their runs.
    fn model_of(
        &self,
        actuator: &IdentifiedActuator,
        logs: [&[ScreenedLog]; 2],
        (other, validated): (&[RotorLog], &[Validation]),
    ) -> Model {
        let mut model = self.model(actuator);
        // A template that no log has changed has seen none.
        if model.parameters() != self.settings.template.parameters() {
            model.identified_from = logs[0].iter().map(seen_rows).collect();
        }
        let Some((taken, alone)) = self.delay().zip(self.without_delay(actuator)) else { return model };
        let held_out = if validated.is_empty() {
            taken.held_out
        } else {
            [&runs(other, &alone)[..], validated]
                .map(|runs| pooled_rms(runs.iter().map(|run| (run.rms, run.samples))))
        };
        let errors = [[taken.residual_without, taken.residual_with], held_out];
        self.with_delay(model, actuator, logs, errors)
    }

    pub(crate) fn finish(
        mut self,
        logs: &[ScreenedLog],
        validation: &[ScreenedLog],
        actuator: IdentifiedActuator,
    ) -> Result<Identification, IdentifyError> {
        let idle = duplicate_logs::idle(logs, &self.rotors, &self.body_logs, &self.no_body);
        if self.parts.iter().all(|part| !part.done) {
            return Err(self.nothing(idle));
        }
        self.findings.extend(idle);
        self.check_results();
        let signals = self.excited.iter().map(|rotor| signals(rotor, &actuator));
        let response = frequency_response::response(&signals.collect::<Vec<InputOutput<'_>>>());
        self.findings.extend(validation.iter().flat_map(ScreenedLog::channel_findings).cloned());
        let mut other = rotor_logs(validation, self.settings, &mut self.findings);
        if !self.use_battery {
            other.iter_mut().for_each(|rotor| rotor.voltage = None);
        }
        let (training, validated) = (runs(&self.rotors, &actuator), runs(&other, &actuator));
        if !self.mismatch {
            let runs = training.iter().chain(&validated);
            let found = not_explained(self.rotors.iter().chain(&other), &runs.collect::<Vec<_>>());
            self.findings.extend(found);
        }
        let mut model = self.model_of(&actuator, [logs, validation], (&other, &validated));
        // A template that no log has changed is of another bench.
        model.rotor_error =
            (!model.identified_from.is_empty()).then(|| rotor_error(&model, &[logs, validation])).flatten();
        Ok(Identification {
            model,
            frequency_response: response,
            interval: self.excited.first().map_or(0.0, |rotor| rotor.interval),
            training,
            validation: validated,
            parts: self.parts,
            battery: self.battery,
            supplies: self.supplies,
            static_curve: self.static_curve,
            pole: self.pole,
            joint: self.joint,
            actuator,
            thrust: self.thrust,
            body: self.body,
            findings: self.findings,
            rotors: Vec::new(),
        })
    }

    /// Why nothing can be identified: what each log lacks, and where there are rotors, what each step lacks.
    fn nothing(self, mut reasons: Vec<Finding>) -> IdentifyError {
        // The body's reasons are those of the logs.
        let is_no_reason =
            |finding: &&Finding| !reasons.iter().any(|reason| reason.cause() == Some(*finding));
        let others: Vec<Finding> = self.findings.iter().filter(is_no_reason).cloned().collect();
        reasons.extend(others);
        let steps = if self.rotors.is_empty() { Vec::new() } else { self.parts };
        IdentifyError::Nothing { reasons, steps }
    }
}

/// The rows that a model's own numbers have seen.
fn seen_rows(log: &ScreenedLog) -> SeenRows {
    let time = log.raw().time();
    SeenRows {
        file: log.source_name().to_owned(),
        sha256: log.raw().sha256().to_owned(),
        from_s: time.first().copied().unwrap_or(0.0),
        to_s: time.last().copied().unwrap_or(0.0),
    }
}

/// The rotors whose commands step, or that are far off, that their runs under the model do not follow; of the others the levels that they
/// miss.
fn not_explained<'a>(rotors: impl Iterator<Item = &'a RotorLog>, runs: &[&Validation]) -> Vec<Finding> {
    let of = |rotor: &RotorLog| runs.iter().find(|run| run.source == rotor.source()).copied();
    let is_excited =
        |rotor: &RotorLog, run: &Validation| rotor.jumps().len() >= FEWEST_JUMPS || run.is_far_off();
    let asked = rotors.filter_map(|rotor| Some((rotor, of(rotor).filter(|run| is_excited(rotor, run))?)));
    asked.filter_map(|(rotor, run)| unexplained(rotor, run).or_else(|| missed_level(rotor, run))).collect()
}

/// From z to the measured rate, [rad/s] both.
fn signals<'a>(rotor: &'a RotorLog, actuator: &IdentifiedActuator) -> InputOutput<'a> {
    let voltage = |row: usize| rotor.voltage.as_ref().map(|voltage| voltage[row]);
    let z = |(row, command): (usize, &f64)| actuator.steady_rate(*command, voltage(row));
    InputOutput {
        time: &rotor.time,
        input: rotor.command.iter().enumerate().map(z).collect(),
        output: &rotor.rate,
        segments: &rotor.stretches,
        interval: rotor.interval,
    }
}

/// [rad/s] coefficients by ascending power, from u^0.
fn powers(coefficients: &[f64]) -> Vec<f64> {
    std::iter::once(0.0).chain(coefficients.iter().copied()).collect()
}

/// A free run of each rotor.
fn runs(rotors: &[RotorLog], actuator: &IdentifiedActuator) -> Vec<Validation> {
    rotors.iter().filter_map(|rotor| validate::validate(rotor, actuator)).collect()
}
