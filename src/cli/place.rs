//! Where in the bench file the setting stands that an error speaks of.
//!
//! The rooms check their own tables and name the key; which file the table came from they do not know. Here the two are
//! put together, at the one door through which every error leaves.

use std::error::Error;
use std::path::Path;

use toml::de::{DeTable, DeValue};

use crate::bench::BenchError;
use crate::can::CanError;
use crate::control::ControlError;
use crate::emulate::EmulateError;
use crate::file::line_and_column;
use crate::guard::GuardError;
use crate::rt::RealTimeError;
use crate::runtime::ProcessError;
use crate::session::{ReplayError, SessionError};
use crate::shm::ShmError;

/// A setting of the bench file, as an error names it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// The keys it may be, each from the file's top: rooms do not know in which of their tables a number stood.
    keys: Vec<String>,
    /// Whether the file is to blame, though it has none of the keys: something is missing there, or a default does not
    /// go with what is written.
    blames_file: bool,
}

impl Setting {
    /// One key; what it says, or that it is not there, is the file's fault.
    fn one(key: impl Into<String>) -> Option<Self> {
        Some(Self { keys: vec![key.into()], blames_file: true })
    }

    /// What an error speaks of, where it speaks of the bench file and does not say which.
    pub fn of(error: &(dyn Error + 'static)) -> Option<Self> {
        // Transparent to its sources, but not to a downcast.
        if let Some(error) = error.downcast_ref::<ProcessError>() {
            return match error {
                ProcessError::Bench(error) => Self::of(error),
                ProcessError::Can(error) => Self::of(error),
                ProcessError::Control(error) => Self::of(error),
                ProcessError::Emulate(error) => Self::of(error),
                ProcessError::Guard(error) => Self::of(error),
                ProcessError::Shm(error) => Self::of(error),
                ProcessError::RealTime(error) => Self::of(error),
                // A command may have been given another one by an option.
                ProcessError::Plant { .. } => Some(Self { blames_file: false, ..Self::one("model")? }),
                _ => None,
            };
        }
        match error.downcast_ref::<SessionError>() {
            Some(SessionError::Bench(error)) => return Self::of(error),
            Some(SessionError::Can(error)) => return Self::of(error),
            _ => {}
        }
        match error.downcast_ref::<ReplayError>() {
            Some(ReplayError::Bench(error)) => return Self::of(error),
            Some(ReplayError::Process(error)) => return Self::of(error),
            _ => {}
        }
        match error.downcast_ref() {
            Some(BenchError::Period { .. }) => return Self::one("period_s"),
            Some(BenchError::Reference { .. }) => return Self::one("controller.reference"),
            Some(BenchError::Name(error)) => return Self::of(error),
            _ => {}
        }
        error
            .downcast_ref()
            .and_then(Self::of_bus)
            .or_else(|| error.downcast_ref().and_then(Self::of_controller))
            .or_else(|| error.downcast_ref().and_then(Self::of_emulator))
            .or_else(|| error.downcast_ref().and_then(Self::of_guard))
            .or_else(|| error.downcast_ref().and_then(Self::of_machine))
            .or_else(|| error.downcast_ref().and_then(Self::of_shared_memory))
    }

    fn of_bus(error: &CanError) -> Option<Self> {
        match error {
            CanError::Role { place, .. } => Self::one(format!("bus.{place}")),
            CanError::Overload { .. } => Self::one("bus.bit_rate"),
            CanError::Read { .. } => Some(Self { blames_file: false, ..Self::one("bus.database")? }),
            // A command may have been given another one by an option.
            CanError::Interface { .. } | CanError::Socket { .. } => {
                Some(Self { blames_file: false, ..Self::one("bus.interface")? })
            }
            // These name the DBC file, which is the one that is wrong.
            CanError::Syntax { .. } | CanError::Database { .. } => None,
        }
    }

    /// A controller is also made of the numbers of a model, which is another file.
    fn of_controller(error: &ControlError) -> Option<Self> {
        let keys = match error {
            ControlError::Parameter { name: "period_s", .. } => return Self::one("period_s"),
            ControlError::Parameter { name, .. } => ["controller", "controller.emc", "controller.pid"]
                .map(|table| format!("{table}.{name}"))
                .into(),
            ControlError::Move { .. } => vec!["controller.reference.moves".to_owned()],
            ControlError::Falls { .. } => vec!["model".to_owned()],
            ControlError::Unreachable { .. } => vec!["controller.pid".to_owned()],
            ControlError::Unstable { .. } => vec!["controller.emc".to_owned(), "controller".to_owned()],
        };
        Some(Self { keys, blames_file: false })
    }

    fn of_emulator(error: &EmulateError) -> Option<Self> {
        let key = match error {
            EmulateError::NotPositive { name, .. }
            | EmulateError::Negative { name, .. }
            | EmulateError::Range { name, .. } => {
                let keys = ["emulator", "emulator.plant"].map(|table| format!("{table}.{name}"));
                return Some(Self { keys: keys.into(), blames_file: true });
            }
            EmulateError::Curve => "emulator.plant.steady_rate".to_owned(),
            EmulateError::Sensor { name, .. } => format!("emulator.sensors.{name}"),
            // Or of an option of the command.
            EmulateError::Hidden { .. } => {
                return Some(Self { keys: vec!["emulator.hidden".to_owned()], blames_file: false });
            }
        };
        Self::one(key)
    }

    fn of_guard(error: &GuardError) -> Option<Self> {
        match error {
            GuardError::Setting { key, .. } => Self::one(key),
            GuardError::SpeedCheck(_) => Self::one("guard.speed_check"),
        }
    }

    fn of_machine(error: &RealTimeError) -> Option<Self> {
        match error {
            RealTimeError::Priority { .. } => Self::one("real_time.priority"),
            RealTimeError::Missing { .. } => Self::one("real_time.required"),
        }
    }

    fn of_shared_memory(error: &ShmError) -> Option<Self> {
        match error {
            ShmError::Name { .. } => Self::one("name"),
            ShmError::Group { .. } => Self::one("shared_memory.group"),
            _ => None,
        }
    }

    /// The place of the setting in the bench file at `path` with the content `text`: with its line, where it or the table
    /// that lacks it is written there. `None` when the file has nothing to do with it.
    pub fn place(&self, path: &Path, text: &str) -> Option<String> {
        let file = path.display();
        let written = DeTable::parse(text).ok()?;
        let found = |key: &String| find(written.get_ref(), key);
        let exact = self.keys.iter().filter_map(found).find(|found| found.is_all);
        if exact.is_none() && !self.blames_file {
            return None;
        }
        let nearest = exact.or_else(|| self.keys.iter().filter_map(found).max_by_key(|found| found.at));
        Some(match nearest {
            Some(Found { at, .. }) => format!("{file}, line {}", line_and_column(text, at).0),
            None => file.to_string(),
        })
    }
}

/// As much of a key as is written.
struct Found {
    /// Byte where it begins.
    at: usize,
    /// Whether that is all of it.
    is_all: bool,
}

/// Follows `key` into `table`. An array of tables is followed where it has only one, and else is the place itself.
fn find(table: &DeTable<'_>, key: &str) -> Option<Found> {
    let (first, rest) = key.split_once('.').map_or((key, None), |(first, rest)| (first, Some(rest)));
    let (name, value) = table.iter().find(|(name, _)| name.get_ref() == first)?;
    let here = |is_all| Found { at: name.span().start, is_all };
    let Some(rest) = rest else { return Some(here(true)) };
    let inner = match value.get_ref() {
        DeValue::Table(inner) => inner,
        DeValue::Array(items) => match (items.first().map(toml::Spanned::get_ref), items.len()) {
            (Some(DeValue::Table(inner)), 1) => inner,
            _ => return Some(here(true)),
        },
        _ => return Some(here(false)),
    };
    Some(find(inner, rest).unwrap_or_else(|| here(false)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::BenchConfig;
    use crate::can::Roles;
    use crate::runtime::{controller_plant, emulate};
    use crate::shm::BenchPlace;

    /// What `check` and the processes find wrong with a bench file, as its user reads it.
    fn said_of(text: &str) -> String {
        let path = Path::new("bench.toml");
        let find = || -> Result<(), super::super::CliError> {
            let config = BenchConfig::parse(text, path)?;
            Roles::build(&config.bus, config.period_s)?;
            config.guard.build(config.period_s)?;
            controller_plant::command_source(&config)?;
            config.real_time.check()?;
            emulate::emulator(&config)?;
            BenchPlace::open(&config.name, &config.shared_memory)?;
            Ok(())
        };
        find().map_or_else(|error| error.in_bench_file(path, text).to_string(), |()| "nothing".to_owned())
    }

    /// Where it is wrong for what runs, the bench file that names it is not wrong otherwise.
    #[test]
    fn a_model_that_no_controller_can_use_is_named_where_the_bench_file_names_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("falls.toml");
        let mut model = crate::model::Model::paper();
        model.actuator.steady_rate = vec![0.0, 3000.0, -6000.0, 3960.0];
        model.save(&file).expect("written");
        let said = said_of(&format!("name = \"x\"\nmodel = {file:?}"));
        assert!(said.starts_with("bench.toml, line 2: model `paper`: g(u)"), "{said}");
        assert!(said.contains("falls between u = 0.455 and 0.555"), "{said}");
    }

    /// One of each: every error about what stands in the bench file names it, and the line.
    #[test]
    fn every_room_s_errors_name_the_bench_file_and_the_line() {
        let cases = [
            ("\nperiod_s = 0.0", "bench.toml, line 2: period_s: 0 is outside 0.0001..1 s"),
            (
                "[guard]\n\nhold_s = 0.0",
                "bench.toml, line 3: guard hold_s is 0: it must be above 0 and at most 10",
            ),
            (
                "[guard]\nslew_per_s = 5.0\n[guard.propeller_rate]\nfrozen_after_s = -1.0",
                "bench.toml, line 4: guard propeller_rate 1 frozen_after_s is -1: it must be from 0 to 3600",
            ),
            (
                "[bus.sensors]\nbody_rate = { signal = \"GYRO.rate\", unit = \"rads\" }",
                "bench.toml, line 2: bus.sensors.body_rate: `GYRO.rate`: unknown unit `rads`; for what is measured in rad/s: `rad/s`, `deg/s`, `°/s`, `dps`, `rpm`, `RPM`, `Hz`, `rev/s`, `krpm`",
            ),
            (
                "[bus.commands.rotor_1]\nsignal = \"COMMAND.rotor_1\"",
                "bench.toml, line 1: bus.commands.rotor_2: no signal carries this rotor's command",
            ),
            (
                "name = \"x\"\n[bus.messages.GYR0]\nperiod_s = 0.1",
                "bench.toml, line 2: bus.messages.GYR0: no role uses this message: take it out, or name one of its signals in bus.sensors",
            ),
            (
                "[bus]\ndatabase = [\n  { file = \"no/such.dbc\" },\n]",
                "bench.toml, line 2: cannot read `no/such.dbc`: No such file or directory (os error 2)",
            ),
            ("[bus]\nbit_rate = 20000", "bench.toml, line 2: the bus would be 168.8 % loaded"),
            (
                "[controller.emc]\nalpha = -1.0",
                "bench.toml, line 2: alpha is -1: it must be zero or a positive number",
            ),
            (
                "[controller]\nkind = \"pid\"\n[controller.pid]\nk_p = 1.0\nk_i = nan",
                "bench.toml, line 5: k_i is NaN",
            ),
            (
                "[controller.reference]\nangle_rad = inf",
                "bench.toml, line 2: reference.angle_rad is inf: it must be a number",
            ),
            (
                "[controller.emc]\nfeedback_gain = [0.276, 0.120, 0.052]",
                "bench.toml, line 1: the state feedback",
            ),
            (
                "[emulator]\nesc_timeout_s = 0.0",
                "bench.toml, line 2: emulator: `esc_timeout_s` must lie in 0.001..3600, not 0",
            ),
            (
                "[emulator.plant]\ninertia = 0.0",
                "bench.toml, line 2: emulator: `inertia` must be above zero, not 0",
            ),
            (
                "[[emulator.impulse]]\nat_s = 1.0\nduration_s = 0.0\ntorque = 0.1",
                "bench.toml, line 3: emulator: `impulse.duration_s` must lie in",
            ),
            (
                "[emulator.sensors.thrust]\nrate_hz = -1.0",
                "bench.toml, line 1: emulator: sensor `thrust` cannot have",
            ),
            (
                "[[emulator.hidden]]\neffect = \"gravity\"",
                "bench.toml, line 1: emulator: hidden effect `gravity`:",
            ),
            ("[real_time]\npriority = 120", "bench.toml, line 2: real_time.priority: 120 is outside 0..99"),
            ("name = \"a/b\"", "bench.toml, line 1: `a/b` cannot name a bench"),
            (
                "[shared_memory]\ngroup = \"nobody-has-it\"",
                "bench.toml, line 2: there is no Unix group `nobody-has-it`",
            ),
        ];
        let wrong: Vec<String> = cases
            .into_iter()
            .map(|(text, wanted)| (text, wanted, said_of(text)))
            .filter(|(_, wanted, said)| !said.starts_with(wanted))
            .map(|(text, wanted, said)| format!("{text}\n  said:   {said}\n  wanted: {wanted}"))
            .collect();
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    /// What is not in the file does not get a line of it, and what it has nothing to do with does not get its name.
    #[test]
    fn a_default_that_clashes_names_the_file_and_an_option_does_not() {
        let guard = said_of("name = \"x\"\nguard.arm_checks_s = 5.0");
        assert_eq!(
            guard,
            "bench.toml, line 2: guard arm_timeout_s is 2: it must be from arm_checks_s to 3600"
        );
        let setting = |error: &EmulateError| Setting::of(error).expect("of the bench file");
        let hidden = EmulateError::Hidden { effect: "x".to_owned(), reason: "unknown".to_owned() };
        assert_eq!(setting(&hidden).place(Path::new("bench.toml"), "[emulator]\nseed = 2"), None);
        let timeout = EmulateError::Range { name: "esc_timeout_s", value: 0.0, low: 1.0, high: 2.0 };
        assert_eq!(setting(&timeout).place(Path::new("bench.toml"), ""), Some("bench.toml".to_owned()));
        assert_eq!(
            Setting::of(&BenchError::Read { path: "x".into(), error: std::io::Error::other("y") }),
            None
        );
    }
}
