//! How much an effect matters: the error over the noise floor that remains when the effect is taken out and
//! everything else is fitted again as well as it can be. An effect that the base can absorb is no effect.

use nalgebra::{DMatrix, DVector};

use crate::catalogue::{Entry, Kind};
use crate::experiment::Truth;
use crate::motion::Row;
use crate::noise::Noise;
use crate::plant::{ARM, Base, HOVER_RATE, Hidden};

/// [s] step of the plant in this search: a hundredth of a per cent on the paper's pole.
const SUBSTEP: f64 = 0.0025;
/// [s] horizon after which the body is put back on the truth: it is unstable by itself.
const HORIZON: f64 = 0.5;
/// Rounds of the search that settle every case tried.
pub const ROUNDS: usize = 6;

/// What is left in the plant, with its parameters free.
pub struct Rest<'a> {
    pub effects: Vec<(&'a Entry, Vec<f64>)>,
    pub base: Base,
}

/// A plant from a vector: five relative changes of the base, then relative changes of the effects.
fn plant(rest: &Rest, p: &DVector<f64>) -> (Base, Hidden) {
    let b = rest.base;
    let base = Base {
        steady: [b.steady[0] * (1.0 + p[0]), b.steady[1] * (1.0 + p[1])],
        voltage_gain: b.voltage_gain * (1.0 + p[2]),
        pole: b.pole * (1.0 + p[3]).max(0.05),
        inertia: b.inertia * (1.0 + p[4]).max(0.05),
        ..b
    };
    let mut hidden = Hidden::nothing();
    let mut next = 5;
    for (entry, values) in &rest.effects {
        let moved: Vec<f64> =
            values.iter().enumerate().map(|(i, v)| v * (1.0 + p[next + i]).max(0.05)).collect();
        next += values.len();
        (entry.hide)(&mut hidden, &moved);
    }
    (base, hidden)
}

fn run(truth: &Truth, base: &Base, hidden: &Hidden) -> Vec<Row> {
    let every = (HORIZON / truth.inputs.period).round() as usize;
    let restart = (truth.inputs.kind == Kind::Attitude).then_some((every, truth.rows.as_slice()));
    truth.inputs.replay(base, hidden, SUBSTEP, restart)
}

/// Misfits over the noise floor, by channel. The floor of the body is what a model driven by measured rotor
/// rates cannot beat: over the horizon the noise of both rates, integrated once and twice, comes on top of
/// the noise of the sensor itself.
fn misfit(truth: &Truth, rows: &[Row], noise: Noise) -> Vec<Vec<f64>> {
    let paper = Base::PAPER;
    let kick = 2.0_f64.sqrt() * 2.0 * ARM * paper.thrust * HOVER_RATE / paper.inertia * noise.rate;
    let walked = kick * (truth.inputs.period * HORIZON / 2.0).sqrt();
    let twice = kick * (truth.inputs.period * HORIZON.powi(3) / 12.0).sqrt();
    let channel = |pick: &dyn Fn(&Row) -> f64, size: f64| -> Vec<f64> {
        truth.rows.iter().zip(rows).map(|(t, m)| (pick(t) - pick(m)) / size).collect()
    };
    let mut channels = vec![channel(&|row| row.rate[0], noise.rate)];
    if truth.inputs.kind == Kind::Attitude {
        channels.push(channel(&|row| row.rate[1], noise.rate));
        channels.push(channel(&|row| row.body_rate, noise.gyro.hypot(walked)));
        channels.push(channel(&|row| row.angle, noise.angle.hypot(twice)));
    }
    channels
}

fn mean_square(channel: &[f64]) -> f64 {
    channel.iter().map(|e| e * e).sum::<f64>() / channel.len() as f64
}

/// Error over noise floor without the effect, the rest refitted in `rounds`: 1 is invisible. The worst channel
/// counts.
pub fn without(truth: &Truth, rest: &Rest, noise: Noise, rounds: usize) -> f64 {
    let size = 5 + rest.effects.iter().map(|(_, values)| values.len()).sum::<usize>();
    let evaluate = |p: &DVector<f64>| -> (f64, DVector<f64>) {
        let (base, hidden) = plant(rest, p);
        let flat: Vec<f64> = misfit(truth, &run(truth, &base, &hidden), noise).concat();
        let total = flat.iter().map(|e| e * e).sum::<f64>();
        (if total.is_finite() { total } else { f64::MAX }, DVector::from_vec(flat))
    };
    let mut p = DVector::zeros(size);
    let (mut cost, mut error) = evaluate(&p);
    let mut damping = 1e-3;
    for _ in 0..rounds {
        let mut jacobian = DMatrix::zeros(error.len(), size);
        for i in 0..size {
            let mut nudged = p.clone();
            nudged[i] += 1e-4;
            jacobian.set_column(i, &((evaluate(&nudged).1 - &error) / 1e-4));
        }
        let normal = jacobian.transpose() * &jacobian;
        let slope = jacobian.transpose() * &error;
        let before = cost;
        for _ in 0..4 {
            // A parameter that the log does not see at all stays where it is.
            let mut damped = normal.clone();
            for i in 0..size {
                damped[(i, i)] += damping * normal[(i, i)] + 1e-9 * normal.trace() + 1e-12;
            }
            let Some(solver) = damped.cholesky() else { break };
            let tried = &p - solver.solve(&slope);
            let (new_cost, new_error) = evaluate(&tried);
            if new_cost < cost {
                (p, cost, error) = (tried, new_cost, new_error);
                damping *= 0.1;
                break;
            }
            damping *= 10.0;
        }
        if cost > 0.999 * before {
            break;
        }
    }
    let (base, hidden) = plant(rest, &p);
    let channels = misfit(truth, &run(truth, &base, &hidden), noise);
    channels.iter().map(|c| (1.0 + mean_square(c)).sqrt()).fold(1.0, f64::max)
}
