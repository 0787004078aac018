//! A log judged once: of each channel which cells are measurements, of rotors, thrusts and the body which rows are scored, and why
//! the others are not. Whoever fits a model to a log, compares one with it or describes it takes it from here, so that all see the same rows.

mod parts;

use std::sync::Arc;

use super::attitude::{Attitude, Mistaken};
use super::battery::CheckedBattery;
use super::channel::{self, CheckedChannel, Judgement};
use super::checks;
use super::checks::rate_is_angle_difference::{self, RATE_OF_ANGLE};
use super::column::{CheckedColumn, Remark};
use super::rotor_data::HeldVoltage;
use super::screened_body::ScreenedBody;
use super::screened_rotor::ScreenedRotor;
use super::screened_thrust::ScreenedThrust;
use super::suspicion::Suspicion;
use super::{Finding, ScreeningError};
use crate::log::Dataset;
use crate::log::signals::MOST_ROTORS;
use crate::signal::ROTORS;
use crate::signal::columns::{self, BATTERY_VOLTAGE};
use crate::threads::{both, spread, spread_longest_first};

/// A log, and what of it is a measurement. Its copies share what it holds.
///
/// ```
/// use rotorbench::log::Dataset;
/// use rotorbench::screening::ScreenedLog;
///
/// let time: Vec<f64> = (0..500).map(|row| 0.02 * f64::from(row)).collect();
/// let mut rates: Vec<f64> = time.iter().map(|time| 400.0 + 9.0 * (3.0 * time).sin()).collect();
/// rates[250] = 5000.0; // [rad/s] a broken frame
/// let mut log = Dataset::new("run", "", time)?;
/// log.insert("propeller_rate_1_rad_s", rates)?;
/// let log = ScreenedLog::of(&log);
/// assert_eq!(log.findings().map(|finding| finding.code).collect::<Vec<_>>(), ["outliers"]);
/// assert!(log.dataset().column("propeller_rate_1_rad_s").is_some_and(|rates| rates[250].is_nan()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct ScreenedLog(Arc<Judged>);

#[derive(Debug)]
struct Judged {
    raw: Dataset,
    /// `None` where every cell is a measurement.
    cleaned: Option<Dataset>,
    channels: Vec<ScreenedChannel>,
    /// Of the log as a whole: columns that are not read, values that no bench measures.
    columns: Vec<Suspicion>,
    /// What is wrong with the units of time and body.
    units: Option<Mistaken>,
    /// What was found of the battery beside the rotors; it stands last in its channel, too.
    of_battery: Option<Judgement>,
    /// Those whose commands the log holds.
    rotors: Vec<ScreenedRotor>,
    thrusts: Vec<ScreenedThrust>,
    body: Option<ScreenedBody>,
    chain: Option<ScreenedBody>,
}

/// What is no measurement in one channel.
#[derive(Debug, Clone)]
pub struct ScreenedChannel {
    /// Name of the channel.
    pub name: String,
    /// What each check found.
    pub judgements: Vec<Judgement>,
}

impl ScreenedChannel {
    fn of(log: &Dataset, name: &str) -> Option<Self> {
        let mut channel = CheckedChannel::of(log, name)?;
        for check in checks::CHANNEL {
            let found = check(&channel);
            channel.found.extend(found);
        }
        Some(Self { name: name.to_owned(), judgements: channel.found })
    }

    /// What was found in it.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        self.judgements.iter().map(|judged| judged.finding.clone()).collect()
    }

    /// Rows whose cells are left out.
    pub fn left_out(&self) -> impl Iterator<Item = usize> + '_ {
        self.judgements.iter().flat_map(|judged| judged.rows.iter().chain(&judged.biased).copied())
    }

    /// Why the cell of this row is no measurement: the code of the finding; `None` of one that is, or is empty.
    #[must_use]
    pub fn reason(&self, row: usize) -> Option<&'static str> {
        let holds = |judged: &&Judgement| judged.rows.contains(&row) || judged.biased.contains(&row);
        self.judgements.iter().find(holds).map(|judged| judged.finding.code)
    }

    /// Whether a check found this.
    #[must_use]
    pub fn has(&self, code: &str) -> bool {
        self.judgements.iter().any(|judged| judged.finding.code == code)
    }
}

impl From<Dataset> for ScreenedLog {
    fn from(raw: Dataset) -> Self {
        let names = channel::screened(&raw);
        let readings = |name: &&str| {
            let values = raw.column(name).unwrap_or_default();
            values.iter().filter(|value| value.is_finite()).count()
        };
        let channels = spread_longest_first(&names, readings, |name| ScreenedChannel::of(&raw, name));
        let channels = channels.into_iter().flatten().collect();
        let of_columns = checks::LOG.iter().flat_map(|check| check(&raw)).collect();
        Self(Arc::new(Judged::of(raw, channels, of_columns, &[], |battery| {
            checks::BATTERY.iter().find_map(|check| check(battery))
        })))
    }
}

impl Judged {
    /// A log whose channels and columns are judged; `judge` looks at the battery beside the rotors, and of those `stepping` commands step
    /// between rows in another log of the bench.
    fn of(
        mut raw: Dataset,
        mut channels: Vec<ScreenedChannel>,
        columns: Vec<Suspicion>,
        stepping: &[usize],
        judge: impl FnOnce(&CheckedBattery) -> Option<Judgement>,
    ) -> Self {
        let mut cleaned = None;
        channels.iter().for_each(|channel| channel.take_out(&raw, &mut cleaned));
        let log = cleaned.as_ref().unwrap_or(&raw);
        let mut rotors = rotors(log, &channels, stepping);
        let thrust = |number: usize| {
            let rotor = rotors.iter().find(|rotor| rotor.number() == number);
            ScreenedThrust::of(log, number, rotor)
        };
        let of_body = || {
            let thrusts = (1..=MOST_ROTORS).filter_map(thrust).collect();
            let body = ScreenedBody::of(log, &rotors);
            let chain = body.as_ref().and_then(|body| body.commanded(log, &rotors));
            (thrusts, body, chain)
        };
        let ((thrusts, body, chain), (units, of_battery)) = both(of_body, || {
            let turning = rotors.iter().filter(|it| it.is_measured() && it.turns()).map(ScreenedRotor::data);
            (units(log, &rotors), judge(&CheckedBattery { log, turning: turning.collect() }))
        });
        let slopes = body
            .as_ref()
            .filter(|it| it.has(RATE_OF_ANGLE))
            .and_then(|_| rate_is_angle_difference::slopes(log));
        rate_is_angle_difference::put(slopes, &raw, &mut cleaned);
        if let Some((channel, found)) =
            channels.iter_mut().find(|channel| channel.name == BATTERY_VOLTAGE).zip(of_battery.clone())
        {
            let is_useless = !found.rows.is_empty();
            channel.judgements.push(found);
            if is_useless {
                channel.take_out(&raw, &mut cleaned);
                rotors.iter_mut().for_each(ScreenedRotor::drop_battery);
            }
        }
        raw.keep_few(cleaned.as_mut());
        Self { raw, cleaned, channels, columns, units, of_battery, rotors, thrusts, body, chain }
    }
}

/// The rotors of a log whose channels are judged.
fn rotors(log: &Dataset, channels: &[ScreenedChannel], stepping: &[usize]) -> Vec<ScreenedRotor> {
    let voltage = HeldVoltage::of(log);
    let rotor = |number: usize| {
        let rate = columns::propeller_rate(number);
        let rates = channels.iter().find(|channel| channel.name == rate);
        let found = rates.map_or(&[][..], |channel| &channel.judgements);
        ScreenedRotor::of(log, voltage.as_ref(), number, found, stepping.contains(&number))
    };
    let rotors = spread(&(1..=MOST_ROTORS).collect::<Vec<_>>(), |number| rotor(*number));
    let mut rotors: Vec<ScreenedRotor> = rotors.into_iter().flatten().collect();
    if let Some((first, others)) = rotors.split_first_mut() {
        others.iter_mut().for_each(|other| other.see_through_as(first));
    }
    rotors
}

/// What is wrong with the units of time and body of a log: a factor of 57 between a rate and the slope of its angle is a unit. What
/// more rotors than two turn is no body of ours.
fn units(log: &Dataset, rotors: &[ScreenedRotor]) -> Option<Mistaken> {
    if rotors.iter().any(|rotor| rotor.number() > ROTORS && rotor.turns()) {
        return None;
    }
    let attitude = Attitude::of(log, log.column(columns::BODY_RATE)?);
    checks::BODY_UNITS.iter().find_map(|check| check(&attitude))
}

impl ScreenedChannel {
    /// Empties its cells that are no measurements in the cleaned log.
    fn take_out(&self, raw: &Dataset, cleaned: &mut Option<Dataset>) {
        if self.left_out().next().is_none() {
            return;
        }
        let mut values = raw.column(&self.name).unwrap_or_default().to_vec();
        self.left_out().for_each(|row| values[row] = f64::NAN);
        // As long as the column it replaces.
        let _ = cleaned.get_or_insert_with(|| raw.clone()).replace(&self.name, values);
    }
}

impl ScreenedLog {
    /// Judges a log.
    #[must_use]
    pub fn of(log: &Dataset) -> Self {
        Self::from(log.clone())
    }

    /// The log as it was read.
    #[must_use]
    pub fn raw(&self) -> &Dataset {
        &self.0.raw
    }

    /// The log with every cell missing that is no measurement; a battery that is not connected or saturated has none.
    #[must_use]
    pub fn dataset(&self) -> &Dataset {
        self.0.cleaned.as_ref().unwrap_or(&self.0.raw)
    }

    /// Where it came from: a file name, or a few words.
    #[must_use]
    pub fn source_name(&self) -> &str {
        self.0.raw.source_name()
    }

    /// The channels that were looked at.
    #[must_use]
    pub fn channels(&self) -> &[ScreenedChannel] {
        &self.0.channels
    }

    /// The channel of this name.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&ScreenedChannel> {
        self.0.channels.iter().find(|channel| channel.name == name)
    }

    /// The rotors whose commands and rates it holds.
    pub fn rotors(&self) -> impl Iterator<Item = &ScreenedRotor> {
        self.0.rotors.iter().filter(|rotor| rotor.is_measured())
    }

    /// The rotor of this number, from 1, where the log holds its commands and rates.
    #[must_use]
    pub fn rotor(&self, number: usize) -> Option<&ScreenedRotor> {
        self.rotors().find(|rotor| rotor.number() == number)
    }

    /// The rotor of this number, from 1, where the log holds its commands, its rates measured or not.
    #[must_use]
    pub fn commanded(&self, number: usize) -> Option<&ScreenedRotor> {
        self.0.rotors.iter().find(|rotor| rotor.number() == number)
    }

    /// The rotors whose thrusts and rates it holds.
    #[must_use]
    pub fn thrusts(&self) -> &[ScreenedThrust] {
        &self.0.thrusts
    }

    /// The thrust of the rotor of this number, from 1, where the log holds it and the rate.
    #[must_use]
    pub fn thrust(&self, number: usize) -> Option<&ScreenedThrust> {
        self.0.thrusts.iter().find(|thrust| thrust.number() == number)
    }

    /// The body, by what is best known of what drives it.
    #[must_use]
    pub fn body(&self) -> Option<&ScreenedBody> {
        self.0.body.as_ref()
    }

    /// The body as driven by the commands of both rotors alone.
    #[must_use]
    pub fn chain(&self) -> Option<&ScreenedBody> {
        self.0.chain.as_ref()
    }

    /// Of each row why a channel of the body is not scored: what was found in its cell, or what is not known of what drives the
    /// body; `None` of a row that is scored, and of one whose cell is empty.
    #[must_use]
    pub fn body_reasons(&self, name: &str) -> Vec<Option<&'static str>> {
        let mut reasons = vec![None; self.raw().len()];
        let found = self.channel(name).map_or(&[][..], |channel| &channel.judgements);
        // A row has the first reason that was found.
        for judged in found.iter().rev() {
            judged
                .rows
                .iter()
                .chain(&judged.biased)
                .for_each(|row| reasons[*row] = Some(judged.finding.code));
        }
        let values = self.dataset().column(name).unwrap_or_default().iter().enumerate();
        for (row, _) in values.filter(|(_, value)| value.is_finite()) {
            reasons[row] = self.body().and_then(|body| body.reason(row));
        }
        reasons
    }

    /// What was found in its cells, channel by channel.
    pub fn channel_findings(&self) -> impl Iterator<Item = &Finding> {
        self.0.channels.iter().flat_map(|channel| &channel.judgements).map(|judged| &judged.finding)
    }

    /// What was found in its rotors. Of one that stood all the time nothing is said beside others.
    pub fn rotor_findings(&self) -> impl Iterator<Item = &Finding> {
        let any_turns = self.0.rotors.iter().any(ScreenedRotor::turns);
        let concerned = self.0.rotors.iter().filter(move |rotor| !any_turns || rotor.turns());
        concerned.flat_map(ScreenedRotor::findings)
    }

    /// What can hardly be what its name says, by itself: its columns, those of these rotors, where they turn, and its body's.
    pub(crate) fn suspicions(&self, rotors: &[usize]) -> impl Iterator<Item = Suspicion> {
        let concerned = self.rotors().filter(|rotor| rotor.turns() && rotors.contains(&rotor.number()));
        let of_rotors = concerned.flat_map(ScreenedRotor::suspicions).cloned();
        self.0.columns.iter().cloned().chain(of_rotors).chain(self.units().map(Mistaken::suspicion))
    }

    /// What is wrong with the units of time and body.
    pub(crate) fn units(&self) -> Option<&Mistaken> {
        self.0.units.as_ref()
    }

    /// What was found in its columns, each as a whole, and in their names.
    pub fn column_findings(&self) -> impl Iterator<Item = &Finding> {
        self.0.columns.iter().map(|it| &it.finding)
    }

    /// What was found in its body: its units, whether it was held, where it stood at a stop.
    pub fn body_findings(&self) -> impl Iterator<Item = &Finding> {
        let of_body = self.body().into_iter().flat_map(|body| body.findings().iter().chain(body.remarks()));
        self.units().map(Mistaken::finding).into_iter().chain(of_body)
    }

    /// What was found in it: its columns' names, its channels, its rotors, its body.
    pub fn findings(&self) -> impl Iterator<Item = &Finding> {
        let of_columns = self.column_findings().chain(self.channel_findings());
        of_columns.chain(self.rotor_findings()).chain(self.body_findings())
    }

    /// Any of its columns as it was logged, and what is remarked of it; `None` where the log has none of this name.
    #[must_use]
    pub(crate) fn look_at<'a>(&'a self, name: &'a str) -> Option<(CheckedColumn<'a>, Vec<Remark>)> {
        let judged = self.channel(name).map_or(&[][..], |channel| &channel.judgements);
        let column = CheckedColumn::of(self.raw(), name, judged)?;
        let remarks = checks::COLUMN.iter().flat_map(|check| check(&column)).collect();
        Some((column, remarks))
    }

    /// Why nothing in it can be compared.
    #[must_use]
    pub fn nothing_scored(&self) -> ScreeningError {
        let has_a_part = self.rotors().next().is_some() || self.body().is_some();
        let reasons: Vec<&'static str> = self.findings().map(|finding| finding.code).collect();
        if has_a_part && !reasons.is_empty() {
            ScreeningError::NothingScored { log: self.source_name().to_owned(), reasons }
        } else {
            ScreeningError::nothing_in_common(&[self.dataset()])
        }
    }
}

/// Judges several logs.
#[must_use]
pub fn screened(logs: &[Dataset]) -> Vec<ScreenedLog> {
    logs.iter().map(ScreenedLog::of).collect()
}
