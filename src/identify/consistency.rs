//! Where the results contradict each other, hardly show, or leave something over: each with what it may be.

use super::inertia::IdentifiedBody;
use super::lag_order::{LagAlternative, dead_time_effect};
use super::significance;
use super::static_curve;
use super::thresholds::THRESHOLDS;
use super::validate::Validation;
use super::work::Work;
use crate::screening::Finding;
use crate::screening::rotor_data::{RotorLog, bounds};

impl Work<'_> {
    /// Where the results contradict each other or leave something over.
    pub(crate) fn check_results(&mut self) {
        let mut found: Vec<Finding> = Vec::new();
        // Of rotors that differ it is known why their common fit contradicts itself.
        let matched = !self.mismatch;
        if matched {
            found.extend(self.voltage_gains_disagree());
        }
        if let Some(pole) = self.pole_estimate().filter(|pole| pole.value > THRESHOLDS.fastest_pole) {
            found.push(Finding::new("pole_too_fast", "pole").with("pole_rad_s", pole.value));
        }
        if self.joint.is_some() || self.static_curve.is_some() {
            found.extend(self.curve_falls());
        }
        if let Some(fit) = self.pole.as_ref().filter(|_| matched)
            && (fit.gain.value - 1.0).abs() > THRESHOLDS.gain_off_one
            && fit.gain.distance(1.0) > THRESHOLDS.disagreement_errors
        {
            found.push(Finding::new("gain_not_one", "steady_rate").with("gain", fit.gain.value));
        }
        self.check_lag(&mut found);
        found.extend(self.body.as_ref().and_then(body_torque));
        if matched {
            self.check_errors(&mut found);
        }
        self.check_template(&mut found);
        self.check_inertia(&mut found);
        if let Some((low, high)) =
            self.excited_range().filter(|(low, high)| high - low < THRESHOLDS.narrow_excitation)
        {
            let narrow = Finding::new("excitation_narrow", "steady_rate");
            found.push(narrow.with("lowest_command", low).with("highest_command", high));
        }
        self.findings.extend(found);
    }

    /// A curve that falls among the commands that were logged.
    fn curve_falls(&self) -> Option<Finding> {
        let ranges = self.rotors.iter().map(|rotor| bounds(&rotor.command));
        let range = ranges.reduce(|(low, high), other| (low.min(other.0), high.max(other.1)))?;
        let (from, to) = static_curve::falls(&self.actuator().coefficients, range)?;
        let found = Finding::new("curve_falls", "steady_rate");
        Some(found.with("lowest_command", from).with("highest_command", to))
    }

    fn voltage_gains_disagree(&self) -> Option<Finding> {
        let steady = self.battery.as_ref()?.gain;
        let exciting = self.joint.as_ref()?.voltage_gain?;
        let sigma = steady.standard_error.hypot(exciting.standard_error);
        ((steady.value - exciting.value).abs() > THRESHOLDS.disagreement_errors * sigma).then(|| {
            let found = Finding::new("voltage_gains_disagree", "voltage_gain");
            found.with("constant_rad_s_v", steady.value).with("exciting_rad_s_v", exciting.value)
        })
    }

    /// What a first-order lag leaves over, and what of it the model has.
    fn check_lag(&self, found: &mut Vec<Finding>) {
        let fit = self.pole.as_ref().map(|fit| (&fit.alternatives, fit.residual_correlation));
        let joint = || self.joint.as_ref().map(|fit| (&fit.alternatives, fit.residual_correlation));
        let Some((alternatives, correlation)) = fit.or_else(joint) else { return };
        let matched = !self.mismatch;
        let needed: Vec<&LagAlternative> = alternatives.iter().filter(|it| it.needed).collect();
        if let Some(delay) = self.delay() {
            let pole = self.pole_estimate().map_or(f64::NAN, |pole| pole.value);
            found.push(
                Finding::new("dead_time_in_model", dead_time_effect().map_or("", |card| card.id))
                    .with("delay_ms", 1e3 * delay.delay.value)
                    .with("delay_error_ms", 1e3 * delay.delay.standard_error)
                    .with("pole_rad_s", pole)
                    .with("pole_without_rad_s", delay.pole_without.value),
            );
        } else if matched && !needed.is_empty() {
            let each =
                |pick: fn(&LagAlternative) -> f64| needed.iter().map(|it| pick(it)).collect::<Vec<f64>>();
            let effects: Vec<String> = needed.iter().map(|it| it.effect.to_owned()).collect();
            found.push(
                Finding::new("first_order_lag_insufficient", "pole")
                    .with("effects", effects)
                    .with("times_ms", each(|it| 1e3 * it.time.value))
                    .with("time_errors_ms", each(|it| 1e3 * it.time.standard_error))
                    .with("rms_rad_s", each(|it| it.residual_rms))
                    .with("poles_rad_s", each(|it| it.pole)),
            );
        }
        if matched && correlation > THRESHOLDS.correlated_residual {
            found.push(Finding::new("rotor_residual_correlated", "rotor").with("correlation", correlation));
        }
    }

    /// Which numbers of the model hardly show.
    fn check_errors(&self, found: &mut Vec<Finding>) {
        let gain = self.voltage_gain().filter(|_| self.static_curve.is_some() || self.joint.is_none());
        let gain = gain.or(self.joint.as_ref().and_then(|joint| joint.voltage_gain));
        // An error that is large because something is missing in the model is found as that.
        let correlation = self.pole.as_ref().map(|fit| fit.residual_correlation);
        let correlation = correlation.or(self.joint.as_ref().map(|fit| fit.residual_correlation));
        let pole = self
            .pole_estimate()
            .filter(|_| correlation.is_none_or(|it| it <= THRESHOLDS.correlated_residual));
        let inertia =
            self.body.as_ref().filter(|body| body.residual_correlation <= THRESHOLDS.correlated_residual);
        let inertia = inertia.map(|body| body.inertia);
        for (finding, estimate) in [
            (Finding::new("voltage_gain_uncertain", "voltage_gain"), gain),
            (Finding::new("pole_uncertain", "pole"), pole),
            (Finding::new("inertia_uncertain", "inertia"), inertia),
        ] {
            let uncertain =
                estimate.filter(|it| it.standard_error > THRESHOLDS.uncertain_share * it.value.abs());
            found.extend(uncertain.map(|it| significance::with_estimate(finding, &it)));
        }
    }

    fn excited_range(&self) -> Option<(f64, f64)> {
        let ranges: Vec<(f64, f64)> = self.excited.iter().map(|rotor| bounds(&rotor.command)).collect();
        let low = ranges.iter().map(|range| range.0).reduce(f64::min)?;
        Some((low, ranges.iter().map(|range| range.1).fold(low, f64::max)))
    }
}

/// A torque of the body's own that its model lacks, or what else is left over.
fn body_torque(body: &IdentifiedBody) -> Option<Finding> {
    let of = |code| Finding::new(code, "inertia").of(&body.source);
    if let Some(omitted) = body.omitted_torque {
        let found = of("body_torque_omitted").with("goes_with", omitted.goes_with);
        let found = found.with("standard_errors", omitted.shows);
        let found = found.with("inertia_kg_m2", omitted.inertia.value);
        return Some(found.with("inertia_error_kg_m2", omitted.inertia.standard_error));
    }
    let is_left_over = body.residual_correlation > THRESHOLDS.correlated_residual
        && body.residual_rms > THRESHOLDS.unexplained_motion_share * body.motion_rms;
    is_left_over.then(|| {
        of("body_residual_correlated")
            .with("rms_rad_s", body.residual_rms)
            .with("motion_rms_rad_s", body.motion_rms)
            .with("correlation", body.residual_correlation)
    })
}

/// A log whose rates the model does not explain, though its commands excite them.
pub(crate) fn unexplained(rotor: &RotorLog, run: &Validation) -> Option<Finding> {
    (run.fit_percent < THRESHOLDS.unexplained_fit).then(|| {
        let found = rotor.finding("rates_unexplained").with("rms_rad_s", run.rms);
        found.with("fit_percent", run.fit_percent)
    })
}
