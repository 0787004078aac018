//! What the end of a file says of its columns and of where they lie.

use super::number::{NumberConversion, Physical};
use super::thrift::Thrift;

/// Columns of a file, the groups around them among them.
const MOST_COLUMNS: usize = 100_000;

/// A column as the schema has it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Leaf {
    /// Name, with those of the groups around it: `motor.rate`.
    pub(super) name: String,
    /// How its values become numbers; `None` where they are none.
    pub(super) number: Option<NumberConversion>,
    /// The level at which a value is there.
    pub(super) defined: u32,
    /// Whether a row may have several.
    pub(super) is_repeated: bool,
}

/// Where the values of a column lie that belong to a group of rows.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Chunk {
    pub(super) codec: i64,
    pub(super) start: usize,
    pub(super) length: usize,
}

/// A group of rows.
#[derive(Debug, Clone, Default)]
pub(super) struct RowGroup {
    pub(super) rows: usize,
    /// One for each leaf.
    pub(super) chunks: Vec<Chunk>,
}

/// What the end of a file says.
#[derive(Debug, Clone, Default)]
pub(super) struct Metadata {
    pub(super) leaves: Vec<Leaf>,
    pub(super) groups: Vec<RowGroup>,
    /// Which program wrote it.
    pub(super) created_by: String,
}

/// A line of the schema: a column, or a group of the lines that follow.
#[derive(Debug, Clone, Default)]
struct Element {
    physical: Option<Physical>,
    length: usize,
    repetition: i64,
    name: String,
    children: usize,
    converted: Option<i64>,
    scale: i32,
    logical: Logical,
}

/// What a logical type adds to a physical one.
#[derive(Debug, Clone, Copy, Default)]
struct Logical {
    /// [1/s] of a stamp or a time of day.
    per_second: Option<i64>,
    is_unsigned: bool,
    is_decimal: bool,
    is_half: bool,
}

impl Metadata {
    /// From the bytes of the description.
    pub(super) fn parse(bytes: &[u8]) -> Option<Self> {
        let mut metadata = Self::default();
        let mut elements = Vec::new();
        Thrift::new(bytes).fields(|thrift, field| {
            match field.number {
                2 => thrift.list(|thrift| {
                    elements.push(element(thrift)?);
                    (elements.len() <= MOST_COLUMNS).then_some(())
                })?,
                4 => thrift.list(|thrift| {
                    metadata.groups.push(group(thrift)?);
                    Some(())
                })?,
                6 => thrift.text()?.clone_into(&mut metadata.created_by),
                _ => return Some(false),
            }
            Some(true)
        })?;
        metadata.leaves = leaves(&elements)?;
        let whole = metadata.groups.iter().all(|group| group.chunks.len() == metadata.leaves.len());
        whole.then_some(metadata)
    }
}

fn element(thrift: &mut Thrift) -> Option<Element> {
    let mut element = Element::default();
    thrift.fields(|thrift, field| {
        match field.number {
            1 => element.physical = Physical::of(thrift.integer()?),
            2 => element.length = thrift.size()?,
            3 => element.repetition = thrift.integer()?,
            4 => thrift.text()?.clone_into(&mut element.name),
            5 => element.children = thrift.size()?,
            6 => element.converted = Some(thrift.integer()?),
            7 => element.scale = i32::try_from(thrift.integer()?).ok()?,
            10 => element.logical = logical(thrift)?,
            _ => return Some(false),
        }
        Some(true)
    })?;
    Some(element)
}

fn logical(thrift: &mut Thrift) -> Option<Logical> {
    let mut logical = Logical::default();
    thrift.fields(|thrift, field| {
        match field.number {
            5 => {
                logical.is_decimal = true;
                return Some(false);
            }
            // Time of day and stamp.
            7 | 8 => thrift.fields(|thrift, field| {
                if field.number != 2 {
                    return Some(false);
                }
                thrift.fields(|_, unit| {
                    logical.per_second = match unit.number {
                        1 => Some(1_000),
                        2 => Some(1_000_000),
                        3 => Some(1_000_000_000),
                        _ => None,
                    };
                    Some(false)
                })?;
                Some(true)
            })?,
            10 => thrift.fields(|_, field| {
                if field.number != 2 {
                    return Some(false);
                }
                logical.is_unsigned = !field.truth()?;
                Some(true)
            })?,
            15 => {
                logical.is_half = true;
                return Some(false);
            }
            _ => return Some(false),
        }
        Some(true)
    })?;
    Some(logical)
}

impl Element {
    fn number(&self) -> Option<NumberConversion> {
        let mut logical = self.logical;
        match self.converted {
            Some(5) => logical.is_decimal = true,
            Some(7 | 9) => logical.per_second = logical.per_second.or(Some(1_000)),
            Some(8 | 10) => logical.per_second = logical.per_second.or(Some(1_000_000)),
            Some(11..=14) => logical.is_unsigned = true,
            _ => {}
        }
        let (physical, length) = (self.physical?, self.length);
        let scale = if logical.is_decimal { self.scale } else { 0 };
        match physical {
            Physical::Text => return None,
            Physical::Bytes if logical.is_half && length == 2 => return Some(NumberConversion::half()),
            Physical::Bytes if logical.is_decimal && (1..=16).contains(&length) => {}
            Physical::Bytes => return None,
            _ => {}
        }
        Some(NumberConversion {
            physical,
            length,
            scale,
            per_second: logical.per_second,
            is_unsigned: logical.is_unsigned,
            is_half: false,
        })
    }
}

/// The columns of a schema: its lines but the first, their groups written out.
fn leaves(elements: &[Element]) -> Option<Vec<Leaf>> {
    let (root, rest) = elements.split_first()?;
    let mut leaves = Vec::new();
    // The groups that are open: how many lines they still have, and what their columns take over.
    let mut open =
        vec![(root.children, Leaf { name: String::new(), number: None, defined: 0, is_repeated: false })];
    for element in rest {
        while open.pop_if(|(left, _)| *left == 0).is_some() {}
        let (left, around) = open.last_mut()?;
        *left -= 1;
        let before = if around.name.is_empty() { String::new() } else { format!("{}.", around.name) };
        let leaf = Leaf {
            name: format!("{before}{}", element.name),
            number: element.number(),
            defined: around.defined + u32::from(element.repetition != 0),
            is_repeated: around.is_repeated || element.repetition == 2,
        };
        if element.physical.is_some() || element.children == 0 {
            leaves.push(leaf);
        } else if open.len() < 16 {
            open.push((element.children, leaf));
        } else {
            return None;
        }
    }
    Some(leaves)
}

fn group(thrift: &mut Thrift) -> Option<RowGroup> {
    let mut group = RowGroup::default();
    thrift.fields(|thrift, field| {
        match field.number {
            1 => thrift.list(|thrift| {
                group.chunks.push(chunk(thrift)?);
                Some(())
            })?,
            3 => group.rows = thrift.size()?,
            _ => return Some(false),
        }
        Some(true)
    })?;
    Some(group)
}

fn chunk(thrift: &mut Thrift) -> Option<Chunk> {
    let mut chunk = Chunk::default();
    let mut dictionary = None;
    thrift.fields(|thrift, field| {
        if field.number != 3 {
            return Some(false);
        }
        thrift.fields(|thrift, field| {
            match field.number {
                4 => chunk.codec = thrift.integer()?,
                7 => chunk.length = thrift.size()?,
                9 => chunk.start = thrift.size()?,
                11 => dictionary = Some(thrift.size()?),
                _ => return Some(false),
            }
            Some(true)
        })?;
        Some(true)
    })?;
    // Some writers say 0 where there is no dictionary.
    chunk.start = dictionary.filter(|at| *at > 0).map_or(chunk.start, |at| at.min(chunk.start));
    Some(chunk)
}
