//! The counter a sender steps with each frame: distinguishes a new frame from a repeated, replayed or foreign one.

use super::thresholds::THRESHOLDS;

/// The receiver's view of one sender's counter.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counter {
    last: Option<u64>,
    /// Counter of a refused frame: a sender that goes on from there has restarted, and is followed.
    candidate: Option<u64>,
}

impl Counter {
    /// Whether a frame with this counter goes on from the one before; how many are missing between. A frame that
    /// does not is refused, and changes nothing: one forged or stray frame costs no good one. A restarted sender
    /// costs one frame. `mask` is the counter's width.
    pub(super) fn accept(&mut self, value: u64, mask: u64) -> Option<u64> {
        let lost = |from: u64| {
            let lost = value.wrapping_sub(from).wrapping_sub(1) & mask;
            (lost <= THRESHOLDS.maximum_lost.min(mask >> 1)).then_some(lost)
        };
        let verdict = match (self.last, self.candidate) {
            (None, _) => Some(0),
            (Some(last), candidate) => lost(last).or_else(|| candidate.and_then(lost)),
        };
        match verdict {
            Some(_) => *self = Self { last: Some(value), candidate: None },
            None => self.candidate = Some(value),
        }
        verdict
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(values: &[u64]) -> Vec<Option<u64>> {
        let mut counter = Counter::default();
        values.iter().map(|value| counter.accept(*value, 0xFF)).collect()
    }

    #[test]
    fn follows_a_sender_and_counts_what_is_lost() {
        assert_eq!(run(&[254, 255, 0, 1, 4]), [Some(0), Some(0), Some(0), Some(0), Some(2)]);
    }

    #[test]
    fn refuses_repetition_and_replay() {
        assert_eq!(run(&[7, 7, 7, 8, 6, 9]), [Some(0), None, None, Some(0), None, Some(0)]);
    }

    #[test]
    fn one_forged_frame_costs_no_good_one_and_a_restart_costs_one() {
        assert_eq!(run(&[100, 0, 101, 102]), [Some(0), None, Some(0), Some(0)]);
        assert_eq!(run(&[100, 0, 1, 2]), [Some(0), None, Some(0), Some(0)]);
    }
    /// The limit shrinks with the width: of a counter of one bit the next value alone goes on, of two bits one may be missing.
    #[test]
    fn a_narrow_counter_refuses_repetition_too() {
        let run = |values: [u64; 5], mask| {
            let mut counter = Counter::default();
            values.map(|value| counter.accept(value, mask))
        };
        assert_eq!(run([0, 1, 1, 0, 1], 1), [Some(0), Some(0), None, Some(0), Some(0)]);
        assert_eq!(run([0, 1, 3, 3, 2], 3), [Some(0), Some(0), Some(1), None, None]);
    }
}
