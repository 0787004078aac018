//! Each rotor of each log by itself, before all are fitted together: whether its rates follow its own commands, upwards and
//! no slower than a rotor can, and not before them; and whether rotors differ. A joint fit makes numbers of them in any
//! case, and its findings then name wrong reasons.

use super::command_timing;
use super::response_sign::answers_downwards;
use super::rotor_mismatch::{self, FittedRotor};
use super::single_rotor_fit::{SingleRotorFit, excited_part, follows, lag, scatter};
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::{deviation, mean};
use crate::estimation::slope::slope;
use crate::screening::Finding;
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::suspicion::{Stops, Suspicion};
use crate::signal::Sensor;
use crate::threads::spread;

/// Milliseconds and microseconds in a second, and a factor that says about as much.
const TIMES: [f64; 2] = [1e3, 1e6];

/// How each rotor responds to its commands.
pub(crate) struct CommandResponses<'a> {
    rotors: &'a [RotorLog],
    full_voltage: f64,
    excited: Vec<Option<RotorLog>>,
    own: Vec<Option<SingleRotorFit>>,
    /// Both rotors of a log.
    pairs: Vec<(usize, usize)>,
}

impl<'a> CommandResponses<'a> {
    /// Fits each; `full_voltage` [V].
    pub fn fit(rotors: &'a [RotorLog], full_voltage: f64) -> Self {
        let excited: Vec<Option<RotorLog>> = spread(rotors, excited_part);
        let own = spread(&excited, |part| part.as_ref().and_then(|part| follows(part, full_voltage)));
        let pairs = (1..rotors.len())
            .filter(|at| are_of_one_log(&rotors[at - 1], &rotors[*at]))
            .map(|at| (at - 1, at))
            .collect();
        Self { rotors, full_voltage, excited, own, pairs }
    }

    /// Rates that can hardly be those of the commands beside them; where they cannot, that is all of it. `pole` [rad/s] is that of the
    /// bench's model: beside it a slow rotor has another reason than its time, unless that is off by the factor of a unit.
    pub fn suspicions(&self, pole: f64) -> Vec<Suspicion> {
        let crossed = self.pairs.iter().filter_map(|pair| self.crossed(*pair));
        let crossed: Vec<Suspicion> = crossed.map(Suspicion::impossible).collect();
        if !crossed.is_empty() {
            return crossed;
        }
        let wrong = |(rotor, follows): (&RotorLog, &Option<SingleRotorFit>)| {
            let slow = follows.as_ref().and_then(|follows| too_slow(rotor, follows, pole));
            slow.or_else(|| falls(rotor, follows.as_ref()).map(Suspicion::impossible))
        };
        let mut found: Vec<Suspicion> = self.rotors.iter().zip(&self.own).filter_map(wrong).collect();
        if found.iter().all(|it| it.stops != Stops::Fits) {
            found.extend(self.lead());
        }
        found
    }

    /// Rates of one of two rotors of a log that follow the other's commands.
    fn crossed(&self, (one, other): (usize, usize)) -> Option<Finding> {
        let parts = [self.excited[one].as_ref()?, self.excited[other].as_ref()?];
        let rates = [&self.rotors[one].rate[..], &self.rotors[other].rate];
        crossed(parts, rates, [&self.own[one], &self.own[other]], self.full_voltage)
    }

    /// Whether rates lead their commands, or answer them at once: the first rotor whose do.
    fn lead(&self) -> Option<Suspicion> {
        let lead = |(part, own): (&Option<RotorLog>, &Option<SingleRotorFit>)| {
            let part = part.as_ref()?;
            let left = own.as_ref().map_or_else(|| scatter(part), |own| own.fit.residual_rms);
            command_timing::find(part, left, |part, delay| lag(part, self.full_voltage, delay))
        };
        // What stops most; the first of equals.
        let found = self.excited.iter().zip(&self.own).filter_map(lead);
        found.reduce(|most, it| if it.stops > most.stops { it } else { most })
    }

    /// Whether the rotors of a log differ: what a fit leaves over then has that reason.
    pub fn mismatch(&self) -> Option<Finding> {
        let mut pairs = self.pairs.iter();
        pairs.find_map(|&(one, other)| {
            rotor_mismatch::of_a_log([self.fitted(one), self.fitted(other)], self.full_voltage)
        })
    }

    /// Whether rotors of two logs differ: each against the first that moves.
    pub fn mismatch_between_logs(&self) -> Option<Finding> {
        let rotors = self.rotors;
        let first = (0..rotors.len()).find(|at| self.own[*at].is_some())?;
        let mut others = (first + 1..rotors.len()).filter(|at| rotors[*at].file != rotors[first].file);
        others.find_map(|other| {
            rotor_mismatch::of_two_logs([self.fitted(first), self.fitted(other)], self.full_voltage)
        })
    }

    fn fitted(&self, at: usize) -> FittedRotor<'_> {
        (&self.rotors[at], self.own[at].as_ref())
    }
}

fn are_of_one_log(one: &RotorLog, other: &RotorLog) -> bool {
    one.file == other.file && one.number != other.number && one.time == other.time
}

/// Rates that follow the other rotor's commands.
fn crossed(
    parts: [&RotorLog; 2],
    rates: [&[f64]; 2],
    own: [&Option<SingleRotorFit>; 2],
    full_voltage: f64,
) -> Option<Finding> {
    let follows_other = |at: usize| {
        let commanded = parts[1 - at];
        let rate = rates[at].get(..commanded.time.len())?.to_vec().into();
        let other = RotorLog { rate, ..commanded.clone() };
        let other = follows(&other, full_voltage).filter(SingleRotorFit::is_plain)?;
        // Commands of two levels have no fit of their own: they say nothing of whose they are.
        let left = own[at].as_ref()?.fit.residual_rms;
        (other.fit.residual_rms < THRESHOLDS.other_rotor_error_share * left).then_some(at)
    };
    let found: Vec<usize> = (0..2).filter_map(follows_other).collect();
    let (first, at) = (parts[0], *found.first()?);
    let number = |at: usize| parts[at].number;
    let found_in = Finding::new("rates_of_other_rotor", Sensor::PropellerRate.name()).of(&first.file);
    let found_in = found_in.with("rotor", number(at)).with("other_rotor", number(1 - at));
    Some(found_in.with("crossed", found.len()))
}

/// A time that is no bench's.
fn too_slow(rotor: &RotorLog, follows: &SingleRotorFit, expected: f64) -> Option<Suspicion> {
    let pole = follows.fit.pole;
    let near = 1.0 / THRESHOLDS.time_unit_factor..THRESHOLDS.time_unit_factor;
    let is_unit = TIMES.iter().any(|unit| near.contains(&(unit * pole / expected)));
    let finding = rotor.finding("rotor_too_slow").with("pole_rad_s", pole);
    (follows.is_plain() && pole < THRESHOLDS.slowest_pole).then(|| Suspicion::impossible_if(is_unit, finding))
}

/// A rotor that slows down when it is commanded more: by a curve that falls, and by what its rates do right behind each change of the
/// command. A curve alone may fall for another reason: in flight a controller makes the commands, and takes back what a rotor has
/// too much of.
fn falls(rotor: &RotorLog, follows: Option<&SingleRotorFit>) -> Option<Finding> {
    let moving = follows.filter(|follows| follows.is_plain()).and_then(|follows| {
        let (low, high) = follows.range;
        let fall = follows.at(low, 0.0).value - follows.at(high, 0.0).value;
        (fall > THRESHOLDS.falling_rate_rms * follows.fit.residual_rms).then_some((low, high))
    });
    let (low, high) = moving.or_else(|| falls_steadily(rotor)).filter(|_| answers_downwards(rotor))?;
    let falls = rotor.finding("rate_falls_with_command");
    Some(falls.with("lowest_command", low).with("highest_command", high))
}

/// [-] lowest and highest steady command, where the rates fall from one to the other by more than the battery takes.
fn falls_steadily(rotor: &RotorLog) -> Option<(f64, f64)> {
    let steady = rotor.steady().into_iter().flat_map(|(_, rows)| rows);
    let rows: Vec<usize> = steady.filter(|row| rotor.rate[*row].is_finite()).collect();
    let [commands, rates]: [Vec<f64>; 2] =
        [&rotor.command, &rotor.rate].map(|column| rows.iter().map(|&row| column[row]).collect());
    let (low, high) = bounds(&commands);
    if rows.len() < THRESHOLDS.fewest_steady_rows || high - low < THRESHOLDS.narrowest_steady_range {
        return None;
    }
    let (rise, _) = slope(&commands, &rates);
    let [spread, scatter] = [&commands, &rates].map(|column| deviation(column.iter().copied()));
    let fall = -rise * (high - low);
    // Where nobody read it the battery may have emptied meanwhile.
    let given_way = rotor.voltage.as_ref().map_or(THRESHOLDS.unread_battery_fall, |volts| {
        let (least, most) = bounds(&rows.iter().map(|&row| volts[row]).collect::<Vec<f64>>());
        if most > 0.0 { (most - least) / most } else { 0.0 }
    });
    let taken = THRESHOLDS.voltage_power * mean(&rates).abs() * given_way;
    (rise * spread < THRESHOLDS.falling_correlation * scatter && fall > taken).then_some((low, high))
}
