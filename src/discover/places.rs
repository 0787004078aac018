//! Where a law may act: the sites, each with the channels that it may look at. A smooth function of them, without a formula, says how
//! much of the error a law there could explain at most.

use super::channels::{LawInput, Outlook};
use super::law::{CandidateLaw, LawTerm, TermPart};
use super::linear::{FittedAndHeldOut, LinearizedBlock, Score};
use super::thresholds::THRESHOLDS;
use crate::effect::{Site, signals};
use crate::threads::spread;

/// A site, and the channels that a law looks at there.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    pub site: Site,
    pub channels: Vec<LawInput>,
    /// In the unit of its one channel, where a law looks at which way that went last, too: half of the way back after which it has
    /// gone the other way. `None`: where the channel is says all.
    pub way: Option<f64>,
}

/// What a smooth function does at a place.
#[derive(Debug, Clone)]
pub(crate) struct PlaceScore {
    pub place: Place,
    /// The function: hats over its knots.
    pub law: CandidateLaw,
    pub score: Score,
}

impl Place {
    /// Those of a site, of one channel each, and of two.
    pub fn all(outlooks: &[Outlook], is_two: bool) -> Vec<Self> {
        let of = |outlook: &Outlook| {
            let lasting: Vec<&LawInput> =
                outlook.channels.iter().filter(|channel| !channel.is_time()).collect();
            let one = lasting.iter().map(|channel| vec![(*channel).clone()]);
            let two = lasting.iter().enumerate().flat_map(|(index, first)| {
                lasting[index + 1..].iter().map(move |second| vec![(*first).clone(), (*second).clone()])
            });
            let sets: Vec<Vec<LawInput>> = if is_two { two.collect() } else { one.collect() };
            sets.into_iter().map(|channels| Self::of(outlook.site, channels)).collect::<Vec<_>>()
        };
        outlooks.iter().flat_map(of).collect()
    }

    /// A site, and channels whose values say all.
    pub fn of(site: Site, channels: Vec<LawInput>) -> Self {
        Self { site, channels, way: None }
    }

    /// Those at which a law may remember which way its channel went, over several widths.
    pub fn by_way(outlooks: &[Outlook]) -> Vec<Self> {
        let seen = |site: Site| match site {
            Site::SteadyRate => Some(signals::COMMAND),
            Site::Torque => Some(signals::BODY_ANGLE),
            _ => None,
        };
        let of = |outlook: &Outlook| {
            let channel = outlook.channels.iter().find(|channel| Some(channel.signal) == seen(outlook.site));
            let (site, channel) = (outlook.site, channel.cloned());
            THRESHOLDS.ways.into_iter().filter_map(move |share| {
                let channel = channel.clone()?;
                let way = Some(share * channel.range());
                Some(Self { site, channels: vec![channel], way })
            })
        };
        outlooks.iter().flat_map(of).collect()
    }

    /// Whether it is the same but for which way its channel went.
    pub fn is_place_of(&self, site: Site, channels: &[&LawInput]) -> bool {
        let has = |own: &&LawInput| self.channels.iter().any(|it| it.signal == own.signal);
        self.site == site && self.channels.len() == channels.len() && channels.iter().all(has)
    }

    /// A function of its channels that is linear between knots.
    pub fn shape(&self, knots: usize) -> CandidateLaw {
        let parts = match &self.channels[..] {
            [only] => (0..knots).map(|knot| hat("$x", only, knot, knots)).collect::<Vec<_>>(),
            [first, second, ..] => {
                let both = (0..knots * knots).map(|index| {
                    let (one, two) = (index % knots, index / knots);
                    format!("{}*{}", bare_hat("$x", first, one, knots), bare_hat("$y", second, two, knots))
                });
                both.collect()
            }
            [] => Vec::new(),
        };
        let part = |text: String| TermPart { text: text.into(), powers: [0.0, 0.0] };
        let parts = parts.into_iter().map(part).collect();
        let channels = self.channels.clone();
        let plain = LawTerm { form: "shape", parts, inner: Vec::new(), channels, times: None };
        // From minus one, where the channel comes down, to one, where it rises.
        let by_way = self.way.map(|way| {
            let times = Some(format!("(($x-play($x,{way}))/{way})"));
            LawTerm { times, ..plain.clone() }
        });
        CandidateLaw { site: self.site, terms: [plain].into_iter().chain(by_way).collect() }
    }
}

/// [unit of the channel] where a knot is.
pub(crate) fn knot_at(channel: &LawInput, knot: usize, knots: usize) -> f64 {
    channel.low + channel.range() * knot as f64 / (knots - 1) as f64
}

/// The hat over a knot: one there, none at the next ones, and beyond the ends as at the ends.
fn hat(variable: &str, channel: &LawInput, knot: usize, knots: usize) -> String {
    bare_hat(&format!("min(max({variable},{}),{})", channel.low, channel.high), channel, knot, knots)
}

/// The same, none beyond the ends: an expression has no room for more of two channels.
fn bare_hat(variable: &str, channel: &LawInput, knot: usize, knots: usize) -> String {
    let step = channel.range() / (knots - 1) as f64;
    format!("max(0,1-abs({variable}-{})/{step})", knot_at(channel, knot, knots))
}

/// Smooth functions at every place of one channel, the best first, and what is there without one.
pub(crate) fn scores(linear: &LinearizedBlock, places: &[Place]) -> Vec<PlaceScore> {
    let found = spread(places, |place| {
        if place.channels.len() > 1 {
            return with_knots(linear, place, THRESHOLDS.pair_knots);
        }
        if place.way.is_some() {
            return with_knots(linear, place, THRESHOLDS.coarse_knots);
        }
        let coarse = with_knots(linear, place, THRESHOLDS.coarse_knots);
        let fine = with_knots(linear, place, THRESHOLDS.fine_knots);
        let is_finer = |coarse: &PlaceScore, fine: &PlaceScore| {
            fine.score.held_out < (1.0 - THRESHOLDS.fine_gain) * coarse.score.held_out
        };
        match (coarse, fine) {
            (Some(coarse), Some(fine)) => Some(if is_finer(&coarse, &fine) { fine } else { coarse }),
            (coarse, fine) => coarse.or(fine),
        }
    });
    let mut found: Vec<PlaceScore> = found.into_iter().flatten().collect();
    found.sort_by(|a, b| a.score.held_out.total_cmp(&b.score.held_out));
    found
}

fn with_knots(linear: &LinearizedBlock, place: &Place, knots: usize) -> Option<PlaceScore> {
    let law = place.shape(knots);
    let columns = columns_of_parts(linear, &law);
    let score = linear.score(&columns, THRESHOLDS.ridge)?;
    Some(PlaceScore { place: place.clone(), law, score })
}

/// The columns of each part by itself: a run with all parts in it costs as much as each of them. A part that no row comes near to moves
/// nothing.
fn columns_of_parts(linear: &LinearizedBlock, law: &CandidateLaw) -> Vec<FittedAndHeldOut> {
    let of = |term: &LawTerm, part: &TermPart| {
        let term = LawTerm { parts: vec![part.clone()], ..term.clone() };
        let column = linear.columns(&CandidateLaw { site: law.site, terms: vec![term] });
        column.and_then(|columns| columns.into_iter().next()).unwrap_or_else(|| linear.nothing())
    };
    law.terms.iter().flat_map(|term| term.parts.iter().map(move |part| of(term, part))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{Expression, Point};

    /// As many knots as there are: an effect of the user's own that the program reads, which adds up to one within the range.
    #[test]
    fn a_shape_is_an_effect_that_parses_and_its_hats_add_up_to_one() {
        let channel =
            |signal, log, unit| LawInput { signal, log, unit, low: -0.4, high: 0.5, is_signed: true };
        let angle = channel("body_angle", "body_angle_rad", "rad");
        let rate = channel("body_rate", "body_rate_rad_s", "rad/s");
        for (channels, knots) in
            [(vec![angle.clone()], THRESHOLDS.fine_knots), (vec![angle, rate], THRESHOLDS.pair_knots)]
        {
            let law = Place::of(Site::Torque, channels).shape(knots);
            let user = law.user_effect("a_shape", &vec![1.0; law.coefficients()]);
            let names: Vec<&str> = user.parameters.iter().map(|it| it.name.as_str()).collect();
            let expression = Expression::parse(&user.expression, &names).expect("it parses");
            for (body_angle, body_rate) in [(-0.4, 0.5), (-0.333, 0.1), (0.0, 0.0), (0.41, -0.399)] {
                let point = Point { body_angle, body_rate, ..Point::default() };
                let sum = expression.value(&vec![1.0; law.coefficients()], &point);
                assert!((sum - 1.0).abs() < 1e-9, "{body_angle}, {body_rate}: {sum}");
            }
        }
    }

    /// On the way up it is the first function and the second, on the way down the first less the second.
    #[test]
    fn a_shape_by_the_way_is_an_effect_that_parses_and_has_two_values_at_a_place() {
        let angle = LawInput {
            signal: "body_angle",
            log: "body_angle_rad",
            unit: "rad",
            low: -0.4,
            high: 0.5,
            is_signed: true,
        };
        let outlooks = [Outlook { site: Site::Torque, channels: vec![angle] }];
        let places = Place::by_way(&outlooks);
        assert_eq!(places.len(), THRESHOLDS.ways.len());
        for place in places {
            let knots = THRESHOLDS.coarse_knots;
            let law = place.shape(knots);
            assert_eq!(law.coefficients(), 2 * knots);
            let coefficients: Vec<f64> =
                (0..2 * knots).map(|at| if at < knots { 1.0 } else { 0.25 }).collect();
            let user = law.user_effect("a_shape", &coefficients);
            let names: Vec<&str> = user.parameters.iter().map(|it| it.name.as_str()).collect();
            let expression = Expression::parse(&user.expression, &names).expect("it parses");
            let way = place.way.expect("a width");
            for (direction, expected) in [(1.0, 1.25), (-1.0, 0.75), (0.0, 1.0)] {
                let (body_angle, memory) = (0.1, Some(0.1 - direction * way));
                let point = Point { body_angle, memory, ..Point::default() };
                let value = expression.value(&coefficients, &point);
                assert!((value - expected).abs() < 1e-9, "{direction}: {value}");
            }
        }
    }
}
