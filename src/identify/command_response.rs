//! Each rotor of each log by itself, before all are fitted together: whether its rates follow its own commands, upwards and
//! no slower than a rotor can, and not before them; and whether rotors are [`alike`]. A fit of all at once makes numbers of
//! them in any case, and its warnings then name wrong reasons.

use super::IdentifyError;
use super::command_timing;
use super::rotor_mismatch::{self, FEWEST_STEADY};
use super::single_rotor_fit::{Follows, GIVES_WAY, deviation, follows, lag, lively_part, scatter};
use crate::screening::rotor_data::{RotorLog, bounds};

/// [1/s] no rotor on a bench follows its command as slowly as this pole.
const SLOWEST_POLE: f64 = 0.3;
/// Milliseconds and microseconds in a second, and a factor that says about as much.
const TIMES: [f64; 2] = [1e3, 1e6];
const ABOUT: f64 = 2.0;
/// Share of the voltage that an empty battery lacks.
const EMPTIED: f64 = 0.3;
/// Errors of which one is that much smaller tell whose command a rate follows.
const CROSSED: f64 = 0.5;
/// Rms of what a fit leaves over, by which a curve falls that does.
const FALLEN: f64 = 2.0;
/// [-] range of steady commands below which nothing is said of where the curve goes.
const NARROWEST: f64 = 0.05;
/// Correlation of steady rates with their commands from which they fall.
const FALLS: f64 = -0.8;

/// What is to be said of rotors that were looked at by themselves.
#[derive(Debug, Default)]
pub(crate) struct Said {
    /// For people.
    pub sentences: Vec<String>,
    /// Whether rates lead their commands, or rotors of a log differ: what a fit leaves over then has that reason.
    pub unlike: bool,
}

/// Rotors looked at each by itself.
pub(crate) struct Alone<'a> {
    rotors: &'a [RotorLog],
    full_voltage: f64,
    lively: Vec<Option<RotorLog>>,
    own: Vec<Option<Follows>>,
    /// Both rotors of a log.
    pairs: Vec<(usize, usize)>,
}

impl<'a> Alone<'a> {
    /// Looks at them; `full_voltage` [V].
    pub fn look(rotors: &'a [RotorLog], full_voltage: f64) -> Self {
        let lively: Vec<Option<RotorLog>> = rotors.iter().map(lively_part).collect();
        let own =
            lively.iter().map(|part| part.as_ref().and_then(|part| follows(part, full_voltage))).collect();
        let pairs = (1..rotors.len())
            .filter(|at| are_of_one_log(&rotors[at - 1], &rotors[*at]))
            .map(|at| (at - 1, at))
            .collect();
        Self { rotors, full_voltage, lively, own, pairs }
    }

    /// Refuses rates that cannot be those of the commands beside them. `pole` [1/s] is that of the bench's model, where there is
    /// one: beside it a slow rotor has another reason than its time, unless that is off by the factor of a unit.
    ///
    /// # Errors
    /// [`IdentifyError::Unit`] with the log, and what its columns or its time may be instead.
    pub fn refuse(&self, pole: Option<f64>) -> Result<(), IdentifyError> {
        let refuse = |sentence: Option<String>| sentence.map_or(Ok(()), |it| Err(IdentifyError::Unit(it)));
        for &(one, other) in &self.pairs {
            if let (Some(first), Some(second)) = (&self.lively[one], &self.lively[other]) {
                refuse(crossed([first, second], [&self.own[one], &self.own[other]], self.full_voltage))?;
            }
        }
        for (rotor, follows) in self.rotors.iter().zip(&self.own) {
            refuse(follows.as_ref().and_then(|follows| too_slow(rotor, follows, pole)))?;
            refuse(falls(rotor, follows.as_ref()))?;
        }
        Ok(())
    }

    /// Says so where rates lead their commands, or two rotors are not alike.
    pub fn say(&self) -> Said {
        let (rotors, own, full_voltage) = (self.rotors, &self.own, self.full_voltage);
        let lead = |(part, own): (&Option<RotorLog>, &Option<Follows>)| {
            let part = part.as_ref()?;
            let left = own.as_ref().map_or_else(|| scatter(part), |own| own.fit.residual_rms);
            command_timing::tell(part, left, |part, delay| lag(part, full_voltage, delay))
        };
        let looked = |at: usize| (&rotors[at], own[at].as_ref());
        let of_a_log = || {
            let mut pairs = self.pairs.iter();
            pairs.find_map(|&(one, other)| {
                rotor_mismatch::of_a_log([looked(one), looked(other)], full_voltage)
            })
        };
        if let Some(unlike) = self.lively.iter().zip(own).find_map(lead).or_else(of_a_log) {
            return Said { sentences: vec![unlike], unlike: true };
        }
        // Each against the first that moves.
        let first = (0..rotors.len()).find(|at| own[*at].is_some());
        let of_two_logs = first.and_then(|first| {
            let mut others =
                (first + 1..rotors.len()).filter(|at| rotors[*at].file() != rotors[first].file());
            others.find_map(|other| rotor_mismatch::of_two_logs([looked(first), looked(other)], full_voltage))
        });
        Said { sentences: of_two_logs.into_iter().collect(), unlike: false }
    }
}

fn are_of_one_log(one: &RotorLog, other: &RotorLog) -> bool {
    one.file() == other.file() && one.number() != other.number() && one.time == other.time
}

/// What to say where a rotor's rates follow the other's commands.
fn crossed(parts: [&RotorLog; 2], own: [&Option<Follows>; 2], full_voltage: f64) -> Option<String> {
    let follows_other = |at: usize| {
        let other = RotorLog { rate: parts[at].rate.clone(), ..parts[1 - at].clone() };
        let other = follows(&other, full_voltage).filter(Follows::is_plain)?;
        // Commands of two levels have no fit of their own: they say nothing of whose they are.
        let left = own[at].as_ref()?.fit.residual_rms;
        (other.fit.residual_rms < CROSSED * left).then_some(at)
    };
    let found: Vec<usize> = (0..2).filter_map(follows_other).collect();
    let (first, at) = (parts[0], *found.first()?);
    let (this, that) = (parts[at].number(), parts[1 - at].number());
    let both =
        if found.len() > 1 { format!(", and those of {that} the commands of {this}") } else { String::new() };
    let file = first.file();
    Some(format!(
        "{file}: the rates of rotor {this} follow the commands of rotor {that}{both}: they are another rotor's column; give \
         each command the rate of its own rotor"
    ))
}

/// What to say of a time that is no bench's.
fn too_slow(rotor: &RotorLog, follows: &Follows, expected: Option<f64>) -> Option<String> {
    let pole = follows.fit.pole;
    let is_unit =
        |expected: f64| TIMES.iter().any(|unit| (1.0 / ABOUT..ABOUT).contains(&(unit * pole / expected)));
    (follows.is_plain() && pole < SLOWEST_POLE && expected.is_none_or(is_unit)).then(|| {
        format!(
            "{}: the rates follow the commands with a time constant of {:.0} s (a pole of {pole:.3} 1/s), and no rotor on a \
             bench is that slow; if the time is in milliseconds or microseconds, import it with unit `ms` or `us`",
            rotor.source,
            1.0 / pole
        )
    })
}

/// What to say of a rotor that slows down when it is told more.
fn falls(rotor: &RotorLog, follows: Option<&Follows>) -> Option<String> {
    let moving = follows.filter(|follows| follows.is_plain()).and_then(|follows| {
        let (low, high) = follows.range;
        let fall = follows.at(low, 0.0).value - follows.at(high, 0.0).value;
        (fall > FALLEN * follows.fit.residual_rms).then_some((low, high))
    });
    let (low, high) = moving.or_else(|| falls_steadily(rotor))?;
    Some(format!(
        "{}: the rotor slows down when it is told more, over all commands from {low:.3} to {high:.3}: the command counts the \
         other way round (1 is none: import it with scale -1, offset 1), or the rates are those of another rotor",
        rotor.source
    ))
}

/// [-] lowest and highest steady command, where the rates fall from one to the other by more than the battery takes.
fn falls_steadily(rotor: &RotorLog) -> Option<(f64, f64)> {
    let steady = rotor.steady().into_iter().flat_map(|(_, rows)| rows);
    let rows: Vec<usize> = steady.filter(|row| rotor.rate[*row].is_finite()).collect();
    let [commands, rates]: [Vec<f64>; 2] =
        [&rotor.command, &rotor.rate].map(|column| rows.iter().map(|&row| column[row]).collect());
    let (low, high) = bounds(&commands);
    if rows.len() < FEWEST_STEADY || high - low < NARROWEST {
        return None;
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / rows.len() as f64;
    let (command, rate) = (mean(&commands), mean(&rates));
    let product =
        commands.iter().zip(&rates).map(|(u, w)| (u - command) * (w - rate)).sum::<f64>() / rows.len() as f64;
    let spread = deviation(&commands);
    let fall = -product / (spread * spread) * (high - low);
    // Where nobody read it the battery may have emptied meanwhile.
    let given_way = rotor.voltage.as_ref().map_or(EMPTIED, |volts| {
        let (least, most) = bounds(&rows.iter().map(|&row| volts[row]).collect::<Vec<f64>>());
        if most > 0.0 { (most - least) / most } else { 0.0 }
    });
    let taken = GIVES_WAY * rate.abs() * given_way;
    (product < FALLS * spread * deviation(&rates) && fall > taken).then_some((low, high))
}
