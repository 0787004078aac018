//! Sentences for what `screening` finds.

mod beside_model;
mod cells;
mod rotor;
mod summary;

use crate::log::betaflight::Betaflight;
use crate::log::dataflash::DataFlash;
use crate::log::format::LogFormat;
use crate::log::signals::log_signal;
use crate::log::ulog::Ulog;
use crate::report::number;
use crate::screening::Finding;
use crate::signal::columns;
use crate::unit::short;

/// The sentence of a finding of this room; `text` says what another finding says, which it rests on.
pub(crate) fn sentence(finding: &Finding, text: fn(&Finding) -> String) -> Option<String> {
    cells::sentence(finding)
        .or_else(|| rotor::sentence(finding))
        .or_else(|| beside_model::sentence(finding))
        .or_else(|| body(finding))
        .or_else(|| body_rows(finding))
        .or_else(|| log(finding, text))
        .or_else(|| summary::sentence(finding))
}

/// Units of rate and angle of the body, and whether it was held.
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
        "body_held_still" => {
            "the body does not move, whatever the torque on it: it was held still, and nothing here tells of it".to_owned()
        }
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

/// What is found in the rows of a body, and of its columns.
fn body_rows(finding: &Finding) -> Option<String> {
    Some(match finding.code {
        "end_stop" => format!(
            "the body stands at {:.3} rad, an end of its travel, from {:.1} to {:.1} s{} while what drives it changes: a stop holds it, \
             and {} samples there are left out",
            finding.number("angle_rad"),
            finding.number("from_s"),
            finding.number("to_s"),
            cells::more_places(finding),
            finding.rows
        ),
        "rate_is_angle_difference" => format!(
            "rate and angle of the body are one measurement: all but {:.0} % of what is new in the rate follows from the angle beside it, \
             {:.0} ms behind it (the rate is a difference of the angle, filtered or not, or the angle was summed up from the rate, as \
             attitude estimators do); nothing is said of a gyro, and what is held against a model is the angle's slope at each row",
            100.0 * finding.number("left_share"),
            finding.number("lag_ms")
        ),
        _ => return None,
    })
}

/// Logs that have no part, or too much of one, and columns that are not read.
fn log(finding: &Finding, said_of: fn(&Finding) -> String) -> Option<String> {
    let text = |name: &str| finding.text(name);
    let said = match finding.code {
        "value_too_great" => format!(
            "`{}` is {:e} at {} s: no bench measures that; leave such cells empty, or `import` with `valid` in the mapping",
            finding.subject,
            finding.number("value"),
            finding.number("at_s")
        ),
        "log_not_used" => format!("not used: {}", reason(finding, said_of)),
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
        "column_of_no_signal" => {
            let columns = finding.texts("columns");
            format!(
                "{} {} of the log format: carried along, not used. Meant: {}?",
                quoted(columns),
                if columns.len() == 1 { "is no signal" } else { "are no signals" },
                finding.texts("meant").iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
            )
        }
        "no_battery_voltage" => {
            "no `battery_voltage_v`: the battery counts as full, and its sag shows as an error".to_owned()
        }
        "body_of_many_rotors" => format!(
            "{} rotors turn this body: it is no attitude bench's, and is left out; if it is, name its two with --rotors",
            finding.count("rotors")
        ),
        "no_common_model" => format!(
            "no one model holds for all rotors: what stands for all is rotor {}'s; each has its own",
            finding.count("rotor")
        ),
        "rotor_differs_from_all" => format!(
            "the model of all rotors leaves {} rad/s of its rates unexplained, its own {} rad/s: take its own \
             model",
            number(finding.number("rms_of_all"), 3),
            number(finding.number("rms_of_own"), 3)
        ),
        "own_model_worse" => format!(
            "its own model leaves {} rad/s of its rates unexplained, that of all rotors {} rad/s: its own was not found right; do \
             not use it",
            number(finding.number("rms_of_own"), 3),
            number(finding.number("rms_of_all"), 3)
        ),
        "rotor_not_identified" => "nothing can be identified of it; --rotors of it alone says why".to_owned(),
        "log_given_twice" => "given twice: it counts double".to_owned(),
        "log_fitted_and_validated" => {
            "judged on what was fitted, every effect looks better than it is; give a log that no fit has seen"
                .to_owned()
        }
        _ => return None,
    };
    Some(said)
}

/// What to do where a channel of no signal may be the command.
fn own_channels(finding: &Finding) -> String {
    let own: Vec<String> =
        finding.texts("columns").iter().filter(|name| log_signal(name).is_none()).cloned().collect();
    match own.len() {
        0 => String::new(),
        1 => format!("; if {} is it, the mapping names it `command_1`, with its unit", quoted(&own)),
        _ => format!("; if one of {} is it, the mapping names it `command_1`, with its unit", quoted(&own)),
    }
}

/// What makes a flight controller log the rates of its rotors.
pub(super) fn rates_of(format: &str) -> &'static str {
    let known: [(&dyn LogFormat, &str); 3] = [
        (
            &Betaflight,
            "; Betaflight logs rates from 4.5 on with `dshot_bidir = ON`, `blackbox_disable_rpm = OFF`",
        ),
        (
            &Ulog,
            "; PX4 logs rates (`esc_status`) by bidirectional DShot (`DSHOT_BIDIR_EN`), a telemetry wire (`DSHOT_TEL_CFG`) or DroneCAN",
        ),
        (
            &DataFlash,
            "; ArduPilot logs rates (`ESC`) by bidirectional DShot (`SERVO_BLH_BDMASK`), a telemetry wire or DroneCAN",
        ),
    ];
    known.iter().find(|(known, _)| known.name() == format).map_or("", |(_, instead)| instead)
}

/// Which rates read nothing but 0, and what to name where another column has them.
fn dead_rates(finding: &Finding) -> String {
    let (dead, instead) = (finding.texts("dead"), finding.texts("instead"));
    let Some(rate) = dead.first() else { return String::new() };
    let read = format!(": {} {} 0 throughout", quoted(dead), if dead.len() == 1 { "reads" } else { "read" });
    if instead.is_empty() {
        return read;
    }
    format!(
        "{read}, and {} {}: if it is the rate, the mapping names its column `{rate}`, with its unit (`rpm`; of electrical turns with \
         `scale` = 1 / pole pairs)",
        quoted(instead),
        if instead.len() == 1 { "does not" } else { "do not" }
    )
}

/// `a`, `b` and `c`.
fn quoted(names: &[String]) -> String {
    let all: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match all.split_last() {
        Some((last, before)) if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => all.concat(),
    }
}

/// Why a log has no part in the result.
fn reason(finding: &Finding, said_of: fn(&Finding) -> String) -> String {
    let holds = || {
        let empty = finding.texts("empty_columns");
        let name = |name: &String| format!("{name}{}", if empty.contains(name) { " (empty)" } else { "" });
        let names: Vec<String> = finding.texts("columns").iter().map(name).collect();
        if names.is_empty() { "nothing but time".to_owned() } else { names.join(", ") }
    };
    if let Some(cause) = finding.cause() {
        return said_of(cause);
    }
    match finding.text("reason") {
        "duplicate" => format!("it holds the same as {}, and would count twice", finding.text("same_as")),
        "no_rows" => "it has a header and no rows".to_owned(),
        "no_commands" => format!(
            "the commands are missing: it has no command_N beside its propeller_rate_N_rad_s; it holds {}{}",
            holds(),
            own_channels(finding)
        ),
        "no_rotor_columns" => {
            // Where rates are there, it is the commands that are not.
            let is_rate = |name: &&String| columns::is_propeller_rate(name);
            let has_rates = finding
                .texts("columns")
                .iter()
                .filter(is_rate)
                .any(|it| !finding.texts("empty_columns").contains(it));
            let instead = if has_rates { "" } else { rates_of(finding.text("format")) };
            format!(
                "it has no command_N with a propeller_rate_N_rad_s beside it; it holds {}{instead}",
                holds()
            )
        }
        "no_rate_under_command" => {
            format!("no rate was measured while a rotor ran under a known command{}", dead_rates(finding))
        }
        _ => format!(
            "{} usable samples over {} s are too few, or nothing is excited in them: k_V and g(u) ask for levels or slow ramps of \
             5 s after settling, the pole for {} jumps of the command at least",
            finding.rows,
            short((100.0 * finding.number("seconds")).round() / 100.0),
            finding.count("fewest_jumps")
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::findings::sentence;

    #[test]
    fn a_finding_names_its_log_and_its_rotor() {
        let finding = Finding::of_rotor("standstill_left_out", 2).of("log.csv").rows(3);
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
    fn a_log_without_commands_asks_for_the_channel_that_may_be_one() {
        let said = |columns: &[&str]| {
            let columns: Vec<String> = columns.iter().map(|name| (*name).to_owned()).collect();
            sentence(&Finding::new("log_not_used", "").with("reason", "no_commands").with("columns", columns))
        };
        assert!(said(&["propeller_rate_1_rad_s"]).ends_with("it holds propeller_rate_1_rad_s"));
        let one = said(&["gas", "propeller_rate_1_rad_s"]);
        assert!(one.ends_with("; if `gas` is it, the mapping names it `command_1`, with its unit"), "{one}");
        assert!(said(&["gas", "note"]).contains("; if one of `gas` and `note` is it"));
    }

    #[test]
    fn rows_of_a_body_that_are_too_far_apart_are_no_levels() {
        let body = Finding::new("samples_too_far_apart", "body_rate_rad_s").with("interval_s", 10.0);
        assert!(
            sentence(&body).ends_with("of a thrust stand, leave the body's columns out"),
            "{}",
            sentence(&body)
        );
        let rotor = Finding::of_rotor("samples_too_far_apart", 1).with("interval_s", 10.0);
        let said = sentence(&rotor.with("most_rows", 200).with("rows_a_level", 3));
        assert!(said.ends_with("give each level up to 3 rows, and a file up to 200"), "{said}");
    }

    #[test]
    fn a_log_whose_rate_reads_nothing_names_the_column_that_moves() {
        let texts = |name: &str| vec![name.to_owned()];
        let finding = || Finding::new("log_not_used", "").with("reason", "no_rate_under_command");
        assert!(sentence(&finding()).ends_with("while a rotor ran under a known command"));
        let dead = finding().with("dead", texts("propeller_rate_1_rad_s"));
        assert!(sentence(&dead).ends_with("a known command: `propeller_rate_1_rad_s` reads 0 throughout"));
        let said = sentence(&dead.with("instead", texts("motor_electrical_speed_rpm")));
        let moves = "reads 0 throughout, and `motor_electrical_speed_rpm` does not: if it is the rate, the mapping names its column";
        assert!(said.contains(moves), "{said}");
    }

    #[test]
    fn a_flight_without_rates_says_what_makes_its_controller_log_them() {
        let said = |format: &'static str| {
            let finding = Finding::new("log_not_used", "").with("reason", "no_rotor_columns");
            sentence(&finding.with("columns", vec!["command_1".to_owned()]).with("format", format))
        };
        for (format, words) in [
            (Betaflight.name(), "with `dshot_bidir = ON`, `blackbox_disable_rpm = OFF`"),
            (Ulog.name(), "PX4 logs rates (`esc_status`) by bidirectional DShot"),
            (DataFlash.name(), "ArduPilot logs rates (`ESC`) by bidirectional DShot"),
        ] {
            assert!(said(format).contains(words), "{}", said(format));
        }
        assert!(said("").ends_with("it holds command_1"), "{}", said(""));
        let lacks_one =
            Finding::new("log_not_used", "").with("reason", "no_rotor_columns").with("format", Ulog.name());
        let held = ["command_2", "propeller_rate_1_rad_s"].map(str::to_owned).to_vec();
        let lacks_one = lacks_one.with("columns", held);
        assert!(
            sentence(&lacks_one).ends_with("it holds command_2, propeller_rate_1_rad_s"),
            "{}",
            sentence(&lacks_one)
        );
        let empty = lacks_one.with("empty_columns", vec!["propeller_rate_1_rad_s".to_owned()]);
        assert!(sentence(&empty).contains("PX4 logs rates"), "{}", sentence(&empty));
    }

    #[test]
    fn columns_that_are_no_signals_are_named_with_what_they_may_mean() {
        let texts = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
        let finding =
            Finding::new("column_of_no_signal", "").with("columns", texts(&["cmd_1", "rotor_speed_1"]));
        let said = sentence(&finding.with("meant", texts(&["command_1", "propeller_rate_1_rad_s"])));
        assert_eq!(
            said,
            "`cmd_1` and `rotor_speed_1` are no signals of the log format: carried along, not used. Meant: `command_1`, \
             `propeller_rate_1_rad_s`?"
        );
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
