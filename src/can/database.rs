//! DBC files: read, checked, compiled. `can-dbc` gives the syntax tree; everything it lets pass is checked here.

use std::collections::HashMap;
use std::path::Path;

use can_dbc::{AttributeValue, Dbc, MultiplexIndicator, NumericValue, SignalExtendedValueType, ValueType};

use crate::file::read_settings;

use super::codec::SignalCodec;
use super::error::CanError;
use super::frame::{Id, MAXIMUM_LENGTH, Payload, is_fd_length};
use super::layout::{ByteOrder, LayoutError, NumberFormat, SignalLayout};
use super::source::{DbcLines, NO_MESSAGE};
use super::walk;

/// The messages of one DBC file.
#[derive(Debug, Clone, PartialEq)]
pub struct Database {
    /// File name, for people.
    pub file: String,
    /// In the order of the file.
    pub messages: Vec<Message>,
}

/// A message: what one identifier carries.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Its (long) name.
    pub name: String,
    /// Identifier on the bus.
    pub id: Id,
    /// Bytes of payload.
    pub length: usize,
    /// Line in the file, from 1.
    pub line: usize,
    /// In the order of the file.
    pub signals: Vec<Signal>,
}

/// A signal of a message.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    /// Its (long) name.
    pub name: String,
    /// Where its bits are and what they mean.
    pub codec: SignalCodec,
    /// Unit as written.
    pub unit: String,
    /// Least and greatest allowed value in that unit; `None` where the file says `[0|0]`.
    pub range: Option<(f64, f64)>,
    /// When it is in the payload at all; `None` = always.
    pub selector: Option<Selector>,
}

/// The condition under which a multiplexed signal is in the payload.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Selector {
    /// Index of the signal that selects.
    pub multiplexer: usize,
    /// Raw values, both ends included, that select this signal.
    pub values: Vec<(u64, u64)>,
}

impl Database {
    /// Reads and checks a DBC file.
    ///
    /// # Errors
    /// [`CanError::Read`], or what [`Self::parse`] says.
    pub fn load(path: &Path) -> Result<Self, CanError> {
        let file = path.display().to_string();
        match read_settings(path) {
            Ok(bytes) => Self::parse(&file, &bytes),
            Err(source) => Err(CanError::Read { file, source }),
        }
    }

    /// Checks the bytes of a DBC file: UTF-8 or, as most tools write it, Windows-1252.
    ///
    /// # Errors
    /// [`CanError::Syntax`] where it is not DBC; [`CanError::Database`] for an identifier, length or layout that
    /// cannot be, for two signals on the same bits, and for a multiplexer that is not there.
    pub fn parse(file: &str, bytes: &[u8]) -> Result<Self, CanError> {
        let text = match std::str::from_utf8(bytes) {
            Ok(text) => text.trim_start_matches('\u{feff}').to_owned(),
            Err(_) => encoding_rs::WINDOWS_1252.decode(bytes).0.into_owned(),
        };
        let source = DbcLines::scan(file, &text);
        let tree = Dbc::try_from(text.as_str()).map_err(|error| source.syntax_error(&error))?;
        source.check_ids()?;
        check_references(&tree, &source)?;
        let mut messages = Vec::with_capacity(tree.messages.len());
        let mut lines = HashMap::new();
        for message in tree.messages.iter().filter(|message| message.name != NO_MESSAGE) {
            let raw = message.id.raw();
            let message = read_message(&tree, message, &source)?;
            if let Some(first) = lines.insert(message.id, message.line) {
                let reason =
                    format!("message `{}` has the identifier of the one in line {first}", message.name);
                return Err(source.error(source.second_line(raw), reason));
            }
            messages.push(message);
        }
        Ok(Self { file: file.to_owned(), messages })
    }

    /// The message of that name.
    #[must_use]
    pub fn message(&self, name: &str) -> Option<&Message> {
        self.messages.iter().find(|message| message.name == name)
    }
}

impl Message {
    /// The signal of that name.
    #[must_use]
    pub fn signal(&self, name: &str) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.name == name)
    }

    /// Whether the signal with this index is in a payload of which `length` bytes are there: whole, with all its
    /// multiplexers, and selected by them.
    #[must_use]
    pub fn carries(&self, index: usize, payload: &Payload, length: usize) -> bool {
        let bits = 8 * length.min(self.length);
        let mut next = self.signals.get(index);
        while let Some(signal) = next {
            if signal.last_bit() >= bits {
                return false;
            }
            let Some(selector) = &signal.selector else { return true };
            next = self.signals.get(selector.multiplexer);
            let Some(multiplexer) = next else { return false };
            if !selector.selects(multiplexer.codec.decode_raw(payload)) {
                return false;
            }
        }
        false
    }

    /// The signals in the payload of a frame, with raw bits and value. A signal that a shorter payload cuts off
    /// is left out.
    pub fn decode<'a>(&'a self, data: &[u8]) -> impl Iterator<Item = (&'a Signal, u64, f64)> {
        let mut payload = [0; MAXIMUM_LENGTH];
        for (to, from) in payload.iter_mut().zip(data) {
            *to = *from;
        }
        let length = data.len();
        self.signals.iter().enumerate().filter_map(move |(index, signal)| {
            let present = self.carries(index, &payload, length);
            let raw = signal.codec.decode_raw(&payload);
            present.then(|| (signal, raw, signal.codec.scale(raw)))
        })
    }

    /// The payload with each signal for which `value` has one, in the unit of the DBC file; the bits of the others are
    /// zero. A multiplexer is a signal like any other: its value and the signals it selects must both be given.
    #[inline]
    pub fn encode(&self, mut value: impl FnMut(&Signal) -> Option<f64>) -> Payload {
        let mut payload = [0; MAXIMUM_LENGTH];
        // Put together in a register and written once: most frames are no longer than this word.
        let mut first = 0;
        for signal in &self.signals {
            let Some(value) = value(signal) else { continue };
            if signal.codec.is_in_first_word() {
                first |= signal.codec.encode_in_first_word(value);
            } else {
                signal.codec.encode(&mut payload, value);
            }
        }
        if let Some(word) = payload.first_chunk_mut() {
            *word = (u64::from_le_bytes(*word) | first).to_le_bytes();
        }
        payload
    }
}

impl Signal {
    /// Position of the last bit in the order of the signal's bytes.
    fn last_bit(&self) -> usize {
        let layout = self.codec.layout();
        super::layout::network_position(layout) + usize::from(layout.size) - 1
    }
}

impl Selector {
    /// Whether the multiplexer's raw value selects the signal.
    #[must_use]
    pub fn selects(&self, raw: u64) -> bool {
        self.values.iter().any(|(first, last)| (*first..=*last).contains(&raw))
    }

    fn meets(&self, other: &Self) -> bool {
        let meet = |a: &(u64, u64), b: &(u64, u64)| a.0 <= b.1 && b.0 <= a.1;
        self.values.iter().any(|a| other.values.iter().any(|b| meet(a, b)))
    }
}

fn read_message(tree: &Dbc, message: &can_dbc::Message, source: &DbcLines) -> Result<Message, CanError> {
    let line = source.message_line(message.id.raw());
    let name = long_name(tree.message_attribute(message.id, "SystemMessageLongSymbol"), &message.name);
    let fail = |line, reason: String| source.error(line, format!("message `{name}`: {reason}"));
    let id = match message.id {
        can_dbc::MessageId::Standard(short) => Id::new(u32::from(short), false),
        can_dbc::MessageId::Extended(long) => Id::new(long, true),
    };
    let id = id.ok_or_else(|| fail(line, "its identifier does not exist".to_owned()))?;
    let length = usize::try_from(message.size).unwrap_or(usize::MAX);
    if length > MAXIMUM_LENGTH {
        return Err(fail(line, format!("{} bytes, and a frame carries at most 64", message.size)));
    }
    let mut signals = Vec::with_capacity(message.signals.len());
    for signal in &message.signals {
        let signal_line = source.signal_line(message.id.raw(), &signal.name);
        let signal = read_signal(tree, message, signal, length)
            .map_err(|error| fail(signal_line, format!("signal `{}` {error}", signal.name)))?;
        if signals.iter().any(|other: &Signal| other.name == signal.name) {
            return Err(fail(signal_line, format!("two signals have the name `{}`", signal.name)));
        }
        signals.push(signal);
    }
    let line_of = |index: usize| {
        message.signals.get(index).map_or(line, |signal| source.signal_line(message.id.raw(), &signal.name))
    };
    for index in 0..signals.len() {
        let selector = read_selector(tree, message, index).map_err(|reason| fail(line_of(index), reason))?;
        if let Some(signal) = signals.get_mut(index) {
            signal.selector = selector;
        }
    }
    check_chains(&signals).map_err(|(index, reason)| fail(line_of(index), reason))?;
    check_overlap(&signals).map_err(|(index, reason)| fail(line_of(index), reason))?;
    Ok(Message { name: name.clone(), id, length, line, signals })
}

fn read_signal(
    tree: &Dbc,
    message: &can_dbc::Message,
    signal: &can_dbc::Signal,
    length: usize,
) -> Result<Signal, LayoutError> {
    let size = u16::try_from(signal.size).map_err(|_| LayoutError::Size(signal.size))?;
    let start = u16::try_from(signal.start_bit).ok().filter(|start| *start < 512);
    let number = match tree.extended_value_type_for_signal(message.id, &signal.name) {
        Some(SignalExtendedValueType::IEEEfloat32Bit) => NumberFormat::Float32,
        Some(SignalExtendedValueType::IEEEdouble64bit) => NumberFormat::Float64,
        _ if signal.value_type == ValueType::Signed => NumberFormat::Signed,
        _ => NumberFormat::Unsigned,
    };
    let order = match signal.byte_order {
        can_dbc::ByteOrder::LittleEndian => ByteOrder::Little,
        can_dbc::ByteOrder::BigEndian => ByteOrder::Big,
    };
    let start = start.ok_or(LayoutError::Outside(length as u64))?;
    let codec = SignalCodec::build(
        SignalLayout { start, size, order, number },
        length,
        signal.factor,
        signal.offset,
    )?;
    let range = (number_of(signal.min), number_of(signal.max));
    let long = tree.signal_attribute(message.id, &signal.name, "SystemSignalLongSymbol");
    Ok(Signal {
        name: long_name(long, &signal.name),
        codec,
        unit: signal.unit.clone(),
        range: (range.0 < range.1).then_some(range),
        selector: None,
    })
}

/// `SIG_VALTYPE_` and `SG_MUL_VAL_` must name a signal that is there: of a misspelt one, floats would be read as
/// integers.
fn check_references(tree: &Dbc, source: &DbcLines) -> Result<(), CanError> {
    let types = tree.signal_extended_value_type_list.iter();
    let types = types.map(|entry| ("SIG_VALTYPE_", entry.message_id, &entry.signal_name));
    let selectors = tree.extended_multiplex.iter();
    let selectors = selectors.map(|entry| ("SG_MUL_VAL_", entry.message_id, &entry.signal_name));
    for (keyword, id, name) in types.chain(selectors) {
        if tree.signal_by_name(id, name).is_none() {
            let reason =
                format!("{keyword} names the signal `{name}`, which message {} does not have", id.raw());
            return Err(source.error(source.message_line(id.raw()), reason));
        }
    }
    Ok(())
}

/// What selects the signal: `SG_MUL_VAL_` where the file has it, else the indicator and the only multiplexer.
fn read_selector(tree: &Dbc, message: &can_dbc::Message, index: usize) -> Result<Option<Selector>, String> {
    let Some(signal) = message.signals.get(index) else { return Ok(None) };
    let position = |name: &str| message.signals.iter().position(|other| other.name == name);
    let extended = tree
        .extended_multiplex
        .iter()
        .find(|entry| entry.message_id == message.id && entry.signal_name == signal.name);
    if let Some(entry) = extended {
        let multiplexer = position(&entry.multiplexor_signal_name).ok_or_else(|| {
            format!(
                "signal `{}` is selected by `{}`, which is not there",
                signal.name, entry.multiplexor_signal_name
            )
        })?;
        let values = entry.mappings.iter().map(|range| (range.min_value, range.max_value)).collect();
        return Ok(Some(Selector { multiplexer, values }));
    }
    let value = match signal.multiplexer_indicator {
        MultiplexIndicator::MultiplexedSignal(value)
        | MultiplexIndicator::MultiplexorAndMultiplexedSignal(value) => value,
        MultiplexIndicator::Multiplexor | MultiplexIndicator::Plain => return Ok(None),
    };
    let mut multiplexers = (0..message.signals.len()).filter(|other| {
        let other = message.signals.get(*other).map(|signal| signal.multiplexer_indicator);
        other == Some(MultiplexIndicator::Multiplexor)
    });
    match (multiplexers.next(), multiplexers.next()) {
        (Some(multiplexer), None) => Ok(Some(Selector { multiplexer, values: vec![(value, value)] })),
        (None, _) => Err(format!("signal `{}` is multiplexed, and no signal selects it", signal.name)),
        _ => Err(format!("signal `{}` is multiplexed, and several signals could select it", signal.name)),
    }
}

/// The way from each signal up through its multiplexers must end.
fn check_chains(signals: &[Signal]) -> Result<(), (usize, String)> {
    for (index, signal) in signals.iter().enumerate() {
        if chain(signals, index).count() > signals.len() {
            return Err((index, format!("signal `{}` selects itself through its multiplexers", signal.name)));
        }
    }
    Ok(())
}

/// The selectors of a signal from the nearest on; at most one more than there are signals.
fn chain(signals: &[Signal], index: usize) -> impl Iterator<Item = &Selector> {
    let first = signals.get(index).and_then(|signal| signal.selector.as_ref());
    let next =
        |selector: &&Selector| signals.get(selector.multiplexer).and_then(|signal| signal.selector.as_ref());
    std::iter::successors(first, next).take(signals.len() + 1)
}

/// No bit may belong to two signals that one payload can carry.
fn check_overlap(signals: &[Signal]) -> Result<(), (usize, String)> {
    let masks: Vec<Payload> = signals.iter().map(|signal| walk::occupied(signal.codec.layout())).collect();
    for (later, mask) in masks.iter().enumerate() {
        for (earlier, other) in masks.iter().enumerate().take(later) {
            let overlap = mask.iter().zip(other).any(|(a, b)| a & b != 0);
            if overlap && !exclusive(signals, earlier, later) {
                let name = |index: usize| signals.get(index).map_or("", |signal| signal.name.as_str());
                return Err((later, format!("signals `{}` and `{}` overlap", name(earlier), name(later))));
            }
        }
    }
    Ok(())
}

/// Whether some multiplexer above both never selects both.
fn exclusive(signals: &[Signal], one: usize, other: usize) -> bool {
    chain(signals, one).any(|a| chain(signals, other).any(|b| a.multiplexer == b.multiplexer && !a.meets(b)))
}

fn long_name(attribute: Option<&AttributeValue>, short: &str) -> String {
    match attribute {
        Some(AttributeValue::String(long)) if !long.is_empty() => long.clone(),
        _ => short.to_owned(),
    }
}

fn number_of(value: NumericValue) -> f64 {
    match value {
        NumericValue::Uint(value) => value as f64,
        NumericValue::Int(value) => value as f64,
        NumericValue::Double(value) => value,
    }
}

/// Whether a message of this length can only be sent as CAN FD.
#[must_use]
pub fn needs_fd(length: usize) -> bool {
    length > 8 && is_fd_length(length)
}
