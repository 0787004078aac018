//! Sentences for rates that do not belong to their commands, and rotors that differ.

use super::super::numbers::value_of;
use crate::screening::Finding;
use crate::unit::short;

/// Rates that do not belong to their commands, and rotors that differ.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    let (rotor, other) = (finding.count("rotor"), finding.count("other_rotor"));
    Some(match finding.code {
        "rates_lead_commands" => {
            let (by, left) = match n("rows_earlier") == 1.0 {
                true => ("a row", ""),
                false => ("half a row", ", and leaves a delay of half a row"),
            };
            format!(
                "the rates lead the commands: with each command {by} earlier the error falls from {:.2} to {:.2} rad/s, with a \
                 pole of {:.2} rad/s; the logger writes a command later than it is sent (`rows_later = 1` at the command in a \
                 mapping moves it up by a row{left}; or log each command with the row in which it is sent); until then no \
                 number of this rotor can be trusted",
                n("rms_rad_s"),
                n("rms_earlier_rad_s"),
                n("pole_rad_s")
            )
        }
        "rates_answer_at_once" => format!(
            "each rate is that of the command in its own row, {} ms from the next, as if the rotor followed with a pole of {:.0} rad/s, \
             and no rotor with a propeller comes to {:.0}: where each row is a level at which the rotor had settled (the table of \
             a thrust stand), say `levels = true` in its mapping, in place of a clock; else the rates were reckoned from the commands",
            short(1e3 * n("interval_s")),
            n("pole_rad_s"),
            n("fastest_rad_s")
        ),
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
            "the rates follow the commands with a time constant of {:.0} s (a pole of {:.3} rad/s), and no rotor on a bench is that \
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
