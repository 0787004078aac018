//! Pseudo-random binary sequence of maximum length, from a linear feedback shift register.

/// Feedback taps (bit numbers from 1) of registers of 3 to 24 bits that run through all 2^n - 1 states.
/// Source: Xilinx XAPP052, table 3.
#[rustfmt::skip]
const TAPS: &[&[u32]] = &[
    &[3, 2], &[4, 3], &[5, 3], &[6, 5], &[7, 6], &[8, 6, 5, 4], &[9, 5], &[10, 7], &[11, 9], &[12, 6, 4, 1],
    &[13, 4, 3, 1], &[14, 5, 3, 1], &[15, 14], &[16, 15, 13, 4], &[17, 14], &[18, 11], &[19, 6, 2, 1],
    &[20, 17], &[21, 19], &[22, 21], &[23, 18], &[24, 23, 22, 17],
];

/// Highest number of chips a sequence can have.
pub(super) const LONGEST: u64 = (1 << 24) - 1;

/// A maximum-length sequence: one whole period as +1 and -1, no value repeated inside it.
///
/// `at_least` chips are asked for; the answer has the next 2^n - 1. `seed` chooses where the period begins.
pub(super) fn maximum_length_sequence(at_least: u64, seed: u64) -> Vec<i8> {
    let taps = TAPS.iter().find(|taps| (1_u64 << taps[0]) > at_least).copied().unwrap_or(&[24, 23, 22, 17]);
    let bits = taps[0];
    let period = (1_u64 << bits) - 1;
    // Neighbouring seeds begin far apart; the state is never zero.
    let mut register = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) % period + 1;
    let mut sequence = Vec::with_capacity(usize::try_from(period).unwrap_or(0));
    for _ in 0..period {
        let feedback = taps.iter().fold(0, |parity, tap| parity ^ (register >> (tap - 1)));
        register = ((register << 1) | (feedback & 1)) & period;
        sequence.push(if register & 1 == 1 { 1 } else { -1 });
    }
    sequence
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_register_runs_through_all_its_states() {
        for taps in TAPS.iter().filter(|taps| taps[0] <= 18) {
            let period = (1_u64 << taps[0]) - 1;
            let sequence = maximum_length_sequence(period, 7);
            assert_eq!(sequence.len() as u64, period);
            // A maximum-length sequence has one more +1 than -1, and its only sub-period is itself.
            assert_eq!(sequence.iter().map(|chip| i64::from(*chip)).sum::<i64>(), 1, "{taps:?}");
            for divisor in (1..period).filter(|d| period.is_multiple_of(*d) && *d * *d <= period) {
                for shift in [divisor, period / divisor].into_iter().filter(|shift| *shift < period) {
                    let shift = usize::try_from(shift).expect("small");
                    let again = sequence.iter().zip(sequence.iter().cycle().skip(shift));
                    assert!(again.clone().any(|(a, b)| a != b), "{taps:?} repeats after {shift}");
                }
            }
        }
    }

    #[test]
    fn the_spectrum_is_white() {
        let sequence = maximum_length_sequence(511, 3);
        for shift in 1..511 {
            let pairs = sequence.iter().zip(sequence.iter().cycle().skip(shift));
            assert_eq!(pairs.map(|(a, b)| i32::from(a * b)).sum::<i32>(), -1, "shift {shift}");
        }
        assert_ne!(sequence, maximum_length_sequence(511, 4));
        assert_eq!(sequence, maximum_length_sequence(511, 3));
    }
}
