//! What a law adds to the torque on a body that moves as it was measured. A strong law of the angle leads the free run of a model without
//! it elsewhere within a window: there it would meet other teeth than the body did. What the body met is in the log.

use std::sync::Arc;

use super::law::{CandidateLaw, LawTerm};
use crate::diagnose::block_data::{BlockData, Runs};
use crate::diagnose::body_block::{BodyPath, BodyRun};
use crate::effect::signals;
use crate::effect::{Expression, Point, Site};
use crate::model::{BodyInput, Model};

/// The torque [N m] that each run has more, mean over the interval after each sample.
pub(crate) type Torques = Vec<Vec<f64>>;

/// What one coefficient of a law adds to the torque of each run, per unit of it; `None` where the law acts elsewhere, remembers, or
/// looks at what was not measured.
pub(crate) fn torques(
    data: &BlockData,
    model: &Model,
    law: &CandidateLaw,
    coefficient: usize,
) -> Option<Torques> {
    let Runs::Body(runs) = &data.runs else { return None };
    let is_force = matches!(law.site, Site::Torque | Site::Thrust);
    if !is_force || law.terms.iter().any(LawTerm::remembers) {
        return None;
    }
    let names = law.coefficient_names();
    let alone: Vec<f64> = (0..names.len()).map(|at| f64::from(u8::from(at == coefficient))).collect();
    let user = law.user_effect("law", &alone);
    let names: Vec<&str> = user.parameters.iter().map(|it| it.name.as_str()).collect();
    let numbers: Vec<f64> = user.parameters.iter().map(|it| it.start).collect();
    let expression = Expression::parse(&user.expression, &names).ok()?;
    let seen = |signal: &str| law.channels().iter().any(|channel| channel.signal == signal);
    let moves = seen(signals::BODY_ANGLE) || seen(signals::BODY_RATE);
    let is_seen = |run: &BodyRun| {
        (!seen(signals::BODY_ANGLE) || run.path().angle.len() == run.input.time.len())
            && (law.site != Site::Thrust || run.input.propeller_rate.iter().all(|rates| !rates.is_empty()))
    };
    let of = |run: &BodyRun| {
        let value = |point: &Point| expression.value(&numbers, point);
        let path = run.path();
        let mean =
            |point: Point, row: usize| if moves { mean(path, point, row, &value) } else { value(&point) };
        let arm = model.body.arm;
        let rows = 0..run.input.time.len();
        let torques: Vec<f64> = match law.site {
            Site::Thrust => rows
                .map(|row| {
                    let side = |rotor: usize| {
                        let propeller_rate = run.input.propeller_rate[rotor][row];
                        mean(Point { propeller_rate, ..held(&run.input, row) }, row)
                    };
                    arm * (side(0) - side(1))
                })
                .collect(),
            _ => rows.map(|row| mean(held(&run.input, row), row)).collect(),
        };
        torques.iter().all(|torque| torque.is_finite()).then_some(torques)
    };
    runs.iter().map(|run| is_seen(run).then(|| of(run)).flatten()).collect()
}

/// What the interval after a row holds, as the simulation of the body holds it.
fn held(input: &BodyInput, row: usize) -> Point {
    let at = |values: &[f64]| values.get(row).copied().unwrap_or(0.0);
    Point {
        time: at(&input.time),
        torque: at(&input.torque),
        propeller_rate_1: at(&input.propeller_rate[0]),
        propeller_rate_2: at(&input.propeller_rate[1]),
        ..Point::default()
    }
}

/// The mean of a law over the interval after a row, by Simpson's rule: the body goes straight on between two samples.
fn mean(path: &BodyPath, held: Point, row: usize, value: &dyn Fn(&Point) -> f64) -> f64 {
    let between = |values: &[f64], share: f64| {
        let now = values.get(row).copied().unwrap_or(0.0);
        let next = values.get(row + 1).copied().unwrap_or(now);
        now + share * (next - now)
    };
    let at = |share: f64| {
        let (body_angle, body_rate) = (between(&path.angle, share), between(&path.rate, share));
        value(&Point { body_angle, body_rate, ..held })
    };
    (at(0.0) + 4.0 * at(0.5) + at(1.0)) / 6.0
}

/// The data of a body on which these torques act, too, `share` times.
pub(crate) fn with_torques(data: &BlockData, torques: &Torques, share: f64) -> BlockData {
    let mut data = data.clone();
    if let Runs::Body(runs) = &mut data.runs {
        for (run, more) in runs.iter_mut().zip(torques) {
            let mut input = BodyInput::clone(&run.input);
            input.torque.iter_mut().zip(more).for_each(|(torque, more)| *torque += share * more);
            run.input = Arc::new(input);
        }
    }
    data
}

#[cfg(test)]
mod tests {
    use super::super::channels::LawInput;
    use super::super::forms::of_one;
    use super::*;
    use crate::diagnose::body_block::BodySource;

    /// A body that swings 0.4 rad wide in a second, sampled each hundredth; its rotors at 600 and 500 rad/s.
    fn body(has_angle: bool) -> BlockData {
        let time: Vec<f64> = (0..100).map(|row| 0.01 * f64::from(row)).collect();
        let angle: Vec<f64> = time.iter().map(|t| 0.4 * (6.0 * t).sin()).collect();
        let source = BodySource {
            torque: vec![0.0; 100],
            torque_slope: vec![0.0; 100].into(),
            propagated: vec![0.0; 100].into(),
            rate: time.iter().map(|t| 2.4 * (6.0 * t).cos()).collect(),
            propeller_rate: [vec![600.0; 100], vec![500.0; 100]],
            angle: if has_angle { angle.into() } else { Vec::new().into() },
            time: time.into(),
        };
        BlockData::new(Runs::Body(vec![BodyRun::new(0, 0..100, source, 0.4)]))
    }

    fn law(site: Site, channel: &LawInput, form: &str, inner: f64) -> CandidateLaw {
        let mut terms = of_one(channel, &[]).into_iter();
        let mut term = terms.find(|term| term.form == form).expect("a form of the library");
        term.inner.iter_mut().for_each(|number| number.value = inner);
        CandidateLaw { site, terms: vec![term] }
    }

    fn angle() -> LawInput {
        let (signal, log, unit) = ("body_angle", "body_angle_rad", "rad");
        LawInput { signal, log, unit, low: -0.4, high: 0.4, is_signed: true }
    }

    /// Fine teeth go by within a sample: what counts is their mean from one to the next.
    #[test]
    fn fine_teeth_add_their_mean_over_each_interval_of_the_measured_path() {
        let teeth = law(Site::Torque, &angle(), "wave", 60.0);
        for (coefficient, shape) in [(0, f64::sin as fn(f64) -> f64), (1, f64::cos)] {
            let found = torques(&body(true), &Model::paper(), &teeth, coefficient).expect("along the path");
            for row in 0..99 {
                let parts = (0..1000).map(|part| 0.01 * (f64::from(row) + (f64::from(part) + 0.5) / 1000.0));
                let mean = parts.map(|t| shape(60.0 * 0.4 * (6.0 * t).sin())).sum::<f64>() / 1000.0;
                // Simpson's rule where a tooth takes four samples, on straight lines between them.
                let off = (found[0][row as usize] - mean).abs();
                assert!(off < 0.02, "row {row}: {} for {mean}", found[0][row as usize]);
            }
        }
    }

    #[test]
    fn a_law_of_the_thrust_pulls_at_both_arms() {
        let (signal, log, unit) = ("propeller_rate", "propeller_rate_rad_s", "rad/s");
        let rate = LawInput { signal, log, unit, low: 400.0, high: 700.0, is_signed: false };
        let square = law(Site::Thrust, &rate, "square", 0.0);
        let found = torques(&body(true), &Model::paper(), &square, 0).expect("along the path");
        let wanted = Model::paper().body.arm * (600.0_f64.powi(2) - 500.0_f64.powi(2));
        assert!(found[0].iter().all(|torque| (torque / wanted - 1.0).abs() < 1e-12), "{:?}", found[0]);
    }

    #[test]
    fn of_what_was_not_measured_or_acts_elsewhere_there_is_no_path() {
        let teeth = law(Site::Torque, &angle(), "wave", 60.0);
        assert_eq!(torques(&body(false), &Model::paper(), &teeth, 0), None);
        assert_eq!(
            torques(&body(true), &Model::paper(), &CandidateLaw { site: Site::BodyRateSensor, ..teeth }, 0),
            None
        );
    }

    #[test]
    fn torques_are_added_to_those_of_the_rotors() {
        let data = body(true);
        let more = with_torques(&data, &vec![vec![2.0; 100]], 0.25);
        let Runs::Body(runs) = &more.runs else { panic!("a body") };
        assert!(runs[0].input.torque.iter().all(|torque| *torque == 0.5));
        let Runs::Body(before) = &data.runs else { panic!("a body") };
        assert!(before[0].input.torque.iter().all(|torque| *torque == 0.0), "the data themselves stay");
    }
}
