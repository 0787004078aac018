//! The paper run on the emulator: section III from its own experiments, section V from its own runs under control.
//!
//! Each experiment and each run is an emulated bench of its own behind its guard, as `run --lockstep` has it.

mod bench;
mod error;
mod settings;

use serde::Serialize;

use crate::control::gains::complementary_eigenvalues;
use crate::control::{ControllerConfig, ControllerKind, EmcGains};
use crate::experiment::Waveform;
use crate::identify::{Identification, IdentifySettings, identify_with_progress};
use crate::rt::Shutdown;

use bench::Benches;

pub use bench::ControlledRun;
pub use error::PaperError;
pub use settings::{IMPULSE, IMPULSE_AT_S, PERIOD_S, PaperSettings};

/// [s] transport delays of the runs under control: none, and one that a real bench has and the PID of Table III barely stands.
const DELAYS_S: [f64; 2] = [0.0, 0.03];

/// A printed number and ours.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Serialize)]
pub struct PrintedNumber {
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
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Serialize)]
pub struct PaperRun {
    /// Tables I to IV, number by number.
    pub beside: Vec<PrintedNumber>,
    /// Section III.
    pub identification: Identification,
    /// Gains of EMC from the identified pole, β = γ_0 = 0.276 as printed.
    pub gains: EmcGains,
    /// Section V.
    pub runs: Vec<ControlledRun>,
}

/// Experiments that the model is identified from; the others validate it.
const FITTED: usize = 3;

/// The experiments of section III.
fn experiments(settings: &PaperSettings) -> [(Waveform, &'static str); 5] {
    let PaperSettings { seed, prbs_s, hold_s } = *settings;
    let levels = vec![0.35, 0.4, 0.45, 0.5, 0.55, 0.6];
    let ramp = |slope| Waveform::Ramp { low: 0.3, high: 0.65, slope, cycles: 2 };
    let prbs = |seed, duration_s| Waveform::Prbs { amplitude: 0.08, bandwidth_hz: 0.0, duration_s, seed };
    [
        (Waveform::Constant { levels, hold_s }, "constant commands"),
        (ramp(0.01), "ramps"),
        (prbs(seed, prbs_s), "PRBS"),
        (ramp(0.02), "ramps of another slope"),
        (prbs(seed.wrapping_add(1), 60.0), "another PRBS"),
    ]
}

/// Runs the paper on an emulated bench with the paper's parameters. `report` is called with what is being done, and the share
/// that is done; `shutdown` stops it.
///
/// # Errors
/// [`PaperError`] of the room that refuses, or that it was stopped.
pub fn run(
    settings: &PaperSettings,
    shutdown: &Shutdown,
    report: &mut dyn FnMut(&str, f64),
) -> Result<PaperRun, PaperError> {
    let experiments = experiments(settings);
    let runs: Vec<(f64, &'static str, ControllerKind)> = DELAYS_S
        .iter()
        .flat_map(|delay| [(*delay, "EMC", ControllerKind::Emc), (*delay, "PID", ControllerKind::Pid)])
        .collect();
    let mut benches = Benches::new(settings, &experiments, runs.len(), shutdown);
    let mut logs = Vec::new();
    for (shape, name) in experiments {
        logs.push(benches.experiment(shape, name, report)?);
    }
    let validation = logs.split_off(FITTED);
    let identification =
        identify_with_progress(&logs, &validation, &IdentifySettings::default(), &mut |step| {
            report(step, benches.share());
        })?;
    let gains = ControllerConfig::paper().emc.gains(identification.model.actuator.pole, PERIOD_S)?;
    let mut done = Vec::new();
    for (delay, controller, kind) in runs {
        done.push(benches.controlled_run(controller, kind, delay, &identification.model, report)?);
    }
    Ok(PaperRun { beside: beside(&identification, &gains), identification, gains, runs: done })
}

/// Tables I and IV from what was identified, Tables II and III from the gains.
fn beside(found: &Identification, gains: &EmcGains) -> Vec<PrintedNumber> {
    let curve = |index: usize| found.static_curve.as_ref()?.coefficients.get(index).copied();
    let identified = [
        ("I", "c_g1", 447.1, curve(1), "rad/s"),
        ("I", "c_g2", 1124.5, curve(0), "rad/s"),
        ("I", "k_V", 40.0, found.battery.as_ref().map(|battery| battery.gain), "rad/(s V)"),
        ("IV", "p", 16.0, found.pole.as_ref().map(|fit| fit.pole), "rad/s"),
    ];
    let [l_0, l_1, l_2, l_3] = gains.l;
    let [k_1, k_2, k_3] = gains.k;
    let settings = ControllerConfig::paper();
    let [g_0, g_1, g_2, g_3] = complementary_eigenvalues(gains.beta, settings.emc.alpha);
    let (actuator, body, pid) = (&found.model.actuator, &found.model.body, settings.pid);
    let tangent = 2.0 * actuator.thrust_coefficient * actuator.hover_rate;
    let computed = [
        ("II", "γ_0", 0.276, g_0, "-"),
        ("II", "γ_1", 0.120, g_1, "-"),
        ("II", "γ_2", 0.052, g_2, "-"),
        ("II", "γ_3", 0.023, g_3, "-"),
        ("II", "l_0", -5.03e-17, l_0, "-"),
        ("II", "l_1", 1.95e-1, l_1, "-"),
        ("II", "l_2", 1.02e-2, l_2, "-"),
        ("II", "l_3", 1.43e-4, l_3, "-"),
        // **Deviation:** Table III repeats γ_0, γ_1, γ_2 of Table II; as gains they are unstable.
        ("III", "k_1", 0.276, k_1, "-"),
        ("III", "k_2", 0.120, k_2, "-"),
        ("III", "k_3", 0.052, k_3, "-"),
        ("III", "k_P", 2.248, pid.k_p, "N m/rad"),
        ("III", "k_I", 0.985, pid.k_i, "N m/(rad s)"),
        ("III", "k_D", 0.574, pid.k_d, "N m s/rad"),
        ("IV", "β", 0.27, gains.beta, "-"),
        ("IV", "J", 0.032, body.inertia, "kg m²"),
        ("IV", "d", 0.25, body.arm, "m"),
        ("IV", "T_c", 0.02, PERIOD_S, "s"),
        ("IV", "v_bmax", 12.6, actuator.full_voltage, "V"),
        ("IV", "c_p1", 0.0197, tangent, "N s/rad"),
        ("IV", "c_p0", -6.0771, -0.5 * tangent * actuator.hover_rate, "N"),
    ];
    let identified = identified.map(|(table, symbol, printed, ours, unit)| PrintedNumber {
        table,
        symbol,
        printed,
        ours: ours.map(|ours| ours.value),
        standard_error: ours.map(|ours| ours.standard_error),
        unit,
    });
    let computed = computed.map(|(table, symbol, printed, ours, unit)| PrintedNumber {
        table,
        symbol,
        printed,
        ours: Some(ours),
        standard_error: None,
        unit,
    });
    identified.into_iter().chain(computed).collect()
}
