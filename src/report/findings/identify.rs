//! Sentences for what `identify` finds, and for the steps of section III.

use crate::identify::Part;
use crate::screening::Finding;
use crate::unit::{short, with_error};

/// The sentence of a finding of this room.
pub(crate) fn sentence(finding: &Finding) -> Option<String> {
    of_battery(finding)
        .or_else(|| of_commands(finding))
        .or_else(|| of_columns(finding))
        .or_else(|| of_fits(finding))
        .or_else(|| of_significance(finding))
        .or_else(|| of_template(finding))
        .or_else(|| of_body(finding))
        .or_else(|| of_done_steps(finding))
        .or_else(|| of_steps_not_done(finding))
}

/// What became of a step, with what is kept of the template for it.
#[must_use]
pub fn outcome(part: &Part) -> String {
    let kept = match part.finding.code {
        "no_thrust" => "; the template's curve is kept",
        "inertia_not_significant" | "no_torque_moves_body" => "; the template's J is kept",
        _ => "",
    };
    format!("{}{kept}", super::text(&part.finding))
}

/// Why nothing can be identified: first the logs without a part, then what each step lacks.
pub(super) fn nothing(reasons: &[Finding], steps: &[Part]) -> String {
    let (unused, rest): (Vec<_>, Vec<_>) = reasons.iter().partition(|it| it.code == "log_not_used");
    let steps = steps.iter().map(|part| format!("{}: {}", part.step, super::text(&part.finding)));
    let lines =
        unused.into_iter().map(super::sentence).chain(steps).chain(rest.into_iter().map(super::sentence));
    format!("nothing can be identified:\n  {}", lines.collect::<Vec<String>>().join("\n  "))
}

/// Three digits of a number that is not known to two, and of its error.
fn in_digits(finding: &Finding, value: &str, error: &str) -> String {
    let digits = |value: f64| short(format!("{value:.2e}").parse().unwrap_or(value));
    format!("{} ± {}", digits(finding.number(value)), digits(finding.number(error)))
}

/// Σ c_j u^j from j = 1.
fn formula(coefficients: &[f64]) -> String {
    let term = |(at, value): (usize, &f64)| {
        let power = match at {
            0 => "u".to_owned(),
            at => format!("u^{}", at + 1),
        };
        format!("{} {power}", short(*value))
    };
    coefficients.iter().enumerate().map(term).collect::<Vec<String>>().join(" + ").replace("+ -", "- ")
}

/// A value with its error; without one where it is exact.
fn value_of([value, error]: [f64; 2]) -> String {
    if error == 0.0 { short(value) } else { with_error(value, error) }
}

fn of_battery(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    let is_given = finding.text("full_voltage_from") == "option";
    Some(match finding.code {
        "battery_above_full_voltage" => {
            let (volts, full) = (n("voltage_v"), n("full_voltage_v"));
            let taken = format!("{volts:.1} V is taken as full, so that no command counts as more than all");
            if is_given {
                format!(
                    "the battery had {volts:.1} V, more than the {full:.1} V that --full-voltage-v says it has when full: \
                     {taken}; is `battery_voltage_v` the voltage of that battery, of all its cells?"
                )
            } else {
                format!(
                    "the battery had {volts:.1} V, more than the template's full {full:.1} V: {taken}; give this bench's full \
                     voltage with --full-voltage-v"
                )
            }
        }
        "battery_below_full_voltage" => {
            let (low, high, full) = (n("lowest_v"), n("highest_v"), n("full_voltage_v"));
            if is_given {
                format!(
                    "the battery had {low:.1} to {high:.1} V, but --full-voltage-v says that it is full at {full:.1} V: g(u) \
                     and k_V are extrapolated to a charge far from these logs; is it the battery of this bench?"
                )
            } else {
                format!(
                    "the battery had {low:.1} to {high:.1} V, but the template's is full at {full:.1} V: g(u) and k_V are \
                     extrapolated to a battery that this bench does not have; give its full voltage with --full-voltage-v"
                )
            }
        }
        "battery_not_logged" => format!(
            "no column `battery_voltage_v` with a battery's voltage in {}: k_V cannot be identified, and g(u) and p are fitted \
             without the battery's part, so they hold for the charge at which the log was made, and p includes how the battery \
             gives way under load",
            finding.texts("logs").join(", ")
        ),
        "battery_constant" => format!(
            "`battery_voltage_v` reads {} V throughout: k_V cannot be identified from a voltage that never changes, and g(u) and \
             p are fitted without it; they hold at that voltage if a supply held it, and if the reading froze, for the charge at \
             which the log was made, with p including how the battery gives way under load",
            short(n("voltage_v"))
        ),
        "battery_reading_gap" => format!(
            "`battery_voltage_v` has no reading between {:.1} and {:.1} s: the one before is taken for all of that time, and k_V \
             and g(u) are off by what the battery did meanwhile; leave that part of the log out",
            n("from_s"),
            n("to_s")
        ),
        "battery_reading_frozen" => format!(
            "`battery_voltage_v` reads exactly {} V from {:.1} to {:.1} s: if that reading froze, k_V and g(u) are off; leave \
             that part of the log out",
            short(n("voltage_v")),
            n("from_s"),
            n("to_s")
        ),
        "battery_quantized" => format!(
            "`battery_voltage_v` is read in steps of {} V, and crosses too few of them to show how it fell: k_V and g(u) may be \
             off by more than their errors say; read it finer, or record a longer discharge",
            short(n("step_v"))
        ),
        _ => return None,
    })
}

/// Rates that do not belong to their commands, and rotors that differ.
fn of_commands(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    let (rotor, other) = (finding.count("rotor"), finding.count("other_rotor"));
    Some(match finding.code {
        "rates_lead_commands" => {
            let by = if n("rows_earlier") == 1.0 { "a row" } else { "half a row" };
            format!(
                "the rates lead the commands: with each command {by} earlier the error falls from {:.2} to {:.2} rad/s, with a \
                 pole of {:.2} rad/s; the logger writes a command later than it is sent (move the column of the commands up by \
                 {by}, or log each command with the row in which it is sent); until then no number of this rotor can be trusted",
                n("rms_rad_s"),
                n("rms_earlier_rad_s"),
                n("pole_rad_s")
            )
        }
        "rates_of_other_rotor" => {
            let both = if finding.count("crossed") > 1 {
                format!(", and those of {other} the commands of {rotor}")
            } else {
                String::new()
            };
            format!(
                "the rates of rotor {rotor} follow the commands of rotor {other}{both}: they are another rotor's column; give \
                 each command the rate of its own rotor"
            )
        }
        "rotor_too_slow" => format!(
            "the rates follow the commands with a time constant of {:.0} s (a pole of {:.3} 1/s), and no rotor on a bench is that \
             slow; if the time is in milliseconds or microseconds, import it with unit `ms` or `us`",
            1.0 / n("pole_rad_s"),
            n("pole_rad_s")
        ),
        "rate_falls_with_command" => format!(
            "the rotor slows down when it is commanded more, over all commands from {:.3} to {:.3}: the command counts the other \
             way round (1 is none: import it with scale -1, offset 1), or the rates are those of another rotor",
            n("lowest_command"),
            n("highest_command")
        ),
        "rotor_mismatch" => format!(
            "the rotors differ ({}): a model of both is right for neither; identify each by itself, with --rotor {rotor} and with \
             --rotor {other}",
            differences(finding)
        ),
        "rotor_mismatch_between_logs" => format!(
            "{} differ ({}): one model of both is right for neither; identify each log by itself, and if it is the same rotor, \
             look for what is missing with `diagnose`",
            finding.texts("names").join(" and "),
            differences(finding)
        ),
        _ => return None,
    })
}

/// What differs between two rotors.
fn differences(finding: &Finding) -> String {
    let names = finding.texts("names");
    let both = |values: &str, errors: &str, unit: &str| {
        let (values, errors) = (finding.numbers(values), finding.numbers(errors));
        let each = values.iter().zip(errors).zip(names);
        let each =
            each.map(|((value, error), name)| format!("{} {unit} of {name}", value_of([*value, *error])));
        each.collect::<Vec<String>>().join(", ")
    };
    let parts = [
        (
            "rates_rad_s",
            "rate_errors_rad_s",
            "rad/s",
            format!("rates at command {:.3}", finding.number("command")),
        ),
        ("delays_ms", "delay_errors_ms", "ms", "delays".to_owned()),
        ("poles_rad_s", "pole_errors_rad_s", "rad/s", "poles".to_owned()),
    ];
    let there = parts.into_iter().filter(|(values, ..)| !finding.numbers(values).is_empty());
    there
        .map(|(values, errors, unit, what)| format!("{what}: {}", both(values, errors, unit)))
        .collect::<Vec<String>>()
        .join("; ")
}

/// Columns that can hardly be what their names say.
fn of_columns(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    let unit = finding.text("unit");
    Some(match finding.code {
        "rate_in_other_unit" => format!(
            "rates from {:.4} to {:.4} rad/s are {} times what the model's rotor does at these commands, as {unit} are; if the \
             column is in {unit}, import it with unit `{unit}`; if it is another rotor, make its model first (`rotorbench \
             identify`)",
            n("lowest_rad_s"),
            n("highest_rad_s"),
            short((1e3 * n("ratio")).round() / 1e3)
        ),
        "battery_without_reading" => {
            "`battery_voltage_v` has only readings which no battery has that turns a rotor: it is not \
             connected, or it is another column; leave it out"
                .to_owned()
        }
        "battery_in_other_unit" => format!(
            "battery voltages from {:.3} to {:.3} V are not those of the model's battery, which has {:.1} V when full; {}; if it \
             is another battery, make its model first (`rotorbench identify`)",
            n("lowest_v"),
            n("highest_v"),
            n("full_voltage_v"),
            match unit {
                "mV" => "import the column in millivolts: unit `mV`",
                "0.01 V" => "import the column in hundredths of a volt: scale 0.01",
                "0.1 V" => {
                    "import the column in tenths of a volt: scale 0.1 (a charge in percent is no voltage: leave that column out)"
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
        _ => return None,
    })
}

/// Where fits contradict each other or leave something over.
fn of_fits(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    Some(match finding.code {
        "voltage_gains_disagree" => format!(
            "k_V is {:.2} from constant commands and {:.2} from exciting ones: the battery does not act as a plain subtraction \
             (see `diagnose`)",
            n("constant_rad_s_v"),
            n("exciting_rad_s_v")
        ),
        "battery_not_significant" => {
            "the battery's effect does not show beside the command in these logs: k_V is left out of the joint estimation; record \
             a longer discharge, or constant commands"
                .to_owned()
        }
        "pole_too_fast" => format!(
            "a pole of {:.0} rad/s is faster than any rotor with a propeller: is the time in seconds?",
            n("pole_rad_s")
        ),
        "gain_not_one" => format!(
            "the gain from z to the rate is {:.3} in motion: the static curve does not hold there",
            n("gain")
        ),
        "dead_time_in_model" => format!(
            "the rotor answers {} ms late: the model has `{}` for it, and the pole fitted beside it, {:.3} rad/s; \
             without it the pole would come out as {:.3}, to make up for the delay (--no-delay leaves it out)",
            with_error(n("delay_ms"), n("delay_error_ms")),
            finding.subject,
            n("pole_rad_s"),
            n("pole_without_rad_s")
        ),
        "first_order_lag_insufficient" => format!(
            "a first-order lag is not enough, and its pole makes up for what is missing: {}; `diagnose` tells which effect it \
             is, `extend` adds it",
            alternatives(finding)
        ),
        "rotor_residual_correlated" => format!(
            "the residual is far from noise (lag-one correlation {:.2}): something is missing in the model; standard errors allow \
             for it, `diagnose` looks for it",
            n("correlation")
        ),
        "excitation_narrow" => format!(
            "exciting commands span only {:.3} to {:.3}: g(u) holds near there only",
            n("lowest_command"),
            n("highest_command")
        ),
        "rates_unexplained" => format!(
            "the model leaves {:.1} rad/s of the rates' rms unexplained, a fit of {:.0} %: outliers, commands that hardly show \
             over the noise, or another bench's log; look at it before the model is used",
            n("rms_rad_s"),
            n("fit_percent")
        ),
        "ramps_too_fast" | "ramps_too_fast_joint_used" => format!(
            "the ramps are too fast for Eq. (4): at {:.3} 1/s the rate lags {:.0} ms, an error of {:.1} rad/s; {}",
            n("slope_per_s"),
            n("lag_ms"),
            n("error_rad_s"),
            match (finding.code, finding.count("lag_fitted")) {
                ("ramps_too_fast_joint_used", _) => "taken from the joint estimation",
                (_, 0) => "slow them down",
                _ => "g(u) was fitted beside that lag, slower ramps have less of it",
            }
        ),
        "thrust_not_quadratic" => format!(
            "thrust is not c ω² alone: a linear part of {:.0} % at hover fits better (an offset of the load cell, its lag during \
             fast changes, or the propeller)",
            100.0 * n("linear_share")
        ),
        "thrust_falls_with_rate" => {
            "thrust falls with the rate, which no propeller's does: is the sign of the load cell right? The template's thrust \
             curve is kept"
                .to_owned()
        }
        _ => return None,
    })
}

/// The alternatives to a first-order lag that the data ask for.
fn alternatives(finding: &Finding) -> String {
    let numbers =
        ["times_ms", "time_errors_ms", "rms_rad_s", "poles_rad_s"].map(|name| finding.numbers(name));
    let at = |column: usize, index: usize| numbers[column].get(index).copied().unwrap_or(f64::NAN);
    let each = finding.texts("effects").iter().enumerate().map(|(index, effect)| {
        format!(
            "`{effect}` of {} ms lowers the error to {:.2} rad/s, with a pole of {:.2} rad/s beside it",
            with_error(at(0, index), at(1, index)),
            at(2, index),
            at(3, index)
        )
    });
    each.collect::<Vec<String>>().join(", ")
}

/// Numbers that are known to little or nothing.
fn of_significance(finding: &Finding) -> Option<String> {
    let (name, unit, more) = match finding.code {
        "voltage_gain_uncertain" => ("k_V =", "rad/(s V)", "hold commands longer, or record a longer PRBS"),
        "pole_uncertain" => ("the pole", "rad/s", "record more jumps, larger ones, or a longer PRBS"),
        "inertia_uncertain" => ("J =", "kg m²", "excite the attitude more, or longer"),
        "pole_not_significant" => {
            return Some(format!(
                "the pole would be {:.2} ± {:.2} rad/s, which is none: the rates do not follow these commands (another rotor's \
                 column, samples too far apart, commands that changed between the rows)",
                finding.number("value"),
                finding.number("error")
            ));
        }
        "voltage_gain_not_significant" => {
            let value = in_digits(finding, "value", "error");
            return Some(format!("k_V would be {value} rad/(s V), which hardly shows: hold commands longer"));
        }
        "inertia_not_significant" => {
            let value = in_digits(finding, "value", "error");
            return Some(format!(
                "J would be {value} kg m², which hardly shows: excite the attitude more, or longer"
            ));
        }
        _ => return None,
    };
    let share = 100.0 * finding.number("error") / finding.number("value").abs();
    let value = in_digits(finding, "value", "error");
    Some(format!("{name} {value} {unit} is known to {share:.0} % only: {more}"))
}

/// What is the template's, and where that is not this bench's.
fn of_template(finding: &Finding) -> Option<String> {
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
            "the pole {} rad/s is the template's, not this bench's: nothing in the logs shows it; record steps or a PRBS",
            short(n("pole_rad_s"))
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
            format!(
                "k_V = {} rad/(s V) is the template's, not this bench's: {shown}{allowed}; hold a command for minutes while the \
                 battery falls, or record a PRBS",
                short(n("template_rad_s_v"))
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
            "J = {:.2e} kg m² is 1/{:.0} of the template's {}; if the body rate is in degrees per second, import it with unit \
             `deg/s`",
            n("inertia_kg_m2"),
            n("template_kg_m2") / n("inertia_kg_m2"),
            n("template_kg_m2")
        ),
        _ => return None,
    })
}

fn of_body(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    Some(match finding.code {
        "too_few_body_samples" => "too few samples of the body rate to identify the inertia".to_owned(),
        "torque_hardly_shows" => format!(
            "the torque hardly shows in the body rate (d/J = {}); excite the attitude more, or check that the body may turn and \
             that its rate has the sign of torque = d (f1 - f2)",
            with_error(n("value"), n("error"))
        ),
        "inertias_disagree" => format!(
            "says J = {:.5} kg m², {} says {:.5}: not the same bench, or something is missing in the body's model",
            n("inertia_kg_m2"),
            finding.text("other_log"),
            n("other_inertia_kg_m2")
        ),
        "body_residual_correlated" => format!(
            "J alone leaves {:.3} rad/s of the body rate's {:.3} unexplained over windows of half a second, and that is far from \
             noise (lag-one correlation {:.2}): something is missing in the body's model, and J carries part of it; `diagnose` \
             looks for it",
            n("rms_rad_s"),
            n("motion_rms_rad_s"),
            n("correlation")
        ),
        "body_torque_omitted" => format!(
            "a torque that goes with {} shows ({:.0} standard errors), and beside it J would be {} kg m²: something is missing in \
             the body's model; J's error allows for it, `diagnose` looks for it",
            finding.text("goes_with"),
            n("standard_errors"),
            with_error(n("inertia_kg_m2"), n("inertia_error_kg_m2"))
        ),
        _ => return None,
    })
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn of_done_steps(finding: &Finding) -> Option<String> {
    let samples = finding.count("samples");
    Some(match finding.code {
        "levels_fitted" => {
            format!(
                "{}, {} left out",
                counted(finding.count("levels"), "level"),
                finding.count("levels_left_out")
            )
        }
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
        "inertia_fitted" => format!("{samples} samples, {}", finding.text("driven_by")),
        _ => return None,
    })
}

fn of_steps_not_done(finding: &Finding) -> Option<String> {
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
        "too_few_jumps" => format!(
            "no log has at least {} jumps of the command: steps or a PRBS excite the pole",
            finding.count("jumps_needed")
        ),
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
