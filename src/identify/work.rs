//! What is known so far of a bench, step by step.

use super::command_response::CommandResponses;
use super::dead_time::Delay;
use super::inertia::IdentifiedBody;
use super::inputs;
use super::joint_fit::JointFit;
use super::possible_gain;
use super::result::{IdentifySettings, PipelineStep, PoleFit};
use super::significance;
use super::single_rotor_fit::is_excited;
use super::static_curve::StaticCurve;
use super::supply_gain::SupplyGain;
use super::thrust_curve::ThrustCurve;
use super::voltage_gain::BatteryGain;
use super::{Estimate, IdentifiedActuator};
use crate::screening::checks::command_follows_rate::COMMAND_FOLLOWS_RATE;
use crate::screening::excitation::FEWEST_JUMPS;
use crate::screening::quantized_voltage;
use crate::screening::rotor_data::RotorLog;
use crate::screening::{Finding, ScreenedLog};
use crate::threads::spread_out;

/// What is known so far.
pub(crate) struct Work<'a> {
    pub settings: &'a IdentifySettings,
    pub rotors: Vec<RotorLog>,
    pub excited: Vec<RotorLog>,
    pub use_battery: bool,
    pub parts: Vec<PipelineStep>,
    pub findings: Vec<Finding>,
    pub battery: Option<BatteryGain>,
    pub joint: Option<JointFit>,
    pub static_curve: Option<StaticCurve>,
    pub pole: Option<PoleFit>,
    pub thrust: Option<ThrustCurve>,
    pub body: Option<IdentifiedBody>,
    /// k_V between logs of several supplies.
    pub supplies: Option<SupplyGain>,
    /// A k_V that hardly shows in constant commands.
    pub insignificant_gain: Option<Estimate>,
    /// [rad/(s V)] a k_V of constant commands that no motor has, and the most that this one could have.
    pub impossible_gain: Option<(f64, f64)>,
    /// Whether rotors were found to differ, or to lead their commands: what a fit leaves over then has that reason.
    pub mismatch: bool,
    /// Logs in which the body was seen.
    pub body_logs: Vec<String>,
    /// What kept it from being seen in others.
    pub no_body: Vec<Finding>,
}

/// Logs of a step or two each, as a lab makes them, that show together what none shows alone.
fn excited_together<'a>(rotors: impl Iterator<Item = &'a RotorLog>) -> Vec<RotorLog> {
    let stepped: Vec<&RotorLog> = rotors.filter(|rotor| !rotor.jumps().is_empty()).collect();
    let jumps: usize = stepped.iter().map(|rotor| rotor.jumps().len()).sum();
    if jumps < FEWEST_JUMPS { Vec::new() } else { stepped.into_iter().cloned().collect() }
}

impl<'a> Work<'a> {
    pub fn new(logs: &[ScreenedLog], settings: &'a IdentifySettings, mut warnings: Vec<Finding>) -> Self {
        let mut rotors = inputs::rotor_logs(logs, settings, &mut warnings);
        let use_battery = inputs::uses_battery(&rotors, settings, &mut warnings);
        if use_battery {
            let mended = spread_out(rotors.iter_mut().collect(), quantized_voltage::mend);
            warnings.extend(mended.into_iter().flatten());
        } else {
            rotors.iter_mut().for_each(|rotor| rotor.voltage = None);
        }
        let template = &settings.template.actuator;
        let follows =
            |rotor: &&RotorLog| !rotor.rows_are_levels() && rotor.too_seldom(template.pole).is_none();
        // What a controller makes of the rate itself is an answer, and no experiment, but for its jumps.
        let may_move = |rotor: &RotorLog| !is_governed(&warnings, rotor);
        let is_excited = |rotor: &&RotorLog| {
            rotor.jumps().len() >= FEWEST_JUMPS
                || (may_move(rotor) && is_excited(rotor, template.full_voltage))
        };
        let mut excited: Vec<RotorLog> = rotors.iter().filter(follows).filter(is_excited).cloned().collect();
        if excited.is_empty() {
            excited = excited_together(rotors.iter().filter(follows));
        }
        Self {
            settings,
            rotors,
            excited,
            use_battery,
            parts: Vec::new(),
            findings: warnings,
            battery: None,
            joint: None,
            static_curve: None,
            pole: None,
            thrust: None,
            body: None,
            supplies: None,
            insignificant_gain: None,
            impossible_gain: None,
            mismatch: false,
            body_logs: Vec::new(),
            no_body: Vec::new(),
        }
    }

    /// Whether rotors differ. Rates that lead their commands, `leads`, are reason enough for what a fit leaves over.
    pub fn compare_rotors(&mut self, leads: bool) {
        // Rows that are levels each hold no response.
        let responding = self.rotors.iter().filter(|rotor| !rotor.rows_are_levels());
        let responding: Vec<RotorLog> = responding.cloned().collect();
        let responses = CommandResponses::fit(&responding, self.full_voltage());
        let found = if leads { None } else { responses.mismatch() };
        self.mismatch = leads || found.is_some();
        let found = if self.mismatch { found } else { responses.mismatch_between_logs() };
        self.findings.extend(found);
    }

    /// What a step came to.
    pub fn note(&mut self, step: &'static str, done: bool, finding: Finding) {
        self.parts.push(PipelineStep { step, done, finding });
    }

    /// Why a step found nothing.
    pub fn lacks(&mut self, step: &'static str, code: &'static str) {
        self.note(step, false, Finding::new(code, ""));
    }

    pub fn full_voltage(&self) -> f64 {
        self.settings.template.actuator.full_voltage
    }

    /// Whether a controller makes this rotor's command from its rate: its ramps and levels are no experiment.
    pub(crate) fn is_governed(&self, rotor: &RotorLog) -> bool {
        is_governed(&self.findings, rotor)
    }

    /// The best of all estimates of k_V.
    pub(crate) fn voltage_gain(&self) -> Option<Estimate> {
        let steady = self.battery.as_ref().map(|battery| battery.gain);
        let between = self.supplies.as_ref().map(|supplies| supplies.gain);
        let excited = self.joint.as_ref().and_then(|joint| joint.voltage_gain);
        let all = [steady, between, excited].into_iter().flatten();
        all.min_by(|a, b| a.standard_error.total_cmp(&b.standard_error))
    }

    /// [rad/(s V)] the template's k_V; where no motor of this bench has so much, all of its rate over all of its volts, which one without
    /// drag has.
    pub(crate) fn template_voltage_gain(&self) -> f64 {
        let template = self.settings.template.actuator.voltage_gain;
        let at_full = possible_gain::at_full_command(&self.rotors, |_, _| 1.0);
        match at_full.map(|rate| rate / self.full_voltage()) {
            Some(most) if most > 0.0 && possible_gain::is_too_great(template, most) => most,
            _ => template,
        }
    }

    /// A k_V that is known to be next to nothing, though not how much it is.
    pub(crate) fn no_voltage_gain(&self) -> Option<&Estimate> {
        let template = self.template_voltage_gain();
        let shown =
            self.insignificant_gain.as_ref().filter(|_| self.use_battery && self.voltage_gain().is_none());
        shown.filter(|gain| significance::is_none(gain, template))
    }

    /// The rotor as known so far.
    pub(crate) fn actuator(&self) -> IdentifiedActuator {
        let template = &self.settings.template.actuator;
        let values = |estimates: &[Estimate]| estimates.iter().map(|estimate| estimate.value).collect();
        let coefficients = match (&self.static_curve, &self.joint) {
            (Some(curve), _) => values(&curve.coefficients),
            (None, Some(joint)) => values(&joint.coefficients),
            (None, None) => template.steady_rate.get(1..).unwrap_or_default().to_vec(),
        };
        // Curve and gain belong together: what a curve was fitted without, it goes without.
        let gain = match (&self.static_curve, &self.joint) {
            (None, Some(joint)) => joint.voltage_gain.map_or(0.0, |gain| gain.value),
            (Some(_), _) if !self.use_battery => 0.0,
            (None, None) if !self.settings.battery => 0.0,
            _ if self.no_voltage_gain().is_some() => 0.0,
            _ => self.voltage_gain().map_or_else(|| self.template_voltage_gain(), |gain| gain.value),
        };
        IdentifiedActuator {
            coefficients,
            voltage_gain: gain,
            full_voltage: template.full_voltage,
            pole: self.pole_estimate().map_or(template.pole, |pole| pole.value),
            delay: self.delay().map_or(0.0, |it| it.delay.value),
            thrust_coefficient: self
                .thrust
                .as_ref()
                .map_or(template.thrust_coefficient, |thrust| thrust.coefficient.value),
        }
    }

    /// Pole and delay of the joint estimation, where that has a battery: those from z hold k_V and the curve for exact,
    /// and their errors know nothing of theirs.
    fn is_joint_pole(&self) -> bool {
        self.joint.as_ref().is_some_and(|joint| self.pole.is_none() || joint.voltage_gain.is_some())
    }

    pub(crate) fn pole_estimate(&self) -> Option<Estimate> {
        let joint = self.joint.as_ref().filter(|_| self.is_joint_pole()).map(|joint| joint.pole);
        joint.or(self.pole.as_ref().map(|fit| fit.pole))
    }

    /// The delay that goes with the pole.
    pub(crate) fn delay(&self) -> Option<&Delay> {
        let joint = self.joint.as_ref().filter(|_| self.is_joint_pole());
        joint.map_or_else(|| self.pole.as_ref()?.delay.as_ref(), |joint| joint.delay.as_ref())
    }
}

fn is_governed(findings: &[Finding], rotor: &RotorLog) -> bool {
    let own = rotor.finding(COMMAND_FOLLOWS_RATE);
    findings.iter().any(|it| it.code == own.code && it.place() == own.place())
}
