//! Sentences for what `screening` finds.

use crate::screening::Finding;
use crate::unit::short;

/// The sentence of a finding of this room.
pub(crate) fn sentence(finding: &Finding) -> Option<String> {
    cells(finding)
        .or_else(|| rotor(finding))
        .or_else(|| body(finding))
        .or_else(|| log(finding))
        .or_else(|| summary(finding))
}

/// Cells that are no measurements.
fn cells(finding: &Finding) -> Option<String> {
    let (name, rows) = (&finding.subject, finding.rows);
    let number = |name: &str| finding.number(name);
    let said = match finding.code {
        "rate_dropout" => format!(
            "`{name}` reads exactly 0 in {rows} rows in which the rotor was commanded to turn, first at {:.2} s: a dropout of the \
             telemetry, or a rotor that stood; taken as missing",
            number("first_s")
        ),
        "rate_frozen" => format!(
            "`{name}` reads exactly {} rad/s from {:.1} to {:.1} s while the command changes (from {} to {}){}: it was not \
             measured there (a sensor or a recorder that froze, a wrong column, a rotor at its limit); {rows} samples are left \
             out",
            short(number("value")),
            number("from_s"),
            number("to_s"),
            short(number("least_command")),
            short(number("greatest_command")),
            more_places(finding)
        ),
        "battery_dropout" => format!(
            "`{name}`: {rows} readings below {} V or over {} V (the middle one is {} V), which no battery has that turns a rotor: \
             they count as missing",
            short(number("least_v")),
            digits(number("most_v"), 4),
            digits(number("middle_v"), 4)
        ),
        "sample_and_hold" => {
            let (least, most) = (finding.count("least_rows"), finding.count("most_rows"));
            let stands = if least == most {
                format!("every reading stands in {most} rows")
            } else {
                format!("readings stand in {least} to {most} rows")
            };
            format!(
                "`{name}`: {stands} (sample-and-hold), fresh ones come at {} Hz in a log of {} Hz; the {rows} cells that repeat \
                 one are no measurements, and what fits a model takes them as missing",
                digits(number("interval_s").recip(), 3),
                digits(number("log_interval_s").recip(), 3)
            )
        }
        "saturated" => format!(
            "`{name}` is saturated at {}: {rows} of {} readings stand there, and how far it really went is not known; what fits \
             a model takes them as missing, and the reading on either side of each stay there; record with a wider range, or \
             drive less",
            ends(finding),
            finding.count("readings")
        ),
        "gyro_frozen" => format!(
            "`{name}` is frozen from {:.1} to {:.1} s at {}{}: it was not measured there, and what fits a model takes the {rows} \
             readings as missing",
            number("from_s"),
            number("to_s"),
            digits(number("value"), 4),
            more_places(finding)
        ),
        "outliers" => format!(
            "`{name}`: {} far from the neighbours, the first at {:.2} s ({}): no measurements, and what fits a model takes them \
             as missing",
            if rows == 1 { "1 outlier lies".to_owned() } else { format!("{rows} outliers lie") },
            number("first_s"),
            digits(number("first"), 4)
        ),
        "too_many_outliers" => format!(
            "`{name}`: {rows} of {} readings lie far from their neighbours, the first at {:.2} s ({}): too many for single \
             outliers, and they are left in",
            finding.count("readings"),
            number("first_s"),
            digits(number("first"), 4)
        ),
        _ => return None,
    };
    Some(said)
}

/// What is found of one rotor's command, rate, thrust and battery.
fn rotor(finding: &Finding) -> Option<String> {
    let rows = finding.rows;
    let number = |name: &str| finding.number(name);
    let said = match finding.code {
        "samples_too_far_apart" => format!(
            "samples are {:.0} s apart, too far for any rotor or body to be seen moving; if the time is in milliseconds or \
             microseconds, import it with unit `ms` or `us`",
            number("interval_s")
        ),
        "command_out_of_range" => format!(
            "commands reach from {:.4} to {:.4}, but 0 to 1 is expected; scale them with `import` (percent: scale 0.01; \
             microseconds of a servo pulse: scale 0.001, offset -1)",
            number("least"),
            number("greatest")
        ),
        "rate_too_fast" => format!(
            "rates reach {:.0} rad/s ({:.0} rpm); if the column is in rpm, import it with unit `rpm` (electrical rpm of an ESC: \
             scale 1/pole pairs beside it)",
            number("greatest_rad_s"),
            number("greatest_rad_s") * 60.0 / std::f64::consts::TAU
        ),
        "rotor_does_not_turn" => format!(
            "the rotor stands while it is commanded: up to {:.2}, and its rates lie about zero, from {:.1} to {:.1} rad/s; are \
             the command columns those of another rotor? (leave them out, and the other rotor is taken alone)",
            number("greatest_command"),
            number("least_rad_s"),
            number("greatest_rad_s")
        ),
        "rate_negative" => format!(
            "rates are negative down to {:.0} rad/s, but a rotor's command and rate have one sign here; if the column counts the \
             other way round, import it with scale -1",
            number("least_rad_s")
        ),
        "battery_voltage_too_high" => format!(
            "battery voltages from {:.3} to {:.3} V are not those of a battery; {}",
            number("least_v"),
            number("greatest_v"),
            if finding.text("unit") == "mV" {
                "if the column is in millivolts, import it with unit `mV`; in hundredths of a volt, with the scale 0.01"
            } else {
                "a charge in percent is no voltage (leave that column out); tenths of a volt want the scale 0.1 at `import`"
            }
        ),
        "command_saturated" => format!(
            "the command is at its limit {} in {:.0} % of the samples; that a controller asked for more, or that the rotor got \
             less, does not show there{}",
            short(number("at")),
            100.0 * number("share"),
            if finding.count("hides_all") > 0 {
                ", and only what leads there and away excites g(u) and the pole: record again with a smaller amplitude or a \
                 lower operating point, or give only the part of the log that is not at the limit"
            } else {
                ""
            }
        ),
        "battery_not_connected" => format!(
            "`battery_voltage_v` reads {:.2} to {:.2} V, which no battery has that turns a rotor: it is not connected, or it is \
             another column; taken as if no voltage had been measured",
            number("least_v"),
            number("greatest_v")
        ),
        "battery_saturated" => format!(
            "`battery_voltage_v` is saturated at {}: {rows} of {} readings stand there, and what the battery had is not known; \
             taken as if no voltage had been measured; give only the part of the log that is not at the limit",
            finding.numbers("at").iter().map(|at| short(*at)).collect::<Vec<_>>().join(" and "),
            finding.count("readings")
        ),
        "rate_unlike_template" => unlike_template(finding, "rates", "rad/s"),
        "thrust_unlike_template" => unlike_template(finding, "thrusts", "N"),
        "standstill_left_out" => format!(
            "{rows} samples at commands below {} or within {} s after are left out: a rotor that stands or starts does not follow \
             the model",
            short(number("least_command")),
            short(number("starting_s"))
        ),
        "uncommanded_motion" => format!(
            "the command stands still at {:.4} while the rate scatters by {:.0} rad/s ({:.0} %) about its smooth course: it is \
             not this command that moved the rotor (a wrong column, a recorder that froze, the log of something else); {rows} \
             samples, from {:.1} to {:.1} s, are left out",
            number("command"),
            number("scatter_rad_s"),
            100.0 * number("scatter_rad_s") / number("mean_rad_s"),
            number("from_s"),
            number("to_s")
        ),
        "commands_missing" => format!(
            "commands come each {} ms, and in {} places one or more are missing ({} rows, {} empty cells): what the rotor was \
             commanded until the next one is not known, so each stretch behind such a place starts anew; {} of {} samples are \
             used",
            short((1e6 * number("interval_s")).round() / 1e3),
            finding.count("places"),
            finding.count("missing_rows"),
            finding.count("empty_cells"),
            finding.count("used"),
            finding.count("measured")
        ),
        _ => return None,
    };
    Some(said)
}

/// Numbers that are a multiple of what the template's rotor does.
fn unlike_template(finding: &Finding, what: &str, si: &str) -> String {
    let unit = finding.text("unit");
    format!(
        "{what} from {:.4} to {:.4} {si} are {} times what the template's rotor does at these commands; {}",
        finding.number("least"),
        finding.number("greatest"),
        short((1e3 * finding.number("ratio")).round() / 1e3),
        if unit.is_empty() {
            "is the unit of the column right?".to_owned()
        } else {
            format!(
                "if the column is in {unit}, import it with unit `{unit}`; everything in {si} is off by that else"
            )
        }
    )
}

/// Units of rate and angle of the body.
fn body(finding: &Finding) -> Option<String> {
    let (ratio, span) = (finding.number("ratio"), finding.number("angle_span_rad"));
    let said = match finding.code {
        "body_rate_too_fast" if span.is_nan() => format!(
            "the body rate reaches {:.0} rad/s, which no body on a bench does; if the column is in degrees per second, import it \
             with unit `deg/s`",
            finding.number("greatest_rad_s")
        ),
        "body_rate_too_fast" => format!(
            "the body rate reaches {:.0} rad/s, and the angle spans {span:.0} rad; no body on a bench does that; if the columns \
             are in degrees, import them with the units `deg/s` and `deg`",
            finding.number("greatest_rad_s")
        ),
        "body_rate_in_degrees" => format!(
            "the body rate is {ratio:.0} times the slope of the body angle: it is in degrees per second, import it with unit \
             `deg/s`"
        ),
        "time_in_milliseconds" => format!(
            "the body rate is {ratio:.0} times the slope of the body angle: the time is in milliseconds, import it with unit `ms`"
        ),
        "body_angle_in_degrees" => format!(
            "the slope of the body angle is {ratio:.0} times the body rate: the angle is in degrees, import it with unit `deg`"
        ),
        "body_turns_over" => format!(
            "the body angle spans {span:.1} rad, {:.1} turns; if angle and rate are in degrees, import them with the units `deg` \
             and `deg/s`",
            span / std::f64::consts::TAU
        ),
        _ => return None,
    };
    let inertia = match finding.text("inertia") {
        "not_identified" => "; J is not identified from this log",
        "holds" => "; J comes from the rate and holds",
        "too_small" => ": J comes out 57 times too small otherwise",
        _ => "",
    };
    Some(said + inertia)
}

/// Logs that have no part, or too much of one, and columns that are not read.
fn log(finding: &Finding) -> Option<String> {
    let text = |name: &str| finding.text(name);
    let said = match finding.code {
        "log_not_used" => format!("not used: {}", reason(finding)),
        "validation_log_was_fitted" => {
            let same = if finding.log == text("same_as") {
                "it was".to_owned()
            } else {
                format!("it holds the same as {}, which was", text("same_as"))
            };
            format!("not validated on: {same} fitted to, and its error says nothing of other logs")
        }
        "column_without_unit" => format!(
            "`{}` is not read, for its name does not say its unit: the log format has `{}` for {}; name it so if it is in {}, \
             else import it with its unit",
            finding.subject,
            text("expected"),
            text("meaning"),
            text("expected_unit")
        ),
        "column_in_another_unit" => format!(
            "`{}` is not read: the log format has `{}` for {}, in {}; import it with unit `{}`",
            finding.subject,
            text("expected"),
            text("meaning"),
            text("expected_unit"),
            text("unit")
        ),
        "no_battery_voltage" => {
            "no `battery_voltage_v`: the battery counts as full, and its sag shows as an error".to_owned()
        }
        "log_given_twice" => "given twice: it counts double".to_owned(),
        "log_fitted_and_validated" => {
            "fitted on and judged on: its held-out error is none, and every effect looks better than it is"
                .to_owned()
        }
        _ => return None,
    };
    Some(said)
}

/// Why a log has no part in the result.
fn reason(finding: &Finding) -> String {
    let holds = || {
        let empty = finding.texts("empty_columns");
        let name = |name: &String| format!("{name}{}", if empty.contains(name) { " (empty)" } else { "" });
        let names: Vec<String> = finding.texts("columns").iter().map(name).collect();
        if names.is_empty() { "nothing but time".to_owned() } else { names.join(", ") }
    };
    if let Some(cause) = finding.cause() {
        return super::text(cause);
    }
    match finding.text("reason") {
        "duplicate" => format!("it holds the same as {}, and would count twice", finding.text("same_as")),
        "no_rows" => "it has a header and no rows".to_owned(),
        "no_commands" => format!(
            "the commands are missing: it has no command_N beside its propeller_rate_N_rad_s; it holds {}",
            holds()
        ),
        "no_rotor_columns" => {
            format!("it has no command_N with a propeller_rate_N_rad_s beside it; it holds {}", holds())
        }
        "no_rate_under_command" => "no rate was measured while a rotor ran under a known command".to_owned(),
        _ => format!(
            "{} usable samples over {} s are too few, or nothing is excited in them: k_V and g(u) ask for levels or slow ramps of \
             5 s after settling, the pole for {} jumps of the command at least",
            finding.rows,
            short((100.0 * finding.number("seconds")).round() / 100.0),
            finding.count("fewest_jumps")
        ),
    }
}

/// What a log looks like.
fn summary(finding: &Finding) -> Option<String> {
    let (name, count) = (&finding.subject, finding.count("count"));
    let number = |name: &str| finding.number(name);
    let said = match finding.code {
        "holes" => format!(
            "{} in time (rows are {:.1} ms apart, the longest hole is {:.0} ms): {} at up-steps of a command, {} at down-steps",
            counted(count, "hole"),
            1e3 * number("interval_s"),
            1e3 * number("longest_s"),
            finding.count("at_up_steps"),
            finding.count("at_down_steps")
        ),
        "starts_from_standstill" => format!(
            "{} from standstill, the first at {:.3} s: what happens there is not in the model's range",
            counted(count, "start"),
            number("first_s")
        ),
        "constant" => format!("`{name}` is {} throughout", short(number("value"))),
        "perhaps_frozen" => format!(
            "`{name}` is frozen {}, longest for {:.3} s from {:.3} s at {}",
            counted(count, "time"),
            number("longest_s"),
            number("from_s"),
            short(number("value"))
        ),
        "perhaps_saturated" => format!(
            "`{name}` is saturated at {}: {} samples stand there",
            short(number("at")),
            finding.count("samples")
        ),
        "dropouts" => format!(
            "`{name}` drops out {}, longest for {:.3} s from {:.3} s",
            counted(count, "time"),
            number("longest_s"),
            number("from_s")
        ),
        _ => return None,
    };
    Some(said)
}

fn more_places(finding: &Finding) -> String {
    match finding.count("places") {
        0 | 1 => String::new(),
        places => format!(", and in {} more places", places - 1),
    }
}

/// The ends of a range at which a channel is saturated.
fn ends(finding: &Finding) -> String {
    finding.numbers("at").iter().map(|at| digits(*at, 4)).collect::<Vec<_>>().join(" and ")
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// A number for people: so many digits of it.
fn digits(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let scale = 10f64.powi(digits - 1 - value.abs().log10().floor() as i32);
    short((value * scale).round() / scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::findings::sentence;

    #[test]
    fn a_finding_names_its_log_and_its_rotor() {
        let finding = Finding::new("standstill_left_out", "rotor 2").of("log.csv").rows(3);
        let said = sentence(&finding.with("least_command", 0.05).with("starting_s", 0.5));
        assert!(
            said.starts_with("log.csv, rotor 2: 3 samples at commands below 0.05 or within 0.5 s after"),
            "{said}"
        );
    }

    #[test]
    fn a_log_that_is_not_used_says_why() {
        let cause =
            Finding::new("body_rate_too_fast", "body_rate_rad_s").of("a.csv").with("greatest_rad_s", 90.0);
        let said = sentence(&Finding::new("log_not_used", "").of("a.csv").because(cause));
        assert!(said.starts_with("a.csv: not used: the body rate reaches 90 rad/s, which no body"), "{said}");
    }

    #[test]
    fn how_often_readings_come_is_said_in_hertz() {
        let finding = Finding::new("sample_and_hold", "propeller_rate_1_rad_s").rows(3000);
        let finding = finding.with("least_rows", 1).with("most_rows", 2).with("interval_s", 0.03);
        let said = sentence(&finding.with("log_interval_s", 0.02));
        assert!(said.contains("readings stand in 1 to 2 rows"), "{said}");
        assert!(said.contains("fresh ones come at 33.3 Hz in a log of 50 Hz"), "{said}");
    }
}
