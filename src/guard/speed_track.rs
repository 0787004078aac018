//! Whether each rotor turns as its command has it: the members of the model run beside the bench, and what its readings are off is summed.
//!
//! **False alarms.** While a rotor follows its model the excess x of a reading over the band, in standard deviations, has a mean that is not
//! above zero, and tails that are not above those of a normal distribution of variance 1, whatever came before. Then
//! exp(2 k S) of the sum S of (x - k) is a supermartingale, and the chance that S gains h from any one reading on is at most
//! exp(-2 k h) (Ville); of n readings, n exp(-2 k h). A sum of capped terms is smaller still.

use super::speed_model::{MOST_MEMBERS, SpeedModel};
use super::table::Cause;
use super::thresholds::THRESHOLDS;
use crate::clock::{span_ns, span_s};
use crate::model::MemberState;
use crate::signal::{ROTORS, Sample, Sensors, side};

/// Commands that are kept for members with a dead time.
const KEPT: usize = 256;
/// Changes of a command within one step, at most, that a member sees one by one.
const MOST_PIECES: usize = 8;

/// Commands of the last while, oldest first, in a ring.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Commands {
    kept: [(u64, f64); KEPT],
    last: usize,
}

impl Default for Commands {
    fn default() -> Self {
        Self { kept: [(0, 0.0); KEPT], last: 0 }
    }
}

impl Commands {
    /// From `from_ns` on it is `command`. Those of a span that only a finer ring could hold apart become one.
    fn push(&mut self, from_ns: u64, command: f64, delay_ns: u64) {
        let (last_ns, last) = self.kept[self.last];
        if last == command {
            return;
        }
        let before_ns = self.kept[(self.last + KEPT - 1) % KEPT].0;
        let finest_ns = 2 * delay_ns / KEPT as u64;
        if last_ns.saturating_sub(before_ns) >= finest_ns || before_ns == 0 {
            self.last = (self.last + 1) % KEPT;
        }
        self.kept[self.last] = (from_ns, command);
    }

    /// The command in force at `at_ns`, and when the next one comes.
    fn at(&self, at_ns: u64) -> (f64, u64) {
        let mut next_ns = u64::MAX;
        for back in 0..KEPT {
            let (from_ns, command) = self.kept[(self.last + KEPT - back) % KEPT];
            if from_ns <= at_ns {
                return (command, next_ns);
            }
            next_ns = from_ns;
        }
        (0.0, next_ns)
    }
}

/// One rotor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct RotorTrack {
    members: [MemberState; MOST_MEMBERS],
    commands: Commands,
    /// [rad/s] lowest and highest that the model reads since the last reading came, and before it since the one before.
    window: Option<(f64, f64)>,
    /// [rad/s] most that the members were apart meanwhile, and the warm one.
    spread: f64,
    warm: f64,
    /// Count of the last reading.
    count: u32,
    /// [ns] since when the command is in the model's range; 0 = it is not.
    in_range_ns: u64,
    /// [ns] since when the command is zero; 0 = it is not.
    zero_ns: u64,
    /// [-] sums above and below, and of a rotor that should stand.
    above: f64,
    below: f64,
    turning: f64,
}

/// What the check remembers.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct SpeedTrack {
    rotors: [RotorTrack; ROTORS],
    /// [ns] to when the members have run; 0 = they have not begun.
    run_ns: u64,
    /// [V] last good reading; `None` = none yet.
    voltage: Option<f64>,
}

impl SpeedTrack {
    /// Runs the members from the last step to `now_ns`, over which the rotors had `commanded`, and judges what came since. The rotor that is
    /// wrong, why, and its reading.
    pub(super) fn assess(
        &mut self,
        model: &SpeedModel,
        now_ns: u64,
        commanded: [f64; ROTORS],
        sensors: &Sensors,
    ) -> Option<(usize, Cause, f64)> {
        let battery = &sensors.battery_voltage;
        if battery.is_good() && battery.stamp_ns != 0 && battery.value.is_finite() {
            self.voltage = Some(battery.value);
        }
        let is_first = self.run_ns == 0;
        if is_first || now_ns.saturating_sub(self.run_ns) > span_ns(THRESHOLDS.speed_longest_step_s) {
            // A guard that stood still for so long has its own cause, and would have to run the members for as long.
            *self = Self { voltage: self.voltage, run_ns: now_ns, ..Self::default() };
        }
        let from_ns = self.run_ns;
        self.run_ns = now_ns;
        let voltage = self.voltage?;
        let mut found = None;
        let rotors = self.rotors.iter_mut().zip(commanded).zip(&sensors.propeller_rate).enumerate();
        for (number, ((rotor, command), sample)) in rotors {
            rotor.commands.push(from_ns, command, model.delay_ns);
            rotor.note(model, now_ns, command);
            let cause = if rotor.is_new(sample, now_ns) {
                rotor.run(model, (from_ns, sample.stamp_ns.clamp(from_ns, now_ns)), voltage, side(number));
                let cause = rotor.judge(model, now_ns, sample.value);
                rotor.run(model, (sample.stamp_ns.clamp(from_ns, now_ns), now_ns), voltage, side(number));
                cause
            } else {
                rotor.run(model, (from_ns, now_ns), voltage, side(number));
                rotor.verdict()
            };
            found = found.or(cause.map(|cause| (number, cause, sample.value)));
        }
        found
    }
}

impl RotorTrack {
    fn is_new(&mut self, sample: &Sample, now_ns: u64) -> bool {
        let is_new = sample.is_good() && sample.stamp_ns != 0 && sample.count != self.count;
        self.count = sample.count;
        is_new && sample.value.is_finite() && sample.stamp_ns <= now_ns
    }

    /// Takes down since when the command is what it is.
    fn note(&mut self, model: &SpeedModel, now_ns: u64, command: f64) {
        let since = |is: bool, since_ns: u64| match (is, since_ns) {
            (false, _) => 0,
            (true, 0) => now_ns,
            (true, since_ns) => since_ns,
        };
        let (lowest, highest) = model.commands;
        self.in_range_ns = since(command > 0.0 && (lowest..=highest).contains(&command), self.in_range_ns);
        self.zero_ns = since(command <= 0.0, self.zero_ns);
        if self.in_range_ns == 0 {
            (self.above, self.below) = (0.0, 0.0);
        }
        if self.zero_ns == 0 {
            self.turning = 0.0;
        }
    }

    /// Runs every member over a span, and takes down what they read.
    fn run(&mut self, model: &SpeedModel, (from_ns, to_ns): (u64, u64), voltage: f64, side: f64) {
        for (member, state) in model.members.iter().zip(&mut self.members) {
            let delay_ns = span_ns(member.delay());
            let mut at_ns = from_ns;
            for piece in 0..MOST_PIECES {
                let (command, next_ns) = self.commands.at(at_ns.saturating_sub(delay_ns));
                let change_ns = next_ns.saturating_add(delay_ns);
                let until_ns = if piece + 1 == MOST_PIECES { to_ns } else { change_ns.min(to_ns) };
                member.advance(state, span_s(until_ns.saturating_sub(at_ns)), command, voltage, side);
                at_ns = until_ns;
                if at_ns >= to_ns {
                    break;
                }
            }
        }
        let expected = self.members[0].reading();
        let own = model.members.len() - usize::from(model.has_warm);
        let apart = |state: &MemberState| state.reading() - expected;
        let squares: f64 = self.members[..own].iter().map(|state| apart(state).powi(2)).sum();
        let warm = if model.has_warm { apart(&self.members[own]).abs() } else { 0.0 };
        self.spread = self.spread.max(squares.sqrt());
        self.warm = self.warm.max(warm);
        let (low, high) = self.window.unwrap_or((expected, expected));
        self.window = Some((low.min(expected), high.max(expected)));
    }

    /// Holds a reading against what the model read at any time since the one before: how old it is nobody knows.
    fn judge(&mut self, model: &SpeedModel, now_ns: u64, reading: f64) -> Option<Cause> {
        let (low, high) = self.window.take().unwrap_or((0.0, 0.0));
        let allowed = model.allowed(self.spread, self.warm);
        (self.spread, self.warm) = (0.0, 0.0);
        let lasts = |since_ns: u64, span: f64| {
            since_ns != 0 && now_ns.saturating_sub(since_ns) >= span_ns(span).saturating_add(model.delay_ns)
        };
        let add = |sum: &mut f64, beyond: f64| *sum = summed(*sum, beyond / model.scale);
        if lasts(self.in_range_ns, THRESHOLDS.speed_settle_s) {
            add(&mut self.above, reading - high - allowed);
            add(&mut self.below, low - reading - allowed);
        }
        if lasts(self.zero_ns, THRESHOLDS.speed_run_out_s) {
            add(&mut self.turning, reading.abs() - model.standing.max(model.allowed(0.0, 0.0)));
        }
        self.verdict()
    }

    fn verdict(&self) -> Option<Cause> {
        if self.turning >= THRESHOLDS.speed_limit {
            return Some(Cause::TurnsUncommanded);
        }
        (self.above.max(self.below) >= THRESHOLDS.speed_limit).then_some(Cause::SpeedWrong)
    }
}

/// [-] The sum after one more reading, `excess` standard deviations beyond the band.
fn summed(sum: f64, excess: f64) -> f64 {
    (sum + (excess - THRESHOLDS.speed_drift).min(THRESHOLDS.speed_most)).max(0.0)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    use super::*;

    /// The bound that the limit rests on, at lower limits, where alarms come often enough to be counted.
    #[test]
    fn false_alarms_are_no_more_than_the_bound_says() {
        let mut random = ChaCha8Rng::seed_from_u64(27);
        for limit in [2.0, 3.0, 4.0] {
            let (mut sum, mut alarms, readings) = (0.0, 0_u32, 1_000_000);
            for _ in 0..readings {
                sum = summed(sum, random.sample(StandardNormal));
                if sum >= limit {
                    (sum, alarms) = (0.0, alarms + 1);
                }
            }
            let bound = f64::from(readings) * (-2.0 * THRESHOLDS.speed_drift * limit).exp();
            assert!(f64::from(alarms) <= bound, "{alarms} at {limit}, at most {bound:.0}");
            assert!(f64::from(alarms) > 1e-3 * bound, "{alarms} at {limit}: nothing was counted");
        }
        // 100 hours at 1 kHz, two rotors, two signs.
        let chance =
            4.0 * 100.0 * 3600.0 * 1e3 * (-2.0 * THRESHOLDS.speed_drift * THRESHOLDS.speed_limit).exp();
        assert!(chance < 1e-6, "{chance}");
    }

    #[test]
    fn one_wild_reading_is_no_alarm_and_three_are() {
        let after = |count: usize| (0..count).fold(0.0, |sum, _| summed(sum, 1e9));
        assert!(after(2) < THRESHOLDS.speed_limit && after(3) >= THRESHOLDS.speed_limit);
        assert_eq!(summed(5.0, -1e9), 0.0);
    }

    #[test]
    fn a_command_acts_after_its_delay_however_fine_the_steps() {
        let delay_ns = 300_000_000;
        for step_ns in [20_000_000, 1_000_000, 100_000] {
            let mut commands = Commands::default();
            for step in 1..=1_000_000_000 / step_ns {
                commands.push(1_000_000_000 + step * step_ns, step as f64, delay_ns);
            }
            let now_ns: u64 = 2_000_000_000;
            let (command, next_ns) = commands.at(now_ns - delay_ns);
            let expected = (700_000_000 / step_ns) as f64;
            // Where the ring is coarser than the steps it may be late by a hundredth of the delay.
            let late = (expected - command) * step_ns as f64;
            assert!((0.0..=0.01 * delay_ns as f64 + 1.0).contains(&late), "{step_ns}: {command}, {expected}");
            assert!(next_ns > now_ns - delay_ns);
        }
        assert_eq!(Commands::default().at(5), (0.0, u64::MAX));
    }
}
