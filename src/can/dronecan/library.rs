//! The types that are known: those that come with the crate, and those of files that the bench file names.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::dsdl::{Compound, CompoundBody};
use super::parse::{DsdlSource, Refused, parse};
use crate::can::error::CanError;

/// The published types that a bench speaks, by the path of their file.
macro_rules! published {
    ($($path:literal)+) => {
        const PUBLISHED: &[(&str, &str)] =
            &[$(($path, include_str!(concat!("../../../dbc/dsdl/", $path)))),+];
    };
}
published! {
    "uavcan/Timestamp.uavcan"
    "uavcan/equipment/ahrs/1003.RawIMU.uavcan"
    "uavcan/equipment/esc/1030.RawCommand.uavcan"
    "uavcan/equipment/esc/1031.RPMCommand.uavcan"
    "uavcan/equipment/esc/1034.Status.uavcan"
    "uavcan/equipment/esc/1036.StatusExtended.uavcan"
    "uavcan/equipment/power/1092.BatteryInfo.uavcan"
    "uavcan/equipment/safety/1100.ArmingStatus.uavcan"
    "uavcan/protocol/1.GetNodeInfo.uavcan"
    "uavcan/protocol/341.NodeStatus.uavcan"
    "uavcan/protocol/HardwareVersion.uavcan"
    "uavcan/protocol/SoftwareVersion.uavcan"
    "uavcan/protocol/dynamic_node_id/1.Allocation.uavcan"
    "uavcan/protocol/param/10.ExecuteOpcode.uavcan"
    "uavcan/protocol/param/11.GetSet.uavcan"
    "uavcan/protocol/param/Empty.uavcan"
    "uavcan/protocol/param/NumericValue.uavcan"
    "uavcan/protocol/param/Value.uavcan"
}

/// How deep types may lie in one another.
const DEEPEST: usize = 16;

/// Definitions, each understood once.
#[derive(Debug, Clone, Default)]
pub struct Library {
    types: BTreeMap<String, Arc<Compound>>,
}

/// A definition of a file: where it is, what it defines, and its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Definition {
    /// The file, for errors.
    pub file: String,
    /// Full name of the type.
    pub name: String,
    /// Data type id.
    pub id: Option<u16>,
    /// Text of the file.
    pub text: String,
}

impl Definition {
    /// The definition in `text`, named by its file: `20050.StatusMsg1.uavcan` in the namespace `com.hobbywing.esc`, or
    /// `Part.uavcan` of what has no id.
    ///
    /// # Errors
    /// [`CanError::Database`] when name or namespace cannot be.
    pub fn new(file: &str, namespace: &str, text: String) -> Result<Self, CanError> {
        let fail = |reason: String| CanError::Database { file: file.to_owned(), line: 1, reason };
        let name = file.rsplit('/').next().unwrap_or(file);
        let mut parts = name.split('.').collect::<Vec<_>>();
        if !matches!(parts.pop(), Some("uavcan" | "dsdl")) {
            return Err(fail("a file of DSDL is named ID.Type.uavcan or Type.uavcan".to_owned()));
        }
        let short = parts.pop().unwrap_or("");
        let id = match parts[..] {
            [] => None,
            [id] => Some(id.parse().map_err(|_| fail(format!("`{id}` is no data type id of 0 to 65535")))?),
            _ => return Err(fail("a file of DSDL is named ID.Type.uavcan or Type.uavcan".to_owned())),
        };
        let is_word = |word: &str, is_type: bool| {
            let mut letters = word.chars();
            let first = letters.next();
            first.is_some_and(|it| if is_type { it.is_ascii_uppercase() } else { it.is_ascii_lowercase() })
                && letters.all(|it| it.is_ascii_alphanumeric() || it == '_')
        };
        if !is_word(short, true) {
            return Err(fail(format!("`{short}` is no name of a type: it begins with a capital letter")));
        }
        if !namespace.split('.').all(|word| is_word(word, false)) {
            return Err(fail(format!("`{namespace}` is no namespace, such as `com.hobbywing.esc`")));
        }
        Ok(Self { file: file.to_owned(), name: format!("{namespace}.{short}"), id, text })
    }
}

impl Library {
    /// The published types and `others`.
    ///
    /// # Errors
    /// [`CanError::Database`] with file and line: a definition that is none, a type or an id that is there twice.
    pub fn build(others: &[Definition]) -> Result<Self, CanError> {
        let mut all = Vec::new();
        for (path, text) in PUBLISHED {
            let (folder, _) = path.rsplit_once('/').unwrap_or(("", path));
            all.push(Definition::new(path, &folder.replace('/', "."), (*text).to_owned())?);
        }
        all.extend_from_slice(others);
        let mut sources: BTreeMap<&str, &Definition> = BTreeMap::new();
        for definition in &all {
            if let Some(other) = sources.insert(&definition.name, definition) {
                let reason = format!("`{}` is defined in `{}`, too", definition.name, other.file);
                return Err(CanError::Database { file: definition.file.clone(), line: 1, reason });
            }
        }
        let mut library = Self::default();
        for definition in &all {
            library.understand(&sources, definition, DEEPEST)?;
        }
        library.check_ids(&sources)?;
        Ok(library)
    }

    fn understand(
        &mut self,
        sources: &BTreeMap<&str, &Definition>,
        definition: &Definition,
        depth: usize,
    ) -> Result<Arc<Compound>, CanError> {
        if let Some(known) = self.types.get(&definition.name) {
            return Ok(Arc::clone(known));
        }
        let mut inner = None;
        let mut find = |name: &str| {
            let source = sources.get(name).ok_or_else(|| format!("no file defines `{name}`"))?;
            let depth = depth.checked_sub(1).ok_or("types lie in one another without end")?;
            self.understand(sources, source, depth).map_err(|error| {
                let reason = error.to_string();
                inner = Some(error);
                reason
            })
        };
        let source = DsdlSource { name: &definition.name, id: definition.id, text: &definition.text };
        let parsed = parse(&source, &mut find);
        let compound = parsed.map_err(|Refused { line, reason }| {
            // What is wrong in a file that this one names is wrong there.
            inner.unwrap_or(CanError::Database { file: definition.file.clone(), line, reason })
        })?;
        let compound = Arc::new(compound);
        self.types.insert(definition.name.clone(), Arc::clone(&compound));
        Ok(compound)
    }

    fn check_ids(&self, sources: &BTreeMap<&str, &Definition>) -> Result<(), CanError> {
        let mut seen: BTreeMap<(bool, u16), &str> = BTreeMap::new();
        for compound in self.types.values() {
            let Some(id) = compound.id else { continue };
            let is_service = matches!(compound.body, CompoundBody::Service(..));
            if let Some(other) = seen.insert((is_service, id), &compound.name) {
                let name = if is_published(&compound.name) { other } else { &compound.name };
                let file = sources.get(name).map_or_else(String::new, |it| it.file.clone());
                let reason = format!("`{other}` and `{}` have the same data type id {id}", compound.name);
                return Err(CanError::Database { file, line: 1, reason });
            }
        }
        Ok(())
    }

    /// The type of this full name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Arc<Compound>> {
        self.types.get(name)
    }

    /// All types, by name.
    pub fn types(&self) -> impl Iterator<Item = &Arc<Compound>> {
        self.types.values()
    }
}

fn is_published(name: &str) -> bool {
    PUBLISHED.iter().any(|(path, _)| {
        let words: Vec<&str> = path.trim_end_matches(".uavcan").split(['/', '.']).collect();
        let words = words.into_iter().filter(|word| word.parse::<u16>().is_err());
        words.collect::<Vec<_>>().join(".") == name
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ids and signatures of the types that a bench speaks, as the reference implementation has them.
    #[test]
    fn the_published_types_have_their_ids_and_signatures() {
        let library = Library::build(&[]).expect("sound");
        for (name, id, signature) in [
            ("uavcan.equipment.esc.RawCommand", 1030, 0x217f_5c87_d7ec_951d),
            ("uavcan.equipment.esc.RPMCommand", 1031, 0xce0f_9f62_1cf7_e70b),
            ("uavcan.equipment.esc.Status", 1034, 0xa9af_28ae_a2fb_b254),
            ("uavcan.equipment.esc.StatusExtended", 1036, 0x02dc_203c_5096_0edc),
            ("uavcan.equipment.ahrs.RawIMU", 1003, 0x8280_632c_40e5_74b5),
            ("uavcan.equipment.power.BatteryInfo", 1092, 0x249c_2654_8a71_1966),
            ("uavcan.protocol.NodeStatus", 341, 0x0f08_68d0_c1a7_c6f1),
            ("uavcan.equipment.safety.ArmingStatus", 1100, 0x8700_f375_556a_8003),
            ("uavcan.protocol.dynamic_node_id.Allocation", 1, 0x0b2a_8126_20a1_1d40),
            ("uavcan.protocol.GetNodeInfo", 1, 0xee46_8a81_21c4_6a9e),
            ("uavcan.protocol.param.ExecuteOpcode", 10, 0x3b13_1ac5_eb69_d2cd),
            ("uavcan.protocol.param.GetSet", 11, 0xa7b6_22f9_39d1_a4d5),
        ] {
            let compound = library.get(name).expect(name);
            assert_eq!((compound.id, compound.signature), (Some(id), signature), "{name}");
        }
        let status = library.get("uavcan.equipment.esc.Status").and_then(|it| it.message());
        assert_eq!(status.and_then(|it| it.fixed_bits()), Some(110));
    }

    fn definition(file: &str, namespace: &str, text: &str) -> Definition {
        Definition::new(file, namespace, text.to_owned()).expect(file)
    }

    #[test]
    fn a_file_that_cannot_be_is_refused_with_its_name() {
        let said = |others: &[Definition]| Library::build(others).expect_err("refused").to_string();
        let own = |text| definition("a/20000.Own.uavcan", "own", text);
        assert_eq!(said(&[own("uint8 x\nPart y")]), "a/20000.Own.uavcan:2: no file defines `own.Part`");
        let part = definition("b/Part.uavcan", "own", "\nuint99 x");
        assert_eq!(said(&[own("Part y"), part]), "b/Part.uavcan:2: there is no `uint99`");
        let around = definition("b/Part.uavcan", "own", "Own x");
        assert!(said(&[own("Part y"), around]).ends_with("types lie in one another without end"));
        let again = definition("341.Other.uavcan", "own", "uint8 x");
        assert!(said(&[again]).starts_with("341.Other.uavcan:1: "), "the file of the user is named");
        let published = definition("341.NodeStatus.uavcan", "uavcan.protocol", "uint8 x");
        assert!(said(&[published]).contains("is defined in `uavcan/protocol/341.NodeStatus.uavcan`, too"));
        let service = definition("40000.Own.uavcan", "own", "uavcan.protocol.GetNodeInfo x");
        assert!(said(&[service]).contains("is a service"));
        for (file, namespace) in [
            ("Own.txt", "own"),
            ("70000.Own.uavcan", "own"),
            ("1.2.Own.uavcan", "own"),
            ("own.uavcan", "own"),
            ("Own.uavcan", "Own"),
            ("Own.uavcan", ""),
        ] {
            Definition::new(file, namespace, String::new()).map(drop).expect_err(file);
        }
    }
}
