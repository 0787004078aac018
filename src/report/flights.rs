//! Flights side by side: the table of answers to an impulse, and the curves, for `paper` and for `compare --runs`.

use super::findings::sentence;
use super::{Axis, Mark, Page, Plot, Series, Table, Tone, number};
use crate::studies::controller_comparison::{FlightComparison, RecordedFlight};
use crate::studies::impulse_response::{Answer, Moment};

/// A flight to be shown.
#[derive(Debug, Clone)]
pub(super) struct Shown<'a> {
    /// Name of its curve and row.
    pub name: String,
    /// [s] transport delay, where it is known.
    pub delay: Option<f64>,
    /// Colour of its curves.
    pub tone: Tone,
    /// How the controller answered.
    pub answer: &'a Answer,
    /// Period by period.
    pub moments: &'a [Moment],
    /// [s] taken from the time, so that all are struck at once.
    pub begins: f64,
}

/// Peak, settling, overshoot, swings, ITAE, effort and error of the disturbance's estimate, flight by flight.
pub(super) fn answer_table(flights: &[Shown], caption: &str) -> Table {
    let table = Table::new([
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
    flights.iter().fold(table, |table, flight| {
        let answer = flight.answer;
        table.row([
            flight.name.clone(),
            known(flight.delay.map(|delay| 1e3 * delay)),
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
fn settling(answer: &Answer) -> String {
    if answer.settled { number(answer.settling, 3) } else { "not settled within the window".to_owned() }
}

/// Name, beginning and end [s] of the first impulse, where it is known. As a curve it would press the estimates, ten times
/// smaller, to the axis.
fn impulse(flight: &Shown) -> Option<(String, f64, f64)> {
    let is_struck = |moment: &&Moment| moment.disturbance.abs() > 0.0;
    let first = flight.moments.iter().find(is_struck)?;
    let behind =
        flight.moments.iter().skip_while(|moment| !is_struck(moment)).find(|moment| !is_struck(moment))?;
    let label = format!("impulse, {} N m", number(first.disturbance, 2));
    Some((label, first.time - flight.begins, behind.time - flight.begins))
}

/// Angle, and disturbance estimate; both with one axis of time, and the impulse where it is known.
pub(super) fn answer_plots(flights: &[Shown], titles: [&str; 2], group: &str) -> [Plot; 2] {
    let column =
        |flight: &Shown, pick: fn(&Moment) -> f64| -> Vec<f64> { flight.moments.iter().map(pick).collect() };
    let time = |flight: &Shown| -> Vec<f64> {
        flight.moments.iter().map(|moment| moment.time - flight.begins).collect()
    };
    let axis = || Axis::new("time", "s");
    let mut angle = Plot::new(titles[0], axis(), Axis::new("angle", "rad")).group(group);
    let mut torque = Plot::new(titles[1], axis(), Axis::new("torque", "N m")).group(group);
    for flight in flights {
        let curve =
            |pick| Series::line(flight.name.as_str(), &time(flight), &column(flight, pick)).tone(flight.tone);
        angle = angle.series(curve(|moment| moment.angle));
        torque = torque.series(curve(|moment| moment.estimate));
    }
    if let Some((label, from, to)) = flights.iter().find_map(impulse) {
        angle = angle.span(label.as_str(), from, to);
        torque = torque.span(label, from, to);
    }
    [angle, torque]
}

/// What the table's last column means.
pub(super) const DISTURBANCE: &str = "d̂ is the controller's estimate of the disturbance torque on the body, a PID's what its integral holds against.";

impl FlightComparison {
    fn shown(&self) -> Vec<Shown<'_>> {
        let alone = |flight: &RecordedFlight| {
            self.flights.iter().filter(|other| other.controller == flight.controller).count() == 1
        };
        let each = self.flights.iter().map(|flight| Shown {
            name: if alone(flight) {
                flight.controller.to_owned()
            } else {
                format!("{} ({})", flight.controller, flight.recording)
            },
            delay: flight.delay,
            tone: Tone::Next,
            answer: &flight.answer,
            moments: &flight.moments,
            begins: flight.struck_s,
        });
        each.collect()
    }

    /// How each controller answered.
    #[must_use]
    pub fn table(&self) -> Table {
        let judged = self.flights.first().map_or(0.0, |flight| flight.judged_s);
        let caption = format!("Answer to the impulse, judged for {} s behind it", number(judged, 3));
        answer_table(&self.shown(), &caption)
    }

    /// How each controller answered the impulses behind the first one; `None` where there are none.
    #[must_use]
    pub fn later_table(&self) -> Option<Table> {
        let mut rows = Vec::new();
        for (flight, shown) in self.flights.iter().zip(self.shown()) {
            rows.extend(flight.later.iter().map(|strike| Shown {
                name: format!(
                    "{}, {} s, {} N m for {} ms, judged for {} s",
                    shown.name,
                    number(strike.struck_s, 4),
                    number(strike.impulse.torque, 3),
                    number(1e3 * strike.impulse.duration_s, 3),
                    number(strike.judged_s, 3)
                ),
                answer: &strike.answer,
                ..shown.clone()
            }));
        }
        (!rows.is_empty()).then(|| answer_table(&rows, "Answers to the impulses behind the first one"))
    }

    /// The tables, and what to know about the flights.
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
        let mut sources = Table::new(["recording", "controller", "struck at [s]", "impulse", "angle"])
            .caption("The recordings");
        for flight in &self.flights {
            let impulse = flight.impulse.map_or_else(
                || "not known".to_owned(),
                |it| format!("{} N m for {} ms", number(it.torque, 3), number(1e3 * it.duration_s, 3)),
            );
            let angle = if flight.is_angle_measured { "measured" } else { "estimated by the controller" };
            sources = sources.row([
                flight.recording.clone(),
                flight.controller.to_owned(),
                number(flight.struck_s, 4),
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
