//! How a rotor's command moves: jumps, ramps slow enough for [LPC16] Eq. (4), and levels.

use std::ops::Range;

use super::rotor_data::RotorLog;
use super::thresholds::THRESHOLDS;

/// Jumps of the command from which a pole may be fitted.
pub(crate) const FEWEST_JUMPS: usize = THRESHOLDS.fewest_jumps;

/// How the command moves over a stretch of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SteadyCommand {
    /// One value.
    Constant,
    /// Slow change, no jumps.
    Ramp,
}

impl RotorLog {
    /// Rows right after which the command jumps.
    pub fn jumps(&self) -> Vec<usize> {
        let jump = |row: &usize| (self.command[row + 1] - self.command[*row]).abs() > THRESHOLDS.jump;
        let inside = self.stretches.iter().flat_map(|stretch| stretch.start..stretch.end - 1);
        inside.filter(jump).collect()
    }

    /// How often the command leaves a straight line at once by more than `least` [-]: moves too small to be jumps, as a controller that
    /// follows a test signal makes them. A corner between two ramps is one.
    pub fn quick_moves(&self, least: f64) -> usize {
        let mut count = 0;
        for stretch in &self.stretches {
            let (mut before, mut after) = (stretch.start, stretch.start);
            let mut counted_until = f64::NEG_INFINITY;
            for row in stretch.clone() {
                let time = self.time[row];
                while time - self.time[before] > THRESHOLDS.jump_span && before < row {
                    before += 1;
                }
                while after + 1 < stretch.end && self.time[after] - time < THRESHOLDS.jump_span {
                    after += 1;
                }
                let (back, ahead) = (time - self.time[before], self.time[after] - time);
                if time < counted_until || back <= 0.0 || ahead <= 0.0 {
                    continue;
                }
                let slopes = [
                    (self.command[row] - self.command[before]) / back,
                    (self.command[after] - self.command[row]) / ahead,
                ];
                if (slopes[1] - slopes[0]).abs() * 0.5 * THRESHOLDS.jump_span > least {
                    count += 1;
                    // Until it lies wholly behind.
                    counted_until = self.time[after] + THRESHOLDS.jump_span;
                }
            }
        }
        count
    }

    /// How often the command jumps in all rows, and how many of these jumps a hole hides: in it, or right behind them.
    pub fn all_jumps(&self) -> (usize, usize) {
        let usable = self.jumps();
        let jump = |row: &usize| (self.command[row + 1] - self.command[*row]).abs() > THRESHOLDS.jump;
        let all: Vec<usize> = (0..self.time.len().saturating_sub(1)).filter(jump).collect();
        let is_near =
            |row: usize, after: usize| self.time[row] - self.time[after + 1] <= THRESHOLDS.transient;
        let is_hidden = |after: &&usize| {
            let mut rows = (**after..self.time.len() - 1).take_while(|row| is_near(*row, **after));
            usable.binary_search(after).is_err() && rows.any(|row| self.is_hole(row))
        };
        (all.len(), all.iter().filter(is_hidden).count())
    }

    /// Stretches over which the rotor follows slowly enough to be called steady, [LPC16] Eq. (4).
    pub fn steady(&self) -> Vec<(SteadyCommand, Range<usize>)> {
        let mut stretches = Vec::new();
        for segment in &self.whole() {
            for calm in self.calm(segment) {
                self.split_by_kind(calm, &mut stretches);
            }
        }
        stretches
    }

    /// Parts of a segment that begin `settling` after a fast change and hold no other.
    fn calm(&self, segment: &Range<usize>) -> Vec<Range<usize>> {
        let mut parts = Vec::new();
        let mut start = segment.start;
        let mut behind = segment.start;
        let mut settled_at = f64::NEG_INFINITY;
        for row in segment.clone() {
            while self.time[row] - self.time[behind] > THRESHOLDS.jump_span && behind + 1 < row {
                behind += 1;
            }
            if (self.command[row] - self.command[behind]).abs() > THRESHOLDS.jump {
                parts.push(start..row);
                settled_at = self.time[row] + THRESHOLDS.settling;
            }
            if self.time[row] <= settled_at {
                start = row + 1;
            }
        }
        parts.push(start..segment.end);
        parts.retain(|part| !part.is_empty() && self.span(part) >= THRESHOLDS.shortest_steady);
        parts
    }

    /// [s]
    fn span(&self, rows: &Range<usize>) -> f64 {
        if rows.is_empty() { 0.0 } else { self.time[rows.end - 1] - self.time[rows.start] }
    }

    fn split_by_kind(&self, calm: Range<usize>, into: &mut Vec<(SteadyCommand, Range<usize>)>) {
        let mut start = calm.start;
        let mut constants = Vec::new();
        for row in calm.clone() {
            let last = row + 1 == calm.end;
            if last || (self.command[row + 1] - self.command[start]).abs() > 1e-6 {
                if self.span(&(start..row + 1)) >= THRESHOLDS.shortest_steady {
                    constants.push(start..row + 1);
                }
                start = row + 1;
            }
        }
        let mut from = calm.start;
        for constant in constants {
            if self.span(&(from..constant.start)) >= THRESHOLDS.shortest_steady {
                into.push((SteadyCommand::Ramp, from..constant.start));
            }
            from = constant.end;
            into.push((SteadyCommand::Constant, constant));
        }
        if self.span(&(from..calm.end)) >= THRESHOLDS.shortest_steady {
            into.push((SteadyCommand::Ramp, from..calm.end));
        }
    }
}
