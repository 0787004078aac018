//! Error frames: what the controller says of the bus.

use std::fmt;

/// Error class bits of an error frame. Linux, `include/uapi/linux/can/error.h`.
mod class {
    pub(super) const LOST_ARBITRATION: u32 = 0x002;
    pub(super) const CONTROLLER: u32 = 0x004;
    pub(super) const NO_ACKNOWLEDGE: u32 = 0x020;
    pub(super) const BUS_OFF: u32 = 0x040;
    pub(super) const RESTARTED: u32 = 0x100;
    pub(super) const COUNTERS: u32 = 0x200;
}

/// An error frame, as it came: a plain value, so that the cycle can pass it on. Its text is for elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ErrorFrame {
    /// Bits of the error classes.
    pub class: u32,
    /// What the classes say in detail.
    pub data: [u8; 8],
}

impl ErrorFrame {
    /// The controller has left the bus: nothing is sent until it is restarted.
    #[must_use]
    pub fn is_bus_off(&self) -> bool {
        self.class & class::BUS_OFF != 0
    }

    /// The controller is back on the bus.
    #[must_use]
    pub fn is_restarted(&self) -> bool {
        self.class & class::RESTARTED != 0
    }

    /// Nobody acknowledged a frame: nobody else is on the bus.
    #[must_use]
    pub fn is_unacknowledged(&self) -> bool {
        self.class & class::NO_ACKNOWLEDGE != 0
    }

    /// Another frame went first: ordinary on a busy bus.
    #[must_use]
    pub fn is_lost_arbitration(&self) -> bool {
        self.class == class::LOST_ARBITRATION
    }

    /// The controller lost received frames.
    #[must_use]
    pub fn is_receive_overflow(&self) -> bool {
        self.class & class::CONTROLLER != 0 && self.data[1] & 0x01 != 0
    }

    /// The controller is error passive: its next step is bus off.
    #[must_use]
    pub fn is_passive(&self) -> bool {
        self.class & class::CONTROLLER != 0 && self.data[1] & 0x30 != 0
    }

    /// Transmit and receive error counters, where the frame carries them.
    #[must_use]
    pub fn counters(&self) -> Option<(u8, u8)> {
        (self.class & class::COUNTERS != 0).then_some((self.data[6], self.data[7]))
    }
}

/// All causes in words. Allocates: not for the cycle.
impl fmt::Display for ErrorFrame {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match socketcan::CanErrorFrame::new_error(self.class, &self.data) {
            Ok(frame) => {
                let error = socketcan::CanError::from(frame);
                for (index, cause) in error.causes().enumerate() {
                    write!(formatter, "{}{cause}", if index == 0 { "" } else { "; " })?;
                }
                Ok(())
            }
            Err(_) => write!(formatter, "error frame of class {:#X}", self.class),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_every_cause() {
        let frame = ErrorFrame { class: 0x244, data: [0, 0x20, 0, 0, 0, 0, 255, 7] };
        assert!(frame.is_bus_off() && frame.is_passive() && !frame.is_restarted());
        assert_eq!(frame.counters(), Some((255, 7)));
        let text = frame.to_string();
        assert!(text.contains("bus off") && text.contains("tx=255, rx=7"), "{text}");
        let causes: Vec<&str> = text.split("; ").collect();
        assert!(causes.len() == 3 && causes.iter().all(|cause| !cause.is_empty()), "{text}");
    }

    /// One bit of the class, or of what the controller says, each; others are none of their business.
    #[test]
    fn each_cause_has_bits_of_its_own() {
        let said = |class, controller| {
            let frame = ErrorFrame { class, data: [0, controller, 0xFF, 0xFF, 0xFF, 0xFF, 3, 4] };
            let words = [
                (frame.is_lost_arbitration(), "arbitration"),
                (frame.is_receive_overflow(), "overflow"),
                (frame.is_passive(), "passive"),
                (frame.is_unacknowledged(), "unacknowledged"),
                (frame.is_bus_off(), "off"),
                (frame.is_restarted(), "restarted"),
                (frame.counters() == Some((3, 4)), "counters"),
            ];
            words.iter().filter(|(is, _)| *is).map(|(_, word)| *word).collect::<Vec<_>>()
        };
        for (class, controller, wanted) in [
            (0x002, 0xFF, vec!["arbitration"]),
            (0x004, 0x01, vec!["overflow"]),
            (0x004, 0x10, vec!["passive"]),
            (0x004, 0x20, vec!["passive"]),
            (0x004, 0x31, vec!["overflow", "passive"]),
            // Nearly full or nearly passive: warnings, and the sender's queue.
            (0x004, 0xCE, vec![]),
            // Lost arbitration with something else is an error like others.
            (0x006, 0x00, vec![]),
            (0x020, 0xFF, vec!["unacknowledged"]),
            (0x040, 0xFF, vec!["off"]),
            (0x100, 0xFF, vec!["restarted"]),
            (0x200, 0xFF, vec!["counters"]),
            (0x099, 0xFF, vec![]),
        ] {
            assert_eq!(said(class, controller), wanted, "{class:#X} {controller:#X}");
        }
    }
}
