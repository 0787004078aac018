//! Parts of a log, as the whole was judged, and a log judged again with what another of its bench shows.

use std::ops::Range;
use std::sync::Arc;

use super::{Judged, ScreenedChannel, ScreenedLog};
use crate::log::signals::rotor_of;
use crate::screening::channel::OF_BODY;
use crate::screening::checks::rate_is_angle_difference::{self, RATE_OF_ANGLE};
use crate::signal::columns::{self, BATTERY_VOLTAGE};

impl ScreenedLog {
    /// The log of these rotors alone, under their own numbers and as they were judged: other rotors and the body are left out.
    #[must_use]
    pub(crate) fn of_rotors(&self, rotors: &[usize]) -> Self {
        let keeps =
            |name: &str| rotor_of(name).map_or(!OF_BODY.contains(&name), |rotor| rotors.contains(&rotor));
        let judged = &*self.0;
        Self(Arc::new(Judged {
            raw: judged.raw.with_columns(keeps),
            cleaned: judged.cleaned.as_ref().map(|cleaned| cleaned.with_columns(keeps)),
            channels: judged.channels.iter().filter(|channel| keeps(&channel.name)).cloned().collect(),
            columns: judged.columns.clone(),
            units: None,
            of_battery: judged.of_battery.clone(),
            rotors: judged.rotors.iter().filter(|rotor| rotors.contains(&rotor.number())).cloned().collect(),
            thrusts: judged.thrusts.iter().filter(|it| rotors.contains(&it.number())).cloned().collect(),
            body: None,
            chain: None,
        }))
    }

    /// The log of these stretches of rows, which ascend, with its cells, its battery and its columns as they were judged. Where runs
    /// of rotors and body begin and end is judged at the cuts; but what is not scored in the whole, where more is known, is not scored
    /// in a part.
    #[must_use]
    pub(crate) fn of_rows(&self, stretches: &[Range<usize>]) -> Self {
        self.judged_again(stretches, &[])
    }

    /// The log, judged again with what another of its bench shows: that commands of these rotors step between rows.
    #[must_use]
    pub(crate) fn with_stepping(&self, rotors: &[usize]) -> Self {
        self.judged_again(std::slice::from_ref(&(0..self.raw().len())), rotors)
    }

    fn judged_again(&self, stretches: &[Range<usize>], stepping: &[usize]) -> Self {
        let whole = &*self.0;
        let of_battery =
            |channel: &ScreenedChannel| channel.name == BATTERY_VOLTAGE && whole.of_battery.is_some();
        let within = |channel: &ScreenedChannel| {
            let own = channel.judgements.len() - usize::from(of_battery(channel));
            let judgements = channel.judgements[..own].iter().filter_map(|judged| judged.of_rows(stretches));
            ScreenedChannel { name: channel.name.clone(), judgements: judgements.collect() }
        };
        let channels = whole.channels.iter().map(within).collect();
        let mut judged =
            Judged::of(whole.raw.of_rows(stretches), channels, whole.columns.clone(), stepping, |_| {
                whole.of_battery.as_ref().and_then(|judged| judged.of_rows(stretches))
            });
        judged.units.clone_from(&whole.units);
        let rows: Vec<usize> = stretches.iter().cloned().flatten().collect();
        for rotor in judged.rotors.iter_mut().filter(|rotor| !stepping.contains(&rotor.number())) {
            if let Some(whole) = self.commanded(rotor.number()) {
                rotor.keep_to(whole, &rows);
            }
        }
        for thrust in &mut judged.thrusts {
            if let Some(whole) = self.thrust(thrust.number()) {
                thrust.keep_to(whole, &rows);
            }
        }
        for (body, whole) in [(&mut judged.body, self.body()), (&mut judged.chain, self.chain())] {
            if let (Some(body), Some(whole)) = (body, whole) {
                body.keep_to(whole, &rows);
            }
        }
        let made = self.body().filter(|body| body.has(RATE_OF_ANGLE));
        let rates = made.and_then(|_| self.dataset().column(columns::BODY_RATE));
        let rates = rates.map(|rates| rows.iter().map(|row| rates[*row]).collect());
        rate_is_angle_difference::put(rates, &judged.raw, &mut judged.cleaned);
        Self(Arc::new(judged))
    }
}
