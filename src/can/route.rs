//! One message in its roles: which of its signals are bound to which field, and how to read and write them.

use std::fmt;

use crate::signal::Health;

use super::codec::SignalCodec;
use super::counter::{Counter, beyond};
use super::database::needs_fd;
use super::frame::{Frame, FrameKind, Id, Payload};

#[cfg(test)]
mod tests;

/// Why a frame or a value was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameRefusal {
    /// No role names the identifier, or it is a remote request.
    UnknownId,
    /// The identifier of our own command, from another sender.
    ForeignCommand,
    /// The right identifier with the wrong number of bytes.
    WrongLength,
    /// The sender's counter repeated, went back or jumped too far; of a transfer: its number came twice.
    Counter,
    /// A frame of a transfer came twice, or one before it is missing.
    Toggle,
    /// A transfer is not what its checksum says.
    Checksum,
    /// A frame of a transfer whose beginning is missing, or that was not ended in time.
    Incomplete,
    /// Not a number, or infinite.
    NotANumber,
    /// Outside the allowed range.
    OutOfRange,
    /// A second node says what one says already.
    OtherNode,
}

impl FrameRefusal {
    /// The bit of [`Health`] a refused value gets.
    pub(super) fn health(self) -> u32 {
        match self {
            Self::UnknownId
            | Self::ForeignCommand
            | Self::WrongLength
            | Self::Toggle
            | Self::Checksum
            | Self::Incomplete
            | Self::OtherNode => 0,
            Self::Counter => Health::COUNTER,
            Self::NotANumber => Health::NOT_A_NUMBER,
            Self::OutOfRange => Health::OUT_OF_RANGE,
        }
    }
}

impl fmt::Display for FrameRefusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::UnknownId => "unknown identifier",
            Self::ForeignCommand => "command of another sender",
            Self::WrongLength => "wrong length",
            Self::Counter => "counter",
            Self::Toggle => "toggle bit",
            Self::Checksum => "checksum",
            Self::Incomplete => "incomplete transfer",
            Self::NotANumber => "not a number",
            Self::OutOfRange => "out of range",
            Self::OtherNode => "a second node",
        })
    }
}

/// A value read from a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FrameReading {
    /// Good, in SI.
    Value(f64),
    /// Bad.
    Refused(FrameRefusal),
}

/// A DBC signal bound to a field.
#[derive(Debug, Clone, PartialEq)]
pub struct Binding<F> {
    /// The field it feeds or carries.
    pub field: F,
    /// Its name in the DBC file.
    pub signal: String,
    /// Its unit, as the role reads it.
    pub unit: String,
    /// Its place and scaling in the DBC file.
    pub codec: SignalCodec,
    /// SI value = DBC value * `scale` + `offset`.
    pub scale: f64,
    /// Offset in SI after scaling.
    pub offset: f64,
    /// Least and greatest allowed value in SI.
    pub range: (f64, f64),
    /// By how much a value may miss the range.
    pub(super) slack: f64,
    /// The multiplexers above it, with the raw values that select it; the nearest first.
    pub(super) selectors: Vec<(SignalCodec, Vec<(u64, u64)>)>,
}

/// A message with its bound signals.
#[derive(Debug, Clone, PartialEq)]
pub struct Route<F> {
    /// Name in the DBC file, with the node where one is substituted.
    pub name: String,
    /// Identifier on the bus.
    pub id: Id,
    /// Bytes of payload.
    pub length: usize,
    /// Bytes of payload that a received frame must have: `length` on a bus, what its signals need in a capture.
    pub(super) least_length: usize,
    /// [s] period at which it is sent.
    pub period_s: f64,
    /// Name and place of its counter.
    pub counter: Option<(String, SignalCodec)>,
    /// Whether its DBC file keeps a node in the identifier and no role says which: then it is the file's own.
    pub lacks_node: bool,
    pub(super) bindings: Vec<Binding<F>>,
    /// Whether everything it carries can be put together in one word and written at once; see [`Routes::new`].
    pub(super) is_one_word: bool,
}

impl<F: Copy> Binding<F> {
    /// The value in SI, or why not; `None` when the payload does not carry the signal.
    #[inline]
    pub(super) fn read(&self, payload: &Payload) -> Option<FrameReading> {
        for (multiplexer, values) in &self.selectors {
            let raw = multiplexer.decode_raw(payload);
            if !values.iter().any(|(first, last)| (*first..=*last).contains(&raw)) {
                return None;
            }
        }
        let value = self.codec.decode(payload) * self.scale + self.offset;
        Some(if !value.is_finite() {
            FrameReading::Refused(FrameRefusal::NotANumber)
        } else if value < self.range.0 - self.slack || value > self.range.1 + self.slack {
            FrameReading::Refused(FrameRefusal::OutOfRange)
        } else {
            FrameReading::Value(value)
        })
    }

    /// What the receiver understands when 0 is sent.
    pub(super) fn zero_as_sent(&self) -> f64 {
        let raw = self.codec.unscale(-self.offset / self.scale);
        self.codec.scale(raw) * self.scale + self.offset
    }

    #[inline]
    fn write(&self, payload: &mut Payload, value: f64) {
        for (multiplexer, values) in &self.selectors {
            if let Some((first, _)) = values.first() {
                multiplexer.encode_raw(payload, *first);
            }
        }
        self.codec.encode(payload, (value - self.offset) / self.scale);
    }
}

impl<F: Copy> Route<F> {
    /// Its signals in their roles.
    #[must_use]
    pub fn bindings(&self) -> &[Binding<F>] {
        &self.bindings
    }

    /// Whether it can only be sent as CAN FD.
    #[must_use]
    pub fn needs_fd(&self) -> bool {
        needs_fd(self.length)
    }

    /// Frames missing before this one; [`FrameRefusal::Counter`] when it does not go on from the one before.
    #[inline]
    pub(super) fn check_counter(&self, counter: &mut Counter, frame: &Frame) -> Result<u64, FrameRefusal> {
        let Some((_, codec)) = &self.counter else { return Ok(0) };
        let mask = u64::MAX >> (64 - codec.layout().size);
        counter.accept(codec.decode_raw(frame.payload()), mask).ok_or(FrameRefusal::Counter)
    }

    /// Has the counter of the next frame go on behind that of another sender's `frame`, see [`beyond`].
    pub(super) fn go_on_behind(&self, next: &mut u64, frame: &Frame) {
        let Some((_, codec)) = &self.counter else { return };
        let mask = u64::MAX >> (64 - codec.layout().size);
        *next = beyond(*next, codec.decode_raw(frame.payload()), mask);
    }

    /// The frame with these values, its counter stepped.
    #[inline]
    pub(super) fn emit(&self, counter: &mut u64, value: impl Fn(F) -> f64) -> Frame {
        let mut frame = Frame::zeros(self.id, self.kind(), self.length);
        if self.is_one_word {
            let mut word = 0;
            for binding in &self.bindings {
                let value = (value(binding.field) - binding.offset) / binding.scale;
                word |= binding.codec.encode_in_first_word(value);
            }
            if let Some((_, codec)) = &self.counter {
                word |= codec.in_first_word(*counter);
                *counter = counter.wrapping_add(1);
            }
            frame.payload_mut()[..8].copy_from_slice(&word.to_le_bytes());
            return frame;
        }
        for binding in &self.bindings {
            binding.write(frame.payload_mut(), value(binding.field));
        }
        if let Some((_, codec)) = &self.counter {
            codec.encode_raw(frame.payload_mut(), *counter);
            *counter = counter.wrapping_add(1);
        }
        frame
    }

    /// Bytes that hold its bound signals, what selects them, and its counter.
    fn bytes_of_signals(&self) -> usize {
        let selectors = |binding: &Binding<F>| {
            binding.selectors.iter().map(|(multiplexer, _)| multiplexer.least_length()).max().unwrap_or(0)
        };
        let bindings = self.bindings.iter().map(|it| it.codec.least_length().max(selectors(it)));
        bindings.chain(self.counter.iter().map(|(_, codec)| codec.least_length())).max().unwrap_or(0)
    }

    /// Whether all its signals lie in the first eight bytes, each in bits of its own, and always.
    fn fits_one_word(&self) -> bool {
        let bound = self.bindings.iter().map(|binding| &binding.codec);
        let mut taken = 0;
        bound.chain(self.counter.iter().map(|(_, codec)| codec)).all(|codec| {
            let bits = if codec.is_in_first_word() { codec.in_first_word(u64::MAX) } else { 0 };
            let is_own = bits != 0 && bits & taken == 0;
            taken |= bits;
            is_own
        }) && self.bindings.iter().all(|binding| binding.selectors.is_empty())
    }

    fn kind(&self) -> FrameKind {
        if self.needs_fd() {
            FrameKind::Fd { bit_rate_switch: true, error_state: false }
        } else {
            FrameKind::Classic
        }
    }
}

/// Messages by identifier: a table for 11 bits, a sorted list for 29.
#[derive(Debug, Clone)]
pub(super) struct Routes<F> {
    messages: Vec<Route<F>>,
    standard: Box<[u16]>,
    extended: Vec<(u32, u16)>,
}

/// No message has this 11-bit identifier.
const NONE: u16 = u16::MAX;

impl<F: Copy> Routes<F> {
    /// The messages, sorted by priority here.
    pub(super) fn new(mut messages: Vec<Route<F>>) -> Self {
        // The base identifier's 11 bits decide first; at a tie the 11-bit frame wins.
        messages.sort_by_key(|route| match route.id {
            Id::Standard(short) => (u32::from(short), None),
            Id::Extended(long) => (long >> 18, Some(long)),
        });
        for route in &mut messages {
            route.is_one_word = route.fits_one_word();
        }
        let mut standard = vec![NONE; 0x800].into_boxed_slice();
        let mut extended = Vec::new();
        for (index, route) in messages.iter().enumerate() {
            let index = u16::try_from(index).unwrap_or(NONE);
            match route.id {
                Id::Standard(short) => {
                    if let Some(entry) = standard.get_mut(usize::from(short)) {
                        *entry = index;
                    }
                }
                Id::Extended(long) => extended.push((long, index)),
            }
        }
        extended.sort_unstable();
        Self { messages, standard, extended }
    }

    /// The same for frames of a capture, which may be shorter as long as they hold all that is read of them: the file that
    /// describes a message today may name bytes that the sender of that day had not.
    pub(super) fn of_capture(&self) -> Self {
        let mut routes = self.clone();
        for route in &mut routes.messages {
            route.least_length = route.bytes_of_signals();
        }
        routes
    }

    pub(super) fn messages(&self) -> &[Route<F>] {
        &self.messages
    }

    /// Whether it is a data frame with the identifier of one of these messages, whatever its length.
    pub(super) fn has(&self, frame: &Frame) -> bool {
        !matches!(self.find(frame), Err(FrameRefusal::UnknownId))
    }

    /// The message of a received frame, if a role names it and its length is right.
    #[inline]
    pub(super) fn find(&self, frame: &Frame) -> Result<(usize, &Route<F>), FrameRefusal> {
        let index = match frame.id() {
            Id::Standard(short) => self.standard.get(usize::from(short)).copied(),
            Id::Extended(long) => {
                let found = self.extended.binary_search_by_key(&long, |(id, _)| *id).ok();
                found.and_then(|place| self.extended.get(place)).map(|(_, index)| *index)
            }
        };
        let index = usize::from(index.unwrap_or(NONE));
        match self.messages.get(index) {
            Some(_) if frame.kind() == FrameKind::Remote => Err(FrameRefusal::UnknownId),
            Some(route) if (route.least_length..=route.length).contains(&frame.length()) => {
                Ok((index, route))
            }
            Some(_) => Err(FrameRefusal::WrongLength),
            None => Err(FrameRefusal::UnknownId),
        }
    }
}
