//! What is the template's in the result, and where the template's numbers are not those of this bench.

use super::significance;
use super::thresholds::THRESHOLDS;
use super::work::Work;
use crate::screening::Finding;
use crate::screening::attitude::inertia_in_degrees;
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::signal::columns;

impl Work<'_> {
    /// What no log shows.
    fn check_taken(&self, found: &mut Vec<Finding>) {
        let template = &self.settings.template.actuator;
        let coefficients = template.steady_rate.get(1..).unwrap_or_default().to_vec();
        if self.rotors.is_empty() {
            let taken = Finding::new("rotor_from_template", "").with("coefficients_rad_s", coefficients);
            let taken = taken.with("pole_rad_s", template.pole);
            return found.push(taken.with("template_rad_s_v", template.voltage_gain));
        }
        if self.joint.is_none() && self.static_curve.is_none() {
            let taken = Finding::new("curve_from_template", "steady_rate");
            found.push(taken.with("coefficients_rad_s", coefficients));
        }
        if self.joint.is_none() && self.pole.is_none() {
            let contradicted = self.parts.iter().any(|part| part.finding.code == "pole_contradicts_steps");
            let taken = Finding::new("pole_from_template", "pole").with("pole_rad_s", template.pole);
            found.push(taken.with("contradicted", usize::from(contradicted)));
        }
        found.extend(self.voltage_gain_taken());
    }

    /// What the model's k_V is where no log shows it.
    fn voltage_gain_taken(&self) -> Option<Finding> {
        let template = self.settings.template.actuator.voltage_gain;
        let of = |code| Finding::new(code, "voltage_gain").with("template_rad_s_v", template);
        let without = self.static_curve.is_none()
            && self.joint.as_ref().is_some_and(|joint| joint.voltage_gain.is_none());
        if self.use_battery && without {
            return Some(of("voltage_gain_without_battery"));
        }
        if let Some(shown) = self.no_voltage_gain() {
            return Some(significance::with_estimate(of("voltage_gain_zero"), shown));
        }
        if !self.use_battery || self.voltage_gain().is_some() {
            return None;
        }
        let taken = of("voltage_gain_from_template")
            .with("taken_rad_s_v", self.template_voltage_gain())
            .with("curve_allows_for_it", usize::from(self.static_curve.is_some()));
        Some(match &self.insignificant_gain {
            Some(shown) => significance::with_estimate(taken, shown),
            None => taken,
        })
    }

    /// Where the template's numbers are not those of this bench.
    pub(crate) fn check_template(&self, found: &mut Vec<Finding>) {
        let template = &self.settings.template.actuator;
        self.check_taken(found);
        let over = |pick: &dyn Fn(&RotorLog) -> Option<(f64, f64)>| {
            let all: Vec<(f64, f64)> = self.rotors.iter().filter_map(pick).collect();
            let low = all.iter().map(|range| range.0).reduce(f64::min)?;
            Some((low, all.iter().map(|range| range.1).fold(low, f64::max)))
        };
        let rates = over(&|rotor| rotor.thrust.as_ref().map(|_| bounds(&rotor.rate)));
        if let Some((low, high)) = rates.filter(|_| self.thrust.is_some())
            && !(low..=high).contains(&template.hover_rate)
        {
            let outside = Finding::new("hover_outside_measured_thrust", "thrust_coefficient");
            let outside = outside.with("hover_rad_s", template.hover_rate);
            found.push(outside.with("lowest_rad_s", low).with("highest_rad_s", high));
        }
        let volts = over(&|rotor| rotor.voltage.as_deref().map(bounds));
        if let Some((low, high)) = volts
            && high < THRESHOLDS.low_battery_share * template.full_voltage
        {
            let below = Finding::new("battery_below_full_voltage", columns::BATTERY_VOLTAGE);
            let below = below.with("lowest_v", low).with("highest_v", high);
            let below = below.with("full_voltage_v", template.full_voltage);
            found.push(below.with("full_voltage_from", self.settings.full_voltage_from()));
        }
    }

    /// Whether J is off by the factor between radians and degrees.
    pub(crate) fn check_inertia(&self, found: &mut Vec<Finding>) {
        let Some(body) = &self.body else { return };
        let of_template = self.settings.template.body.inertia;
        found.extend(inertia_in_degrees(of_template, body.inertia.value).map(|it| it.of(&body.source)));
    }
}
