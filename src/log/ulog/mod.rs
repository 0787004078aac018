//! The log of PX4, ULog: topics, several instances of some, each with a clock of its own. The file defines what they hold.
//!
//! A table is called as its topic, `battery_status`, and from the second instance on `battery_status[1]`. A nested message with
//! a stamp of its own is a table, too, with the rows in which that stamp is new: PX4 repeats what each ESC said last whenever
//! any ESC speaks. Those of `esc_status` are called by their motor, `esc_status.motor[0]`, like `actuator_motors.control[0]`.
//! A field without any value is no column. Time is since the autopilot was started.

mod columns;
mod layout;
mod messages;
#[cfg(test)]
mod tests;

use super::format::{FormatError, LogFormat, ReadRequest, Start};
use super::tables::Tables;
use messages::UlogFile;

/// PX4's ULog.
pub struct Ulog;

/// How a file begins, before its version and the time of its start.
const MAGIC: [u8; 7] = *b"ULog\x01\x12\x35";

impl LogFormat for Ulog {
    fn name(&self) -> &'static str {
        "PX4 ULog"
    }

    fn recognises(&self, start: &Start) -> bool {
        start.bytes.starts_with(&MAGIC)
    }

    fn mapping(&self) -> Option<&'static str> {
        Some(include_str!("../mappings/ulog.toml"))
    }

    fn read(&self, request: &ReadRequest) -> Result<Tables, FormatError> {
        let damaged = |reason: &str| FormatError::Damaged {
            path: request.path.to_owned(),
            format: self.name(),
            byte: 0,
            reason: reason.to_owned(),
        };
        if !request.bytes.starts_with(&MAGIC) {
            return Err(damaged("it begins otherwise"));
        }
        if let Some(part) = request.part.filter(|part| *part != 1) {
            return Err(FormatError::Part { path: request.path.to_owned(), part, parts: 1 });
        }
        let UlogFile { topics, notes: mut tables, refused, .. } = UlogFile::read(request.bytes);
        if let Some(reason) = refused {
            return Err(FormatError::Unusable { path: request.path.to_owned(), reason });
        }
        if topics.iter().all(|topic| topic.rows.is_empty()) {
            return Err(damaged("no topic in it has a row"));
        }
        for topic in &topics {
            columns::add(request.bytes, topic, request.wants, &mut tables);
        }
        Ok(tables)
    }
}
