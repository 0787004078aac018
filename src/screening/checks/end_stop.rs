//! A body that stands at an end of its travel: what holds it there is in no model, and what drives it does not show.
//!
//! By the angle and by what drives the body: it comes to the least or the greatest angle of the log again and again, and stands there
//! while the torque changes by much; at no other angle does it stand so. (A body with dry friction stands anywhere, and hardly twice at
//! one angle.) Once an end is known for a stop, all standing there counts, under a steady torque, too.

use std::ops::Range;

use super::gyro_frozen::{drive, range};
use crate::estimation::finite::finite_rows;
use crate::estimation::moments::mean_of;
use crate::estimation::quantile::extremes;
use crate::screening::Finding;
use crate::screening::body::CheckedBody;
use crate::screening::channel::Judgement;
use crate::screening::channel_noise::ChannelNoise;
use crate::screening::thresholds::THRESHOLDS;
use crate::signal::ROTORS;
use crate::signal::columns::BODY_ANGLE;

/// The code: a body that stands at an end of its travel.
pub const END_STOP: &str = "end_stop";

/// Rows over which the body stands at a stop.
pub(crate) fn check(body: &CheckedBody) -> Option<Judgement> {
    let angle = body.log.column(BODY_ANGLE)?;
    if body.rotors.iter().any(|rotor| rotor.number > ROTORS && rotor.turns()) {
        return None;
    }
    let standing = Standing::of(body, angle)?;
    let ends = [standing.low, standing.high].map(|end| standing.at(end));
    let is_stop = |runs: &Vec<Range<usize>>| {
        runs.len() >= THRESHOLDS.stop_arrivals && runs.iter().any(|run| standing.is_driven(run))
    };
    let moved: Vec<bool> = ends.iter().map(is_stop).collect();
    let at_stops = || ends.iter().zip(&moved).filter(|(_, moved)| **moved).flat_map(|(runs, _)| runs);
    let longest = at_stops().max_by(|a, b| standing.span(a).total_cmp(&standing.span(b)))?;
    let all: f64 = at_stops().map(|run| standing.span(run)).sum();
    if standing.between() > THRESHOLDS.stop_elsewhere * all {
        return None;
    }
    let (time, places) = (body.log.time(), at_stops().count());
    let finding = Finding::new(END_STOP, BODY_ANGLE).of(body.log.source_name());
    let finding =
        finding.with("angle_rad", mean_of(longest.clone().map(|row| angle[row]).filter(|it| it.is_finite())));
    let finding = finding.with("from_s", time[longest.start]).with("to_s", time[longest.end - 1]);
    let mut rows: Vec<usize> = at_stops().cloned().flatten().collect();
    rows.sort_unstable();
    Some(Judgement::new(finding.with("places", places), rows))
}

/// What it takes to see a body stand.
struct Standing<'a> {
    body: &'a CheckedBody<'a>,
    angle: &'a [f64],
    drive: Vec<f64>,
    /// [rad] least and greatest angle.
    low: f64,
    high: f64,
    /// [rad] what noise and steps of the reading make of an angle that stands.
    still: f64,
    /// By how much the drive changes where it changes by much.
    much: f64,
}

impl<'a> Standing<'a> {
    /// `None` where the angle hardly moves, or nothing drives the body.
    fn of(body: &'a CheckedBody, angle: &'a [f64]) -> Option<Self> {
        let (low, high) = extremes(angle.iter().copied());
        let noise = ChannelNoise::of(angle.iter().copied());
        let still = THRESHOLDS.held_motion * noise.in_signal(angle, &body.log.segments()) + noise.step;
        let drive = drive(body.log)?;
        let much = THRESHOLDS.frozen_drive_share * range(drive.iter().copied());
        let moves = high - low > THRESHOLDS.stop_travel * still;
        (moves && much > 0.0).then_some(Self { body, angle, drive, low, high, still, much })
    }

    /// [rad] within which it is at one angle.
    fn band(&self) -> f64 {
        THRESHOLDS.stop_band * self.still
    }

    fn span(&self, rows: &Range<usize>) -> f64 {
        self.body.log.time()[rows.end - 1] - self.body.log.time()[rows.start]
    }

    /// Whether what drives it changes, and it goes on standing for longer than a free body needs to be seen moving.
    fn is_driven(&self, rows: &Range<usize>) -> bool {
        let time = self.body.log.time();
        let last = time[rows.end - 1] - THRESHOLDS.stop_answer;
        range(rows.clone().take_while(|row| time[*row] < last).map(|row| self.drive[row])) >= self.much
    }

    /// Runs of rows that stand at this angle; a turning point goes there and back.
    fn at(&self, end: f64) -> Vec<Range<usize>> {
        let mut found = Vec::new();
        for segment in self.body.log.segments() {
            let known: Vec<usize> = finite_rows(self.angle, segment);
            let is_there = |row: usize| (self.angle[row] - end).abs() <= self.band();
            let runs = known.chunk_by(|a, b| is_there(*a) == is_there(*b)).filter(|rows| is_there(rows[0]));
            found.extend(runs.map(|rows| rows[0]..rows[rows.len() - 1] + 1));
        }
        found.retain(|rows| self.span(rows) >= THRESHOLDS.stop_shortest && self.is_level(rows));
        found
    }

    fn is_level(&self, rows: &Range<usize>) -> bool {
        let third = rows.len() / THRESHOLDS.stop_parts;
        let mean = |rows: Range<usize>| mean_of(rows.map(|row| self.angle[row]).filter(|it| it.is_finite()));
        let [first, middle, last] = [
            rows.start..rows.start + third,
            rows.start + third..rows.end - third,
            rows.end - third..rows.end,
        ]
        .map(mean);
        (middle - mean_of([first, last].into_iter())).abs() < THRESHOLDS.stop_level * self.still
    }

    /// [s] for which it stands between its ends although it is driven.
    fn between(&self) -> f64 {
        let rows = ((THRESHOLDS.stop_shortest / self.body.log.median_interval()) as usize).max(2);
        let mut standing = 0.0;
        for segment in self.body.log.segments() {
            let windows = (segment.start..segment.end.saturating_sub(rows)).step_by(rows);
            for window in windows.map(|from| from..from + rows) {
                let (low, high) = extremes(window.clone().map(|row| self.angle[row]));
                let is_between = low > self.low + self.band() && high < self.high - self.band();
                if is_between && high - low <= self.band() && self.is_driven(&window) {
                    standing += self.span(&window);
                }
            }
        }
        standing
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;
    use crate::screening::tests::noise_of;
    use crate::signal::columns::{BODY_RATE, TORQUE_COMMAND};

    /// 60 s at 50 Hz of a pendulum in oil under a torque of a few levels; `floor` [rad] is where a stop takes up the rest, and
    /// `friction` [N m] holds it where it is.
    fn log(floor: f64, friction: f64) -> ScreenedLog {
        // Levels of 1.4 s, none of them twice.
        let torque = |row: usize| 0.15 * noise_of(row / 70 + 11, 0) - 0.05;
        let (mut angle, mut rate) = (0.0_f64, 0.0_f64);
        let mut columns: [Vec<f64>; 3] = Default::default();
        for row in 0..3000 {
            let noise = f64::from((row * 37 % 11) as u32) * 1e-4;
            for (column, value) in columns.iter_mut().zip([torque(row), rate + noise, angle + noise]) {
                column.push(value);
            }
            for _ in 0..20 {
                let pull = torque(row) - 0.4 * angle;
                let held = rate.abs() < 2e-3 && pull.abs() < friction;
                let rub = if held { 0.0 } else { friction * rate.signum() };
                rate = if held { 0.0 } else { rate + 1e-3 * (pull - rub - 0.1 * rate) / 0.02 };
                angle += 1e-3 * rate;
                if angle < floor {
                    (angle, rate) = (floor, rate.max(0.0));
                }
            }
        }
        let time = (0..3000).map(|row| 0.02 * f64::from(row)).collect();
        let mut log = Dataset::new("log.csv", "", time).expect("time rises");
        for (name, column) in [TORQUE_COMMAND, BODY_RATE, BODY_ANGLE].into_iter().zip(columns) {
            log.insert(name, column).expect("fits");
        }
        log.into()
    }

    #[test]
    fn a_body_at_a_stop_is_left_out_there_and_its_simulation_starts_anew() {
        let log = log(-0.05, 0.0);
        let found: Vec<&Finding> = log.findings().filter(|it| it.code == END_STOP).collect();
        assert_eq!(found.len(), 1, "{:?}", log.findings().collect::<Vec<_>>());
        assert!((found[0].number("angle_rad") + 0.05).abs() < 2e-3, "{:?}", found[0]);
        let (body, angle) = (log.body().expect("a body"), log.dataset().column(BODY_ANGLE).expect("there"));
        let stands = (0..3000).filter(|row| body.reason(*row) == Some(END_STOP));
        assert!(stands.clone().count() > 300 && stands.clone().all(|row| angle[row] < -0.04));
        let free = (0..3000).filter(|row| angle[*row] > 0.0 && body.reason(*row).is_none());
        assert!(free.count() > 1000);
        let stop = stands.clone().nth(100).expect("some");
        assert!(body.stretches().iter().all(|rows| !rows.contains(&stop)));
    }

    #[test]
    fn a_free_body_and_one_with_friction_stand_at_no_stop() {
        for (floor, friction) in [(-1.0, 0.0), (-1.0, 0.03), (-1.0, 0.08)] {
            let log = log(floor, friction);
            assert!(log.findings().all(|it| it.code != END_STOP), "{floor} {friction}");
        }
    }
}
