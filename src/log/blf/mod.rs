//! The binary log of Vector's tools (BLF): frames of a bus, in compressed containers.
//!
//! A channel is called by its number, from 1, as Vector's tools do. Stamps are in the clock of the machine that recorded.

mod frame;
#[cfg(test)]
mod tests;

use std::io::Read as _;
use std::path::Path;

use super::bytes::Bytes;
use super::candump::CandumpFrame;
use super::format::{FormatError, Start};
use super::tables::Skipped;
use crate::cancel;

/// Name of the format, as its users call it.
pub const NAME: &str = "Vector BLF";

/// How a file and how an object in it begin.
const FILE: [u8; 4] = *b"LOGG";
const OBJECT: [u8; 4] = *b"LOBJ";

/// [byte] Between objects there is padding, of fewer than these.
const PADDING: usize = 8;

/// [byte] An object that says it is larger is damaged; one with a frame is smaller by far.
const LARGEST_OBJECT: usize = 1 << 20;
const LARGEST_FRAME: usize = 4096;

/// Frames that stand in fewer bytes of a file than a part in this are no recording of a bus.
const MOST_EXPANSION: usize = 64;

/// Kinds of objects.
const CONTAINER: u32 = 10;

/// Whether a file that begins so is one.
#[must_use]
pub fn recognises(start: &Start) -> bool {
    start.bytes.starts_with(&FILE)
}

/// The frames in `bytes`, and what was left out; `path` is for messages.
///
/// # Errors
/// [`FormatError`] when there is no frame in it.
pub fn read(path: &Path, bytes: &[u8]) -> Result<(Vec<CandumpFrame>, Vec<Skipped>), FormatError> {
    let damaged = |reason: &str| FormatError::Damaged {
        path: path.to_owned(),
        format: NAME,
        byte: 0,
        reason: reason.to_owned(),
    };
    let (header_size, start_ns) = file_header(bytes).ok_or_else(|| damaged("its header is missing"))?;
    let mut blf = Blf { start_ns, most: bytes.len().saturating_mul(MOST_EXPANSION), ..Blf::default() };
    let mut at = header_size;
    while at < bytes.len() {
        cancel::check();
        let Some(found) = next_object(bytes, at) else {
            if !is_padding(bytes.get(at..).unwrap_or_default()) {
                blf.skip("cut_off", at);
            }
            break;
        };
        if found > at + PADDING {
            blf.skip("damaged_bytes", at);
        }
        at = found;
        match object(bytes, at) {
            Some(Object { kind: CONTAINER, body, end, .. }) => {
                blf.container(body, at);
                at = end;
            }
            // Without containers the objects lie in the file itself.
            Some(found) => {
                blf.frame(&found, at);
                at = found.end;
            }
            None => {
                let more = next_object(bytes, at + OBJECT.len());
                blf.skip(if more.is_some() { "damaged_bytes" } else { "cut_off" }, at);
                at = more.unwrap_or(bytes.len());
            }
        }
        if blf.expanded > blf.most {
            return Err(damaged("its containers hold more than a recording of a bus can"));
        }
    }
    if !blf.tail.is_empty() {
        blf.skip("cut_off", bytes.len());
    }
    if blf.frames.is_empty() {
        return Err(damaged("there is no frame in it"));
    }
    Ok((blf.frames, blf.skipped))
}

/// Length of the file's header and [ns] the start of the recording since 1970, in the clock that it was written by.
fn file_header(bytes: &[u8]) -> Option<(usize, u64)> {
    /// Where the start is said.
    const START: usize = 40;
    let mut fields = Bytes::new(bytes.strip_prefix(&FILE)?);
    let size = usize::try_from(fields.u32()?).ok()?;
    let mut fields = Bytes::new(bytes.get(START..)?);
    let mut next = || fields.u16().map(u64::from);
    let (year, month, _, day) = (next()?, next()?, next()?, next()?);
    let (hour, minute, second, millisecond) = (next()?, next()?, next()?, next()?);
    let is_date = (1970..2200).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
    let seconds = is_date.then(|| 86_400 * days(year, month, day) + 3600 * hour + 60 * minute + second);
    Some((size.max(START), seconds.map_or(0, |seconds| 1_000_000_000 * seconds + 1_000_000 * millisecond)))
}

/// Days from 1970 to a date of the Gregorian calendar.
fn days(year: u64, month: u64, day: u64) -> u64 {
    // Counted from March on, a leap day is a year's last.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let of_years = 365 * year + year / 4 - year / 100 + year / 400;
    (of_years + (153 * month + 2) / 5 + day).saturating_sub(719_469)
}

/// Where the next object begins.
fn next_object(bytes: &[u8], at: usize) -> Option<usize> {
    let rest = bytes.get(at..)?;
    rest.windows(OBJECT.len()).position(|window| window == OBJECT).map(|offset| at + offset)
}

/// Whether these last bytes only fill up.
fn is_padding(bytes: &[u8]) -> bool {
    bytes.len() < PADDING && bytes.iter().all(|byte| *byte == 0)
}

/// An object of the file.
struct Object<'a> {
    kind: u32,
    version: u16,
    /// What follows the part of its header that all have.
    body: &'a [u8],
    end: usize,
}

/// The object at `at`; `None` where it does not end within `bytes`, or cannot be one.
fn object(bytes: &[u8], at: usize) -> Option<Object<'_>> {
    let mut fields = Bytes::new(bytes.get(at..)?);
    fields.take(OBJECT.len())?;
    let (_, version, size, kind) = (fields.u16()?, fields.u16()?, fields.u32()?, fields.u32()?);
    let size = usize::try_from(size).ok()?;
    let end = at.checked_add(size)?;
    let body = bytes.get(at + fields.at()..end)?;
    Some(Object { kind, version, body, end })
}

/// A file under way.
#[derive(Default)]
struct Blf {
    start_ns: u64,
    /// The beginning of an object that the next container goes on with.
    tail: Vec<u8>,
    /// [byte] So many the containers had in all, and how many are believed.
    expanded: usize,
    most: usize,
    frames: Vec<CandumpFrame>,
    skipped: Vec<Skipped>,
}

impl Blf {
    fn skip(&mut self, code: &'static str, at: usize) {
        Skipped::count(&mut self.skipped, code, "", at as u64);
    }

    /// Takes in the container whose body begins in the object at `at` of the file.
    fn container(&mut self, body: &[u8], at: usize) {
        let Some(whole) = expand(body, self.most.saturating_sub(self.expanded)) else {
            self.skip("damaged_container", at);
            self.tail.clear();
            return;
        };
        self.expanded += whole.len();
        let mut bytes = std::mem::take(&mut self.tail);
        bytes.extend_from_slice(&whole);
        let mut here = 0;
        while let Some(found) = next_object(&bytes, here) {
            if found > here + PADDING {
                self.skip("damaged_bytes", at);
            }
            match object(&bytes, found) {
                Some(object) if object.end > found + OBJECT.len() => {
                    self.frame(&object, at);
                    here = object.end;
                }
                None if may_go_on(&bytes, found) => {
                    here = found;
                    break;
                }
                _ => {
                    self.skip("damaged_bytes", at);
                    here = found + OBJECT.len();
                }
            }
        }
        // Fewer bytes than a mark has may be the first of one.
        let rest = bytes.split_off(here.min(bytes.len()));
        self.tail = if is_padding(&rest) { Vec::new() } else { rest };
    }

    /// Takes in an object, where it is a frame.
    fn frame(&mut self, object: &Object, at: usize) {
        if !frame::KINDS.contains(&object.kind) {
            return;
        }
        let Some((channel, mut frame)) = frame::parse(object.kind, object.version, object.body) else {
            self.skip("damaged_frame", at);
            return;
        };
        frame.stamp_ns = frame.stamp_ns.saturating_add(self.start_ns);
        self.frames.push(CandumpFrame { interface: channel.to_string(), frame });
    }
}

/// Whether the object at `at`, which `bytes` does not hold whole, may go on in the next container.
fn may_go_on(bytes: &[u8], at: usize) -> bool {
    let mut fields = Bytes::new(bytes.get(at + OBJECT.len()..).unwrap_or_default());
    let head = (fields.u32(), fields.u32(), fields.u32());
    let (Some(_), Some(size), Some(kind)) = head else { return true };
    let most = if frame::KINDS.contains(&kind) { LARGEST_FRAME } else { LARGEST_OBJECT };
    usize::try_from(size).is_ok_and(|size| size <= most)
}

/// What a container holds, up to `most` bytes.
fn expand(body: &[u8], most: usize) -> Option<Vec<u8>> {
    let mut fields = Bytes::new(body);
    let method = fields.u16()?;
    fields.take(6)?;
    let size = usize::try_from(fields.u32()?).ok()?;
    fields.take(4)?;
    match method {
        0 => Some(fields.rest().to_vec()),
        2 => {
            let mut whole = Vec::new();
            let most = (size as u64).min(most as u64) + 1;
            flate2::read::ZlibDecoder::new(fields.rest()).take(most).read_to_end(&mut whole).ok()?;
            Some(whole)
        }
        _ => None,
    }
}
