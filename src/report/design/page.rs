//! What `design` shows: tables for terminal and report alike, and the loop's frequency response.

use nalgebra::Complex;

use super::answer::Design;
use crate::control::design::{DiscreteLoop, LoopResponse, Margins};
use crate::control::thresholds::THRESHOLDS;
use crate::report::{Axis, Mark, Page, Plot, Series, TextTable, number};

/// The design as tables, for terminal and report alike.
#[must_use]
pub fn tables(design: &Design) -> Vec<TextTable> {
    let mut tables = Vec::new();
    if let Some(emc) = &design.emc {
        let caption = format!(
            "EMC for model `{}`, T_c = {} s, β = {}",
            design.model,
            number(design.period_s, 4),
            number(emc.beta, 4)
        );
        let mut table =
            TextTable::new(["k", "predictor γ_k", "gain l_k", "feedback γ_k", "gain k_k+1"]).caption(caption);
        for (k, (gamma, l)) in emc.gamma.iter().zip(emc.observer_gain).enumerate() {
            let [gamma_c, gain] = [emc.gamma_c.get(k), emc.feedback_gain.get(k)]
                .map(|value| value.map_or(String::new(), |v| number(*v, 4)));
            // Zero but for rounding, when γ_0 = β.
            let l = if l.abs() < 1e-12 { 0.0 } else { l };
            table = table.row([k.to_string(), number(*gamma, 4), number(l, 4), gamma_c, gain]);
        }
        tables.push(table);
    }
    if let Some(pid) = design.pid {
        let caption = format!("PID for model `{}`, T_c = {} s", design.model, number(design.period_s, 4));
        tables.push(
            TextTable::new(["gain", "value", "unit"])
                .caption(caption)
                .row(["k_P".to_owned(), number(pid.k_p, 4), "N m/rad".to_owned()])
                .row(["k_I".to_owned(), number(pid.k_i, 4), "N m/(rad s)".to_owned()])
                .row(["k_D".to_owned(), number(pid.k_d, 4), "N m s/rad".to_owned()]),
        );
    }
    if let Some(margins) = &design.margins {
        tables.push(margin_table(design, margins));
    }
    if !design.closed_loop.is_empty() {
        let mut table =
            TextTable::new(["real", "imaginary", "modulus"]).caption("Eigenvalues of the closed loop");
        for value in design
            .closed_loop
            .iter()
            .filter(|value| value.modulus > crate::report::thresholds::THRESHOLDS.shown_modulus)
        {
            table = table.row([value.real, value.imaginary, value.modulus].map(|part| number(part, 4)));
        }
        tables.push(table);
    }
    tables
}

fn margin_table(design: &Design, margins: &Margins) -> TextTable {
    let decibel = |factor: f64| format!("{} ({} dB)", number(factor, 3), number(20.0 * factor.log10(), 3));
    let caption = format!("Discrete loop with {} ms of transport delay", number(1e3 * design.delay_s, 3));
    let rows = [
        ("gain may grow by", decibel(margins.gain_up)),
        ("gain may fall to", decibel(margins.gain_down)),
        ("phase margin [°]", number(margins.phase_rad.to_degrees(), 3)),
        ("at [rad/s]", number(margins.crossover_rad_s, 3)),
        ("further delay up to [ms]", number(1e3 * margins.delay_s, 3)),
        ("sensitivity peak", number(margins.sensitivity_peak, 3)),
        ("complementary sensitivity peak", number(margins.complementary_peak, 3)),
        ("bandwidth (-3 dB) [rad/s]", number(margins.bandwidth_rad_s, 3)),
    ];
    rows.into_iter().fold(TextTable::new(["margin", "value"]).caption(caption), |table, (name, value)| {
        table.row([name.to_owned(), value])
    })
}

/// The report.
#[must_use]
pub fn page(design: &Design, closed: Option<&DiscreteLoop>) -> Page {
    let mut page = Page::new(format!("Controller design for `{}`", design.model));
    match (&design.refusal, &design.margins) {
        (Some(refusal), _) => page.verdict(Mark::Bad, format!("Refused: {refusal}.")),
        (None, Some(_)) if design.warning.is_some() => {
            page.verdict(Mark::Warning, "The closed loop is stable, and slow beyond use.")
        }
        (None, Some(margins)) if margins.sensitivity_peak > THRESHOLDS.nervous_peak => page.verdict(
            Mark::Warning,
            format!(
                "The closed loop is stable, and its sensitivity peak is above {}.",
                THRESHOLDS.nervous_peak
            ),
        ),
        _ => page.verdict(Mark::Good, "The closed loop is stable."),
    };
    design.note.iter().for_each(|note| {
        page.paragraph(format!("Note: {note}."));
    });
    design.warning.iter().for_each(|warning| {
        page.paragraph(format!("Warning: {warning}."));
    });
    design.advice.iter().for_each(|advice| {
        page.paragraph(format!("Advice: {advice}."));
    });
    tables(design).into_iter().for_each(|table| {
        page.table(table);
    });
    if let Some((closed, margins)) = closed.zip(design.margins.as_ref()) {
        let [magnitude, phase] = plots(closed, margins);
        page.heading("Frequency response").plot(magnitude).plot(phase);
    }
    page
}

/// Magnitudes of L, S and T, and the phase of L, around the crossover.
fn plots(closed: &DiscreteLoop, margins: &Margins) -> [Plot; 2] {
    // Further down nothing happens that a margin depends on.
    let mut sweep = closed.sweep();
    sweep.retain(|point| {
        point.frequency > crate::report::thresholds::THRESHOLDS.shown_from * margins.crossover_rad_s
    });
    let frequency: Vec<f64> = sweep.iter().map(|point| point.frequency).collect();
    let curve = |name: &str, pick: fn(&LoopResponse) -> Complex<f64>| {
        let values: Vec<f64> = sweep.iter().map(|point| 20.0 * pick(point).norm().log10()).collect();
        Series::line(name, &frequency, &values)
    };
    let axis = || Axis::new("frequency", "rad/s").logarithmic();
    let magnitude = Plot::new("Magnitude", axis(), Axis::new("magnitude", "dB").range(-60.0, 60.0))
        .group("loop")
        .series(curve("open loop L", |point| point.open))
        .series(curve("sensitivity S", LoopResponse::sensitivity))
        .series(curve("complementary sensitivity T", LoopResponse::complementary))
        .level("|L| = 1", 0.0);
    let phase = Plot::new("Phase of the open loop", axis(), Axis::new("phase", "deg"))
        .group("loop")
        .height(220)
        .series(Series::line("open loop L", &frequency, &unwound(&sweep, margins.crossover_rad_s)))
        .level("-180°", -180.0);
    [magnitude, phase]
}

/// [deg] Phase of L without jumps, between -360 and 0 at the crossover: the margin is what it is above -180.
fn unwound(sweep: &[LoopResponse], crossover: f64) -> Vec<f64> {
    let mut phases: Vec<f64> = Vec::with_capacity(sweep.len());
    for point in sweep {
        let phase = point.open.arg().to_degrees();
        let last = phases.last().copied().unwrap_or(phase);
        phases.push(last + (phase - last + 180.0).rem_euclid(360.0) - 180.0);
    }
    let at = sweep.partition_point(|point| point.frequency < crossover).min(sweep.len().saturating_sub(1));
    let turns = phases.get(at).map_or(0.0, |phase| (phase / 360.0).ceil());
    phases.iter().map(|phase| phase - 360.0 * turns).collect()
}
