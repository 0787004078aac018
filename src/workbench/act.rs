//! What the page may ask for. Nothing else changes the desk, and none of it reaches a bench.

use std::path::PathBuf;

use serde::Deserialize;

use super::choice::Choice;
use super::desk::LogUse;

/// One wish of the page.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "act", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Act {
    /// Opens a log below the folders that were named.
    OpenLog {
        /// Its path.
        path: PathBuf,
        /// Which part of it counts.
        #[serde(default)]
        choice: Choice,
    },
    /// Opens one of the logs of a file that holds several.
    OpenPart {
        /// Number of what was opened.
        log: u64,
        /// Which of them, from 1.
        part: usize,
    },
    /// Takes a log away.
    CloseLog {
        /// Its number.
        log: u64,
    },
    /// Reads a log again where its file is another now: a recording that is being written.
    Reread {
        /// Its number.
        log: u64,
    },
    /// Says what a log is for.
    Role {
        /// The log's number.
        log: u64,
        /// What it is for.
        role: LogUse,
    },
    /// Says what a column of a foreign log becomes.
    Mend {
        /// The log's number.
        log: u64,
        /// The column's name.
        column: String,
        /// The signal that it becomes; `-` = none.
        signal: String,
        /// Unit that it comes in.
        unit: Option<String>,
    },
    /// Confirms what the columns of a foreign log mean: it is read.
    Confirm {
        /// The log's number.
        log: u64,
        /// Name of a mapping that says it; without one, what the page shows.
        like: Option<String>,
    },
    /// Goes back to the columns of a foreign log.
    AskAgain {
        /// The log's number.
        log: u64,
    },
    /// Opens a model file below the folders that were named.
    OpenModel {
        /// Its path.
        path: PathBuf,
    },
    /// Draws a model's curves, or not.
    Show {
        /// The model's number.
        model: u64,
        /// Whether they are drawn.
        shown: bool,
    },
    /// Chooses the model that is diagnosed and extended.
    Choose {
        /// Its number.
        model: u64,
    },
    /// Takes a model away.
    CloseModel {
        /// Its number.
        model: u64,
    },
    /// Makes a model of the bench from the logs that are fitted on.
    Identify,
    /// Searches for what the chosen model is missing.
    Diagnose,
    /// Searches for the law itself, where no effect of the catalogue explains it.
    Discover,
    /// Adds the law that was found to the chosen model.
    AddLaw,
    /// The same, to be looked at.
    TryLaw,
    /// Adds effects to the chosen model, refitted.
    Add {
        /// Their ids.
        effects: Vec<String>,
    },
    /// The same, to be looked at.
    Try {
        /// Their ids.
        effects: Vec<String>,
    },
    /// Refits the chosen model's own numbers.
    Recalibrate,
    /// Undoes the last step of the chosen model's ladder.
    StepBack,
    /// Chooses the model as it was after so many steps of its ladder.
    Rung {
        /// How many of the steps stay.
        steps: usize,
    },
    /// Ends the search that is running.
    Cancel,
    /// Takes the notices away.
    Read,
}
