//! A record whose input steps, and what is left of its output when the steps happened at some instants and the output follows them in
//! some way.

use std::ops::Range;

use super::step_course::{Course, Curve, Lags, Sums};
use super::thresholds::THRESHOLDS;

/// [intervals] between two instants that are one: far below the digits of a clock.
const SAME_INSTANT: f64 = 1e-6;
/// [-] the input at which a pole is the pole.
const MIDDLE_INPUT: f64 = 0.5;

/// One hold of the input: the rows that show it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hold {
    /// Its first row, and the one behind its last.
    pub from: usize,
    pub end: usize,
    pub input: f64,
}

/// A record whose input steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stepped<'a> {
    /// [s]
    pub time: &'a [f64],
    /// Not-a-number where nothing was measured.
    pub output: &'a [f64],
    /// Another input, which moves the output through the same lag without steps of its own.
    pub other: Option<&'a [f64]>,
    /// The holds of each stretch, one behind the other; stretches know nothing of each other.
    pub stretches: &'a [Vec<Hold>],
    /// [s] between two rows.
    pub interval: f64,
}

/// How the output follows a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Following {
    /// [rad/s]
    pub pole: f64,
    /// [-] half of the logarithm of the pole of steps up over that of steps down.
    pub upward: f64,
    /// [-] logarithm of what a unit of the input, in the middle of a step, makes of the pole.
    pub by_input: f64,
    /// [-] time constant of a second lag over that of the first.
    pub second: f64,
    /// [s] dead time.
    pub delay: f64,
}

impl Following {
    pub fn plain(pole: f64, delay: f64) -> Self {
        Self { pole, upward: 0.0, by_input: 0.0, second: 0.0, delay }
    }

    /// The two lags of a step.
    fn lags(&self, from: f64, to: f64) -> Lags {
        let direction = if to > from { self.upward } else { -self.upward };
        let pole = self.pole * (direction + self.by_input * (0.5 * (from + to) - MIDDLE_INPUT)).exp();
        Lags::new(pole, self.second / pole)
    }
}

/// Where steps happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Steps {
    /// At their rows.
    AtRows,
    /// Anywhere in the interval before.
    Between,
}

/// What a hold is known by, and how the steps happened.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial {
    pub following: Following,
    pub steps: Steps,
    pub curve: Option<Curve>,
}

/// A trial, carried out.
#[derive(Default)]
pub(super) struct Tried {
    pub squares: f64,
    pub rows: usize,
    /// Of each step its row, the inputs, and the squares that each instant leaves.
    pub steps: Vec<(usize, [f64; 2], Profile)>,
    /// Of each hold its input, its level, and the rows by which that is known.
    pub levels: Vec<(f64, f64, f64)>,
}

impl Tried {
    pub fn mean_square(&self) -> f64 {
        if self.rows == 0 { f64::INFINITY } else { self.squares / self.rows as f64 }
    }

    /// [-] of all changes of level, the share that goes with the input.
    pub fn answered(&self) -> f64 {
        let pairs = self.levels.windows(2).zip(self.steps.iter().skip(1));
        let changes = pairs
            .filter(|(levels, (_, inputs, _))| levels[0].0 == inputs[0])
            .map(|(levels, (_, inputs, _))| (levels[1].1 - levels[0].1, (inputs[1] - inputs[0]).signum()));
        let (with, all) =
            changes.fold((0.0, 0.0), |(with, all), (change, way)| (with + way * change, all + change.abs()));
        if all > 0.0 { with / all } else { 0.0 }
    }

    /// Logarithm of the likelihood, the noise being what is left.
    pub fn likelihood(&self) -> f64 {
        -0.5 * self.rows as f64 * self.mean_square().max(f64::MIN_POSITIVE).ln()
    }
}

impl Stepped<'_> {
    pub(super) fn carry_out(&self, trial: &Trial) -> Tried {
        let mut tried = Tried::default();
        for holds in self.stretches {
            self.try_stretch(holds, trial, &mut tried);
        }
        tried
    }

    /// [s] when a step to the hold whose first row this is may arrive, at the earliest and at the latest.
    fn arrival(&self, row: usize, trial: &Trial) -> (f64, f64) {
        let at = self.time[row] + trial.following.delay;
        let within = if trial.steps == Steps::AtRows { 0.0 } else { self.time[row] - self.time[row - 1] };
        (at - within, at)
    }

    fn try_stretch(&self, holds: &[Hold], trial: &Trial, tried: &mut Tried) {
        let (Some(first), Some(last)) = (holds.first(), holds.last()) else { return };
        // The first row that may answer to a hold.
        let answers = |hold: &Hold| {
            // The row before, at which it cannot have moved, knows the level of the hold before: whether it counts there must not hang
            // on rounding.
            let earliest = self.arrival(hold.from, trial).0 + SAME_INSTANT * self.interval;
            first.from + self.time[first.from..last.end].partition_point(|time| *time <= earliest)
        };
        let mut before: Option<Course> = None;
        for (index, hold) in holds.iter().enumerate() {
            let begin = if index == 0 { hold.from } else { answers(hold) };
            let rows = begin..holds.get(index + 1).map_or(last.end, answers).max(begin);
            before = match before {
                None => self.free_start(rows, &trial.following, tried),
                Some(course) => {
                    let inputs = [holds[index - 1].input, hold.input];
                    self.try_step((hold.from, inputs, course), rows, trial, tried)
                }
            };
        }
    }

    /// A hold whose beginning is not known: a level, and what is left to go to it.
    fn free_start(&self, rows: Range<usize>, following: &Following, tried: &mut Tried) -> Option<Course> {
        let at = *self.time.get(rows.start)?;
        let measured = self.measured(rows);
        let (mut n, mut e, mut ee, mut y, mut ey, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (time, output) in measured {
            let left = (-following.pole * (time - at)).exp();
            n += 1.0;
            e += left;
            ee += left * left;
            y += output;
            ey += left * output;
            yy += output * output;
        }
        let determinant = n * ee - e * e;
        if n <= THRESHOLDS.shortest_hold_rows as f64 || determinant < 1e-6 * n * n {
            return None;
        }
        let (level, way) = ((ee * y - e * ey) / determinant, (n * ey - e * y) / determinant);
        tried.squares += (yy - level * y - way * ey).max(0.0);
        tried.rows += n as usize;
        Some(Course { level, from: [level + way; 2], at, lags: Lags::new(following.pole, 0.0) })
    }

    fn measured(&self, rows: Range<usize>) -> impl Iterator<Item = (f64, f64)> + '_ {
        let rows = rows.map(|row| (self.time[row], self.output[row]));
        rows.filter(|(_, output)| output.is_finite())
    }

    /// Every instant of a step to a hold; the course behind the best.
    fn try_step(
        &self,
        (row, inputs, before): (usize, [f64; 2], Course),
        rows: Range<usize>,
        trial: &Trial,
        tried: &mut Tried,
    ) -> Option<Course> {
        let lags = trial.following.lags(inputs[0], inputs[1]);
        let (earliest, latest) = self.arrival(row, trial);
        let split = rows.start + self.time[rows.clone()].partition_point(|time| *time < latest);
        let within: Vec<(f64, f64)> = self.measured(rows.start..split).collect();
        let sums = Sums::of(self.measured(split..rows.end), latest, &lags);
        if sums.rows() < THRESHOLDS.shortest_hold_rows {
            return None;
        }
        let answer = Answer { before, lags, latest, span: latest - earliest, within: &within, sums: &sums };
        let known = trial.curve.map(|curve| (curve.level(inputs[1]), curve.weight.sqrt()));
        let left = |ahead: f64| answer.at(ahead, known);
        let profile = match trial.steps {
            Steps::AtRows => Profile { ahead: 0.0, squares: left(0.0).0, curvature: 0.0 },
            Steps::Between => Profile::of(|ahead| left(ahead).0, sums.rows() + within.len()),
        };
        let (squares, course, weight) = left(profile.best());
        tried.squares += squares;
        tried.rows += sums.rows() + within.len();
        tried.steps.push((row, inputs, profile));
        tried.levels.push((inputs[1], course.level, weight));
        Some(course)
    }
}

/// The rows that may answer to a step.
struct Answer<'a> {
    before: Course,
    lags: Lags,
    /// [s] when the step came at the latest, and by how much it may have come before.
    latest: f64,
    span: f64,
    /// Time [s] and output of the rows in that time, and products of those behind.
    within: &'a [(f64, f64)],
    sums: &'a Sums,
}

impl Answer<'_> {
    /// The squares that are left when the step came `ahead` [-] of its interval, the course then, and by how many rows its level is
    /// known; `known` is a level that is known before, and by the root of how many.
    fn at(&self, ahead: f64, known: Option<(f64, f64)>) -> (f64, Course, f64) {
        let at = self.latest - ahead * self.span;
        let course = Course { level: 0.0, from: self.before.value(at), at, lags: self.lags };
        let unit = Course { level: 1.0, from: [0.0; 2], ..course };
        let mut level = self.sums.of_level(&course, self.latest - at);
        for (time, output) in self.within {
            if *time <= at {
                level.add(output - self.before.value(*time)[1], 0.0);
            } else {
                level.add(output - course.value(*time)[1], unit.value(*time)[1]);
            }
        }
        let weight = level.weight;
        if let Some((value, share)) = known {
            level.add(share * value, share);
        }
        let (found, squares) = level.solved(course.from[1]);
        (squares, Course { level: found, ..course }, weight)
    }
}

/// The squares that the instants of a step leave: a parabola about the least.
#[derive(Debug, Clone, Copy)]
pub(super) struct Profile {
    /// [-] of the interval: where the parabola is least, which may be outside.
    ahead: f64,
    squares: f64,
    curvature: f64,
}

impl Profile {
    /// Of the squares that each instant leaves of so many `rows`: as near to the least as their noise asks for.
    fn of(left: impl Fn(f64) -> f64, rows: usize) -> Self {
        let places =
            (0..=THRESHOLDS.instant_places).map(|place| place as f64 / THRESHOLDS.instant_places as f64);
        let all = places.map(|ahead| (ahead, left(ahead)));
        let (mut middle, _) = all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0.5, 0.0));
        let mut found = Self { ahead: middle, squares: 0.0, curvature: 0.0 };
        for power in 0..THRESHOLDS.instant_looks {
            let step = 0.25_f64.powi(power) / THRESHOLDS.instant_places as f64;
            middle = middle.clamp(step, 1.0 - step);
            let [low, here, high] = [-step, 0.0, step].map(|by| left(middle + by));
            let bend = (low - 2.0 * here + high) / (2.0 * step * step);
            let slope = (high - low) / (2.0 * step);
            if bend <= 0.0 || !bend.is_finite() {
                // Where a row changes sides there is a kink: nearer, the least lies in a valley or at an end.
                let places = [(middle - step, low), (middle, here), (middle + step, high)];
                let (ahead, squares) = places
                    .into_iter()
                    .fold((middle, here), |best, next| if next.1 < best.1 { next } else { best });
                (middle, found) = (ahead, Self { ahead, squares, curvature: 0.0 });
                continue;
            }
            let off = -0.5 * slope / bend;
            found = Self { ahead: middle + off, squares: here - bend * off * off, curvature: bend };
            // As narrow as noise would have it: nearer there is nothing to see.
            if bend * step * step < found.squares.max(0.0) / rows.max(1) as f64 {
                break;
            }
            middle = found.best();
        }
        found
    }

    /// [-] the best instant in the interval.
    fn best(&self) -> f64 {
        self.ahead.clamp(0.0, 1.0)
    }

    /// Logarithm of the mean likelihood of all instants over that of the best, their mean and their standard deviation; `noise` is the
    /// variance of a row.
    pub fn evidence(&self, noise: f64) -> (f64, f64, f64) {
        let deviation = (noise / self.curvature.max(f64::MIN_POSITIVE)).sqrt().min(1.0 / f64::EPSILON);
        let best = self.best();
        let (low, high) = (
            (best - THRESHOLDS.instant_reach * deviation).max(0.0),
            (best + THRESHOLDS.instant_reach * deviation).min(1.0),
        );
        let place =
            |point: usize| low + (high - low) * (point as f64 + 0.5) / THRESHOLDS.instant_points as f64;
        let exponent = |ahead: f64| ((ahead - self.ahead) / deviation).powi(2);
        let (mut sum, mut mean, mut square) = (0.0, 0.0, 0.0);
        for ahead in (0..THRESHOLDS.instant_points).map(place) {
            let weight = (-0.5 * (exponent(ahead) - exponent(best))).exp();
            sum += weight;
            mean += weight * ahead;
            square += weight * ahead * ahead;
        }
        mean /= sum;
        let likelihood = sum * (high - low) / THRESHOLDS.instant_points as f64;
        (likelihood.max(f64::MIN_POSITIVE).ln(), mean, (square / sum - mean * mean).max(0.0).sqrt())
    }
}
