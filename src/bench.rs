//! The bench file: one TOML that every process of a bench reads. Each table belongs to the room that
//! uses it; this room only puts them together and checks what spans several.

pub mod thresholds;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::can::BusConfig;
use crate::control::ControllerConfig;
use crate::emulate::EmulatorConfig;
use crate::file::{SettingsKind, line_and_column, read_settings_text, settings_kind, toml_reason};
use crate::guard::GuardConfig;
use crate::rt::RealTimeConfig;
use crate::shm::{BenchPlace, SharedMemoryConfig, ShmError};
use crate::signal::Sensor;

use thresholds::THRESHOLDS;

/// What starts a control step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StepTrigger {
    /// The paper's fixed T_c: an absolute-time grid.
    #[default]
    Timer,
    /// The arrival of the IMU frame.
    Imu,
}

/// The bench file.
///
/// ```
/// use rotorbench::bench::BenchConfig;
///
/// let bench: BenchConfig = toml::from_str("name = \"pitch\"\nperiod_s = 0.01")?;
/// bench.check()?;
/// assert_eq!((bench.period_s, bench.guard.rotor_maximum), (0.01, BenchConfig::default().guard.rotor_maximum));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BenchConfig {
    /// Name of the bench: prefix of its shared-memory services, so that two benches never meet.
    pub name: String,
    /// [s] control period T_c. [LPC16] Table IV.
    pub period_s: f64,
    /// What starts a control step.
    pub trigger: StepTrigger,
    /// Model file, or `paper` for the built-in Tables I and IV.
    pub model: String,
    /// Real-time settings.
    pub real_time: RealTimeConfig,
    /// Who may open the bench's services.
    pub shared_memory: SharedMemoryConfig,
    /// Controller, its gains and its reference.
    pub controller: ControllerConfig,
    /// Guard limits.
    pub guard: GuardConfig,
    /// CAN bus, DBC files and roles of signals.
    pub bus: BusConfig,
    /// The plant emulator.
    pub emulator: EmulatorConfig,
}

/// What is wrong with a bench file as a whole; what is wrong inside a table, that table's room says.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The file cannot be read.
    #[error("bench file {}: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: std::io::Error,
    },
    /// The file is not a bench file.
    #[error("{}, line {line}, column {column}: {reason}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong there.
        reason: String,
    },
    /// The other kind of file.
    #[error(
        "{} is a model, and a bench file is wanted here (`rotorbench check --template` writes one); models go to `--model`, or into \
         the bench file as `model = \"{}\"`", path.display(), path.display()
    )]
    IsModel {
        /// The file.
        path: PathBuf,
    },
    /// What the columns of a log mean.
    #[error(
        "{} is a mapping, and a bench file is wanted here (`rotorbench check --template` writes one); mappings go to `--mapping`",
        path.display()
    )]
    IsMapping {
        /// The file.
        path: PathBuf,
    },
    /// No file of settings at all.
    #[error(
        "{} is a log, and a bench file is wanted here (`rotorbench check --template` writes one); logs go to `--log`", path.display()
    )]
    IsLog {
        /// The file.
        path: PathBuf,
    },
    /// The period cannot be kept, or is no number.
    #[error("period_s: {} is outside {SHORTEST_PERIOD_S}..{LONGEST_PERIOD_S} s", crate::unit::short(*period_s))]
    Period {
        /// What was found.
        period_s: f64,
    },
    /// The name of the bench cannot be one.
    #[error(transparent)]
    Name(#[from] ShmError),
    /// The reference leads where the guard takes no angle for good.
    #[error(
        "controller.reference: {} rad is outside {}..{} rad, where the guard takes body_angle for good (guard.body_angle)",
        crate::unit::short(*angle_rad), crate::unit::short(*minimum_rad), crate::unit::short(*maximum_rad)
    )]
    Reference {
        /// [rad] what was found.
        angle_rad: f64,
        /// [rad] lowest.
        minimum_rad: f64,
        /// [rad] highest.
        maximum_rad: f64,
    },
}

const SHORTEST_PERIOD_S: f64 = THRESHOLDS.shortest_period_s;
const LONGEST_PERIOD_S: f64 = THRESHOLDS.longest_period_s;

impl BenchConfig {
    /// The bench file at `path`, or the bench that is built in.
    ///
    /// # Errors
    /// [`BenchError`] with the place.
    pub fn load(path: Option<&Path>) -> Result<Self, BenchError> {
        let Some(path) = path else { return Ok(Self::default()) };
        let text =
            read_settings_text(path).map_err(|error| BenchError::Read { path: path.to_owned(), error })?;
        let mut config = Self::parse(&text, path)?;
        config.resolve_paths(path.parent().unwrap_or(Path::new("")));
        Ok(config)
    }

    /// The bench file with the content `text`; `path` is for the errors.
    ///
    /// # Errors
    /// [`BenchError`] with the place.
    pub fn parse(text: &str, path: &Path) -> Result<Self, BenchError> {
        let config: Self = toml::from_str(text).map_err(|error| {
            let path = path.to_owned();
            let (line, column) = line_and_column(text, error.span().map_or(0, |span| span.start));
            match settings_kind(text) {
                Some(SettingsKind::Model) => BenchError::IsModel { path },
                Some(SettingsKind::Mapping) => BenchError::IsMapping { path },
                Some(SettingsKind::Log) => BenchError::IsLog { path },
                _ => BenchError::Parse { path, line, column, reason: toml_reason(text, &error) },
            }
        })?;
        config.check()?;
        Ok(config)
    }

    /// Checks what no single table can.
    ///
    /// # Errors
    /// [`BenchError`] with what was found.
    pub fn check(&self) -> Result<(), BenchError> {
        BenchPlace::check_name(&self.name)?;
        if !(SHORTEST_PERIOD_S..=LONGEST_PERIOD_S).contains(&self.period_s) {
            return Err(BenchError::Period { period_s: self.period_s });
        }
        self.check_reference()
    }

    /// What is not a number is the controller's to refuse.
    fn check_reference(&self) -> Result<(), BenchError> {
        let Some(row) = Sensor::BodyAngle.guard() else { return Ok(()) };
        let limits = &self.guard.body_angle;
        let [minimum_rad, maximum_rad] =
            [limits.minimum.unwrap_or(row.range.0), limits.maximum.unwrap_or(row.range.1)];
        let reference = &self.controller.reference;
        let mut angles =
            std::iter::once(reference.angle_rad).chain(reference.moves.iter().map(|it| it.angle_rad));
        let outside =
            angles.find(|angle| angle.is_finite() && (*angle < minimum_rad || *angle > maximum_rad));
        outside.map_or(Ok(()), |angle_rad| Err(BenchError::Reference { angle_rad, minimum_rad, maximum_rad }))
    }

    /// Holds the emulated body still, as experiments on the rotors do. Nothing is controlled by its gyro then, and that it reads
    /// the same is no fault: unless the file says otherwise, the guard does not take it for frozen. The built-in
    /// bench's gyro reads the same seven times on end, which is frozen at 50 Hz, by chance alone every 17 h.
    pub fn hold_body(&mut self) {
        self.emulator.plant.clamped = true;
        self.guard.body_rate.frozen_after_s.get_or_insert(0.0);
    }

    /// The emulated bench as it is run: its ESCs have the timeout of those that speak what its bus does, unless the file says one.
    #[must_use]
    pub fn emulator(&self) -> EmulatorConfig {
        self.emulator.clone().completed(self.bus.protocol.esc_timeout_s())
    }

    /// Files named in a bench file are found from where the bench file is.
    fn resolve_paths(&mut self, folder: &Path) {
        let resolve = |file: &mut String| {
            if Path::new(file.as_str()).extension().is_some() && !Path::new(file.as_str()).is_absolute() {
                *file = folder.join(file.as_str()).to_string_lossy().into_owned();
            }
        };
        resolve(&mut self.model);
        self.bus.file_names().for_each(resolve);
    }
}

impl Default for BenchConfig {
    fn default() -> Self {
        Self {
            name: "bench".to_owned(),
            period_s: 0.02,
            trigger: StepTrigger::default(),
            model: "paper".to_owned(),
            real_time: RealTimeConfig::default(),
            shared_memory: SharedMemoryConfig::default(),
            controller: ControllerConfig::default(),
            guard: GuardConfig::default(),
            bus: BusConfig::default(),
            emulator: EmulatorConfig::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn refused(text: &str) -> String {
        BenchConfig::parse(text, Path::new("bench.toml")).expect_err("refused").to_string()
    }

    #[test]
    fn the_built_in_bench_is_written_and_read_back() {
        let built_in = BenchConfig::default();
        built_in.check().expect("valid");
        let text = toml::to_string(&built_in).expect("written");
        assert_eq!(BenchConfig::parse(&text, Path::new("bench.toml")).expect("read"), built_in);
    }

    #[test]
    fn an_error_names_file_line_and_column() {
        assert!(
            refused("period_s = 0.02\n  nmae = 'x'\n")
                .starts_with("bench.toml, line 2, column 3: unknown field `nmae`")
        );
        assert!(refused("period_s = \n").starts_with("bench.toml, line 1, column 12"));
        assert!(refused("trigger = 'gyro'").contains("line 1, column 11: unknown variant `gyro`"));
        assert!(refused("[real_time]\npriority = 300").contains("line 2, column 12"));
        for period in ["0.0", "-0.02", "nan", "inf", "1.5"] {
            let sentence = refused(&format!("period_s = {period}"));
            assert!(sentence.starts_with("period_s: "), "{sentence}");
        }
    }

    #[test]
    fn a_decimal_comma_is_called_one() {
        let said = refused("period_s = 0,02");
        assert!(said.ends_with("; a decimal comma? write 0.02"), "{said}");
        assert!(refused("[guard]\nhold_s = -12,5 # [s]").ends_with("write -12.5"), "with its sign");
        for other in ["period_s = 0.02, 3", "[controller.emc]\nfeedback_gain = [1,2,3", "name = \"a\",5"] {
            assert!(!refused(other).contains("decimal comma"), "{other}");
        }
    }

    #[test]
    fn a_model_is_called_one() {
        let model = crate::model::Model::paper().emit().expect("written");
        let said = refused(&model);
        assert!(said.starts_with("bench.toml is a model, and a bench file is wanted here"), "{said}");
    }

    #[test]
    fn a_log_is_called_one() {
        let said = refused("time_s,command_1\n0,0.5\n");
        assert!(said.starts_with("bench.toml is a log, and a bench file is wanted here"), "{said}");
        assert!(refused("period_s = 0,02").contains("decimal comma"), "a comma alone makes no log");
    }

    #[test]
    fn a_reference_stays_where_the_guard_takes_the_angle_for_good() {
        let of = |angle: &str, guard: &str| format!("[controller.reference]\nangle_rad = {angle}\n{guard}");
        for far in ["4e9", "-3.3"] {
            let sentence = refused(&of(far, ""));
            assert!(sentence.contains("is outside -3.2..3.2 rad"), "{sentence}");
        }
        let moves = "[[controller.reference.moves]]\nat_s = 1.0\nangle_rad = 7.0\n";
        assert!(refused(moves).contains("7 rad is outside"));
        let wide = of("7.0", "[guard.body_angle]\nmaximum = 10.0\n");
        assert!(
            BenchConfig::parse(&wide, Path::new("bench.toml")).is_ok(),
            "a bench that turns over says so"
        );
    }

    #[test]
    fn a_name_that_cannot_be_one_is_refused_by_all() {
        assert!(refused("name = '../bench'").contains("cannot name a bench"));
    }

    #[test]
    fn files_are_found_from_the_bench_file() {
        let mut config = BenchConfig { model: "fitted.toml".to_owned(), ..BenchConfig::default() };
        let built_in = config.bus.database.clone();
        config.resolve_paths(Path::new("/benches/one"));
        assert_eq!(config.model, "/benches/one/fitted.toml");
        assert_eq!(config.bus.database, built_in, "names of built-in files stay");
    }

    proptest! {
        /// Fuzz of the loader: any text is read or refused, never a panic.
        #[test]
        fn any_text_is_read_or_refused(text in "\\PC{0,200}") {
            let _ = BenchConfig::parse(&text, Path::new("bench.toml"));
        }

        /// The same on texts that look like a bench file.
        #[test]
        fn any_likely_text_is_read_or_refused(
            key in "(name|period_s|trigger|real_time|guard|bus|emulator|controller)(\\.[a-z_]{1,12})?",
            value in "(-?[0-9]{1,20}(\\.[0-9]{1,5})?|'[a-z]{0,40}'|\\[\\]|\\{\\}|nan|inf|true)",
        ) {
            let _ = BenchConfig::parse(&format!("{key} = {value}\n"), Path::new("bench.toml"));
        }
    }
}
