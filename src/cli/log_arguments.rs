//! What every command that reads logs takes beside their names.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use crate::compare::CompareConfig;
use crate::report::shell::quoted;
use crate::session::OpenConfig;

/// Options of logs.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Which log, and which part of it")]
pub struct LogArguments {
    /// What the columns of foreign logs mean: a mapping file, or the name of a shipped mapping (`rcbenchmark`); `import` of a
    /// foreign log shows what they may mean
    #[arg(long, value_name = "FILE|NAME")]
    mapping: Option<String>,
    /// Which log of a file that holds several, from 1; `FILE#N` says it of one file
    #[arg(long, visible_alias = "flight", value_name = "N")]
    part: Option<usize>,
    /// Only rows from this time on [s]
    #[arg(long, value_name = "S")]
    from_s: Option<f64>,
    /// Only rows up to this time [s]
    #[arg(long, value_name = "S")]
    to_s: Option<f64>,
    /// Only these rotors, from 1, such as 3 or 2,4; an attitude bench names its two
    #[arg(long, visible_alias = "rotor", value_name = "N,..", value_delimiter = ',')]
    rotors: Vec<usize>,
    /// Bench file with the DBC files and roles that say what the frames of a capture of the bus mean
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
    /// Only frames of this interface of a capture
    #[arg(long, value_name = "IFACE")]
    interface: Option<String>,
    /// Threads to work on, at most; by default one for each core. The result does not depend on it
    #[arg(long, value_name = "N", help_heading = "How fast")]
    pub(super) threads: Option<NonZeroUsize>,
}

impl LogArguments {
    /// What the session takes of it.
    pub fn open_config(&self) -> OpenConfig {
        OpenConfig {
            mapping: self.mapping.clone(),
            part: self.part,
            bench: self.config.clone(),
            interface: self.interface.clone(),
            from_s: self.from_s,
            to_s: self.to_s,
            rotors: self.rotors.clone(),
            leaves_out: false,
        }
    }

    /// The rotors that were named; empty = all.
    pub fn rotors(&self) -> Vec<usize> {
        self.rotors.clone()
    }

    /// The same for one rotor alone.
    pub fn of_rotor(&self, rotor: usize) -> Self {
        Self { rotors: vec![rotor], ..self.clone() }
    }

    /// Whether a mapping was named.
    pub fn has_mapping(&self) -> bool {
        self.mapping.is_some()
    }

    /// The options as they were typed, each with a blank before it.
    pub fn as_typed(&self) -> String {
        let rotors: Vec<String> = self.rotors.iter().map(usize::to_string).collect();
        let options = [
            ("mapping", self.mapping.clone()),
            ("part", self.part.map(|part| part.to_string())),
            ("from-s", self.from_s.map(|seconds| seconds.to_string())),
            ("to-s", self.to_s.map(|seconds| seconds.to_string())),
            ("rotors", (!rotors.is_empty()).then(|| rotors.join(","))),
            ("config", self.config.as_ref().map(|path| path.display().to_string())),
            ("interface", self.interface.clone()),
        ];
        let given =
            options.into_iter().filter_map(|(name, value)| Some(format!(" --{name} {}", quoted(&value?))));
        given.collect()
    }

    /// Files that are read beside the logs.
    pub fn inputs(&self) -> impl Iterator<Item = PathBuf> {
        self.mapping.iter().map(PathBuf::from).chain(self.config.clone())
    }
}

/// [s] a horizon over which a body can run freely.
pub(super) fn horizon(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    let can_be = CompareConfig::HORIZONS_S.contains(&seconds);
    let [from, to] = [CompareConfig::HORIZONS_S.start(), CompareConfig::HORIZONS_S.end()];
    if can_be { Ok(seconds) } else { Err(format!("must lie in {from}..{to} s")) }
}
