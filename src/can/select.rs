//! Which protocol a bench speaks.

use std::collections::BTreeMap;

use super::config::{BusConfig, ProtocolName};
use super::dronecan::{self, DronecanBus, DronecanConfig};
use super::error::CanError;
use super::protocol::Protocol;
use super::resolve::fail;
use super::roles::Roles;

/// The protocol of the `[bus]` table, with its roles. `period_s` is the control period.
///
/// # Errors
/// See [`Roles::build`] and [`DronecanBus::build`].
pub fn protocol(config: &BusConfig, period_s: f64) -> Result<Box<dyn Protocol>, CanError> {
    match config.protocol {
        ProtocolName::Dbc if config.dronecan != DronecanConfig::default() => {
            Err(fail("dronecan", "the table belongs to protocol = \"dronecan\"".to_owned()))
        }
        ProtocolName::Dbc => Ok(Box::new(Roles::build(config, period_s)?)),
        ProtocolName::Dronecan => Ok(Box::new(DronecanBus::build(config, period_s)?)),
    }
}

/// The same table with what the bus has to give before a bench can speak there: on DroneCAN a node id, where the bench file leaves
/// that to an allocator. Waits for it until `is_over`, and says nothing else meanwhile.
///
/// # Errors
/// See [`dronecan::join`].
pub fn join(config: &BusConfig, is_over: &dyn Fn() -> bool) -> Result<BusConfig, CanError> {
    match config.protocol {
        ProtocolName::Dbc => Ok(config.clone()),
        ProtocolName::Dronecan => dronecan::join(config, is_over),
    }
}

impl BusConfig {
    /// Names of the files that say what frames mean, of every protocol that there is.
    pub fn file_names(&mut self) -> impl Iterator<Item = &mut String> {
        let databases = self.database.iter_mut().map(|database| &mut database.file);
        databases.chain(self.dronecan.dsdl.iter_mut().map(|definition| &mut definition.file))
    }

    /// The files that say what frames mean, by their names, and their texts: what somebody needs to understand recorded frames
    /// later.
    ///
    /// # Errors
    /// [`CanError::Read`].
    pub fn files(&self) -> Result<BTreeMap<String, String>, CanError> {
        let mut files = BTreeMap::new();
        match self.protocol {
            ProtocolName::Dbc => {
                for database in &self.database {
                    let text = String::from_utf8_lossy(&database.bytes()?).into_owned();
                    files.insert(database.file.clone(), text);
                }
            }
            ProtocolName::Dronecan => {
                for definition in &self.dronecan.dsdl {
                    files.insert(definition.file.clone(), definition.text()?);
                }
            }
        }
        Ok(files)
    }
}
