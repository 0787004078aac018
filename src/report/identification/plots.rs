//! Plots of what `identify` fitted.

use crate::estimation::frequency_response::{LagResponse, near};
use crate::estimation::quantile::median_step;
use crate::identify::{Identification, IdentifiedBody, Validation};
use crate::report::findings::driven_by;
use crate::report::thresholds::THRESHOLDS;
use crate::report::{Axis, Page, Plot, Series, Tone, number};

/// Rows from which a plot shows no single sample any more, and of the excerpt that then goes before it.
const CROWDED: usize = 2_000;
const EXCERPT: usize = 250;

/// Rows from the middle of a crowded record.
fn excerpt(rows: usize) -> Option<std::ops::Range<usize>> {
    (rows > CROWDED).then(|| rows / 2..rows / 2 + EXCERPT)
}

/// Time, measured and modelled values.
type Trace = (f64, f64, f64);

fn column(traces: &[Trace], pick: fn(&Trace) -> f64) -> Vec<f64> {
    traces.iter().map(pick).collect()
}

/// A line that breaks where rows are missing.
fn line(name: &str, time: &[f64], values: &[f64]) -> Series {
    let usual = median_step(time.iter().copied()).unwrap_or(f64::INFINITY);
    Series::line(name, time, values).break_over(THRESHOLDS.drawn_gap * usual)
}

/// Measured samples as points on the line of the model.
fn excerpt_plot(title: &str, traces: &[Trace], y: Axis) -> Option<Plot> {
    let traces = &traces[excerpt(traces.len())?];
    let time = column(traces, |row| row.0);
    Some(
        Plot::new(format!("{title}, an excerpt"), Axis::new("time", "s"), y)
            .series(line("model", &time, &column(traces, |row| row.2)).tone(Tone::Model))
            .series(Series::points("measured", &time, &column(traces, |row| row.1)).tone(Tone::Measured)),
    )
}

/// Fig. 3: measured and modelled rate, percentage error below.
pub(in crate::report) fn error_plots(page: &mut Page, run: &Validation) {
    let traces = run.traces.as_slice();
    let time = column(traces, |row| row.0);
    let percent = column(traces, |row| 100.0 * (row.2 - row.1) / row.1);
    let title = format!("Rotor rate (Fig. 3): {}", run.source);
    let rate = || Axis::new("ω_p", "rad/s");
    excerpt_plot(&title, traces, rate()).into_iter().for_each(|plot| {
        page.plot(plot);
    });
    page.plot(
        Plot::new(title, Axis::new("time", "s"), rate())
            .group(run.source.as_str())
            .series(line("measured", &time, &column(traces, |row| row.1)).tone(Tone::Measured))
            .series(line("model", &time, &column(traces, |row| row.2)).tone(Tone::Model)),
    )
    .plot(
        Plot::new("Simulation error", Axis::new("time", "s"), Axis::new("error", "%"))
            .group(run.source.as_str())
            .height(220)
            .series(line("(model - measured) / measured", &time, &percent).tone(Tone::Residual)),
    );
}

/// The body's measured rate, and what J makes of the torque, window by window.
pub(super) fn body_plots(page: &mut Page, body: &IdentifiedBody) {
    let traces = body.traces.as_slice();
    let time = column(traces, |row| row.0);
    let error = column(traces, |row| row.2 - row.1);
    let title = format!("Body rate: {}", body.source);
    let rate = || Axis::new("ω_b", "rad/s");
    page.heading("Body").paragraph(format!(
        "J from {}, over windows of half a second, each from its own mean: {} rad/s are left of a motion of {} rad/s rms.",
        driven_by(body.driven_by),
        number(body.residual_rms, 3),
        number(body.motion_rms, 3)
    ));
    excerpt_plot(&title, traces, rate()).into_iter().for_each(|plot| {
        page.plot(plot);
    });
    page.plot(
        Plot::new(title, Axis::new("time", "s"), rate())
            .group("body")
            .series(Series::line("measured", &time, &column(traces, |row| row.1)).tone(Tone::Measured))
            .series(Series::line("model", &time, &column(traces, |row| row.2)).tone(Tone::Model)),
    )
    .plot(
        Plot::new("Error", Axis::new("time", "s"), Axis::new("model - measured", "rad/s"))
            .group("body")
            .height(220)
            .series(Series::line("model - measured", &time, &error).tone(Tone::Residual)),
    );
}

impl Identification {
    /// Fig. 5: frequency response of data and model.
    pub fn response_plots(&self, page: &mut Page) {
        let good: Vec<_> = self
            .frequency_response
            .iter()
            .filter(|point| point.coherence > THRESHOLDS.shown_coherence)
            .collect();
        if good.is_empty() {
            return;
        }
        let frequency: Vec<f64> = good.iter().map(|point| point.frequency).collect();
        let of = |pick: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..good.len()).map(pick).collect() };
        let lag = LagResponse { pole: self.actuator.pole, delay: self.actuator.delay };
        let sampled = |k: usize| lag.sampled(self.interval, frequency[k]);
        let continuous = |k: usize| lag.continuous(frequency[k]);
        // Unwound as the model's: a delay turns it more than once.
        let phase = of(&|k| near(good[k].phase_deg, sampled(k).1));
        let axis = || Axis::new("frequency", "Hz").logarithmic();
        let low = of(&|k| good[k].magnitude - 1.96 * good[k].magnitude_error);
        let high = of(&|k| good[k].magnitude + 1.96 * good[k].magnitude_error);
        page.plot(
            Plot::new("Magnitude from z to ω_p (Fig. 5)", axis(), Axis::new("magnitude", "-").logarithmic())
                .group("bode")
                .series(Series::band("95 %", &frequency, &low, &high).tone(Tone::Quiet))
                .series(Series::points("data", &frequency, &of(&|k| good[k].magnitude)).tone(Tone::Measured))
                .series(Series::line("model, sampled", &frequency, &of(&|k| sampled(k).0)).tone(Tone::Model))
                .series(Series::line("model, continuous", &frequency, &of(&|k| continuous(k).0)).dashed()),
        )
        .plot(
            Plot::new("Phase", axis(), Axis::new("phase", "deg"))
                .group("bode")
                .height(220)
                .series(Series::points("data", &frequency, &phase).tone(Tone::Measured))
                .series(Series::line("model, sampled", &frequency, &of(&|k| sampled(k).1)).tone(Tone::Model))
                .series(Series::line("model, continuous", &frequency, &of(&|k| continuous(k).1)).dashed()),
        )
        .plot(
            Plot::new("Coherence", axis(), Axis::new("coherence", "-").range(0.0, 1.05))
                .group("bode")
                .height(200)
                .series(
                    Series::line("coherence", &frequency, &of(&|k| good[k].coherence)).tone(Tone::Measured),
                ),
        );
    }
}
