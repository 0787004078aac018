//! Sentences for what is found of one rotor's command, rate, thrust and battery.

use super::super::numbers::{counted, digits, settled_between};
use super::cells::more_places;
use crate::screening::Finding;
use crate::unit::{short, with_error};

/// What is found of one rotor's command, rate, thrust and battery.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    let rows = finding.rows;
    let number = |name: &str| finding.number(name);
    let said = match finding.code {
        "samples_too_far_apart" => format!(
            "samples are {:.0} s apart, too far for any rotor or body to be seen moving; if the time is in milliseconds or \
             microseconds, import it with unit `ms` or `us`; {}",
            number("interval_s"),
            // Of a body's rows nobody knows that they are levels.
            if finding.is_of_rotor {
                format!(
                    "if each row is a level of a thrust stand, give each level up to {} rows, and a file up to {}",
                    number("rows_a_level"),
                    number("most_rows")
                )
            } else {
                "if each row is a level of a thrust stand, leave the body's columns out".to_owned()
            }
        ),
        "rows_are_levels" => format!(
            "each of the {rows} rows, {:.0} s apart, is taken as a level at which the rotor had settled: `identify` takes the static \
             curve, k_V and the thrust curve from them; nothing in them shows how the rotor follows its command (pole, delay), so \
             nothing else is fitted to them; if the time is in milliseconds or microseconds, import it with unit `ms` or `us`",
            number("interval_s")
        ),
        "readings_too_seldom" => format!(
            "rates come at {} Hz, {}: {} Hz are the least that show how such a rotor follows, so pole and delay are not fitted to them \
             (PX4: SDLOG_PROFILE; ArduPilot and ESCs: a faster telemetry)",
            digits(number("rate_hz"), 2),
            settled_between(finding),
            digits(number("needed_hz"), 2)
        ),
        "command_out_of_range" => format!(
            "commands reach from {:.4} to {:.4}, but 0 to 1 is expected; scale them with `import` (percent: scale 0.01; \
             microseconds of a servo pulse: scale 0.001, offset -1)",
            number("least"),
            number("greatest")
        ),
        "rate_too_fast" => format!(
            "rates reach {:.0} rad/s ({:.0} rpm); if the column is in rpm, import it with unit `rpm`; if it was, it is electrical rpm: \
             `scale` = 1 / pole pairs beside the unit",
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
        "standstill_left_out" => format!(
            "{rows} samples at commands below {} or within {} s after are left out: a rotor that stands or starts does not follow \
             the model",
            short(number("least_command")),
            short(number("starting_s"))
        ),
        "moves_left_out" => format!(
            "{:.0} % of what its command does is in rows at which it stands or starts, which are left out: a pole, a delay or an answer \
             from the others need not hold there; record steps between commands that turn it",
            100.0 * number("share")
        ),
        "stalled" => format!(
            "the rotor stood from {:.1} to {:.1} s while it was commanded {}{}: it stalled, its speed controller lost it, or it would not \
             start; {rows} samples are left out, from its fall until {} s after it turned again",
            number("from_s"),
            number("to_s"),
            if number("least_command") == number("greatest_command") {
                short(number("least_command"))
            } else {
                format!("{} to {}", short(number("least_command")), short(number("greatest_command")))
            },
            more_places(finding),
            short(number("starting_s"))
        ),
        "command_follows_rate" => format!(
            "a controller makes this command from the rate beside it: what is new in the rate takes the command down with it (a \
             correlation of {:.2} over {} readings); ramps and levels of such a log tell of the controller, too, so no g(u) and no lag are \
             taken from them; switch the controller off and record steps of the command (`rotorbench experiment prbs` drives a bench so); a \
             model from such a log can be held against this one",
            number("correlation"),
            finding.count("readings")
        ),
        "rate_behind_thrust" => format!(
            "the thrust moves {} ms before the rate beside it, and no thrust goes before the rate that makes it: the rate is read late, \
             by that or more (a load cell may be late, too); so much of a delay or lag from command to rate is its reading's, and not \
             the rotor's",
            with_error(1e3 * number("late_s"), 1e3 * number("standard_error_s"))
        ),
        "commands_regulated" => {
            "a controller made the commands of every rotor from its rate: ramps and levels of them are no experiment; switch it off and \
             record a ramp"
                .to_owned()
        }
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
        "steps_between_rows" => format!(
            "commands step between two rows: by the rates, each of {} steps came somewhere in the {} ms before the row that shows it, \
             known to {} ms, and is taken from then on; a delay is known to {} ms at best, for steps are taken to come half a row before their rows \
             on average{}",
            finding.count("steps"),
            digits(1e3 * number("interval_s"), 2),
            digits(1e3 * number("known_to_s"), 2),
            digits(1e3 * number("delay_known_to_s"), 2),
            match rows {
                0 => String::new(),
                _ => format!(
                    "; {} left out, behind steps of which the rates do not say when they came",
                    if rows == 1 { "one sample is".to_owned() } else { format!("{rows} samples are") }
                ),
            }
        ),
        "transient_behind_hole" => format!(
            "{} in the rows {} where or right after the command stepped: when it took effect is not known, so {rows} samples \
             are left out, until {:.0} ms behind the hole ({})",
            counted(finding.count("holes"), "hole"),
            if finding.count("holes") == 1 { "lies" } else { "lie" },
            1e3 * number("settled_s"),
            match finding.count("steps") {
                0 => "no step without a hole says how long rates take to settle".to_owned(),
                steps => format!(
                    "rates need that long to settle, by the {} without a hole",
                    counted(steps, "step")
                ),
            }
        ),
        "commands_missing" => format!(
            "commands come each {} ms, and in {} places one or more are missing ({} rows, {} empty cells): what the rotor was \
             commanded until the next one is not known, so each stretch behind such a place starts anew{}",
            short((1e6 * number("interval_s")).round() / 1e3),
            finding.count("places"),
            finding.count("missing_rows"),
            finding.count("empty_cells"),
            match (finding.count("used"), finding.count("measured")) {
                (_, 0) => String::new(),
                (used, measured) => format!("; {used} of {measured} samples are used"),
            }
        ),
        "battery_reading_gap" => format!(
            "`battery_voltage_v` has no reading between {:.1} and {:.1} s: the one before is taken for all of that time, and k_V \
             and g(u) are off by what the battery did meanwhile; leave that part of the log out",
            number("from_s"),
            number("to_s")
        ),
        "battery_reading_frozen" => format!(
            "`battery_voltage_v` reads exactly {} V from {:.1} to {:.1} s: if that reading froze, k_V and g(u) are off; leave \
             that part of the log out",
            short(number("voltage_v")),
            number("from_s"),
            number("to_s")
        ),
        _ => return None,
    };
    Some(said)
}
