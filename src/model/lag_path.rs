//! A free run of a rotor that is a first-order lag, laid out once for many laws on its command: the search for a grid asks for thousands of
//! them, and where commands change and how far the lag goes in between is the same for all.

use super::equations::Equations;
use super::rotor_stride::Strides;
use super::rotor_trace::{RotorInput, RotorStart};

/// What holds over a part of a run, and how much of its way the lag goes in it.
#[derive(Debug, Clone, Copy)]
struct Piece {
    /// [-] in force.
    command: f64,
    /// [V]
    voltage: f64,
    /// [s] of the row.
    time: f64,
    /// [-] share of the way to its steady state.
    response: f64,
    /// Whether no command has arrived yet: the rotor goes on as it is found.
    waits: bool,
    /// Whether a row of the log begins with it.
    begins_row: bool,
}

/// The pieces of a run of a first-order lag.
#[derive(Debug, Clone)]
pub(crate) struct LagPath {
    pieces: Vec<Piece>,
    side: f64,
}

impl Equations {
    /// The run of these inputs; `None` where the rotor is more than a lag, where a law on its command remembers, and of a single row.
    pub(crate) fn lag_path(&self, input: &RotorInput, start: &RotorStart) -> Option<LagPath> {
        let remembers = self.command.iter().any(|hook| hook.memory().is_some());
        if !self.is_lag() || remembers || input.time.len() < 2 {
            return None;
        }
        let mut pieces = Vec::with_capacity(2 * input.time.len());
        let mut strides = Strides::of(self);
        let goes_on_until = start.goes_on_until(self.arrival(input));
        let mut in_force = 0;
        for (row, times) in input.time.windows(2).enumerate() {
            let voltage = input.voltage.map_or(Some(self.constants.full_voltage), |v| v.get(row).copied())?;
            let mut from = times[0];
            while from < times[1] {
                let waits = start.rate.is_some() && from < goes_on_until;
                let to =
                    self.held_until(input, &mut in_force, (from, times[1]), waits.then_some(goes_on_until));
                let response = strides.over(to - from).response;
                let (command, time) = (*input.command.get(in_force)?, times[0]);
                let begins_row = from == times[0];
                pieces.push(Piece { command, voltage, time, response, waits, begins_row });
                from = to;
            }
        }
        Some(LagPath { pieces, side: input.side })
    }

    /// [rad/s] the rates of a run along a path of the same lag, one a row: as [`Equations::rotor_readings`] has them.
    pub(crate) fn readings_along(&self, path: &LagPath, start: &RotorStart, out: &mut [f64]) {
        let mut point = self.constants;
        point.side = path.side;
        let mut out = out.iter_mut();
        let (mut rate, mut z, mut seen) = (f64::NAN, f64::NAN, None);
        for piece in &path.pieces {
            if self.looks_at_time || seen != Some(piece.seen()) {
                point.time = piece.time;
                z = self.steady_rate_at(&mut point, piece.command, piece.voltage);
            }
            if seen.is_none() {
                rate = start.rate.unwrap_or(z);
            }
            seen = Some(piece.seen());
            if piece.begins_row
                && let Some(out) = out.next()
            {
                *out = rate;
            }
            let to = if piece.waits { start.rate.unwrap_or(z) } else { z };
            rate += (to - rate) * piece.response;
        }
        if let Some(out) = out.next() {
            *out = rate;
        }
    }
}

impl Piece {
    /// What the catalogue's laws on the command look at.
    fn seen(&self) -> (f64, f64) {
        (self.command, self.voltage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Model;

    /// Along a path a run is what it is row by row: with a dead time, commands that change between rows, a battery, an uneven clock.
    #[test]
    fn a_run_along_a_path_is_the_run() {
        let rows = 400;
        let uneven = |row: usize| 0.02 * row as f64 + 0.004 * (row % 3) as f64;
        let time: Vec<f64> = (0..rows).map(uneven).collect();
        let command: Vec<f64> = (0..rows).map(|row| 0.3 + 0.05 * (row / 7 % 5) as f64).collect();
        let from: Vec<f64> = time.iter().map(|time| time - 0.003).collect();
        let voltage: Vec<f64> = (0..rows).map(|row| 12.0 - 0.002 * row as f64).collect();
        let known = Model::paper().known_effects().expect("the catalogue");
        let law = |id: &str| known.iter().find(|effect| effect.id == id).expect("known");
        let mut model = ["command_quantization", "transport_delay"]
            .iter()
            .fold(Model::paper(), |model, id| model.with(law(id)));
        for (step, delay) in [(0.0, 0.0), (0.013, 0.0), (0.013, 0.031), (0.04, 0.09)] {
            model.set_parameter("command_quantization.step", step);
            model.set_parameter("transport_delay.delay", delay);
            let equations = model.equations().expect("known");
            for (command_from, voltage) in [(None, None), (Some(&from[..]), Some(&voltage[..]))] {
                let input = RotorInput { time: &time, command: &command, command_from, voltage, side: 1.0 };
                let found = Some(300.0);
                for (rate, is_first, until) in [
                    (None, true, None),
                    (found, true, None),
                    (found, false, None),
                    (found, false, Some(0.13)),
                ] {
                    let start =
                        RotorStart { rate, is_first, rate_holds_until: until, ..RotorStart::default() };
                    let path = equations.lag_path(&input, &start).expect("a lag");
                    let (mut whole, mut along) = (vec![0.0; rows], vec![0.0; rows]);
                    equations.rotor_readings(&input, &start, &mut whole);
                    equations.readings_along(&path, &start, &mut along);
                    // Spans that are the same but for rounding share a response.
                    let is_same = whole.iter().zip(&along).all(|(a, b)| (a - b).abs() < 1e-6);
                    assert!(is_same, "{step} {delay} {rate:?} {is_first} {until:?}");
                }
            }
        }
        let heated = model.with(law("motor_heating")).equations().expect("known");
        let input =
            RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
        assert!(heated.lag_path(&input, &RotorStart::default()).is_none(), "more than a lag");
    }
}
