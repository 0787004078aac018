//! A mapping whose range of commands ends before the log's does: what lies above it is cut, and becomes full command.

use serde::Serialize;

use super::mapping::SignalMapping;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::{median, quantile};
use crate::unit::Unit;

/// Commands above the range that a mapping cuts them to, where the rotor went on answering.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NarrowRange {
    /// The signal.
    pub signal: String,
    /// The column that it is read from, or several.
    pub column: String,
    /// Values above the range.
    pub above: usize,
    /// Their share of all values [-].
    pub share: f64,
    /// Numbers of the file at which the range begins, at which it ends, and to which the log goes.
    pub from_to_log: [f64; 3],
    /// [rad/s] the rate where the range ends, and at the top of what lies above; `null` in a log without rates.
    pub rates_rad_s: Option<[f64; 2]>,
    /// `scale` with which the mapping reaches as far as the log.
    pub scale: f64,
    /// `offset` beside it.
    pub offset: f64,
}

impl NarrowRange {
    /// What is to be said of commands `raw`, in SI and not yet cut, beside the rates of their rotor.
    pub(super) fn of(
        signal: &SignalMapping,
        unit: Option<Unit>,
        raw: &[f64],
        rates: Option<&[f64]>,
    ) -> Option<Self> {
        let [low, high] = signal.clamp?;
        let all = raw.iter().filter(|value| value.is_finite()).count();
        let above = || raw.iter().copied().filter(|value| *value > high);
        let share = above().count() as f64 / all.max(1) as f64;
        // A single glitch is no end of a range.
        let greatest = quantile(above(), THRESHOLDS.narrow_end)?;
        if share < THRESHOLDS.narrow_share {
            return None;
        }
        let rates_rad_s = match rates {
            Some(rates) => Some(rates_beside(raw, rates, [low, high, greatest])?),
            None => None,
        };
        let scaled = |value: f64| unit.map_or(value, |unit| (value - unit.offset) / unit.scale);
        let number = |value: f64| (scaled(value) - signal.offset) / signal.scale;
        let from_to_log = [low, high, greatest].map(number);
        let scale = (scaled(high) - scaled(low)) / (from_to_log[2] - from_to_log[0]);
        Some(Self {
            signal: signal.name.clone(),
            column: signal.columns().join("`, `"),
            above: above().count(),
            share,
            from_to_log,
            rates_rad_s,
            scale,
            offset: scaled(low) - scale * from_to_log[0],
        })
    }
}

/// The rates where a range ends and at the top of what lies above it; `None` where they do not differ, or one of them was not measured.
fn rates_beside(raw: &[f64], rates: &[f64], [low, high, greatest]: [f64; 3]) -> Option<[f64; 2]> {
    let part = THRESHOLDS.narrow_part * (greatest - high);
    let near = high - THRESHOLDS.narrow_near * (high - low);
    let rate_of = |is_there: &dyn Fn(f64) -> bool| {
        median(raw.iter().zip(rates).filter(|(value, _)| is_there(**value)).map(|(_, rate)| rate.abs()))
    };
    let end = rate_of(&|value| value >= near && value <= high + part)?;
    let top = rate_of(&|value| value >= greatest - part)?;
    ((top - end).abs() > THRESHOLDS.narrow_rate * top.max(end)).then_some([end, top])
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::log::Mapping;
    use crate::log::mapped::parse;

    /// Pulses from 1000 µs in steps up to `most`, a rate that goes on rising until `full`, and one row of a glitch.
    fn found(most: u32, full: u32, has_rate: bool) -> Vec<NarrowRange> {
        let mut text = String::from("t,esc,rate\n");
        for row in 0..400 {
            let pulse = 1000 + (row / 20 * 100) % (most - 900);
            let rate = if has_rate { (pulse.min(full) - 1000).to_string() } else { String::new() };
            text += &format!("{row},{},{rate}\n", if row == 7 { 65_535 } else { pulse });
        }
        let mut mapping =
            String::from("[time]\ncolumn = \"t\"\n[[signal]]\nname = \"command_1\"\ncolumn = \"esc\"\n");
        mapping += "unit = \"-\"\nscale = 0.001\noffset = -1.0\nclamp = [0.0, 1.0]\n";
        if has_rate {
            mapping += "[[signal]]\nname = \"propeller_rate_1_rad_s\"\ncolumn = \"rate\"\nunit = \"rad/s\"\n";
        }
        let mapping = Mapping::parse(&mapping, Path::new("m.toml")).expect("a mapping");
        parse(text.as_bytes(), Path::new("log.csv"), &mapping, None).expect("a log").1.narrow_ranges
    }

    #[test]
    fn a_range_that_ends_while_the_rate_rises_is_said_with_the_one_that_holds() {
        let all = found(2300, 2300, true);
        let [it] = &all[..] else { panic!("{all:?}") };
        assert_eq!((it.signal.as_str(), it.column.as_str()), ("command_1", "esc"));
        for (number, wanted) in it.from_to_log.into_iter().zip([1000.0, 2000.0, 2300.0]) {
            assert!((number - wanted).abs() < 1e-6, "{it:?}");
        }
        assert_eq!(it.rates_rad_s, Some([1000.0, 1300.0]));
        assert!(
            (it.scale - 1.0 / 1300.0).abs() < 1e-9 && (it.offset + 1000.0 / 1300.0).abs() < 1e-6,
            "{it:?}"
        );
    }

    #[test]
    fn a_range_that_holds_all_that_the_rotor_answers_is_not_spoken_of() {
        assert_eq!(found(2300, 2000, true), [], "the rate has come to its end");
        assert_eq!(found(2000, 2000, true), [], "a glitch");
        assert_eq!(found(2300, 2300, false).len(), 1, "no rate says that it has");
    }
}
