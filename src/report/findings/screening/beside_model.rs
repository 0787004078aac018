//! Sentences for columns that, beside a model, can hardly be what their names say.

use crate::screening::Finding;
use crate::unit::short;

/// Columns that can hardly be what their names say.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    let unit = finding.text("unit");
    Some(match finding.code {
        "rate_in_other_unit" => format!(
            "rates from {:.4} to {:.4} rad/s are {} times what the model's rotor does at these commands, as {unit} are; if the \
             column is in {unit}, import it with unit `{unit}`{}; if it is another rotor, make its model first (`rotorbench \
             identify`)",
            n("least"),
            n("greatest"),
            short((1e3 * n("ratio")).round() / 1e3),
            electrical(n("ratio"))
        ),
        "battery_in_other_unit" => format!(
            "battery voltages from {:.3} to {:.3} V are not those of the model's battery, which has {:.1} V when full; {}; if it \
             is another battery, make its model first (`rotorbench identify --full-voltage-v {:.1}`)",
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
            },
            n("highest_v")
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

/// What more a rate may be that is `ratio` times what is expected: an ESC counts pole pairs times the rotor's turns.
pub(super) fn electrical(ratio: f64) -> &'static str {
    if ratio > 1.0 {
        "; if it was, is it electrical rpm? `scale` = 1 / pole pairs beside the unit"
    } else {
        ""
    }
}
