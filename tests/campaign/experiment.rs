//! The two experiments of the development cases: a propeller on a stand at 50 Hz, and the pivoting body
//! under a proportional-derivative law at 100 Hz. Train and validation differ in what they excite.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::catalogue::Kind;
use crate::motion::{Motion, Row};
use crate::noise::{Channel, Noise, Reader};
use crate::plant::{ARM, Base, FULL_BATTERY, HOVER_COMMAND, HOVER_RATE, Hidden};

/// What drives a plant, row by row.
pub struct Inputs {
    pub kind: Kind,
    /// [s] between rows.
    pub period: f64,
    pub commands: Vec<[f64; 2]>,
    /// [V] at each row, and just before the next one under this row's load.
    pub voltages: Vec<[f64; 2]>,
}

/// One log before the sensors: what drove the plant and what it did.
pub struct Truth {
    pub inputs: Inputs,
    pub rows: Vec<Row>,
}

/// [s] step of the plant that makes the data; it halves the shortest time constant of any law 20 times.
pub const SUBSTEP: f64 = 0.0005;

/// A battery that empties unevenly and gives way under load.
struct Battery {
    drop: f64,
    duration: f64,
    wave: [f64; 2],
    resistance: f64,
    full: f64,
}

impl Battery {
    fn draw(rng: &mut ChaCha8Rng, duration: f64) -> Self {
        let resistance = rng.random_range(0.15..0.3);
        Self {
            drop: rng.random_range(0.45..1.0),
            duration,
            wave: [rng.random_range(18.0..45.0), rng.random_range(0.0..TAU)],
            resistance,
            full: 12.5 + resistance * HOVER_COMMAND * HOVER_COMMAND,
        }
    }

    fn at(&self, time: f64, load: f64) -> f64 {
        let [period, phase] = self.wave;
        let swing = |t: f64| 0.9 * period / TAU * (TAU * t / period + phase).sin();
        let emptied = (time + swing(time) - swing(0.0)) / self.duration;
        self.full - self.drop * emptied - self.resistance * load
    }
}

/// Two-valued signal that changes its mind after random whole numbers of samples.
fn random_binary(rng: &mut ChaCha8Rng, samples: usize, shortest: usize, longest: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(samples);
    while out.len() < samples {
        let value = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let length = rng.random_range(shortest..=longest);
        out.extend(std::iter::repeat_n(value, length.min(samples - out.len())));
    }
    out
}

/// Steps, ramps and random binary; or, to validate, a chirp on a random square.
fn actuator_commands(rng: &mut ChaCha8Rng, validate: bool) -> Vec<f64> {
    let time = |k: usize| 0.02 * k as f64;
    if validate {
        let square = random_binary(rng, 3_000, 50, 200);
        return (0..3_000)
            .map(|k| {
                let t = time(k);
                HOVER_COMMAND + 0.1 * (TAU * (0.05 * t + 0.5 * 0.016 * t * t)).sin() + 0.07 * square[k]
            })
            .collect();
    }
    let levels: Vec<f64> = (0..20).map(|_| rng.random_range(0.26..0.68)).collect();
    let (fast, slow) = (random_binary(rng, 2_000, 3, 25), random_binary(rng, 2_000, 50, 200));
    (0..6_000)
        .map(|k| match k {
            0..2_000 => levels[k / 100],
            2_000..4_000 => {
                let turn = (time(k) - 40.0) / 12.0;
                0.265 + 0.4 * (2.0 * (turn - turn.floor()) - 1.0).abs()
            }
            _ => HOVER_COMMAND + 0.07 * fast[k - 4_000] + 0.06 * slow[k - 4_000],
        })
        .collect()
}

/// Runs the propeller stand. `None` where the hidden laws made the rotor stall or run away.
pub fn actuator(base: &Base, hidden: &Hidden, rng: &mut ChaCha8Rng, validate: bool) -> Option<Truth> {
    let period = 0.02;
    let commands = actuator_commands(rng, validate);
    let battery = Battery::draw(rng, period * commands.len() as f64);
    let voltages: Vec<[f64; 2]> = commands
        .iter()
        .enumerate()
        .map(|(k, u)| [k, k + 1].map(|at| battery.at(period * at as f64, u * u)))
        .collect();
    let commands: Vec<[f64; 2]> = commands.iter().map(|u| [*u, *u]).collect();
    let inputs = Inputs { kind: Kind::Actuator, period, commands, voltages };
    let rows = inputs.replay(base, hidden, SUBSTEP, None);
    let is_plausible = rows.iter().all(|row| row.rate[0] > 50.0 && row.rate[0] < 1_500.0);
    is_plausible.then_some(Truth { inputs, rows })
}

impl Inputs {
    /// A plant under these inputs; the body is put back on `truth` every so many samples, where asked.
    pub fn replay(
        &self,
        base: &Base,
        hidden: &Hidden,
        substep: f64,
        restart: Option<(usize, &[Row])>,
    ) -> Vec<Row> {
        let body = self.kind == Kind::Attitude;
        let first = (self.commands[0], self.voltages[0][0]);
        let mut motion = Motion::start(base, hidden, body, self.period, substep, first);
        let mut rows = Vec::with_capacity(self.commands.len());
        for (k, (command, voltage)) in self.commands.iter().zip(&self.voltages).enumerate() {
            if let Some((every, truth)) = restart
                && k % every == 0
            {
                motion.place_body(&truth[k]);
            }
            rows.push(motion.row());
            motion.advance(*command, *voltage);
        }
        rows
    }

    /// The first `rows` of them.
    #[cfg(test)]
    pub fn first(&self, rows: usize) -> Self {
        Self { commands: self.commands[..rows].to_vec(), voltages: self.voltages[..rows].to_vec(), ..*self }
    }
}

/// What the controller is asked for at each sample: angle [rad] and added torque [N m].
fn attitude_requests(rng: &mut ChaCha8Rng, validate: bool) -> Vec<[f64; 2]> {
    if validate {
        let (phase, slow) = (rng.random_range(0.0..TAU), rng.random_range(0.09..0.12));
        let torque = rng.random_range(0.08..0.13);
        return (0..4_000)
            .map(|k| {
                let t = 0.01 * k as f64;
                let chirp = torque * (TAU * (0.2 * t + 0.5 * 0.05 * t * t)).sin();
                [0.4 * (TAU * slow * t + phase).sin(), chirp]
            })
            .collect();
    }
    let angle = random_binary(rng, 6_000, 200, 600);
    let torque = random_binary(rng, 6_000, 12, 45);
    (0..6_000).map(|k| [0.35 * angle[k], 0.12 * torque[k]]).collect()
}

/// Runs the pivoting body in closed loop under a controller made for `law`. `None` where the hidden laws drove the loop out of its bench.
pub fn attitude(
    (base, law): (&Base, &Base),
    hidden: &Hidden,
    rng: &mut ChaCha8Rng,
    validate: bool,
) -> Option<Truth> {
    let period = 0.01;
    let requests = attitude_requests(rng, validate);
    let battery = Battery::draw(rng, period * requests.len() as f64);
    // The controller is built on the bench's numbers, whatever the plant has become.
    let torque_per_rate = 2.0 * ARM * law.thrust * HOVER_RATE;
    let wanted = |angle: f64, rate: f64, request: [f64; 2], voltage: f64| {
        let torque = 1.2 * (request[0] - angle) - 0.2 * rate + request[1];
        let half = (torque / torque_per_rate / 2.0).clamp(-250.0, 250.0);
        let lost = law.voltage_gain * (FULL_BATTERY - voltage);
        [1.0, -1.0].map(|side| law.command_for(HOVER_RATE + lost + side * half).clamp(0.0, 1.0))
    };
    let first = wanted(0.0, 0.0, requests[0], 12.5);
    let mut motion = Motion::start(base, hidden, true, period, SUBSTEP, (first, 12.5));
    let (mut commands, mut voltages, mut rows) = (Vec::new(), Vec::new(), Vec::new());
    let mut load = HOVER_COMMAND * HOVER_COMMAND;
    for (k, request) in requests.iter().enumerate() {
        let row = motion.row();
        if !row.angle.is_finite() || row.angle.abs() > 1.3 {
            return None;
        }
        let time = period * k as f64;
        let command = wanted(row.angle, row.true_body_rate, *request, battery.at(time, load));
        load = (command[0] * command[0] + command[1] * command[1]) / 2.0;
        let voltage = [battery.at(time, load), battery.at(time + period, load)];
        rows.push(row);
        motion.advance(command, voltage);
        commands.push(command);
        voltages.push(voltage);
    }
    Some(Truth { inputs: Inputs { kind: Kind::Attitude, period, commands, voltages }, rows })
}

/// Seven significant digits, as the development logs are written.
pub fn digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let places = (6 - value.abs().log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

impl Truth {
    /// The log file: noise on every sensor, the battery read in its steps.
    pub fn csv(&self, noise: Noise, rng: &mut ChaCha8Rng) -> String {
        let inputs = &self.inputs;
        let body = inputs.kind == Kind::Attitude;
        let mut out = String::from(if body {
            "time_s,command_1,command_2,battery_voltage_v,propeller_rate_1_rad_s,propeller_rate_2_rad_s,\
             body_rate_rad_s,body_angle_rad\n"
        } else {
            "time_s,command_1,battery_voltage_v,propeller_rate_1_rad_s\n"
        });
        let mut reader = Reader::new(&self.rows, noise);
        for (k, voltage) in inputs.voltages.iter().enumerate() {
            reader.begin(rng);
            let mut cells = vec![inputs.period * k as f64, inputs.commands[k][0]];
            let off: f64 = StandardNormal.sample(rng);
            let steps = (voltage[0] + noise.battery * off) * noise.steps_per_volt;
            let battery = steps.round() / noise.steps_per_volt;
            if body {
                cells.extend([inputs.commands[k][1], battery]);
                let channels = [Channel::Rate1, Channel::Rate2, Channel::Gyro, Channel::Angle];
                cells.extend(channels.map(|channel| reader.read(channel, k, rng)));
            } else {
                cells.extend([battery, reader.read(Channel::Rate1, k, rng)]);
            }
            out.push_str(&cells.into_iter().map(digits).collect::<Vec<_>>().join(","));
            out.push('\n');
        }
        out
    }
}
