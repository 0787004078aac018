//! What the card of an effect says of it in an answer, and where it is in doubt.

use crate::diagnose::diagnosis::FoundParameter;
use crate::effect::{Card, Law};
use crate::model::Model;

/// Why a law of slow change may be another one: k_V moved with it, the model has no battery (k_V = 0), or its time constant is not
/// known. `None`: it is what its card says.
pub(super) fn in_doubt<'a>(
    (model, voltage_gain_moved): (&Model, bool),
    card: &Card,
    found: impl Iterator<Item = (&'a String, &'a FoundParameter)>,
) -> Option<&'static str> {
    // A lag of a pole is no slow change, however long its state lasts.
    let is_slow = matches!(&card.law, Law::Memory(memory) if memory.slow);
    let time = card.parameters.iter().find(|it| is_slow && it.unit == "s")?;
    let name = format!("{}.{}", card.id, time.name);
    let is_known = |it: &FoundParameter| it.standard_error.is_some_and(|error| error <= 0.5 * it.value.abs());
    let mut times = found.filter(|(it, _)| **it == name);
    if voltage_gain_moved {
        Some("k_V moved with it")
    } else if model.actuator.voltage_gain == 0.0 {
        Some("the model has no battery (k_V = 0)")
    } else {
        times.any(|(_, it)| !is_known(it)).then_some("its time constant is not known")
    }
}

/// What a card says of its effect, or, where that is `in_doubt`, what shows.
pub(super) fn card_sentence(card: &Card, in_doubt: Option<&str>) -> String {
    match in_doubt {
        Some(why) => format!(
            "The rates change slowly over the log, whatever the cause: {why}, so it may be heat, battery or drift."
        ),
        None => card.report[0].to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::find;

    #[test]
    fn a_slow_change_is_heat_only_where_battery_and_time_are_known() {
        let card = find("motor_heating").expect("in the catalogue");
        let said = |gain: f64, moved: bool, error: Option<f64>| {
            let mut model = Model::paper();
            model.actuator.voltage_gain = gain;
            let time = FoundParameter { value: 21.94, standard_error: error, unit: "s".to_owned() };
            let found = [("motor_heating.time_constant".to_owned(), time)];
            let found = found.iter().map(|(name, it)| (name, it));
            card_sentence(card, in_doubt((&model, moved), card, found))
        };
        assert_eq!(said(40.0, false, Some(5.0)), card.report[0]);
        let hedged = |why: &str| {
            format!(
                "The rates change slowly over the log, whatever the cause: {why}, so it may be heat, battery or drift."
            )
        };
        assert_eq!(said(40.0, true, Some(5.0)), hedged("k_V moved with it"));
        assert_eq!(said(0.0, false, Some(5.0)), hedged("the model has no battery (k_V = 0)"));
        assert_eq!(said(40.0, false, Some(11.0)), hedged("its time constant is not known"));
        assert_eq!(said(40.0, false, None), hedged("its time constant is not known"));
        // A second pole is a lag of milliseconds.
        let lag = find("second_order_lag").expect("in the catalogue");
        assert_eq!(in_doubt((&Model::paper(), true), lag, std::iter::empty()), None);
    }
}
