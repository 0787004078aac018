//! Types of DSDL, the language in which DroneCAN v0 defines its messages: what a field is, how many bits it takes, and the
//! signature that keeps two definitions apart.

use std::fmt;
use std::sync::Arc;

use super::crc;

/// How the bits of a number are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NumberKind {
    /// One bit.
    Boolean,
    /// Unsigned integer of up to 64 bits.
    Unsigned,
    /// Two's complement of up to 64 bits.
    Signed,
    /// IEEE 754 binary16, 32 or 64.
    Float,
}

/// What becomes of a value that does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cast {
    /// The nearest that does.
    Saturated,
    /// The low bits of an integer; infinity for a float.
    Truncated,
}

/// A number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Primitive {
    /// How its bits are read.
    pub kind: NumberKind,
    /// How many they are, 1 to 64.
    pub bits: u32,
    /// What becomes of a value that does not fit.
    pub cast: Cast,
}

/// An array, of one size or of up to so many items.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// What it holds.
    pub item: Type,
    /// Number of items, or the greatest.
    pub most: usize,
    /// Whether there may be fewer.
    pub is_dynamic: bool,
}

/// Type of a field.
#[derive(Debug, Clone, PartialEq)]
pub enum Type {
    /// So many bits without meaning.
    Void(u32),
    /// A number.
    Primitive(Primitive),
    /// Several of one type.
    Array(Box<Array>),
    /// A type with a name.
    Compound(Arc<Compound>),
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq)]
pub struct DsdlField {
    /// Its name; empty for bits without meaning.
    pub name: String,
    /// Its type.
    pub of: Type,
}

/// Fields one after the other, or, in a union, one of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Structure {
    /// The fields.
    pub fields: Vec<DsdlField>,
    /// Whether only one of them is there, behind its number.
    pub is_union: bool,
}

/// What a definition defines.
#[derive(Debug, Clone, PartialEq)]
pub enum CompoundBody {
    /// A message, or a part of one.
    Message(Structure),
    /// A service: a request and the response to it.
    Service(Structure, Structure),
}

/// A type with a name, as a file defines it.
#[derive(Debug, Clone, PartialEq)]
pub struct Compound {
    /// Full name, such as `uavcan.protocol.NodeStatus`.
    pub name: String,
    /// Data type id; `None` for what is only a part of others.
    pub id: Option<u16>,
    /// What it defines.
    pub body: CompoundBody,
    /// Data type signature: what the transfers' checksums begin with.
    pub signature: u64,
}

/// [bit] that number an item, or count items, of `count`.
fn bits_for(count: usize) -> u32 {
    usize::BITS - count.leading_zeros()
}

impl Type {
    /// [bit] that it takes at least; an array that may be empty takes none.
    #[must_use]
    pub fn least_bits(&self) -> usize {
        match self {
            Self::Void(bits) | Self::Primitive(Primitive { bits, .. }) => *bits as usize,
            Self::Array(array) if array.is_dynamic => 0,
            Self::Array(array) => array.most.saturating_mul(array.item.least_bits()),
            Self::Compound(compound) => compound.message().map_or(0, Structure::least_bits),
        }
    }

    /// [bit] that it takes at most, the count of an array's items included.
    #[must_use]
    pub fn most_bits(&self) -> usize {
        match self {
            Self::Void(bits) | Self::Primitive(Primitive { bits, .. }) => *bits as usize,
            Self::Array(array) => {
                let count = if array.is_dynamic { array.count_bits() as usize } else { 0 };
                array.most.saturating_mul(array.item.most_bits()).saturating_add(count)
            }
            Self::Compound(compound) => compound.message().map_or(0, Structure::most_bits),
        }
    }

    /// [bit] that it always takes; `None` when that depends on the values.
    #[must_use]
    pub fn fixed_bits(&self) -> Option<usize> {
        match self {
            Self::Void(bits) | Self::Primitive(Primitive { bits, .. }) => Some(*bits as usize),
            Self::Array(array) if array.is_dynamic => None,
            Self::Array(array) => Some(array.most.saturating_mul(array.item.fixed_bits()?)),
            Self::Compound(compound) => compound.message()?.fixed_bits(),
        }
    }

    /// The signature of the type with a name in it.
    fn signature(&self) -> Option<u64> {
        match self {
            Self::Void(_) | Self::Primitive(_) => None,
            Self::Array(array) => array.item.signature(),
            Self::Compound(compound) => Some(compound.signature),
        }
    }
}

impl Array {
    /// [bit] of the count of its items, where it is sent.
    #[must_use]
    pub fn count_bits(&self) -> u32 {
        bits_for(self.most)
    }

    /// Whether its count is left out at the end of a message, and the length of the transfer says it.
    #[must_use]
    pub fn is_countless_at_end(&self) -> bool {
        self.is_dynamic && self.item.least_bits() >= 8
    }
}

impl Structure {
    /// [bit] of the number of a union's field; 0 where it is none.
    #[must_use]
    pub fn tag_bits(&self) -> u32 {
        if self.is_union { bits_for(self.fields.len().saturating_sub(1).max(1)) } else { 0 }
    }

    fn of_fields(&self, each: impl Fn(&Type) -> usize, is_least: bool) -> usize {
        let bits = self.fields.iter().map(|field| each(&field.of));
        let fields = match (self.is_union, is_least) {
            (false, _) => bits.fold(0, usize::saturating_add),
            (true, true) => bits.min().unwrap_or(0),
            (true, false) => bits.max().unwrap_or(0),
        };
        fields.saturating_add(self.tag_bits() as usize)
    }

    /// [bit] that it takes at least.
    #[must_use]
    pub fn least_bits(&self) -> usize {
        self.of_fields(Type::least_bits, true)
    }

    /// [bit] that it takes at most.
    #[must_use]
    pub fn most_bits(&self) -> usize {
        self.of_fields(Type::most_bits, false)
    }

    /// [bit] that it always takes; `None` when that depends on the values.
    #[must_use]
    pub fn fixed_bits(&self) -> Option<usize> {
        if self.is_union {
            return None;
        }
        self.fields.iter().try_fold(0_usize, |sum, field| Some(sum.saturating_add(field.of.fixed_bits()?)))
    }
}

impl Compound {
    /// The fields, if it is no service.
    #[must_use]
    pub fn message(&self) -> Option<&Structure> {
        match &self.body {
            CompoundBody::Message(structure) => Some(structure),
            CompoundBody::Service(..) => None,
        }
    }

    /// The signature of a definition: over its text without whatever does not change the bits, then over the signatures of
    /// the types in it.
    pub(super) fn signature_of(name: &str, body: &CompoundBody, overridden: Option<u64>) -> u64 {
        let (structures, is_service) = match body {
            CompoundBody::Message(structure) => (vec![structure], false),
            CompoundBody::Service(request, response) => (vec![request, response], true),
        };
        let own = overridden.unwrap_or_else(|| {
            let mut lines = vec![name.to_owned()];
            for (index, structure) in structures.iter().enumerate() {
                lines.extend((is_service && index == 1).then(|| "---".to_owned()));
                lines.extend(structure.is_union.then(|| "@union".to_owned()));
                lines.extend(structure.fields.iter().map(ToString::to_string));
            }
            crc::signature(0, lines.join("\n").as_bytes())
        });
        let fields = structures.iter().flat_map(|structure| &structure.fields);
        fields.filter_map(|field| field.of.signature()).fold(own, |signature, part| {
            crc::signature(crc::signature(signature, &part.to_le_bytes()), &signature.to_le_bytes())
        })
    }
}

/// In the normal form that the signature is made of.
impl fmt::Display for Type {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Void(bits) => write!(formatter, "void{bits}"),
            Self::Primitive(Primitive { kind, bits, cast }) => {
                let cast = if *cast == Cast::Saturated { "saturated" } else { "truncated" };
                match kind {
                    NumberKind::Boolean => write!(formatter, "{cast} bool"),
                    NumberKind::Unsigned => write!(formatter, "{cast} uint{bits}"),
                    NumberKind::Signed => write!(formatter, "{cast} int{bits}"),
                    NumberKind::Float => write!(formatter, "{cast} float{bits}"),
                }
            }
            Self::Array(array) => {
                let limit = if array.is_dynamic { "<=" } else { "" };
                write!(formatter, "{}[{limit}{}]", array.item, array.most)
            }
            Self::Compound(compound) => formatter.write_str(&compound.name),
        }
    }
}

/// In the normal form that the signature is made of.
impl fmt::Display for DsdlField {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name.as_str() {
            "" => self.of.fmt(formatter),
            name => write!(formatter, "{} {name}", self.of),
        }
    }
}
