//! Whether rotors differ, of one log and of two: a model of both is right for neither where they do.

use super::thresholds::THRESHOLDS;
use nalgebra::{DMatrix, DVector};

use super::Estimate;
use super::lag_order::{self, LagAlternative};
use super::regressors::record_of;
use super::single_rotor_fit::{SingleRotorFit, excited_part};
use crate::effect::Term;
use crate::estimation::least_squares;
use crate::estimation::moments::mean_of;
use crate::estimation::variable_projection::LagFit;
use crate::screening::Finding;
use crate::screening::rotor_data::{RotorLog, bounds};

/// A rotor, and the fit to it alone.
pub(crate) type FittedRotor<'a> = (&'a RotorLog, Option<&'a SingleRotorFit>);

/// Two rotors of a log that differ.
pub(crate) fn of_a_log(fitted: [FittedRotor<'_>; 2], full_voltage: f64) -> Option<Finding> {
    let rotors = fitted.map(|(rotor, _)| rotor);
    let moving = fitted[0].1.zip(fitted[1].1).filter(|(a, b)| a.is_plain() && b.is_plain());
    let (rates, answers) = match moving {
        Some((a, b)) => {
            let answers = Answers::of(rotors, [a, b], THRESHOLDS.mismatch_pole_share, full_voltage)?;
            (moving_rates(rotors, [a, b], full_voltage), answers)
        }
        None => (steady_rates(rotors), Answers::default()),
    };
    let numbers = rotors.map(|rotor| rotor.number);
    let names = numbers.map(|number| format!("rotor {number}"));
    let rates = rates.filter(|(_, rates)| differ(rates, THRESHOLDS.mismatch_rate_share));
    let found = Finding::new("rotor_mismatch", "").of(&rotors[0].file);
    let found = found.with("rotor", numbers[0]).with("other_rotor", numbers[1]);
    with_differences(found, names, rates, &answers)
}

/// Two rotors of different logs that differ. It may be one and the same, in a log that shows what the
/// other does not.
pub(crate) fn of_two_logs(fitted: [FittedRotor<'_>; 2], full_voltage: f64) -> Option<Finding> {
    let (a, b) = fitted[0].1.zip(fitted[1].1).filter(|(a, b)| a.is_plain() && b.is_plain())?;
    let rotors = fitted.map(|(rotor, _)| rotor);
    let answers = Answers::of(rotors, [a, b], THRESHOLDS.log_mismatch_pole_share, full_voltage)?;
    let rates = rates_in_common(rotors, [a, b], full_voltage);
    let names = rotors.map(|rotor| rotor.source());
    with_differences(Finding::new("rotor_mismatch_between_logs", ""), names, rates, &answers)
}

/// Where both were commanded the same, and where they differ by more than what the battery may have taken from one of them: k_V is
/// not known yet.
fn rates_in_common(
    rotors: [&RotorLog; 2],
    follows: [&SingleRotorFit; 2],
    full_voltage: f64,
) -> Option<Rates> {
    let [(low, high), (other_low, other_high)] = follows.map(|follows| follows.range);
    let common = (low.max(other_low), high.min(other_high));
    if common.1 - common.0 < THRESHOLDS.common_range_share * (high - low).min(other_high - other_low) {
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
    let taken = THRESHOLDS.voltage_power * rates[0].value.abs() * (one - other).abs() / volts;
    let is_more = (rates[0].value - rates[1].value).abs() > taken;
    (is_more && differ(&rates, THRESHOLDS.log_mismatch_rate_share)).then_some((command, rates))
}

/// A command [-], and the rates [rad/s] of both rotors there.
type Rates = (f64, [Estimate; 2]);

/// At the mean command and charge of both.
fn moving_rates(rotors: [&RotorLog; 2], follows: [&SingleRotorFit; 2], full_voltage: f64) -> Option<Rates> {
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
    fn of(
        rotors: [&RotorLog; 2],
        follows: [&SingleRotorFit; 2],
        share: f64,
        full_voltage: f64,
    ) -> Option<Self> {
        let plain =
            |it: &SingleRotorFit| Estimate { value: it.fit.pole, standard_error: it.fit.pole_error() };
        if !differ(&follows.map(plain), share) {
            return Some(Self::default());
        }
        let parts = excited_part(rotors[0]).zip(excited_part(rotors[1]))?;
        let parts = [&parts.0, &parts.1];
        let delayed = [0, 1].map(|at| delay(parts[at], &follows[at].fit, full_voltage));
        let pole = |at: usize| {
            let pole = plain(follows[at]);
            Estimate { value: delayed[at].as_ref().map_or(pole.value, |it| it.pole), ..pole }
        };
        let none = Estimate { value: 0.0, standard_error: 0.0 };
        let delays = [0, 1].map(|at| delayed[at].as_ref().map_or(none, |it| it.time.scaled(1e3)));
        let those = |both: [Estimate; 2]| differ(&both, share).then_some(both);
        Some(Self { poles: those([0, 1].map(pole)), delays: those(delays) })
    }
}

/// The delay with which a rotor answers, where its log asks for one.
fn delay(part: &RotorLog, lag: &LagFit, full_voltage: f64) -> Option<LagAlternative> {
    let part = std::slice::from_ref(part);
    let tried = if lag.coefficients.len() > 2 {
        lag_order::both(lag, part, |part, delay| {
            record_of(part, full_voltage, delay, |u, drop| [u, u * u, -drop])
        })
    } else {
        lag_order::both(lag, part, |part, delay| record_of(part, full_voltage, delay, |u, _| [u, u * u]))
    };
    tried.into_iter().find(|it| it.term == Term::DeadTime && it.needed && it.clear)
}

/// Whether two numbers differ plainly, and by more than that share.
fn differ([a, b]: &[Estimate; 2], share: f64) -> bool {
    let apart = (a.value - b.value).abs();
    let sigma = a.standard_error.hypot(b.standard_error);
    apart > THRESHOLDS.mismatch_errors * sigma && apart > share * a.value.abs().min(b.value.abs())
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
    if rows.len() < THRESHOLDS.fewest_steady_rows {
        return None;
    }
    let apart: Vec<f64> = rows.iter().map(|&row| one.command[row] - other.command[row]).collect();
    let (low, high) = bounds(&apart);
    let difference = rows.iter().map(|&row| one.rate[row] - other.rate[row]);
    let difference = DVector::from_iterator(rows.len(), difference);
    // At equal commands, and not beyond those that were sent: a curve of degree two takes up how they differ.
    let of = |columns: usize| {
        let sum = |at: usize| one.command[rows[at]] + other.command[rows[at]];
        let entry = |at: usize, column: usize| [1.0, apart[at], apart[at] * sum(at)][column];
        least_squares::least_squares(&DMatrix::from_fn(rows.len(), columns, entry), &difference)
    };
    let fit = if low.abs().max(high.abs()) < THRESHOLDS.same_command {
        of(1)?
    } else if high - low > THRESHOLDS.apart_spread && low <= 0.0 && high >= 0.0 {
        of(3).or_else(|| of(2))?
    } else {
        return None;
    };
    let mean = |column: &[f64]| mean_of(rows.iter().map(|&row| column[row]));
    // The error of the difference is all that counts: half of its variance to each.
    let error = fit.standard_error(0) / std::f64::consts::SQRT_2;
    let rate = mean(&other.rate);
    let rates = [rate + fit.coefficients[0], rate].map(|value| Estimate { value, standard_error: error });
    Some((mean(&other.command), rates))
}

/// `found` with what differs; `None` where nothing does.
fn with_differences(
    found: Finding,
    names: [String; 2],
    rates: Option<Rates>,
    answers: &Answers,
) -> Option<Finding> {
    if rates.is_none() && answers.delays.is_none() && answers.poles.is_none() {
        return None;
    }
    let command = rates.map(|(command, _)| command);
    let mut found = found.with("names", names.to_vec());
    if let Some(command) = command {
        found = found.with("command", command);
    }
    for (values, errors, both) in [
        ("rates_rad_s", "rate_errors_rad_s", rates.map(|(_, rates)| rates)),
        ("delays_ms", "delay_errors_ms", answers.delays),
        ("poles_rad_s", "pole_errors_rad_s", answers.poles),
    ] {
        let Some(both) = both else { continue };
        found = found.with(values, both.map(|it| it.value).to_vec());
        found = found.with(errors, both.map(|it| it.standard_error).to_vec());
    }
    Some(found)
}
