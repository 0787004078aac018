//! Progress on long work: a bar where standard error is a terminal, nothing elsewhere.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over a share from 0 to 1.
pub struct Progress {
    bar: ProgressBar,
    steps: u64,
}

/// Positions of a bar that is told shares.
const FINENESS: f64 = 1000.0;

impl Progress {
    /// For work that knows which share of it is done.
    pub fn of_share() -> Self {
        Self::new(FINENESS as u64, "{bar:40} {percent:>3} %  {elapsed} of about {duration}  {msg}")
    }

    /// For work of so many named steps.
    pub fn of_steps(steps: usize) -> Self {
        Self::new(steps as u64, "{bar:40} {pos:>2} of {len}  {elapsed}  {msg}")
    }

    fn new(steps: u64, template: &str) -> Self {
        let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        Self { bar: ProgressBar::new(steps).with_style(style), steps }
    }

    /// What is being done, and the share that is done.
    pub fn share(&self, what: &str, share: f64) {
        self.bar.set_message(what.to_owned());
        self.bar.set_position((share.clamp(0.0, 1.0) * self.steps as f64) as u64);
    }

    /// The step before is done, this one begins.
    pub fn begin(&self, step: &'static str) {
        // The first step that begins has none before it.
        if !self.bar.message().is_empty() {
            self.bar.inc(1);
        }
        self.bar.set_message(step);
        self.bar.tick();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
