//! The name of a bus that is a group of UDP multicast: `mcast:N`, or `mcast:N@DEVICE`.

use std::fmt;
use std::io;
use std::net::Ipv4Addr;

use crate::can::error::CanError;

use super::socket::{self, NetworkDevice};

/// What such a name begins with.
const PREFIX: &str = "mcast:";
/// The device where none is named: no datagram leaves this machine.
const LOOPBACK: &str = "lo";
/// Port of all groups.
pub(super) const PORT: u16 = 57732;

/// A group and the network device that carries it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MulticastGroup {
    /// Number of the bus.
    pub number: u8,
    /// Name of the device.
    pub device: String,
}

impl MulticastGroup {
    /// What a name of an interface says; `None` where it is no such name.
    ///
    /// # Errors
    /// Why there can be no such group.
    pub fn parse(interface: &str) -> Option<Result<Self, String>> {
        let rest = interface.strip_prefix(PREFIX)?;
        let (number, device) = rest.split_once('@').unwrap_or((rest, LOOPBACK));
        // As the reference implementation has it: no number is the first bus.
        let number = if number.is_empty() { "0" } else { number };
        let is_name = !device.is_empty()
            && device.len() < libc::IFNAMSIZ
            && device.bytes().all(|byte| byte.is_ascii_graphic() && byte != b'/');
        Some(match number.parse() {
            Ok(number) if is_name && !interface.contains('+') => {
                Ok(Self { number, device: device.to_owned() })
            }
            _ => Err(
                "a bus on UDP multicast is `mcast:0` to `mcast:255`, or `mcast:0@eth0` on a device that is \
                      not the loopback"
                    .to_owned(),
            ),
        })
    }

    /// Its address.
    #[must_use]
    pub fn address(&self) -> Ipv4Addr {
        Ipv4Addr::new(239, 65, 82, self.number)
    }

    /// The device as it is now; `None` where there is none of that name.
    ///
    /// # Errors
    /// [`CanError::Socket`] where the operating system does not say.
    pub fn look(&self) -> Result<Option<NetworkDevice>, CanError> {
        socket::device(&self.device).map_err(|source| self.refused("does not say what it is", source))
    }

    /// The device, which must be there and up.
    ///
    /// # Errors
    /// [`CanError::Interface`] with what mends it.
    pub fn ready(&self) -> Result<NetworkDevice, CanError> {
        let fail = |reason| Err(CanError::Interface { interface: self.to_string(), reason });
        match self.look()? {
            None => fail(format!("this machine has no network device `{}`", self.device)),
            Some(device) if !device.is_up => {
                fail(format!("the device is down (sudo ip link set {} up)", self.device))
            }
            Some(device) => Ok(device),
        }
    }

    pub(super) fn refused(&self, action: &'static str, source: io::Error) -> CanError {
        CanError::Socket { interface: self.to_string(), action, source }
    }
}

/// As it is named in a bench file.
impl fmt::Display for MulticastGroup {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{PREFIX}{}", self.number)?;
        if self.device == LOOPBACK { Ok(()) } else { write!(formatter, "@{}", self.device) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_read_as_it_is_written() {
        let read = |name| MulticastGroup::parse(name).map(|it| it.map(|it| (it.number, it.device)));
        assert_eq!(read("mcast:0"), Some(Ok((0, "lo".to_owned()))));
        assert_eq!(read("mcast:"), read("mcast:0"), "as the reference has it");
        assert_eq!(read("mcast:255@eth1"), Some(Ok((255, "eth1".to_owned()))));
        for name in ["vcan0", "can0", "mcast", ""] {
            assert_eq!(read(name), None, "{name}");
        }
        for name in [
            "mcast:256",
            "mcast:-1",
            "mcast:+1",
            "mcast:x",
            "mcast:0@",
            "mcast:0@a/b",
            "mcast:0@a b",
            "mcast:0@a-name-that-is-too-long",
        ] {
            assert!(matches!(read(name), Some(Err(_))), "{name}");
        }
        for name in ["mcast:7", "mcast:7@eth1"] {
            assert_eq!(
                MulticastGroup::parse(name).map(|it| it.map(|it| it.to_string())),
                Some(Ok(name.to_owned()))
            );
        }
        let group = MulticastGroup { number: 3, device: "lo".to_owned() };
        assert_eq!(group.address().to_string(), "239.65.82.3");
    }

    #[test]
    fn a_device_that_is_not_there_is_said_to_be_missing() {
        let group = MulticastGroup { number: 0, device: "nope0".to_owned() };
        assert_eq!(group.look().expect("the kernel says"), None);
        let said = group.ready().expect_err("there is none").to_string();
        assert_eq!(said, "CAN interface `mcast:0@nope0`: this machine has no network device `nope0`");
    }
}
