//! Sentences for columns that, beside a model, can hardly be what their names say.

use crate::report::number;
use crate::screening::Finding;
use crate::unit::short;

/// Columns that can hardly be what their names say.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    let unit = finding.text("unit");
    Some(match finding.code {
        "rate_in_other_unit" => format!(
            "rates from {:.4} to {:.4} rad/s are {} times what the model's rotor does at these commands, as {unit} are; if the \
             column is in {unit}, import it with unit `{unit}`{}; if it is another rotor, the model is not its own \
             (`rotorbench identify` makes one)",
            n("least"),
            n("greatest"),
            short((1e3 * n("ratio")).round() / 1e3),
            electrical(n("ratio"))
        ),
        "rate_unlike_template" => unlike_template(finding, "rates", "rad/s"),
        "thrust_unlike_template" => unlike_template(finding, "thrusts", "N") + &other_propeller(finding),
        "battery_in_other_unit" => format!(
            "battery voltages from {:.3} to {:.3} V are not those of the model's battery, which has {:.1} V when full; {}; if it \
             is another battery, say what it has when full (`rotorbench identify --full-voltage-v` makes a model of it)",
            n("lowest_v"),
            n("highest_v"),
            n("full_voltage_v"),
            match unit {
                "mV" => "import `battery_voltage_v` in millivolts: unit `mV`",
                "0.01 V" => "import `battery_voltage_v` in hundredths of a volt: scale 0.01",
                "0.1 V" => {
                    "import `battery_voltage_v` in tenths of a volt: scale 0.1 (a charge in percent is no voltage: leave that column out)"
                }
                _ => "a charge in percent is no voltage (leave that column out)",
            }
        ),
        "battery_of_other_bench" => format!(
            "the battery had {:.1} V, and the model's has {:.1} V when full: is it the model of this bench, and the column a \
             voltage? (`rotorbench identify` makes a model)",
            n("voltage_v"),
            n("full_voltage_v")
        ),
        "torque_scale" => torque_scale(finding),
        _ => return None,
    })
}

/// A torque, an arm or J that is off by a power of ten.
fn torque_scale(finding: &Finding) -> String {
    let n = |name: &str| finding.number(name);
    let (ratio, power) = (n("ratio"), n("power"));
    let inertia = format!("J = {} kg m²", short(n("inertia_kg_m2")));
    let torque = if finding.text("driven_by") == "torque_command" {
        let unit = Some(finding.text("unit")).filter(|it| !it.is_empty());
        let unit = unit.map_or_else(String::new, |unit| format!("unit `{unit}`, or "));
        format!(
            "`torque_command_nm` over the model's {inertia} makes it: if that column is not in N m, import it with its unit ({unit}scale \
             {})",
            short(power)
        )
    } else {
        format!(
            "the rotors' thrusts, the model's arm of {} m and its {inertia} make it: is that arm {} times too {}, or the model's \
             `thrust_coefficient`",
            short(n("arm_m")),
            short(power.max(1.0 / power)),
            if power > 1.0 { "small" } else { "great" }
        )
    };
    format!(
        "the body speeds up {} times as fast as {torque}; or is J in the model another (`inertia = {}` would do, and `rotorbench \
         identify` finds it)?",
        number(ratio, 3),
        number(n("inertia_kg_m2") / ratio, 2)
    )
}

/// What to do where the thrusts are right, and another propeller's.
fn other_propeller(finding: &Finding) -> String {
    let column = finding.text("column");
    format!(
        "; if `{column}` is in N, give a model with this propeller's c (`--template` of `identify`, else `--model`)"
    )
}

/// Numbers that are a multiple of what the rotor of the model, or of the template of a fit, does.
fn unlike_template(finding: &Finding, what: &str, si: &str) -> String {
    let unit = finding.text("unit");
    format!(
        "{what} from {:.4} to {:.4} {si} are {} times what the model's rotor does at these commands; {}",
        finding.number("least"),
        finding.number("greatest"),
        short((1e3 * finding.number("ratio")).round() / 1e3),
        if unit.is_empty() {
            "is the unit of the column right?".to_owned()
        } else {
            let or = if si == "rad/s" { electrical(finding.number("ratio")) } else { "" };
            format!(
                "if the column is in {unit}, import it with unit `{unit}`{or}; everything in {si} is off by that else"
            )
        }
    )
}

/// What more a rate may be that is `ratio` times what is expected: an ESC counts pole pairs times the rotor's turns.
fn electrical(ratio: f64) -> &'static str {
    if ratio > 1.0 {
        "; if it was, is it electrical rpm? `scale` = 1 / pole pairs beside the unit"
    } else {
        ""
    }
}
