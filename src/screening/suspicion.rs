//! What can hardly be what its name says, and who cannot work with it: one judgement, of which every command says the same.

use super::{Finding, ScreeningError};

/// Who cannot work with a log in which something was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Stops {
    /// Nobody: it is said.
    Nobody,
    /// Whoever searches with a model for what it is missing. It may be the log of another bench, and a model of that can be made of it.
    Searches,
    /// Whoever fits anything: it would be taken for physics.
    Fits,
}

/// A column that can hardly be what its name says.
#[derive(Debug, Clone)]
pub(crate) struct Suspicion {
    /// What, and by which numbers.
    pub finding: Finding,
    /// Who cannot work with it.
    pub stops: Stops,
}

impl Suspicion {
    /// To which nobody can fit anything.
    pub(crate) fn impossible(finding: Finding) -> Self {
        Self { finding, stops: Stops::Fits }
    }

    /// The same where it is impossible; else it is said.
    pub(crate) fn impossible_if(is_impossible: bool, finding: Finding) -> Self {
        Self { finding, stops: if is_impossible { Stops::Fits } else { Stops::Nobody } }
    }

    /// That is said.
    pub(crate) fn said(finding: Finding) -> Self {
        Self { finding, stops: Stops::Nobody }
    }
}

/// What was found in some logs.
#[derive(Debug, Clone, Default)]
pub(crate) struct Suspicions {
    /// Columns that can hardly be what their names say, what stops most first.
    mistaken: Vec<Suspicion>,
    /// What they lack for a model.
    pub(crate) lacking: Vec<Finding>,
}

impl Suspicions {
    pub(crate) fn of(mut mistaken: Vec<Suspicion>, lacking: Vec<Finding>) -> Self {
        mistaken.sort_by_key(|it| std::cmp::Reverse(it.stops));
        Self { mistaken, lacking }
    }

    /// Refuses the logs for who does this.
    ///
    /// # Errors
    /// [`ScreeningError::Column`] of what stops most.
    pub(crate) fn refuse(&self, who: Stops) -> Result<(), ScreeningError> {
        match self.mistaken.first().filter(|it| it.stops >= who) {
            Some(it) => Err(ScreeningError::Column(Box::new(it.finding.clone()))),
            None => Ok(()),
        }
    }

    /// Columns that can hardly be what their names say.
    pub(crate) fn mistaken(&self) -> impl Iterator<Item = &Finding> {
        self.mistaken.iter().map(|it| &it.finding)
    }

    /// All of it.
    pub(crate) fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.mistaken().chain(&self.lacking)
    }
}
