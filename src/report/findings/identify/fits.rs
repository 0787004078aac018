//! Sentences for fits that contradict each other or leave something over, and for numbers known to little or nothing.

use super::super::numbers::in_digits;
use crate::screening::Finding;
use crate::unit::{short, with_error};

/// The sentence of a finding about a fit.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    of_residuals(finding).or_else(|| of_significance(finding))
}

/// A pole that the steps themselves speak against, and what it makes up for.
fn contradicted(finding: &Finding) -> String {
    let n = |name: &str| finding.number(name);
    let pole = format!("a pole of {:.3} rad/s came out, but", n("pole_rad_s"));
    let (up, down) = (n("up_after_s"), n("down_after_s"));
    if up.is_finite() && down.is_finite() {
        return format!(
            "{pole} half of the steps up are 63 % done after {up:.3} s, and half of those down after {down:.3} s: this rotor has two poles, \
             and a fit of one makes up for the other. It is not used; `diagnose --model paper` fits both"
        );
    }
    format!(
        "{pole} the rate has gone 63 % of the way after {:.3} s in half of {} steps: a g(u) that is not of the form of this rotor's curve (a \
         dead zone, a saturation) makes up for its error so. It is not used",
        n("risen_after_s"),
        finding.count("steps")
    )
}

/// Where fits contradict each other or leave something over.
fn of_residuals(finding: &Finding) -> Option<String> {
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
        "pole_contradicts_steps" => contradicted(finding),
        "curve_falls" => format!(
            "g(u) falls between the commands {:.3} and {:.3}, as no rotor does: the model is not one of this rotor there, and \
             controllers refuse it; record levels over the whole range, or give a lower --degree",
            n("lowest_command"),
            n("highest_command")
        ),
        "rates_lead_ramps" => format!(
            "on ramps the rate is {:.0} ms ahead of the command, as no rotor is: the command is made from the rate (by a speed \
             controller), or it is logged late; the curve and the pole are then not the rotor's",
            n("lead_ms")
        ),
        "gain_not_one" => format!(
            "the gain from z to the rate is {:.3} in motion: the static curve does not hold there",
            n("gain")
        ),
        "dead_time_in_model" => format!(
            "the rate answers {} ms late (the rotor does, or its reading is: a load cell or a body beside it tells): the model has `{}` for it, and the pole fitted beside it, {:.3} rad/s; \
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
            "the model leaves {:.1} rad/s of the rates' rms unexplained, a fit of {:.0} %: a controller that made the commands, a curve \
             of another form (`diagnose` tries an offset and a dead zone), outliers, commands that hardly show over the noise, or another \
             bench's log; look at it before the model is used",
            n("rms_rad_s"),
            n("fit_percent")
        ),
        "levels_missed" => format!(
            "held at {:.3} the rates settle at {:.1} rad/s, and the model says {:.1}{}: another `--degree` of g(u), outliers that bent it, or \
             something is missing (`diagnose`)",
            n("command"),
            n("measured_rad_s"),
            n("modelled_rad_s"),
            match finding.count("levels") {
                0 | 1 => String::new(),
                levels => format!(", the worst of {levels} levels that it misses by more than a twentieth"),
            }
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
            "thrust does not rise with the rate, which every propeller's does: was a propeller on, is the sign of the load cell \
             right, and was it set to zero at rest? The template's thrust curve is kept"
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
        "voltage_gain_negative" => {
            let value = in_digits(finding, "value", "error");
            return Some(format!(
                "k_V would be {value} rad/(s V): the rates rose as the voltage fell, which is no battery's doing (the rates drifted, \
                 another load drew on it, or another column is its voltage)"
            ));
        }
        "voltage_gain_of_no_motor" => {
            let value = in_digits(finding, "value", "error");
            let most = short(finding.number("most_rad_s_v").round());
            return Some(format!(
                "k_V would be {value} rad/(s V), which no motor has: all of its rate over all of its volts is {most} rad/(s V)"
            ));
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

#[cfg(test)]
mod tests {
    use crate::report::findings::sentence;
    use crate::screening::Finding;

    /// It shows plainly; holding commands for longer would not change its sign.
    #[test]
    fn a_k_v_of_the_wrong_sign_is_no_matter_of_longer_holds() {
        let found = Finding::new("voltage_gain_negative", "voltage_gain");
        let said = sentence(&found.with("value", -737.0).with("error", 15.8));
        assert!(said.contains("rose as the voltage fell") && !said.contains("longer"), "{said}");
    }
}
