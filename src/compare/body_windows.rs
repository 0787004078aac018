//! The body over windows: each starts where it was measured to be.

use std::borrow::Cow;
use std::ops::Range;

use super::CompareConfig;
use super::block_run::{BehindSensors, BlockRun, NoisePath};
use super::body_drive::BodyDrive;
use super::run::RunMode;
use crate::cancel;
use crate::estimation::slope::finite_slope;
use crate::estimation::windows;
use crate::log::Dataset;
use crate::model::{BodyInput, BodyTrace, Equations, LagInverse};
use crate::screening::readings;
use crate::signal::columns::{BODY_ANGLE, BODY_RATE, PROPELLER_RATES};

/// Windows over the body: rate, and angle where it is measured.
pub(crate) fn body(
    name: &'static str,
    equations: &Equations,
    log: &Dataset,
    config: &CompareConfig,
    driven: &BodyDrive,
) -> Vec<BlockRun> {
    let Some(shown) = log.column(BODY_RATE) else { return Vec::new() };
    let shown_angle = log.column(BODY_ANGLE);
    let rate = driven.judged.driven_rows(shown);
    let angle = shown_angle.map(|angle| driven.judged.driven_rows(angle));
    let in_part = matches!(rate, Cow::Owned(_));
    let rotors = driven.by.first() == Some(&PROPELLER_RATES[0]);
    let interval = log.median_interval();
    let gyroscope = equations.gyroscope_inverse(interval);
    let behind = BehindSensors::of((&gyroscope, &equations.telemetry_inverse(interval)), log);
    let [start_rate, start_angle] =
        [Some(shown), shown_angle].map(|shown| shown.map(|shown| readings::bridged(log.time(), shown)));
    let starts = Starts { equations, gyroscope, rate: start_rate.unwrap_or_default(), angle: start_angle };
    let floor = |angle| NoisePath::Window { rotors, angle, behind };
    let mut rates = BlockRun::new(name, BODY_RATE, "rad/s", &driven.by, floor(false));
    let mut angles = BlockRun::new(name, BODY_ANGLE, "rad", &driven.by, floor(true));
    let (mut squares, mut count) = (0.0, 0.0);
    let mut trace = BodyTrace::default();
    for (rows, input) in &driven.stretches {
        cancel::check();
        let is_known = |row: usize| rate[rows.start + row].is_finite() && starts.is_known(rows.start + row);
        for window in windows::joined(&input.time, is_known, config.horizon_s) {
            starts.run((rows, input), &window, &mut trace);
            // The start is the measurement itself: it is not scored.
            let scored = rows.start + window.start + 1..rows.start + window.end;
            rates.add_part(in_part.then_some(&rate[scored.clone()]), scored.clone(), &trace.rate[1..]);
            if let Some(angle) = &angle {
                angles.add_part(in_part.then_some(&angle[scored.clone()]), scored, &trace.angle[1..]);
            }
        }
        for window in windows::joined(&input.time, is_known, f64::MIN_POSITIVE) {
            starts.run((rows, input), &window, &mut trace);
            let step = rate[rows.start + window.end - 1] - trace.rate[1];
            if step.is_finite() {
                squares += step * step;
                count += 1.0;
            }
        }
    }
    rates.run = RunMode::Windows(config.horizon_s);
    angles.run = rates.run;
    rates.one_step = (count > 0.0).then(|| f64::sqrt(squares / count));
    [rates, angles].into_iter().filter(|block| block.is_scored(log)).collect()
}

/// Where windows start. They are scored by what was measured.
struct Starts<'a> {
    equations: &'a Equations,
    gyroscope: LagInverse,
    /// [rad/s] what the gyroscope showed, bridged where it shortly did not.
    rate: Cow<'a, [f64]>,
    /// [rad] likewise.
    angle: Option<Cow<'a, [f64]>>,
}

impl Starts<'_> {
    fn is_known(&self, row: usize) -> bool {
        self.angle.as_ref().is_none_or(|angle| angle[row].is_finite())
    }

    /// Runs a window of the stretch that these rows of the log are.
    fn run(&self, (rows, input): (&Range<usize>, &BodyInput), window: &Range<usize>, trace: &mut BodyTrace) {
        let (time, readings, row) = (&input.time[..], &self.rate[rows.clone()], window.start);
        let angle = self.angle.as_ref().map_or(0.0, |angle| angle[rows.start + row]);
        let shown = (time[row], angle, readings[row]);
        let start = self
            .equations
            .start_behind(&self.gyroscope, shown, |half| finite_slope(time, readings, row, half));
        trace.rate.clear();
        trace.angle.clear();
        self.equations.simulate_body(input, window.start, window.end, &start, trace);
    }
}
