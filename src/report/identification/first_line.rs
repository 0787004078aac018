//! What stands above all numbers of `identify`: that there are none of this bench, or that they hardly are.

use super::number;
use crate::identify::{Identification, Validation};
use crate::screening::Finding;

impl Identification {
    /// The headline where the logs hold a rotor and nothing of its model was found, nor of a body.
    #[must_use]
    pub fn headline(&self) -> Option<String> {
        let found =
            [self.battery.is_some(), self.static_curve.is_some(), self.pole.is_some(), self.joint.is_some()];
        let run = self.training.first()?;
        (!found.contains(&true) && self.body.is_none() && self.rotors.is_empty()).then(|| {
            format!(
                "No rotor model found: the numbers are the template's (rms {} rad/s on {}, fit {} %)",
                number(run.rms, 3),
                run.source,
                number(run.fit_percent, 3)
            )
        })
    }

    /// What stands above all numbers where the model hardly explains the logs that they are from: their errors hold for a model of the
    /// right form.
    #[must_use]
    pub fn caution(&self) -> Option<String> {
        let is_unexplained = |run: &&Validation| {
            let of_run = |it: &&Finding| it.code == "rates_unexplained" && it.place() == run.source;
            self.findings.iter().any(|it| of_run(&it))
        };
        let worst = self.training.iter().filter(is_unexplained);
        let worst = worst.min_by(|a, b| a.fit_percent.total_cmp(&b.fit_percent))?;
        Some(format!(
            "These numbers are hardly this bench's: on {}, which they are from, the model leaves {} rad/s, a fit of {:.0} %. The errors \
             beneath hold for a model of the right form only",
            worst.source,
            number(worst.rms, 3),
            worst.fit_percent
        ))
    }
}
