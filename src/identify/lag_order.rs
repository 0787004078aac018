//! Alternatives to the first-order lag: a transport delay before it, or a second pole behind it.

use super::thresholds::THRESHOLDS;
use serde::Serialize;

use super::Estimate;
use super::regressors::NO_DELAY;
use crate::effect::{self, Card, Site, Term};
use crate::estimation::autocorrelation::variance_inflation;
use crate::estimation::golden_section::{golden, least};
use crate::estimation::two_poles::two_pole_cost;
use crate::estimation::variable_projection::{self, LagFit, Record};
use crate::screening::rotor_data::RotorLog;

/// An alternative model of the same record.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct LagAlternative {
    /// Its effect in the catalogue.
    pub effect: &'static str,
    /// What that effect is: a dead time or a second lag.
    #[serde(skip)]
    pub term: Term,
    /// [s] delay, or time constant of the second pole.
    pub time: Estimate,
    /// [rad/s] pole beside it.
    pub pole: f64,
    /// [rad/s] rms error left; the first-order lag's is in [`super::PoleFit`].
    pub residual_rms: f64,
    /// Whether the data ask for it.
    pub needed: bool,
    /// Whether they prefer it to every other alternative.
    pub clear: bool,
}

/// Both alternatives on the first `alternative_rows` rows of each log: `record(rotors, τ)` is the record of `rotors`
/// with commands delayed by τ.
pub(crate) fn both<const M: usize>(
    whole: &LagFit,
    rotors: &[RotorLog],
    record: impl Fn(&[RotorLog], f64) -> Record<M>,
) -> Vec<LagAlternative> {
    let heads: Vec<RotorLog> = rotors.iter().map(|rotor| rotor.head(THRESHOLDS.alternative_rows)).collect();
    let interval = rotors.first().map_or(0.0, |rotor| rotor.interval);
    let unknown = delay_unknown(rotors);
    let record = |delay: f64| record(&heads, delay);
    let head = record(NO_DELAY);
    let Some(lag) = variable_projection::fit_from(&head, whole.pole) else { return Vec::new() };
    let delayed = delay(&lag, (interval, unknown), record);
    let mut alternatives: Vec<LagAlternative> =
        delayed.into_iter().chain(second_order(&lag, &head, unknown)).filter(is_of_rotor).collect();
    let least = |but: usize| {
        let others = alternatives.iter().enumerate().filter(|(index, _)| *index != but);
        others.map(|(_, alternative)| alternative.residual_rms).fold(lag.residual_rms, f64::min)
    };
    let clear: Vec<bool> =
        (0..alternatives.len()).map(|index| is_clear(&alternatives[index], least(index), &lag)).collect();
    alternatives.iter_mut().zip(clear).for_each(|(alternative, clear)| alternative.clear = clear);
    // As errors over the whole record, so that they can be read beside that of the lag alone.
    alternatives
        .iter_mut()
        .for_each(|alternative| alternative.residual_rms *= whole.residual_rms / lag.residual_rms);
    alternatives
}

/// Whether the lag beside it is a rotor's: where little moves, a fit may end at one that takes hours.
fn is_of_rotor(alternative: &LagAlternative) -> bool {
    alternative.pole >= THRESHOLDS.slowest_pole && alternative.residual_rms.is_finite()
}

/// [s] by what a dead time is not known where commands step between rows; a second lag, much of which is one, neither.
pub(crate) fn delay_unknown(rotors: &[RotorLog]) -> f64 {
    rotors.iter().map(|rotor| rotor.delay_unknown).fold(0.0, f64::max)
}

/// [s] standard deviation of the instant of each step before the rates are asked, where commands step between rows.
pub(crate) fn step_deviation(rotors: &[RotorLog]) -> Option<f64> {
    let between = rotors.iter().filter(|rotor| rotor.command_from.is_some());
    between.map(|rotor| rotor.interval / 12.0_f64.sqrt()).reduce(f64::max)
}

/// Whether an alternative stands out: each standard error by which the next best is worse raises the cost by the variance of
/// the noise, of what is left with the alternative itself.
fn is_clear(alternative: &LagAlternative, next: f64, lag: &LagFit) -> bool {
    let raised = lag.samples as f64 * ((next / alternative.residual_rms).powi(2) - 1.0);
    raised > THRESHOLDS.alternative_errors * THRESHOLDS.alternative_errors
}

/// The effect that is a dead time before the rotor.
pub(crate) fn dead_time_effect() -> Option<&'static Card> {
    effect::acting_as(Site::Command, Term::DeadTime)
}

/// Fits a delay in front of the lag.
fn delay<const M: usize>(
    lag: &LagFit,
    (interval, unknown): (f64, f64),
    record: impl Fn(f64) -> Record<M>,
) -> Option<LagAlternative> {
    let fit = |delay: f64| variable_projection::fit_from(&record(delay), lag.pole);
    let cost =
        |delay: f64| fit(delay).map_or(f64::INFINITY, |fit| fit.residual_rms.powi(2) * fit.samples as f64);
    let step = 0.5 * interval;
    let coarse =
        least((0..=THRESHOLDS.longest_delay).map(|index| (index as f64 * step).max(NO_DELAY)), cost)?;
    let (time, least) = golden(cost, (coarse - step).max(NO_DELAY), coarse + step);
    alternative(
        dead_time_effect()?,
        time,
        least,
        lag,
        fit(time)?.pole,
        cost,
        (interval * THRESHOLDS.curvature_reach, unknown),
    )
}

/// Fits a second pole behind the first.
fn second_order<const M: usize>(lag: &LagFit, record: &Record<M>, unknown: f64) -> Option<LagAlternative> {
    // With the fast time constant given, the slower pole keeps the sum of both times near that of one lag.
    let best = |time: f64| {
        let centre = 1.0 / (1.0 / lag.pole - time).max(THRESHOLDS.least_slow_time / lag.pole);
        let (low, high) = THRESHOLDS.slow_pole_bracket;
        let high = (high * centre).min(THRESHOLDS.poles_apart / time);
        golden(|pole| two_pole_cost(record, pole, 1.0 / time), low * centre, high)
    };
    let ratio = THRESHOLDS.fast_time_ratio;
    let times =
        (0..THRESHOLDS.fast_times).map(|power| THRESHOLDS.least_fast_time / lag.pole * ratio.powi(power));
    let coarse = least(times, |time| best(time).1)?;
    let longest = THRESHOLDS.most_fast_time / lag.pole;
    let (log_time, least) =
        golden(|log| best(log.exp()).1, (coarse / ratio).ln(), (coarse * ratio).min(longest).ln());
    let time = log_time.exp();
    let card = effect::acting_as(Site::SteadyRate, Term::Lag)?;
    let reach = THRESHOLDS.curvature_reach * time;
    alternative(card, time, least, lag, best(time).0, |time| best(time).1, (reach, unknown))
}

/// Judges an alternative by its parameter's standard error, from the curvature of the cost around it and stretched by
/// the correlation of the residual; what of it is `unknown` [s] in any case is in it, too.
fn alternative(
    card: &'static Card,
    time: f64,
    least: f64,
    first_order: &LagFit,
    pole: f64,
    cost: impl Fn(f64) -> f64,
    (reach, unknown): (f64, f64),
) -> Option<LagAlternative> {
    let samples = first_order.samples as f64;
    let curvature = ((cost(time + reach) - least) / (reach * reach)).max(f64::MIN_POSITIVE);
    let correlation = first_order.residual_correlation.clamp(0.0, THRESHOLDS.most_correlated);
    let stretch = variance_inflation(correlation).sqrt();
    let standard_error = (stretch * (least / samples / curvature).sqrt()).hypot(unknown);
    let residual_rms = (least / samples).sqrt();
    let needed = time > THRESHOLDS.alternative_errors * standard_error
        && residual_rms < (1.0 - THRESHOLDS.alternative_gain) * first_order.residual_rms;
    let time = Estimate { value: time, standard_error };
    let term = card.acts_as?;
    Some(LagAlternative { effect: card.id, term, time, pole, residual_rms, needed, clear: false })
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    /// Two poles, integrated by Euler in steps a thousand times finer than the sampling, and noise.
    fn two_poles(slow: f64, fast: f64) -> Record<1> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let (mut first, mut second) = (600.0, 600.0);
        let whole = std::iter::once(0..6000).collect();
        let mut record = Record { time: vec![], output: vec![], inputs: vec![], segments: whole };
        for row in 0..6000 {
            let noise: f64 = random.sample(StandardNormal);
            let input = if random.random::<bool>() { 700.0 } else { 500.0 };
            record.time.push(f64::from(row) * 0.02);
            record.output.push(second + 1.5 * noise);
            record.inputs.push([input]);
            for _ in 0..1000 {
                first += 2e-5 * slow * (input - first);
                second += 2e-5 * fast * (first - second);
            }
        }
        record
    }

    #[test]
    fn a_second_pole_is_found_and_a_first_order_lag_is_left_alone() {
        let record = two_poles(16.0, 80.0);
        let alternative = second_order(&variable_projection::fit(&record).unwrap(), &record, 0.0).unwrap();
        assert!(alternative.needed);
        assert!(alternative.time.distance(1.0 / 80.0) < 3.5, "{alternative:?}");
        let record = two_poles(16.0, 40_000.0);
        assert!(!second_order(&variable_projection::fit(&record).unwrap(), &record, 0.0).unwrap().needed);
    }

    /// Where little moves, the lag beside a dead time may take hours: no rotor's.
    #[test]
    fn an_alternative_whose_lag_is_no_rotors_is_none() {
        let beside = |pole: f64, residual_rms: f64| LagAlternative {
            effect: "transport_delay",
            term: Term::DeadTime,
            time: Estimate { value: 0.01, standard_error: 0.001 },
            pole,
            residual_rms,
            needed: false,
            clear: false,
        };
        assert!(is_of_rotor(&beside(16.0, 1.5)));
        assert!(!is_of_rotor(&beside(0.9 * THRESHOLDS.slowest_pole, 1.5)));
        assert!(!is_of_rotor(&beside(f64::NAN, 1.5)) && !is_of_rotor(&beside(16.0, f64::NAN)));
    }
}
