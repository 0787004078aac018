//! The true plant, and the controllers on it.

use std::collections::VecDeque;

use rotorbench::control::design::{Compensator, DiscreteLoop, LoopPlant};
use rotorbench::control::{
    AnyController, Compensation, ControlError, ControllerConfig, ControllerKind, PlantParameters,
};
use rotorbench::signal::{Applied, Command, Sample, Sensors};

/// The true plant: two rotors, quadratic thrust, body with a torque law, transport delay; midpoint rule.
pub struct Truth {
    pub rotor: [f64; 2],
    pub rate: f64,
    pub angle: f64,
    pub delay: VecDeque<[f64; 2]>,
    pub substep_s: f64,
    pub law: fn(f64, f64) -> f64,
}

impl Truth {
    pub fn new(period_s: f64, delay_s: f64, law: fn(f64, f64) -> f64) -> Self {
        let substep_s = period_s / SUBSTEPS as f64;
        let waiting = (delay_s / substep_s).round() as usize;
        let hover = PlantParameters::paper().hover_rate;
        let delay = std::iter::repeat_n([0.463_34; 2], waiting).collect();
        Self { rotor: [hover; 2], rate: 0.0, angle: 0.0, delay, substep_s, law }
    }

    pub fn derivative(&self, [w_1, w_2, rate, angle]: [f64; 4], u: [f64; 2], torque: f64) -> [f64; 4] {
        let z = u.map(|u| 447.1 * u * u + 1124.5 * u);
        let thrust = 0.0197 * 0.0197 / (4.0 * 6.0771) * (w_1 * w_1 - w_2 * w_2);
        let sum = 0.25 * thrust + torque + (self.law)(angle, rate);
        [16.0 * (z[0] - w_1), 16.0 * (z[1] - w_2), sum / 0.032, rate]
    }

    /// One period under the command, with a disturbance torque given at each substep.
    pub fn advance(&mut self, command: [f64; 2], torque: f64) {
        for _ in 0..SUBSTEPS {
            self.delay.push_back(command);
            let u = self.delay.pop_front().expect("just pushed");
            let now = [self.rotor[0], self.rotor[1], self.rate, self.angle];
            let k = self.derivative(now, u, torque);
            let middle = std::array::from_fn(|i| now[i] + 0.5 * self.substep_s * k[i]);
            let k = self.derivative(middle, u, torque);
            let next: [f64; 4] = std::array::from_fn(|i| now[i] + self.substep_s * k[i]);
            (self.rotor, self.rate, self.angle) = ([next[0], next[1]], next[2], next[3]);
        }
    }

    pub fn sensors(&self, k: u32, noise: f64) -> Sensors {
        let stamp = 1_000_000 * u64::from(k);
        Sensors {
            sequence: u64::from(k),
            stamp_ns: stamp,
            body_rate: Sample::good(self.rate + noise, stamp, k),
            battery_voltage: Sample::good(12.6, stamp, k),
            ..Sensors::default()
        }
    }
}

const SUBSTEPS: usize = 40;

pub fn free(_: f64, _: f64) -> f64 {
    0.0
}

pub fn applied(command: &Command, rotor: [f64; 2]) -> Applied {
    Applied { sequence: command.sequence, command_sequence: command.sequence, rotor, ..Applied::default() }
}

pub fn build(kind: ControllerKind, period_s: f64) -> (AnyController, Compensator) {
    let plant = PlantParameters::paper();
    let config = ControllerConfig { kind, ..ControllerConfig::default() };
    let built = config.build(&plant, period_s).expect("stable");
    let linear = match &built {
        AnyController::Emc(emc) => Compensator::Emc(emc.gains()),
        AnyController::Pid(pid) => Compensator::Pid(pid.gains()),
    };
    (built, linear)
}

pub fn closed(kind: ControllerKind, delay_s: f64, period_s: f64) -> Result<DiscreteLoop, ControlError> {
    let plant = PlantParameters::paper();
    let loop_plant = LoopPlant { delay_s, ..LoopPlant::new(&plant) };
    let linear = build(kind, period_s).1;
    DiscreteLoop::build(&plant, &loop_plant, &linear, &Compensation::default(), 0.0, period_s)
}
