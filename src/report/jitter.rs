//! The report of `jitter`: what the machine's timing is, stage by stage, beside cyclictest.

use hdrhistogram::Histogram;

use super::findings::text;
use super::{Axis, Mark, Page, Plot, Series, TextTable, Tone, number};
use crate::rt::{Granted, Machine, Percentiles};
use crate::screening::Finding;
use crate::studies::jitter::{Jitter, Ratios, StageResult};

/// [ns] in a µs.
const MICROSECOND: f64 = 1e3;
/// Percentile points of a curve for each halving of what is left.
const TICKS: u32 = 8;

/// A line about a measurement that goes on: a bar, the share that is done, and how long a stage takes [s].
#[must_use]
pub fn measuring(bar: &str, share: f64, stage_s: f64) -> String {
    format!("measuring {bar} {:.0} %  {stage_s} s for each stage", 100.0 * share)
}

impl Jitter {
    /// The spans of every stage, and cyclictest's latency.
    #[must_use]
    pub fn span_table(&self) -> TextTable {
        let mut table = TextTable::new(["[µs]", "", "p50", "p90", "p99", "p99.9", "p99.99", "max"])
            .caption("Spans; no outlier is removed");
        for result in &self.stages {
            let name = result.stage.to_string();
            let Some(timing) = &result.timing else { continue };
            let spans = [
                ("release lateness", &timing.lateness),
                ("execution", &timing.execution),
                ("command out, after due", &timing.response),
                ("sensor to command", &timing.sensor_to_command),
            ];
            let measured = spans.into_iter().filter(|(_, spans)| spans.count > 0);
            for (row, (what, spans)) in measured.enumerate() {
                let name = if row == 0 { name.clone() } else { String::new() };
                table = table.row([name, what.to_owned()].into_iter().chain(figures(spans)));
            }
        }
        let Some(latency) = &self.cyclictest.latency else { return table };
        table.row(["cyclictest".to_owned(), "latency".to_owned()].into_iter().chain(figures(latency)))
    }

    /// What was not measured, and why.
    #[must_use]
    pub fn omissions(&self) -> Vec<String> {
        let reason = |why: &Option<Finding>| why.as_ref().map_or_else(|| "not reached".to_owned(), text);
        let stages = self.stages.iter().filter(|result| result.timing.is_none());
        let mut said: Vec<String> =
            stages.map(|it| format!("{}: not measured: {}", it.stage, reason(&it.finding))).collect();
        if self.cyclictest.latency.is_none() {
            said.push(format!("cyclictest: not measured: {}", reason(&self.cyclictest.finding)));
        }
        said
    }

    /// Slots, overruns and disturbances of every stage.
    #[must_use]
    pub fn count_table(&self) -> TextTable {
        let headers = [
            "stage",
            "slots",
            "run",
            "skipped",
            "overruns",
            "in a row",
            "page faults",
            "from disk",
            "forced switches",
        ];
        let table = TextTable::new(headers).caption("Slots and disturbances");
        self.stages.iter().fold(table, |table, result| {
            let Some(timing) = &result.timing else { return table };
            let mark = if timing.overruns + timing.skipped > 0 { Mark::Bad } else { Mark::Good };
            let usage = &result.usage;
            let counts = [
                timing.slots,
                timing.run,
                timing.skipped,
                timing.overruns,
                timing.longest_overrun,
                usage.minor_page_faults,
                usage.major_page_faults,
                usage.involuntary_context_switches,
            ];
            let cells = std::iter::once(result.stage.to_string()).chain(counts.iter().map(u64::to_string));
            table.marked_row(mark, cells)
        })
    }

    /// Release lateness of every stage over cyclictest's latency of the same round; no rows without cyclictest.
    #[must_use]
    pub fn ratio_table(&self) -> TextTable {
        let table = TextTable::new(["release lateness / cyclictest's latency", "p50", "p99", "p99.9"])
            .caption("Beside cyclictest, median of the rounds' ratios");
        self.stages.iter().fold(table, |table, result| {
            let Some(Ratios { p50, p99, p99_9 }) = result.to_cyclictest else { return table };
            table.row([
                result.stage.to_string(),
                format!("{p50:.2}"),
                format!("{p99:.2}"),
                format!("{p99_9:.2}"),
            ])
        })
    }

    /// The machine, what was asked of it and what it granted.
    #[must_use]
    pub fn machine_table(&self) -> TextTable {
        let Machine { kernel, preemption, tick_hz, timer_resolution_ns, clock_source, .. } = &self.machine;
        let Machine { processors, isolated, tickless, governors, is_virtual, .. } = &self.machine;
        let none = |text: &str| if text.is_empty() { "none".to_owned() } else { text.to_owned() };
        let asked = &self.asked;
        let scheduler = match asked.priority {
            0 => "normal scheduler".to_owned(),
            priority => format!("SCHED_FIFO {priority}"),
        };
        let lock = if asked.lock_memory { ", memory locked" } else { "" };
        let processor = asked.processor.map_or(String::new(), |it| format!(", processor {it}"));
        let granted = self.stages.iter().rev().find_map(|it| it.granted.as_ref());
        let kind = if *is_virtual { " (a virtual machine: its host may take them away)" } else { "" };
        let table = TextTable::new(["machine", ""])
            .row(["kernel".to_owned(), format!("{kernel}, {preemption}, {tick_hz} Hz")])
            .row(["processors".to_owned(), format!("{processors}{kind}")])
            .row(["isolated, tickless".to_owned(), format!("{}, {}", none(isolated), none(tickless))])
            .row(["frequency governor".to_owned(), none(&governors.join(", "))])
            .row(["clock".to_owned(), format!("{clock_source}, timers to {timer_resolution_ns} ns")])
            .row([
                "asked for".to_owned(),
                format!("{scheduler}{lock}{processor}, timer slack {} ns", asked.timer_slack_ns),
            ])
            .row(["cyclictest".to_owned(), none(&self.cyclictest.command)]);
        let Some(granted) = granted else { return table.row(["granted", "nothing was measured"]) };
        let had = Granted { refused: Vec::new(), ..granted.clone() };
        let table = table.row(["granted".to_owned(), had.to_string()]);
        granted.refused.iter().fold(table, |table, refused| {
            table.marked_row(Mark::Warning, ["not granted".to_owned(), refused.clone()])
        })
    }

    /// One sentence: whether the machine kept its period.
    #[must_use]
    pub fn sentence(&self) -> String {
        let missed: Vec<String> = self
            .stages
            .iter()
            .filter_map(|result| {
                let timing = result.timing.as_ref().filter(|it| it.overruns + it.skipped > 0)?;
                Some(format!("{}: {} late, {} skipped", result.stage, timing.overruns, timing.skipped))
            })
            .collect();
        let cut = if self.is_cut_short { " Ended before its time." } else { "" };
        if missed.is_empty() {
            return format!("Every command was out before the next slot was due.{cut}");
        }
        format!("Slots whose command was not out before the next was due: {}.{cut}", missed.join("; "))
    }

    /// The whole report.
    #[must_use]
    pub fn page(&self) -> Page {
        let mut page = Page::new(format!("Timing of this machine at {} Hz", number(1.0 / self.period_s, 4)));
        let mark = if self.has_missed() { Mark::Bad } else { Mark::Good };
        page.verdict(mark, self.sentence());
        page.paragraph(format!(
            "Each stage ran for {} s in {} rounds. Lateness is from when a slot was due to when it began; execution from \
             there to when its command was out; the deadline is on both together.",
            number(self.seconds, 3),
            self.rounds
        ));
        page.heading("Figures").table(self.span_table()).table(self.count_table());
        let ratios = self.ratio_table();
        if !ratios.is_empty() {
            page.table(ratios);
        }
        page.list(self.omissions());
        page.heading("Release lateness")
            .plot(self.percentile_plot("Lateness that is not exceeded", &self.latenesses()))
            .plot(self.distribution_plot("How often which lateness", &self.latenesses()));
        let commands = self.curves(|statistics| &statistics.sensor_to_command);
        if !commands.is_empty() {
            page.heading("Sensor to command")
                .plot(self.percentile_plot("From the gyro sample's arrival to the command", &commands));
        }
        let executions = self.curves(|statistics| &statistics.execution);
        page.heading("Execution").plot(self.percentile_plot("Time that is not exceeded", &executions));
        page.heading("Machine").table(self.machine_table());
        page
    }

    /// Every histogram measured, with its name.
    #[must_use]
    pub fn histograms(&self) -> Vec<super::histogram::Named<'_>> {
        let mut named = Vec::new();
        for StageResult { stage, statistics, .. } in &self.stages {
            let Some(statistics) = statistics else { continue };
            for (what, histogram) in [
                ("lateness", &statistics.lateness),
                ("execution", &statistics.execution),
                ("response", &statistics.response),
                ("sensor_to_command", &statistics.sensor_to_command),
            ] {
                if !histogram.is_empty() {
                    named.push((format!("{}.{what}", stage.name()), histogram));
                }
            }
        }
        if !self.cyclictest.histogram.is_empty() {
            named.push(("cyclictest.latency".to_owned(), &self.cyclictest.histogram));
        }
        named
    }

    fn latenesses(&self) -> Vec<(String, &Histogram<u64>)> {
        let mut curves = self.curves(|statistics| &statistics.lateness);
        if !self.cyclictest.histogram.is_empty() {
            curves.push(("cyclictest".to_owned(), &self.cyclictest.histogram));
        }
        curves
    }

    fn curves(&self, of: fn(&crate::rt::Statistics) -> &Histogram<u64>) -> Vec<(String, &Histogram<u64>)> {
        let measured = self.stages.iter().filter_map(|it| Some((it.stage, of(it.statistics.as_ref()?))));
        measured.filter(|(_, it)| !it.is_empty()).map(|(stage, it)| (stage.to_string(), it)).collect()
    }

    fn percentile_plot(&self, title: &str, curves: &[(String, &Histogram<u64>)]) -> Plot {
        let plot = Plot::new(
            title,
            Axis::new("one in so many is longer", "").logarithmic(),
            Axis::new("span", "µs").logarithmic(),
        );
        curves.iter().fold(plot, |plot, (name, histogram)| {
            let (mut x, mut y) = (Vec::new(), Vec::new());
            for step in histogram.iter_quantiles(TICKS) {
                let left = 1.0 - step.quantile_iterated_to();
                // The last step is the maximum: one of all.
                x.push(if left > 0.0 {
                    (1.0 / left).min(histogram.len() as f64)
                } else {
                    histogram.len() as f64
                });
                y.push(step.value_iterated_to() as f64 / MICROSECOND);
            }
            plot.series(toned(Series::line(name, &x, &y), name))
        })
    }

    fn distribution_plot(&self, title: &str, curves: &[(String, &Histogram<u64>)]) -> Plot {
        let plot =
            Plot::new(title, Axis::new("span", "µs").logarithmic(), Axis::new("times", "").logarithmic());
        curves.iter().fold(plot, |plot, (name, histogram)| {
            let (mut x, mut y) = (Vec::new(), Vec::new());
            // From a µs on in steps of a quarter: wide enough to count, narrow enough to see.
            for step in histogram.iter_log(MICROSECOND as u64, 1.25) {
                x.push(step.value_iterated_to() as f64 / MICROSECOND);
                y.push(step.count_since_last_iteration() as f64);
            }
            plot.series(toned(Series::steps(name, &x, &y), name))
        })
    }
}

/// The yardstick is in the background.
fn toned(series: Series, name: &str) -> Series {
    if name == "cyclictest" { series.tone(Tone::Quiet).dashed() } else { series }
}

fn figures(spans: &Percentiles) -> impl Iterator<Item = String> {
    let Percentiles { p50_us, p90_us, p99_us, p99_9_us, p99_99_us, max_us, .. } = *spans;
    [p50_us, p90_us, p99_us, p99_9_us, p99_99_us, max_us].into_iter().map(|it| format!("{it:.1}"))
}
