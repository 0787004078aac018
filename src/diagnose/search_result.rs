//! What the search of one block found.

use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::model_selection::{floor, over_floor};
use super::surrogate_test::Luck;

/// An error within this factor of the noise floor leaves nothing to explain.
pub(crate) const AT_FLOOR: f64 = 1.1;
/// The same for a body driven by measured rotors: the floor does not know how far the rotors' model is off, which their
/// own noise hides and the body integrates.
const AT_FLOOR_DRIVEN: f64 = 1.25;

/// A candidate on its own.
#[derive(Debug, Clone)]
pub struct Single {
    /// Id.
    pub effect: String,
    /// Its trial; `None` when the log lacks what it needs.
    pub trial: Option<Trial>,
    /// What its shifted traces do; `None` when it was not tried.
    pub luck: Option<Luck>,
    /// Why it was not tried, or why it was refused after it had been.
    pub note: String,
}

/// What the search of one block found.
#[derive(Debug, Clone)]
pub struct Found {
    /// The data it was found on.
    pub stage: Stage,
    /// The base as it is.
    pub stale: Trial,
    /// The base with its own parameters refitted.
    pub recalibrated: Trial,
    /// Every candidate on its own.
    pub singles: Vec<Single>,
    /// The answer: the best set, and of the base's own parameters only those refitted whose change it needs.
    pub answer: Trial,
    /// The recalibrated base, then sets on the way to the answer, the answer last.
    pub ladder: Vec<Trial>,
    /// Sets that the data cannot tell from the answer, nearest first.
    pub alternatives: Vec<Trial>,
    /// For each effect of the answer, the trial without it.
    pub dropped: Vec<Trial>,
    /// Noise floor of each channel in its unit.
    pub floors: [f64; 2],
    /// Base parameters without whose change the answer is worse.
    pub changed: Vec<String>,
}

impl Found {
    /// The largest held-out error of a trial over its noise floor, and the channel it is in.
    #[must_use]
    pub fn over_floor(&self, trial: &Trial) -> (f64, usize) {
        over_floor(&self.stage, trial, &self.floors)
    }

    /// The factor of the noise floor within which nothing is left to explain.
    #[must_use]
    pub fn at_floor(&self) -> f64 {
        if self.stage.train.is_driven_by_rotors() { AT_FLOOR_DRIVEN } else { AT_FLOOR }
    }

    /// The share of what the recalibrated base leaves above the noise that the answer explains.
    #[must_use]
    pub fn explained(&self) -> f64 {
        let (before, after) = (self.recalibrated.validate(&self.stage), self.answer.validate(&self.stage));
        let room = before - floor(&self.stage, &self.floors);
        if room > 0.0 { ((before - after) / room).clamp(0.0, 1.0) } else { 1.0 }
    }
}
