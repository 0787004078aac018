//! What all who take part in the bus without a bench have in common.

use crate::can::frame::Frame;

/// One that receives frames and sends some when they are due, without a bus of its own.
pub trait Participant {
    /// Takes in a frame of another node that came at `now_ns`.
    fn receive(&mut self, frame: &Frame, now_ns: u64);

    /// What is to be sent at `now_ns`; what found no room stays due.
    fn due_frames(&mut self, now_ns: u64) -> Vec<Frame>;
}
