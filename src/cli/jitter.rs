//! `rotorbench jitter`: what this machine's timing is, in cyclictest's terms.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::operate::BenchArguments;
use super::output::{AnswerArguments, writable};
use super::progress::{self, ProgressLine};
use super::{CliResult, Outcome};
use crate::report;
use crate::rt::Shutdown;
use crate::studies::jitter::{Cyclictest, JitterConfig, jitter};

/// Arguments of `jitter`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// Period of the cycles [µs]; default: the bench file's, or 1000 without one
    #[arg(long, value_name = "US", value_parser = clap::value_parser!(u32).range(100..=1_000_000))]
    period_us: Option<u32>,
    /// How long each stage runs, over all rounds [s]
    #[arg(long, visible_alias = "seconds", value_name = "S", default_value_t = 10.0, value_parser = super::operate::seconds)]
    duration_s: f64,
    /// How often the stages take turns
    #[arg(long, value_name = "N", default_value_t = 5)]
    rounds: u32,
    /// SCHED_FIFO priority, 0 = the normal scheduler; default: the bench file's, or 80
    #[arg(long, value_name = "P", value_parser = clap::value_parser!(u8).range(0..=99))]
    priority: Option<u8>,
    /// Processor to stay on; default: the bench file's, or any
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
    /// Interface to measure with; default: the bench file's, if it is virtual. On any other, which must be named here,
    /// the safe command is sent at every period
    #[arg(long, value_name = "IFACE")]
    interface: Option<String>,
    /// Leave cyclictest out even where it is installed
    #[arg(long)]
    without_cyclictest: bool,
    #[command(flatten)]
    answer: AnswerArguments,
    /// Write all histograms: an HdrHistogram interval log, or percentile text, a file for each, where it ends in .hgrm
    #[arg(long, value_name = "FILE.hdr|FILE.hgrm")]
    histogram: Option<PathBuf>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = arguments.config()?;
    let results = arguments.answer.report.iter().chain(&arguments.histogram);
    writable(results, &arguments.bench.config, arguments.answer.force)?;
    if let Some(path) = &arguments.histogram {
        arguments.answer.force.check(&earlier(path))?;
    }
    let shutdown = Shutdown::listen()?;
    // Drawn between the stages, not during them.
    let progress = ProgressLine::start();
    let measured = jitter(&config, &shutdown, |done| {
        progress
            .line(|| report::jitter::measuring(&progress::bar(done, progress::BAR), done, config.seconds));
    })?;
    drop(progress);
    if let Some(path) = &arguments.histogram {
        let duration = Duration::from_secs_f64(measured.took_s);
        for file in report::histogram::save(path, &measured.histograms(), measured.began, duration)? {
            eprintln!("histogram: {}", file.display());
        }
    }
    if let Some(path) = &arguments.answer.report {
        measured.page().save(path)?;
        eprintln!("report: {}", path.display());
    }
    if arguments.answer.json {
        println!("{}", report::json::answer(&report::json::jitter(&measured)?)?);
    } else {
        println!("{}\n{}", measured.machine_table().text(), measured.span_table().text());
        println!("{}", measured.count_table().text());
        let ratios = measured.ratio_table();
        if !ratios.is_empty() {
            println!("{}", ratios.text());
        }
        measured.omissions().iter().for_each(|line| println!("{line}"));
        println!("{}", measured.sentence());
    }
    Ok(if measured.has_missed() { Outcome::FoundWanting } else { Outcome::Done })
}

/// Files that are there of the percentile text at `path`, which is one for each histogram, named after it.
fn earlier(path: &Path) -> Vec<PathBuf> {
    let is_text = |file: &Path| file.extension().is_some_and(|it| it == "hgrm");
    if !is_text(path) {
        return Vec::new();
    }
    let start = format!("{}-", path.file_stem().unwrap_or_default().to_string_lossy());
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let found = std::fs::read_dir(folder).into_iter().flatten().flatten();
    found
        .filter(|file| file.file_name().to_string_lossy().starts_with(&start))
        .map(|file| path.with_file_name(file.file_name()))
        .filter(|file| is_text(file))
        .collect()
}

impl Arguments {
    fn config(&self) -> Result<JitterConfig, super::CliError> {
        let mut bench = self.bench.load()?;
        if self.bench.config.is_none() {
            bench.period_s = 0.001;
        }
        if let Some(period_us) = self.period_us {
            bench.period_s = f64::from(period_us) * 1e-6;
        }
        bench.real_time.priority = self.priority.unwrap_or(bench.real_time.priority);
        bench.real_time.processor = self.cpu.or(bench.real_time.processor);
        if let Some(interface) = &self.interface {
            bench.bus.interface.clone_from(interface);
        }
        let cyclictest = if self.without_cyclictest { None } else { Cyclictest::find() };
        Ok(JitterConfig {
            bench,
            seconds: self.duration_s,
            rounds: self.rounds,
            is_interface_named: self.interface.is_some(),
            cyclictest,
        })
    }
}
