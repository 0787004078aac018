//! Laws outside the catalogue that have no formula in it: paths of chance, vibrations, memory of other kinds.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::catalogue::Kind;
use crate::plant::Outside;

/// Laws outside the catalogue on each bench.
pub const OUTSIDE_ATTITUDE: usize = 7;
pub const OUTSIDE_ACTUATOR: usize = 6;

/// The number of a law for `discover` alone: a relay, of which the library has the formula.
pub const RELAY: usize = 100;

fn path(samples: usize, mut value: impl FnMut(usize) -> f64) -> Vec<f64> {
    (0..samples).map(&mut value).collect()
}

/// A random walk that forgets, with the standard deviation asked for.
fn wander(rng: &mut ChaCha8Rng, samples: usize, size: f64, memory: f64) -> Vec<f64> {
    let keep = (-1.0 / memory).exp();
    let mut at = 0.0;
    path(samples, |_| {
        let kick: f64 = StandardNormal.sample(rng);
        at = keep * at + (1.0 - keep * keep).sqrt() * kick * size;
        at
    })
}

/// The law of this number, drawn: its name, and what it does.
pub fn outside(number: usize, kind: Kind, rng: &mut ChaCha8Rng) -> (&'static str, Outside) {
    let u = |rng: &mut ChaCha8Rng, low: f64, high: f64| rng.random_range(low..high);
    match (kind, number) {
        (Kind::Attitude, 0) => {
            let (size, rate, gate) = (u(rng, 0.03, 0.12), u(rng, 1.2, 4.0), u(rng, 4.0, 9.0));
            (
                "intermittent vibration",
                Outside::TorquePath(path(6_000, |k| {
                    let t = 0.01 * k as f64;
                    if (t / gate).rem_euclid(2.0) < 1.0 { size * (TAU * rate * t).sin() } else { 0.0 }
                })),
            )
        }
        (Kind::Attitude, 1) => {
            let size = u(rng, 0.02, 0.1);
            let memory = u(rng, 20.0, 150.0);
            ("gusts", Outside::TorquePath(wander(rng, 6_000, size, memory)))
        }
        (Kind::Attitude, 2) => {
            let (size, rate, drift) = (u(rng, 0.03, 0.12), u(rng, 0.8, 3.0), u(rng, 0.002, 0.02));
            (
                "swept vibration",
                Outside::TorquePath(path(6_000, |k| {
                    let t = 0.01 * k as f64;
                    size * (TAU * (rate * t + drift * t * t)).sin()
                })),
            )
        }
        (Kind::Attitude, RELAY) => (
            "relay over the angle",
            Outside::Relay([u(rng, 0.03, 0.1), u(rng, -0.05, 0.05), u(rng, 0.05, 0.12)]),
        ),
        (Kind::Actuator, RELAY) => (
            "relay over the command",
            Outside::Relay([u(rng, 6.0, 30.0), u(rng, 0.42, 0.52), u(rng, 0.03, 0.07)]),
        ),
        (Kind::Attitude, 3) => ("cogging", Outside::Cogging(u(rng, 0.02, 0.09), u(rng, 25.0, 60.0))),
        (Kind::Attitude, 4) => {
            ("stick-slip", Outside::StickSlip([u(rng, 0.03, 0.08), u(rng, 2.0, 3.5), u(rng, 3.0, 10.0)]))
        }
        (Kind::Attitude, 5) => {
            ("hysteretic spring", Outside::Hysteresis([u(rng, 0.06, 0.2), u(rng, 0.08, 0.2)]))
        }
        (Kind::Attitude, _) => ("soft stops", Outside::Stops([u(rng, 0.25, 0.36), u(rng, 3.0, 12.0)])),
        (Kind::Actuator, 0) => {
            let size = u(rng, 4.0, 25.0);
            let memory = u(rng, 25.0, 400.0);
            ("wandering controller", Outside::RatePath(wander(rng, 6_000, size, memory)))
        }
        (Kind::Actuator, 1) => {
            let (size, rate) = (u(rng, 5.0, 30.0), u(rng, 0.3, 2.5));
            ("ripple", Outside::RatePath(path(6_000, |k| size * (TAU * rate * 0.02 * k as f64).sin())))
        }
        (Kind::Actuator, 2) => {
            let (size, every) = (u(rng, 60.0, 250.0), rng.random_range(80..300));
            let starts: Vec<usize> = (0..6_000 / every).map(|_| rng.random_range(0..6_000)).collect();
            let length = rng.random_range(3..12);
            (
                "desynchronisation",
                Outside::RatePath(path(6_000, |k| {
                    if starts.iter().any(|s| (*s..*s + length).contains(&k)) { -size } else { 0.0 }
                })),
            )
        }
        (Kind::Actuator, 3) => {
            ("resonance", Outside::Resonance([u(rng, 12.0, 40.0), u(rng, 0.05, 0.25), u(rng, 0.3, 0.8)]))
        }
        (Kind::Actuator, 4) => ("backlash", Outside::Backlash(u(rng, 0.006, 0.03))),
        (Kind::Actuator, _) => {
            ("pole that warms", Outside::WarmPole([u(rng, 0.15, 0.35), u(rng, 5.0, 30.0)]))
        }
    }
}
