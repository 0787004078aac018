//! A node id for who only asks, where none is named.

use super::dronecan_wire::Wire;
use super::thresholds::THRESHOLDS;
use crate::can::dronecan::{GREATEST_NODE, Participant, TransferHeader};
use crate::can::{CanError, Frame, Id};

/// The node id `named`; without one the highest that nobody uses, as far as it is heard, and that is not `kept` for others. Hears
/// for that what is on the bus, and says nothing meanwhile.
///
/// # Errors
/// A bus that is no longer there, or that is full.
pub(super) fn own_node_id(
    wire: &mut impl Wire,
    named: Option<u8>,
    kept: impl Fn(u8) -> bool,
) -> Result<u8, CanError> {
    if let Some(named) = named {
        return Ok(named);
    }
    let mut heard = Heard([false; 1 + GREATEST_NODE as usize]);
    let until_ns = wire.now_ns().saturating_add(THRESHOLDS.own_id_listens_ns);
    while wire.turn(&mut heard, until_ns)? < until_ns {}
    let is_free = |id: &u8| !kept(*id) && !heard.0.get(usize::from(*id)).is_some_and(|it| *it);
    (1..=GREATEST_NODE).rev().find(is_free).ok_or_else(|| CanError::Role {
        place: "dronecan.node_id".to_owned(),
        reason: "every node id is taken on this bus: there is none to ask as".to_owned(),
    })
}

/// Who sends, by node id; 0 is nobody's.
struct Heard([bool; 1 + GREATEST_NODE as usize]);

impl Participant for Heard {
    fn receive(&mut self, frame: &Frame, _now_ns: u64) {
        if let Id::Extended(id) = frame.id()
            && let Some(place) = self.0.get_mut(usize::from(TransferHeader::parse(id).source))
        {
            *place = true;
        }
    }

    fn due_frames(&mut self, _now_ns: u64) -> Vec<Frame> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bus on which these nodes speak, each once a second.
    struct Speaking {
        nodes: Vec<u8>,
        now_ns: u64,
    }

    impl Wire for Speaking {
        fn turn(&mut self, participant: &mut dyn Participant, _until_ns: u64) -> Result<u64, CanError> {
            assert!(participant.due_frames(self.now_ns).is_empty(), "nothing is said under no number");
            self.now_ns += crate::clock::NANOSECONDS_PER_SECOND / 10;
            let turn = (self.now_ns / (crate::clock::NANOSECONDS_PER_SECOND / 10)) as usize % 10;
            for node in self.nodes.iter().skip(turn).step_by(10) {
                let id = Id::Extended(TransferHeader::message(24, 341, *node).id());
                participant.receive(&Frame::classic(id, &[0xC0]).expect("short"), self.now_ns);
            }
            Ok(self.now_ns)
        }

        fn now_ns(&self) -> u64 {
            self.now_ns
        }
    }

    fn chosen(nodes: Vec<u8>, named: Option<u8>, kept: impl Fn(u8) -> bool) -> Result<u8, CanError> {
        own_node_id(&mut Speaking { nodes, now_ns: 1 }, named, kept)
    }

    #[test]
    fn who_only_asks_takes_the_highest_number_that_nobody_has() {
        assert_eq!(chosen(vec![], None, |_| false).expect("free"), 127);
        assert_eq!(chosen(vec![127, 20, 100, 126], None, |_| false).expect("free"), 125);
        assert_eq!(chosen(vec![127], None, |id| id > 99).expect("free"), 99);
        assert_eq!(
            chosen(vec![127], Some(127), |_| false).expect("named"),
            127,
            "whoever names one means it"
        );
        let full = chosen((1..=127).collect(), None, |_| false).expect_err("full").to_string();
        assert!(full.contains("every node id is taken"), "{full}");
    }
}
