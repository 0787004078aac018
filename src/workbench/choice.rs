//! Which rows and rotors of a log count: what `--from-s`, `--to-s` and `--rotors` say to the commands.

use serde::{Deserialize, Serialize};

use crate::session::OpenConfig;

/// A part of a log; all of it by default.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Choice {
    /// From 1; the first becomes rotor 1 of the log, and so on. Empty = all, as they are.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rotors: Vec<usize>,
    /// [s] only rows from this time on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_s: Option<f64>,
    /// [s] only rows up to this time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to_s: Option<f64>,
}

impl Choice {
    pub fn is_all(&self) -> bool {
        *self == Self::default()
    }

    /// The options of a command that say it.
    pub fn options(&self) -> Vec<String> {
        let rotors: Vec<String> = self.rotors.iter().map(usize::to_string).collect();
        let said = [
            ("--from-s", self.from_s.map(|seconds| seconds.to_string())),
            ("--to-s", self.to_s.map(|seconds| seconds.to_string())),
            ("--rotors", (!rotors.is_empty()).then(|| rotors.join(","))),
        ];
        let given = said.into_iter().filter_map(|(option, value)| Some([option.to_owned(), value?]));
        given.flatten().collect()
    }

    /// The same for the reader of logs.
    pub fn within(&self, config: OpenConfig) -> OpenConfig {
        OpenConfig { rotors: self.rotors.clone(), from_s: self.from_s, to_s: self.to_s, ..config }
    }
}
