//! The tables of all rooms that have thresholds: what `docs/thresholds.md` is made of.

use crate::threshold::{Threshold, page};
use crate::{
    bench, can, cli, compare, control, diagnose, discover, effect, emulate, estimation, experiment, fleet,
    guard, identify, log, model, recording, report, runtime, screening, session, shm, studies, workbench,
};

/// Room and table, in the order of the rooms. `tests/architecture/` fails when a room with a `thresholds.rs` is missing.
pub const ROOMS: &[(&str, &[Threshold])] = &[
    ("effect", effect::thresholds::TABLE),
    ("model", model::thresholds::TABLE),
    ("estimation", estimation::thresholds::TABLE),
    ("can", can::thresholds::TABLE),
    ("shm", shm::thresholds::TABLE),
    ("control", control::thresholds::TABLE),
    ("guard", guard::thresholds::TABLE),
    ("experiment", experiment::thresholds::TABLE),
    ("recording", recording::thresholds::TABLE),
    ("log", log::thresholds::TABLE),
    ("screening", screening::thresholds::TABLE),
    ("emulate", emulate::thresholds::TABLE),
    ("bench", bench::thresholds::TABLE),
    ("identify", identify::thresholds::TABLE),
    ("compare", compare::thresholds::TABLE),
    ("diagnose", diagnose::thresholds::TABLE),
    ("discover", discover::thresholds::TABLE),
    ("runtime", runtime::thresholds::TABLE),
    ("studies", studies::thresholds::TABLE),
    ("session", session::thresholds::TABLE),
    ("fleet", fleet::thresholds::TABLE),
    ("report", report::thresholds::TABLE),
    ("workbench", workbench::thresholds::TABLE),
    ("cli", cli::thresholds::TABLE),
];

/// The page, in Markdown; `used_in` says in which file of `src/` the threshold of a room is used.
#[must_use]
pub fn markdown(used_in: impl Fn(&str, &str) -> String) -> String {
    page(ROOMS, used_in)
}
