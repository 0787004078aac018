//! The messages of a DataFlash log: where they begin and end, and what the log says of their fields.

use std::collections::HashMap;

use crate::log::number::NumberStyle;

/// Begins each message, before the byte of its type.
pub(super) const HEAD: [u8; 2] = [0xa3, 0x95];
/// Bytes before a message's fields.
pub(super) const HEAD_LENGTH: usize = 3;
/// The type of the messages that describe the others, and how long they are.
pub(super) const FORMAT: u8 = 0x80;
const FORMAT_LENGTH: usize = 89;

/// How a field is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FieldKind {
    Number(NumberStyle),
    /// 32 numbers of 16 bits.
    Samples,
    /// So many letters.
    Text(usize),
}

impl FieldKind {
    /// By the letter of the format; with what the letter itself divides the number by.
    fn parse(letter: u8) -> Option<(Self, f64)> {
        Some(match letter {
            b'b' => (Self::Number(NumberStyle::I8), 1.0),
            b'B' | b'M' => (Self::Number(NumberStyle::U8), 1.0),
            b'h' => (Self::Number(NumberStyle::I16), 1.0),
            b'H' => (Self::Number(NumberStyle::U16), 1.0),
            b'i' => (Self::Number(NumberStyle::I32), 1.0),
            b'I' => (Self::Number(NumberStyle::U32), 1.0),
            b'q' => (Self::Number(NumberStyle::I64), 1.0),
            b'Q' => (Self::Number(NumberStyle::U64), 1.0),
            b'g' => (Self::Number(NumberStyle::F16), 1.0),
            b'f' => (Self::Number(NumberStyle::F32), 1.0),
            b'd' => (Self::Number(NumberStyle::F64), 1.0),
            b'c' => (Self::Number(NumberStyle::I16), 100.0),
            b'C' => (Self::Number(NumberStyle::U16), 100.0),
            b'e' => (Self::Number(NumberStyle::I32), 100.0),
            b'E' => (Self::Number(NumberStyle::U32), 100.0),
            b'L' => (Self::Number(NumberStyle::I32), 1e7),
            b'a' => (Self::Samples, 1.0),
            b'n' => (Self::Text(4), 1.0),
            b'N' => (Self::Text(16), 1.0),
            b'Z' => (Self::Text(64), 1.0),
            _ => return None,
        })
    }

    /// Bytes.
    pub(super) fn length(self) -> usize {
        match self {
            Self::Number(number) => number.length(),
            Self::Samples => 64,
            Self::Text(length) => length,
        }
    }

    /// The number at the start of `bytes`; of several samples the one at `index`.
    pub(super) fn number(self, bytes: &[u8], index: usize) -> Option<f64> {
        match self {
            Self::Number(number) => number.value(bytes),
            Self::Samples => NumberStyle::I16.value(bytes.get(2 * index..)?),
            Self::Text(_) => None,
        }
    }
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MessageField {
    pub(super) name: String,
    pub(super) kind: FieldKind,
    /// Bytes from the first field's.
    pub(super) at: usize,
    /// What its letter divides the number by.
    divisor: f64,
}

/// What the log says of a type of messages.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Format {
    pub(super) name: String,
    /// Bytes, the head included.
    pub(super) length: usize,
    pub(super) fields: Vec<MessageField>,
    /// Letters of its units and multipliers, one for each field.
    units: Vec<u8>,
    multipliers: Vec<u8>,
}

impl Format {
    /// From the bytes behind the head of a message that describes others, and which type it is about.
    fn parse(body: &[u8]) -> Option<(u8, Self)> {
        let [kind, length] = body.get(..2)?.try_into().ok()?;
        let name = text(body.get(2..6)?);
        let letters = text(body.get(6..22)?);
        let names = text(body.get(22..86)?);
        let plain = |name: &str| !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_graphic());
        let (mut fields, mut at) = (Vec::new(), 0);
        let mut names = names.split(',');
        for letter in letters.bytes() {
            let (kind, divisor) = FieldKind::parse(letter)?;
            // What has no name cannot be asked for.
            if let Some(name) = names.next().filter(|name| plain(name)) {
                fields.push(MessageField { name: name.to_owned(), kind, at, divisor });
            }
            at += kind.length();
        }
        let whole = at + HEAD_LENGTH == usize::from(length) && plain(&name);
        let format =
            Self { name, length: usize::from(length), fields, units: Vec::new(), multipliers: Vec::new() };
        whole.then_some((kind, format))
    }

    /// The format of the messages that describe others: it must be known before the first of them.
    fn of_formats() -> Self {
        let name = "FMT".to_owned();
        Self { name, length: FORMAT_LENGTH, fields: Vec::new(), units: Vec::new(), multipliers: Vec::new() }
    }

    /// The field of that name, and its number in a message's bytes behind the head.
    fn named<'a>(&self, name: &str, body: &'a [u8]) -> Option<(FieldKind, &'a [u8])> {
        let field = self.fields.iter().find(|it| it.name == name)?;
        Some((field.kind, body.get(field.at..field.at + field.kind.length())?))
    }

    fn text_of(&self, name: &str, body: &[u8]) -> Option<String> {
        let (kind, bytes) = self.named(name, body)?;
        matches!(kind, FieldKind::Text(_)).then(|| text(bytes))
    }

    fn number_of(&self, name: &str, body: &[u8]) -> Option<f64> {
        let (kind, bytes) = self.named(name, body)?;
        kind.number(bytes, 0)
    }

    /// Which field tells apart the messages of several sensors of a kind, where it is a byte.
    pub(super) fn instance(&self) -> Option<usize> {
        let place = self.units.iter().position(|unit| *unit == b'#')?;
        self.fields
            .get(place)
            .filter(|field| field.kind == FieldKind::Number(NumberStyle::U8))
            .map(|field| field.at)
    }
}

/// Letters up to the first zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(bytes.get(..end).unwrap_or_default()).into_owned()
}

/// What a log says of itself.
#[derive(Debug, Clone, Default)]
pub(super) struct Contents {
    formats: HashMap<u8, Format>,
    units: HashMap<u8, String>,
    multipliers: HashMap<u8, f64>,
    pub(super) parameters: HashMap<String, f64>,
    /// The first texts: firmware, board, frame.
    pub(super) texts: Vec<String>,
}

/// More texts than a log begins with.
const TEXTS: usize = 4;

impl Contents {
    pub(super) fn new() -> Self {
        let mut contents = Self::default();
        contents.formats.insert(FORMAT, Format::of_formats());
        contents
    }

    pub(super) fn format(&self, kind: u8) -> Option<&Format> {
        self.formats.get(&kind)
    }

    /// Learns from a message what it says of the others. False where it describes a type in a way that cannot be, or otherwise
    /// than another one did before.
    pub(super) fn learn(&mut self, kind: u8, body: &[u8]) -> bool {
        if kind == FORMAT {
            let Some((kind, format)) = Format::parse(body) else { return false };
            if kind == FORMAT {
                return format.length == FORMAT_LENGTH;
            }
            let known = self.formats.entry(kind).or_insert_with(|| format.clone());
            return known.name == format.name && known.fields == format.fields;
        }
        let Some(format) = self.formats.get(&kind) else { return true };
        let letter = |name: &str| match format.named(name, body) {
            Some((FieldKind::Number(NumberStyle::U8) | FieldKind::Number(NumberStyle::I8), [letter])) => {
                Some(*letter)
            }
            _ => None,
        };
        match format.name.as_str() {
            "UNIT" => {
                if let (Some(id), Some(label)) = (letter("Id"), format.text_of("Label", body)) {
                    self.units.insert(id, label);
                }
            }
            "MULT" => {
                if let (Some(id), Some(number)) = (letter("Id"), format.number_of("Mult", body)) {
                    // The firmware has rounded it to seven digits.
                    self.multipliers.insert(id, format!("{number:.6e}").parse().unwrap_or(number));
                }
            }
            "FMTU" => {
                let letters = |name: &str| format.text_of(name, body).map(String::into_bytes);
                let about = letter("FmtType");
                let (units, multipliers) = (letters("UnitIds"), letters("MultIds"));
                if let Some(described) = about.and_then(|about| self.formats.get_mut(&about)) {
                    described.units = units.unwrap_or_default();
                    described.multipliers = multipliers.unwrap_or_default();
                }
            }
            "PARM" => {
                if let (Some(name), Some(number)) =
                    (format.text_of("Name", body), format.number_of("Value", body))
                {
                    self.parameters.insert(name, number);
                }
            }
            "MSG" if self.texts.len() < TEXTS => self.texts.extend(format.text_of("Message", body)),
            _ => {}
        }
        true
    }

    /// The unit of a field, and what its number is divided by to be in it.
    pub(super) fn scale(&self, format: &Format, place: usize) -> (Option<&'static str>, f64) {
        let label = format.units.get(place).and_then(|unit| self.units.get(unit));
        let unit = label.and_then(|label| unit(label));
        let own = format.fields.get(place).map_or(1.0, |field| field.divisor);
        // Where the letter of the format scales, the multiplier says the same once more.
        let multiplier = format.multipliers.get(place).and_then(|it| self.multipliers.get(it)).copied();
        match multiplier.filter(|it| own == 1.0 && it.is_finite() && *it > 0.0) {
            // A whole divisor loses no digit; 1e-6 is not a number of two digits.
            Some(multiplier) if multiplier < 1.0 => {
                let divisor = 1.0 / multiplier;
                let whole = divisor.round();
                (unit, if (divisor - whole).abs() < 1e-6 * whole { whole } else { divisor })
            }
            Some(multiplier) => (unit, 1.0 / multiplier),
            None => (unit, own),
        }
    }
}

/// The spelling that units have here.
fn unit(label: &str) -> Option<&'static str> {
    Some(match label {
        "A" => "A",
        "V" => "V",
        "s" => "s",
        "us" => "us",
        "rpm" => "rpm",
        "Hz" => "Hz",
        "rad" => "rad",
        "rad/s" => "rad/s",
        "deg" | "degheading" => "deg",
        "deg/s" => "deg/s",
        "degC" => "degC",
        "m" => "m",
        "m/s" => "m/s",
        "m/s/s" => "m/s^2",
        "%" => "%",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_16_bits() {
        let number = |bits: u16| {
            FieldKind::Number(NumberStyle::F16).number(&bits.to_le_bytes(), 0).expect("two bytes")
        };
        for (bits, value) in [
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x7bff, 65_504.0),
            (0x0001, 2_f64.powi(-24)),
            (0x0400, 2_f64.powi(-14)),
            (0x7c00, f64::INFINITY),
            (0x3555, 0.333_251_953_125),
        ] {
            assert_eq!(number(bits), value, "{bits:#x}");
        }
        assert!(number(0x7e00).is_nan());
    }

    #[test]
    fn a_description_that_cannot_be_is_none() {
        let body = |length: u8, name: &[u8], letters: &[u8], names: &[u8]| {
            let mut body = vec![7, length];
            for (text, size) in [(name, 4), (letters, 16), (names, 64)] {
                body.extend(text);
                body.resize(body.len() + size - text.len(), 0);
            }
            body
        };
        let (kind, format) = Format::parse(&body(13, b"ABCD", b"Qh", b"TimeUS,X")).expect("good");
        assert_eq!((kind, format.name.as_str(), format.fields[1].at), (7, "ABCD", 8));
        assert_eq!(Format::parse(&body(14, b"ABCD", b"Qh", b"TimeUS,X")), None, "another length");
        assert_eq!(Format::parse(&body(13, b"ABCD", b"Qh?", b"TimeUS,X")), None, "no such letter");
        assert_eq!(Format::parse(&body(13, b"A\x01", b"Qh", b"TimeUS,X")), None, "no name");
    }
}
