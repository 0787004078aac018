//! What a recording knows about its own making: all that is needed to run it again.

use std::collections::BTreeMap;

use crate::clock::{monotonic_ns, realtime_ns};

use super::RecordError;

/// Name of the MCAP metadata record that holds it.
pub const METADATA_NAME: &str = "rotorbench";
/// Version of the recording's layout: topics, schemas, metadata keys.
pub const FORMAT_VERSION: u32 = 1;

/// Texts, seeds and clocks of a recording. They lie in one MCAP metadata record named `rotorbench`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RecordingMetadata {
    /// Which process recorded: `run`, `demo`, `record`, ...
    pub process: String,
    /// The bench file in force, as TOML text with every default written out.
    pub bench: String,
    /// The model in force, as TOML text.
    pub model: String,
    /// The experiment that ran, as TOML text; empty without one.
    pub experiment: String,
    /// Seeds of whatever was random: `emulator`, ...
    pub seeds: BTreeMap<String, u64>,
    /// DBC files by name, as text: what the raw frames mean.
    pub dbc_files: BTreeMap<String, String>,
    /// Name of the bus the raw frames come from.
    pub interface: String,
    /// Version of the program, of the machine's architecture and of its kernel; filled by the recorder.
    pub versions: BTreeMap<String, String>,
    /// [ns] CLOCK_REALTIME at the start; filled by the recorder.
    pub realtime_ns: u64,
    /// [ns] CLOCK_MONOTONIC at the same moment; filled by the recorder.
    pub monotonic_ns: u64,
}

impl RecordingMetadata {
    /// Adds what this machine and this build are, and the time.
    pub(crate) fn stamped(&self) -> Self {
        let kernel = |file: &str| {
            std::fs::read_to_string(format!("/proc/sys/kernel/{file}"))
                .map_or_else(|_| String::new(), |text| text.trim().to_owned())
        };
        let build = if cfg!(debug_assertions) { "debug" } else { "release" };
        let versions = [
            ("rotorbench", env!("CARGO_PKG_VERSION").to_owned()),
            ("build", build.to_owned()),
            ("architecture", std::env::consts::ARCH.to_owned()),
            ("kernel", kernel("osrelease")),
            ("host", kernel("hostname")),
            ("format", FORMAT_VERSION.to_string()),
        ];
        Self {
            versions: versions.into_iter().map(|(name, value)| (name.to_owned(), value)).collect(),
            realtime_ns: realtime_ns(),
            monotonic_ns: monotonic_ns(),
            ..self.clone()
        }
    }

    /// [ns] what a CLOCK_MONOTONIC stamp of this recording is in CLOCK_REALTIME.
    #[must_use]
    pub fn wall_ns(&self, stamp_ns: u64) -> u64 {
        self.realtime_ns.saturating_sub(self.monotonic_ns).saturating_add(stamp_ns)
    }

    pub(crate) fn to_metadata(&self) -> BTreeMap<String, String> {
        let mut map = BTreeMap::from([
            ("process".to_owned(), self.process.clone()),
            ("bench.toml".to_owned(), self.bench.clone()),
            ("model.toml".to_owned(), self.model.clone()),
            ("experiment.toml".to_owned(), self.experiment.clone()),
            ("interface".to_owned(), self.interface.clone()),
            ("realtime_ns".to_owned(), self.realtime_ns.to_string()),
            ("monotonic_ns".to_owned(), self.monotonic_ns.to_string()),
        ]);
        map.extend(self.seeds.iter().map(|(name, seed)| (format!("seed:{name}"), seed.to_string())));
        map.extend(self.dbc_files.iter().map(|(name, text)| (format!("dbc:{name}"), text.clone())));
        map.extend(self.versions.iter().map(|(name, text)| (format!("version:{name}"), text.clone())));
        map
    }

    pub(crate) fn from_metadata(map: &BTreeMap<String, String>) -> Result<Self, RecordError> {
        let text = |name: &str| map.get(name).cloned().unwrap_or_default();
        let number = |name: &str, text: &str| {
            text.parse::<u64>()
                .map_err(|_| RecordError::Metadata { key: name.to_owned(), value: text.to_owned() })
        };
        let below = |prefix: &'static str| {
            map.iter()
                .filter_map(move |(name, value)| Some((name.strip_prefix(prefix)?.to_owned(), value.clone())))
        };
        Ok(Self {
            process: text("process"),
            bench: text("bench.toml"),
            model: text("model.toml"),
            experiment: text("experiment.toml"),
            interface: text("interface"),
            seeds: below("seed:")
                .map(|(name, value)| Ok((name.clone(), number(&name, &value)?)))
                .collect::<Result<_, RecordError>>()?,
            dbc_files: below("dbc:").collect(),
            versions: below("version:").collect(),
            realtime_ns: number("realtime_ns", &text("realtime_ns"))?,
            monotonic_ns: number("monotonic_ns", &text("monotonic_ns"))?,
        })
    }
}
