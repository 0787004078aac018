//! Logs made by small steps of the differential equation: nothing is shared with the fitter.

use rotorbench::identify::Identification;
use rotorbench::log::Dataset;
use rotorbench::screening::Finding;

/// [s] T_s.
pub const PERIOD: f64 = 0.02;
pub const C_G1: f64 = 447.1;
pub const C_G2: f64 = 1124.5;
pub const K_V: f64 = 40.0;
pub const POLE: f64 = 16.0;
pub const FULL_VOLTAGE: f64 = 12.6;

/// z by Eq. (7) in Eq. (2), with the sign of Eq. (6).
pub fn z(u: f64, v: f64) -> f64 {
    C_G1 * u * u + C_G2 * u - K_V * (FULL_VOLTAGE - v)
}

/// [V] a discharge.
pub fn voltage(t: f64) -> f64 {
    12.4 - 0.004 * t
}

/// A log of columns of samples, T_s apart.
pub fn of_columns<const N: usize>(source: &str, names: [&str; N], columns: [Vec<f64>; N]) -> Dataset {
    let samples = columns.first().map_or(0, Vec::len);
    let time = (0..samples).map(|k| k as f64 * PERIOD).collect();
    let mut log = Dataset::new(source, "", time).expect("rising time");
    for (name, column) in names.into_iter().zip(columns) {
        log.insert(name, column).expect("as long as time");
    }
    log
}

/// ω_p by Eq. (2) with the command held over T_s, in 200 midpoint steps for each sample.
pub fn moving(command: impl Fn(f64) -> f64, samples: usize) -> Dataset {
    let step = PERIOD / 200.0;
    let mut rate = z(command(0.0), voltage(0.0));
    let mut rates = Vec::new();
    for k in 0..samples {
        rates.push(rate);
        let u = command(k as f64 * PERIOD);
        for j in 0..200 {
            let steady = z(u, voltage(k as f64 * PERIOD + (f64::from(j) + 0.5) * step));
            let middle = rate + 0.5 * step * POLE * (steady - rate);
            rate += step * POLE * (steady - middle);
        }
    }
    dataset("moving.csv", &command, rates)
}

/// ω_p = z: Eq. (4) to the letter.
pub fn steady(command: impl Fn(f64) -> f64, samples: usize) -> Dataset {
    let rates = (0..samples).map(|k| k as f64 * PERIOD).map(|t| z(command(t), voltage(t))).collect();
    dataset("steady.csv", &command, rates)
}

pub fn dataset(name: &str, command: &dyn Fn(f64) -> f64, rates: Vec<f64>) -> Dataset {
    let time: Vec<f64> = (0..rates.len()).map(|k| k as f64 * PERIOD).collect();
    let commands = time.iter().map(|&t| command(t)).collect();
    let voltages = time.iter().map(|&t| voltage(t)).collect();
    let mut log = Dataset::new(name, "", time).expect("rising time");
    for (name, values) in
        [("command_1", commands), ("propeller_rate_1_rad_s", rates), ("battery_voltage_v", voltages)]
    {
        log.insert(name, values).expect("as long as time");
    }
    log
}

/// Six levels of 1000 samples each, Eq. (3).
pub fn levels(t: f64) -> f64 {
    0.35 + 0.05 * ((t + 0.5 * PERIOD) / 20.0).floor()
}

/// Up and down between 0.3 and 0.65 at 0.01 1/s.
pub fn ramps(t: f64) -> f64 {
    0.3 + 0.01 * (35.0 - (t.rem_euclid(70.0) - 35.0).abs())
}

/// Four levels that nobody can foretell, each for 0.1 s: a multiplicative hash of the slot's number.
pub fn exciting(t: f64) -> f64 {
    let slot = ((t + 0.5 * PERIOD) / 0.1).floor() as u32;
    let hash = slot.wrapping_mul(2_654_435_761) ^ (slot.wrapping_mul(40_503) >> 7);
    0.35 + 0.08 * f64::from((hash >> 13) % 4)
}

/// [N s²/rad²] c of f = c ω², and [kg m²] J, [m] d of Table IV.
pub const THRUST: f64 = 1.5965e-5;
pub const INERTIA: f64 = 0.032;
pub const ARM: f64 = 0.25;

/// Both rotors at hover ± `deviation`, and the body they turn by Eq. (1) with the sign of Eq. (12), in 200 midpoint
/// steps for each sample.
pub fn attitude(deviation: impl Fn(f64) -> f64, samples: usize) -> Dataset {
    let step = PERIOD / 200.0;
    let z = |u: f64| C_G1 * u * u + C_G2 * u;
    let mut columns: [Vec<f64>; 5] = Default::default();
    let mut x = [z(0.4633), z(0.4633), 0.0];
    for k in 0..samples {
        let change = deviation(k as f64 * PERIOD);
        let u = [0.4633 + change, 0.4633 - change];
        let torque = |x: [f64; 3]| ARM * THRUST * (x[0] * x[0] - x[1] * x[1]);
        let row = [u[0], u[1], x[0], x[1], x[2]];
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        let slope = |x: [f64; 3]| [POLE * (z(u[0]) - x[0]), POLE * (z(u[1]) - x[1]), torque(x) / INERTIA];
        for _ in 0..200 {
            let k = slope(x);
            let k = slope(std::array::from_fn(|i| x[i] + 0.5 * step * k[i]));
            x = std::array::from_fn(|i| x[i] + step * k[i]);
        }
    }
    let names =
        ["command_1", "command_2", "propeller_rate_1_rad_s", "propeller_rate_2_rad_s", "body_rate_rad_s"];
    of_columns("attitude.csv", names, columns)
}

/// The first finding of this code.
pub fn finding<'a>(found: &'a Identification, code: &str) -> Option<&'a Finding> {
    found.findings.iter().find(|it| it.code == code)
}

/// The codes of all findings.
pub fn codes(found: &Identification) -> Vec<&'static str> {
    found.findings.iter().map(|it| it.code).collect()
}
