//! Progress on long work: one line that is written over, where standard error is a terminal; nothing elsewhere.

use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// [characters] of a bar.
pub const BAR: usize = 40;
/// Between two drawings of the line.
const PERIOD: Duration = Duration::from_millis(50);
/// [characters] of a terminal that does not say how wide it is.
const USUAL_WIDTH: u16 = 80;

/// The line. It goes when this is dropped.
#[derive(Debug)]
pub struct ProgressLine {
    began: Instant,
    is_shown: bool,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    drawn: Option<Instant>,
    count: usize,
}

impl ProgressLine {
    /// Begins now.
    pub fn start() -> Self {
        let is_shown = std::io::stderr().is_terminal();
        Self { began: Instant::now(), is_shown, state: Mutex::default() }
    }

    /// What is being done, and the share of the whole that is done.
    pub fn share(&self, what: &str, share: f64) {
        self.draw(|_, elapsed| {
            let whole = if share > 0.0 { time(elapsed.div_f64(share.min(1.0))) } else { "?".to_owned() };
            let percent = 100.0 * share.clamp(0.0, 1.0);
            format!("{} {percent:>3.0} %  {} of about {whole}  {what}", bar(share, BAR), time(elapsed))
        });
    }

    /// The step before is done, this one of `all` begins.
    pub fn step(&self, what: &str, all: usize) {
        // Steps are few, and each is said.
        let done = self.count(|state| state.drawn = None) - 1;
        self.draw(|_, elapsed| {
            let share = done as f64 / all.max(1) as f64;
            format!("{} {done:>2} of {all}  {}  {what}", bar(share, BAR), time(elapsed))
        });
    }

    /// One more of what nobody knows the number of.
    pub fn one_more(&self, what: &str) {
        self.count(|_| ());
        self.draw(|count, elapsed| format!("{count} {what}, {}", time(elapsed)));
    }

    /// Words and the time since the beginning.
    pub fn words(&self, words: impl FnOnce() -> String) {
        self.draw(|_, elapsed| format!("{} {}", time(elapsed), words()));
    }

    /// A line of the caller's own.
    pub fn line(&self, line: impl FnOnce() -> String) {
        self.draw(|_, _| line());
    }

    fn count(&self, change: impl FnOnce(&mut State)) -> usize {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.count += 1;
        change(&mut state);
        state.count
    }

    fn draw(&self, line: impl FnOnce(usize, Duration) -> String) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.is_shown || state.drawn.is_some_and(|drawn| drawn.elapsed() < PERIOD) {
            return;
        }
        let columns = crossterm::terminal::size().map_or(0, |(columns, _)| columns);
        let width = if columns > 0 { columns } else { USUAL_WIDTH };
        let text = line(state.count, self.began.elapsed());
        let text: String = text.chars().take(usize::from(width).saturating_sub(1)).collect();
        // Who closed the terminal does not miss it.
        let _ = write!(std::io::stderr(), "\r{text}\x1b[K");
        state.drawn = Some(Instant::now());
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        if self.is_shown {
            let _ = write!(std::io::stderr(), "\r\x1b[K");
        }
    }
}

/// A share from 0 to 1, drawn over so many characters.
pub fn bar(share: f64, width: usize) -> String {
    let full = (share.clamp(0.0, 1.0) * width as f64) as usize;
    "█".repeat(full) + &"░".repeat(width - full)
}

/// `4:05`, `1:00:00`.
fn time(span: Duration) -> String {
    let (hours, minutes, seconds) = (span.as_secs() / 3600, span.as_secs() / 60 % 60, span.as_secs() % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{seconds:02}") } else { format!("{minutes}:{seconds:02}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_is_as_wide_as_it_should_be_and_time_reads_as_a_clock() {
        assert_eq!(
            [bar(0.0, 4), bar(0.5, 4), bar(7.0, 4), bar(f64::NAN, 4)],
            ["░░░░", "██░░", "████", "░░░░"]
        );
        assert_eq!([5, 245, 3600].map(|it| time(Duration::from_secs(it))), ["0:05", "4:05", "1:00:00"]);
    }

    #[test]
    fn what_is_counted_is_counted_without_a_terminal_too() {
        let mut progress = ProgressLine::start();
        progress.is_shown = false;
        progress.step("one", 2);
        progress.one_more("candidates");
        progress.share("all", 0.0);
        assert_eq!(progress.state.lock().map(|state| state.count).ok(), Some(2));
    }
}
