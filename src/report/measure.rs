//! What an error is of, in words.

use serde::Deserialize;
use serde_json::{Value, json};

use crate::model::Measure;

/// What an error is of, in words.
///
/// ```
/// use rotorbench::model::Measure;
/// use rotorbench::report::measure::measure;
///
/// let of = Measure::of_free_runs("body_rate_rad_s", Some(0.4), "rad/s");
/// assert_eq!(measure(&of), "rms of body_rate_rad_s, free run over windows of 0.4 s, initial state fitted [rad/s]");
/// ```
#[must_use]
pub fn measure(of: &Measure) -> String {
    let Measure { channel, unit, free_run, window_s } = of;
    let run = match window_s {
        _ if !free_run => String::new(),
        None => ", free run between holes".to_owned(),
        Some(seconds) => format!(", free run over windows of {seconds} s, initial state fitted"),
    };
    format!("rms of {channel}{run} [{unit}]")
}

/// Says in words what each error in a value is of: a model file has it as a table, answers as a text.
pub fn say_measures(value: &mut Value) {
    match value {
        Value::Array(parts) => parts.iter_mut().for_each(say_measures),
        Value::Object(fields) => {
            if let Some(of) = fields.get_mut("measure").filter(|it| it.is_object())
                && let Ok(it) = Measure::deserialize(&*of)
            {
                *of = json!(measure(&it));
            }
            fields.values_mut().for_each(say_measures);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_say_what_an_error_is_of() {
        let windows = Measure::of_free_runs("body_rate_rad_s", Some(0.4), "rad/s");
        let holes = Measure::of_free_runs("propeller_rate_rad_s", None, "rad/s");
        let mut ladder =
            json!({ "model": { "ladder": [{ "error": { "measure": windows, "noise_floor": 1.0 } }] } });
        say_measures(&mut ladder);
        let windows = "rms of body_rate_rad_s, free run over windows of 0.4 s, initial state fitted [rad/s]";
        assert_eq!(ladder["model"]["ladder"][0]["error"]["measure"], windows);
        assert_eq!(measure(&holes), "rms of propeller_rate_rad_s, free run between holes [rad/s]");
        assert_eq!(measure(&Measure::of_fit("a", "b")), "rms of a [b]");
        let mut other = json!({ "measure": { "of": "something else" }, "rows": [1, "measure"] });
        let before = other.clone();
        say_measures(&mut other);
        assert_eq!(other, before);
    }
}
