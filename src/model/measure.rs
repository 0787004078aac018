//! What the errors of a ladder are of.

use serde::{Deserialize, Serialize};

/// What an rms error is of. A model file holds it as a table; answers say it in words (`report`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "Written")]
pub struct Measure {
    /// Column of the log, without a rotor's number.
    pub channel: String,
    /// Unit of the error.
    pub unit: String,
    /// Whether it is of a free run, between holes or over windows; else of a fit's own rows.
    pub free_run: bool,
    /// [s] length of the windows, each run from a fitted state; `None`: from hole to hole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window_s: Option<f64>,
}

impl Measure {
    /// Of `channel` [`unit`] over free runs: between holes, or over windows of so many seconds, each from a fitted state.
    #[must_use]
    pub fn of_free_runs(channel: &str, window_s: Option<f64>, unit: &str) -> Self {
        Self { channel: channel.to_owned(), unit: unit.to_owned(), free_run: true, window_s }
    }

    /// Of `channel` [`unit`] where a fit left it.
    #[must_use]
    pub fn of_fit(channel: &str, unit: &str) -> Self {
        Self { channel: channel.to_owned(), unit: unit.to_owned(), free_run: false, window_s: None }
    }
}

/// As a file has it: the table, or the sentence that model files had up to version 0.1.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a table with `channel`, `unit`, `free_run` and, of windows, `window_s`")]
enum Written {
    Table(Table),
    Sentence(String),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    channel: String,
    unit: String,
    free_run: bool,
    window_s: Option<f64>,
}

impl From<Written> for Measure {
    fn from(written: Written) -> Self {
        match written {
            Written::Table(Table { channel, unit, free_run, window_s }) => {
                Self { channel, unit, free_run, window_s }
            }
            Written::Sentence(sentence) => of_sentence(&sentence),
        }
    }
}

/// `rms of CHANNEL[, free run between holes | , free run over windows of S s, initial state fitted] [UNIT]`. Of another one
/// the channel is the sentence, and the unit is empty.
fn of_sentence(sentence: &str) -> Measure {
    let split = || {
        let (said, unit) = sentence.strip_prefix("rms of ")?.strip_suffix(']')?.rsplit_once(" [")?;
        let (channel, run) = said.split_once(", free run ").map_or((said, None), |(it, run)| (it, Some(run)));
        let Some(run) = run else { return Some(Measure::of_fit(channel, unit)) };
        let window_s = match run {
            "between holes" => None,
            over => Some(over.strip_prefix("over windows of ")?.split_once(" s,")?.0.parse().ok()?),
        };
        Some(Measure::of_free_runs(channel, window_s, unit))
    };
    split().unwrap_or_else(|| Measure::of_fit(sentence, ""))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct File {
        measure: Measure,
        after: f64,
    }

    fn read(measure: &str) -> Result<Measure, toml::de::Error> {
        toml::from_str::<File>(&format!("measure = {measure}\nafter = 1.0")).map(|file| file.measure)
    }

    #[test]
    fn sentences_of_earlier_model_files_are_read() {
        let cases = [
            (
                "rms of body_rate_rad_s, free run over windows of 0.4 s, initial state fitted [rad/s]",
                Measure::of_free_runs("body_rate_rad_s", Some(0.4), "rad/s"),
            ),
            (
                "rms of propeller_rate_rad_s, free run between holes [rad/s]",
                Measure::of_free_runs("propeller_rate_rad_s", None, "rad/s"),
            ),
            ("rms of the rotor rate [rad/s]", Measure::of_fit("the rotor rate", "rad/s")),
            ("what somebody wrote", Measure::of_fit("what somebody wrote", "")),
            (
                "rms of a, free run over windows of many s, [b]",
                Measure::of_fit("rms of a, free run over windows of many s, [b]", ""),
            ),
        ];
        for (sentence, expected) in cases {
            assert_eq!(read(&format!("\"{sentence}\"")).expect("a text"), expected);
        }
    }

    #[test]
    fn a_table_is_read_as_it_is_written() {
        let windows = Measure::of_free_runs("body_rate_rad_s", Some(0.25), "rad/s");
        for measure in [windows, Measure::of_free_runs("a", None, "b"), Measure::of_fit("a", "b")] {
            let file = File { measure, after: 2.0 };
            let text = toml::to_string(&file).expect("TOML");
            assert_eq!(toml::from_str::<File>(&text).expect("reads"), file, "{text}");
        }
        let wrong = read("{ channel = \"a\", unit = \"b\", free_run = true, windows_s = 0.4 }")
            .expect_err("a wrong name");
        assert!(wrong.to_string().contains("`window_s`"), "{wrong}");
    }
}
