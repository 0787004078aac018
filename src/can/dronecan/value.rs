//! Whole messages as values: written to a payload and read from it, whatever their type. For what has time, and for tests; what
//! a cycle needs of a message is compiled to places ([`super::place`]).

use super::bits;
use super::dsdl::{Array, Cast, NumberKind, Primitive, Structure, Type};
use super::transfer::Framing;

/// A value of any type.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Of an integer; 0 or 1 of a `bool`.
    Integer(i128),
    /// Of a float.
    Float(f64),
    /// Of an array: its items; of a structure: its fields, those without meaning left out.
    List(Vec<Self>),
    /// Of a union: which field, and its value.
    Union(usize, Box<Self>),
}

/// Why a value is not one of the type, or a payload not one of the message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ValueError {
    /// The payload ends before the message does.
    #[error("the payload ends before the message does")]
    TooShort,
    /// The payload goes on behind the message.
    #[error("the payload goes on behind the message")]
    TooLong,
    /// A count or the number of a union's field is greater than the greatest.
    #[error("an array or a union says more than its type has")]
    TooMany,
    /// A value of another type.
    #[error("a value does not fit its field")]
    Mismatch,
}

/// What a field holds that nobody set: zero, nothing, the first of a union; of a float that may be unknown, `unknown`.
#[must_use]
pub fn empty(of: &Type, unknown: f64) -> Value {
    match of {
        Type::Void(_) => Value::Integer(0),
        Type::Primitive(Primitive { kind: NumberKind::Float, .. }) => Value::Float(unknown),
        Type::Primitive(_) => Value::Integer(0),
        Type::Array(array) if array.is_dynamic => Value::List(Vec::new()),
        Type::Array(array) => Value::List(vec![empty(&array.item, unknown); array.most]),
        Type::Compound(compound) => {
            compound.message().map_or(Value::List(Vec::new()), |structure| empty_message(structure, unknown))
        }
    }
}

/// A message of which nothing is set; see [`empty`].
#[must_use]
pub fn empty_message(structure: &Structure, unknown: f64) -> Value {
    let mut fields = structure.fields.iter().filter(|field| !field.name.is_empty());
    if structure.is_union {
        let first = fields.next().map_or(Value::Integer(0), |field| empty(&field.of, unknown));
        return Value::Union(0, Box::new(first));
    }
    Value::List(fields.map(|field| empty(&field.of, unknown)).collect())
}

/// The payload of a message, for such frames. A number that does not fit becomes what its type says.
///
/// # Errors
/// [`ValueError`] when the value is not one of this type.
pub fn encode(structure: &Structure, value: &Value, framing: Framing) -> Result<Vec<u8>, ValueError> {
    let mut writer = Writer { bytes: Vec::new(), at: 0 };
    writer.structure(structure, value, framing == Framing::Classic)?;
    Ok(writer.bytes)
}

/// The message in a payload of such frames, the bits that fill its last byte aside, and the bytes that fill the last FD frame.
///
/// # Errors
/// [`ValueError`] when it is none.
pub fn decode(structure: &Structure, payload: &[u8], framing: Framing) -> Result<Value, ValueError> {
    let mut reader = Reader { bytes: payload, at: 0 };
    let value = reader.structure(structure, framing == Framing::Classic)?;
    let written = payload.len() - reader.rest() / 8;
    let is_filled = match framing {
        Framing::Classic => written == payload.len(),
        // A padding is as long as it must be; of several frames the checksum's two bytes are gone.
        Framing::Fd => framing.sent_bytes(written) >= payload.len(),
    };
    if !is_filled {
        return Err(ValueError::TooLong);
    }
    Ok(value)
}

/// The bits for a number of this type.
#[must_use]
pub(super) fn raw_of(primitive: Primitive, value: &Value) -> Option<u64> {
    let Primitive { kind, bits, cast } = primitive;
    match (kind, value) {
        (NumberKind::Float, Value::Float(value)) => Some(raw_float(bits, cast, *value)),
        (NumberKind::Boolean, Value::Integer(value)) => Some(u64::from(*value != 0)),
        (NumberKind::Unsigned | NumberKind::Signed, Value::Integer(value)) => {
            let greatest = i128::from(bits::mask(bits));
            let (least, greatest) = match kind {
                NumberKind::Signed => (-(greatest >> 1) - 1, greatest >> 1),
                _ => (0, greatest),
            };
            let value = if cast == Cast::Saturated { (*value).clamp(least, greatest) } else { *value };
            Some(value as u64 & bits::mask(bits))
        }
        _ => None,
    }
}

fn raw_float(bits: u32, cast: Cast, value: f64) -> u64 {
    let greatest = match bits {
        16 => bits::GREATEST_HALF,
        32 => f64::from(f32::MAX),
        _ => f64::MAX,
    };
    // Not a number stays what it is.
    let fitting = match cast {
        Cast::Saturated => value.clamp(-greatest, greatest),
        Cast::Truncated if value.abs() > greatest => f64::INFINITY.copysign(value),
        Cast::Truncated => value,
    };
    match bits {
        16 => u64::from(bits::half_of(fitting as f32)),
        32 => u64::from((fitting as f32).to_bits()),
        _ => fitting.to_bits(),
    }
}

/// The number that bits of this type stand for, as far as `f64` holds it.
#[must_use]
#[inline]
pub(super) fn number_of(kind: NumberKind, bits: u32, raw: u64) -> f64 {
    match (kind, bits) {
        (NumberKind::Float, 16) => f64::from(bits::of_half(raw as u16)),
        (NumberKind::Float, 32) => f64::from(f32::from_bits(raw as u32)),
        (NumberKind::Float, _) => f64::from_bits(raw),
        (NumberKind::Signed, _) => extend(raw, bits) as f64,
        (NumberKind::Boolean | NumberKind::Unsigned, _) => raw as f64,
    }
}

fn extend(raw: u64, bits: u32) -> i64 {
    ((raw << (64 - bits)) as i64) >> (64 - bits)
}

/// Writes bits one behind the other.
struct Writer {
    bytes: Vec<u8>,
    at: usize,
}

impl Writer {
    fn put(&mut self, bits: u32, raw: u64) {
        let end = self.at + bits as usize;
        self.bytes.resize(end.div_ceil(8), 0);
        bits::write(&mut self.bytes, self.at, bits, raw);
        self.at = end;
    }

    /// `is_last`: nothing follows in the message, and an array's count may be left out there.
    fn structure(&mut self, of: &Structure, value: &Value, is_last: bool) -> Result<(), ValueError> {
        if of.is_union {
            let Value::Union(index, value) = value else { return Err(ValueError::Mismatch) };
            let field = of.fields.get(*index).ok_or(ValueError::Mismatch)?;
            self.put(of.tag_bits(), *index as u64);
            return self.value(&field.of, value, is_last);
        }
        let Value::List(values) = value else { return Err(ValueError::Mismatch) };
        let mut values = values.iter();
        for (index, field) in of.fields.iter().enumerate() {
            let is_last = is_last && index + 1 == of.fields.len();
            match field.of {
                Type::Void(bits) => self.put(bits, 0),
                _ => self.value(&field.of, values.next().ok_or(ValueError::Mismatch)?, is_last)?,
            }
        }
        if values.next().is_some() { Err(ValueError::Mismatch) } else { Ok(()) }
    }

    fn value(&mut self, of: &Type, value: &Value, is_last: bool) -> Result<(), ValueError> {
        match of {
            Type::Void(bits) => self.put(*bits, 0),
            Type::Primitive(primitive) => {
                self.put(primitive.bits, raw_of(*primitive, value).ok_or(ValueError::Mismatch)?);
            }
            Type::Array(array) => self.array(array, value, is_last)?,
            Type::Compound(compound) => {
                self.structure(compound.message().ok_or(ValueError::Mismatch)?, value, is_last)?;
            }
        }
        Ok(())
    }

    fn array(&mut self, array: &Array, value: &Value, is_last: bool) -> Result<(), ValueError> {
        let Value::List(items) = value else { return Err(ValueError::Mismatch) };
        let fits = if array.is_dynamic { items.len() <= array.most } else { items.len() == array.most };
        if !fits {
            return Err(ValueError::Mismatch);
        }
        let is_countless = is_last && array.is_countless_at_end();
        if array.is_dynamic && !is_countless {
            self.put(array.count_bits(), items.len() as u64);
        }
        for (index, item) in items.iter().enumerate() {
            self.value(&array.item, item, is_last && !is_countless && index + 1 == items.len())?;
        }
        Ok(())
    }
}

/// Reads bits one behind the other.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn rest(&self) -> usize {
        (8 * self.bytes.len()).saturating_sub(self.at)
    }

    fn take(&mut self, bits: u32) -> Result<u64, ValueError> {
        let raw = bits::read(self.bytes, self.at, bits).ok_or(ValueError::TooShort)?;
        self.at += bits as usize;
        Ok(raw)
    }

    fn structure(&mut self, of: &Structure, is_last: bool) -> Result<Value, ValueError> {
        if of.is_union {
            let index = self.take(of.tag_bits())? as usize;
            let field = of.fields.get(index).ok_or(ValueError::TooMany)?;
            return Ok(Value::Union(index, Box::new(self.value(&field.of, is_last)?)));
        }
        let mut values = Vec::new();
        for (index, field) in of.fields.iter().enumerate() {
            let value = self.value(&field.of, is_last && index + 1 == of.fields.len())?;
            values.extend((!field.name.is_empty()).then_some(value));
        }
        Ok(Value::List(values))
    }

    fn value(&mut self, of: &Type, is_last: bool) -> Result<Value, ValueError> {
        match of {
            Type::Void(bits) => self.take(*bits).map(|_| Value::Integer(0)),
            Type::Primitive(Primitive { kind, bits, .. }) => {
                let raw = self.take(*bits)?;
                Ok(match kind {
                    NumberKind::Float => Value::Float(number_of(*kind, *bits, raw)),
                    NumberKind::Signed => Value::Integer(i128::from(extend(raw, *bits))),
                    NumberKind::Boolean | NumberKind::Unsigned => Value::Integer(i128::from(raw)),
                })
            }
            Type::Array(array) => self.array(array, is_last),
            Type::Compound(compound) => {
                self.structure(compound.message().ok_or(ValueError::Mismatch)?, is_last)
            }
        }
    }

    fn array(&mut self, array: &Array, is_last: bool) -> Result<Value, ValueError> {
        let mut items = Vec::new();
        if is_last && array.is_countless_at_end() {
            while self.rest() >= 8 {
                if items.len() == array.most {
                    return Err(ValueError::TooMany);
                }
                items.push(self.value(&array.item, false)?);
            }
            return Ok(Value::List(items));
        }
        let count = if array.is_dynamic { self.take(array.count_bits())? as usize } else { array.most };
        if count > array.most {
            return Err(ValueError::TooMany);
        }
        for index in 0..count {
            items.push(self.value(&array.item, is_last && index + 1 == count)?);
        }
        Ok(Value::List(items))
    }
}
