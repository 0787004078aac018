//! Which turns of the control loop a blackbox log holds.

/// Which turns of the control loop are logged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Interval {
    intra: u32,
    numerator: u32,
    denominator: u32,
}

impl Default for Interval {
    fn default() -> Self {
        Self { intra: 32, numerator: 1, denominator: 1 }
    }
}

impl Interval {
    /// From the lines `I interval` and `P interval` of the header; the latter is `n/d`, or `d` where n is 1.
    pub(super) fn read(intra: Option<&str>, inter: Option<&str>) -> Self {
        let mut interval = Self::default();
        let whole = |text: &str| text.trim().parse::<u32>().ok();
        if let Some(intra) = intra.and_then(whole) {
            interval.intra = intra.max(1);
        }
        if let Some(text) = inter {
            let (above, below) = text.split_once('/').unwrap_or(("1", text));
            if let (Some(above), Some(below)) = (whole(above), whole(below)) {
                interval.numerator = above.max(1);
                interval.denominator = below.max(1);
            }
        }
        interval
    }

    /// How many turns after `iteration` are left out on purpose.
    pub(super) fn left_out_after(self, iteration: u32) -> u32 {
        let in_block = iteration.wrapping_add(1) % self.intra;
        let phase = (u64::from(in_block) + u64::from(self.numerator) - 1) % u64::from(self.denominator);
        if phase < u64::from(self.numerator) {
            return 0;
        }
        let to_next = u64::from(self.denominator) - phase;
        u32::try_from(to_next.min(u64::from(self.intra - in_block))).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_that_are_left_out_are_counted() {
        // Against the definition, turn by turn: logged is a turn t with (t mod I + n - 1) mod d < n.
        for (intra, numerator, denominator) in
            [(32, 1, 1), (32, 1, 2), (32, 2, 3), (256, 1, 16), (32, 1, 64), (10, 3, 7)]
        {
            let interval = Interval { intra, numerator, denominator };
            for iteration in 0..600_u32 {
                let logged = |turn: u32| (turn % intra + numerator - 1) % denominator < numerator;
                let expected = (1..).take_while(|ahead| !logged(iteration + ahead)).count();
                let counted = interval.left_out_after(iteration);
                assert_eq!(usize::try_from(counted), Ok(expected), "{interval:?} after {iteration}");
            }
        }
    }
}
