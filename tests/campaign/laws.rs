//! Laws outside the catalogue that have a formula, for `discover` to find: where each acts, what it looks at, and what it adds. Written
//! for the adversary's plant alone.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::catalogue::Kind;

/// What a law may look at.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seen {
    pub time: f64,
    pub command: f64,
    pub voltage: f64,
    pub rate: f64,
    pub angle: f64,
    pub body_rate: f64,
}

/// Numbers of a law, four at the most.
pub type Numbers = [f64; 4];

/// A family of laws.
#[derive(Debug)]
pub struct Family {
    pub name: &'static str,
    pub kind: Kind,
    /// Where it acts, as the program calls it.
    pub site: &'static str,
    /// What it looks at, as logs call it.
    pub channels: &'static [&'static str],
    /// From where to where each number is drawn, the strength first: that one log-uniform.
    pub ranges: [(f64, f64); 4],
    pub adds: fn(&Numbers, &Seen) -> f64,
}

const NONE: (f64, f64) = (0.0, 0.0);
const ANGLE: &[&str] = &["body_angle_rad"];
const RATE: &[&str] = &["body_rate_rad_s"];
const COMMAND: &[&str] = &["command"];
const ROTOR: &[&str] = &["propeller_rate_rad_s"];

/// A hump of height one.
fn hump(value: f64, middle: f64, width: f64) -> f64 {
    (-((value - middle) / width) * ((value - middle) / width)).exp()
}

#[rustfmt::skip]
pub static FAMILIES: &[Family] = &[
    Family { name: "teeth", kind: Kind::Attitude, site: "torque", channels: ANGLE,
             ranges: [(0.02, 0.1), (20.0, 60.0), (-3.0, 3.0), NONE],
             adds: |p, s| p[0] * (p[1] * s.angle + p[2]).sin() },
    Family { name: "end stops", kind: Kind::Attitude, site: "torque", channels: ANGLE,
             ranges: [(2.0, 12.0), (0.22, 0.34), NONE, NONE],
             adds: |p, s| -p[0] * (s.angle.abs() - p[1]).max(0.0) * s.angle.signum() },
    Family { name: "hardening spring", kind: Kind::Attitude, site: "torque", channels: ANGLE,
             ranges: [(0.5, 4.0), NONE, NONE, NONE], adds: |p, s| -p[0] * s.angle * s.angle * s.angle },
    Family { name: "magnet", kind: Kind::Attitude, site: "torque", channels: ANGLE,
             ranges: [(0.03, 0.15), (-0.2, 0.2), (0.05, 0.12), NONE],
             adds: |p, s| p[0] * hump(s.angle, p[1], p[2]) },
    Family { name: "rope", kind: Kind::Attitude, site: "torque", channels: ANGLE,
             ranges: [(0.4, 2.0), (0.0, 0.2), NONE, NONE], adds: |p, s| -p[0] * (s.angle - p[1]).max(0.0) },
    Family { name: "sticky pivot", kind: Kind::Attitude, site: "torque", channels: RATE,
             ranges: [(0.03, 0.12), (0.15, 0.5), NONE, NONE],
             adds: |p, s| -p[0] * (s.body_rate / 0.02).tanh() * hump(s.body_rate, 0.0, p[1]) },
    Family { name: "centrifugal brake", kind: Kind::Attitude, site: "torque", channels: RATE,
             ranges: [(0.1, 0.6), (0.25, 0.7), NONE, NONE],
             adds: |p, s| -p[0] * (s.body_rate.abs() - p[1]).max(0.0) * s.body_rate.signum() },
    Family { name: "damping that grows outwards", kind: Kind::Attitude, site: "torque",
             channels: &["body_angle_rad", "body_rate_rad_s"], ranges: [(0.8, 6.0), NONE, NONE, NONE],
             adds: |p, s| -p[0] * s.angle * s.angle * s.body_rate },
    Family { name: "brush beyond an angle", kind: Kind::Attitude, site: "torque",
             channels: &["body_angle_rad", "body_rate_rad_s"], ranges: [(0.4, 3.0), (0.08, 0.2), NONE, NONE],
             adds: |p, s| -p[0] * (s.angle.abs() - p[1]).max(0.0) * s.body_rate },
    Family { name: "vibration", kind: Kind::Attitude, site: "torque", channels: &["time_s"],
             ranges: [(0.02, 0.12), (5.0, 25.0), (-3.0, 3.0), NONE],
             adds: |p, s| p[0] * (p[1] * s.time + p[2]).sin() },
    Family { name: "gyro that bends", kind: Kind::Attitude, site: "body_rate_sensor", channels: RATE,
             ranges: [(0.02, 0.3), NONE, NONE, NONE], adds: |p, s| -p[0] * s.body_rate.powi(3) },
    Family { name: "gyro that feels the tilt", kind: Kind::Attitude, site: "body_rate_sensor", channels: ANGLE,
             ranges: [(0.2, 1.5), NONE, NONE, NONE], adds: |p, s| p[0] * s.angle * s.angle },
    Family { name: "propeller that flutters", kind: Kind::Attitude, site: "thrust", channels: ROTOR,
             ranges: [(0.1, 0.8), (570.0, 660.0), (15.0, 45.0), NONE],
             adds: |p, s| -p[0] * hump(s.rate, p[1], p[2]) },
    Family { name: "hum", kind: Kind::Actuator, site: "steady_rate", channels: &["time_s"],
             ranges: [(5.0, 30.0), (2.0, 15.0), (-3.0, 3.0), NONE],
             adds: |p, s| p[0] * (p[1] * s.time + p[2]).sin() },
    Family { name: "knee", kind: Kind::Actuator, site: "steady_rate", channels: COMMAND,
             ranges: [(80.0, 500.0), (0.42, 0.58), NONE, NONE], adds: |p, s| -p[0] * (s.command - p[1]).max(0.0) },
    Family { name: "step in the map", kind: Kind::Actuator, site: "steady_rate", channels: COMMAND,
             ranges: [(6.0, 40.0), (0.36, 0.56), NONE, NONE],
             adds: |p, s| if s.command > p[1] { p[0] } else { 0.0 } },
    Family { name: "wave in the map", kind: Kind::Actuator, site: "steady_rate", channels: COMMAND,
             ranges: [(3.0, 20.0), (25.0, 70.0), (-3.0, 3.0), NONE],
             adds: |p, s| p[0] * (p[1] * s.command + p[2]).sin() },
    Family { name: "cell that gives way", kind: Kind::Actuator, site: "steady_rate", channels: &["battery_voltage_v"],
             ranges: [(30.0, 200.0), (11.95, 12.2), NONE, NONE],
             adds: |p, s| -p[0] * (p[1] - s.voltage).max(0.0) },
    Family { name: "sag under load", kind: Kind::Actuator, site: "steady_rate",
             channels: &["battery_voltage_v", "command"], ranges: [(60.0, 400.0), NONE, NONE, NONE],
             adds: |p, s| -p[0] * (12.6 - s.voltage) * (s.command - 0.2) },
    Family { name: "resonant speed", kind: Kind::Actuator, site: "rotor_acceleration", channels: ROTOR,
             ranges: [(150.0, 1500.0), (480.0, 700.0), (20.0, 60.0), NONE],
             adds: |p, s| -p[0] * hump(s.rate, p[1], p[2]) },
    Family { name: "tachometer that slips a tooth", kind: Kind::Actuator, site: "rotor_rate_sensor", channels: ROTOR,
             ranges: [(3.0, 15.0), (0.05, 0.15), (-3.0, 3.0), NONE],
             adds: |p, s| p[0] * (p[1] * s.rate + p[2]).sin() },
];

impl Family {
    /// Numbers of strength `share` [-] of the way from the weakest to the strongest.
    pub fn draw(&self, share: f64, rng: &mut ChaCha8Rng) -> Numbers {
        let mut numbers =
            self.ranges.map(|(low, high)| if low < high { rng.random_range(low..high) } else { 0.0 });
        let (low, high) = self.ranges[0];
        numbers[0] = low * (high / low).powf(share);
        numbers
    }
}

/// Laws of the campaign of `diagnose` that are of a family, too.
const ALSO: [(&str, &str); 2] = [("cogging", "teeth"), ("soft stops", "end stops")];

/// The family of this name.
pub fn family(name: &str) -> Option<&'static Family> {
    let own = ALSO.iter().find(|(also, _)| *also == name).map_or(name, |(_, own)| own);
    FAMILIES.iter().find(|family| family.name == own)
}
