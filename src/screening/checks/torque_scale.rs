//! A torque, an arm or an inertia that is off by a power of ten beside a model.

use crate::model::Model;
use crate::screening::plausibility::is_another;
use crate::screening::suspicion::{Stops, Suspicion};
use crate::screening::thresholds::THRESHOLDS;
use crate::screening::{Finding, ScreenedLog, torque_response};
use crate::signal::columns::BODY_RATE;
use crate::unit::Unit;

/// The unit of torques that is a power of ten of the right one.
const MILLI: &str = "mN m";

/// A body that speeds up ten times as fast as the model's torque over J makes it, or a hundred times, or a tenth: what is searched for
/// beside such a model is the unit. One that is two or three times as heavy has changed, and `diagnose` says so. Who makes a model of the
/// bench finds its J, whatever the unit of the torque.
pub(crate) fn check(log: &ScreenedLog, model: &Model) -> Option<Suspicion> {
    // What a law of the user's own makes of the torque is not known here.
    let body = log.body().filter(|body| model.user_effects.is_empty() && !body.is_held())?;
    let ratio = torque_response::ratio(log, model)?;
    let exponent = ratio.log10().round();
    let power = 10_f64.powi(exponent as i32);
    // A bench's own scale may be some eight times another's; a hundred times is nobody's.
    let near = if exponent.abs() > 1.0 { THRESHOLDS.torque_power_far } else { THRESHOLDS.torque_power_near };
    let finding = Finding::new("torque_scale", BODY_RATE).of(log.source_name());
    let finding =
        finding.with("ratio", ratio).with("power", power).with("driven_by", body.driven_by().code());
    let finding = finding.with("inertia_kg_m2", model.body.inertia).with("arm_m", model.body.arm);
    let is_milli = Unit::parse(MILLI, "N m").is_ok_and(|unit| !is_another(&(power / unit.to_si(1.0)), near));
    let finding = finding.with("unit", if is_milli { MILLI } else { "" });
    let is_unit = exponent != 0.0 && !is_another(&(ratio / power), near);
    is_unit.then_some(Suspicion { finding, stops: Stops::Searches })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::tests::noise_of as noise;
    use crate::signal::columns::{BODY_ANGLE, PROPELLER_RATES, TORQUE_COMMAND};

    /// What acts on a body of the paper's J beside its torque: a pendulum's moment [N m], a friction's torque [N m], and how late [rows]
    /// the torque comes.
    type Beside = (f64, f64, usize);

    /// 40 s at 100 Hz of levels of torque on such a body; `columns` are what is written of torque, rate and angle.
    fn log((moment, friction, late): Beside, columns: [f64; 3]) -> Dataset {
        let torque = |row: usize| 0.15 * noise(row / 9, 1);
        let (mut angle, mut rate) = (0.0_f64, 0.0_f64);
        let mut written: [Vec<f64>; 3] = Default::default();
        for row in 0..4000 {
            let read = [torque(row), rate + 0.004 * noise(row, 2), angle + 1e-4 * noise(row, 3)];
            written
                .iter_mut()
                .zip(read)
                .zip(columns)
                .for_each(|((all, read), factor)| all.push(factor * read));
            for _ in 0..20 {
                let drag = friction * (rate / 0.02).tanh() + 0.02 * rate;
                rate += 5e-4 * (torque(row.saturating_sub(late)) - moment * angle.sin() - drag) / 0.032;
                angle += 5e-4 * rate;
            }
        }
        let time = (0..4000).map(|row| 0.01 * f64::from(row)).collect();
        let [torque, rate, angle] = written;
        Dataset::made(time, [(TORQUE_COMMAND, torque), (BODY_RATE, rate), (BODY_ANGLE, angle)])
    }

    /// The ratio that is asked about.
    fn asked(log: &Dataset, model: &Model) -> Option<f64> {
        let found = check(&ScreenedLog::of(log), model)?;
        assert_eq!((found.finding.code, found.stops), ("torque_scale", Stops::Searches));
        Some(found.finding.number("power"))
    }

    const BENCHES: [Beside; 5] =
        [(0.0, 0.0, 0), (0.4, 0.0, 0), (3.0, 0.0, 2), (0.4, 0.05, 0), (0.4, 0.02, 5)];

    #[test]
    fn a_power_of_ten_is_asked_about_beside_other_effects() {
        let paper = Model::paper();
        for bench in BENCHES {
            assert_eq!(asked(&log(bench, [1.0; 3]), &paper), None, "{bench:?}");
            for (factor, power) in [(1e3, 1e-3), (10.0, 0.1), (0.1, 10.0), (1e-3, 1e3), (102.0, 0.01)] {
                let found = asked(&log(bench, [factor, 1.0, 1.0]), &paper);
                assert_eq!(found, Some(power), "{bench:?} {factor}");
            }
        }
    }

    #[test]
    fn a_body_that_has_changed_is_not_asked_about() {
        let right = log((0.4, 0.02, 2), [1.0; 3]);
        for (inertia, power) in [
            (0.32, Some(10.0)),
            (0.0032, Some(0.1)),
            (0.064, None),
            (0.1, None),
            (0.011, None),
            (0.26, None),
            (1.3, None),
        ] {
            let mut model = Model::paper();
            model.body.inertia = inertia;
            assert_eq!(asked(&right, &model), power, "{inertia}");
        }
    }

    #[test]
    fn a_gyro_of_another_scale_is_no_torque_of_another() {
        let paper = Model::paper();
        assert_eq!(asked(&log((0.4, 0.0, 0), [1.0, 10.0, 1.0]), &paper), None);
        assert_eq!(asked(&log((0.4, 0.0, 0), [1.0, 0.1, 1.0]), &paper), None);
    }

    #[test]
    fn a_torque_that_does_not_move_the_body_says_nothing() {
        let mut other = log((0.4, 0.0, 0), [1.0; 3]);
        let torque = (0..4000).map(|row| 1.5 * noise(row / 9, 7)).collect();
        other.replace(TORQUE_COMMAND, torque).expect("as long as before");
        assert_eq!(asked(&other, &Model::paper()), None);
    }

    #[test]
    fn an_arm_that_is_off_by_ten_is_asked_about() {
        let right = log((0.4, 0.02, 0), [1.0; 3]);
        let paper = Model::paper();
        let lever = paper.body.arm * paper.actuator.thrust_coefficient;
        let torque = right.column(TORQUE_COMMAND).expect("there");
        // Thrusts about 6 N, apart by what makes that torque, and held for the row as it is.
        let rate = |side: f64| {
            torque.iter().map(|it| (3.8e5 + side * 0.5 * it / lever).sqrt()).collect::<Vec<f64>>()
        };
        let body = |name: &str| right.column(name).expect("there").to_vec();
        let log = Dataset::made(
            right.time().to_vec(),
            [
                (PROPELLER_RATES[0], rate(1.0)),
                (PROPELLER_RATES[1], rate(-1.0)),
                (BODY_RATE, body(BODY_RATE)),
                (BODY_ANGLE, body(BODY_ANGLE)),
            ],
        );
        assert_eq!(asked(&log, &paper), None);
        for (arm, power) in [(2.5, 0.1), (0.025, 10.0)] {
            let mut model = paper.clone();
            model.body.arm = arm;
            assert_eq!(asked(&log, &model), Some(power), "{arm}");
        }
    }
}
