//! Errors as sentences, those whose reasons are findings among them.

use std::error::Error;

use super::identify::step;
use super::screening::rates_of;
use super::{sentence, text};
use crate::compare::CompareError;
use crate::diagnose::DiagnoseError;
use crate::fleet::FleetError;
use crate::identify::{IdentifyError, PipelineStep};
use crate::screening::{Finding, ScreeningError};
use crate::session::SessionError;
use crate::studies::paper::PaperError;

/// An error and its causes in one sentence. An error that says its cause itself has no source.
#[must_use]
pub fn explained(error: &(dyn Error + 'static)) -> String {
    let said = refusal(error).unwrap_or_else(|| error.to_string());
    let causes = std::iter::successors(error.source(), |&cause| cause.source());
    causes.fold(said, |said, cause| format!("{said}: {cause}"))
}

/// What an error says whose reason is a finding; `None` of one that speaks for itself.
#[must_use]
pub fn refusal(error: &(dyn Error + 'static)) -> Option<String> {
    if let Some(FleetError::Session(error)) = error.downcast_ref::<FleetError>() {
        return refusal(error);
    }
    match error.downcast_ref::<SessionError>() {
        Some(SessionError::Identify(error)) => return refusal(error),
        Some(SessionError::Diagnose(error)) => return refusal(error),
        Some(SessionError::Compare(error)) => return refusal(error),
        _ => {}
    }
    if let Some(DiagnoseError::Screening(error)) = error.downcast_ref::<DiagnoseError>() {
        return refusal(error);
    }
    if let Some(CompareError::Screening(error)) = error.downcast_ref::<CompareError>() {
        return refusal(error);
    }
    match error.downcast_ref::<ScreeningError>() {
        Some(ScreeningError::Column(finding)) => return Some(sentence(finding)),
        Some(error @ ScreeningError::NothingInCommon { formats, .. }) => {
            // On a line of its own: what a log holds is long.
            let rates =
                formats.iter().map(|format| rates_of(format)).find(|rates| !rates.is_empty()).unwrap_or("");
            return Some(format!("{error}{}", rates.replacen("; ", "\n  ", 1)));
        }
        _ => {}
    }
    if let Some(PaperError::Identify(error)) = error.downcast_ref::<PaperError>() {
        return refusal(error);
    }
    match error.downcast_ref::<IdentifyError>()? {
        IdentifyError::Screening(error) => refusal(error),
        IdentifyError::Nothing { reasons, steps } => Some(nothing(reasons, steps)),
        _ => None,
    }
}

/// Why nothing can be identified: first the logs without a part, then what each step lacks.
fn nothing(reasons: &[Finding], steps: &[PipelineStep]) -> String {
    let (unused, rest): (Vec<_>, Vec<_>) = reasons.iter().partition(|it| it.code == "log_not_used");
    let steps = steps.iter().map(|part| format!("{}: {}", step(part.step), text(&part.finding)));
    let lines = unused.into_iter().map(sentence).chain(steps).chain(rest.into_iter().map(sentence));
    format!("nothing can be identified:\n  {}", lines.collect::<Vec<String>>().join("\n  "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::log::betaflight::Betaflight;
    use crate::log::format::LogFormat as _;

    #[test]
    fn a_flight_that_no_model_can_be_held_against_says_what_makes_its_controller_log_rates() {
        let said = |format: &'static str| {
            let log = Dataset::new("f.bbl", "", vec![0.0, 1.0]).expect("time rises").of_format(format);
            explained(&ScreeningError::nothing_in_common(&[&log]))
        };
        assert!(
            said(Betaflight.name())
                .contains("f.bbl holds nothing but time\n  Betaflight logs rates from 4.5 on")
        );
        assert!(said("").ends_with("f.bbl holds nothing but time"), "{}", said(""));
        let flight =
            |format| Dataset::new("f.bbl", "", vec![0.0, 1.0]).expect("time rises").of_format(format);
        let mut with_rates = flight(Betaflight.name());
        with_rates.insert("propeller_rate_1_rad_s", vec![700.0; 2]).expect("fits");
        let said = |logs: &[&Dataset]| explained(&ScreeningError::nothing_in_common(logs));
        assert!(!said(&[&with_rates]).contains("logs rates from"), "the commands are missing, and no rate");
        // Another format beside it needs no such words.
        let both = said(&[&flight("Parquet"), &flight(Betaflight.name())]);
        assert!(both.contains("Betaflight logs rates from 4.5 on"), "{both}");
    }
}
