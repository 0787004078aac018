//! Thrift's compact protocol, as far as Parquet's descriptions need it.

use crate::log::bytes::Bytes;

/// Deeper nests no description; a damaged one could go on for ever.
const DEEPEST: usize = 16;

/// Kinds of values.
const TRUE: u8 = 1;
const FALSE: u8 = 2;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const MAP: u8 = 11;
const STRUCT: u8 = 12;
const UUID: u8 = 13;

/// A field of a structure: its number, and the kind of value that comes next.
#[derive(Debug, Clone, Copy)]
pub(super) struct ThriftField {
    pub(super) number: i16,
    kind: u8,
}

impl ThriftField {
    /// A truth value lies in the field's kind.
    pub(super) fn truth(self) -> Option<bool> {
        [(TRUE, true), (FALSE, false)]
            .into_iter()
            .find(|(kind, _)| *kind == self.kind)
            .map(|(_, truth)| truth)
    }
}

/// Values, front to back; `None` where the bytes are none.
#[derive(Debug, Clone, Copy)]
pub(super) struct Thrift<'a> {
    pub(super) bytes: Bytes<'a>,
    depth: usize,
}

impl<'a> Thrift<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes: Bytes::new(bytes), depth: 0 }
    }

    /// Reads a structure: `each` takes the value of a field it knows, and says whether it did.
    pub(super) fn fields(
        &mut self,
        mut each: impl FnMut(&mut Self, ThriftField) -> Option<bool>,
    ) -> Option<()> {
        self.depth += 1;
        let mut number = 0_i16;
        while self.depth < DEEPEST {
            let head = self.bytes.u8()?;
            let kind = head & 0x0f;
            if kind == 0 {
                self.depth -= 1;
                return Some(());
            }
            number = match head >> 4 {
                0 => i16::try_from(self.integer()?).ok()?,
                step => number.checked_add(i16::from(step))?,
            };
            let field = ThriftField { number, kind };
            if !each(self, field)? {
                self.pass(kind)?;
            }
        }
        None
    }

    /// Reads a list, `each` an element.
    pub(super) fn list(&mut self, mut each: impl FnMut(&mut Self) -> Option<()>) -> Option<()> {
        let (count, _) = self.list_head()?;
        (0..count).try_for_each(|_| each(self))
    }

    fn list_head(&mut self) -> Option<(u64, u8)> {
        let head = self.bytes.u8()?;
        let count = match head >> 4 {
            15 => varint(&mut self.bytes)?,
            count => u64::from(count),
        };
        // Each element takes a byte at least.
        (count <= self.bytes.rest().len() as u64).then_some((count, head & 0x0f))
    }

    /// An integer of any size.
    pub(super) fn integer(&mut self) -> Option<i64> {
        varint(&mut self.bytes).map(unzigzag)
    }

    /// An integer that cannot be negative.
    pub(super) fn size(&mut self) -> Option<usize> {
        usize::try_from(self.integer()?).ok()
    }

    /// Bytes of a text.
    pub(super) fn text(&mut self) -> Option<&'a str> {
        let length = usize::try_from(varint(&mut self.bytes)?).ok()?;
        std::str::from_utf8(self.bytes.take(length)?).ok()
    }

    /// Passes over a value.
    fn pass(&mut self, kind: u8) -> Option<()> {
        match kind {
            TRUE | FALSE => {}
            3 => drop(self.bytes.u8()?),
            4..=6 => drop(varint(&mut self.bytes)?),
            DOUBLE => drop(self.bytes.u64()?),
            BINARY => {
                let length = usize::try_from(varint(&mut self.bytes)?).ok()?;
                self.bytes.take(length)?;
            }
            LIST | SET => {
                let (count, kind) = self.list_head()?;
                self.depth += 1;
                (0..count).try_for_each(|_| self.pass_element(kind))?;
                self.depth -= 1;
            }
            MAP => {
                let count = varint(&mut self.bytes)?;
                let kinds = if count == 0 { 0 } else { self.bytes.u8()? };
                self.depth += 1;
                (0..count).try_for_each(|_| {
                    self.pass_element(kinds >> 4)?;
                    self.pass_element(kinds & 0x0f)
                })?;
                self.depth -= 1;
            }
            STRUCT => self.fields(|_, _| Some(false))?,
            UUID => drop(self.bytes.take(16)?),
            _ => return None,
        }
        Some(())
    }

    /// In a list a truth value takes a byte.
    fn pass_element(&mut self, kind: u8) -> Option<()> {
        if self.depth > DEEPEST {
            return None;
        }
        if kind == TRUE || kind == FALSE { self.bytes.u8().map(drop) } else { self.pass(kind) }
    }
}

/// A number in seven bits of each byte.
pub(super) fn varint(bytes: &mut Bytes) -> Option<u64> {
    let mut number = 0_u64;
    for shift in (0..64).step_by(7) {
        let byte = bytes.u8()?;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(number);
        }
    }
    None
}

/// The signed number whose sign is its last bit.
pub(super) fn unzigzag(number: u64) -> i64 {
    (number >> 1) as i64 ^ -((number & 1) as i64)
}
