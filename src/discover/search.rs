//! The search: places, then formulas at the promising ones, then a second term.

use super::channels::{LawInput, Outlook, outlooks};
use super::forms;
use super::formula::{Formula, LawTask, simplest};
use super::inner_numbers::polished;
use super::law::{CandidateLaw, LawTerm};
use super::linear::{LinearizedBlock, Score};
use super::lines::lines;
use super::places::{Place, PlaceScore, scores};
use super::thresholds::THRESHOLDS;
use crate::diagnose::SearchEvent;
use crate::diagnose::candidate_fit::CandidateFit;
use crate::effect::Site;
use crate::effect::signals;
use crate::estimation::bootstrap::share_of_wins;
use crate::model::Effect;
use crate::threads::spread;

/// What was found of a block.
pub(crate) struct BlockResult<'a> {
    /// With the fit that the law was added to.
    pub task: LawTask<'a>,
    /// The formula, refitted; and others that are the same to the data.
    pub formula: Option<Formula>,
    pub others: Vec<Formula>,
    /// Smooth functions at the places, the best first, and what is there without one.
    pub places: Vec<PlaceScore>,
    pub without: Option<Score>,
    /// How sure the place is that explains most.
    pub confidence: Option<f64>,
}

impl BlockResult<'_> {
    /// Whether a formula leaves little more than noise.
    fn reaches(&self) -> bool {
        let at_floor = self.task.found.at_floor();
        self.formula.as_ref().is_some_and(|it| self.task.over_floor(&it.fitted) <= at_floor)
    }

    fn loss(&self) -> f64 {
        self.formula.as_ref().map_or(f64::INFINITY, |it| self.task.loss(&it.fitted))
    }
}

/// Beside the refitted base; and where that does not come to the noise, beside the base as it is, and beside what the catalogue
/// explains a part with.
pub(crate) fn search<'a>(task: &LawTask<'a>, progress: &(dyn Fn(SearchEvent) + Sync)) -> BlockResult<'a> {
    let mut alone = from_start(*task, progress);
    if !alone.reaches() && has_moved(task) {
        // A number that went far off took up a part of what is missing: beside it no law is what it is.
        let found = task.found;
        let as_it_is = from_start(LawTask { start: &found.nominal, ..*task }, progress);
        alone = if as_it_is.loss() < alone.loss() { as_it_is } else { alone };
    }
    if alone.reaches() || task.found.answer.effects.is_empty() {
        return alone;
    }
    let answer = &task.found.answer;
    let beside = from_start(LawTask { start: answer, before: answer, ..*task }, progress);
    // What needs effects of the catalogue beside it must do the better for them.
    let is_better = beside.loss() < (1.0 - THRESHOLDS.term_gain) * alone.loss();
    match beside.formula.as_ref().filter(|_| is_better) {
        Some(formula) => match without_effects(task, formula, &beside) {
            Some(plain) => BlockResult {
                formula: Some(plain),
                others: Vec::new(),
                confidence: beside.confidence,
                ..alone
            },
            None => beside,
        },
        None => alone,
    }
}

/// Whether a number of the base went far off when it was refitted.
fn has_moved(task: &LawTask) -> bool {
    let names = task.split().base_parameters(task.model);
    let value = |fitted: &CandidateFit, name: &String| fitted.model.parameter(name).unwrap_or(0.0);
    names.iter().any(|name| {
        let [now, own] = [&task.found.refitted, &task.found.nominal].map(|fitted| value(fitted, name));
        (now - own).abs() > THRESHOLDS.moved_base * own.abs()
    })
}

/// A formula that was found beside effects of the catalogue, refitted without them, where it does as well: they only stood in for it.
fn without_effects(task: &LawTask, formula: &Formula, beside: &BlockResult) -> Option<Formula> {
    let coefficients = formula.law.coefficients_in(&formula.fitted.model, task.id);
    let plain = task.refit(&formula.law, &coefficients, &[])?;
    let limit = beside.loss() * (1.0 + task.tolerance(&formula.fitted).max(THRESHOLDS.term_gain));
    let gains = task.gains(task.before, &plain.fitted) && task.is_determined(&plain);
    (gains && task.loss(&plain.fitted) <= limit).then_some(plain)
}

fn from_start<'a>(task: LawTask<'a>, progress: &(dyn Fn(SearchEvent) + Sync)) -> BlockResult<'a> {
    let nothing = BlockResult {
        task,
        formula: None,
        others: Vec::new(),
        places: Vec::new(),
        without: None,
        confidence: None,
    };
    let names = task.free_names();
    let Some(linear) = LinearizedBlock::new(task.split(), task.start, &names, task.known) else {
        return nothing;
    };
    let Some(without) = linear.without() else { return nothing };
    let outlooks = outlooks(&task.split().train);
    let places = places(&linear, &outlooks);
    let times = times(&outlooks);
    let promising = promising(&places, &without);
    let found_lines = lines(linear.residuals().0, linear.residuals().1);
    // Products of two channels show where a smooth function of both has too few rows for its knots.
    let pairs = Place::all(&outlooks, true);
    let tried: Vec<&Place> =
        promising.iter().map(|it| &it.place).filter(|it| it.channels.len() == 1).collect();
    let tried: Vec<&Place> = tried.into_iter().chain(&times).chain(&pairs).collect();
    let laws = [laws(&tried, &found_lines), waves(&outlooks, &tried), remembering(&outlooks)].concat();
    let formulas = refitted(&task, &linear, &laws, progress);
    let (mut formula, mut others) = match simplest(&task, formulas) {
        Some((formula, others)) => (Some(formula), others),
        None => (None, Vec::new()),
    };
    for _ in 1..THRESHOLDS.most_terms {
        let Some(now) = formula.as_ref() else { break };
        if task.over_floor(&now.fitted) <= crate::diagnose::thresholds::THRESHOLDS.done_at_floor {
            break;
        }
        let Some((better, beside)) = with_one_more(&task, now, &tried, &found_lines, progress) else {
            break;
        };
        (formula, others) = (Some(better), beside);
    }
    let formula = formula.filter(|it| task.gains(task.before, &it.fitted));
    let confidence = how_sure(formula.as_ref(), &others, &places);
    BlockResult { task, formula, others, places, without: Some(without), confidence }
}

/// Every place with its smooth function, the best first: those of two channels where the second pays, and one by the way that its
/// channel went where that does.
fn places(linear: &LinearizedBlock, outlooks: &[Outlook]) -> Vec<PlaceScore> {
    let mut places = scores(linear, &Place::all(outlooks, false));
    let pairs = scores(linear, &Place::all(outlooks, true));
    let best_single = places.first().map_or(f64::INFINITY, |place| place.score.held_out);
    let pays = |pair: &PlaceScore| pair.score.held_out < (1.0 - THRESHOLDS.pair_gain) * best_single;
    places.extend(pairs.into_iter().filter(pays));
    let by_way = scores(linear, &Place::by_way(outlooks)).into_iter().next();
    places.extend(by_way.filter(pays));
    places.sort_by(|a, b| a.score.held_out.total_cmp(&b.score.held_out));
    places
}

/// Where laws over time may act: they have no shape that another log would share.
fn times(outlooks: &[Outlook]) -> Vec<Place> {
    let of = |outlook: &Outlook| {
        let time = outlook.channels.iter().find(|channel| channel.is_time())?;
        Some(Place::of(outlook.site, vec![time.clone()]))
    };
    outlooks.iter().filter_map(of).collect()
}

/// The places whose formulas are tried.
fn promising<'a>(places: &'a [PlaceScore], without: &Score) -> Vec<&'a PlaceScore> {
    let gain = |place: &PlaceScore| without.held_out - place.score.held_out;
    // What remembers has forms of its own.
    let lasting = || places.iter().filter(|place| place.place.way.is_none());
    let best = lasting().next().map_or(0.0, gain);
    let promising = lasting().filter(|place| gain(place) > THRESHOLDS.promising_gain * best && best > 0.0);
    promising.take(THRESHOLDS.most_places).collect()
}

/// Laws of one term at the places.
fn laws(places: &[&Place], lines: &[f64]) -> Vec<CandidateLaw> {
    let of = |place: &&Place| -> Vec<CandidateLaw> {
        let terms: Vec<LawTerm> = match &place.channels[..] {
            [only] => forms::of_one(only, lines),
            [first, second, ..] => [forms::of_two(first, second), forms::of_two(second, first)].concat(),
            [] => Vec::new(),
        };
        terms.into_iter().map(|term| CandidateLaw { site: place.site, terms: vec![term] }).collect()
    };
    places.iter().flat_map(of).collect()
}

/// Waves where a smooth function shows little: teeth finer than its knots are none to it.
fn waves(outlooks: &[Outlook], tried: &[&Place]) -> Vec<CandidateLaw> {
    let singles = Place::all(outlooks, false);
    let others: Vec<&Place> = singles.iter().filter(|place| !tried.contains(place)).collect();
    laws(&others, &[]).into_iter().filter(|law| law.terms.iter().all(LawTerm::is_wave)).collect()
}

/// Laws that remember what the command was, or where the body has been.
fn remembering(outlooks: &[Outlook]) -> Vec<CandidateLaw> {
    let of = |(site, signal): (Site, &str)| {
        let mut channels = outlooks.iter().flat_map(|outlook| &outlook.channels);
        let channel = channels.find(|channel| channel.signal == signal);
        let terms = channel.map_or_else(Vec::new, |channel| forms::of_memory(site, channel));
        terms.into_iter().map(move |term| CandidateLaw { site, terms: vec![term] })
    };
    let all = [
        (Site::Command, signals::COMMAND),
        (Site::SteadyRate, signals::COMMAND),
        (Site::Torque, signals::BODY_ANGLE),
    ];
    all.into_iter().flat_map(of).collect()
}

/// The laws that do best in one step, the best of each form at each place, best first.
fn preselected(linear: &LinearizedBlock, laws: &[CandidateLaw]) -> Vec<(CandidateLaw, Score)> {
    let scored = spread(laws, |law| linear.score(&linear.columns(law)?, 0.0));
    let mut scored: Vec<(CandidateLaw, Score)> =
        laws.iter().zip(scored).filter_map(|(law, score)| Some((law.clone(), score?))).collect();
    scored.sort_by(|a, b| a.1.loss().total_cmp(&b.1.loss()));
    let mut taken: Vec<(Site, Vec<&'static str>, &'static str)> = Vec::new();
    let signals =
        |law: &CandidateLaw| law.terms[0].channels.iter().map(|it: &LawInput| it.signal).collect::<Vec<_>>();
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
    spread(&scored, |(law, score)| polished(linear, law, score))
}

fn refitted(
    task: &LawTask,
    linear: &LinearizedBlock,
    laws: &[CandidateLaw],
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Vec<Formula> {
    let formulas = spread(&preselected(linear, laws), |(law, score)| {
        progress(SearchEvent::Fitted);
        task.refit(law, &score.coefficients, &linear.numbers_after(score))
    });
    formulas.into_iter().flatten().collect()
}

/// A formula with one more term at its site, where that gains enough; and others that are the same to the data.
fn with_one_more(
    task: &LawTask,
    now: &Formula,
    places: &[&Place],
    lines: &[f64],
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Option<(Formula, Vec<Formula>)> {
    let coefficients = now.law.coefficients_in(&now.fitted.model, task.id);
    let known: Vec<Effect> = [task.known, &[now.fitted.model.effect(task.id).ok()?]].concat();
    let linear = LinearizedBlock::new(task.split(), &now.fitted, &now.fitted.names, &known)?;
    let here: Vec<&Place> = places.iter().filter(|place| place.site == now.law.site).copied().collect();
    let best = preselected(&linear, &laws(&here, lines));
    let formulas = spread(&best, |(law, score)| {
        progress(SearchEvent::Fitted);
        let terms = [&now.law.terms[..], &law.terms[..]].concat();
        let coefficients = [&coefficients[..], &score.coefficients[..]].concat();
        task.refit(&CandidateLaw { terms, ..now.law.clone() }, &coefficients, &linear.numbers_after(score))
    });
    let gains = |formula: &Formula| task.gains(&now.fitted, &formula.fitted);
    let formulas: Vec<Formula> = formulas.into_iter().flatten().filter(gains).collect();
    simplest(task, formulas)
}

/// How sure the place of the answer is, of the formula or of the best smooth function, beside the smooth functions elsewhere and the
/// formulas elsewhere that do as well.
fn how_sure(formula: Option<&Formula>, formulas: &[Formula], places: &[PlaceScore]) -> Option<f64> {
    let best = places.first()?;
    let (site, channels) = match formula {
        Some(formula) => (formula.law.site, formula.law.channels()),
        None => (best.place.site, best.place.channels.iter().collect()),
    };
    let holds_all = |at: Site, own: &[&LawInput]| {
        let has = |channel: &&LawInput| own.iter().any(|it| it.signal == channel.signal);
        at == site && channels.iter().all(has)
    };
    let is_place = |it: &PlaceScore| holds_all(it.place.site, &it.place.channels.iter().collect::<Vec<_>>());
    let mut others: Vec<&[f64]> =
        places.iter().filter(|it| !is_place(it)).map(|it| it.score.residuals.as_slice()).collect();
    let own = match formula {
        // Of a long log a part was looked at, whose rows are others.
        Some(formula) if formula.fitted.held_out.residuals.len() == best.score.residuals.len() => {
            formula.fitted.held_out.residuals.all()
        }
        _ => places.iter().find(|it| is_place(it))?.score.residuals.as_slice().into(),
    };
    let elsewhere = formulas.iter().filter(|it| !holds_all(it.law.site, &it.law.channels()));
    let elsewhere: Vec<_> = elsewhere.map(|it| it.fitted.held_out.residuals.all()).collect();
    others.extend(elsewhere.iter().filter(|it| it.len() == own.len()).map(|it| &**it));
    Some(share_of_wins(&own, &others, THRESHOLDS.stretches, THRESHOLDS.draws))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::block_data::{BlockData, Runs};
    use crate::diagnose::body_block::{BodyRun, BodySource};
    use crate::diagnose::data_split::DataSplit;
    use crate::diagnose::search_space::Search;
    use crate::diagnose::tests::noise;
    use crate::model::Model;

    const TEETH: f64 = 55.0;
    const ROWS: usize = 2400;

    /// A body that is driven to and fro, to another place each so many `held` rows, on which a torque of its angle acts, too.
    fn driven(seed: usize, held: usize, mut law: impl FnMut(f64) -> f64) -> BlockData {
        let inertia = Model::paper().body.inertia;
        let (mut angle, mut rate) = (0.0_f64, 0.0);
        let (mut torques, mut angles, mut rates) = (Vec::new(), Vec::new(), Vec::new());
        for row in 0..ROWS {
            let wanted = 0.35 * noise(seed + row / held);
            let torque = 1.2 * (wanted - angle) - 0.2 * rate + 0.12 * noise(seed + 1000 + row / 23);
            torques.push(torque);
            angles.push(angle + 1e-3 * noise(seed + 10_000 + row));
            rates.push(rate + 5e-3 * noise(seed + 50_000 + row));
            for _ in 0..50 {
                rate += 2e-4 * (torque + law(angle)) / inertia;
                angle += 2e-4 * rate;
            }
        }
        let source = BodySource {
            time: (0..ROWS).map(|row| 0.01 * row as f64).collect(),
            torque: torques,
            torque_slope: vec![0.0; ROWS].into(),
            propagated: vec![0.0; ROWS].into(),
            rate: rates.into(),
            angle: angles.into(),
            ..BodySource::default()
        };
        BlockData::new(Runs::Body(vec![BodyRun::new(0, 0..ROWS, source, 0.4)]))
    }

    /// Strong fine teeth: within a window of 0.4 s a model without them is several teeth off.
    fn over_teeth(seed: usize) -> BlockData {
        driven(seed, 300, |angle| 0.09 * (TEETH * angle + 1.0).sin())
    }

    /// The level of a relay, one above a place [rad] and minus one below another one.
    fn level(level: &mut f64, [up, down]: [f64; 2], angle: f64) -> f64 {
        if angle > up {
            *level = 1.0;
        } else if angle < down {
            *level = -1.0;
        }
        *level
    }

    /// Asks about a block and one that is held out, with the base refitted.
    fn linearized<T>(data: [BlockData; 2], ask: impl FnOnce(&LinearizedBlock, &[Outlook]) -> T) -> T {
        let model = Model::paper();
        let known = model.known_effects().expect("the catalogue");
        let search = Search { base: &model, known: &known, eligible: Vec::new(), progress: &|_| () };
        let [train, held_out] = data;
        let mut split = DataSplit::new(train, Some(held_out));
        let (_, refitted) = search.bases(&mut split);
        let linear =
            LinearizedBlock::new(&split, &refitted, &split.base_parameters(&model), &known).expect("finite");
        ask(&linear, &outlooks(&split.train))
    }

    #[test]
    fn strong_fine_teeth_are_seen_along_the_path_that_was_measured() {
        linearized([over_teeth(1), over_teeth(200_000)], |linear, outlooks| {
            let angle = Place::all(outlooks, false).into_iter();
            let angle = angle.filter(|place| {
                place.site == Site::Torque && place.channels[0].signal == signals::BODY_ANGLE
            });
            let places: Vec<Place> = angle.collect();
            let found = preselected(linear, &laws(&places.iter().collect::<Vec<_>>(), &[]));
            let (law, score) = &found[0];
            let number = law.terms[0].inner[0].value;
            assert!(law.terms[0].is_wave() && (number - TEETH).abs() < 0.2, "{}: {number}", law.expression());
            let left = score.held_out / linear.without().expect("finite").held_out;
            assert!(left < 0.05, "{left} of the error is left");
        });
    }

    /// No slope leads to where a relay changes over: both places are found by trying, as good as those that the data were made with.
    #[test]
    fn the_thresholds_of_a_relay_are_found() {
        let snapping = |seed| {
            let mut held = 1.0;
            driven(seed, 100, move |angle| 0.02 * level(&mut held, [0.16, -0.12], angle))
        };
        linearized([snapping(1), snapping(200_000)], |linear, outlooks| {
            let found = preselected(linear, &remembering(outlooks));
            let (law, score) = &found[0];
            assert_eq!(law.terms[0].form, "relay", "{}", law.expression());
            let mut true_law = law.clone();
            [0.14, 0.02]
                .into_iter()
                .zip(&mut true_law.terms[0].inner)
                .for_each(|(value, it)| it.value = value);
            let columns = linear.columns(&true_law).expect("it acts");
            let truth = linear.score(&columns, 0.0).expect("finite").loss();
            assert!(score.loss() <= 1.01 * truth, "{} for {truth}", score.loss());
        });
    }

    /// A loop of no form in the library: two levels that grow apart with the angle.
    #[test]
    fn what_looks_at_the_way_that_it_went_has_a_curve_for_each() {
        let sized = |angle: f64| 0.04 + 0.5 * angle * angle;
        let looped = |seed| {
            let mut held = 1.0;
            driven(seed, 25, move |angle| -level(&mut held, [0.1, -0.1], angle) * sized(angle))
        };
        linearized([looped(1), looped(200_000)], |linear, outlooks| {
            let found = places(linear, outlooks);
            let best = &found[0];
            let signals: Vec<&str> = best.place.channels.iter().map(|it| it.signal).collect();
            assert_eq!((best.place.site, &signals[..]), (Site::Torque, &[signals::BODY_ANGLE][..]));
            assert!(best.place.way.is_some());
            // The best of the others looks at the body's rate beside its angle.
            let plain = found.iter().find(|it| it.place.way.is_none()).expect("tried");
            let [by_way, plain] = [best, plain].map(|it| it.score.held_out);
            assert!(by_way < 0.5 * plain, "{by_way} for {plain}");
            // None of it goes on to the formulas of one channel.
            let without = linear.without().expect("finite");
            assert!(promising(&found, &without).iter().all(|it| it.place.way.is_none()));
        });
    }
}
