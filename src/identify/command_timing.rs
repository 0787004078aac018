//! Rates that lead their commands: a logger that writes each command a row after it was sent. What is left over by a lag
//! fitted to such a log looks like noise, and no delay makes up for it.

use super::pole::LagFit;
use crate::screening::rotor_data::RotorLog;

/// Share of the error that earlier commands must take away.
const FALLS: f64 = 1.0 / 3.0;

/// What to say where the rates of a rotor (`part` of its log) go with commands of a row, or half a row, later than those
/// beside them; `left` [rad/s] is what these leave over, and `follows(log, τ)` fits a lag behind a delay τ [s].
pub(crate) fn tell(
    part: &RotorLog,
    left: f64,
    follows: impl Fn(&RotorLog, f64) -> Option<LagFit>,
) -> Option<String> {
    let earlier = a_row_earlier(part);
    let tried = [("a row", 0.0), ("half a row", 0.5 * part.interval)];
    let fits = tried.into_iter().filter_map(|(by, delay)| Some((by, follows(&earlier, delay)?)));
    let (by, fit) = fits.min_by(|a, b| a.1.residual_rms.total_cmp(&b.1.residual_rms))?;
    (fit.residual_rms < (1.0 - FALLS) * left).then(|| {
        format!(
            "{}: the rates lead the commands: with each command {by} earlier the error falls from {left:.2} to {:.2} rad/s, with \
             a pole of {:.2} rad/s; the logger writes a command later than it is sent (move the column of the commands up by {by}, \
             or log each command with the row in which it is sent); until then no number of this rotor is to be trusted",
            part.source, fit.residual_rms, fit.pole
        )
    })
}

/// The log with each command in the row before its own.
fn a_row_earlier(part: &RotorLog) -> RotorLog {
    let mut earlier = part.clone();
    for segment in part.segments.iter().filter(|segment| !segment.is_empty()) {
        earlier.command.copy_within(segment.start + 1..segment.end, segment.start);
    }
    earlier
}
