//! The counter a sender steps with each frame: distinguishes a new frame from a repeated, replayed or foreign one.

use super::thresholds::THRESHOLDS;

/// The receiver's view of one sender's counter.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Counter {
    last: Option<u64>,
    /// Counter of a refused frame: a sender that goes on from there has restarted, and is followed.
    candidate: Option<u64>,
}

/// Frames missing between those with the counters `from` and `value`; `None` where the one does not go on from the other.
fn missing(from: u64, value: u64, mask: u64) -> Option<u64> {
    let lost = value.wrapping_sub(from).wrapping_sub(1) & mask;
    (lost <= THRESHOLDS.maximum_lost.min(mask >> 1)).then_some(lost)
}

/// Whoever follows a sender takes another sender's frame with the counter `value` for the next one where it goes on from the last
/// of the first, and would then refuse the first's next, `next`, as repeated. What the first has to say next, to be followed still:
/// a count that the other's next frame does not have either. `next`, where there is no danger.
pub(super) fn beyond(next: u64, value: u64, mask: u64) -> u64 {
    let last = next.wrapping_sub(1);
    let ahead = value.wrapping_sub(last) & mask;
    // Of one bit every second count is the other's.
    if mask > 1 && (ahead == 0 || missing(last, value, mask).is_some()) {
        next.wrapping_add(ahead).wrapping_add(1)
    } else {
        next
    }
}

impl Counter {
    /// Whether a frame with this counter goes on from the one before; how many are missing between. A frame that
    /// does not is refused, and changes nothing: one forged or stray frame costs no good one. A restarted sender
    /// costs one frame. `mask` is the counter's width.
    pub(super) fn accept(&mut self, value: u64, mask: u64) -> Option<u64> {
        let lost = |from: u64| missing(from, value, mask);
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

    /// A second sender begins at any count: one of its frames is taken at most; two, where it is heard when the next is out.
    #[test]
    fn a_second_sender_is_not_followed() {
        for mask in [0x3, 0xF, 0xFF] {
            for (begins, is_behind) in (0..=mask).flat_map(|it| [(it, false), (it, true)]) {
                let (mut follower, mut next, mut other) = (Counter::default(), 250, begins);
                let (mut taken, mut owned) = (0, 0);
                follower.accept((next - 1) & mask, mask);
                for _ in 0..3 * mask {
                    let mut own = |follower: &mut Counter| {
                        owned += u64::from(follower.accept(next & mask, mask).is_some());
                        next += 1;
                    };
                    if is_behind {
                        own(&mut follower);
                    }
                    taken += u64::from(follower.accept(other, mask).is_some());
                    if !is_behind {
                        own(&mut follower);
                    }
                    // Heard before the next frame is sent.
                    next = beyond(next, other, mask);
                    other = (other + 1) & mask;
                }
                let most = if is_behind { 1 } else { 2 };
                let case = format!("{mask:x}: from {begins}, behind: {is_behind}");
                assert!(taken <= most, "{case}: {taken} frames are taken");
                assert!(owned + 3 >= 3 * mask, "{case}: {owned} of its own");
            }
        }
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
