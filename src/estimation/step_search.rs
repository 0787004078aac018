//! The way in which an output follows the steps of its input: the one that leaves least, with no more in it than the data ask for.

use std::ops::Range;

use super::golden_section::golden;
use super::step_trial::{Following, Stepped, Steps, Trial};
use super::thresholds::THRESHOLDS;

impl Stepped<'_> {
    /// The pole, without more, that leaves least.
    pub(super) fn coarse(&self, steps: Steps) -> Option<Following> {
        let poles = (0..THRESHOLDS.tried_poles).map(|power| 2.0 * 1.5_f64.powi(power));
        let tried = poles.map(|pole| Following::plain(pole, 0.0));
        let left =
            |following: Following| self.carry_out(&Trial { following, steps, curve: None }).likelihood();
        tried.map(|it| (left(it), it)).max_by(|a, b| a.0.total_cmp(&b.0)).map(|found| found.1)
    }

    pub(super) fn search(&self, near: Trial, delays: Range<f64>) -> StepSearch<'_> {
        StepSearch { record: self, trial: near, delays, interval: self.interval }
    }

    /// The way to follow that leaves least, from one that is near, with no more in it than the data ask for.
    pub(super) fn follow(&self, near: Trial, delays: Range<f64>) -> Following {
        let search = self.search(near, delays);
        let mut at = search.delay_on_a_grid();
        for round in 0..THRESHOLDS.step_rounds {
            let before = at;
            // Not before pole and dead time are near: what is asked of others would make up for that.
            let asks = round % THRESHOLDS.asked_again == THRESHOLDS.asked_again - 1;
            search.refine(&mut at, asks);
            search.go_on(&before.0, &mut at);
            if asks {
                search.drop_what_does_not_show(&mut at);
            }
            if at.1 - before.1 < THRESHOLDS.step_search_end && asks {
                break;
            }
        }
        at.0
    }
}

/// A search for the way to follow.
pub(super) struct StepSearch<'a> {
    record: &'a Stepped<'a>,
    trial: Trial,
    delays: Range<f64>,
    interval: f64,
}

/// A way to follow, and the logarithm of its likelihood.
type Found = (Following, f64);

impl StepSearch<'_> {
    fn of(&self, following: Following) -> Found {
        (following, self.record.carry_out(&Trial { following, ..self.trial }).likelihood())
    }

    /// A pole and a dead time alone.
    pub fn plain(&self) -> Following {
        let mut at = self.delay_on_a_grid();
        for _ in 0..THRESHOLDS.plain_step_rounds {
            self.refine(&mut at, false);
        }
        at.0
    }

    fn within(&self, delay: f64) -> f64 {
        delay.clamp(self.delays.start, self.delays.end)
    }

    /// The delay has several valleys.
    fn delay_on_a_grid(&self) -> Found {
        let Range { start, end } = self.delays;
        let count =
            (2.0 * (end - start) / self.interval).ceil().clamp(1.0, THRESHOLDS.most_step_delays) as usize;
        let delays = (0..=count).map(|step| start + (end - start) * step as f64 / count as f64);
        let tried = delays.map(|delay| self.of(Following::plain(self.trial.following.pole, delay)));
        let near = self.of(self.trial.following);
        tried.fold((near.0, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best })
    }

    /// Along one number, where that gains more than `gain`.
    fn along(&self, at: &mut Found, span: Range<f64>, gain: f64, with: impl Fn(f64) -> Following) {
        let (value, _) = golden(|value| -self.of(with(value)).1, span.start, span.end);
        let next = self.of(with(value));
        if next.1 > at.1 + gain {
            *at = next;
        }
    }

    /// Each number in turn. What shows already is refined; what does not is asked for where it `asks`, and has to show.
    fn refine(&self, at: &mut Found, asks: bool) {
        let gain = |value: f64| if value == 0.0 { THRESHOLDS.step_shape_gain } else { 0.0 };
        let it = at.0;
        let poles = it.pole / THRESHOLDS.pole_span..it.pole * THRESHOLDS.pole_span;
        self.along(at, poles, 0.0, |pole| Following { pole, ..it });
        let it = at.0;
        let near = self.within(it.delay - self.interval)..self.within(it.delay + self.interval);
        self.along(at, near, 0.0, |delay| Following { delay, ..it });
        let it = at.0;
        if asks || it.upward != 0.0 {
            let most = THRESHOLDS.most_upward;
            self.along(at, -most..most, gain(it.upward), |upward| Following { upward, ..it });
        }
        let it = at.0;
        let middles: &[f64] = if it.by_input != 0.0 { &[it.by_input] } else { &THRESHOLDS.by_inputs };
        if asks || it.by_input != 0.0 {
            for middle in middles {
                let with = |by_input: f64| Following { by_input, ..it };
                let reach = THRESHOLDS.by_input_reach;
                self.along(at, middle - reach..middle + reach, gain(it.by_input), with);
            }
        }
        let it = at.0;
        if asks || it.second != 0.0 {
            let pole = |second: f64| it.pole * (1.0 + second) / (1.0 + it.second);
            let lag = |second: f64| Following { second, pole: pole(second), ..it };
            // The sum of all times stays: what a second lag takes, the dead time gives.
            let delay = |second: f64| self.within(it.delay - (second - it.second) / it.pole);
            let late = |second: f64| Following { second, delay: delay(second), ..it };
            self.along(at, 0.0..THRESHOLDS.longest_second_lag, gain(it.second), lag);
            self.along(at, 0.0..THRESHOLDS.longest_second_lag, gain(it.second), late);
        }
    }

    /// Without each number that was taken when others were off, where it no longer gains what it has to.
    fn drop_what_does_not_show(&self, at: &mut Found) {
        let it = at.0;
        let plainer = [
            (it.upward != 0.0).then_some(Following { upward: 0.0, ..it }),
            (it.by_input != 0.0).then_some(Following { by_input: 0.0, ..it }),
            (it.second != 0.0).then_some(Following { second: 0.0, pole: it.pole / (1.0 + it.second), ..it }),
            (it.second != 0.0).then(|| {
                let delay = self.within(it.delay + it.second / it.pole);
                Following { second: 0.0, delay, ..it }
            }),
        ];
        for following in plainer.into_iter().flatten() {
            let near = (following, f64::NEG_INFINITY);
            let mut found = near;
            self.refine(&mut found, false);
            if found.1 > at.1 - THRESHOLDS.step_shape_gain {
                *at = found;
                return;
            }
        }
    }

    /// Further on the way that a round has gone: pole, second lag and dead time stand in for each other.
    fn go_on(&self, from: &Following, at: &mut Found) {
        let to = at.0;
        self.along(at, 0.0..THRESHOLDS.furthest_on, 0.0, |share| Following {
            pole: to.pole * (to.pole / from.pole).powf(share),
            upward: to.upward + share * (to.upward - from.upward),
            by_input: to.by_input + share * (to.by_input - from.by_input),
            second: (to.second + share * (to.second - from.second)).clamp(0.0, THRESHOLDS.longest_second_lag),
            delay: self.within(to.delay + share * (to.delay - from.delay)),
        });
    }
}
