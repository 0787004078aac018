//! The paper run on the emulator: section III from its own experiments, section V from its own flights.

use serde::Serialize;

use super::ProcessError;
use super::lockstep::{Lockstep, Slot, drive};
use super::pilot::Pilot;
use super::plant;
use crate::control::{ControllerConfig, ControllerKind, EmcGains};
use crate::emulate::{EmulatorConfig, Impulse};
use crate::experiment::{ExperimentConfig, Rotors, Shape};
use crate::identify::{Identification, IdentifyError, IdentifySettings, identify};
use crate::record::{Dataset, DatasetError};

/// [s] T_s and T_c. [LPC16] Eq. (3), Table IV.
pub const PERIOD_S: f64 = 0.02;
/// [s] when the impulse strikes, and how long its effect is judged.
pub const IMPULSE_AT_S: f64 = 5.0;
const JUDGED_S: f64 = 8.0;
/// [s] [N m] the impulse.
pub const IMPULSE: (f64, f64) = (0.05, 0.6);
/// [s] transport delays of the flights: none, and one that a real bench has.
const DELAYS_S: [f64; 2] = [0.0, 0.03];

/// Why the run failed.
#[derive(Debug, thiserror::Error)]
pub enum PaperError {
    /// The emulated bench, or a controller, cannot be built.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// The emulator refuses.
    #[error(transparent)]
    Emulate(#[from] crate::emulate::EmulateError),
    /// An experiment refuses.
    #[error(transparent)]
    Experiment(#[from] crate::experiment::ExperimentError),
    /// A controller refuses.
    #[error(transparent)]
    Control(#[from] crate::control::ControlError),
    /// A log is none.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// Identification fails.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// How a controller answered one torque impulse.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Answer {
    /// [rad] largest angle.
    pub peak: f64,
    /// [s] from the impulse until the angle stays within 5 % of its peak.
    pub settling: f64,
    /// [%] largest angle on the other side, of the peak.
    pub overshoot_percent: f64,
    /// Times the angle swings through to the other side by more than 5 % of the peak.
    pub swings: usize,
    /// [rad s²] integral of time times the absolute angle.
    pub itae: f64,
    /// [N m] rms of the commanded torque.
    pub effort: f64,
    /// [N m] rms of estimated minus true disturbance torque.
    pub disturbance_error: f64,
    /// [N m] largest disturbance estimate.
    pub disturbance_peak: f64,
}

/// One flight.
#[derive(Debug, Clone, Serialize)]
pub struct Flight {
    /// `EMC` or `PID`.
    pub controller: &'static str,
    /// [s] transport delay in the loop.
    pub delay: f64,
    /// How it answered.
    pub answer: Answer,
    /// Time [s], angle [rad], estimated and true disturbance [N m].
    #[serde(skip)]
    pub traces: Vec<[f64; 4]>,
}

/// A printed number and ours.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Beside {
    /// Table of the print.
    pub table: &'static str,
    /// Symbol of the print.
    pub symbol: &'static str,
    /// As printed.
    pub printed: f64,
    /// Ours; absent where nothing was identified.
    pub ours: Option<f64>,
    /// Standard error of ours, where it was identified and not computed.
    pub standard_error: Option<f64>,
    /// Unit of all three.
    pub unit: &'static str,
}

/// Everything the report shows.
#[derive(Debug, Serialize)]
pub struct PaperRun {
    /// Tables I to IV, number by number.
    pub beside: Vec<Beside>,
    /// Section III.
    pub identification: Identification,
    /// Gains of EMC from the identified pole, β = γ_0 = 0.276 as printed.
    pub gains: EmcGains,
    /// Section V.
    pub flights: Vec<Flight>,
}

/// Runs the paper on an emulated bench with the paper's parameters; `prbs_s` [s] is the length of the PRBS.
///
/// # Errors
/// [`PaperError`] of the room that refuses.
pub fn run(seed: u64, prbs_s: f64) -> Result<PaperRun, PaperError> {
    let levels = vec![0.35, 0.4, 0.45, 0.5, 0.55, 0.6];
    let ramp = |slope| Shape::Ramp { low: 0.3, high: 0.65, slope, cycles: 2 };
    let prbs = |seed, duration_s| Shape::Prbs { amplitude: 0.08, bandwidth_hz: 0.0, duration_s, seed };
    let logs = [
        experiment(seed, Shape::Constant { levels, hold_s: 300.0 }, "constant commands")?,
        experiment(seed + 1, ramp(0.01), "ramps")?,
        experiment(seed + 2, prbs(seed, prbs_s), "PRBS")?,
    ];
    let validation = [
        experiment(seed + 3, ramp(0.02), "ramps of another slope")?,
        experiment(seed + 4, prbs(seed + 1, 60.0), "another PRBS")?,
    ];
    let identification = identify(&logs, &validation, &IdentifySettings::default())?;
    let gains = ControllerConfig::paper().emc.gains(identification.model.actuator.pole, PERIOD_S)?;
    let mut flights = Vec::new();
    for delay in DELAYS_S {
        for (name, kind) in [("EMC", ControllerKind::Emc), ("PID", ControllerKind::Pid)] {
            flights.push(fly(seed + 5, name, kind, delay, &identification)?);
        }
    }
    Ok(PaperRun { beside: beside(&identification, &gains), identification, gains, flights })
}

/// Tables I and IV from what was identified, Tables II and III from the gains.
fn beside(found: &Identification, gains: &EmcGains) -> Vec<Beside> {
    let curve = |index: usize| found.static_curve.as_ref()?.coefficients.get(index).copied();
    let identified = [
        ("I", "c_g1", 447.1, curve(1), "rad/s"),
        ("I", "c_g2", 1124.5, curve(0), "rad/s"),
        ("I", "k_V", 40.0, found.battery.as_ref().map(|battery| battery.gain), "rad/(s V)"),
        ("IV", "p", 16.0, found.pole.as_ref().map(|fit| fit.pole), "rad/s"),
    ];
    let [l_0, l_1, l_2, l_3] = gains.l;
    let [k_1, k_2, k_3] = gains.k;
    let computed = [
        ("II", "l_0", -5.03e-17, l_0),
        ("II", "l_1", 1.95e-1, l_1),
        ("II", "l_2", 1.02e-2, l_2),
        ("II", "l_3", 1.43e-4, l_3),
        // **Deviation:** Table III repeats γ_0, γ_1, γ_2 of Table II; as gains they are unstable.
        ("III", "k_1", 0.276, k_1),
        ("III", "k_2", 0.120, k_2),
        ("III", "k_3", 0.052, k_3),
    ];
    let identified = identified.map(|(table, symbol, printed, ours, unit)| Beside {
        table,
        symbol,
        printed,
        ours: ours.map(|ours| ours.value),
        standard_error: ours.map(|ours| ours.standard_error),
        unit,
    });
    let computed = computed.map(|(table, symbol, printed, ours)| Beside {
        table,
        symbol,
        printed,
        ours: Some(ours),
        standard_error: None,
        unit: "-",
    });
    identified.into_iter().chain(computed).collect()
}

/// One rotor of a clamped bench, driven open loop.
fn experiment(seed: u64, shape: Shape, name: &str) -> Result<Dataset, PaperError> {
    let mut config = EmulatorConfig { seed, integration_step_s: 0.004, ..EmulatorConfig::default() };
    config.plant.clamped = true;
    config.sensors = config.sensors.at_rate(1.0 / PERIOD_S);
    let experiment = ExperimentConfig { shape, rotors: Rotors::One, around: 0.4633, lead_in_s: 4.0 };
    Ok(drive(&config.build()?, &experiment.build(PERIOD_S)?).into_dataset(name)?)
}

fn fly(
    seed: u64,
    controller: &'static str,
    kind: ControllerKind,
    delay: f64,
    identification: &Identification,
) -> Result<Flight, PaperError> {
    let impulse = Impulse { at_s: IMPULSE_AT_S, duration_s: IMPULSE.0, torque: IMPULSE.1 };
    let bench =
        EmulatorConfig { seed, command_delay_s: delay, impulse: vec![impulse], ..EmulatorConfig::default() };
    let settings = ControllerConfig { kind, ..ControllerConfig::paper() };
    let (parameters, _) = plant::of_model(&identification.model)?;
    let pilot =
        Pilot::controller(settings.build(&parameters, PERIOD_S)?, settings.reference.build(PERIOD_S)?);
    let slots = Lockstep::new(bench.build()?, pilot, PERIOD_S).run(IMPULSE_AT_S + JUDGED_S, &mut ());
    let trace = |slot: &Slot| {
        let estimate = slot.command.map_or(f64::NAN, |command| command.estimate.disturbance_torque);
        [slot.time, slot.truth.body_angle, estimate, slot.truth.disturbance_torque]
    };
    let traces = slots.iter().map(trace).collect();
    Ok(Flight { controller, delay, answer: judge(&slots), traces })
}

/// Judges the flight from the impulse on. The angle is the true one, less what it was just before.
fn judge(slots: &[Slot]) -> Answer {
    let start = slots.iter().position(|slot| slot.time >= IMPULSE_AT_S - 0.5 * PERIOD_S).unwrap_or(0);
    let judged = slots.get(start..).unwrap_or_default();
    let before = judged.first().map_or(0.0, |slot| slot.truth.body_angle);
    let angle = |slot: &Slot| slot.truth.body_angle - before;
    let largest = judged
        .iter()
        .map(angle)
        .fold(0.0, |most: f64, value| if value.abs() > most.abs() { value } else { most });
    let (peak, side) = (largest.abs(), largest.signum());
    let since = |slot: &Slot| slot.time - IMPULSE_AT_S;
    let settling = judged.iter().rev().find(|slot| angle(slot).abs() > 0.05 * peak).map_or(0.0, since);
    let overshoot = judged.iter().map(|slot| -side * angle(slot)).fold(0.0, f64::max);
    let mut swings = 0;
    let mut last_side = side;
    for slot in judged.iter().filter(|slot| angle(slot).abs() > 0.05 * peak) {
        if angle(slot).signum() != last_side {
            swings += 1;
            last_side = -last_side;
        }
    }
    let rms = |value: &dyn Fn(&Slot) -> f64| {
        (judged.iter().map(|slot| value(slot).powi(2)).sum::<f64>() / judged.len().max(1) as f64).sqrt()
    };
    let estimate = |slot: &Slot| slot.command.map_or(0.0, |command| command.estimate.disturbance_torque);
    Answer {
        peak,
        settling,
        overshoot_percent: 100.0 * overshoot / peak.max(f64::MIN_POSITIVE),
        swings,
        itae: judged.iter().map(|slot| since(slot) * angle(slot).abs() * PERIOD_S).sum(),
        effort: rms(&|slot| slot.command.map_or(0.0, |command| command.torque)),
        disturbance_error: rms(&|slot| estimate(slot) - slot.truth.disturbance_torque),
        disturbance_peak: judged.iter().map(|slot| estimate(slot).abs()).fold(0.0, f64::max),
    }
}
