//! What all who talk on the bus without a bench have in common.

use crate::can::frame::Frame;

/// One who hears frames and owes some, without a bus of its own.
pub trait Talk {
    /// Takes in a frame of another node that came at `now_ns`.
    fn receive(&mut self, frame: &Frame, now_ns: u64);

    /// What is to be sent at `now_ns`; what found no room is owed again.
    fn owed(&mut self, now_ns: u64) -> Vec<Frame>;
}
