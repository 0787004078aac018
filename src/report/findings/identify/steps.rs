//! Sentences for the steps of section III: what was done, or why it was not.

use super::super::numbers::{counted, digits, settled_between};
use crate::screening::Finding;

/// A step of section III and its equation; a name that is no step's stands for itself.
pub fn step(code: &str) -> &str {
    match code {
        "voltage_gain" => "k_V from constant commands, Eq. (6)",
        "joint_estimation" => "joint estimation of g(u), k_V and p, by output error",
        "static_curve" => "g(u) from ramps, Eq. (9)",
        "pole" => "p from z by output error, section III.B",
        "thrust_curve" => "thrust curve and its tangent, Eq. (13)",
        "inertia" => "J from an attitude log, Eq. (1)",
        other => other,
    }
}

/// What drove the body that J is from.
pub(crate) fn driven_by(code: &str) -> &'static str {
    match code {
        "measured_rotor_rates" => "measured rotor rates",
        "torque_command" => "commanded torque",
        _ => "rotor rates predicted from the commands",
    }
}

/// The sentence of a step.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    done(finding).or_else(|| not_done(finding))
}

fn done(finding: &Finding) -> Option<String> {
    let samples = finding.count("samples");
    Some(match finding.code {
        "levels_fitted" => {
            format!(
                "{}, {} left out",
                counted(finding.count("levels"), "level"),
                finding.count("levels_left_out")
            )
        }
        "supplies_fitted" => format!(
            "{} of {}, whose supplies differ by up to {:.2} V",
            counted(finding.count("levels"), "level"),
            counted(finding.count("logs"), "log"),
            finding.number("voltage_range_v")
        ),
        "lag_fitted" => format!("{samples} samples"),
        "lag_and_delay_fitted" => format!(
            "{samples} samples, beside a delay of {:.2} ± {:.2} ms",
            finding.number("delay_ms"),
            finding.number("delay_error_ms")
        ),
        "curve_fitted" => format!(
            "{samples} samples of {}, commands {:.3} to {:.3}",
            finding.text("from"),
            finding.number("lowest_command"),
            finding.number("highest_command")
        ),
        "thrust_fitted" => format!("{samples} samples"),
        "inertia_fitted" => format!("{samples} samples, {}", driven_by(finding.text("driven_by"))),
        _ => return None,
    })
}

fn not_done(finding: &Finding) -> Option<String> {
    Some(match finding.code {
        "battery_excluded" => {
            "left out, as asked for: g(u) holds for the charge of these logs, and p includes how the battery gives way under load"
                .to_owned()
        }
        "no_rotor" => "no rotor that can be identified".to_owned(),
        "no_battery_voltage" => "no battery voltage to identify it from".to_owned(),
        "voltage_hardly_moved" => format!(
            "{}, but the voltage hardly moved over its noise; hold longer",
            counted(finding.count("levels"), "constant level")
        ),
        "no_constant_commands" => "no command was held constant for five seconds after settling".to_owned(),
        "readings_too_seldom" => format!(
            "rates come at {} Hz, {}: {} Hz are the least that show how such a rotor follows",
            digits(finding.number("rate_hz"), 2),
            settled_between(finding),
            digits(finding.number("needed_hz"), 2)
        ),
        "too_few_jumps" => too_few_jumps(finding),
        "too_few_samples" => format!(
            "only {} usable samples of command and rate, {} are the least",
            finding.count("samples"),
            finding.count("samples_needed")
        ),
        "degree_not_determined" => {
            "the commands do not determine a curve of that degree: use more than two command levels, or ramps".to_owned()
        }
        "no_ramps_and_no_levels" => {
            "no slow ramps, and no constant levels that span a range of commands".to_owned()
        }
        "levels_do_not_determine_degree" => {
            "the levels of the command do not determine a curve of that degree".to_owned()
        }
        "from_joint_estimation" => "taken from the joint estimation".to_owned(),
        "no_exciting_commands" => "no exciting commands".to_owned(),
        "no_static_curve" => "no g(u) to make z of".to_owned(),
        "steady_rate_hardly_moved" => "the commands do not move z enough".to_owned(),
        "no_thrust" => "no thrust in the logs".to_owned(),
        "no_torque_moves_body" => "no log in which a torque moves the body".to_owned(),
        _ => return None,
    })
}

fn too_few_jumps(finding: &Finding) -> String {
    let starts = match finding.count("starts") {
        0 => String::new(),
        starts => format!(
            "; {} from standstill {} not: record steps between commands at which the rotor turns",
            counted(starts, "start"),
            if starts == 1 { "does" } else { "do" }
        ),
    };
    format!(
        "{} of the command in the best log, {} of them at a hole in the rows, {} usable; {} are needed, in all logs together: steps or \
         a PRBS excite the pole{starts}",
        counted(finding.count("jumps"), "jump"),
        finding.count("jumps_at_holes"),
        finding.count("jumps_usable"),
        finding.count("jumps_needed")
    )
}
