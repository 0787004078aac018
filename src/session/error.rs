//! Why there is no result.

use crate::bench::BenchError;
use crate::can::CanError;
use crate::cancel::Cancelled;
use crate::compare::CompareError;
use crate::control::ControlError;
use crate::diagnose::DiagnoseError;
use crate::file::MappingPlace;
use crate::identify::IdentifyError;
use crate::log::ForeignError;
use crate::log::can_capture::CaptureError;
use crate::log::csv::LogError;
use crate::log::format::FormatError;
use crate::log::mapping::MappingError;
use crate::log::mended::MendError;
use crate::model::ModelError;
use crate::recording::RecordError;
use crate::runtime::ProcessError;
use crate::studies::controller_comparison::RunComparisonError;

/// Why a part of a log cannot be had.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChoiceError {
    /// A rotor that is not there.
    #[error("{log}: no rotor {rotor}; {}", rotors_in(present))]
    Rotor {
        /// The log.
        log: String,
        /// What was asked for.
        rotor: usize,
        /// The rotors that are there.
        present: Vec<usize>,
    },
    /// The name of the built-in model in the place of a log.
    #[error("`paper` is the model that is built in, and a log is wanted here; models go to `--model`")]
    Paper,
    /// No row between two times.
    #[error("{log}: no row {}; it goes from {start} s to {end} s", span(*from, *to))]
    Span {
        /// The log.
        log: String,
        /// [s]
        from: f64,
        /// [s]
        to: f64,
        /// [s]
        start: f64,
        /// [s]
        end: f64,
    },
}

/// Where rows were looked for; an end that nobody said is none.
fn span(from: f64, to: f64) -> String {
    let ends = [("from", from), ("to", to)].into_iter().filter(|(_, end)| end.is_finite());
    ends.map(|(word, end)| format!("{word} {end} s")).collect::<Vec<_>>().join(" ")
}

impl SessionError {
    /// The same to somebody who writes a plan, which has keys where a command has options.
    #[must_use]
    pub(crate) fn of_plan(mut self) -> Self {
        if let Self::Log(LogError::NoTime { place, .. }) | Self::Model(ModelError::IsMapping { place, .. }) =
            &mut self
        {
            *place = MappingPlace::Plan;
        }
        self
    }

    /// The logs of a file that holds several, where none was chosen: number of each, and how long it is [s] where the file says
    /// that.
    #[must_use]
    pub fn parts(&self) -> Option<Vec<(usize, Option<f64>)>> {
        match self {
            Self::Format(FormatError::Parts { lengths, .. }) => {
                Some(lengths.iter().enumerate().map(|(at, length)| (at + 1, Some(*length))).collect())
            }
            Self::Foreign(ForeignError::Restart { parts, .. }) => {
                Some((1..=*parts).map(|part| (part, None)).collect())
            }
            _ => None,
        }
    }
}

fn rotors_in(present: &[usize]) -> String {
    if present.is_empty() {
        return "it names none".to_owned();
    }
    let numbers: Vec<String> = present.iter().map(usize::to_string).collect();
    format!("it holds {}", numbers.join(", "))
}

/// Why there is no result.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// It was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A log in our format.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A log in a format of another program.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A part of a log that is not there.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    /// A foreign log.
    #[error(transparent)]
    Foreign(#[from] ForeignError),
    /// The mapping of a foreign log.
    #[error(transparent)]
    Mapping(#[from] MappingError),
    /// What a column is said to mean.
    #[error(transparent)]
    Mend(#[from] MendError),
    /// A recording.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A capture of a bus.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The bench file that says what a capture's frames mean.
    #[error(transparent)]
    Bench(#[from] BenchError),
    /// Its roles.
    #[error(transparent)]
    Can(#[from] CanError),
    /// A model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Nothing could be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// Nothing could be compared.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Nothing could be diagnosed or extended.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// A run on the emulated bench.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// A controller whose settings are out of their range.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// Recordings of runs that cannot be held beside each other.
    #[error(transparent)]
    Runs(#[from] RunComparisonError),
    /// There is no step to undo.
    #[error("the ladder is empty, there is no step to undo")]
    EmptyLadder,
}
