//! Each rotor of each log by itself, before all are fitted together: whether its rates follow its own commands, upwards and
//! no slower than a rotor can, and not before them; and whether two rotors of a log are alike. A fit of all at once makes numbers of them in any
//! case, and its warnings then name wrong reasons.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::lead;
use super::linear;
use super::pole::{self, LagFit};
use super::procedure::FEWEST_JUMPS;
use super::record_of::record_of;
use super::rivals::{self, Rival};
use super::rotor_log::{RotorLog, bounds};
use super::unsure;
use super::{Estimate, IdentifyError};
use crate::unit::with_error;

/// Rows from the first jump on that are looked at: four minutes at 50 Hz.
const LOOKED_AT: usize = 12_000;
/// [1/s] no rotor on a bench follows its command as slowly as this pole.
const SLOWEST_POLE: f64 = 0.3;
/// Share of the scatter of the rates that a fit leaves over at most, where it is believed that the rates follow.
const FOLLOWS: f64 = 0.6;
/// Errors of which one is that much smaller tell whose command a rate follows.
const CROSSED: f64 = 0.5;
/// Rms of what a fit leaves over, by which a curve falls that does.
const FALLEN: f64 = 2.0;
/// [-] range of steady commands below which nothing is said of where the curve goes.
const NARROWEST: f64 = 0.05;
/// Correlation of steady rates with their commands from which they fall.
const FALLS: f64 = -0.8;
/// Power of the voltage with which a rate at one command falls at most.
const GIVES_WAY: f64 = 2.0;
/// [-] difference of two commands that is one, and its spread from which its part in the rates is known.
const APART: (f64, f64) = (1e-6, 0.02);
/// Rows that show a difference of steady rates.
const FEWEST_STEADY: usize = 100;
/// Standard errors, and shares of a rate and of a pole, from which two rotors differ plainly.
const PLAINLY: f64 = 5.0;
const UNLIKE: (f64, f64) = (0.005, 0.02);

/// What the rates of a rotor do after its commands (or after another's).
struct Follows {
    fit: LagFit,
    /// [rad/s] standard deviation of the rates.
    scatter: f64,
    /// [-] between which nine of ten commands lie.
    range: (f64, f64),
}

impl Follows {
    /// Whether the pole is one, and most of the motion is explained.
    fn is_plain(&self) -> bool {
        let pole = Estimate { value: self.fit.pole, standard_error: self.fit.pole_error() };
        unsure::is_sure(&pole) && self.fit.residual_rms < FOLLOWS * self.scatter
    }

    /// [rad/s] the steady rate at a command [-] and a voltage drop [V].
    fn at(&self, command: f64, drop: f64) -> Estimate {
        let mut place = vec![command, command * command];
        place.extend((self.fit.coefficients.len() > 2).then_some(-drop));
        place.push(0.0);
        let place = DVector::from(place);
        let rates = DVector::from_vec(self.fit.coefficients.clone()).push(0.0);
        let variance = (place.transpose() * &self.fit.covariance * &place)[(0, 0)];
        Estimate { value: rates.dot(&place), standard_error: variance.max(0.0).sqrt() }
    }
}

/// Refuses rates that cannot be those of the commands beside them. Says so where they lead these, or two rotors are not
/// alike.
///
/// # Errors
/// [`IdentifyError::Unit`] with the log, and what its columns or its time may be instead.
pub(super) fn check(rotors: &[RotorLog], full_voltage: f64) -> Result<Option<String>, IdentifyError> {
    let refuse = |sentence: Option<String>| sentence.map_or(Ok(()), |it| Err(IdentifyError::Unit(it)));
    let looked_at: Vec<Option<RotorLog>> = rotors.iter().map(lively_part).collect();
    let own = |at: usize| looked_at[at].as_ref().and_then(|part| follows(part, full_voltage));
    let own: Vec<Option<Follows>> = (0..rotors.len()).map(own).collect();
    let pairs: Vec<(usize, usize)> = (1..rotors.len())
        .filter(|at| are_of_one_log(&rotors[at - 1], &rotors[*at]))
        .map(|at| (at - 1, at))
        .collect();
    for &(one, other) in &pairs {
        if let (Some(first), Some(second)) = (&looked_at[one], &looked_at[other]) {
            refuse(crossed([first, second], [&own[one], &own[other]], full_voltage))?;
        }
    }
    for (rotor, follows) in rotors.iter().zip(&own) {
        refuse(follows.as_ref().and_then(|follows| too_slow(rotor, follows)))?;
        refuse(falls(rotor, follows.as_ref()))?;
    }
    let lead = |(part, own): (&Option<RotorLog>, &Option<Follows>)| {
        let part = part.as_ref()?;
        let left = own.as_ref().map_or_else(|| scatter(part), |own| own.fit.residual_rms);
        lead::tell(part, left, |part, delay| lag(part, full_voltage, delay))
    };
    if let Some(leads) = looked_at.iter().zip(&own).find_map(lead) {
        return Ok(Some(leads));
    }
    let unlike = pairs.iter().find_map(|&(one, other)| {
        let rotors = [&rotors[one], &rotors[other]];
        let moving = own[one].as_ref().zip(own[other].as_ref()).filter(|(a, b)| a.is_plain() && b.is_plain());
        let (rates, answers) = match moving {
            Some((a, b)) => {
                let parts = looked_at[one].as_ref().zip(looked_at[other].as_ref())?;
                let answers = Answers::of(parts.into(), [a, b], full_voltage);
                (moving_rates(rotors, [a, b], full_voltage), answers)
            }
            None => (steady_rates(rotors), Answers::default()),
        };
        tell_of_unlike(rotors, rates, &answers)
    });
    Ok(unlike)
}

/// The rotor from its first jump on, where it is lively.
fn lively_part(rotor: &RotorLog) -> Option<RotorLog> {
    let jumps = rotor.jumps();
    let first = *jumps.first().filter(|_| jumps.len() >= FEWEST_JUMPS)?;
    let part = first..first + LOOKED_AT;
    let inside = |segment: &Range<usize>| segment.start.max(part.start)..segment.end.min(part.end);
    let segments = rotor.segments.iter().map(inside).filter(|it| it.len() > 1).collect();
    Some(RotorLog { segments, ..rotor.clone() })
}

fn follows(part: &RotorLog, full_voltage: f64) -> Option<Follows> {
    let fit = lag(part, full_voltage, 0.0)?;
    let mut commands: Vec<f64> = part.scored().map(|row| part.command[row]).collect();
    commands.sort_by(f64::total_cmp);
    let last = commands.len().checked_sub(1)?;
    let range = (commands[last * 5 / 100], commands[last - last * 5 / 100]);
    Some(Follows { fit, scatter: scatter(part), range })
}

/// A lag behind commands that act `delay` [s] late, with the battery where it was read.
fn lag(part: &RotorLog, full_voltage: f64, delay: f64) -> Option<LagFit> {
    let part = std::slice::from_ref(part);
    let beside = || pole::fit(&record_of(part, full_voltage, delay, |u, drop| [u, u * u, -drop]));
    let alone = || pole::fit(&record_of(part, full_voltage, delay, |u, _| [u, u * u]));
    part[0].voltage.is_some().then(beside).flatten().or_else(alone)
}

/// [rad/s] standard deviation of the rates.
fn scatter(part: &RotorLog) -> f64 {
    deviation(&part.scored().map(|row| part.rate[row]).collect::<Vec<f64>>())
}

/// [unit of the values]
fn deviation(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
}

fn are_of_one_log(one: &RotorLog, other: &RotorLog) -> bool {
    file(one) == file(other) && number(one) != number(other) && one.time == other.time
}

/// The log's name.
fn file(rotor: &RotorLog) -> &str {
    rotor.source.rsplit_once(", rotor ").map_or(rotor.source.as_str(), |(file, _)| file)
}

/// The number that the columns of a rotor have.
fn number(rotor: &RotorLog) -> &str {
    rotor.source.rsplit(' ').next().unwrap_or_default()
}

/// What to say where a rotor's rates follow the other's commands.
fn crossed(parts: [&RotorLog; 2], own: [&Option<Follows>; 2], full_voltage: f64) -> Option<String> {
    let follows_other = |at: usize| {
        let other = RotorLog { rate: parts[at].rate.clone(), ..parts[1 - at].clone() };
        let other = follows(&other, full_voltage).filter(Follows::is_plain)?;
        let left = own[at].as_ref().map_or(other.scatter, |own| own.fit.residual_rms);
        (other.fit.residual_rms < CROSSED * left).then_some(at)
    };
    let found: Vec<usize> = (0..2).filter_map(follows_other).collect();
    let (first, at) = (parts[0], *found.first()?);
    let (this, that) = (number(parts[at]), number(parts[1 - at]));
    let both =
        if found.len() > 1 { format!(", and those of {that} the commands of {this}") } else { String::new() };
    let file = file(first);
    Some(format!(
        "{file}: the rates of rotor {this} follow the commands of rotor {that}{both}: they are another rotor's column; give \
         each command the rate of its own rotor"
    ))
}

/// What to say of a time that is no bench's.
fn too_slow(rotor: &RotorLog, follows: &Follows) -> Option<String> {
    let pole = follows.fit.pole;
    (follows.is_plain() && pole < SLOWEST_POLE).then(|| {
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
    let volts: Vec<f64> =
        rotor.voltage.as_ref().map_or_else(Vec::new, |volts| rows.iter().map(|&row| volts[row]).collect());
    let (least, most) = bounds(&volts);
    let taken = if most > 0.0 { GIVES_WAY * rate.abs() * (most - least) / most } else { 0.0 };
    (product < FALLS * spread * deviation(&rates) && fall > taken).then_some((low, high))
}

/// A command [-], and the rates [rad/s] of both rotors there.
type Rates = (f64, [Estimate; 2]);

/// At the mean command and charge of both.
fn moving_rates(rotors: [&RotorLog; 2], follows: [&Follows; 2], full_voltage: f64) -> Option<Rates> {
    let mean = |of: &dyn Fn(&RotorLog, usize) -> f64| {
        let all = rotors.iter().flat_map(|rotor| rotor.scored().map(move |row| of(rotor, row)));
        let (sum, count) = all.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        sum / count
    };
    let command = mean(&|rotor, row| rotor.command[row]);
    let drop = mean(&|rotor, row| rotor.voltage.as_ref().map_or(0.0, |voltage| full_voltage - voltage[row]));
    Some((command, follows.map(|follows| follows.at(command, drop)))).filter(|_| drop.is_finite())
}

/// What differs in how two rotors answer.
#[derive(Default)]
struct Answers {
    /// [rad/s]
    poles: Option<[Estimate; 2]>,
    /// [ms] zero: none is needed.
    delays: Option<[Estimate; 2]>,
}

impl Answers {
    /// A lag makes up for a delay with its pole: poles that differ are held against each other beside it.
    fn of(parts: [&RotorLog; 2], follows: [&Follows; 2], full_voltage: f64) -> Self {
        let plain = |it: &Follows| Estimate { value: it.fit.pole, standard_error: it.fit.pole_error() };
        if !differ(&follows.map(plain), UNLIKE.1) {
            return Self::default();
        }
        let late = [0, 1].map(|at| delay(parts[at], &follows[at].fit, full_voltage));
        let pole = |at: usize| {
            let pole = plain(follows[at]);
            Estimate { value: late[at].as_ref().map_or(pole.value, |late| late.pole), ..pole }
        };
        let none = Estimate { value: 0.0, standard_error: 0.0 };
        let delays = [0, 1].map(|at| late[at].as_ref().map_or(none, |late| late.time.scaled(1e3)));
        let those = |both: [Estimate; 2]| differ(&both, UNLIKE.1).then_some(both);
        Self { poles: those([0, 1].map(pole)), delays: those(delays) }
    }
}

/// The delay with which a rotor answers, where its log asks for one.
fn delay(part: &RotorLog, lag: &LagFit, full_voltage: f64) -> Option<Rival> {
    let part = std::slice::from_ref(part);
    let tried = if lag.coefficients.len() > 2 {
        rivals::both(lag, part, |part, delay| {
            record_of(part, full_voltage, delay, |u, drop| [u, u * u, -drop])
        })
    } else {
        rivals::both(lag, part, |part, delay| record_of(part, full_voltage, delay, |u, _| [u, u * u]))
    };
    tried.into_iter().find(|rival| rival.effect == "transport_delay" && rival.needed && rival.clear)
}

/// Whether two numbers differ plainly, and by more than that share.
fn differ([a, b]: &[Estimate; 2], share: f64) -> bool {
    let apart = (a.value - b.value).abs();
    let sigma = a.standard_error.hypot(b.standard_error);
    apart > PLAINLY * sigma && apart > share * a.value.abs().min(b.value.abs())
}

/// Where both are steady at once: their difference is then not the battery's.
fn steady_rates([one, other]: [&RotorLog; 2]) -> Option<Rates> {
    let steady = |rotor: &RotorLog| {
        let mut steady = vec![false; rotor.time.len()];
        rotor.steady().into_iter().for_each(|(_, rows)| steady[rows].fill(true));
        steady
    };
    let (first, second) = (steady(one), steady(other));
    let both = |row: &usize| {
        first[*row] && second[*row] && one.rate[*row].is_finite() && other.rate[*row].is_finite()
    };
    let rows: Vec<usize> = (0..one.time.len()).filter(both).collect();
    if rows.len() < FEWEST_STEADY {
        return None;
    }
    let apart: Vec<f64> = rows.iter().map(|&row| one.command[row] - other.command[row]).collect();
    let (low, high) = bounds(&apart);
    let difference = rows.iter().map(|&row| one.rate[row] - other.rate[row]);
    let difference = DVector::from_iterator(rows.len(), difference);
    // At equal commands, and not beyond those that were told: a curve of degree two takes up how they differ.
    let of = |columns: usize| {
        let sum = |at: usize| one.command[rows[at]] + other.command[rows[at]];
        let entry = |at: usize, column: usize| [1.0, apart[at], apart[at] * sum(at)][column];
        linear::least_squares(&DMatrix::from_fn(rows.len(), columns, entry), &difference)
    };
    let fit = if low.abs().max(high.abs()) < APART.0 {
        of(1)?
    } else if high - low > APART.1 && low <= 0.0 && high >= 0.0 {
        of(3).or_else(|| of(2))?
    } else {
        return None;
    };
    let mean = |column: &[f64]| rows.iter().map(|&row| column[row]).sum::<f64>() / rows.len() as f64;
    // The error of the difference is all that counts: half of its variance to each.
    let error = fit.standard_error(0) / std::f64::consts::SQRT_2;
    let rate = mean(&other.rate);
    let rates = [rate + fit.coefficients[0], rate].map(|value| Estimate { value, standard_error: error });
    Some((mean(&other.command), rates))
}

fn tell_of_unlike(rotors: [&RotorLog; 2], rates: Option<Rates>, answers: &Answers) -> Option<String> {
    let [one, other] = rotors.map(number);
    let in_words = |[a, b]: [Estimate; 2], unit: &str| {
        let [a, b] = [a, b].map(|it| match it.standard_error {
            0.0 => crate::unit::short(it.value),
            error => with_error(it.value, error),
        });
        format!("{a} {unit} of rotor {one}, {b} of rotor {other}")
    };
    let rates = rates.filter(|(_, rates)| differ(rates, UNLIKE.0));
    let rates =
        rates.map(|(command, rates)| format!("rates at command {command:.3}: {}", in_words(rates, "rad/s")));
    let delays = answers.delays.map(|delays| format!("answers come late by {}", in_words(delays, "ms")));
    let poles = answers.poles.map(|poles| format!("poles: {}", in_words(poles, "rad/s")));
    let differences: Vec<String> = rates.into_iter().chain(delays).chain(poles).collect();
    let file = file(rotors[0]);
    (!differences.is_empty()).then(|| {
        format!(
            "{file}: the rotors are not alike ({}): a model of both is right for neither; identify each by itself, with \
             --rotor {one} and with --rotor {other}",
            differences.join("; ")
        )
    })
}
