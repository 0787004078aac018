//! Sentences for what is the template's, and where that is not this bench's.

use super::super::numbers::{formula, in_digits};
use crate::screening::Finding;
use crate::unit::short;

/// What is the template's, and where that is not this bench's.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    let curve = || formula(finding.numbers("coefficients_rad_s"));
    Some(match finding.code {
        "rotor_from_template" => format!(
            "no rotor was identified: g(u) = {} rad/s, the pole {} rad/s and k_V = {} rad/(s V) are the template's; give a log \
             with a rotor's command and rate",
            curve(),
            short(n("pole_rad_s")),
            short(n("template_rad_s_v"))
        ),
        "curve_from_template" => format!(
            "g(u) = {} rad/s is the template's, not this bench's: nothing in the logs shows it; record a ramp or a PRBS",
            curve()
        ),
        "pole_from_template" => format!(
            "the pole {} rad/s is the template's, not this bench's: {}",
            short(n("pole_rad_s")),
            match finding.count("contradicted") {
                0 => "nothing in the logs shows it; record steps or a PRBS",
                _ => "what was fitted contradicts the steps of the logs. `discover` looks for the law that the curve lacks",
            }
        ),
        "voltage_gain_without_battery" => {
            "the model has k_V = 0, because its g(u) was fitted without the battery's part: both hold for the charge at which the \
             logs were made"
                .to_owned()
        }
        "voltage_gain_zero" => format!(
            "the model has k_V = 0: what the logs show, {} rad/(s V), is next to nothing and speaks against the template's {} (a \
             rotor whose ESC governs its rate has none)",
            in_digits(finding, "value", "error"),
            short(n("template_rad_s_v"))
        ),
        "voltage_gain_from_template" => {
            let shown = if n("value").is_finite() {
                let value = in_digits(finding, "value", "error");
                format!("what the logs show, {value} rad/(s V), is not known well enough")
            } else {
                "nothing in the logs shows it".to_owned()
            };
            let allowed = if finding.count("curve_allows_for_it") > 0 {
                ", and the standard errors of g(u) allow for its being off by half"
            } else {
                ""
            };
            let (taken, template) = (n("taken_rad_s_v"), n("template_rad_s_v"));
            let whose = if taken < template {
                format!(
                    "{} rad/(s V) is all of this bench's rate over all of its volts, for the template's {} is more than its motor can have",
                    format_args!("{taken:.1}"),
                    short(template)
                )
            } else {
                format!("{} rad/(s V) is the template's, not this bench's", short(template))
            };
            format!(
                "k_V = {whose}: {shown}{allowed}; hold a command for minutes while the battery falls, or record a PRBS"
            )
        }
        "hover_outside_measured_thrust" => format!(
            "the tangent of the thrust curve is taken at {:.0} rad/s, where the template hovers, but the rates with a measured \
             thrust reach from {:.0} to {:.0}; say where this bench hovers with --hover-rate",
            n("hover_rad_s"),
            n("lowest_rad_s"),
            n("highest_rad_s")
        ),
        "inertia_in_degrees" => format!(
            "J = {:.2e} kg m² is 1/{:.0} of the model's {}; if the body rate is in degrees per second, import it with unit \
             `deg/s`",
            n("inertia_kg_m2"),
            n("template_kg_m2") / n("inertia_kg_m2"),
            n("template_kg_m2")
        ),
        _ => return None,
    })
}
