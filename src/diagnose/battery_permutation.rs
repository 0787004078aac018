//! Whether a law that reads the battery knows anything of it: where another stretch of the reading does as well, it does not.
//!
//! What such a law adds has the shape of the commands whatever the battery does, and with few levels it may lie well by
//! chance. [`surrogate`] shifts command and battery together and cannot see that. Here the reading alone is shifted, round the end of
//! its log, and everything is fitted again.
//!
//! [`surrogate`]: super::surrogate_test::surrogate

use super::block_data::{BlockData, Runs};
use super::candidate_set::Candidate;
use super::progress::SearchEvent;
use super::search_result::SearchResult;
use super::search_space::Search;
use super::thresholds::THRESHOLDS;
use crate::effect::Law;
use crate::log::Cells;
use crate::log::signals::MOST_ROTORS;
use crate::model::Effect;
use crate::signal::Channel;
use crate::threads::spread;

/// Whether a law reads the battery.
pub(crate) fn reads(effect: &Effect) -> bool {
    match &effect.law {
        Law::Expression(expression) => expression.names(Channel::BatteryVoltage.name()),
        _ => effect.needs.iter().any(|need| need == Channel::BatteryVoltage.column()),
    }
}

/// The same data with each rotor's battery reading shifted by a share of all its logs, one behind the other: what goes beyond
/// the end comes first. A level that one log has and the others have not is shifted, too.
fn shifted(data: &BlockData, share: f64) -> BlockData {
    let mut copy = data.clone();
    let Runs::Rotor(runs) = &mut copy.runs else { return copy };
    for rotor in 0..MOST_ROTORS {
        let readings = runs.iter_mut().filter(|run| run.rotor == rotor);
        let mut readings: Vec<&mut Cells> = readings.filter_map(|run| run.voltage.as_mut()).collect();
        let mut volts: Vec<f64> = readings.iter().flat_map(|reading| reading.iter().copied()).collect();
        let by = (share * volts.len() as f64) as usize;
        volts.rotate_left(by);
        let mut left = volts.into_iter();
        for cell in readings.iter_mut().flat_map(|reading| reading.iter_mut()) {
            *cell = left.next().unwrap_or(*cell);
        }
    }
    copy
}

impl Search<'_> {
    /// How often a shifted reading does as well as the battery's own for what an answer's laws make of it, counted as
    /// (1 + as good) / (1 + tried), and their ids. `None` where none does; where no law reads the battery, the base does, too,
    /// or numbers of the base alone do as well: they would make up for any reading.
    pub(crate) fn battery_p_value(&self, found: &SearchResult) -> Option<(f64, Vec<String>)> {
        let (split, answer) = (&found.split, &found.answer);
        let of = |ids: &[String]| self.lookup(ids).into_iter().filter(|effect| reads(effect)).collect();
        let readers: Vec<&Effect> = of(&answer.effects);
        let base: Vec<String> = self.base.effects.iter().map(|effect| effect.id.clone()).collect();
        let of_base: Vec<&Effect> = of(&base);
        // Shifted under the base's own law, too, the reading would always do worse.
        let base_reads = self.base.actuator.voltage_gain != 0.0 || !of_base.is_empty();
        let is_instead = found.refitted.fit.cost <= THRESHOLDS.nearly_as_well * answer.fit.cost;
        if readers.is_empty() || !split.train.is_rotor() || base_reads || is_instead {
            return None;
        }
        let few = (split.train.len() > THRESHOLDS.battery_samples).then(|| {
            let share = split.train.len().div_ceil(THRESHOLDS.battery_samples);
            split.train.in_short_pieces(share)
        });
        let data = few.as_ref().unwrap_or(&split.train);
        let candidate = Candidate {
            effects: self.lookup(&answer.effects),
            ..self.start(&answer.model, &split.base_parameters(self.base))
        };
        let own = candidate.cost_on(data, &answer.model, None);
        let shift = |index: usize| {
            THRESHOLDS.least_battery_shift
                + (1.0 - 2.0 * THRESHOLDS.least_battery_shift) * (index as f64 + 0.5)
                    / THRESHOLDS.battery_surrogates as f64
        };
        let shifts: Vec<f64> = (0..THRESHOLDS.battery_surrogates).map(shift).collect();
        let does_as_well = spread(&shifts, |shift| {
            // A goal a little above: at it a fit must not stop short.
            let cost = candidate.cost_on(
                &shifted(data, *shift),
                &answer.model,
                Some(THRESHOLDS.nearly_as_well * own),
            );
            (self.progress)(SearchEvent::Fitted);
            cost <= (1.0 + THRESHOLDS.converged_cost) * own
        });
        let as_good = does_as_well.into_iter().filter(|it| *it).count();
        let ids = readers.into_iter().map(|effect| effect.id.clone()).collect();
        let p_value = (1 + as_good) as f64 / (1 + THRESHOLDS.battery_surrogates) as f64;
        (p_value > THRESHOLDS.battery_significance_level).then_some((p_value, ids))
    }
}

#[cfg(test)]
mod tests {
    use super::super::rotor_block::rotor_runs;
    use super::*;
    use crate::log::Dataset;
    use crate::signal::columns::{BATTERY_VOLTAGE, PROPELLER_RATES};

    #[test]
    fn a_reading_is_shifted_round_the_end_of_its_log_across_holes() {
        let mut time: Vec<f64> = (0..100).map(|row| 0.01 * f64::from(row)).collect();
        time[60..].iter_mut().for_each(|time| *time += 1.0);
        let (command, rates) = (vec![0.5; 100], vec![600.0; 100]);
        let volts = (100..200).map(f64::from).collect();
        let log = Dataset::made(
            time,
            [("command_1", command), (PROPELLER_RATES[0], rates), (BATTERY_VOLTAGE, volts)],
        );
        let data = BlockData::new(Runs::Rotor(rotor_runs(&[log.into()])));
        let Runs::Rotor(runs) = shifted(&data, 0.3).runs else { panic!("of rotors") };
        assert_eq!(runs.len(), 2, "a hole");
        let volts: Vec<f64> =
            runs.iter().flat_map(|run| run.voltage.clone().unwrap_or_default().to_vec()).collect();
        let expected: Vec<f64> = (130..200).chain(100..130).map(f64::from).collect();
        assert_eq!(volts, expected);
    }

    /// A supply set to one voltage in one log and to another in the next.
    #[test]
    fn a_level_of_one_log_is_shifted_into_another() {
        let log = |volts: f64| {
            let time: Vec<f64> = (0..100).map(|row| 0.01 * f64::from(row)).collect();
            let values = [("command_1", 0.5), (PROPELLER_RATES[0], 600.0), (BATTERY_VOLTAGE, volts)];
            Dataset::made(time, values.map(|(name, value)| (name, vec![value; 100])))
        };
        let data = BlockData::new(Runs::Rotor(rotor_runs(&[log(12.6).into(), log(11.0).into()])));
        let Runs::Rotor(runs) = shifted(&data, 0.5).runs else { panic!("of rotors") };
        let volts: Vec<Option<Cells>> = runs.into_iter().map(|run| run.voltage).collect();
        assert_eq!(volts, [Some(vec![11.0; 100].into()), Some(vec![12.6; 100].into())]);
    }
}
