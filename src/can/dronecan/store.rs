//! Parameters of an emulated ESC, as they are asked for by `GetSet` and `ExecuteOpcode`. Answered without allocating: byte by
//! byte, where whoever asks reads and writes by the published definition.

use super::bits;
use super::transfer::Framing;

/// [byte] of the longest answer.
pub(super) const MOST_ANSWER: usize = 64;
/// [s] without a command after which ESCs on DroneCAN usually stop, unless somebody sets them otherwise.
pub const ESC_TIMEOUT_S: f64 = 0.5;
/// `ExecuteOpcode`: keep what is set over a restart, and forget what was kept.
const SAVE: u8 = 0;
const ERASE: u8 = 1;
/// [byte] of the longest name, and [bit] of its count in FD frames.
const LONGEST_NAME: usize = 92;
const COUNT_BITS: u32 = 7;
/// Which kind of value follows.
const NONE: u8 = 0;
const INTEGER: u8 = 1;
const REAL: u8 = 2;
const BOOLEAN: u8 = 3;
const TEXT: u8 = 4;

/// A value that a parameter may have here.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Number {
    Integer(i64),
    Real(f32),
    Boolean(bool),
}

/// A parameter.
#[derive(Debug, Clone, Copy)]
struct Kept {
    name: &'static str,
    now: Number,
    default: Number,
    /// Least and greatest; a boolean has none.
    range: Option<(Number, Number)>,
}

/// The parameters of a node. Nothing that it does follows from them.
#[derive(Debug, Clone)]
pub(super) struct Store {
    all: [Kept; 3],
}

impl Store {
    /// Those of the ESC with this index.
    pub fn of_esc(index: u8) -> Self {
        let kept = |name, default, range| Kept { name, now: default, default, range };
        let index = Number::Integer(i64::from(index));
        Self {
            all: [
                kept("esc_index", index, Some((Number::Integer(0), Number::Integer(19)))),
                kept(
                    "timeout_s",
                    Number::Real(ESC_TIMEOUT_S as f32),
                    Some((Number::Real(0.05), Number::Real(5.0))),
                ),
                kept("reversed", Number::Boolean(false), None),
            ],
        }
    }

    /// Answers a request to read or write one, both in such frames: the answer's length. `None`: it is no such request.
    pub fn get_set(
        &mut self,
        request: &[u8],
        framing: Framing,
        answer: &mut [u8; MOST_ANSWER],
    ) -> Option<usize> {
        let [low, high, rest @ ..] = request else { return None };
        let index = usize::from(*low) | usize::from(*high >> 3) << 8;
        let (wish, rest) = wish(*high & 7, rest)?;
        let mut room = [0; LONGEST_NAME];
        let name = match framing {
            Framing::Classic => rest,
            Framing::Fd => counted(rest, &mut room)?,
        };
        let mut writer = Writer { bytes: answer, length: 0 };
        let found = if name.is_empty() {
            self.all.get_mut(index)
        } else {
            self.all.iter_mut().find(|it| it.name.as_bytes() == name)
        };
        let Some(kept) = found else {
            // Neither a value nor a name.
            writer.put(&[NONE; 4]);
            writer.name(b"", framing);
            return Some(writer.length);
        };
        if let Some(wish) = wish.filter(|wish| kept.may_be(*wish)) {
            kept.now = wish;
        }
        writer.number(Some(kept.now));
        writer.number(Some(kept.default));
        writer.number(kept.range.map(|range| range.1));
        writer.number(kept.range.map(|range| range.0));
        writer.name(kept.name.as_bytes(), framing);
        Some(writer.length)
    }

    /// Answers a request to keep what is set, or to forget it: the answer's length.
    pub fn execute(&mut self, request: &[u8], answer: &mut [u8; MOST_ANSWER]) -> Option<usize> {
        let opcode = *request.first()?;
        if opcode == ERASE {
            self.all.iter_mut().for_each(|kept| kept.now = kept.default);
        }
        let mut writer = Writer { bytes: answer, length: 0 };
        writer.put(&[0; 6]);
        writer.put(&[if matches!(opcode, SAVE | ERASE) { 0x80 } else { 0 }]);
        Some(writer.length)
    }
}

impl Kept {
    /// Whether a value is of its type and in its range.
    fn may_be(&self, wish: Number) -> bool {
        match (self.default, wish, self.range) {
            (Number::Boolean(_), Number::Boolean(_), _) => true,
            (
                Number::Integer(_),
                Number::Integer(wish),
                Some((Number::Integer(least), Number::Integer(most))),
            ) => (least..=most).contains(&wish),
            (Number::Real(_), Number::Real(wish), Some((Number::Real(least), Number::Real(most)))) => {
                (least..=most).contains(&wish)
            }
            _ => false,
        }
    }
}

/// The value that a request holds, and what is left of it: the parameter's name.
fn wish(kind: u8, rest: &[u8]) -> Option<(Option<Number>, &[u8])> {
    match kind {
        NONE => Some((None, rest)),
        INTEGER => {
            let (bytes, name) = rest.split_first_chunk()?;
            Some((Some(Number::Integer(i64::from_le_bytes(*bytes))), name))
        }
        REAL => {
            let (bytes, name) = rest.split_first_chunk()?;
            Some((Some(Number::Real(f32::from_le_bytes(*bytes))), name))
        }
        BOOLEAN => {
            let (byte, name) = rest.split_first()?;
            Some((Some(Number::Boolean(*byte != 0)), name))
        }
        // None of these parameters is one: it is not taken.
        TEXT => {
            let (count, text) = rest.split_first()?;
            Some((None, text.get(usize::from(*count)..)?))
        }
        _ => None,
    }
}

/// The name that its count and its bytes are, one behind the other.
fn counted<'a>(bytes: &[u8], room: &'a mut [u8; LONGEST_NAME]) -> Option<&'a [u8]> {
    let count = bits::read(bytes, 0, COUNT_BITS)? as usize;
    let name = room.get_mut(..count)?;
    for (index, place) in name.iter_mut().enumerate() {
        *place = bits::read(bytes, COUNT_BITS as usize + 8 * index, 8)? as u8;
    }
    Some(name)
}

/// Writes an answer.
struct Writer<'a> {
    bytes: &'a mut [u8; MOST_ANSWER],
    length: usize,
}

impl Writer<'_> {
    fn put(&mut self, bytes: &[u8]) {
        let end = self.length + bytes.len();
        if let Some(place) = self.bytes.get_mut(self.length..end) {
            place.copy_from_slice(bytes);
            self.length = end;
        }
    }

    /// What ends the answer.
    fn name(&mut self, name: &[u8], framing: Framing) {
        if framing == Framing::Classic {
            return self.put(name);
        }
        let begin = 8 * self.length;
        let bits = COUNT_BITS as usize + 8 * name.len();
        bits::write(self.bytes, begin, COUNT_BITS, name.len() as u64);
        for (index, byte) in name.iter().enumerate() {
            bits::write(self.bytes, begin + COUNT_BITS as usize + 8 * index, 8, u64::from(*byte));
        }
        self.length = (begin + bits).div_ceil(8).min(MOST_ANSWER);
    }

    fn number(&mut self, number: Option<Number>) {
        match number {
            None => self.put(&[NONE]),
            Some(Number::Integer(value)) => {
                self.put(&[INTEGER]);
                self.put(&value.to_le_bytes());
            }
            Some(Number::Real(value)) => {
                self.put(&[REAL]);
                self.put(&value.to_le_bytes());
            }
            Some(Number::Boolean(value)) => self.put(&[BOOLEAN, u8::from(value)]),
        }
    }
}
