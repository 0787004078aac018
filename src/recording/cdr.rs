//! How a message lies in a recording: CDR (little-endian, as ROS 2 writes it) with a `ros2msg` schema beside it, so that
//! Foxglove, PlotJuggler and the `mcap` tools of every language read the file without knowing this program.
//!
//! One table ([`super::messages`]) names each message's fields once; encoder, decoder and schema text all come from it. An `f64` keeps
//! its bits.

use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Representation header: CDR, little-endian, no options.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// A message ended before its fields did, or is not CDR little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("message of {length} bytes is not a whole `{message}`")]
pub struct CdrError {
    /// The message that was expected.
    pub message: &'static str,
    /// Bytes found.
    pub length: usize,
}

/// Bytes under construction; alignment counts from behind the representation header.
pub struct Emitter<'a>(&'a mut Vec<u8>);

impl Emitter<'_> {
    fn put(&mut self, bytes: &[u8]) {
        let behind_header = self.0.len() - HEADER.len();
        let aligned = behind_header.next_multiple_of(bytes.len()) + HEADER.len();
        self.0.resize(aligned, 0);
        self.0.extend_from_slice(bytes);
    }
}

/// Bytes being read.
pub struct Parser<'a> {
    body: &'a [u8],
    at: usize,
}

impl Parser<'_> {
    /// Whether nothing is left.
    pub(super) fn is_at_end(&self) -> bool {
        self.at >= self.body.len()
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let start = self.at.next_multiple_of(N);
        let end = start.checked_add(N)?;
        let bytes = self.body.get(start..end)?.try_into().ok()?;
        self.at = end;
        Some(bytes)
    }
}

/// A type that can lie in a message.
pub trait CdrField: Sized {
    /// Its name in a `ros2msg` schema, with the array's brackets.
    fn type_name() -> String;
    /// Adds the definitions of the messages it is made of.
    fn define(into: &mut NestedDefinitions);
    /// Appends it.
    fn emit(&self, to: &mut Emitter<'_>);
    /// Reads it.
    fn parse(from: &mut Parser<'_>) -> Option<Self>;
    /// Calls `with` for each number in it: name of the field, bits, text.
    fn numbers(&self, name: &str, with: &mut dyn FnMut(String, u64, String));
}

/// A type that can be a whole message.
pub trait CdrMessage: CdrField {
    /// Its name in schemas, without the package.
    const NAME: &'static str;
    /// Its fields, one `type name # comment` a line.
    fn fields_text() -> String;
}

/// Definitions of nested messages, each once, in the order met.
#[derive(Default)]
pub struct NestedDefinitions {
    seen: BTreeSet<&'static str>,
    text: String,
}

impl NestedDefinitions {
    pub(crate) fn add<N: CdrMessage>(&mut self) {
        if self.seen.insert(N::NAME) {
            let rule = "=".repeat(80);
            // Writing to a string cannot fail.
            let _ = write!(self.text, "{rule}\nMSG: rotorbench/{}\n{}", N::NAME, N::fields_text());
        }
    }
}

/// Schema text of `N`: its fields, then every message they are made of.
pub fn schema<N: CdrMessage>() -> String {
    let mut definitions = NestedDefinitions::default();
    definitions.seen.insert(N::NAME);
    N::define(&mut definitions);
    N::fields_text() + &definitions.text
}

/// Replaces the content of `into` by the message `message`.
pub fn encode<N: CdrMessage>(message: &N, into: &mut Vec<u8>) {
    envelope(into, |to| message.emit(to));
}

/// Replaces the content of `into` by a message of what `emit` emits.
pub(super) fn envelope(into: &mut Vec<u8>, emit: impl FnOnce(&mut Emitter<'_>)) {
    into.clear();
    into.extend_from_slice(&HEADER);
    emit(&mut Emitter(into));
}

/// The message in `message`.
///
/// # Errors
/// [`CdrError`] when the message is too short or of another representation.
pub fn decode<N: CdrMessage>(message: &[u8]) -> Result<N, CdrError> {
    message
        .strip_prefix(&HEADER)
        .and_then(|body| N::parse(&mut Parser { body, at: 0 }))
        .ok_or(CdrError { message: N::NAME, length: message.len() })
}

/// Two values of one field that differ in a bit.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Difference {
    /// Name of the field, with its path.
    pub field: String,
    /// The value in the recording, in the shortest spelling that reads back the same.
    pub recorded: String,
    /// The value that came now.
    pub replayed: String,
}

/// The first field in which two messages differ in a bit.
pub fn first_difference<N: CdrMessage>(recorded: &N, replayed: &N) -> Option<Difference> {
    let numbers = |message: &N| {
        let mut numbers = Vec::new();
        message.numbers("", &mut |name, bits, text| numbers.push((name, bits, text)));
        numbers
    };
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    encode(recorded, &mut ours);
    encode(replayed, &mut theirs);
    if ours == theirs {
        return None;
    }
    let mut pairs = numbers(recorded).into_iter().zip(numbers(replayed));
    pairs
        .find(|((_, bits, _), (_, other, _))| bits != other)
        .map(|((field, _, recorded), (_, _, replayed))| Difference { field, recorded, replayed })
}

macro_rules! primitive {
    ($($rust:ty => $ros:literal),*) => {$(
        impl CdrField for $rust {
            fn type_name() -> String {
                $ros.to_owned()
            }
            fn define(_: &mut NestedDefinitions) {}
            fn emit(&self, to: &mut Emitter<'_>) {
                to.put(&self.to_le_bytes());
            }
            fn parse(from: &mut Parser<'_>) -> Option<Self> {
                from.take().map(<$rust>::from_le_bytes)
            }
            fn numbers(&self, name: &str, with: &mut dyn FnMut(String, u64, String)) {
                let mut bits = [0; 8];
                bits.iter_mut().zip(self.to_le_bytes()).for_each(|(to, from)| *to = from);
                with(name.to_owned(), u64::from_le_bytes(bits), format!("{self:?}"));
            }
        }
    )*};
}
primitive!(u8 => "uint8", u32 => "uint32", u64 => "uint64", f64 => "float64");

impl<F: CdrField, const N: usize> CdrField for [F; N] {
    fn type_name() -> String {
        format!("{}[{N}]", F::type_name())
    }
    fn define(into: &mut NestedDefinitions) {
        F::define(into);
    }
    fn emit(&self, to: &mut Emitter<'_>) {
        self.iter().for_each(|item| item.emit(to));
    }
    fn parse(from: &mut Parser<'_>) -> Option<Self> {
        let items: Vec<F> = (0..N).map_while(|_| F::parse(from)).collect();
        items.try_into().ok()
    }
    fn numbers(&self, name: &str, with: &mut dyn FnMut(String, u64, String)) {
        for (index, item) in self.iter().enumerate() {
            item.numbers(&format!("{name}[{index}]"), with);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Command, GuardEvent, Request, Sensors};

    #[test]
    fn bits_survive_and_alignment_is_cdr() {
        let request = Request { sequence: 1, stamp_ns: 2, act: 3, reserved: 0 };
        let mut bytes = Vec::new();
        encode(&request, &mut bytes);
        assert_eq!(bytes[..4], HEADER);
        assert_eq!(bytes[4..], [1, 0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0]);

        let odd = f64::from_bits(0x7ff8_dead_beef_0001);
        let event = GuardEvent { value: odd, ..GuardEvent::default() };
        encode(&event, &mut bytes);
        assert_eq!(decode::<GuardEvent>(&bytes).expect("whole").value.to_bits(), odd.to_bits());
        // Two u64 and four u32 fill 32 bytes, so the f64 stands at 32 without padding.
        assert_eq!(bytes.len(), 4 + 32 + 8);
    }

    #[test]
    fn a_wider_field_behind_a_narrow_one_is_padded() {
        let mut bytes = vec![0, 1, 0, 0];
        let mut emitter = Emitter(&mut bytes);
        7_u32.emit(&mut emitter);
        1.0_f64.emit(&mut emitter);
        assert_eq!(bytes.len(), 4 + 16);
        let mut parser = Parser { body: &bytes[4..], at: 0 };
        assert_eq!(u32::parse(&mut parser), Some(7));
        assert_eq!(f64::parse(&mut parser), Some(1.0));
    }

    #[test]
    fn every_short_message_is_refused() {
        let mut bytes = Vec::new();
        encode(&Command::default(), &mut bytes);
        assert_eq!(decode::<Command>(&bytes).expect("whole"), Command::default());
        for length in 0..bytes.len() {
            assert_eq!(decode::<Command>(&bytes[..length]), Err(CdrError { message: "Command", length }));
        }
    }

    #[test]
    fn a_schema_holds_each_nested_message_once() {
        let text = schema::<Sensors>();
        assert_eq!(text.matches("MSG: rotorbench/Sample").count(), 1);
        assert!(text.starts_with("uint64 sequence # publications from 1\n"));
        assert!(text.contains("Sample[3] acceleration # m/s^2\n"));
    }
}
