//! Section III.B against alternative model structures on a rotor with a dead time: pole and delay come out together, and the model has both.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rotorbench::identify::{Identification, IdentifySettings, identify};
use rotorbench::log::Dataset;
use rotorbench::screening::screened;

use super::close;
use super::logs::{C_G1, C_G2, PERIOD, POLE, dataset, exciting, finding, voltage, z};

/// [s] one and a half samples and a bit.
const DELAY: f64 = 0.033;
/// [rad/s] rms of the noise.
const NOISE: f64 = 1.5;
/// Codes of a delay that the model has, and of something that a lag lacks.
const IN_MODEL: &str = "dead_time_in_model";
const NOT_ENOUGH: &str = "first_order_lag_insufficient";

/// What else a bench may have.
#[derive(Clone, Copy, Default)]
struct Bench {
    /// [s]
    delay: f64,
    /// [s] time constant of a second lag, zero: none.
    second: f64,
    /// [-] share by which the pole is slower on the way down.
    asymmetry: f64,
}

/// `samples` rows of a bench in steps of 0.1 ms by the midpoint rule, with noise on the rates.
fn run(bench: Bench, seed: u64, samples: usize) -> Dataset {
    let step = PERIOD / 200.0;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // Each run has a part of its own of the levels that nobody can foretell.
    let command = |t: f64| exciting(t + 1000.0 * seed as f64);
    let mut rate = z(command(0.0), voltage(0.0));
    let mut shown = rate;
    let mut rates = Vec::new();
    for k in 0..samples {
        let noise: f64 = random.sample(StandardNormal);
        rates.push(if bench.second > 0.0 { shown } else { rate } + NOISE * noise);
        for j in 0..200 {
            let now = k as f64 * PERIOD + (f64::from(j) + 0.5) * step;
            // Before the first command has arrived, the rotor is where it puts it.
            let sent = ((now - bench.delay) / PERIOD).floor().max(0.0) * PERIOD;
            let steady = z(command(sent), voltage(now));
            let pole = if steady < rate { POLE * (1.0 - bench.asymmetry) } else { POLE };
            let before = rate;
            let middle = rate + 0.5 * step * pole * (steady - rate);
            rate += step * pole * (steady - middle);
            if bench.second > 0.0 {
                shown += step / bench.second * (0.5 * (before + rate) - shown);
            }
        }
    }
    dataset("delayed.csv", &command, rates)
}

fn found(logs: &[Dataset], validation: &[Dataset], delay: bool) -> Identification {
    let settings = IdentifySettings { degree: Some(2), delay, ..IdentifySettings::default() };
    identify(&screened(logs), &screened(validation), &settings).expect("identified")
}

#[test]
fn eq_10_with_a_delay_has_the_pole_and_the_delay_in_the_model() {
    let bench = Bench { delay: DELAY, ..Bench::default() };
    let (log, other) = (run(bench, 1, 6000), run(bench, 2, 3000));
    let found = found(&[log], &[other], true);
    let joint = found.joint.as_ref().expect("exciting commands");
    let fitted = joint.delay.as_ref().expect("a delay of one and a half samples");
    println!("{fitted:?} {:?}", joint.pole);
    // 3.3 standard errors: one in a thousand each.
    assert!(fitted.delay.distance(DELAY) < 3.3 && fitted.delay.standard_error < 2e-4, "{fitted:?}");
    assert!(joint.pole.distance(POLE) < 3.3 && joint.pole.standard_error < 0.01 * POLE, "{:?}", joint.pole);
    assert!(joint.coefficients[0].distance(C_G2) < 3.3, "{:?}", joint.coefficients);
    assert!(joint.coefficients[1].distance(C_G1) < 3.3, "{:?}", joint.coefficients);
    // A lag alone makes up for the delay.
    assert!(fitted.pole_without.value < 0.8 * POLE, "{fitted:?}");
    let in_model = finding(&found, IN_MODEL).expect("the delay is found");
    assert_eq!(in_model.number("delay_ms"), 1e3 * fitted.delay.value);
    assert!(finding(&found, NOT_ENOUGH).is_none(), "{:?}", found.findings);

    let model = &found.model;
    assert_eq!(model.parameter("transport_delay.delay"), Some(fitted.delay.value));
    assert_eq!(model.actuator.pole, joint.pole.value);
    model.check().expect("a model that can be");
    let [rung] = model.ladder.as_slice() else { panic!("one rung: {:?}", model.ladder) };
    assert_eq!(rung.added, ["transport_delay"]);
    // Noise of 1.5 rad/s is left over by the one, much more by the other.
    close(rung.error.train_after, NOISE, 0.05);
    close(rung.error.validate_after, NOISE, 0.06);
    assert!(rung.error.train_before > 3.0 * NOISE && rung.error.validate_before > 3.0 * NOISE, "{rung:?}");
    let back = model.step_back().expect("a rung");
    assert!(back.effects.is_empty());
    close(back.actuator.pole, fitted.pole_without.value, 1e-12);
    // What the free run of the report shows is the model with its delay.
    close(found.validation[0].rms, NOISE, 0.06);
}

#[test]
fn a_delay_is_left_out_when_asked_and_where_more_than_a_delay_is_missing() {
    let bench = Bench { delay: DELAY, ..Bench::default() };
    let without = found(&[run(bench, 3, 3000)], &[], false);
    assert!(without.model.effects.is_empty() && without.model.ladder.is_empty());
    let missing = finding(&without, NOT_ENOUGH).expect("a delay is missing");
    let delay = missing.texts("effects").iter().position(|it| it == "transport_delay").expect("the delay");
    assert!((33.0..34.0).contains(&missing.numbers("times_ms")[delay]), "{missing:?}");

    // A third slower on the way down, and delayed: a delay does not explain that, and is not put into the model.
    let skewed = found(&[run(Bench { asymmetry: 0.35, ..bench }, 4, 3000)], &[], true);
    assert!(skewed.model.effects.is_empty(), "{:?}", skewed.model.effects);
    assert!(
        finding(&skewed, NOT_ENOUGH).is_some() && finding(&skewed, "rotor_residual_correlated").is_some()
    );

    // A second lag of 25 ms looks like a delay, and more like a second lag.
    let lagged = found(&[run(Bench { second: 0.025, ..Bench::default() }, 5, 3000)], &[], true);
    assert!(lagged.model.effects.is_empty(), "{:?}", lagged.model.effects);
    let missing = finding(&lagged, NOT_ENOUGH).expect("a lag is missing");
    assert!(missing.texts("effects").iter().any(|it| it == "second_order_lag"), "{missing:?}");

    // No delay, no word of it.
    let punctual = found(&[run(Bench::default(), 6, 3000)], &[], true);
    assert!(punctual.model.effects.is_empty(), "{:?}", punctual.model.effects);
    assert!([IN_MODEL, NOT_ENOUGH].iter().all(|code| finding(&punctual, code).is_none()));
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    /// Errors over repeated noise, in standard errors: their mean square is one. That of the pole without the share that the
    /// delay's own error has in it would be far above.
    #[test]
    fn the_standard_errors_of_delay_and_pole_hold_beside_each_other() {
        const RUNS: u64 = 120;
        let bench = Bench { delay: DELAY, ..Bench::default() };
        let of_seeds = |from: u64| {
            let mut squares = [0.0; 2];
            // Every second one: the other thread has those between.
            for seed in (from..RUNS).step_by(2) {
                let found = found(&[run(bench, 10 + seed, 1500)], &[], true);
                let joint = found.joint.expect("exciting commands");
                let fitted = joint.delay.expect("a delay, also where the battery shows only beside it");
                let away = [fitted.delay.distance(DELAY), joint.pole.distance(POLE)];
                squares.iter_mut().zip(away).for_each(|(sum, away)| *sum += away * away / RUNS as f64);
            }
            squares
        };
        let squares = std::thread::scope(|scope| {
            let odd = scope.spawn(|| of_seeds(1));
            let even = of_seeds(0);
            let odd = odd.join().expect("no panic");
            [even[0] + odd[0], even[1] + odd[1]]
        });
        println!("mean squares, delay and pole: {squares:?}");
        // χ² of 120 over 120 has a standard deviation of 0.13: three of them.
        assert!(squares.iter().all(|square| (0.6..1.4).contains(square)), "{squares:?}");
    }
}
