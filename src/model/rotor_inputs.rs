//! What a rotor is given, and when: the command in force, behind it the voltage and z.

use super::equations::Equations;
use super::rotor_trace::RotorInput;
use crate::effect::Point;

/// What a point was given last: a command that stays for many rows needs no second look.
#[derive(Default)]
pub(super) struct Held {
    /// [-], [V]
    of: Option<(f64, f64)>,
    /// [rad/s] the curve there.
    curve: f64,
}

impl Equations {
    /// The row whose command is in force at `at` [s], behind it by the delay; from the one before on.
    #[inline]
    pub(super) fn in_force(&self, input: &RotorInput, mut row: usize, at: Option<f64>) -> usize {
        let since = input.since();
        while (since.get(row + 1).zip(at)).is_some_and(|(change, at)| change + self.command_delay <= at) {
            row += 1;
        }
        row
    }

    /// [s] when the first command of a run arrives.
    #[inline]
    pub(super) fn arrival(&self, input: &RotorInput) -> f64 {
        input.time.first().map_or(0.0, |first| first + self.command_delay)
    }

    /// [s] until when the command that is in force `from` some time on stays so within its row, or until it `arrives`; `row` becomes the
    /// row of that command.
    #[inline]
    pub(super) fn held_until(
        &self,
        input: &RotorInput,
        row: &mut usize,
        (from, next): (f64, f64),
        arrives: Option<f64>,
    ) -> f64 {
        *row = self.in_force(input, *row, Some(from));
        let until = arrives.unwrap_or_else(|| self.next_change(input, *row, next)).min(next);
        // Times that do not rise, or are no numbers, end with the row.
        if until > from { until } else { next }
    }

    /// [s] when a command arrives that differs from that of a row, or `until`.
    #[inline]
    fn next_change(&self, input: &RotorInput, row: usize, until: f64) -> f64 {
        let commands = input.since().iter().zip(input.command).skip(row);
        let in_force = input.command.get(row);
        // Where a delay is no number, nothing is looked for behind it.
        let mut arrivals = commands.skip(1).map(|(since, command)| (since + self.command_delay, command));
        let change = arrivals
            .find(|(arrives, command)| arrives.is_nan() || *arrives >= until || Some(*command) != in_force);
        change.map_or(until, |(arrives, _)| arrives)
    }

    /// The point learns the command and the battery's voltage of two rows, and z; `held` is what it has learnt last.
    #[inline]
    pub(super) fn hold_rotor(
        &self,
        point: &mut Point,
        input: &RotorInput,
        (command_row, row): (usize, usize),
        held: &mut Held,
    ) -> Option<()> {
        let command = *input.command.get(command_row)?;
        let voltage = input.voltage.map_or(Some(self.constants.full_voltage), |v| v.get(row).copied())?;
        point.time = *input.time.get(row)?;
        let is_held = |(before, at): (f64, f64)| before == command && (at == voltage || !self.reads_battery);
        if !held.of.is_some_and(is_held) || self.looks_at_time {
            point.propeller_rate = self.constants.propeller_rate;
            point.steady_rate = self.constants.steady_rate;
            held.curve = self.curve_at(point, command, voltage);
        }
        held.of = Some((command, voltage));
        point.battery_voltage = voltage;
        point.steady_rate = self.at_voltage(held.curve, voltage);
        Some(())
    }
}
