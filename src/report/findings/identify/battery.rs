//! Sentences for the voltage that identification takes: full or not, logged or not, fine or coarse.

use crate::screening::Finding;
use crate::unit::short;

/// The sentence of a finding about the battery.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
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
        "voltage_gain_impossible" => format!(
            "k_V = {} rad/(s V) is none that a motor has: {}; the rates drifted with something else while the voltage fell (a motor \
             that warms up, a supply that wanders). Give logs of several charges{}",
            short((1e2 * n("value")).round() / 1e2),
            if n("value") < 0.0 {
                "it would turn faster on an emptier battery".to_owned()
            } else {
                format!(
                    "all of its rate over all of its volts is {} rad/(s V)",
                    short(n("most_rad_s_v").round())
                )
            },
            if finding.number("left_out") == 1.0 {
                "; the model goes without the battery's part"
            } else {
                "; the model takes another estimate of it"
            }
        ),
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
        "battery_quantized" => format!(
            "`battery_voltage_v` is read in steps of {} V, and crosses too few of them to show how it fell: k_V and g(u) may be \
             off by more than their errors say; read it finer, or record a longer discharge",
            short(n("step_v"))
        ),
        _ => return None,
    })
}
