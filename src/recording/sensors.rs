//! The message of everything measured: a field for each row of the table of sensors, in its order.

use std::fmt::Write as _;

use super::cdr::{CdrField, CdrMessage, Emitter, NestedDefinitions, Parser, envelope};
use crate::signal::{Channel, Sample, Sensor, Sensors};

/// Channels of the first recordings. Messages of old files end behind them or behind a later sensor; what they lack was never
/// measured.
const FIRST_EDITION: usize = 12;

impl CdrMessage for Sensors {
    const NAME: &'static str = "Sensors";

    fn fields_text() -> String {
        let mut text =
            String::from("uint64 sequence # publications from 1\nuint64 stamp_ns # ns, CLOCK_MONOTONIC\n");
        for sensor in Sensor::ALL {
            let count = sensor.channels().len();
            let array = if count > 1 { format!("[{count}]") } else { String::new() };
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}{array} {} # {}", Sample::type_name(), sensor.name(), sensor.unit());
        }
        text
    }
}

impl CdrField for Sensors {
    fn type_name() -> String {
        Self::NAME.to_owned()
    }

    fn define(into: &mut NestedDefinitions) {
        into.add::<Self>();
        Sample::define(into);
    }

    fn emit(&self, to: &mut Emitter<'_>) {
        emit(self, &Channel::ALL, to);
    }

    fn parse(from: &mut Parser<'_>) -> Option<Self> {
        let sequence = CdrField::parse(from)?;
        let stamp_ns = CdrField::parse(from)?;
        let mut sensors = Self { sequence, stamp_ns, ..Self::default() };
        let mut read = 0;
        for sensor in Sensor::ALL {
            if read >= FIRST_EDITION && from.is_at_end() {
                break;
            }
            for channel in sensor.channels() {
                *channel.of_mut(&mut sensors) = CdrField::parse(from)?;
            }
            read += sensor.channels().len();
        }
        Some(sensors)
    }

    fn numbers(&self, name: &str, with: &mut dyn FnMut(String, u64, String)) {
        let dot = if name.is_empty() { "" } else { "." };
        self.sequence.numbers(&format!("{name}{dot}sequence"), with);
        self.stamp_ns.numbers(&format!("{name}{dot}stamp_ns"), with);
        for sensor in Sensor::ALL {
            let field = sensor.name();
            for (place, channel) in sensor.channels().iter().enumerate() {
                let index = if sensor.channels().len() > 1 { format!("[{place}]") } else { String::new() };
                channel.of(self).numbers(&format!("{name}{dot}{field}{index}"), with);
            }
        }
    }
}

fn emit(sensors: &Sensors, channels: &[Channel], to: &mut Emitter<'_>) {
    sensors.sequence.emit(to);
    sensors.stamp_ns.emit(to);
    channels.iter().for_each(|channel| channel.of(sensors).emit(to));
}

/// Replaces the content of `into` by the message without the later sensors at its end that never gave a value: the same bytes as
/// before there were such sensors.
pub fn encode_given(sensors: &Sensors, into: &mut Vec<u8>) {
    let given = Channel::ALL.iter().rposition(|channel| channel.of(sensors).stamp_ns != 0);
    let length = given.map_or(0, |last| last + 1).max(FIRST_EDITION);
    envelope(into, |to| emit(sensors, Channel::ALL.get(..length).unwrap_or(&[]), to));
}

#[cfg(test)]
mod tests {
    use super::super::cdr::{CdrError, decode, encode, schema};
    use super::*;

    /// What the first program wrote, and what its files have as the schema.
    #[test]
    fn the_first_edition_stays_the_beginning_of_the_message() {
        let first = "uint64 sequence # publications from 1\n\
                     uint64 stamp_ns # ns, CLOCK_MONOTONIC\n\
                     Sample body_rate # rad/s\n\
                     Sample body_angle # rad\n\
                     Sample[3] acceleration # m/s^2\n\
                     Sample battery_voltage # V\n\
                     Sample[2] propeller_rate # rad/s\n\
                     Sample[2] current # A\n\
                     Sample[2] thrust # N\n";
        assert!(schema::<Sensors>().starts_with(first), "{}", schema::<Sensors>());
    }

    /// Refused, that is, unless it ends where that of an older program did: behind a whole sensor that came later.
    #[test]
    fn every_short_message_is_refused() {
        let ends: Vec<usize> = (0..=Sensor::ALL.len())
            .map(|sensors| Sensor::ALL[..sensors].iter().map(|sensor| sensor.channels().len()).sum())
            .filter(|channels| *channels >= FIRST_EDITION)
            .map(|channels: usize| 4 + 16 + 24 * channels)
            .collect();
        let mut bytes = Vec::new();
        encode(&Sensors::default(), &mut bytes);
        assert_eq!(ends.last(), Some(&bytes.len()));
        for length in 0..=bytes.len() {
            let read = decode::<Sensors>(&bytes[..length]);
            let refused = Err(CdrError { message: "Sensors", length });
            assert_eq!(read, if ends.contains(&length) { Ok(Sensors::default()) } else { refused });
        }
    }

    #[test]
    fn a_message_of_the_first_edition_is_read_and_written_again_to_the_bit() {
        let mut sensors = Sensors { sequence: 3, stamp_ns: 4, ..Sensors::default() };
        for (count, channel) in (1..).zip(Channel::ALL.into_iter().take(FIRST_EDITION)) {
            *channel.of_mut(&mut sensors) = Sample::good(f64::from(count).sqrt(), u64::from(count), count);
        }
        let (mut old, mut new) = (Vec::new(), Vec::new());
        encode_given(&sensors, &mut old);
        encode(&sensors, &mut new);
        // Representation header, two u64, and a sample of two u64 and two u32 for each channel.
        assert_eq!(old.len(), 4 + 16 + 24 * FIRST_EDITION);
        assert!(new.starts_with(&old));
        assert_eq!(decode::<Sensors>(&old), Ok(sensors));
        assert_eq!(decode::<Sensors>(&new), Ok(sensors));
    }
}
