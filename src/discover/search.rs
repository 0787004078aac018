//! The search: places, then formulas at the promising ones, then a second term.

use super::channels::{Channel, Outlook, outlooks};
use super::forms;
use super::formula::{Formula, Question, simplest};
use super::law::{Law, Term};
use super::linear::{Linear, Score};
use super::lines::lines;
use super::places::{Place, PlaceScore, confidence, scores};
use super::thresholds::THRESHOLDS;
use crate::diagnose::Event;
use crate::effect::Site;
use crate::model::Effect;
use crate::threads::spread;

/// What was found of a block.
pub(crate) struct Hit<'a> {
    /// With the fit that the law was added to.
    pub question: Question<'a>,
    /// The formula, refitted; and others that are the same to the data.
    pub formula: Option<Formula>,
    pub others: Vec<Formula>,
    /// Smooth functions at the places, the best first, and what is there without one.
    pub places: Vec<PlaceScore>,
    pub without: Option<Score>,
    /// How sure the place is that explains most.
    pub confidence: Option<f64>,
}

impl Hit<'_> {
    /// Whether a formula leaves little more than noise.
    fn reaches(&self) -> bool {
        let at_floor = self.question.found.at_floor();
        self.formula.as_ref().is_some_and(|it| self.question.over_floor(&it.fitted) <= at_floor)
    }

    fn loss(&self) -> f64 {
        self.formula.as_ref().map_or(f64::INFINITY, |it| self.question.loss(&it.fitted))
    }
}

/// Beside the refitted base; and where that does not come to the noise, beside what the catalogue explains a part with.
pub(crate) fn search<'a>(question: &Question<'a>, progress: &(dyn Fn(Event) + Sync)) -> Hit<'a> {
    let alone = from_start(*question, progress);
    if alone.reaches() || question.found.answer.effects.is_empty() {
        return alone;
    }
    let beside = from_start(Question { start: &question.found.answer, ..*question }, progress);
    // What needs effects of the catalogue beside it must do the better for them.
    let is_better = beside.loss() < (1.0 - THRESHOLDS.term_gain) * alone.loss();
    match beside.formula.as_ref().filter(|_| is_better) {
        Some(formula) => match without_effects(question, formula, &beside) {
            Some(plain) => {
                Hit { formula: Some(plain), others: Vec::new(), confidence: beside.confidence, ..alone }
            }
            None => beside,
        },
        None => alone,
    }
}

/// A formula that was found beside effects of the catalogue, refitted without them, where it does as well: they only stood in for it.
fn without_effects(question: &Question, formula: &Formula, beside: &Hit) -> Option<Formula> {
    let coefficients = formula.law.coefficients_in(&formula.fitted.model, question.id);
    let plain = question.refit(&formula.law, &coefficients)?;
    let limit = beside.loss() * (1.0 + question.tolerance(&formula.fitted).max(THRESHOLDS.term_gain));
    let gains = question.gains(question.start, &plain.fitted) && question.is_determined(&plain);
    (gains && question.loss(&plain.fitted) <= limit).then_some(plain)
}

fn from_start<'a>(question: Question<'a>, progress: &(dyn Fn(Event) + Sync)) -> Hit<'a> {
    let nothing = Hit {
        question,
        formula: None,
        others: Vec::new(),
        places: Vec::new(),
        without: None,
        confidence: None,
    };
    let names = question.free_names();
    let Some(linear) = Linear::new(question.split(), question.start, &names, question.known) else {
        return nothing;
    };
    let Some(without) = linear.without() else { return nothing };
    let outlooks = outlooks(&question.split().train);
    let places = places(&linear, &outlooks);
    let times = times(&outlooks);
    let promising = promising(&places, &without);
    let found_lines = lines(linear.residuals().0, linear.residuals().1);
    // Products of two channels show where a smooth function of both has too few rows for its knots.
    let pairs = Place::all(&outlooks, true);
    let tried: Vec<&Place> =
        promising.iter().map(|it| &it.place).filter(|it| it.channels.len() == 1).collect();
    let tried: Vec<&Place> = tried.into_iter().chain(&times).chain(&pairs).collect();
    let laws = [laws(&tried, &found_lines), remembering(&outlooks)].concat();
    let formulas = refitted(&question, &linear, &laws, progress);
    let (mut formula, mut others) = match simplest(&question, formulas) {
        Some((formula, others)) => (Some(formula), others),
        None => (None, Vec::new()),
    };
    for _ in 1..THRESHOLDS.most_terms {
        let Some(now) = formula.as_ref() else { break };
        if question.over_floor(&now.fitted) <= crate::diagnose::thresholds::THRESHOLDS.done_at_floor {
            break;
        }
        let Some((better, beside)) = with_one_more(&question, now, &tried, &found_lines, progress) else {
            break;
        };
        (formula, others) = (Some(better), beside);
    }
    let formula = formula.filter(|it| question.gains(question.start, &it.fitted));
    let confidence = how_sure(formula.as_ref(), &places);
    Hit { question, formula, others, places, without: Some(without), confidence }
}

/// Every place with its smooth function, the best first: those of two channels where the second pays.
fn places(linear: &Linear, outlooks: &[Outlook]) -> Vec<PlaceScore> {
    let mut places = scores(linear, &Place::all(outlooks, false));
    let pairs = scores(linear, &Place::all(outlooks, true));
    let best_single = places.first().map_or(f64::INFINITY, |place| place.score.held_out);
    let pays = |pair: &PlaceScore| pair.score.held_out < (1.0 - THRESHOLDS.pair_gain) * best_single;
    places.extend(pairs.into_iter().filter(pays));
    places.sort_by(|a, b| a.score.held_out.total_cmp(&b.score.held_out));
    places
}

/// Where laws over time may act: they have no shape that another log would share.
fn times(outlooks: &[Outlook]) -> Vec<Place> {
    let of = |outlook: &Outlook| {
        let time = outlook.channels.iter().find(|channel| channel.is_time())?;
        Some(Place { site: outlook.site, channels: vec![time.clone()] })
    };
    outlooks.iter().filter_map(of).collect()
}

/// The places whose formulas are tried.
fn promising<'a>(places: &'a [PlaceScore], without: &Score) -> Vec<&'a PlaceScore> {
    let gain = |place: &PlaceScore| without.held_out - place.score.held_out;
    let best = places.first().map_or(0.0, gain);
    let promising =
        places.iter().filter(|place| gain(place) > THRESHOLDS.promising_gain * best && best > 0.0);
    promising.take(THRESHOLDS.most_places).collect()
}

/// Laws of one term at the places.
fn laws(places: &[&Place], lines: &[f64]) -> Vec<Law> {
    let of = |place: &&Place| -> Vec<Law> {
        let terms: Vec<Term> = match &place.channels[..] {
            [only] => forms::of_one(only, lines),
            [first, second, ..] => [forms::of_two(first, second), forms::of_two(second, first)].concat(),
            [] => Vec::new(),
        };
        terms.into_iter().map(|term| Law { site: place.site, terms: vec![term] }).collect()
    };
    places.iter().flat_map(of).collect()
}

/// Laws that remember what the command was, or where the body has been.
fn remembering(outlooks: &[Outlook]) -> Vec<Law> {
    let of = |(site, signal): (Site, &str)| {
        let mut channels = outlooks.iter().flat_map(|outlook| &outlook.channels);
        let channel = channels.find(|channel| channel.signal == signal);
        let terms = channel.map_or_else(Vec::new, |channel| forms::of_memory(site, channel));
        terms.into_iter().map(move |term| Law { site, terms: vec![term] })
    };
    let all = [(Site::Command, "command"), (Site::SteadyRate, "command"), (Site::Torque, "body_angle")];
    all.into_iter().flat_map(of).collect()
}

/// The laws that do best in one step, the best of each form at each place, best first.
fn screened(linear: &Linear, laws: &[Law]) -> Vec<(Law, Score)> {
    let scored = spread(laws, |law| linear.score(&linear.columns(law)?, 0.0));
    let mut scored: Vec<(Law, Score)> =
        laws.iter().zip(scored).filter_map(|(law, score)| Some((law.clone(), score?))).collect();
    scored.sort_by(|a, b| a.1.loss().total_cmp(&b.1.loss()));
    let mut taken: Vec<(Site, Vec<&'static str>, &'static str)> = Vec::new();
    let signals = |law: &Law| law.terms[0].channels.iter().map(|it: &Channel| it.signal).collect::<Vec<_>>();
    scored.retain(|(law, _)| {
        let own = (law.site, signals(law), law.terms[0].form);
        let of_place = taken.iter().filter(|(site, signals, _)| *site == own.0 && *signals == own.1).count();
        let is_taken = !taken.contains(&own) && of_place < THRESHOLDS.most_of_place;
        if is_taken {
            taken.push(own);
        }
        is_taken
    });
    scored.truncate(THRESHOLDS.most_refitted);
    scored
}

fn refitted(
    question: &Question,
    linear: &Linear,
    laws: &[Law],
    progress: &(dyn Fn(Event) + Sync),
) -> Vec<Formula> {
    let formulas = spread(&screened(linear, laws), |(law, score)| {
        progress(Event::Fitted);
        question.refit(law, &score.coefficients)
    });
    formulas.into_iter().flatten().collect()
}

/// A formula with one more term at its site, where that gains enough; and others that are the same to the data.
fn with_one_more(
    question: &Question,
    now: &Formula,
    places: &[&Place],
    lines: &[f64],
    progress: &(dyn Fn(Event) + Sync),
) -> Option<(Formula, Vec<Formula>)> {
    let coefficients = now.law.coefficients_in(&now.fitted.model, question.id);
    let known: Vec<Effect> = [question.known, &[now.fitted.model.effect(question.id).ok()?]].concat();
    let linear = Linear::new(question.split(), &now.fitted, &now.fitted.names, &known)?;
    let here: Vec<&Place> = places.iter().filter(|place| place.site == now.law.site).copied().collect();
    let best = screened(&linear, &laws(&here, lines));
    let formulas = spread(&best, |(law, score)| {
        progress(Event::Fitted);
        let terms = [&now.law.terms[..], &law.terms[..]].concat();
        let coefficients = [&coefficients[..], &score.coefficients[..]].concat();
        question.refit(&Law { terms, ..now.law.clone() }, &coefficients)
    });
    let gains = |formula: &Formula| question.gains(&now.fitted, &formula.fitted);
    let formulas: Vec<Formula> = formulas.into_iter().flatten().filter(gains).collect();
    simplest(question, formulas)
}

/// How sure the place of the answer is: of the formula, or of the best smooth function.
fn how_sure(formula: Option<&Formula>, places: &[PlaceScore]) -> Option<f64> {
    let best = places.first()?;
    let (site, channels) = match formula {
        Some(formula) => (formula.law.site, formula.law.channels()),
        None => (best.place.site, best.place.channels.iter().collect()),
    };
    let holds_all = |place: &Place| {
        let has = |channel: &&Channel| place.channels.iter().any(|it| it.signal == channel.signal);
        place.site == site && channels.iter().all(has)
    };
    let others: Vec<&[f64]> = places
        .iter()
        .filter(|other| !holds_all(&other.place))
        .map(|other| other.score.residuals.as_slice())
        .collect();
    let own = match formula {
        // Of a long log a part was looked at, whose rows are others.
        Some(formula) if formula.fitted.held_out.residuals.len() == best.score.residuals.len() => {
            formula.fitted.held_out.residuals.all()
        }
        _ => places.iter().find(|it| holds_all(&it.place))?.score.residuals.as_slice().into(),
    };
    Some(confidence(&own, &others))
}
