//! From what a search found to the word for it.

use super::diagnosis::Verdict;
use super::rest_of_body::rest_follows;
use super::search_result::SearchResult;
use super::thresholds::THRESHOLDS;
use super::torque_beside::turns_the_body;

/// Whether a body with all the inertia in the world is the best that the torque on it can be made of: one that turns against
/// its torque, as with a gyro of the wrong sign or with rotors 1 and 2 exchanged. A pendulum whose weight nobody modelled asks for
/// such an inertia, too; beside its angle the torque then turns it the right way.
fn does_not_follow(found: &SearchResult) -> bool {
    !found.split.train.is_rotor()
        && found.refitted.model.body.inertia > THRESHOLDS.held_inertia * found.nominal.model.body.inertia
        && !turns_the_body(&found.split)
}

/// Whether a body moves, and not as the torque on it would have it, and no effect explains that either.
pub(crate) fn turns_against_torque(found: &SearchResult) -> bool {
    let is_unexplained = found.over_floor(&found.answer).0 > found.at_floor();
    is_unexplained && does_not_follow(found) && !found.split.is_body_held
}

/// The channel whose error is plain where it was fitted and at the floor where it was held out, with both over the floor.
pub(crate) fn fails_in_training_only(found: &SearchResult) -> Option<(usize, [f64; 2])> {
    let over = |channel: usize, held_out| {
        found.answer.channel_error(&found.split, channel, held_out) / found.floors[channel]
    };
    let both = |channel| (channel, [over(channel, false), over(channel, true)]);
    let mut channels = (0..found.split.train.channels().len()).map(both);
    channels.find(|(_, [fitted, held_out])| *fitted > THRESHOLDS.plain_error && *held_out <= found.at_floor())
}

/// The verdict on one block.
pub(crate) fn verdict(found: &SearchResult) -> Verdict {
    let over_floor = found.over_floor(&found.answer).0;
    let at_floor = over_floor <= found.at_floor();
    let named = !found.answer.effects.is_empty();
    // Data that excite nothing say nothing, whatever their error is.
    if found.split.insufficient_data().is_some() {
        return Verdict::InsufficientData;
    }
    // However near it came, it stands in for another law.
    if rest_follows(found, &found.answer).is_some() {
        return Verdict::Unknown;
    }
    match (at_floor, named) {
        (true, true) => Verdict::MissingEffect,
        // What the logs fitted on show and the held-out ones do not is not explained by being there once.
        (true, false) if fails_in_training_only(found).is_some() => Verdict::Unknown,
        (true, false) if found.changed.is_empty() => Verdict::Adequate,
        (true, false) => Verdict::ParametersChanged,
        (false, true) if found.explained() >= THRESHOLDS.explained && over_floor <= THRESHOLDS.near_floor => {
            Verdict::MissingEffect
        }
        (false, _) => Verdict::Unknown,
    }
}

/// The verdict on all blocks: the one that asks most of the user.
pub(crate) fn joint(verdicts: &[Verdict]) -> Verdict {
    let order = [Verdict::Unknown, Verdict::MissingEffect, Verdict::ParametersChanged, Verdict::Adequate];
    order.into_iter().find(|verdict| verdicts.contains(verdict)).unwrap_or(Verdict::InsufficientData)
}

#[cfg(test)]
mod tests {
    use super::super::block_data::{BlockData, Runs};
    use super::super::body_block::{BodyRun, BodySource};
    use super::super::candidate_fit::CandidateFit;
    use super::super::data_split::DataSplit;
    use super::super::tests::{at_once, noise, weighed_down};
    use super::*;
    use crate::estimation::output_error::Fit;
    use crate::model::Model;

    const ROWS: usize = 2400;

    fn time() -> Vec<f64> {
        (0..ROWS).map(|row| 0.01 * row as f64).collect()
    }

    fn rotor() -> DataSplit {
        let data = at_once((0..ROWS).map(|row| 0.4 + 0.2 * (row / 40 % 2) as f64));
        DataSplit::new(data.clone(), Some(data))
    }

    /// A body that measured rotors drive, or one whose torque is in the log.
    fn body(driven_by_rotors: bool) -> DataSplit {
        let rates = if driven_by_rotors { vec![600.0; ROWS] } else { Vec::new() };
        let source = BodySource {
            torque: (0..ROWS).map(|row| 0.1 * (row / 40 % 2) as f64).collect(),
            torque_slope: vec![0.0; ROWS].into(),
            propagated: vec![0.0; ROWS].into(),
            propeller_rate: [rates.clone(), rates],
            rate: vec![0.1; ROWS].into(),
            time: time().into(),
            ..BodySource::default()
        };
        let data = BlockData::new(Runs::Body(vec![BodyRun::new(0, 0..ROWS, source, 0.4)]));
        DataSplit::new(data.clone(), Some(data))
    }

    /// A set of effects that leaves an rms of `error` times the noise.
    fn leaves(split: &DataSplit, error: f64, effects: &[&str]) -> CandidateFit {
        let count = split.train.len() as f64;
        // The freedom of the initial states is taken off.
        let size = error * ((count - split.train.units().len() as f64) / count).sqrt();
        let residuals = vec![size; split.train.len()];
        let fit = Fit {
            globals: Vec::new(),
            locals: Vec::new(),
            standard_errors: Vec::new(),
            cost: size * size * count,
            residuals: residuals.into(),
            iterations: 0,
        };
        let effects = effects.iter().map(|id| (*id).to_owned()).collect();
        CandidateFit { effects, model: Model::paper(), names: Vec::new(), held_out: fit.clone(), fit }
    }

    /// What was found where the base leaves `before` times the noise and the answer `after`.
    fn found(split: DataSplit, before: f64, after: f64, effects: &[&str], changed: &[&str]) -> SearchResult {
        SearchResult {
            nominal: leaves(&split, before, &[]),
            refitted: leaves(&split, before, &[]),
            singles: Vec::new(),
            answer: leaves(&split, after, effects),
            ladder: Vec::new(),
            alternatives: Vec::new(),
            two_for_one: Vec::new(),
            dropped: Vec::new(),
            floors: [1.0; 2],
            changed: changed.iter().map(|name| (*name).to_owned()).collect(),
            shifts: Vec::new(),
            split,
        }
    }

    /// What is said of that.
    fn said(split: DataSplit, before: f64, after: f64, effects: &[&str], changed: &[&str]) -> Verdict {
        verdict(&found(split, before, after, effects, changed))
    }

    /// Two hundred times the template's inertia is the best that the base can make of it.
    #[test]
    fn a_weight_that_nobody_modelled_is_no_torque_of_the_wrong_sign() {
        let turns_against = |sign: f64, has_angle: bool, inertias: f64| {
            let mut found = found(weighed_down(sign, has_angle), 9.0, 2.0, &["gravity_pendulum"], &[]);
            found.refitted.model.body.inertia *= inertias;
            turns_against_torque(&found)
        };
        assert!(!turns_against(1.0, true, 200.0));
        assert!(turns_against(-1.0, true, 200.0), "the other way round");
        assert!(turns_against(1.0, false, 200.0), "without an angle nobody can tell");
        assert!(!turns_against(-1.0, true, 50.0));
    }

    #[test]
    fn within_a_tenth_of_the_noise_nothing_is_left_to_explain() {
        assert_eq!(said(rotor(), 1.09, 1.09, &[], &[]), Verdict::Adequate);
        assert_eq!(said(rotor(), 1.09, 1.09, &[], &["pole"]), Verdict::ParametersChanged);
        assert_eq!(said(rotor(), 1.11, 1.11, &[], &[]), Verdict::Unknown);
        assert_eq!(said(rotor(), 1.11, 1.11, &[], &["pole"]), Verdict::Unknown);
        // Two effects that take half of what little there is.
        assert_eq!(said(rotor(), 1.2, 1.09, &["static_offset"], &[]), Verdict::MissingEffect);
        assert_eq!(said(rotor(), 1.2, 1.11, &["static_offset"], &[]), Verdict::Unknown);
    }

    #[test]
    fn a_body_that_measured_rotors_drive_may_be_a_quarter_over_it() {
        assert_eq!(said(body(true), 1.24, 1.24, &[], &[]), Verdict::Adequate);
        assert_eq!(said(body(true), 1.26, 1.26, &[], &[]), Verdict::Unknown);
        assert_eq!(said(body(false), 1.24, 1.24, &[], &[]), Verdict::Unknown);
        assert_eq!(said(body(false), 1.09, 1.09, &[], &[]), Verdict::Adequate);
    }

    /// A body that measured rotors drive, at another angle in each of its windows, twice; and what an answer leaves of it: 1.2 times the noise,
    /// a third of that a torque which goes with `of` an angle \[rad\] and a number of the window.
    fn leaves_torque(of: impl Fn(f64, usize) -> f64, is_one_log: bool) -> Verdict {
        let angle = |log: usize, window: usize| 0.5 * (1.7 * ((window + 500 * log) * window) as f64).sin();
        let data = [0, 1].map(|log| {
            let source = BodySource {
                torque: (0..ROWS).map(|row| 0.1 * (row / 40 % 2) as f64).collect(),
                torque_slope: vec![0.0; ROWS].into(),
                propagated: vec![0.0; ROWS].into(),
                propeller_rate: [vec![600.0; ROWS], vec![600.0; ROWS]],
                rate: vec![0.1; ROWS].into(),
                angle: (0..ROWS).map(|row| angle(log, row / 40)).collect::<Vec<f64>>().into(),
                time: time().into(),
            };
            BlockData::new(Runs::Body(vec![BodyRun::new(log, 0..ROWS, source, 0.4)]))
        });
        let left = [0, 1].map(|log| {
            let mut left = vec![0.0; data[log].len()];
            for (window, unit) in data[log].units().iter().enumerate() {
                let rows = unit.len() / 2;
                for row in 0..rows {
                    // A torque that is not known makes the rate run away from where its window begins.
                    let runs_away = of(angle(log, window), window) * (row as f64 / rows as f64 - 0.5);
                    left[unit.start + row] = noise(unit.start + row) + 1.5 * runs_away;
                }
            }
            left
        });
        let [train, validate] = data;
        let split = DataSplit::new(train, (!is_one_log).then_some(validate));
        let mut answer = leaves(&split, 1.0, &["ground_effect"]);
        let [fitted, held_out] = left;
        answer.held_out.residuals = if is_one_log { fitted.clone().into() } else { held_out.into() };
        answer.fit.residuals = fitted.into();
        let mut found = found(split, 9.0, 1.0, &[], &[]);
        found.answer = answer;
        let over = found.over_floor(&found.answer).0;
        assert!((THRESHOLDS.at_floor..found.at_floor()).contains(&over), "{over}");
        verdict(&found)
    }

    #[test]
    fn what_is_left_of_a_driven_body_may_come_from_its_rotors_and_not_from_where_it_is() {
        for is_one_log in [false, true] {
            assert_eq!(leaves_torque(|angle, _| 4.0 * angle, is_one_log), Verdict::Unknown);
            let another = |_, window: usize| 2.0 * (2.9 * (window * window) as f64).cos();
            assert_eq!(leaves_torque(another, is_one_log), Verdict::MissingEffect);
        }
    }

    #[test]
    fn short_of_the_noise_an_effect_must_explain_nineteen_parts_of_twenty_and_come_near_it() {
        // Of 15 parts of squared error above the noise 94 and 96 %; and of 99, which leaves 2.2 times the noise.
        let named = Verdict::MissingEffect;
        for (before, share, said_to_be) in
            [(4.0_f64, 0.94, Verdict::Unknown), (4.0, 0.96, named), (10.0, 0.96, Verdict::Unknown)]
        {
            let left = (before * before - share * (before * before - 1.0)).sqrt();
            assert_eq!(said(rotor(), before, left, &["static_offset"], &[]), said_to_be, "{share}");
            assert_eq!(
                said(rotor(), before, left, &[], &["pole"]),
                Verdict::Unknown,
                "numbers alone, {share}"
            );
        }
    }

    #[test]
    fn one_block_that_nothing_explains_makes_the_whole_unknown() {
        use Verdict::{Adequate, InsufficientData, MissingEffect, ParametersChanged, Unknown};
        assert_eq!(joint(&[Adequate, MissingEffect, Unknown]), Unknown);
        assert_eq!(joint(&[Adequate, ParametersChanged, MissingEffect]), MissingEffect);
        assert_eq!(joint(&[InsufficientData, Adequate]), Adequate);
        assert_eq!(joint(&[InsufficientData]), InsufficientData);
        assert_eq!(joint(&[]), InsufficientData);
    }
}
