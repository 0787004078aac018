//! The body block: free runs over short windows, driven by what the rotors were measured to do.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use crate::diagnose::thresholds::THRESHOLDS;
use crate::estimation::measured_rows::MeasuredRows;
use crate::estimation::moments::squares_about_mean;
use crate::estimation::scattered::scattered;
use crate::estimation::slope::{beside_a_line, finite_slope};
use crate::estimation::windows;
use crate::log::Cells;
use crate::log::segments::held_throughout;
use crate::model::{BodyInput, BodyStart, BodyTrace, Equations, LagInverse};
use crate::screening::readings;

/// One stretch of one log.
#[derive(Debug, Clone)]
pub struct BodyRun {
    /// Index of the log.
    pub log: usize,
    /// Its samples in the log.
    pub rows: Range<usize>,
    /// [N m/s] how the torque rises within the interval after each sample.
    pub torque_slope: Cells,
    /// [N m] an example of the noise that the torque carries from the rotors' sensors; none once it was asked what it does.
    pub propagated: Cells,
    /// The inputs for a model without delay or lag of the torque.
    pub input: Arc<BodyInput>,
    /// [rad/s] not-a-number where missing.
    pub rate: Cells,
    /// [rad] not-a-number where missing; empty when the log has none.
    pub angle: Cells,
    /// The windows, in samples of this run.
    pub windows: Vec<Range<usize>>,
    /// Whether each window counts.
    pub counts: Vec<bool>,
    /// [rad] and [rad/s] where each window starts.
    starts: Vec<[f64; 2]>,
    /// Once somebody asks: of a long log it is long.
    path: Arc<OnceLock<BodyPath>>,
}

/// How a body went, with straight lines over what was not measured, and what was measured next to it held where there is no line.
#[derive(Debug)]
pub struct BodyPath {
    /// [rad] empty where there is no angle.
    pub angle: Cells,
    /// [rad/s]
    pub rate: Cells,
}

impl BodyPath {
    fn of(time: &[f64], angle: &Cells, rate: &Cells) -> Self {
        let whole = |values: &Cells| {
            let is_whole = values.iter().all(|value| value.is_finite());
            if is_whole { values.clone() } else { held_throughout(&readings::bridged(time, values)).into() }
        };
        Self { angle: whole(angle), rate: whole(rate) }
    }
}

impl BodyRun {
    /// A run cut into windows of `horizon` [s].
    #[must_use]
    pub fn new(log: usize, rows: Range<usize>, source: BodySource, horizon: f64) -> Self {
        let BodySource { time, torque, torque_slope, propagated, propeller_rate, rate, angle } = source;
        let windows = windows::apart(&time, horizon, THRESHOLDS.window_samples, THRESHOLDS.window_rest);
        let angle = if angle.iter().any(|value| value.is_finite()) { angle } else { Cells::default() };
        let path = BodyPath::of(&time, &angle, &rate);
        let at = |values: &[f64], row: usize| values.get(row).copied().unwrap_or(0.0);
        let start = |window: &Range<usize>| [&path.angle, &path.rate].map(|values| at(values, window.start));
        let starts = windows.iter().map(start).collect();
        drop(path);
        Self {
            log,
            rows,
            torque_slope,
            propagated,
            rate,
            angle,
            counts: vec![true; windows.len()],
            windows,
            starts,
            path: Arc::default(),
            input: Arc::new(BodyInput { torque, propeller_rate, time }),
        }
    }

    /// How late the gyroscope is that a model says it was measured with.
    #[must_use]
    pub(crate) fn gyroscope_inverse(&self, equations: &Equations) -> LagInverse {
        let time = &self.input.time;
        let span = time.last().zip(time.first()).map_or(0.0, |(last, first)| last - first);
        equations.gyroscope_inverse(span / time.len().saturating_sub(1).max(1) as f64)
    }

    /// Where a window starts, by what was measured. Behind a gyroscope with laws of its own the body turns at another rate, and
    /// a law that is no straight line, such as dry friction, asks for that one: from the reading no fit finds there.
    fn start(&self, equations: &Equations, gyroscope: &LagInverse, window: usize) -> BodyStart {
        let (time, row) = (&self.input.time[..], self.windows[window].start);
        let [angle, rate] = self.starts[window];
        let shown = (time.get(row).copied().unwrap_or(0.0), angle, rate);
        equations.start_behind(gyroscope, shown, |half| finite_slope(time, &self.path().rate, row, half))
    }

    /// How the body went.
    #[must_use]
    pub fn path(&self) -> &BodyPath {
        self.path.get_or_init(|| BodyPath::of(&self.input.time, &self.angle, &self.rate))
    }

    /// Without the windows that begin before `time` [s].
    #[must_use]
    pub(crate) fn since(self, time: f64) -> Self {
        let begins = |window: &Range<usize>| self.input.time.get(window.start).is_some_and(|at| *at >= time);
        let kept = (0..self.windows.len()).filter(|index| begins(&self.windows[*index])).collect();
        self.with_windows(kept)
    }

    /// With these of its windows.
    fn with_windows(self, kept: Vec<usize>) -> Self {
        let windows = kept.iter().map(|index| self.windows[*index].clone()).collect();
        let counts = kept.iter().map(|index| self.counts[*index]).collect();
        let starts = kept.iter().map(|index| self.starts[*index]).collect();
        Self { windows, counts, starts, ..self }
    }

    /// One in so many of its windows.
    #[must_use]
    pub(crate) fn thinned(&self, share: usize) -> Self {
        // Rarely taken ones are not taken in step, lest they meet each move of an experiment at the same moment.
        let within =
            |group: usize| if share > THRESHOLDS.windows_in_step { scattered(group) % share } else { 0 };
        let taken = (0..self.windows.len().div_ceil(share)).map(|group| group * share + within(group));
        self.clone().with_windows(taken.filter(|index| *index < self.windows.len()).collect())
    }

    /// Channels measured: the rate, and the angle where there is one.
    #[must_use]
    pub fn channels(&self) -> usize {
        if self.angle.is_empty() { 1 } else { 2 }
    }
}

/// The signals of a run.
#[derive(Debug, Clone, Default)]
pub struct BodySource {
    /// [s]
    pub time: Cells,
    /// [N m] mean over the interval after each sample, before any effect.
    pub torque: Vec<f64>,
    /// [N m/s] how it rises within the interval.
    pub torque_slope: Cells,
    /// [N m] an example of the noise in it.
    pub propagated: Cells,
    /// [rad/s] means; empty when there is none.
    pub propeller_rate: [Vec<f64>; 2],
    /// [rad/s]
    pub rate: Cells,
    /// [rad]
    pub angle: Cells,
}

/// The inputs of a run under a model: delayed and lagged as the model says.
#[must_use]
pub fn input_under(equations: &Equations, run: &BodyRun) -> Option<BodyInput> {
    let is_other = equations.has_torque_stream() || equations.has_remembered_torque();
    is_other.then(|| {
        let torque = equations.torque_means(&run.input.time, &run.input.torque, &run.torque_slope);
        let mut input = BodyInput { torque, ..BodyInput::clone(&run.input) };
        if equations.has_remembered_torque() {
            equations.add_remembered_torque(&mut input, &run.path().angle, &run.path().rate);
        }
        input
    })
}

/// The rows of the residuals of these runs in which a rate or an angle was measured.
pub(crate) fn measured_rows(runs: &[BodyRun], units: &[Range<usize>]) -> Option<Arc<MeasuredRows>> {
    let of_run = |run: &'_ BodyRun| {
        let finite = |values: &[f64]| -> Vec<bool> { values.iter().map(|value| value.is_finite()).collect() };
        let (rate, angle) = (finite(&run.rate), finite(&run.angle));
        let each = run.windows.iter().flat_map(move |window| {
            let of = |known: &[bool]| known.get(window.clone()).unwrap_or_default().to_vec();
            [of(&rate), of(&angle)].concat()
        });
        each.collect::<Vec<bool>>()
    };
    let measured: Vec<bool> = runs.iter().flat_map(of_run).collect();
    MeasuredRows::of(measured.iter().copied(), units)
}

/// What the noise in the torque does to rate and angle of a body of 1 kg m² over the windows, rms, the fitted initial
/// state taken off: [rad/s] and [rad] times kg m².
#[must_use]
pub fn propagated(runs: &[BodyRun]) -> [f64; 2] {
    let (mut sums, mut count) = ([0.0, 0.0], 0.0);
    for run in runs.iter().filter(|run| !run.propagated.is_empty()) {
        for rows in &run.windows {
            let (mut rates, mut angles) = (vec![0.0], vec![0.0]);
            for row in rows.start..rows.end - 1 {
                let step = run.input.time[row + 1] - run.input.time[row];
                let (rate, angle) = (rates[rates.len() - 1], angles[angles.len() - 1]);
                rates.push(rate + step * run.propagated[row]);
                angles.push(angle + step * (rate + 0.5 * step * run.propagated[row]));
            }
            sums[0] += squares_about_mean(rates.iter().copied()).1;
            sums[1] += beside_a_line(&angles);
            count += rates.len() as f64;
        }
    }
    sums.map(|sum| (sum / f64::max(count, 1.0)).sqrt())
}

/// Simulates one window from its local start, and writes the residuals: rates, then angles.
pub fn window_residuals(
    (equations, gyroscope): (&Equations, &LagInverse),
    (run, input): (&BodyRun, &BodyInput),
    window: usize,
    locals: &[f64],
    sigma: [f64; 2],
    trace: &mut BodyTrace,
    out: &mut [f64],
) {
    if !run.counts[window] {
        out.fill(0.0);
        return;
    }
    let rows = run.windows[window].clone();
    let has_angle = !run.angle.is_empty();
    let local = |index: usize| locals.get(index).copied().unwrap_or(0.0);
    let (rate, angle, sensor) =
        if has_angle { (local(0), local(1), local(2)) } else { (local(0), 0.0, local(1)) };
    let from = run.start(equations, gyroscope, window);
    let start = BodyStart { angle: from.angle + angle, rate: from.rate + rate, sensor: from.sensor + sensor };
    trace.rate.clear();
    trace.angle.clear();
    equations.simulate_body(input, rows.start, rows.end, &start, trace);
    let difference = |measured: f64, simulated: f64, sigma: f64| {
        if measured.is_finite() { (measured - simulated) / sigma } else { 0.0 }
    };
    let (rates, angles) = out.split_at_mut(rows.len());
    for ((value, measured), simulated) in rates.iter_mut().zip(&run.rate[rows.clone()]).zip(&trace.rate) {
        *value = difference(*measured, *simulated, sigma[0]);
    }
    if has_angle {
        for ((value, measured), simulated) in angles.iter_mut().zip(&run.angle[rows]).zip(&trace.angle) {
            *value = difference(*measured, *simulated, sigma[1]);
        }
    }
}
