//! What an output does behind a step of its input: two lags, one behind the other, to a level that is fitted.

use super::thresholds::THRESHOLDS;

/// Spans that differ by less than this share are the same: times are written with few digits.
const SAME_SPAN: f64 = 1e-9;
/// [-] difference of the poles of two lags below which they are moved apart: at equal poles the formula is 0/0.
const APART: f64 = 1e-4;

/// Two lags, one behind the other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lags {
    /// [rad/s] poles.
    slow: f64,
    fast: f64,
    /// [-] fast / (fast - slow): by how much the first lag's way shows in the output.
    weight: f64,
}

impl Lags {
    /// Of a `pole` [rad/s] and a `second` time constant [s].
    pub fn new(pole: f64, second: f64) -> Self {
        if second * pole < THRESHOLDS.no_second_lag {
            return Self { slow: pole, fast: f64::INFINITY, weight: 1.0 };
        }
        let fast = 1.0 / second;
        let fast = if (fast / pole - 1.0).abs() < APART { pole * (1.0 + APART) } else { fast };
        Self { slow: pole, fast, weight: fast / (fast - pole) }
    }

    /// What is left of the two ways after a span [s].
    fn left(&self, span: f64) -> [f64; 2] {
        [(-self.slow * span).exp(), if self.fast.is_finite() { (-self.fast * span).exp() } else { 0.0 }]
    }
}

/// What the output does from one step on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    /// [unit of the output]
    pub level: f64,
    /// [unit of the output] of the first and of the second lag at the step.
    pub from: [f64; 2],
    /// [s]
    pub at: f64,
    pub lags: Lags,
}

impl Course {
    /// [unit of the output] of both lags.
    pub fn value(&self, time: f64) -> [f64; 2] {
        let [slow, fast] = self.lags.left((time - self.at).max(0.0));
        let [first, second] = self.from.map(|from| from - self.level);
        let inner = first * self.lags.weight;
        let output = inner * slow + (second - inner) * fast;
        [self.level + first * slow, self.level + output]
    }
}

/// Products of 1, of what is left of the slow and of the fast way, and of the output, over the rows behind a step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sums([f64; 10]);

impl Sums {
    /// Over `rows` (time [s], output), which are in order and not before `latest` [s].
    pub fn of(rows: impl Iterator<Item = (f64, f64)>, latest: f64, lags: &Lags) -> Self {
        let mut sums = Self::default();
        // Rows of one interval share the exponentials.
        let (mut now, mut last, mut known) = ([0.0; 2], f64::NAN, (f64::NAN, [0.0; 2]));
        for (time, output) in rows {
            let since = time - latest;
            if last.is_nan() {
                now = lags.left(since);
            } else {
                let span = since - last;
                if known.0.is_nan() || (known.0 - span).abs() > SAME_SPAN * span {
                    known = (span, lags.left(span));
                }
                now = [now[0] * known.1[0], now[1] * known.1[1]];
            }
            last = since;
            sums.add(now, output);
        }
        sums
    }

    fn add(&mut self, [a, b]: [f64; 2], y: f64) {
        let terms = [1.0, a, b, a * a, a * b, b * b, y, y * a, y * b, y * y];
        self.0.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }

    pub fn rows(&self) -> usize {
        self.0[0] as usize
    }

    /// Products of what is left of the output without the hold's level, and of what a level of one adds, of a step that came `lead` [s]
    /// before all these rows; `course` has a level of zero.
    pub fn of_level(&self, course: &Course, lead: f64) -> Level {
        let [n, a, b, aa, ab, bb, y, ya, yb, yy] = self.0;
        let ([slow, fast], weight) = (course.lags.left(lead), course.lags.weight);
        let (ga, gb) = (weight * slow, (1.0 - weight) * fast);
        let inner = course.from[0] * weight;
        let (ca, cb) = (inner * slow, (course.from[1] - inner) * fast);
        Level {
            squares: yy - 2.0 * (ca * ya + cb * yb) + ca * ca * aa + 2.0 * ca * cb * ab + cb * cb * bb,
            product: y - ca * a - cb * b - ga * (ya - ca * aa - cb * ab) - gb * (yb - ca * ab - cb * bb),
            weight: n - 2.0 * (ga * a + gb * b) + ga * ga * aa + 2.0 * ga * gb * ab + gb * gb * bb,
        }
    }
}

/// The least squares of one level.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    squares: f64,
    product: f64,
    /// [rows] by which the level is known.
    pub weight: f64,
}

impl Level {
    /// With one more row: what is `left` of it without the level, and the `share` of the level in it.
    pub fn add(&mut self, left: f64, share: f64) {
        self.squares += left * left;
        self.product += left * share;
        self.weight += share * share;
    }

    /// The level, and the squares that it leaves; `otherwise` where nothing says what it is.
    pub fn solved(&self, otherwise: f64) -> (f64, f64) {
        let level = if self.weight > f64::EPSILON { self.product / self.weight } else { otherwise };
        (level, (self.squares - level * self.product).max(0.0))
    }
}

/// Levels by the input: from those of a first look.
#[derive(Debug, Clone, Copy)]
pub(super) struct Curve {
    coefficients: [f64; 3],
    /// [rows] of noise that it counts as for one level.
    pub weight: f64,
}

impl Curve {
    /// Through levels: the input of each, itself, and the rows by which it is known; `noise` is the variance of a row.
    pub fn of(levels: &[(f64, f64, f64)], noise: f64) -> Option<Self> {
        let own = |weight: f64| noise / weight.max(f64::EPSILON);
        let (mut variance, mut found) = (0.0, None);
        for _ in 0..THRESHOLDS.curve_passes {
            let mut normal = [[0.0; 4]; 3];
            for (input, level, weight) in levels {
                let powers = [1.0, *input, input * input];
                let weight = 1.0 / (variance + own(*weight) + f64::MIN_POSITIVE);
                for (row, power) in normal.iter_mut().zip(powers) {
                    let terms = [powers[0], powers[1], powers[2], *level];
                    row.iter_mut().zip(terms).for_each(|(sum, term)| *sum += weight * power * term);
                }
            }
            let curve = Self { coefficients: solve(normal), weight: 0.0 };
            let (mut excess, mut sum) = (0.0, 0.0);
            for (input, level, weight) in levels {
                let share = (variance + own(*weight) + f64::MIN_POSITIVE).powi(-2);
                excess += share * ((level - curve.level(*input)).powi(2) - own(*weight));
                sum += share;
            }
            variance = (excess / sum).max(0.0);
            found = Some(curve);
        }
        // Never more than one row, and half of what it might be: the curve itself is not known exactly.
        found.map(|curve| Self { weight: noise / (2.0 * variance + noise), ..curve })
    }

    pub fn level(&self, input: f64) -> f64 {
        self.coefficients[0] + input * (self.coefficients[1] + input * self.coefficients[2])
    }
}

/// Solves three equations by elimination; what they do not determine is zero, as the bend of a curve through two levels.
fn solve(mut rows: [[f64; 4]; 3]) -> [f64; 3] {
    let scale = rows[0][0].abs().max(f64::MIN_POSITIVE);
    let mut is_known = [true; 3];
    for pivot in 0..3 {
        if rows[pivot][pivot].abs() < 1e-9 * scale {
            is_known[pivot] = false;
            continue;
        }
        for row in (0..3).filter(|row| *row != pivot) {
            let (factor, own) = (rows[row][pivot] / rows[pivot][pivot], rows[pivot]);
            rows[row].iter_mut().zip(own).for_each(|(value, own)| *value -= factor * own);
        }
    }
    std::array::from_fn(|row| if is_known[row] { rows[row][3] / rows[row][row] } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the formula, against the two lags integrated in small steps.
    #[test]
    fn two_lags_go_as_their_equations_say() {
        for (pole, second) in [(12.0, 0.0), (12.0, 0.03), (12.0, 1.0 / 12.0), (12.0, 0.2)] {
            let course =
                Course { level: 700.0, from: [400.0, 380.0], at: 1.0, lags: Lags::new(pole, second) };
            let (mut first, mut output) = (400.0, 380.0);
            let step = 1e-5;
            for _ in 0..10_000 {
                first += step * pole * (700.0 - first);
                output = if second > 0.0 { output + step / second * (first - output) } else { first };
            }
            let [inner, shown] = course.value(1.1);
            assert!(
                (inner - first).abs() < 0.05 && (shown - output).abs() < 0.05,
                "{second}: {shown} {output}"
            );
        }
    }

    /// The sums stand for the rows one by one.
    #[test]
    fn sums_leave_what_the_rows_leave() {
        let lags = Lags::new(9.0, 0.04);
        let truth = Course { level: 620.0, from: [500.0, 480.0], at: 0.993, lags };
        let rows = (0..40).map(|row| 1.0 + 0.01 * f64::from(row) + 0.002 * f64::from(row % 3));
        let rows: Vec<(f64, f64)> = rows.map(|time| (time, truth.value(time)[1])).collect();
        let sums = Sums::of(rows.iter().copied(), 1.0, &lags);
        let (level, left) = sums.of_level(&Course { level: 0.0, ..truth }, 0.007).solved(0.0);
        assert!((level - 620.0).abs() < 1e-6 && left < 1e-3, "{level} {left}");
        let (_, off) = sums.of_level(&Course { level: 0.0, ..truth }, 0.004).solved(0.0);
        assert!(off > 1.0, "another instant leaves more: {off}");
    }
}
