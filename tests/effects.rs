//! What holds for every effect of the catalogue, whatever it is.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rotorbench::effect::{CATALOGUE, Card, Law, Memory, Point, Symmetry, Term, acting_as};
use rotorbench::model::{BodyInput, BodyStart, BodyTrace, Model, RotorInput, RotorStart, RotorTrace};

fn points(count: usize) -> Vec<Point> {
    let mut generator = ChaCha8Rng::seed_from_u64(5);
    let mut draw = |low: f64, high: f64| generator.random_range(low..high);
    let mut point = || Point {
        time: draw(0.0, 10.0),
        command: draw(0.2, 0.9),
        battery_voltage: draw(10.5, 12.6),
        full_voltage: 12.6,
        steady_rate: draw(200.0, 1000.0),
        propeller_rate: draw(200.0, 1000.0),
        pole: 16.0,
        hover_rate: 617.0,
        hover_command: 0.463,
        side: if draw(0.0, 1.0) > 0.5 { 1.0 } else { -1.0 },
        arm: 0.25,
        thrust_coefficient: 1.6e-5,
        thrust: draw(2.0, 10.0),
        propeller_rate_1: draw(400.0, 800.0),
        propeller_rate_2: draw(400.0, 800.0),
        torque: draw(-1.0, 1.0),
        body_angle: draw(-0.8, 0.8),
        body_rate: draw(-2.0, 2.0),
        memory: None,
    };
    (0..count).map(|_| point()).collect()
}

fn starts(card: &Card) -> Vec<f64> {
    card.parameters.iter().map(|parameter| parameter.start).collect()
}

#[test]
fn cards_are_complete_and_their_bounds_hold_their_starts() {
    let ids: Vec<&str> = CATALOGUE.iter().map(|card| card.id).collect();
    for (index, card) in CATALOGUE.iter().enumerate() {
        assert!(!ids[..index].contains(&card.id), "{} is there twice", card.id);
        for text in [
            card.meaning,
            card.equation,
            card.source,
            card.residual,
            card.experiment,
            card.report[0],
            card.report[1],
        ] {
            assert!(!text.is_empty(), "{}", card.id);
        }
        for other in card.confused_with {
            assert!(ids.contains(other) && *other != card.id, "{} names {other}", card.id);
        }
        for parameter in card.parameters {
            let tried = std::iter::once(&parameter.start).chain(parameter.others);
            for start in tried {
                assert!(
                    parameter.lower <= *start && *start <= parameter.upper,
                    "{}.{}",
                    card.id,
                    parameter.name
                );
            }
        }
    }
}

/// A model file with an effect goes wherever a model goes, the emulator among them: an effect that it lacks would be refused there.
#[test]
fn the_emulator_has_every_effect_with_the_parameters_of_its_card() {
    let emulated: std::collections::BTreeMap<_, _> = rotorbench::emulate::catalogue().collect();
    for card in CATALOGUE {
        let own: Vec<&str> = card.parameters.iter().map(|parameter| parameter.name).collect();
        assert_eq!(emulated.get(card.id), Some(&own), "{}", card.id);
    }
    assert_eq!(emulated.len(), CATALOGUE.len());
}

#[test]
fn at_its_neutral_value_an_effect_adds_nothing() {
    let mut held = 0;
    for card in CATALOGUE {
        for (index, parameter) in
            card.parameters.iter().enumerate().filter(|(_, parameter)| !parameter.neutral.is_nan())
        {
            let mut parameters = starts(card);
            parameters[index] = parameter.neutral;
            for point in points(50) {
                let added = match &card.law {
                    Law::Static(law) | Law::Stiff(law) | Law::PiecewiseConstant(law) => {
                        law(&parameters, &point)
                    }
                    Law::Delay(delay) => delay(&parameters),
                    Law::Memory(memory) => {
                        let state = (memory.steady_state)(
                            &parameters,
                            &Point { steady_rate: 1.0, torque: 0.1, ..point },
                        );
                        let state = (memory.advance)(
                            &parameters,
                            state,
                            &point,
                            (memory.transition)(&parameters, 0.01),
                        );
                        // A limit of infinity times no time is the only way to leave a lag behind.
                        (memory.add)(&parameters, state, &point)
                    }
                    Law::Expression(_) => 0.0,
                };
                assert!(added.abs() < 1e-9, "{}: {added}", card.id);
                held += 1;
            }
        }
    }
    assert!(held > 20 * 50, "most effects have a neutral value");
}

#[test]
fn declared_symmetries_hold() {
    for card in CATALOGUE {
        let (Law::Static(law) | Law::Stiff(law)) = &card.law else {
            assert_eq!(
                card.symmetry,
                Symmetry::None,
                "{}: only laws without memory can be held to it",
                card.id
            );
            continue;
        };
        let parameters = starts(card);
        for point in points(100) {
            let turned = Point { body_angle: -point.body_angle, body_rate: -point.body_rate, ..point };
            let (added, back) = (law(&parameters, &point), law(&parameters, &turned));
            match card.symmetry {
                Symmetry::None => {}
                Symmetry::OddInBodyMotion => assert!((added + back).abs() < 1e-12, "{}", card.id),
                Symmetry::Dissipative => {
                    assert!((added + back).abs() < 1e-12, "{}", card.id);
                    assert!(added * point.body_rate <= 0.0, "{} feeds energy in", card.id);
                }
            }
        }
    }
}

/// What a term adds, as the books have it.
fn by_the_book(term: Term, p: &[f64], point: &Point) -> Option<f64> {
    let Point { command: u, body_angle, body_rate, .. } = *point;
    Some(match term {
        Term::DeadTime | Term::Lag | Term::SlewLimit => return None,
        Term::Constant => p[0],
        Term::VoltageDrop => -p[0] * (point.full_voltage - point.battery_voltage),
        Term::VoltageScaling => u * point.battery_voltage / point.full_voltage - u,
        Term::DeadZone => (u - p[0]).max(0.0) / (1.0 - p[0]) - u,
        Term::Saturation => u.min(p[0]) - u,
        Term::Cubic => p[0] * (u - point.hover_command).powi(3),
        Term::CoulombFriction => -p[0] * (body_rate / p[1]).tanh(),
        Term::ViscousFriction => -p[0] * body_rate,
        Term::QuadraticDrag => -p[0] * body_rate * body_rate.abs(),
        Term::Pendulum => -p[0] * (body_angle + p[1]).sin(),
        Term::Stiffness => -p[0] * body_angle,
        Term::AxialDamping => {
            let speed = point.side * point.arm * body_rate;
            -p[0] * point.thrust_coefficient * point.propeller_rate * speed
        }
    })
}

/// What a lag has still to go, a tenth of a second after what it follows has risen from nothing to one.
fn behind_a_step(memory: &Memory, pole: f64) -> f64 {
    let at = |value: f64| Point {
        steady_rate: value,
        propeller_rate: value,
        torque: value,
        body_rate: value,
        ..Point::default()
    };
    let rest = (memory.steady_state)(&[pole], &at(0.0));
    let state = (memory.advance)(&[pole], rest, &at(1.0), (memory.transition)(&[pole], 0.1));
    -(memory.add)(&[pole], state, &at(1.0))
}

/// Other rooms go by the term and never look at the law.
#[test]
fn what_a_card_says_it_acts_as_is_what_its_law_does() {
    let mut held = 0;
    for card in CATALOGUE {
        let Some(term) = card.acts_as else { continue };
        held += 1;
        let found = acting_as(card.site, term).map(|card| card.id);
        assert_eq!(found, Some(card.id), "two effects are the same term at the same site");
        let parameters = starts(card);
        match (term, &card.law) {
            (Term::DeadTime, Law::Delay(delay)) => assert_eq!(delay(&[0.02]), 0.02, "{}", card.id),
            (Term::Lag, Law::Memory(memory)) => {
                let left = behind_a_step(memory, 16.0);
                assert!((left - (-1.6_f64).exp()).abs() < 1e-12, "{}: {left}", card.id);
            }
            (Term::SlewLimit, Law::Memory(memory)) => {
                // A tenth of a second behind a step to one, at a quarter a second.
                let left = behind_a_step(memory, 0.25);
                assert!((left - 0.975).abs() < 1e-12, "{}: {left}", card.id);
            }
            (_, Law::Static(law) | Law::Stiff(law)) => {
                for point in points(100) {
                    let expected = by_the_book(term, &parameters, &point).expect("a term without memory");
                    let apart = (law(&parameters, &point) - expected).abs();
                    assert!(apart <= 1e-12 * expected.abs().max(1.0), "{} at {point:?}", card.id);
                }
            }
            (term, law) => panic!("{}: {law:?} is no {term:?}", card.id),
        }
    }
    assert!(held > 15, "{held}");
}

/// What a log of the effect's block would read, over a command that goes up, down and to both ends.
fn simulate(model: &Model, rotor: bool) -> Vec<f64> {
    let time: Vec<f64> = (0..1500).map(|row| 0.02 * f64::from(row)).collect();
    let equations = model.equations().expect("known effects");
    let wave = |at: f64| 0.5 + 0.22 * (0.7 * at).sin() + if (at * 0.9).sin() > 0.0 { 0.12 } else { -0.12 };
    if rotor {
        let command: Vec<f64> = time.iter().map(|at| wave(*at)).collect();
        let voltage: Vec<f64> = time.iter().map(|at| 12.5 - 0.05 * at).collect();
        let input = RotorInput {
            time: &time,
            command: &command,
            command_from: None,
            voltage: Some(&voltage),
            side: 1.0,
        };
        let mut trace = RotorTrace::default();
        equations.simulate_rotor(
            &input,
            &RotorStart { rate: Some(500.0), ..RotorStart::default() },
            &mut trace,
        );
        return trace.measured;
    }
    let torque: Vec<f64> = time.iter().map(|at| 0.3 * (2.0 * at).sin() + 0.1 * (5.3 * at).cos()).collect();
    let rates = |sign: f64| -> Vec<f64> {
        torque.iter().map(|torque| 617.0 + sign * torque / (0.5 * 0.0197)).collect()
    };
    let input = BodyInput {
        torque: equations.torque_means(&time, &torque, &vec![0.0; time.len()]),
        propeller_rate: [rates(1.0), rates(-1.0)],
        time: time.into(),
    };
    let mut trace = BodyTrace::default();
    for window in 0..75 {
        let start = BodyStart { angle: 0.3 * f64::from(window - 37) / 37.0, rate: 0.5, sensor: 0.0 };
        equations.simulate_body(&input, 20 * window as usize, 20 * (window as usize + 1), &start, &mut trace);
    }
    trace.rate.extend(trace.angle);
    trace.rate
}

/// An effect that a fit can find moves the simulation, smoothly: difference quotients of two sizes agree. A grid
/// has no slope, so the quantization is only asked to move.
#[test]
fn every_parameter_moves_the_simulation_smoothly() {
    for card in CATALOGUE {
        let base = Model::paper();
        let model = base.with(&base.effect(card.id).expect("in the catalogue"));
        let rotor = card.site.is_rotor();
        let still = simulate(&base, rotor);
        let with = simulate(&model, rotor);
        let moved = with.iter().zip(&still).map(|(with, still)| (with - still).abs()).fold(0.0, f64::max);
        assert!(moved > 1e-6, "{} does nothing", card.id);
        for parameter in card.parameters.iter().filter(|_| !matches!(card.law, Law::PiecewiseConstant(_))) {
            let name = format!("{}.{}", card.id, parameter.name);
            let quotient = |share: f64| -> Vec<f64> {
                let step = share * parameter.start.abs().max(0.1);
                let mut other = model.clone();
                other.set_parameter(&name, parameter.start + step);
                simulate(&other, rotor).iter().zip(&with).map(|(other, with)| (other - with) / step).collect()
            };
            let (coarse, fine) = (quotient(1e-4), quotient(1e-6));
            let size = fine.iter().map(|slope| slope * slope).sum::<f64>();
            let apart = coarse.iter().zip(&fine).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            // One percent: a corner of the law may pass a sample within the coarse step.
            assert!(apart <= 1e-4 * size, "{name}: {apart} of {size}");
        }
    }
}

/// Two laws on the command: one creeps with time, the other is a limit.
fn creeping() -> Model {
    let law = "[[user_effects]]\nid = \"creep\"\nsite = \"command\"\nexpression = \"0.01*time_s\"\n\
               [[effects]]\nid = \"creep\"\nparameters = {}\n\
               [[effects]]\nid = \"command_saturation\"\nparameters = { limit = 0.68 }\n";
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("creep.toml");
    Model::paper().save(&path).expect("written");
    let text = std::fs::read_to_string(&path).expect("read") + "\n" + law;
    std::fs::write(&path, text).expect("written");
    Model::load(&path).expect("a model")
}

/// A rotor that merely lags has a way of its own through the simulation, without what it does not need. One whose command is
/// a picosecond late takes the long way. It is 5000 rad/s² times that behind, and spans that differ by 1e-9 of themselves
/// share their exponential: 1e-9 of a third of 300 rad/s.
#[test]
fn the_short_way_of_a_rotor_that_merely_lags_gives_what_the_long_one_gives() {
    let time: Vec<f64> = (0..800).map(|row| 0.02 * f64::from(row) + 0.002 * f64::from(row % 7)).collect();
    let command: Vec<f64> = time.iter().map(|at| 0.5 + 0.2 * (0.7 * at).sin()).collect();
    let voltage: Vec<f64> = time.iter().map(|at| 12.5 - 0.05 * at).collect();
    for (model, voltage) in [(Model::paper(), None), (creeping(), Some(voltage.as_slice()))] {
        let delay = model.effect("transport_delay").expect("in the catalogue");
        let mut late = model.with(&delay);
        late.set_parameter("transport_delay.delay", 1e-12);
        let run = |model: &Model| {
            let mut trace = RotorTrace::default();
            let input = RotorInput { time: &time, command: &command, command_from: None, voltage, side: 1.0 };
            let start = RotorStart { rate: Some(500.0), ..RotorStart::default() };
            model.equations().expect("known effects").simulate_rotor(&input, &start, &mut trace);
            trace
        };
        let (short, long) = (run(&model), run(&late));
        for (short, long) in
            [(&short.rate, &long.rate), (&short.measured, &long.measured), (&short.mean, &long.mean)]
        {
            assert_eq!((short.len(), long.len()), (time.len(), time.len()));
            let apart = short.iter().zip(long).map(|(short, long)| (short - long).abs());
            let apart = apart.fold(0.0, f64::max);
            assert!(apart < 1e-6, "{apart}");
        }
    }
}

/// What a user's law on the command is told of time: the rotor settles where the command has crept to.
#[test]
fn a_law_on_the_command_knows_the_time() {
    let model = creeping();
    let equations = model.equations().expect("known effects");
    let time: Vec<f64> = (0..500).map(|row| 0.02 * f64::from(row)).collect();
    let input =
        RotorInput { time: &time, command: &vec![0.5; 500], command_from: None, voltage: None, side: 1.0 };
    let mut trace = RotorTrace::default();
    equations.simulate_rotor(&input, &RotorStart::default(), &mut trace);
    // Behind the slow ramp by 1/16 s: 0.01 / 16 of the command, on a slope of 1600 rad/s, is 1 rad/s.
    let u = 0.5 + 0.01 * time[499];
    let settled = 1124.5 * u + 447.1 * u * u;
    assert!((trace.rate[499] - settled).abs() < 2.0, "{} of {settled}", trace.rate[499]);
    assert!(settled - trace.rate[0] > 100.0);
}
