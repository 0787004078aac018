//! A body under what drives it: how well it is explained, and which of two is explained better.

use super::candidate_fit::CandidateFit;
use super::search_result::SearchResult;
use super::thresholds::THRESHOLDS;

/// Whether a fit leaves nothing but noise, on the data fitted on as on those held out.
pub(super) fn is_explained(found: &SearchResult, fitted: &CandidateFit) -> bool {
    let limit = found.at_floor();
    let training =
        |channel: usize| fitted.channel_error(&found.split, channel, false) / found.floors[channel];
    found.over_floor(fitted).0 <= limit
        && (0..found.split.train.channels().len()).all(|channel| training(channel) <= limit)
}

/// Squared error of a fit, fitted and held out, over the noise.
pub(super) fn misfit(found: &SearchResult, fitted: &CandidateFit, floors: &[f64; 2]) -> f64 {
    let share = |channel: usize, held_out| {
        (fitted.channel_error(&found.split, channel, held_out) / floors[channel]).powi(2)
    };
    (0..found.split.train.channels().len()).map(|channel| share(channel, false) + share(channel, true)).sum()
}

/// Whether the body that another set drives is better explained; `sizes` count what each of the two asks for.
pub(super) fn is_better(body: &SearchResult, driven: &SearchResult, sizes: (usize, usize)) -> bool {
    let explained = (is_explained(body, &body.answer), is_explained(driven, &driven.answer));
    match explained {
        (true, false) => false,
        (false, true) => true,
        // As many for the one as for the other: the rotors' own sensors speak for the other, too.
        (true, true) => sizes.1 <= sizes.0,
        _ => {
            misfit(driven, &driven.answer, &body.floors)
                < (1.0 - THRESHOLDS.driver_gain) * misfit(body, &body.answer, &body.floors)
        }
    }
}

/// Whether the first body is the simpler explanation; `None` where both are as good.
pub(super) fn prefers(one: &SearchResult, other: &SearchResult) -> Option<bool> {
    let at_floor = |found: &SearchResult| found.over_floor(&found.answer).0 <= found.at_floor();
    if at_floor(one) != at_floor(other) {
        return Some(at_floor(one));
    }
    let size = |found: &SearchResult| found.answer.effects.len() + found.changed.len();
    if size(one) != size(other) {
        return Some(size(one) < size(other));
    }
    let channels = 0..one.split.train.channels().len();
    let score = |found: &SearchResult| {
        let share = |channel: usize| {
            (found.answer.channel_error(&found.split, channel, true) / one.floors[channel]).powi(2)
        };
        channels.clone().map(share).sum::<f64>()
    };
    let (a, b) = (score(one), score(other));
    ((a - b).abs() > THRESHOLDS.decides_between_drivers * a.min(b)).then_some(a < b)
}
