//! What another input makes of an output that follows steps: it says nothing of when they came.

use std::ops::Range;

use super::golden_section::golden;
use super::moments::deviation;
use super::step_trial::{Following, Hold, Stepped, Steps, Trial};
use super::thresholds::THRESHOLDS;

impl Stepped<'_> {
    /// The output without what another input makes of it through the lag with which it follows steps, by the holds of `few`, and the plain
    /// way in which it follows them then, from one that was found with it; `None` where it makes nothing of it. A gain makes up for a part
    /// of a pole that is wrong, and a pole for a gain: they are found in turn.
    pub(super) fn without_other(
        &self,
        few: &[Vec<Hold>],
        near: Following,
        delays: &Range<f64>,
    ) -> Option<(Vec<f64>, Following)> {
        let other = self.other?;
        let few = Stepped { stretches: few, ..*self };
        let mut following = near;
        for _ in 0..THRESHOLDS.gain_rounds {
            let mut gains = [0.0; 3];
            for gain in &mut gains {
                let added = self.lagged(other, following.pole);
                *gain = few.gain_of_other(&added, following)?;
                following = few.plainly_beside(*gain, &added, following, delays);
            }
            let added = self.lagged(other, following.pole);
            following = few.plainly_beside(limit(gains), &added, following, delays);
            if (gains[2] - gains[1]).abs() < THRESHOLDS.same_gain * few.widest_gain(&added) {
                break;
            }
        }
        let added = self.lagged(other, following.pole);
        let gain = few.gain_of_other(&added, following)?;
        Some((self.without(gain, &added), following))
    }

    fn without(&self, gain: f64, added: &[f64]) -> Vec<f64> {
        self.output.iter().zip(added).map(|(output, added)| output - gain * added).collect()
    }

    /// The plain way in which it follows steps beside this gain of another input.
    fn plainly_beside(&self, gain: f64, added: &[f64], near: Following, delays: &Range<f64>) -> Following {
        let alone = Stepped { output: &self.without(gain, added), ..*self };
        let trial = Trial { following: near, steps: Steps::Between, curve: None };
        alone.search(trial, delays.clone()).plain()
    }

    /// The gain of what another input adds, beside steps that are followed in this way; `None` where it does not show.
    fn gain_of_other(&self, added: &[f64], following: Following) -> Option<f64> {
        let trial = Trial { following, steps: Steps::Between, curve: None };
        let likelihood = |gain: f64| {
            Stepped { output: &self.without(gain, added), ..*self }.carry_out(&trial).likelihood()
        };
        let widest = self.widest_gain(added);
        if !widest.is_finite() {
            return None;
        }
        let cost = |gain: f64| -likelihood(gain);
        let (gain, _) = golden(cost, -widest, widest);
        let closer = THRESHOLDS.closer_gain * widest;
        let (gain, left) = golden(cost, gain - closer, gain + closer);
        (-left > likelihood(0.0) + THRESHOLDS.step_shape_gain).then_some(gain)
    }

    /// The gain with which another input would make all of the output.
    fn widest_gain(&self, added: &[f64]) -> f64 {
        let rows = || {
            self.stretches.iter().filter_map(|holds| Some(holds.first()?.from..holds.last()?.end)).flatten()
        };
        let moved = deviation(rows().map(|row| added[row]));
        deviation(rows().map(|row| self.output[row]).filter(|output| output.is_finite())) / moved
    }

    /// An input through a lag, from its first value on in each stretch; zero where it is not known. Between two rows it goes evenly.
    fn lagged(&self, input: &[f64], pole: f64) -> Vec<f64> {
        let mut lagged = vec![0.0; input.len()];
        for holds in self.stretches {
            let (Some(first), Some(last)) = (holds.first(), holds.last()) else { continue };
            let (mut now, mut held) = (f64::NAN, f64::NAN);
            for row in first.from..last.end {
                let next = if input[row].is_finite() { input[row] } else { held };
                if held.is_finite() {
                    let share = 1.0 - (-pole * (self.time[row] - self.time[row - 1])).exp();
                    now += share * (0.5 * (held + next) - now);
                } else {
                    now = next;
                }
                held = next;
                lagged[row] = if now.is_finite() { now } else { 0.0 };
            }
        }
        lagged
    }
}

/// Where a row of steps goes that become smaller in even proportion; the last where they do not.
fn limit([first, second, third]: [f64; 3]) -> f64 {
    let (before, last) = (second - first, third - second);
    if last.abs() < before.abs() { third + last * last / (before - last) } else { third }
}

#[cfg(test)]
mod tests {
    use super::limit;

    #[test]
    fn even_proportions_go_to_their_limit() {
        assert!((limit([0.0, 4.0, 7.0]) - 16.0).abs() < 1e-12);
        assert!((limit([0.0, 4.0, 2.0]) - 8.0 / 3.0).abs() < 1e-12);
        assert_eq!([limit([1.0, 2.0, 4.0]), limit([1.0, 1.0, 1.0])], [4.0, 1.0]);
    }
}
