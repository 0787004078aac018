//! The blocks of a model one after the other: the rotors, then the body that they drive.

use super::assemble;
use super::block_builder::{is_body_held, rotor_split};
use super::block_context::{BlockContext, Refit, SelectParameters};
use super::config::DiagnoseConfig;
use super::data_split::DataSplit;
use super::diagnosis::{ErrorSummary, Verdict};
use super::error::DiagnoseError;
use super::rest_of_body::rest_follows;
use super::search_result::SearchResult;
use super::verdict;
use crate::log::Dataset;
use crate::model::Model;
use crate::screening::{ScreenedLog, ScreeningError};

/// The blocks of a model beside their data, each with what was found.
pub(crate) struct Blocks {
    pub(crate) found: Vec<SearchResult>,
    pub(crate) verdicts: Vec<Verdict>,
}

impl Blocks {
    /// Builds the rotor block, then the body block that its answer drives; `find` looks into each, `refit` only refits a
    /// block's own numbers and the effects it is given.
    pub(crate) fn build(
        model: &Model,
        train: &[ScreenedLog],
        validate: &[ScreenedLog],
        config: &DiagnoseConfig,
        (find, refit): (&dyn Fn(DataSplit) -> SearchResult, Refit),
        select_parameters: SelectParameters,
    ) -> Result<Self, DiagnoseError> {
        let context =
            BlockContext { model, train, validate, horizon: config.horizon, find, refit, select_parameters };
        let mut rotor = rotor_split(train, validate).map(|split| find(split.judged_by(model)));
        let is_body_asked = !is_body_held(train) && train.iter().any(|log| log.body().is_some());
        if let Some(rotor) = rotor.as_mut().filter(|_| is_body_asked) {
            context.change_all_that_differ(rotor)?;
        }
        let body = match &rotor {
            // Beside rotors a body that was held still says nothing.
            Some(_) if is_body_held(train) => None,
            rotor => context.body(rotor.as_ref().map(|found| (found, &found.answer)), find)?,
        };
        let body = match (&mut rotor, body) {
            (Some(rotor), Some(body)) => {
                let body = context.decide_sensor_lag(rotor, body)?;
                let body = context.without_what_lags(rotor, body)?;
                let driven = context.infer_driver(rotor, body)?;
                Some(context.error_before_driver(rotor, driven)?)
            }
            (_, body) => body,
        };
        let found: Vec<SearchResult> = rotor.into_iter().chain(body).collect();
        if found.is_empty() {
            let logs: Vec<&Dataset> = train.iter().chain(validate).map(ScreenedLog::dataset).collect();
            return Err(ScreeningError::nothing_in_common(&logs).into());
        }
        let verdicts = found.iter().map(verdict::verdict).collect();
        Ok(Self { found, verdicts })
    }

    /// Whether each block that says something is left with nothing but noise.
    pub(crate) fn is_at_floor(&self) -> bool {
        let held_out =
            self.found.iter().zip(&self.verdicts).filter(|(_, it)| **it != Verdict::InsufficientData);
        held_out.into_iter().all(|(found, _)| {
            found.over_floor(&found.answer).0 <= found.at_floor()
                && rest_follows(found, &found.answer).is_none()
        })
    }

    /// The model with what each block found.
    pub(crate) fn merged(&self, model: &Model) -> Model {
        assemble::merged(model, &self.found, &self.verdicts)
    }

    /// The error in the block and channel where it says most.
    pub(crate) fn error_summary(&self, config: &DiagnoseConfig) -> ErrorSummary {
        let (main, channel) = assemble::main_block(&self.found);
        assemble::error_summary(main, channel, config)
    }
}

#[cfg(test)]
mod tests {
    use super::super::candidate_fit::CandidateFit;
    use super::super::not_named::{NotNamed, Unmet};
    use super::super::search_result::SingleEffect;
    use super::super::tests::{leaves, noise};
    use super::super::thresholds::THRESHOLDS;
    use super::*;

    /// Two rotors at the same steps, and a body that turns to and fro.
    fn log() -> ScreenedLog {
        let rows = 2000;
        let column = |of: &dyn Fn(usize) -> f64| (0..rows).map(of).collect::<Vec<f64>>();
        let command = column(&|row| 0.4 + 0.1 * (row / 40 % 3) as f64);
        let rate = column(&|row| 500.0 + 100.0 * (row / 40 % 3) as f64 + noise(row));
        let body = column(&|row| (0.05 * row as f64).sin() + 0.01 * noise(row + rows));
        let columns = [
            ("command_1", command.clone()),
            ("command_2", command),
            ("propeller_rate_1_rad_s", rate.clone()),
            ("propeller_rate_2_rad_s", rate),
            ("body_rate_rad_s", body),
        ];
        Dataset::made(column(&|row| 0.01 * row as f64), columns).into()
    }

    /// A fit that leaves so many times the noise.
    fn left(split: &DataSplit, size: f64) -> CandidateFit {
        let of = |rows: usize| leaves((0..rows).map(|row| size * noise(row)).collect());
        CandidateFit { held_out: of(split.validate.len()).fit, ..of(split.train.len()) }
    }

    /// A block in which this effect was searched for and named, and how many times the noise its own numbers alone leave.
    fn named(split: DataSplit, effect: &str, size: f64) -> SearchResult {
        let answer = CandidateFit { effects: vec![effect.to_owned()], ..left(&split, 1.0) };
        let fits = [left(&split, 9.0), left(&split, size), answer];
        let effect = effect.to_owned();
        let single = SingleEffect { effect, fitted: None, surrogate: None, refusal: None, not_named: None };
        SearchResult { singles: vec![single], ..SearchResult::of_one(split, fits, Vec::new()) }
    }

    /// What a search names in the body, and why it does not name what it tried there.
    fn of_body(of_rotor: &str, body_leaves: f64, is_searched: bool) -> (Vec<String>, Option<NotNamed>) {
        let find = |split: DataSplit| match split.train.is_rotor() {
            true if is_searched => named(split, of_rotor, 3.0),
            true => SearchResult { singles: Vec::new(), ..named(split, of_rotor, 3.0) },
            false => named(split, "rotor_lag", body_leaves),
        };
        let refit = |split: DataSplit, _: &[String]| {
            let fits = [left(&split, 9.0), left(&split, body_leaves), left(&split, body_leaves)];
            SearchResult::of_one(split, fits, Vec::new())
        };
        let kept = |_: &SearchResult, fitted: &CandidateFit| (fitted.clone(), Vec::new());
        let config = DiagnoseConfig::default();
        let built = Blocks::build(&Model::paper(), &[log()], &[log()], &config, (&find, &refit), &kept);
        let mut found = built.expect("the catalogue's effects").found;
        let body = found.pop().expect("a body");
        (body.answer.effects, body.singles[0].not_named.clone())
    }

    #[test]
    fn near_its_noise_a_body_that_nobody_saw_driven_has_nothing_to_name() {
        let within = 0.5 * (1.0 + THRESHOLDS.at_floor);
        let (named, why) = of_body("telemetry_lag", within, true);
        assert!(named.is_empty(), "{named:?}");
        assert_eq!(why, Some(NotNamed { beside: Vec::new(), condition: Unmet::NothingLeft }));
        let stays = (vec!["rotor_lag".to_owned()], None);
        assert_eq!(of_body("telemetry_lag", 3.0 * THRESHOLDS.at_floor, true), stays, "it leaves more");
        assert_eq!(of_body("transport_delay", within, true), stays, "its rates were read");
        assert_eq!(of_body("telemetry_lag", within, false), stays, "it was asked for");
    }
}
