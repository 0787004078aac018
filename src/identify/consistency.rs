//! Where the results contradict each other, hardly show, or leave something over: each with what it may be.

use super::dead_time::CORRELATED;
use super::lag_order::{Rival, dead_time_effect};
use super::pipeline::Work;
use super::significance;
use super::validate::Validation;
use crate::effect::Term;
use crate::screening::Finding;
use crate::screening::rotor_data::bounds;
use crate::unit::with_error;

/// [%] fit of a log with lively commands below which it is not explained.
const UNFIT: f64 = 40.0;
/// Standard error, as a share of a number, from which it is said how little is known of it.
const HARDLY: f64 = 0.2;
/// [rad/s] no rotor with a propeller on it is as fast.
const TOO_FAST: f64 = 200.0;
/// Share of the body's motion from which a correlated rest counts. Below it the noise of the measured rotor rates,
/// summed up over a window, looks the same.
const UNEXPLAINED: f64 = 0.2;

impl Work<'_> {
    /// Says where the results contradict each other or leave something over.
    pub(crate) fn check_results(&mut self) {
        let mut say: Vec<Finding> = Vec::new();
        // Of rotors that differ it is known why their common fit contradicts itself.
        let alike = !self.unlike;
        if let (true, Some(battery), Some(joint)) = (alike, &self.battery, &self.joint)
            && let Some(gain) = joint.voltage_gain
        {
            let sigma = battery.gain.standard_error.hypot(gain.standard_error);
            if (battery.gain.value - gain.value).abs() > 4.0 * sigma {
                say.push(format!(
                    "k_V is {:.2} from constant commands and {:.2} from lively ones: the battery does not act as \
                     a plain subtraction (see `diagnose`)",
                    battery.gain.value, gain.value
                ).into());
            }
        }
        if let Some(pole) = self.pole_estimate().filter(|pole| pole.value > TOO_FAST) {
            say.push(format!(
                "a pole of {:.0} rad/s is faster than any rotor with a propeller: is the time in seconds?",
                pole.value
            ).into());
        }
        if let Some(fit) = self.pole.as_ref().filter(|_| alike)
            && (fit.gain.value - 1.0).abs() > 0.02
            && fit.gain.distance(1.0) > 4.0
        {
            say.push(
                format!(
                    "the gain from z to the rate is {:.3} in motion: the static curve does not hold there",
                    fit.gain.value
                )
                .into(),
            );
        }
        let rivals = self.pole.as_ref().map(|fit| (&fit.rivals, fit.residual_correlation));
        let rivals = rivals.or(self.joint.as_ref().map(|fit| (&fit.rivals, fit.residual_correlation)));
        if let Some((rivals, correlation)) = rivals {
            let taken = self.delay();
            let needed = |rival: &&Rival| {
                rival.needed && (taken.is_none() || rival.term != Term::DeadTime && rival.clear)
            };
            let needed: Vec<String> = rivals.iter().filter(needed).map(in_words).collect();
            if let Some(told) = taken {
                say.push(
                    format!(
                        "the rotor answers {} ms late: the model has `{}` for it, and the pole fitted \
                     beside it, {:.3} rad/s; without it the pole would come out as {:.3}, to make \
                     up for the delay (--no-delay leaves it out)",
                        with_error(1e3 * told.delay.value, 1e3 * told.delay.standard_error),
                        dead_time_effect().map_or("", |card| card.id),
                        self.pole_estimate().map_or(f64::NAN, |pole| pole.value),
                        told.pole_without.value
                    )
                    .into(),
                );
            } else if alike && !needed.is_empty() {
                say.push(format!(
                    "a first-order lag is not enough, and its pole makes up for what is missing: {}; `diagnose` tells which \
                     effect it is, `extend` adds it",
                    needed.join(", ")
                ).into());
            }
            if alike && correlation > CORRELATED {
                say.push(format!(
                    "the residual is far from noise (lag-one correlation {correlation:.2}): something is missing \
                     in the model; standard errors allow for it, `diagnose` looks for it"
                ).into());
            }
        }
        if let Some(body) = self.body.as_ref().filter(|body| {
            body.left_out.is_none()
                && body.residual_correlation > CORRELATED
                && body.residual_rms > UNEXPLAINED * body.motion_rms
        }) {
            say.push(format!(
                "{}: J alone leaves {:.3} rad/s of the body rate's {:.3} unexplained over windows of half a second, \
                 and that is far from noise (lag-one correlation {:.2}): something is missing in the body's model, \
                 and J carries part of it; `diagnose` looks for it",
                body.source, body.residual_rms, body.motion_rms, body.residual_correlation
            ).into());
        }
        if let Some((body, left_out)) = self.body.as_ref().and_then(|body| Some((body, body.left_out?))) {
            say.push(format!(
                "{}: a torque that goes with {} shows ({:.0} standard errors), and beside it J would be {} kg m²: something is \
                 missing in the body's model; J's error allows for it, `diagnose` looks for it",
                body.source,
                left_out.goes_with,
                left_out.shows,
                with_error(left_out.inertia.value, left_out.inertia.standard_error)
            ).into());
        }
        if alike {
            self.check_errors(&mut say);
        }
        self.check_template(&mut say);
        self.check_inertia(&mut say);
        if let Some((low, high)) = self.lively_range().filter(|(low, high)| high - low < 0.05) {
            say.push(
                format!("lively commands span only {low:.3} to {high:.3}: g(u) holds near there only").into(),
            );
        }
        self.findings.extend(say);
    }

    /// Says which numbers of the model hardly show.
    fn check_errors(&self, say: &mut Vec<Finding>) {
        let gain = self.voltage_gain().filter(|_| self.static_curve.is_some() || self.joint.is_none());
        let gain = gain.or(self.joint.as_ref().and_then(|joint| joint.voltage_gain));
        // An error that is large because something is missing in the model is told as that.
        let correlation = self.pole.as_ref().map(|fit| fit.residual_correlation);
        let correlation = correlation.or(self.joint.as_ref().map(|fit| fit.residual_correlation));
        let pole = self.pole_estimate().filter(|_| correlation.is_none_or(|it| it <= CORRELATED));
        let inertia = self.body.as_ref().filter(|body| body.residual_correlation <= CORRELATED);
        let inertia = inertia.map(|body| body.inertia);
        for (name, estimate, unit, more) in [
            ("k_V =", gain, "rad/(s V)", "hold commands longer, or record a longer PRBS"),
            ("the pole", pole, "rad/s", "record more jumps, larger ones, or a longer PRBS"),
            ("J =", inertia, "kg m²", "excite the attitude more, or longer"),
        ] {
            let Some(estimate) = estimate.filter(|it| it.standard_error > HARDLY * it.value.abs()) else {
                continue;
            };
            let share = 100.0 * estimate.standard_error / estimate.value.abs();
            let value = significance::in_digits(&estimate);
            say.push(format!("{name} {value} {unit} is known to {share:.0} % only: {more}").into());
        }
    }

    fn lively_range(&self) -> Option<(f64, f64)> {
        let ranges: Vec<(f64, f64)> = self.lively.iter().map(|rotor| bounds(&rotor.command)).collect();
        let low = ranges.iter().map(|range| range.0).reduce(f64::min)?;
        Some((low, ranges.iter().map(|range| range.1).fold(low, f64::max)))
    }
}

/// What to say of a log whose lively rates the model does not explain.
pub(crate) fn unfit(run: &Validation) -> Option<String> {
    (run.fit_percent < UNFIT).then(|| {
        format!(
            "{}: the model leaves {:.1} rad/s of the rates' rms unexplained, a fit of {:.0} %: single wild readings, commands \
             that hardly show over the noise, or another bench's log; look at it before the model is used",
            run.source, run.rms, run.fit_percent
        )
    })
}

/// A rival that the data ask for.
fn in_words(rival: &Rival) -> String {
    format!(
        "`{}` of {} ms lowers the error to {:.2} rad/s, with a pole of {:.2} rad/s beside it",
        rival.effect,
        with_error(1e3 * rival.time.value, 1e3 * rival.time.standard_error),
        rival.residual_rms,
        rival.pole
    )
}
