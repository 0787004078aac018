//! Sentences for the body and its inertia.

use crate::screening::Finding;
use crate::signal::Channel;
use crate::unit::with_error;

/// The sentence of a finding about the body.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    let n = |name: &str| finding.number(name);
    Some(match finding.code {
        "too_few_body_samples" => "too few samples of the body rate to identify the inertia".to_owned(),
        "torque_hardly_shows" => format!(
            "the torque hardly shows in the body rate (d/J = {}); excite the attitude more, or check that the body may turn and \
             that its rate has the sign of torque = d (f1 - f2)",
            with_error(n("value"), n("error"))
        ),
        "inertias_disagree" => format!(
            "says J = {:.5} kg m², {} says {:.5}: not the same bench, or something is missing in the body's model",
            n("inertia_kg_m2"),
            finding.text("other_log"),
            n("other_inertia_kg_m2")
        ),
        "body_residual_correlated" => format!(
            "J alone leaves {:.3} rad/s of the body rate's {:.3} unexplained over windows of half a second, and that is far from \
             noise (lag-one correlation {:.2}): something is missing in the body's model, and J carries part of it; `diagnose` \
             looks for it",
            n("rms_rad_s"),
            n("motion_rms_rad_s"),
            n("correlation")
        ),
        "body_torque_omitted" => format!(
            "a torque that goes with {} shows ({:.0} standard errors), and beside it J would be {} kg m²: something is missing in \
             the body's model; J's error allows for it, `diagnose` looks for it",
            if finding.text("goes_with") == Channel::BodyRate.name() {
                "the body's rate"
            } else {
                "the body's angle"
            },
            n("standard_errors"),
            with_error(n("inertia_kg_m2"), n("inertia_error_kg_m2"))
        ),
        _ => return None,
    })
}
