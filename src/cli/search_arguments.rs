//! What the commands take that look for what is missing: the model, the logs to fit on, those held out.

use std::path::PathBuf;

use super::CliError;
use super::log_arguments::{LogArguments, horizon};
use super::output::NotesArgument;
use crate::cancel::Cancel;
use crate::compare::CompareConfig;
use crate::diagnose::DiagnoseConfig;
use crate::report::next_steps::Typed;
use crate::screening::ScreenedLog;
use crate::session::{self, Job};

/// A model and logs.
#[derive(Debug, clap::Args)]
pub struct SearchArguments {
    /// Model file, or `paper`
    #[arg(long, default_value = "paper")]
    pub(super) model: PathBuf,
    /// Logs to fit on
    #[arg(long, required = true, num_args = 1..)]
    pub(super) log: Vec<PathBuf>,
    /// Validation logs; without them every third stretch of the training logs is held out
    #[arg(long, num_args = 1..)]
    pub(super) validate: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) logs: LogArguments,
    #[command(flatten)]
    pub(super) notes: NotesArgument,
    /// Windows over which the body runs freely [s]
    #[arg(value_parser = horizon, long, default_value_t = DiagnoseConfig::default().horizon)]
    horizon_s: f64,
}

impl SearchArguments {
    /// Every file that is read: none of them may be written.
    pub(super) fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        self.log.iter().chain(&self.validate).chain([&self.model])
    }

    /// The logs to fit on, and the validation logs.
    pub(super) fn open(&self, cancel: &Cancel) -> Result<(Vec<ScreenedLog>, Vec<ScreenedLog>), CliError> {
        let open = self.logs.open_config();
        let train = session::open_all(&self.log, &open, &Job::unwatched(cancel))?;
        let validate = session::open_all(&self.validate, &open, &Job::unwatched(cancel))?;
        Ok((train, validate))
    }

    /// What the search takes of them.
    pub(super) fn config(&self) -> DiagnoseConfig {
        DiagnoseConfig { horizon: self.horizon_s, ..DiagnoseConfig::default() }
    }

    /// The options as they were typed.
    pub(super) fn as_typed(&self) -> Typed {
        Typed { logs: self.logs.as_typed(), windows: self.windows_as_typed() }
    }

    /// The same of one rotor alone.
    pub(super) fn as_typed_of_rotor(&self, rotor: usize) -> Typed {
        Typed { logs: self.logs.of_rotor(rotor).as_typed(), windows: self.windows_as_typed() }
    }

    fn windows_as_typed(&self) -> String {
        let is_default = self.horizon_s == DiagnoseConfig::default().horizon;
        if is_default { String::new() } else { format!(" --horizon-s {}", self.horizon_s) }
    }

    /// What a comparison takes of them, over the same windows.
    pub(super) fn windows(&self) -> CompareConfig {
        CompareConfig { horizon_s: self.horizon_s, ..CompareConfig::default() }
    }
}
