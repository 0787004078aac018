//! What an answer leaves of a body that measured rotors drive. More than noise may be left of it, for the rotors' model is never quite
//! right; but that knows nothing of where the body is. Where its angle or rate explains what is left, a law of them is missing, for which
//! whatever is named stands in.

use super::block_data::BlockData;
use super::candidate_fit::CandidateFit;
use super::residual_evidence::evidence;
use super::search_result::SearchResult;
use super::thresholds::THRESHOLDS;
use crate::estimation::dependence::Bins;
use crate::estimation::output_error::Fit;
use crate::signal::columns;

/// A channel of the body that explains what is left.
pub(crate) struct RestFollows {
    /// Its name.
    pub(crate) channel: &'static str,
    /// \[-\] of the variance of what is left, from window to window.
    pub(crate) share: f64,
}

/// Whether what `fitted` leaves, where it is more than noise, is a function of the body's angle or rate: by the data fitted on and, where
/// there are others, by those held out.
pub(crate) fn rest_follows(found: &SearchResult, fitted: &CandidateFit) -> Option<RestFollows> {
    let split = &found.split;
    if found.over_floor(fitted).0 <= THRESHOLDS.at_floor || !split.train.is_driven_by_rotors() {
        return None;
    }
    // Of a single log the held-out part is the same rows once more.
    let held_out = split.folds.is_empty().then_some((&split.validate, &fitted.held_out));
    let parts: Vec<(&BlockData, &Fit)> = [(&split.train, &fitted.fit)].into_iter().chain(held_out).collect();
    let of_channel = |channel: &'static str| {
        let (mut windows, mut own, mut chance) = (0.0, 0.0, 0.0);
        for (data, fit) in &parts {
            let (count, explained, surrogate) = dependence(data, fit, channel)?;
            windows += count;
            own += count * explained;
            chance += count * surrogate;
        }
        let share = own / windows;
        (own > THRESHOLDS.rest_is_a_law * chance).then_some(RestFollows { channel, share })
    };
    [columns::BODY_ANGLE, columns::BODY_RATE]
        .into_iter()
        .filter_map(of_channel)
        .max_by(|a, b| a.share.total_cmp(&b.share))
}

/// Of the windows of one part: how many, the share of what is left in them that is a function of a channel, and the greatest that
/// its shifts reach. `None` of too few windows, or without the channel.
fn dependence(data: &BlockData, fit: &Fit, channel: &str) -> Option<(f64, f64, f64)> {
    let part = evidence(data, fit).into_iter().next()?;
    let (_, values) = part.channels.iter().find(|(name, _)| name == channel)?;
    let bins = Bins::of(values, &part.error, THRESHOLDS.bins_of_rest)?;
    let found = bins.dependence(&part.error, THRESHOLDS.surrogates_of_rest);
    Some((part.error.len() as f64, found.explained, found.surrogate))
}
