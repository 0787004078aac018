//! What the rows of a topic hold: the definitions of a log, their nested ones written out.

use std::collections::HashMap;

use crate::log::number::NumberStyle;

/// Deeper nests no real log; a definition that holds itself would never end.
const DEEPEST: usize = 8;

/// Fields of one topic, written out. The largest of PX4 has some 200.
const MOST_FIELDS: usize = 10_000;

/// A value as the log holds it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ValueKind {
    Number(NumberStyle),
    /// A letter of a text: takes a byte, is no number.
    Letter,
}

impl ValueKind {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "int8_t" => Self::Number(NumberStyle::I8),
            "uint8_t" | "bool" => Self::Number(NumberStyle::U8),
            "int16_t" => Self::Number(NumberStyle::I16),
            "uint16_t" => Self::Number(NumberStyle::U16),
            "int32_t" => Self::Number(NumberStyle::I32),
            "uint32_t" => Self::Number(NumberStyle::U32),
            "int64_t" => Self::Number(NumberStyle::I64),
            "uint64_t" => Self::Number(NumberStyle::U64),
            "float" => Self::Number(NumberStyle::F32),
            "double" => Self::Number(NumberStyle::F64),
            "char" => Self::Letter,
            _ => return None,
        })
    }

    /// Bytes it takes.
    fn size(self) -> usize {
        match self {
            Self::Number(number) => number.length(),
            Self::Letter => 1,
        }
    }

    /// Its value at the start of `bytes`; not-a-number where they end before it.
    pub(super) fn value(self, bytes: &[u8]) -> f64 {
        let number = match self {
            Self::Number(number) => number,
            Self::Letter => NumberStyle::U8,
        };
        number.value(bytes).unwrap_or(f64::NAN)
    }
}

/// A field as a definition names it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Defined {
    kind: String,
    /// `None`: not an array.
    length: Option<usize>,
    name: String,
}

/// The definitions of a log, by name. The first of a name counts.
#[derive(Debug, Default)]
pub(super) struct FormatDefinitions(HashMap<String, Vec<Defined>>);

impl FormatDefinitions {
    /// Adds the text of a definition, `name:type field;type[3] field;`; `None` where it is none.
    pub(super) fn add(&mut self, text: &str) -> Option<()> {
        let (name, fields) = text.split_once(':')?;
        let fields = fields.split(';').filter(|field| !field.is_empty()).map(|field| {
            let (kind, name) = field.split_once(' ')?;
            let (kind, length) = match kind.split_once('[') {
                Some((kind, rest)) => (kind, Some(rest.strip_suffix(']')?.parse().ok()?)),
                None => (kind, None),
            };
            Some(Defined { kind: kind.to_owned(), length, name: name.to_owned() })
        });
        let fields = fields.collect::<Option<Vec<_>>>()?;
        self.0.entry(name.to_owned()).or_insert(fields);
        Some(())
    }

    /// Whether there is one of that name.
    pub(super) fn knows(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// The fields of topic `name`; `None` where a nested definition is missing or it is larger than any topic.
    pub(super) fn layout(&self, name: &str) -> Option<RowLayout> {
        let mut layout = RowLayout::default();
        self.write_out(name, "", DEEPEST, &mut layout)?;
        // The logger leaves out the padding at the end.
        layout.least = layout.most;
        while let Some(last) = layout.fields.pop_if(|last| last.name.starts_with("_padding")) {
            layout.least = last.offset;
        }
        layout.fields.retain(|field| field.kind != ValueKind::Letter && !field.is_padding());
        Some(layout)
    }

    fn write_out(&self, name: &str, before: &str, deeper: usize, layout: &mut RowLayout) -> Option<()> {
        let deeper = deeper.checked_sub(1)?;
        for field in self.0.get(name)? {
            for index in 0..field.length.unwrap_or(1) {
                layout.visited += 1;
                if layout.visited > MOST_FIELDS {
                    return None;
                }
                let place = field.length.map_or_else(String::new, |_| format!("[{index}]"));
                let name = format!("{before}{}{place}", field.name);
                match ValueKind::parse(&field.kind) {
                    Some(kind) => {
                        layout.fields.push(RowField { name, kind, offset: layout.most });
                        layout.most += kind.size();
                    }
                    None => self.write_out(&field.kind, &format!("{name}."), deeper, layout)?,
                }
            }
        }
        Some(())
    }
}

/// A number in each row of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct RowField {
    /// Name, with those of the messages around it: `esc[0].esc_rpm`.
    pub(super) name: String,
    pub(super) kind: ValueKind,
    /// Where in the row.
    pub(super) offset: usize,
}

impl RowField {
    fn is_padding(&self) -> bool {
        self.name.rsplit('.').next().is_some_and(|name| name.starts_with("_padding"))
    }
}

/// What the rows of a topic hold.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct RowLayout {
    pub(super) fields: Vec<RowField>,
    /// Bytes of a row: without the padding at its end, and with it.
    pub(super) least: usize,
    pub(super) most: usize,
    visited: usize,
}
