//! The library: functions as an engineer writes them, of one channel and of two, each at the inner numbers from which a fit of it
//! may start.

use super::channels::LawInput;
use super::law::{Inner, LawTerm, TermPart, over};
use super::thresholds::THRESHOLDS;
use crate::effect::Site;

fn part(text: &'static str, x: f64, y: f64) -> TermPart {
    TermPart { text: text.into(), powers: [x, y] }
}

/// A number in a unit that is the channel's to a power; values are tried twice `step` apart.
fn inner(
    letter: char,
    (value, step): (f64, f64),
    bounds: (f64, f64),
    (channel, power): (&LawInput, f64),
) -> Inner {
    Inner { letter, value, step, bounds, unit: over("-", &[(channel.unit, -power)]) }
}

/// A size that is tried at values of which each is some times the one before.
fn sized(value: f64) -> (f64, f64) {
    (value, 0.5 * value)
}

/// Terms of one channel; `lines` [rad/s] are frequencies that the residual has.
pub(crate) fn of_one(channel: &LawInput, lines: &[f64]) -> Vec<LawTerm> {
    let term = |form: &'static str, parts: Vec<TermPart>, inner: Vec<Inner>| LawTerm {
        form,
        parts,
        inner,
        channels: vec![channel.clone()],
        times: None,
    };
    if channel.is_time() {
        return of_time(channel, lines, &term);
    }
    let mut terms = vec![
        term("linear", vec![part("$x", 1.0, 0.0)], Vec::new()),
        term("square", vec![part("$x^2", 2.0, 0.0)], Vec::new()),
        term("cube", vec![part("$x^3", 3.0, 0.0)], Vec::new()),
    ];
    if channel.is_signed {
        terms.extend(of_signed(channel, &term));
    }
    terms.extend(of_range(channel, &term));
    terms.extend(waves(channel, &term));
    terms
}

type MakeTerm<'a> = &'a dyn Fn(&'static str, Vec<TermPart>, Vec<Inner>) -> LawTerm;

fn of_time(channel: &LawInput, lines: &[f64], term: MakeTerm) -> Vec<LawTerm> {
    let range = channel.range();
    let mut terms = vec![term("drift", vec![part("$x", 1.0, 0.0)], Vec::new())];
    // The clock of a log need not begin when the drift did.
    let since = inner('a', (0.0, range), (-10.0 * range, 10.0 * range), (channel, 1.0));
    terms.push(term("drift_since", vec![part("($x-$a)", 1.0, 0.0)], vec![since]));
    terms.extend(THRESHOLDS.warm_ups.iter().map(|share| {
        let inner = inner('a', sized(share * range), (1e-3 * range, 3.0 * range), (channel, 1.0));
        term("warm_up", vec![part("exp(-$x/$a)", 0.0, 0.0)], vec![inner])
    }));
    terms.extend(lines.iter().map(|line| {
        let inner = inner('w', (*line, 1.0 / range), (0.9 * line, 1.1 * line), (channel, -1.0));
        term("line", vec![part("sin($w*$x)", 0.0, 0.0), part("cos($w*$x)", 0.0, 0.0)], vec![inner])
    }));
    terms
}

/// Of a channel with two sides.
fn of_signed(channel: &LawInput, term: MakeTerm) -> Vec<LawTerm> {
    let size = channel.size();
    let mut terms = vec![
        term("absolute", vec![part("abs($x)", 1.0, 0.0)], Vec::new()),
        term("signed_square", vec![part("$x*abs($x)", 2.0, 0.0)], Vec::new()),
        term("root", vec![part("signum($x)*sqrt(abs($x))", 0.5, 0.0)], Vec::new()),
        term("signed_root_cube", vec![part("$x*sqrt(abs($x))", 1.5, 0.0)], Vec::new()),
    ];
    for width in THRESHOLDS.widths {
        let a = inner('a', sized(width * size), (1e-3 * size, 5.0 * size), (channel, 1.0));
        terms.push(term("saturation", vec![part("tanh($x/$a)", 0.0, 0.0)], vec![a.clone()]));
        let b = inner('b', sized(3.0 * width * size), (1e-2 * size, 5.0 * size), (channel, 1.0));
        let sharp =
            Inner { value: THRESHOLDS.widths[0] * size, step: 0.5 * THRESHOLDS.widths[0] * size, ..a };
        terms.push(term("stribeck", vec![part("tanh($x/$a)*exp(-($x/$b)^2)", 0.0, 0.0)], vec![sharp, b]));
    }
    for share in THRESHOLDS.places {
        let a = inner('a', (share * size, 0.05 * size), (0.0, size), (channel, 1.0));
        let text = "signum($x)*max(abs($x)-$a,0)";
        terms.push(term("dead_zone", vec![part(text, 1.0, 0.0)], vec![a]));
    }
    terms
}

/// Of a place in a channel's range.
fn of_range(channel: &LawInput, term: MakeTerm) -> Vec<LawTerm> {
    let (low, range) = (channel.low, channel.range());
    let mut terms = Vec::new();
    for share in THRESHOLDS.places {
        let a = inner('a', (low + share * range, 0.05 * range), (low, channel.high), (channel, 1.0));
        terms.push(term("rising_ramp", vec![part("max($x-$a,0)", 1.0, 0.0)], vec![a.clone()]));
        terms.push(term("falling_ramp", vec![part("max($a-$x,0)", 1.0, 0.0)], vec![a.clone()]));
        let b = inner('b', sized(0.02 * range), (1e-3 * range, 0.3 * range), (channel, 1.0));
        let text = "(0.5+0.5*tanh(($x-$a)/$b))";
        terms.push(term("threshold", vec![part(text, 0.0, 0.0)], vec![a.clone(), b]));
        for width in THRESHOLDS.peaks {
            let b = inner('b', sized(width * range), (5e-3 * range, range), (channel, 1.0));
            let text = "exp(-(($x-$a)/$b)^2)";
            terms.push(term("peak", vec![part(text, 0.0, 0.0)], vec![a.clone(), b]));
        }
    }
    terms
}

/// Waves over a channel, of any phase; of a channel with two sides odd and even ones, too.
fn waves(channel: &LawInput, term: MakeTerm) -> Vec<LawTerm> {
    let mut terms = Vec::new();
    for step in THRESHOLDS.waves.0..THRESHOLDS.waves.1 {
        let number = 2.0 * THRESHOLDS.phase_step * step as f64 / channel.range();
        let n = inner(
            'n',
            (number, THRESHOLDS.phase_step / channel.range()),
            (0.5 * number, 1.5 * number),
            (channel, -1.0),
        );
        let (sine, cosine) = (part("sin($n*$x)", 0.0, 0.0), part("cos($n*$x)", 0.0, 0.0));
        terms.push(term("wave", vec![sine.clone(), cosine.clone()], vec![n.clone()]));
        if channel.is_signed {
            terms.push(term("sine", vec![sine], vec![n.clone()]));
            terms.push(term("cosine", vec![cosine], vec![n]));
        }
    }
    terms
}

/// Terms of two channels, the second of which counts as it is.
pub(crate) fn of_two(first: &LawInput, second: &LawInput) -> Vec<LawTerm> {
    let term = |form: &'static str, text: &'static str, powers: [f64; 2], inner: Vec<Inner>| LawTerm {
        form,
        parts: vec![TermPart { text: text.into(), powers }],
        inner,
        channels: vec![first.clone(), second.clone()],
        times: None,
    };
    let mut terms = vec![
        term("product", "$x*$y", [1.0, 1.0], Vec::new()),
        term("product_of_square", "$x^2*$y", [2.0, 1.0], Vec::new()),
    ];
    if first.is_signed {
        terms.push(term("product_of_absolute", "abs($x)*$y", [1.0, 1.0], Vec::new()));
        let size = first.size();
        for width in THRESHOLDS.widths {
            let a = inner('a', sized(width * size), (1e-3 * size, 5.0 * size), (first, 1.0));
            terms.push(term("product_of_saturation", "tanh($x/$a)*$y", [0.0, 1.0], vec![a.clone()]));
            terms.push(term("product_of_peak", "exp(-($x/$a)^2)*$y", [0.0, 1.0], vec![a]));
        }
        for share in THRESHOLDS.places {
            let a = inner('a', (share * size, 0.05 * size), (0.0, size), (first, 1.0));
            terms.push(term("product_of_dead_zone", "max(abs($x)-$a,0)*$y", [1.0, 1.0], vec![a]));
        }
    }
    for share in THRESHOLDS.places {
        let a = inner(
            'a',
            (first.low + share * first.range(), 0.05 * first.range()),
            (first.low, first.high),
            (first, 1.0),
        );
        terms.push(term("product_of_ramp", "max($x-$a,0)*$y", [1.0, 1.0], vec![a]));
    }
    terms
}

/// Terms that remember where a channel was, of any law at `site` that may.
pub(crate) fn of_memory(site: Site, channel: &LawInput) -> Vec<LawTerm> {
    let term = |form: &'static str, text: &'static str, inner: Inner| LawTerm {
        form,
        parts: vec![part(text, 1.0, 0.0)],
        inner: vec![inner],
        channels: vec![channel.clone()],
        times: None,
    };
    let range = channel.range();
    let play = |share: &f64| inner('a', sized(share * range), (1e-4 * range, 0.5 * range), (channel, 1.0));
    match site {
        Site::Command => {
            THRESHOLDS.plays.iter().map(|share| term("play", "(play($x,$a)-$x)", play(share))).collect()
        }
        Site::Torque => {
            let plays =
                THRESHOLDS.plays.iter().map(|share| term("hysteresis", "(play($x,$a)-$x)", play(share)));
            plays.chain(relays(channel)).collect()
        }
        Site::SteadyRate => {
            let lag = |span: &f64| Inner {
                letter: 'a',
                value: *span,
                step: 0.5 * span,
                bounds: THRESHOLDS.lag_spans_within_s,
                unit: "s".to_owned(),
            };
            let lags = THRESHOLDS.lag_spans_s.iter();
            lags.map(|span| term("creep", "(lag($x,$a)-$x)", lag(span))).chain(relays(channel)).collect()
        }
        _ => Vec::new(),
    }
}

/// Two levels, one of which holds from a threshold on until the channel is back at another one.
fn relays(channel: &LawInput) -> impl Iterator<Item = LawTerm> {
    let (low, range) = (channel.low, channel.range());
    let place = move |share: f64| {
        inner('b', (low + share * range, 0.05 * range), (low, channel.high), (channel, 1.0))
    };
    let width =
        move |share: f64| inner('a', sized(share * range), (1e-4 * range, 0.5 * range), (channel, 1.0));
    let relay = move |(at, half): (f64, f64)| LawTerm {
        form: "relay",
        parts: vec![part("relay($x-$b,$a)", 0.0, 0.0)],
        inner: vec![width(half), place(at)],
        channels: vec![channel.clone()],
        times: None,
    };
    let places = THRESHOLDS.places.into_iter();
    places.flat_map(|at| THRESHOLDS.relays.map(|half| (at, half))).map(relay)
}

#[cfg(test)]
mod tests {
    use super::super::law::CandidateLaw;
    use super::*;
    use crate::model::Model;

    /// Each becomes an effect of the user's own that the program reads, with a value wherever the logs are.
    #[test]
    fn every_term_is_an_effect_that_parses() {
        let channel =
            |signal, log, unit| LawInput { signal, log, unit, low: -0.4, high: 0.5, is_signed: true };
        let angle = channel("body_angle", "body_angle_rad", "rad");
        let rate = channel("body_rate", "body_rate_rad_s", "rad/s");
        let time = channel("time", "time_s", "s");
        let command = LawInput { low: 0.2, is_signed: false, ..channel("command", "command", "-") };
        let remembering = [(Site::Command, &command), (Site::SteadyRate, &command), (Site::Torque, &angle)];
        let remembering = remembering.map(|(site, channel)| (site, of_memory(site, channel)));
        let all = [of_one(&angle, &[]), of_one(&time, &[3.0]), of_two(&angle, &rate)].concat();
        assert!(all.len() > 200);
        let twice = all.into_iter().map(|term| (Site::Torque, vec![term.clone(), term]));
        let once = remembering
            .into_iter()
            .flat_map(|(site, terms)| terms.into_iter().map(move |it| (site, vec![it])));
        for (site, terms) in twice.chain(once) {
            let law = CandidateLaw { site, terms };
            let mut model = Model::paper();
            model.user_effects.push(law.user_effect("a_law", &vec![1.0; law.coefficients()]));
            let effect =
                model.effect("a_law").unwrap_or_else(|error| panic!("{}: {error}", law.expression()));
            assert_eq!(effect.parameters.len(), law.numbers(), "{}", law.expression());
            assert!(effect.parameters.iter().all(|it| !it.unit.is_empty()), "{effect:?}");
        }
    }
}
