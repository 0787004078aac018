//! Sentences for what `studies` finds.

use crate::screening::Finding;
use crate::unit::short;

/// The sentence of a finding of this room.
pub(crate) fn sentence(finding: &Finding) -> Option<String> {
    let subject = &finding.subject;
    let number = |name: &str| short(finding.number(name));
    let impulse = |[torque, duration, at]: [&str; 3]| {
        format!("{} N m for {} s at {} s", number(torque), number(duration), number(at))
    };
    let otherwise = |recorded: String| {
        format!(
            "--impulse says that {} struck the body, its recording says {recorded}; judged is what --impulse says: without it \
             the recording's own is",
            impulse(["torque_nm", "duration_s", "at_s"])
        )
    };
    let sentence = match finding.code {
        "angle_not_measured" => {
            "the angle was not measured; the controller's own estimate is judged, which drifts with the gyro's bias".to_owned()
        }
        "recorded_impulse_differs" => {
            otherwise(impulse(["recorded_torque_nm", "recorded_duration_s", "recorded_at_s"]))
        }
        "no_impulse_recorded" => otherwise("nothing".to_owned()),
        "impulse_unknown" => format!(
            "it does not say when the body was struck; taken from the angle, {:.2} s after the first step. --impulse \
             AT:DURATION:TORQUE says it, and then the error of the disturbance's estimate is known, too",
            finding.number("struck_s")
        ),
        "impulses_differ" => format!(
            "not the same disturbance: {} was struck by {} N m for {} s, {} by {} N m for {} s",
            finding.text("recording"),
            finding.number("torque_nm"),
            finding.number("duration_s"),
            finding.text("other_recording"),
            finding.number("other_torque_nm"),
            finding.number("other_duration_s")
        ),
        "interface_not_named" => format!(
            "`{subject}` may have hardware on it: `--interface {subject}` measures there, sending the safe command only"
        ),
        "bus_unusable" => finding.text("reason").to_owned(),
        "cyclictest_missing" => "not installed (Debian: apt-get install rt-tests), or not asked for".to_owned(),
        "cyclictest_failed" => format!("{}: {}", finding.text("program"), finding.text("reason")),
        "cyclictest_without_values" => {
            format!("it gave no value ({}): {}", finding.text("status"), finding.text("said"))
        }
        _ => return None,
    };
    Some(sentence)
}
