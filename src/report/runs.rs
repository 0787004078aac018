//! Runs side by side: the table of answers to an impulse, and the curves, for `paper` and for `compare --runs`.

use super::findings::sentence;
use super::{Axis, Mark, Page, Plot, Series, TextTable, Tone, number};
use crate::studies::controller_comparison::{RecordedRun, RunComparison};
use crate::studies::impulse_response::{ImpulseResponse, Moment};

/// A run to be shown.
#[derive(Debug, Clone)]
pub(super) struct Shown<'a> {
    /// Name of its curve and row.
    pub name: String,
    /// [s] transport delay, where it is known.
    pub delay: Option<f64>,
    /// Colour of its curves.
    pub tone: Tone,
    /// How the controller answered.
    pub answer: &'a ImpulseResponse,
    /// Period by period.
    pub moments: &'a [Moment],
    /// [s] taken from the time, so that all are struck at once.
    pub begins: f64,
}

/// Peak, settling, overshoot, swings, ITAE, effort and error of the disturbance's estimate, run by run.
pub(super) fn answer_table(runs: &[Shown], caption: &str) -> TextTable {
    let table = TextTable::new([
        "",
        "delay [ms]",
        "peak [rad]",
        "settling [s]",
        "overshoot [%]",
        "swings",
        "ITAE [rad s²]",
        "effort [N m]",
        "d̂ error [N m]",
    ])
    .caption(caption);
    let known = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| number(value, 3));
    runs.iter().fold(table, |table, run| {
        let answer = run.answer;
        table.row([
            run.name.clone(),
            known(run.delay.map(|delay| 1e3 * delay)),
            number(answer.peak, 3),
            settling(answer),
            number(answer.overshoot_percent, 3),
            answer.swings.to_string(),
            number(answer.itae, 3),
            number(answer.effort, 3),
            known(answer.disturbance_error),
        ])
    })
}

/// [s], or that it did not.
fn settling(answer: &ImpulseResponse) -> String {
    if answer.settled { number(answer.settling, 3) } else { "not settled within the window".to_owned() }
}

/// Name, beginning and end [s] of the first impulse, where it is known. As a curve it would press the estimates, ten times
/// smaller, to the axis.
fn impulse(run: &Shown) -> Option<(String, f64, f64)> {
    let is_struck = |moment: &&Moment| moment.disturbance.abs() > 0.0;
    let first = run.moments.iter().find(is_struck)?;
    let behind =
        run.moments.iter().skip_while(|moment| !is_struck(moment)).find(|moment| !is_struck(moment))?;
    let label = format!("impulse, {} N m", number(first.disturbance, 2));
    Some((label, first.time - run.begins, behind.time - run.begins))
}

/// Angle, and disturbance estimate; both with one axis of time, and the impulse where it is known.
pub(super) fn answer_plots(runs: &[Shown], titles: [&str; 2], group: &str) -> [Plot; 2] {
    let column =
        |run: &Shown, pick: fn(&Moment) -> f64| -> Vec<f64> { run.moments.iter().map(pick).collect() };
    let time =
        |run: &Shown| -> Vec<f64> { run.moments.iter().map(|moment| moment.time - run.begins).collect() };
    let axis = || Axis::new("time", "s");
    let mut angle = Plot::new(titles[0], axis(), Axis::new("angle", "rad")).group(group);
    let mut torque = Plot::new(titles[1], axis(), Axis::new("torque", "N m")).group(group);
    for run in runs {
        let curve = |pick| Series::line(run.name.as_str(), &time(run), &column(run, pick)).tone(run.tone);
        angle = angle.series(curve(|moment| moment.angle));
        torque = torque.series(curve(|moment| moment.estimate));
    }
    if let Some((label, from, to)) = runs.iter().find_map(impulse) {
        angle = angle.span(label.as_str(), from, to);
        torque = torque.span(label, from, to);
    }
    [angle, torque]
}

/// What the table's last column means.
pub(super) const DISTURBANCE: &str = "d̂ is the controller's estimate of the disturbance torque on the body, a PID's what its integral holds against.";

impl RunComparison {
    fn shown(&self) -> Vec<Shown<'_>> {
        let alone = |run: &RecordedRun| {
            self.runs.iter().filter(|other| other.controller == run.controller).count() == 1
        };
        let each = self.runs.iter().map(|run| Shown {
            name: if alone(run) {
                run.controller.clone()
            } else {
                format!("{} ({})", run.controller, run.recording)
            },
            delay: run.delay,
            tone: Tone::Next,
            answer: &run.answer,
            moments: &run.moments,
            begins: run.struck_s,
        });
        each.collect()
    }

    /// How each controller answered.
    #[must_use]
    pub fn table(&self) -> TextTable {
        let judged = self.runs.first().map_or(0.0, |run| run.window_s);
        let caption = format!("Response to the impulse, judged for {} s behind it", number(judged, 3));
        answer_table(&self.shown(), &caption)
    }

    /// How each controller answered the impulses behind the first one; `None` where there are none.
    fn later_table(&self) -> Option<TextTable> {
        let mut rows = Vec::new();
        for (run, shown) in self.runs.iter().zip(self.shown()) {
            rows.extend(run.later.iter().map(|strike| Shown {
                name: format!(
                    "{}, {} s, {} N m for {} ms, judged for {} s",
                    shown.name,
                    number(strike.struck_s, 4),
                    number(strike.impulse.torque, 3),
                    number(1e3 * strike.impulse.duration_s, 3),
                    number(strike.window_s, 3)
                ),
                answer: &strike.answer,
                ..shown.clone()
            }));
        }
        (!rows.is_empty()).then(|| answer_table(&rows, "Answers to the impulses behind the first one"))
    }

    /// The tables, and what to know about the runs.
    #[must_use]
    pub fn text(&self) -> String {
        let tables = std::iter::once(self.table()).chain(self.later_table());
        let warnings = self.findings.iter().map(|finding| format!("warning: {}\n", sentence(finding)));
        tables.map(|table| table.text() + "\n").chain(warnings).collect()
    }

    /// The report.
    #[must_use]
    pub fn page(&self) -> Page {
        let mut page = Page::new("Controllers side by side");
        for finding in &self.findings {
            page.verdict(Mark::Warning, sentence(finding));
        }
        page.table(self.table()).paragraph(format!(
            "Settled is within 5 % of the peak, a swing goes further than that to the other side. {DISTURBANCE}"
        ));
        self.later_table().into_iter().for_each(|table| {
            page.table(table);
        });
        let mut sources = TextTable::new(["recording", "controller", "struck at [s]", "impulse", "angle"])
            .caption("The recordings");
        for run in &self.runs {
            let impulse = run.impulse.map_or_else(
                || "not known".to_owned(),
                |it| format!("{} N m for {} ms", number(it.torque, 3), number(1e3 * it.duration_s, 3)),
            );
            let angle = if run.is_angle_measured { "measured" } else { "estimated by the controller" };
            sources = sources.row([
                run.recording.clone(),
                run.controller.clone(),
                number(run.struck_s, 4),
                impulse,
                angle.to_owned(),
            ]);
        }
        page.table(sources);
        let titles = ["Angle, less its reference", "Disturbance estimate"];
        let [angle, torque] = answer_plots(&self.shown(), titles, "time");
        page.paragraph("Time counts from the impulse.").plot(angle).plot(torque);
        page
    }
}
