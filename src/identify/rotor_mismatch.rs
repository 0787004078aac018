//! Whether rotors are alike, of one log and of two: a model of both is right for neither where they are not.

use nalgebra::{DMatrix, DVector};

use super::Estimate;
use super::lag_order::{self, Rival};
use super::pole::LagFit;
use super::regressors::record_of;
use super::single_rotor_fit::{Follows, GIVES_WAY, lively_part};
use crate::effect::Term;
use crate::estimation::least_squares;
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::unit::with_error;

/// [-] difference of two commands that is one, and its spread from which its part in the rates is known.
const APART: (f64, f64) = (1e-6, 0.02);
/// Rows that show a difference of steady rates.
pub(crate) const FEWEST_STEADY: usize = 100;
/// Standard errors, and shares of a rate and of a pole, from which two rotors differ plainly.
const PLAINLY: f64 = 5.0;
const UNLIKE: (f64, f64) = (0.005, 0.02);
/// The same shares for two logs: a battery that gives way under the load makes a pole a few percent faster, and more so where
/// the rotor is faster.
const UNLIKE_LOGS: (f64, f64) = (0.01, 0.05);
/// Share of the narrower range of commands that two logs have in common where their rates are held against each other.
const IN_COMMON: f64 = 0.5;

/// A rotor that was looked at by itself: its lively part, and how that follows.
pub(crate) type Looked<'a> = (&'a RotorLog, Option<&'a Follows>);

/// What to say of two rotors of a log that are not alike.
pub(crate) fn of_a_log(looked: [Looked<'_>; 2], full_voltage: f64) -> Option<String> {
    let rotors = looked.map(|(rotor, _)| rotor);
    let moving = looked[0].1.zip(looked[1].1).filter(|(a, b)| a.is_plain() && b.is_plain());
    let (rates, answers) = match moving {
        Some((a, b)) => {
            let answers = Answers::of(rotors, [a, b], UNLIKE.1, full_voltage)?;
            (moving_rates(rotors, [a, b], full_voltage), answers)
        }
        None => (steady_rates(rotors), Answers::default()),
    };
    let [one, other] = rotors.map(RotorLog::number);
    let names = [format!("rotor {one}"), format!("rotor {other}")];
    let differences = differences(&names, rates.filter(|(_, rates)| differ(rates, UNLIKE.0)), &answers)?;
    Some(format!(
        "{}: the rotors are not alike ({differences}): a model of both is right for neither; identify each by itself, with \
         --rotor {one} and with --rotor {other}",
        rotors[0].file()
    ))
}

/// What to say of two rotors of different logs that are not alike. It may be one and the same, in a log that shows what the
/// other does not.
pub(crate) fn of_two_logs(looked: [Looked<'_>; 2], full_voltage: f64) -> Option<String> {
    let (a, b) = looked[0].1.zip(looked[1].1).filter(|(a, b)| a.is_plain() && b.is_plain())?;
    let rotors = looked.map(|(rotor, _)| rotor);
    let answers = Answers::of(rotors, [a, b], UNLIKE_LOGS.1, full_voltage)?;
    let rates = rates_in_common(rotors, [a, b], full_voltage);
    let names = rotors.map(|rotor| rotor.source.clone());
    let differences = differences(&names, rates, &answers)?;
    Some(format!(
        "{} and {} are not alike ({differences}): one model of both is right for neither; identify each log by itself, and if \
         it is the same rotor, look for what is missing with `diagnose`",
        names[0], names[1]
    ))
}

/// Where both were told the same, and where they differ by more than what the battery may have taken from one of them: k_V is
/// not known yet.
fn rates_in_common(rotors: [&RotorLog; 2], follows: [&Follows; 2], full_voltage: f64) -> Option<Rates> {
    let [(low, high), (other_low, other_high)] = follows.map(|follows| follows.range);
    let common = (low.max(other_low), high.min(other_high));
    if common.1 - common.0 < IN_COMMON * (high - low).min(other_high - other_low) {
        return None;
    }
    let [one, other] = rotors.map(|rotor| {
        let volts = rotor.voltage.as_ref()?;
        let (sum, count) =
            rotor.scored().fold((0.0, 0.0), |(sum, count), row| (sum + volts[row], count + 1.0));
        Some(sum / count)
    });
    let (one, other) = one.zip(other)?;
    let (command, volts) = (0.5 * (common.0 + common.1), 0.5 * (one + other));
    let rates = follows.map(|follows| follows.at(command, full_voltage - volts));
    let taken = GIVES_WAY * rates[0].value.abs() * (one - other).abs() / volts;
    let is_more = (rates[0].value - rates[1].value).abs() > taken;
    (is_more && differ(&rates, UNLIKE_LOGS.0)).then_some((command, rates))
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
    fn of(rotors: [&RotorLog; 2], follows: [&Follows; 2], share: f64, full_voltage: f64) -> Option<Self> {
        let plain = |it: &Follows| Estimate { value: it.fit.pole, standard_error: it.fit.pole_error() };
        if !differ(&follows.map(plain), share) {
            return Some(Self::default());
        }
        let parts = lively_part(rotors[0]).zip(lively_part(rotors[1]))?;
        let parts = [&parts.0, &parts.1];
        let late = [0, 1].map(|at| delay(parts[at], &follows[at].fit, full_voltage));
        let pole = |at: usize| {
            let pole = plain(follows[at]);
            Estimate { value: late[at].as_ref().map_or(pole.value, |late| late.pole), ..pole }
        };
        let none = Estimate { value: 0.0, standard_error: 0.0 };
        let delays = [0, 1].map(|at| late[at].as_ref().map_or(none, |late| late.time.scaled(1e3)));
        let those = |both: [Estimate; 2]| differ(&both, share).then_some(both);
        Some(Self { poles: those([0, 1].map(pole)), delays: those(delays) })
    }
}

/// The delay with which a rotor answers, where its log asks for one.
fn delay(part: &RotorLog, lag: &LagFit, full_voltage: f64) -> Option<Rival> {
    let part = std::slice::from_ref(part);
    let tried = if lag.coefficients.len() > 2 {
        lag_order::both(lag, part, |part, delay| {
            record_of(part, full_voltage, delay, |u, drop| [u, u * u, -drop])
        })
    } else {
        lag_order::both(lag, part, |part, delay| record_of(part, full_voltage, delay, |u, _| [u, u * u]))
    };
    tried.into_iter().find(|rival| rival.term == Term::DeadTime && rival.needed && rival.clear)
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
        least_squares::least_squares(&DMatrix::from_fn(rows.len(), columns, entry), &difference)
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

/// What differs, in words; `None` where nothing does.
fn differences(names: &[String; 2], rates: Option<Rates>, answers: &Answers) -> Option<String> {
    let in_words = |both: [Estimate; 2], unit: &str| {
        let [a, b] = both.map(|it| match it.standard_error {
            0.0 => crate::unit::short(it.value),
            error => with_error(it.value, error),
        });
        format!("{a} {unit} of {}, {b} of {}", names[0], names[1])
    };
    let rates =
        rates.map(|(command, rates)| format!("rates at command {command:.3}: {}", in_words(rates, "rad/s")));
    let delays = answers.delays.map(|delays| format!("answers come late by {}", in_words(delays, "ms")));
    let poles = answers.poles.map(|poles| format!("poles: {}", in_words(poles, "rad/s")));
    let differences: Vec<String> = rates.into_iter().chain(delays).chain(poles).collect();
    (!differences.is_empty()).then(|| differences.join("; "))
}
