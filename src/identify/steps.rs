//! The steps of section III, each as far as the logs reach: what it found, or why it found nothing.

use super::dead_time::{self, Delay};
use super::inertia::{self, IdentifiedBody};
use super::joint_fit::{self, JointFit};
use super::lag_order;
use super::possible_gain;
use super::ramp_lag::KnownLag;
use super::regressors::{NO_DELAY, record_of};
use super::result::PoleFit;
use super::significance;
use super::static_curve::{self, StaticCurve};
use super::steady_rows;
use super::step_times;
use super::supply_gain::{self, SupplyGain};
use super::thresholds::THRESHOLDS;
use super::thrust_curve;
use super::voltage_gain;
use super::work::Work;
use super::{Estimate, IdentifiedActuator};
use crate::estimation::{unknown_instants, variable_projection};
use crate::model::polynomial;
use crate::screening::attitude::Mistaken;
use crate::screening::excitation::FEWEST_JUMPS;
use crate::screening::rotor_data::{RotorLog, VoltageInstrument};
use crate::screening::{Finding, ScreenedLog};
use crate::signal::{Sensor, columns};

impl Work<'_> {
    pub(crate) fn battery(&mut self) {
        const STEP: &str = "voltage_gain";
        if !self.use_battery {
            let why = match (self.settings.battery, self.rotors.is_empty()) {
                (false, _) => "battery_excluded",
                (true, true) => "no_rotor",
                (true, false) => "no_battery_voltage",
            };
            return self.lacks(STEP, why);
        }
        let (gain, left_out) = voltage_gain::identify(&self.rotors);
        let supplies = supply_gain::identify(&self.rotors, self.full_voltage());
        let most = possible_gain::most(&self.rotors).unwrap_or(f64::INFINITY);
        let is_shown = |gain: &Estimate| significance::no_gain(gain).is_none();
        let is_impossible = |gain: &Estimate| possible_gain::is_impossible(gain, most);
        let is_taken = |gain: &Estimate| is_shown(gain) && !is_impossible(gain);
        let own = gain.as_ref().map(|it| it.gain);
        let between = supplies.as_ref().map(|it| it.gain);
        self.battery = gain.filter(|it| is_taken(&it.gain));
        self.supplies = supplies.filter(|it| is_taken(&it.gain));
        let impossible = [between, own].into_iter().flatten().find(is_impossible);
        let is_none = self.battery.is_none() && self.supplies.is_none();
        // What a supply does under its load is no fault where several of them say more.
        let said = impossible.filter(|gain| is_none || gain.value > 0.0);
        self.impossible_gain = said.map(|gain| (gain.value, most));
        if let Some(impossible) = impossible.filter(|_| is_none) {
            return self.note(STEP, false, possible_gain::no_step(&impossible, most));
        }
        // What a supply does under load within a level says little beside what it does from log to log.
        let none = between.or(own).filter(|_| is_none);
        if let Some((shown, why)) = none.and_then(|shown| Some((shown, significance::no_gain(&shown)?))) {
            self.insignificant_gain = Some(shown);
            return self.note(STEP, false, why);
        }
        self.note_levels(STEP, left_out);
    }

    /// Says that a k_V is none that a motor has, and leaves the battery out where there is no other.
    pub(crate) fn without_impossible_battery(&mut self) {
        let Some((gain, most)) = self.impossible_gain else { return };
        let is_left_out = self.voltage_gain().is_none();
        if is_left_out {
            self.use_battery = false;
            self.rotors.iter_mut().chain(&mut self.excited).for_each(|rotor| rotor.voltage = None);
        }
        let refused = possible_gain::refused(gain, most, is_left_out);
        // The joint estimation may have found another one as little possible.
        if !self.findings.iter().any(|it| it.code == refused.code) {
            self.findings.push(refused);
        }
    }

    /// What constant commands came to: the more certain of what the logs' supplies and what single levels say.
    fn note_levels(&mut self, step: &'static str, left_out: usize) {
        let own = self.battery.as_ref().map(|own| (own.gain.standard_error, own.levels.len()));
        let is_sharper = |it: &&SupplyGain| own.is_none_or(|(error, _)| it.gain.standard_error < error);
        if let Some(supplies) = self.supplies.as_ref().filter(is_sharper) {
            let fitted = Finding::new("supplies_fitted", "voltage_gain").with("levels", supplies.levels);
            let fitted = fitted.with("logs", supplies.logs).with("voltage_range_v", supplies.voltage_range);
            return self.note(step, true, fitted);
        }
        match own {
            Some((_, levels)) => {
                let fitted = Finding::new("levels_fitted", "voltage_gain").with("levels", levels);
                self.note(step, true, fitted.with("levels_left_out", left_out));
            }
            None if left_out > 0 => {
                let moved =
                    Finding::new("voltage_hardly_moved", columns::BATTERY_VOLTAGE).with("levels", left_out);
                self.note(step, false, moved);
            }
            None => self.lacks(step, "no_constant_commands"),
        }
    }

    /// How many jumps the best log has, how many of them a hole hides, how many may be used, and how often a rotor started from standstill.
    fn too_few_jumps(&self) -> Finding {
        let runs = self.rotors.iter().filter(|rotor| !rotor.rows_are_levels());
        let best = runs.max_by_key(|rotor| rotor.jumps().len());
        let (jumps, hidden) = best.map_or((0, 0), RotorLog::all_jumps);
        let why = Finding::new("too_few_jumps", "command").with("jumps_needed", FEWEST_JUMPS);
        let why = why.with("jumps", jumps).with("jumps_at_holes", hidden);
        let why = why.with("jumps_usable", best.map_or(0, |rotor| rotor.jumps().len()));
        why.with("starts", self.rotors.iter().map(|rotor| rotor.starts().len()).sum::<usize>())
    }

    pub(crate) fn joint(&mut self) {
        const STEP: &str = "joint_estimation";
        let samples: usize = self.excited.iter().map(|rotor| rotor.scored().count()).sum();
        if self.excited.is_empty() {
            let mut runs = self.rotors.iter().filter(|rotor| !rotor.rows_are_levels()).peekable();
            if runs.peek().is_none() && !self.rotors.is_empty() {
                return self.lacks(STEP, "no_exciting_commands");
            }
            let pole = self.settings.template.actuator.pole;
            let seldom = runs.find_map(|rotor| rotor.too_seldom(pole));
            return self.note(STEP, false, seldom.unwrap_or_else(|| self.too_few_jumps()));
        }
        if samples < THRESHOLDS.fewest_samples {
            let why = Finding::new("too_few_samples", Sensor::PropellerRate.name()).with("samples", samples);
            return self.note(STEP, false, why.with("samples_needed", THRESHOLDS.fewest_samples));
        }
        let (full_voltage, degree) = (self.full_voltage(), self.settings.degree);
        let parts = (self.use_battery, self.settings.delay);
        let mut found = Vec::new();
        let fit = joint_fit::identify(&self.excited, full_voltage, parts, degree, &mut found);
        if let Some(why) = fit.as_ref().and_then(|fit| self.no_pole(&fit.pole)) {
            return self.note(STEP, false, why);
        }
        if !self.mismatch {
            self.findings.append(&mut found);
        }
        match &fit {
            Some(fit) => self.note(STEP, true, fitted_lag(fit.samples, fit.delay.as_ref())),
            None => self.lacks(STEP, "degree_not_determined"),
        }
        self.joint = fit;
    }

    /// Why a pole that was fitted is none: raw steps say otherwise, or it hardly shows.
    fn no_pole(&self, pole: &Estimate) -> Option<Finding> {
        step_times::contradicts(&self.excited, pole).or_else(|| significance::no_pole(pole))
    }

    /// What k_V is taken as where no log shows it. Nobody knows by how much a bench differs from its template: half of it
    /// is what the curve's errors allow for. One that is taken as none is off by what shows of it, and by the error of that.
    fn assumed_voltage_gain(&self) -> Estimate {
        if let Some(shown) = self.no_voltage_gain() {
            return Estimate { value: 0.0, standard_error: shown.standard_error.hypot(shown.value) };
        }
        let taken = Estimate { value: self.template_voltage_gain(), standard_error: 0.0 };
        let unknown = Estimate { standard_error: THRESHOLDS.assumed_gain_error * taken.value.abs(), ..taken };
        if self.use_battery { unknown } else { taken.scaled(0.0) }
    }

    pub(crate) fn static_curve(&mut self) {
        const STEP: &str = "static_curve";
        let gain = self.voltage_gain().unwrap_or_else(|| self.assumed_voltage_gain());
        let (governed, free): (Vec<RotorLog>, Vec<RotorLog>) =
            self.rotors.iter().cloned().partition(|rotor| self.is_governed(rotor));
        if free.is_empty() && !governed.is_empty() {
            return self.lacks(STEP, "commands_regulated");
        }
        let rows = steady_rows::steady_rows(&free, gain.value, self.full_voltage(), self.joint.is_none());
        let Some(rows) = rows else {
            return self.lacks(STEP, "no_ramps_and_no_levels");
        };
        let known = self.joint.as_ref().map(|joint| KnownLag {
            pole: joint.pole,
            delay: joint.delay.as_ref().map_or(0.0, |it| it.delay.value),
        });
        let curve = static_curve::identify(&rows, gain.standard_error, self.settings.degree, known);
        let Some(curve) = curve else { return self.lacks(STEP, "levels_do_not_determine_degree") };
        if let Some(leads) = rates_lead(&curve) {
            self.findings.push(leads);
        } else if let Some(too_fast) = too_fast(&curve) {
            // Nothing of that kind is in the joint estimation.
            let first = |curve: &[Estimate]| curve.first().map_or(f64::INFINITY, |it| it.standard_error);
            let better = |joint: &JointFit| first(&joint.coefficients) < first(&curve.coefficients);
            if self.joint.as_ref().is_some_and(better) {
                let used = Finding { code: "ramps_too_fast_joint_used", ..too_fast };
                return self.note(STEP, false, used);
            }
            self.findings.push(too_fast);
        }
        let from = if curve.from_ramps { "ramps" } else { "constant levels" };
        let fitted = Finding::new("curve_fitted", "steady_rate").with("samples", curve.samples);
        let fitted = fitted.with("from", from).with("lowest_command", curve.range.0);
        self.note(STEP, true, fitted.with("highest_command", curve.range.1));
        self.static_curve = Some(curve);
    }

    pub(crate) fn pole(&mut self) {
        const STEP: &str = "pole";
        if self.static_curve.is_none() || self.excited.is_empty() {
            let why = match (self.joint.is_some(), self.excited.is_empty()) {
                (true, _) => "from_joint_estimation",
                (false, true) => "no_exciting_commands",
                (false, false) => "no_static_curve",
            };
            return self.lacks(STEP, why);
        }
        let actuator = self.actuator();
        let steady =
            |u: f64, drop: f64| u * polynomial(&actuator.coefficients, u) - actuator.voltage_gain * drop;
        let excited = self.excited_with_instruments();
        let record = |rotors: &[RotorLog], delay: f64| {
            record_of(rotors, actuator.full_voltage, delay, |u, drop| [steady(u, drop), 1.0])
        };
        let Some(fit) = variable_projection::fit(&record(&excited, 0.0)) else {
            return self.lacks(STEP, "steady_rate_hardly_moved");
        };
        let found = Estimate { value: fit.pole, standard_error: fit.pole_error() };
        if let Some(why) = self.no_pole(&found) {
            return self.note(STEP, false, why);
        }
        let alternatives = lag_order::both(&fit, &excited, record);
        let interval = self.excited.first().map_or(0.0, |rotor| rotor.interval);
        let unknown = lag_order::delay_unknown(&excited);
        let delayed = self.settings.delay.then(|| {
            dead_time::identify(&fit, &alternatives, (interval, unknown), |delay| record(&excited, delay))
        });
        let (mut fit, delay) = delayed.flatten().map_or((fit, None), |it| (it.fit, Some(it.delay)));
        if let Some(deviation) = lag_order::step_deviation(&excited) {
            let late = delay.as_ref().map_or(NO_DELAY, |it| it.delay.value);
            unknown_instants::widen(&mut fit, &record(&excited, late), deviation);
        }
        self.note(STEP, true, fitted_lag(fit.samples, delay.as_ref()));
        let estimate =
            |index: usize| Estimate { value: fit.coefficients[index], standard_error: fit.error(index) };
        self.pole = Some(PoleFit {
            pole: Estimate { value: fit.pole, standard_error: fit.pole_error() },
            gain: estimate(0),
            offset: estimate(1),
            residual_rms: fit.residual_rms,
            residual_correlation: fit.residual_correlation,
            samples: fit.samples,
            alternatives,
            delay,
        });
    }

    /// The excited rotors; their voltage moves as the rotor does, where that is known by now.
    fn excited_with_instruments(&self) -> Vec<RotorLog> {
        let pole = self.joint.as_ref().map(|joint| joint.pole.value);
        let moves = |rotor: &RotorLog| RotorLog {
            instrument: pole.map(|pole| VoltageInstrument { pole, noise: 0.0 }),
            ..rotor.clone()
        };
        self.excited.iter().map(moves).collect()
    }

    pub(crate) fn thrust(&mut self, logs: &[ScreenedLog]) {
        const STEP: &str = "thrust_curve";
        let hover = self.settings.template.actuator.hover_rate;
        self.thrust = thrust_curve::identify(logs, &self.settings.rotors, hover, &mut self.findings);
        match &self.thrust {
            Some(thrust) => {
                let fitted = Finding::new("thrust_fitted", "thrust_coefficient");
                self.note(STEP, true, fitted.with("samples", thrust.samples));
            }
            None => {
                match self.findings.last().filter(|found| found.code == "thrust_falls_with_rate").cloned() {
                    Some(why) => self.note(STEP, false, why),
                    None => self.lacks(STEP, "no_thrust"),
                }
            }
        }
    }

    /// What is wrong with the units of time and body of logs, where nothing was asked of their bodies.
    pub(crate) fn say_units<'a>(&mut self, logs: impl Iterator<Item = &'a ScreenedLog>) {
        for units in logs.filter_map(ScreenedLog::units).map(Mistaken::finding) {
            if !self.findings.iter().any(|it| it.code == units.code && it.log == units.log) {
                self.findings.push(units.clone());
            }
        }
    }

    pub(crate) fn body(&mut self, logs: &[ScreenedLog], actuator: &IdentifiedActuator) {
        const STEP: &str = "inertia";
        let arm = self.settings.template.body.arm;
        let mut fits: Vec<IdentifiedBody> = Vec::new();
        for log in logs {
            let mut found = Vec::new();
            match inertia::identify(log, actuator, arm, &mut found) {
                Some(fit) => {
                    fits.push(fit);
                    self.findings.append(&mut found);
                }
                None => self.no_body.append(&mut found),
            }
        }
        self.body_logs = fits.iter().map(|fit| fit.source.clone()).collect();
        // A log made for the rotors need not move the body where another one does.
        if fits.is_empty() {
            self.findings.extend(self.no_body.iter().cloned());
        }
        // The log that says most decides; the others agree, or it is a finding.
        let best =
            fits.iter().min_by(|a, b| a.inertia.standard_error.total_cmp(&b.inertia.standard_error)).cloned();
        if let Some(best) = &best {
            for other in &fits {
                let sigma = other.inertia.standard_error.hypot(best.inertia.standard_error);
                if (other.inertia.value - best.inertia.value).abs() > THRESHOLDS.disagreement_errors * sigma {
                    let found = Finding::new("inertias_disagree", "inertia").of(&best.source);
                    let found = found.with("inertia_kg_m2", best.inertia.value);
                    let found = found.with("other_log", other.source.as_str());
                    self.findings.push(found.with("other_inertia_kg_m2", other.inertia.value));
                }
            }
        }
        if let Some(why) = best.as_ref().and_then(|body| significance::no_inertia(&body.inertia)) {
            return self.note(STEP, false, why);
        }
        match &best {
            Some(best) => {
                let fitted = Finding::new("inertia_fitted", "inertia").with("samples", best.samples);
                self.note(STEP, true, fitted.with("driven_by", best.driven_by));
            }
            None => self.lacks(STEP, "no_torque_moves_body"),
        }
        self.body = best;
    }
}

/// Ramps on which the rates are ahead of their commands.
fn rates_lead(curve: &StaticCurve) -> Option<Finding> {
    let lag = curve.ramp_check.as_ref()?.lag;
    let is_ahead = lag.value < -THRESHOLDS.ramp_lag_errors * lag.standard_error;
    is_ahead.then(|| Finding::new("rates_lead_ramps", "steady_rate").with("lead_ms", -1e3 * lag.value))
}

/// Ramps whose lag Eq. (4) does not allow for.
fn too_fast(curve: &StaticCurve) -> Option<Finding> {
    let check = curve.ramp_check.as_ref().filter(|check| !check.slow_enough && check.lag.value > 0.0)?;
    let found = Finding::new("ramps_too_fast", "steady_rate").with("slope_per_s", check.fastest_slope);
    let found = found.with("lag_ms", 1e3 * check.lag.value).with("error_rad_s", check.error);
    Some(found.with("lag_fitted", usize::from(check.lag_fitted)))
}

/// What a fit of the pole came to.
fn fitted_lag(samples: usize, delay: Option<&Delay>) -> Finding {
    match delay {
        Some(it) => Finding::new("lag_and_delay_fitted", "pole")
            .with("samples", samples)
            .with("delay_ms", 1e3 * it.delay.value)
            .with("delay_error_ms", 1e3 * it.delay.standard_error),
        None => Finding::new("lag_fitted", "pole").with("samples", samples),
    }
}
