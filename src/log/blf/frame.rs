//! The objects of a BLF file that hold a frame of the bus.

use crate::log::bytes::Bytes;
use crate::recording::raw_frame::{FrameFlags, RawFrame};

/// Kinds of objects that hold a frame.
const CLASSIC: u32 = 1;
const ERROR_EXTENDED: u32 = 73;
const CLASSIC_2: u32 = 86;
const FD: u32 = 100;
const FD_64: u32 = 101;

/// All of them.
pub(super) const KINDS: [u32; 5] = [CLASSIC, CLASSIC_2, ERROR_EXTENDED, FD, FD_64];

/// Channel and frame of an object; its stamp counts from the start of the recording.
pub(super) fn parse(kind: u32, version: u16, body: &[u8]) -> Option<(u16, RawFrame)> {
    let mut fields = Bytes::new(body);
    let flags = fields.u32()?;
    fields.take(4)?;
    let stamp = fields.u64()?;
    fields.take(match version {
        1 => 0,
        2 => 8,
        _ => return None,
    })?;
    // Units of 10 µs, or of 1 ns.
    let stamp_ns = if flags == 1 { stamp.saturating_mul(10_000) } else { stamp };
    let (channel, mut frame) = match kind {
        CLASSIC | CLASSIC_2 => classic(&mut fields)?,
        FD => fd(&mut fields)?,
        FD_64 => fd_64(&mut fields)?,
        // What the controller saw, the kernel of a bench would say otherwise: that there was an error is all.
        _ => (fields.u16()?, RawFrame { flags: FrameFlags::ERROR, ..RawFrame::default() }),
    };
    frame.stamp_ns = stamp_ns;
    Some((channel, frame))
}

/// The frame of an identifier as the objects have it.
fn identified(id: u32, flags: u32) -> RawFrame {
    let extended = if id & 1 << 31 != 0 { FrameFlags::EXTENDED } else { 0 };
    RawFrame { id: id & 0x1fff_ffff, flags: flags | extended, ..RawFrame::default() }
}

fn flag(set: bool, flag: u32) -> u32 {
    if set { flag } else { 0 }
}

fn classic(fields: &mut Bytes) -> Option<(u16, RawFrame)> {
    let (channel, flags, length, id) = (fields.u16()?, fields.u8()?, fields.u8()?, fields.u32()?);
    let is_remote = flags & 0x80 != 0;
    let mut frame =
        identified(id, flag(flags & 1 != 0, FrameFlags::SENT) | flag(is_remote, FrameFlags::REMOTE));
    frame.length = length.min(8);
    let data = fields.array::<8>()?;
    fill(&mut frame, if is_remote { &[] } else { &data });
    Some((channel, frame))
}

fn fd(fields: &mut Bytes) -> Option<(u16, RawFrame)> {
    let (channel, flags, code, id) = (fields.u16()?, fields.u8()?, fields.u8()?, fields.u32()?);
    fields.take(5)?;
    let (fd_flags, valid) = (fields.u8()?, fields.u8()?);
    fields.take(5)?;
    let data = fields.take(usize::from(valid).min(64))?;
    let shape = Shape {
        sent: flags & 1 != 0,
        remote: flags & 0x80 != 0,
        fd: fd_flags & 1 != 0,
        bit_rate_switch: fd_flags & 2 != 0,
        error_state: fd_flags & 4 != 0,
    };
    Some((channel, shape.frame(id, code, valid, data)))
}

fn fd_64(fields: &mut Bytes) -> Option<(u16, RawFrame)> {
    let (channel, code, valid, _) = (fields.u8()?, fields.u8()?, fields.u8()?, fields.u8()?);
    let id = fields.u32()?;
    fields.take(4)?;
    let flags = fields.u32()?;
    fields.take(18)?;
    let (direction, _extra) = (fields.u8()?, fields.u8()?);
    fields.take(4)?;
    // More may be valid than is there: the rest is zero.
    let data = fields.rest().get(..usize::from(valid)).unwrap_or(fields.rest());
    let shape = Shape {
        sent: direction != 0,
        remote: flags & 0x10 != 0,
        fd: flags & 0x1000 != 0,
        bit_rate_switch: flags & 0x2000 != 0,
        error_state: flags & 0x4000 != 0,
    };
    Some((u16::from(channel), shape.frame(id, code, valid, data)))
}

/// What the flags of an FD object say.
struct Shape {
    sent: bool,
    remote: bool,
    fd: bool,
    bit_rate_switch: bool,
    error_state: bool,
}

impl Shape {
    fn frame(&self, id: u32, code: u8, valid: u8, data: &[u8]) -> RawFrame {
        let fd = FrameFlags::FD
            | flag(self.bit_rate_switch, FrameFlags::BIT_RATE_SWITCH)
            | flag(self.error_state, FrameFlags::ERROR_STATE);
        let kind = if self.remote { FrameFlags::REMOTE } else { flag(self.fd, fd) };
        let mut frame = identified(id, kind | flag(self.sent, FrameFlags::SENT));
        frame.length = match (self.remote, self.fd) {
            (true, _) => code.min(8),
            (false, true) => valid.min(64),
            (false, false) => valid.min(8),
        };
        fill(&mut frame, if self.remote { &[] } else { data });
        frame
    }
}

/// Puts in as much of `data` as the frame has.
fn fill(frame: &mut RawFrame, data: &[u8]) {
    let length = usize::from(frame.length);
    for (to, from) in frame.data.iter_mut().zip(data.iter().take(length)) {
        *to = *from;
    }
}
