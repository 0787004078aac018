//! The log of `candump -L`: what can-utils' `canplayer` and python-can read back.

use std::path::{Path, PathBuf};

use socketcan::dump::{CanDumpRecord, Reader};
use socketcan::{
    CanAnyFrame, CanDataFrame, CanErrorFrame, CanFdFrame, CanRemoteFrame, EmbeddedFrame, ExtendedId,
    Frame as _, Id, StandardId, id::FdFlags,
};

use super::limits;
use crate::recording::raw_frame::{FrameFlags, RawFrame};

/// Why a candump log cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CandumpError {
    /// The file system said no.
    #[error("{path}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A line is none of `candump -L`.
    #[error("{path}, line {line}: {reason} (this is not a log of `candump -L`)")]
    Line {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
}

/// A frame of a candump log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CandumpFrame {
    /// Interface it was seen on.
    pub interface: String,
    /// The frame; its stamp is the log's, in ns since 1970.
    pub frame: RawFrame,
}

/// The line of `frame` at `wall_ns` (CLOCK_REALTIME), always with six decimals; `None` for what no bus can carry.
#[must_use]
pub fn emit(frame: &RawFrame, wall_ns: u64, interface: &str) -> Option<String> {
    let frame = any_frame(frame)?;
    let line = CanDumpRecord { t_us: wall_ns / 1000, device: interface.to_owned(), frame, direction: None };
    Some(line.to_string())
}

fn any_frame(frame: &RawFrame) -> Option<CanAnyFrame> {
    let data = frame.payload();
    if frame.is(FrameFlags::ERROR) {
        return CanErrorFrame::new_error(frame.id, data).ok().map(CanAnyFrame::Error);
    }
    let id: Id = if frame.is(FrameFlags::EXTENDED) {
        ExtendedId::new(frame.id)?.into()
    } else {
        StandardId::new(u16::try_from(frame.id).ok()?)?.into()
    };
    if frame.is(FrameFlags::REMOTE) {
        return CanRemoteFrame::new_remote(id, usize::from(frame.length)).map(CanAnyFrame::Remote);
    }
    if !frame.is(FrameFlags::FD) {
        return CanDataFrame::new(id, data).map(CanAnyFrame::Normal);
    }
    let mut flags = FdFlags::FDF;
    flags.set(FdFlags::BRS, frame.is(FrameFlags::BIT_RATE_SWITCH));
    flags.set(FdFlags::ESI, frame.is(FrameFlags::ERROR_STATE));
    CanFdFrame::with_flags(id, data, flags).map(CanAnyFrame::Fd)
}

/// Parses one line.
///
/// # Errors
/// What is wrong with it.
pub fn parse(line: &str) -> Result<CandumpFrame, String> {
    let record = Reader::from_reader(line.as_bytes()).next_record().map_err(|error| error.to_string())?;
    let record = record.ok_or("the line is empty")?;
    let flags = match &record.frame {
        CanAnyFrame::Normal(_) => 0,
        CanAnyFrame::Remote(_) => FrameFlags::REMOTE,
        CanAnyFrame::Error(_) => FrameFlags::ERROR,
        CanAnyFrame::Fd(fd) => {
            let flag = |set: bool, flag: u32| if set { flag } else { 0 };
            FrameFlags::FD
                | flag(fd.is_brs(), FrameFlags::BIT_RATE_SWITCH)
                | flag(fd.is_esi(), FrameFlags::ERROR_STATE)
        }
    };
    let extended = if record.frame.is_extended() { FrameFlags::EXTENDED } else { 0 };
    let sent =
        if record.direction == Some(socketcan::dump::Direction::Transmitted) { FrameFlags::SENT } else { 0 };
    let id = match &record.frame {
        CanAnyFrame::Error(error) => error.error_bits(),
        other => other.raw_id(),
    };
    let extended = if flags == FrameFlags::ERROR { 0 } else { extended };
    let length = if flags == FrameFlags::REMOTE { record.frame.dlc() } else { record.frame.data().len() };
    let mut frame = RawFrame {
        stamp_ns: record.t_us.saturating_mul(1000),
        hardware_ns: 0,
        id,
        flags: flags | extended | sent,
        length: length as u8,
        data: [0; 64],
    };
    for (to, from) in frame.data.iter_mut().zip(record.frame.data()) {
        *to = *from;
    }
    Ok(CandumpFrame { interface: record.device, frame })
}

/// Reads a whole log.
///
/// # Errors
/// [`CandumpError`] with the line.
pub fn read(path: &Path) -> Result<Vec<CandumpFrame>, CandumpError> {
    let text = limits::read(path)
        .and_then(|bytes| {
            String::from_utf8(bytes)
                .map_err(|_| std::io::Error::new(std::io::ErrorKind::InvalidData, "not UTF-8 text"))
        })
        .map_err(|source| CandumpError::File { path: path.to_owned(), source })?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    lines
        .map(|(index, line)| {
            parse(line).map_err(|reason| CandumpError::Line {
                path: path.to_owned(),
                line: index + 1,
                reason,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines as can-utils writes them, and python-can reads them (checked with both).
    const LINES: [&str; 8] = [
        "(1735270496.916858) can0 110#00112233",
        "(1735270509.245511) vcan0 00000117#0000C738",
        "(1735270588.036508) can0 120##500112233445566778899AABB",
        "(1735270588.036508) can0 120##4",
        "(1735279041.257318) can1 104#R",
        "(1735279048.349278) can1 110#R4",
        "(1469439874.299654) can1 104#",
        "(1785099856.000007) can1 20000004#000C000000000000",
    ];

    #[test]
    fn lines_come_back_as_they_were() {
        for line in LINES {
            let parsed = parse(line).expect(line);
            let emitted = emit(&parsed.frame, parsed.frame.stamp_ns, &parsed.interface).expect(line);
            assert_eq!(emitted, line);
        }
        let error = parse(LINES[7]).expect("an error frame").frame;
        assert_eq!((error.id, error.flags, error.payload()[1]), (4, FrameFlags::ERROR, 0x0c));
        let fd = parse(LINES[2]).expect("an FD frame").frame;
        assert_eq!((fd.flags, fd.length), (FrameFlags::FD | FrameFlags::BIT_RATE_SWITCH, 12));
    }

    #[test]
    fn what_no_bus_can_carry_has_no_line() {
        assert_eq!(emit(&RawFrame { id: 0x800, ..RawFrame::default() }, 0, "can0"), None);
        assert_eq!(emit(&RawFrame { length: 9, ..RawFrame::default() }, 0, "can0"), None);
    }

    #[test]
    fn other_lines_are_refused() {
        for line in ["", "hello", "(1.0) can0 110#0", "(1735270496.916858) can0 8000#00", "(x) can0 1#00"] {
            assert!(parse(line).is_err(), "{line}");
        }
    }
}
