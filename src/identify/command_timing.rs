//! Rates that lead their commands: a logger that writes each command a row after it was sent. What is left over by a lag
//! fitted to such a log looks like noise, and no delay makes up for it.

use super::thresholds::THRESHOLDS;
use crate::estimation::variable_projection::LagFit;
use crate::screening::rotor_data::RotorLog;
use crate::screening::suspicion::Suspicion;
use crate::screening::telemetry_rate::is_too_seldom;

/// The code: rates that go with commands of a later row.
pub(crate) const RATES_LEAD: &str = "rates_lead_commands";

/// The code: rates that go with the commands of their own rows, as if nothing had to speed up.
pub(crate) const RATES_ANSWER_AT_ONCE: &str = "rates_answer_at_once";

/// Where the rates of a rotor (`part` of its log) go with commands of a row, or half a row, later than those beside them;
/// `left` [rad/s] is what these leave over, and `follows(log, τ)` fits a lag behind a delay τ [s]. A pole that no rotor has says that there
/// is no lag: rows are levels, or the rates were reckoned from the commands.
pub(crate) fn find(
    part: &RotorLog,
    left: f64,
    follows: impl Fn(&RotorLog, f64) -> Option<LagFit>,
) -> Option<Suspicion> {
    // When they stepped is known already.
    if part.command_from.is_some() {
        return None;
    }
    let earlier = a_row_earlier(part);
    // A row earlier and then late by the rest is less than a row earlier.
    let delay = |rows: f64| (1.0 - rows) * part.interval;
    let fits = THRESHOLDS.command_leads.into_iter();
    let fits = fits.filter_map(|rows| Some((rows, follows(&earlier, delay(rows))?)));
    let (rows, fit) = fits.min_by(|a, b| a.1.residual_rms.total_cmp(&b.1.residual_rms))?;
    if fit.residual_rms >= (1.0 - THRESHOLDS.lead_error_share) * left {
        return None;
    }
    let with_pole = |code| part.finding(code).with("pole_rad_s", fit.pole);
    // Of rows further apart nobody can say how fast the rotor is.
    if fit.pole > THRESHOLDS.fastest_pole && !is_too_seldom(part.interval, THRESHOLDS.fastest_pole) {
        let within = with_pole(RATES_ANSWER_AT_ONCE).with("interval_s", part.interval);
        return Some(Suspicion::impossible(within.with("fastest_rad_s", THRESHOLDS.fastest_pole)));
    }
    let lead = with_pole(RATES_LEAD).with("rows_earlier", rows).with("rms_rad_s", left);
    Some(Suspicion::said(lead.with("rms_earlier_rad_s", fit.residual_rms)))
}

/// The log with each command in the row before its own.
fn a_row_earlier(part: &RotorLog) -> RotorLog {
    let mut earlier = part.clone();
    for stretch in part.stretches.iter().filter(|stretch| !stretch.is_empty()) {
        earlier.command.copy_within(stretch.start + 1..stretch.end, stretch.start);
    }
    earlier
}
