//! The body of a log, judged once: the rows at which its rate and angle are held against a model, and why the others are not.
//!
//! A body goes on from where it was by what drives it. So a row is scored where it is known, without a hole, what drove the
//! body, from the row before on or to the row behind:
//!
//! - **Measured rotor rates** drive it whatever the rotors were commanded, and at standstill, too, where they make no thrust. A
//!   gap in the readings of one rotor that is longer than a straight line may bridge ends the stretch: what is made up in it
//!   is no torque that was there.
//! - **A torque command** is held until the next, as all commands are; where one is missing, the stretch ends.
//! - **Commands of rotors that nobody measured** drive it through the model of the rotors: the rows of [`ScreenedRotor`] in which
//!   the commands are known, and not those in which a rotor stands or starts, for which that model has no law.
//!
//! Rows that a check takes out (`BODY_ROWS`) end a stretch, under the code of its finding: a body that stands at a **stop** is not free.
//! One that was **held still** answers to nothing, and none of its rows says anything (`body_held_still`).

use std::borrow::Cow;
use std::ops::Range;

use super::Finding;
use super::body::CheckedBody;
use super::channel::{Judgement, rates_of_both};
use super::checks;
use super::checks::body_held_still::BODY_HELD;
use super::left_out::{COMMANDS_MISSING, HOLES, LeftOut, ROTOR_RATE_MISSING, STANDSTILL};
use super::missing_commands;
use super::readings;
use super::rotor_data::held;
use super::screened_rotor::ScreenedRotor;
use crate::log::Dataset;
use crate::log::segments::common;
use crate::signal::ROTORS;
use crate::signal::columns::{BODY_RATE, TORQUE_COMMAND};
use crate::threads::spread;

/// What drives the body of a log, by what is best known of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DrivenBy {
    /// The rates of both rotors, as they were measured.
    MeasuredRates,
    /// A commanded torque.
    TorqueCommand,
    /// The commands of rotors whose rates were not all measured, through a model of them.
    Commands,
}

impl DrivenBy {
    /// A name for files and findings.
    #[must_use]
    pub fn code(self) -> &'static str {
        match self {
            Self::MeasuredRates => "measured_rotor_rates",
            Self::TorqueCommand => "torque_command",
            Self::Commands => "predicted_rotor_rates",
        }
    }
}

/// The body of a log, and which of its rows are scored.
#[derive(Debug, Clone)]
pub struct ScreenedBody {
    driven_by: DrivenBy,
    stretches: Vec<Range<usize>>,
    left_out: LeftOut,
    torque: Option<Vec<f64>>,
    checked: Checked,
}

/// What the checks made of a body.
#[derive(Debug, Clone)]
struct Checked {
    /// What they found in it as a whole.
    found: Vec<Finding>,
    /// What they found in its rows, and say of its columns.
    said: Vec<Finding>,
    /// Of each that took rows out: the others.
    free: Vec<FreeRows>,
}

/// Rows in which a check takes the body for free.
#[derive(Debug, Clone)]
struct FreeRows {
    rows: Vec<Range<usize>>,
    /// The code of its finding: why the other rows are not scored.
    code: &'static str,
}

impl FreeRows {
    /// Of a log of `count` rows; `None` where the check took none out.
    fn of(judged: &Judgement, count: usize) -> Option<Self> {
        let mut is_free = vec![true; count];
        judged.rows.iter().chain(&judged.biased).for_each(|row| is_free[*row] = false);
        let rows = runs(count, |row| is_free[row]);
        is_free.contains(&false).then_some(Self { rows, code: judged.finding.code })
    }
}

impl Checked {
    fn of(body: &CheckedBody) -> Self {
        let found: Vec<Finding> = checks::BODY.iter().filter_map(|check| check(body)).collect();
        // Of a body that was held nothing more is to be said.
        let of_rows = if found.is_empty() { checks::BODY_ROWS } else { &[] };
        let judged: Vec<Judgement> = of_rows.iter().filter_map(|check| check(body)).collect();
        let free = judged.iter().filter_map(|judged| FreeRows::of(judged, body.log.len())).collect();
        Self { found, said: judged.into_iter().map(|judged| judged.finding).collect(), free }
    }
}

/// One of what drives the body.
struct Input<'a> {
    /// Rows in which it is known.
    known: Vec<Range<usize>>,
    /// The code of the others.
    lacks: &'static str,
    /// A rotor that is modelled.
    modelled: Option<&'a ScreenedRotor>,
}

impl<'a> Input<'a> {
    fn measured(log: &Dataset, rates: &[f64]) -> Self {
        let carried = readings::carried(log.time(), rates);
        let known = runs(carried.len(), |row| carried[row].is_finite());
        Self { known, lacks: ROTOR_RATE_MISSING, modelled: None }
    }

    fn commanded(rotor: &'a ScreenedRotor) -> Self {
        Self { known: rotor.stretches().to_vec(), lacks: COMMANDS_MISSING, modelled: Some(rotor) }
    }

    /// A torque, and each of its commands held until the next.
    fn torque(log: &Dataset, torque: &[f64]) -> (Self, Vec<f64>) {
        let mut segments = log.segments();
        for segment in &mut segments {
            segment.start = segment.clone().find(|&row| torque[row].is_finite()).unwrap_or(segment.end);
        }
        segments.retain(|segment| segment.len() > 1);
        // Whether one is missing is asked of commands, which go up to one.
        let greatest =
            torque.iter().filter(|it| it.is_finite()).fold(f64::MIN_POSITIVE, |most, it| most.max(it.abs()));
        let commands: Vec<f64> = torque.iter().map(|torque| torque / greatest).collect();
        let known = missing_commands::find(log.time(), &commands, &segments).known;
        (Self { known, lacks: COMMANDS_MISSING, modelled: None }, held(torque, &segments).into_owned())
    }
}

impl ScreenedBody {
    /// Judges the body of a log whose channels and rotors were judged, as driven by what is best known; `None` when the log has
    /// no body rate, or nothing that drives it.
    pub(crate) fn of(log: &Dataset, rotors: &[ScreenedRotor]) -> Option<Self> {
        let body_rate = log.column(BODY_RATE)?;
        let rates = rates_of_both(log);
        let body =
            CheckedBody { log, rate: body_rate, rotors: rotors.iter().map(ScreenedRotor::data).collect() };
        let checked = Checked::of(&body);
        if let [Some(first), Some(second)] = rates {
            let inputs = spread(&[first, second], |rates| Input::measured(log, rates));
            return Some(Self::driven(log, inputs, DrivenBy::MeasuredRates, checked));
        }
        if let Some(torque) = log.column(TORQUE_COMMAND) {
            let (input, torque) = Input::torque(log, torque);
            let body = Self::driven(log, vec![input], DrivenBy::TorqueCommand, checked);
            return Some(Self { torque: Some(torque), ..body });
        }
        let input = |(number, rates): (usize, Option<&[f64]>)| match rates {
            Some(rates) => Some(Input::measured(log, rates)),
            None => rotors.iter().find(|rotor| rotor.number() == number).map(Input::commanded),
        };
        let inputs: Option<Vec<Input>> = (1..=ROTORS).zip(rates).map(input).collect();
        Some(Self::driven(log, inputs?, DrivenBy::Commands, checked))
    }

    /// The same as driven by the commands of both rotors, whatever else is known; `None` when they are not.
    pub(crate) fn commanded(&self, log: &Dataset, rotors: &[ScreenedRotor]) -> Option<Self> {
        let rotor = |number| rotors.iter().find(|rotor| rotor.number() == number);
        let inputs: Option<Vec<Input>> =
            (1..=ROTORS).map(|number| rotor(number).map(Input::commanded)).collect();
        Some(Self::driven(log, inputs?, DrivenBy::Commands, self.checked.clone()))
    }

    fn driven(log: &Dataset, mut inputs: Vec<Input>, driven_by: DrivenBy, checked: Checked) -> Self {
        let free = checked.free.iter();
        inputs.extend(free.map(|it| Input { known: it.rows.clone(), lacks: it.code, modelled: None }));
        let segments = log.segments();
        let each = inputs.iter().map(|input| &input.known[..]);
        let stretches = each.fold(segments.clone(), |known, input| common(&known, input));
        /// Of each row a place in the table of codes, which is shorter: a code itself takes twice as much as a channel's cell.
        const SCORED: u8 = u8::MAX;
        let mut codes = vec![HOLES];
        let mut why = vec![0; log.len()];
        segments.into_iter().filter(|rows| rows.len() > 1).for_each(|rows| why[rows].fill(SCORED));
        let mut leave_out = |rows: &mut dyn Iterator<Item = usize>, code| {
            let place = codes.len() as u8;
            codes.push(code);
            rows.for_each(|row| {
                if why[row] == SCORED {
                    why[row] = place;
                }
            });
        };
        for input in &inputs {
            leave_out(&mut beside(&input.known, log.len()), input.lacks);
            if let Some(rotor) = input.modelled {
                leave_out(&mut (0..log.len()).filter(|row| rotor.rests(*row)), STANDSTILL);
            }
        }
        // A row alone between two gaps.
        leave_out(&mut beside(&stretches, log.len()), HOLES);
        let left_out = LeftOut::of(why.into_iter().map(|place| codes.get(usize::from(place)).copied()));
        Self { driven_by, stretches, left_out, torque: None, checked }
    }

    /// Scores no row that is not scored in the log that it is a part of: `rows` are its own in it.
    pub(crate) fn keep_to(&mut self, whole: &Self, rows: &[usize]) {
        for &FreeRows { code, .. } in &whole.checked.free {
            let free = runs(rows.len(), |row| whole.left_out.reason(rows[row]) != Some(code));
            self.stretches = common(&self.stretches, &free);
            // A part of this one asks for what was known of the whole, too.
            self.checked.free.push(FreeRows { rows: free, code });
        }
        self.left_out = self.left_out.and_of(&whole.left_out, rows);
        self.checked.found.clone_from(&whole.checked.found);
        self.checked.said.clone_from(&whole.checked.said);
    }

    /// What drives it.
    #[must_use]
    pub fn driven_by(&self) -> DrivenBy {
        self.driven_by
    }

    /// Whether it was held still: it answers to nothing.
    #[must_use]
    pub fn is_held(&self) -> bool {
        self.has(BODY_HELD)
    }

    /// Stretches of rows without a hole over which it is known what drives it; a simulation starts anew with each.
    #[must_use]
    pub fn stretches(&self) -> &[Range<usize>] {
        &self.stretches
    }

    /// Why neither rate nor angle is scored in a row: a code; `None` where they are, if they were measured.
    #[must_use]
    pub fn reason(&self, row: usize) -> Option<&'static str> {
        self.checked.found.first().map(|finding| finding.code).or_else(|| self.left_out.reason(row))
    }

    /// What was found in it as a whole; then none of its rows is scored.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.checked.found
    }

    /// What was found in some of its rows, and what is said of its columns.
    #[must_use]
    pub fn remarks(&self) -> &[Finding] {
        &self.checked.said
    }

    /// Whether a check found this.
    #[must_use]
    pub fn has(&self, code: &str) -> bool {
        self.checked.found.iter().chain(&self.checked.said).any(|finding| finding.code == code)
    }

    /// A channel of the body, not-a-number in the rows in which what drives it is not known.
    pub(crate) fn driven_rows<'a>(&self, values: &'a [f64]) -> Cow<'a, [f64]> {
        self.left_out.blank(values)
    }

    /// [N m] the commanded torque that drives it, each command held until the next; empty where something else does.
    pub(crate) fn torque(&self) -> &[f64] {
        self.torque.as_deref().unwrap_or_default()
    }
}

/// Runs of the rows up to `end` of which this is true.
fn runs(end: usize, is: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for row in (0..end).filter(|row| is(*row)) {
        match runs.last_mut() {
            Some(run) if run.end == row => run.end = row + 1,
            _ => runs.push(row..row + 1),
        }
    }
    runs
}

/// Rows up to `end` that are in none of the ranges, which ascend.
fn beside(ranges: &[Range<usize>], end: usize) -> impl Iterator<Item = usize> + '_ {
    let starts = std::iter::once(0).chain(ranges.iter().map(|rows| rows.end));
    let ends = ranges.iter().map(|rows| rows.start).chain([end]);
    starts.zip(ends).flat_map(|(start, end)| start..end)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::screening::ScreenedLog;

    const ROWS: usize = 600;

    /// 100 Hz, two rotors that change their shares every 0.2 s, and a body that follows, without what `names` does not have.
    fn log(names: &[&str], change: impl Fn(&str, usize, f64) -> f64) -> ScreenedLog {
        let time: Vec<f64> = (0..ROWS).map(|row| 0.01 * row as f64).collect();
        let mut log = Dataset::new("log.csv", "", time).expect("time rises");
        let share = |row: usize| if row / 20 * 7 % 5 > 1 { 0.06 } else { -0.06 };
        let mut turning = 0.0;
        let body: Vec<f64> = (0..ROWS)
            .map(|row| {
                turning += 0.3 * share(row);
                turning
            })
            .collect();
        for name in names {
            let value = |row: usize| match *name {
                "command_1" => 0.5 + share(row),
                "command_2" => 0.5 - share(row),
                "propeller_rate_1_rad_s" => 1300.0 * (0.5 + share(row)) + (row * 37 % 11) as f64,
                "propeller_rate_2_rad_s" => 1300.0 * (0.5 - share(row)) + (row * 29 % 13) as f64,
                TORQUE_COMMAND => share(row),
                _ => body[row] + 1e-4 * (row * 31 % 17) as f64,
            };
            log.insert(*name, (0..ROWS).map(|row| change(name, row, value(row))).collect()).expect("fits");
        }
        log.into()
    }

    fn reasons(log: &ScreenedLog, rows: [usize; 4]) -> [Option<&'static str>; 4] {
        rows.map(|row| log.body().expect("a body").reason(row))
    }

    const RATES: [&str; 5] =
        ["command_1", "command_2", "propeller_rate_1_rad_s", "propeller_rate_2_rad_s", BODY_RATE];

    #[test]
    fn measured_rates_drive_it_where_both_are_known_at_standstill_too() {
        let log = log(&RATES, |name, row, value| match name {
            "propeller_rate_2_rad_s" if (200..203).contains(&row) || (300..320).contains(&row) => f64::NAN,
            "command_1" | "propeller_rate_1_rad_s" if (400..500).contains(&row) => 0.0,
            _ => value,
        });
        let body = log.body().expect("a body");
        assert_eq!((body.driven_by(), body.is_held()), (DrivenBy::MeasuredRates, false));
        // Three rows are a straight line, twenty are not.
        assert_eq!(body.stretches(), [0..300, 320..ROWS]);
        assert_eq!(reasons(&log, [201, 299, 310, 450]), [None, None, Some(ROTOR_RATE_MISSING), None]);
        // Through the modelled rotors it is another question: what was commanded is known, what stands is not.
        let chain = log.chain().expect("commanded");
        assert_eq!(
            [310, 450, 545, 560].map(|row| chain.reason(row)),
            [None, Some(STANDSTILL), Some(STANDSTILL), None]
        );
    }

    #[test]
    fn rotors_that_nobody_measured_drive_it_where_commands_are_known_and_they_turn() {
        let names = ["command_1", "command_2", BODY_RATE];
        let log = log(&names, |name, row, value| match name {
            "command_2" if (200..203).contains(&row) => f64::NAN,
            "command_1" if (400..500).contains(&row) => 0.0,
            _ => value,
        });
        let body = log.body().expect("a body");
        assert_eq!(body.driven_by(), DrivenBy::Commands);
        assert_eq!(
            reasons(&log, [150, 202, 450, 560]),
            [None, Some(COMMANDS_MISSING), Some(STANDSTILL), None]
        );
    }

    /// Two checks that take out rows of their own: each is the reason of its rows, in a part of the log and in a part of that, too.
    #[test]
    fn rows_that_checks_take_out_have_the_code_of_the_first_as_their_reason() {
        let log = log(&RATES, |_, _, value| value);
        let body = |log: &Dataset, free: Vec<FreeRows>| {
            let checked = Checked { found: Vec::new(), said: Vec::new(), free };
            ScreenedBody::driven(log, Vec::new(), DrivenBy::MeasuredRates, checked)
        };
        let taken = |code, rows: Range<usize>| Judgement::new(Finding::new(code, BODY_RATE), rows.collect());
        let judged = [taken("one", 100..150), taken("other", 140..200), taken("none", 0..0)];
        let free = judged.iter().filter_map(|judged| FreeRows::of(judged, ROWS)).collect();
        let whole = body(log.dataset(), free);
        assert_eq!(whole.stretches(), [0..100, 200..ROWS]);
        let reasons = |body: &ScreenedBody, rows: [usize; 4]| rows.map(|row| body.reason(row));
        assert_eq!(reasons(&whole, [99, 100, 149, 150]), [None, Some("one"), Some("one"), Some("other")]);
        assert_eq!(reasons(&whole, [199, 200, 0, 599]), [Some("other"), None, None, None]);
        let part_of = |whole: &ScreenedBody, log: &Dataset, rows: Range<usize>| {
            let log = log.of_rows(std::slice::from_ref(&rows));
            let mut part = body(&log, Vec::new());
            part.keep_to(whole, &rows.collect::<Vec<_>>());
            (part, log)
        };
        let (part, log) = part_of(&whole, log.dataset(), 120..300);
        assert_eq!(part.stretches(), std::slice::from_ref(&(80..180)));
        assert_eq!(reasons(&part, [29, 30, 79, 80]), [Some("one"), Some("other"), Some("other"), None]);
        let (part, _) = part_of(&part, &log, 60..180);
        assert_eq!(part.stretches(), std::slice::from_ref(&(20..120)));
        assert_eq!(reasons(&part, [0, 19, 20, 119]), [Some("other"), Some("other"), None, None]);
    }

    #[test]
    fn a_torque_command_is_held_until_one_is_missing() {
        let log = log(&[TORQUE_COMMAND, BODY_RATE], |name, row, value| {
            if name == TORQUE_COMMAND && (200..203).contains(&row) { f64::NAN } else { 1e-3 * value }
        });
        assert_eq!(log.body().expect("a body").driven_by(), DrivenBy::TorqueCommand);
        assert_eq!(reasons(&log, [199, 200, 202, 203]), [None, None, Some(COMMANDS_MISSING), None]);
        // Every other row has one: that is their pace.
        let slow = self::log(&[TORQUE_COMMAND, BODY_RATE], |name, row, value| {
            if name == TORQUE_COMMAND && row % 2 == 1 { f64::NAN } else { value }
        });
        assert_eq!(slow.body().expect("a body").stretches(), std::slice::from_ref(&(0..ROWS)));
        assert!(slow.body().expect("a body").torque().iter().all(|torque| torque.is_finite()));
    }
}
