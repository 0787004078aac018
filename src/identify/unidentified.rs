//! What is the template's in the result, and where the template's numbers are not those of this bench.

use super::pipeline::Work;
use super::significance;
use super::static_curve::formula;
use crate::screening::Finding;
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::unit::short;

impl Work<'_> {
    /// Says what no log shows, and what to record for it.
    fn tell_of_taken(&self, say: &mut Vec<Finding>) {
        let template = &self.settings.template.actuator;
        let (curve, pole) = (formula(template.steady_rate.get(1..).unwrap_or_default()), template.pole);
        let (pole, gain) = (short(pole), short(template.voltage_gain));
        if self.rotors.is_empty() {
            return say.push(format!(
                "no rotor was identified: g(u) = {curve} rad/s, the pole {pole} rad/s and k_V = {gain} rad/(s V) are the \
                 template's; give a log with a rotor's command and rate"
            ).into());
        }
        if self.joint.is_none() && self.static_curve.is_none() {
            say.push(format!(
                "g(u) = {curve} rad/s is the template's, not this bench's: nothing in the logs shows it; record a ramp or a PRBS"
            ).into());
        }
        if self.joint.is_none() && self.pole.is_none() {
            say.push(format!(
                "the pole {pole} rad/s is the template's, not this bench's: nothing in the logs shows it; record steps or a PRBS"
            ).into());
        }
        let without = self.static_curve.is_none()
            && self.joint.as_ref().is_some_and(|joint| joint.voltage_gain.is_none());
        if self.use_battery && without {
            say.push(
                "the model has k_V = 0, because its g(u) was fitted without the battery's part: both hold for the charge at \
                 which the logs were made"
                    .to_owned().into(),
            );
        } else if let Some(shown) = self.no_voltage_gain() {
            say.push(format!(
                "the model has k_V = 0: what the logs show, {} rad/(s V), is next to nothing and speaks against the template's \
                 {gain} (a rotor whose ESC governs its rate has none)",
                significance::in_digits(shown)
            ).into());
        } else if self.use_battery && self.voltage_gain().is_none() {
            let allowed = if self.static_curve.is_some() {
                ", and the standard errors of g(u) allow for its being off by half"
            } else {
                ""
            };
            say.push(format!(
                "k_V = {gain} rad/(s V) is the template's, not this bench's: {}{allowed}; hold a command for minutes while \
                 the battery falls, or record a PRBS",
                significance::shown_of_gain(self.hardly.as_ref())
            ).into());
        }
    }

    /// Says where the template's numbers are not those of this bench.
    pub(crate) fn check_template(&self, say: &mut Vec<Finding>) {
        let template = &self.settings.template.actuator;
        self.tell_of_taken(say);
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
            ).into());
        }
        let volts = over(&|rotor| rotor.voltage.as_deref().map(bounds));
        if let Some((low, high)) = volts
            && high < 0.7 * template.full_voltage
        {
            let full = template.full_voltage;
            say.push(if self.settings.full_voltage_given {
                format!(
                    "the battery had {low:.1} to {high:.1} V, but --full-voltage-v says that it is full at {full:.1} V: g(u) and \
                     k_V are drawn out to a charge that is far from these logs; is it the battery of this bench?"
                ).into()
            } else {
                format!(
                    "the battery had {low:.1} to {high:.1} V, but the template's is full at {full:.1} V: g(u) and k_V are \
                     drawn out to a battery that this bench does not have; give its full voltage with --full-voltage-v"
                ).into()
            });
        }
    }

    /// Says so where J is off by the factor between radians and degrees.
    pub(crate) fn check_inertia(&self, say: &mut Vec<Finding>) {
        let Some(body) = &self.body else { return };
        let ratio = self.settings.template.body.inertia / body.inertia.value;
        let degrees = 180.0 / std::f64::consts::PI;
        if (0.7..1.4).contains(&(ratio / degrees)) {
            say.push(format!(
                "{}: J = {:.2e} kg m² is 1/{ratio:.0} of the template's {}; if the body rate is in degrees per second, import \
                 it with unit `deg/s`",
                body.source, body.inertia.value, self.settings.template.body.inertia
            ).into());
        }
    }
}
