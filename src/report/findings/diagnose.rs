//! Sentences for what `diagnose` finds.

use crate::model::Model;
use crate::screening::Finding;
use crate::unit::{short, with_error};

/// The sentence of a finding of this room.
pub(crate) fn sentence(finding: &Finding) -> Option<String> {
    let subject = &finding.subject;
    let sentence = match finding.code {
        "searched_on_stretches" => format!(
            "a long log: what is missing was searched for on {} of its {} rows ({}), where most moves; the final fit, the errors of the \
             model and the standard errors are of all rows, those of single candidates are of the stretches",
            finding.count("rows_searched"),
            finding.count("rows_fitted"),
            stretches(finding)
        ),
        "body_not_compared" => {
            "the body is not compared: not every set of logs holds its rate, what drives it, and enough of both".to_owned()
        }
        "not_exciting" => {
            let what = if subject == "torque" { "the torque on the body" } else { "the rotors' commands" };
            format!("{what} hardly changed: these data excite nothing")
        }
        "error_above_floor" => {
            format!("{subject}: the error stays at {:.2} times the noise floor", finding.number("times_floor"))
        }
        "rest_follows_body" => format!(
            "{subject} explains {:.0} % of the torque that is left, and no model of the rotors knows it: a law of {subject} is missing, and what \
             is named may only stand in for that law",
            100.0 * finding.number("share")
        ),
        "base_saw_held_out" => "the model was identified from rows that it is judged on here: where its own numbers stay, the held-out \
                                error is smaller than on rows that nobody has fitted; give another log as `--validate`"
            .to_owned(),
        "parameter_at_bound" => format!(
            "{subject} stands at {}, the end of what it may be: the data would have it go further, so that this number is no \
             measurement, and the effect may stand in for another",
            short(finding.number("value"))
        ),
        "parameter_not_known" => format!(
            "{subject} = {}: these logs show that the effect is there, and not how large this number is",
            with_error(finding.number("value"), finding.number("standard_error"))
        ),
        "error_for_unnamed" => {
            let numbers = finding.texts("numbers").iter().zip(finding.numbers("beside_it"));
            let numbers: Vec<String> =
                numbers.map(|(name, value)| format!("{} would be {}", shown(name), short(*value))).collect();
            format!("with {subject} in the model, too, {}: the ± allows for that", numbers.join(", "))
        }
        "slow_drift" => format!(
            "{:.0} % of what is left is a slow drift of the rates, {:+.2} rad/s each second, cause unknown: nothing in the \
             catalogue may drift that way; a tachometer or a supply that drifts, wear, or weather may",
            100.0 * finding.number("share"),
            finding.number("rad_s_each_second")
        ),
        "one_direction_only" => {
            let (rising, falling) = (finding.count("rising_rows"), finding.count("falling_rows"));
            let (seen, other) = if rising < falling { ("down", "up") } else { ("up", "down") };
            format!(
                "judged almost only on {seen}-steps ({falling} falling, {rising} rising rows): what is said of the rotor holds \
                 for them, and hardly a row shows it step {other}"
            )
        }
        "levels_held" => "the numbers of g(u), and k_V where the model has it, are kept: fitted to two thirds of these rows they miss the \
             other third by more than the model does; of the model's own numbers the pole alone is refitted"
            .to_owned(),
        "no_transients" => "the scored rows of the rotors are at rest: the pole is kept as it is, and effects that show on the way \
             from one level to the next are not tried; log the steps between them, too"
            .to_owned(),
        "delay_or_late_reading" => format!(
            "{subject}: from command to reading a rotor that is commanded late looks like one that is read late, and nothing in these \
             logs tells which; a load cell or a body beside the rate would"
        ),
        "shift_is_curve" => format!(
            "{subject} and the changed numbers of g(u) are one curve: from u = {:.2} to {:.2} it differs from the model's by {:+.1} to \
             {:+.1} rad/s, so no rotor turns {:.0} rad/s {}; what is missing is a bend that the model's g(u) does not have",
            finding.number("from_command"),
            finding.number("to_command"),
            finding.number("least_rad_s"),
            finding.number("greatest_rad_s"),
            finding.number("shift_rad_s").abs(),
            if finding.number("shift_rad_s") < 0.0 { "slower" } else { "faster" }
        ),
        "model_of_other_bench" => format!(
            "the model's rates are {:.0} rad/s off, where the rates themselves vary by {:.0} rad/s: it is not this bench's \
             (`rotorbench identify` makes a model)",
            finding.number("error_rad_s"),
            finding.number("spread_rad_s")
        ),
        "nothing_to_change" => {
            "these logs do not ask for other numbers than the model has; nothing was written".to_owned()
        }
        "turns_against_torque" => format!(
            "the body moves, but not as the torque on it would have it: look whether the {} sign is that of the torque, \
             and whether rotors 1 and 2 are exchanged, before anything else",
            if finding.count("rate_of_angle") > 0 { "angle's" } else { "gyro's" }
        ),
        "battery_or_time" => format!(
            "{subject}: the battery {} steadily in {} ({:+.2} V a minute, {:.0} % of what it does), so battery, heat and drift look \
             the same here; record the same commands again with the battery at another charge and the motor cold: what is the \
             battery's goes with the voltage, what is heat's comes again with the time",
            if finding.number("v_each_minute") < 0.0 { "falls" } else { "rises" },
            if finding.count("logs") == 1 { "this log" } else { "all of these logs" },
            finding.number("v_each_minute"),
            100.0 * finding.number("share")
        ),
        "only_in_training" => format!(
            "{subject}: the error is {:.2} times the noise floor where it was fitted and {:.2} times held out: these logs go \
             where the held-out ones do not, or something happened in them; record more of it, or diagnose all logs without \
             `--validate`",
            finding.number("times_floor"),
            finding.number("held_out_times_floor")
        ),
        "rotors_differ" => format!(
            "rotor {} of {} turns {:.1} % faster at the same commands than rotor {} of {}: a rotor mismatch, or a day on \
             which all turned faster, are no effect of the catalogue; identify each by itself (`identify --rotor`), or diagnose \
             the logs apart",
            finding.count("faster_rotor"),
            finding.text("faster_log"),
            100.0 * finding.number("share"),
            finding.count("slower_rotor"),
            finding.text("slower_log")
        ),
        _ => return None,
    };
    Some(sentence)
}

/// A number's name, with the symbol that stands for it above where it is one of the base's own.
fn shown(name: &str) -> String {
    match Model::base_parameter_unit(name) {
        _ if name.contains('.') => name.to_owned(),
        (_, symbol) => format!("{name} ({symbol})"),
    }
}

/// `1 to 16 s, 100 to 115 s`.
fn stretches(finding: &Finding) -> String {
    let ends = finding.numbers("from_s").iter().zip(finding.numbers("to_s"));
    ends.map(|(from, to)| format!("{from:.0} to {to:.0} s")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_number_would_be_beside_another_effect_is_said_with_its_symbol() {
        let names = ["pole", "slew_rate_limit.rate"].map(str::to_owned).to_vec();
        let finding = Finding::new("error_for_unnamed", "quadratic_rotor_drag");
        let finding = finding.with("numbers", names).with("beside_it", vec![16.0, 2935.6]);
        let said = "with quadratic_rotor_drag in the model, too, pole (p) would be 16, slew_rate_limit.rate would be 2935.6: the ± allows \
                    for that";
        assert_eq!(sentence(&finding).as_deref(), Some(said));
    }
}
