//! The events.

use rotorbench::guard::{Cause, GuardState};
use rotorbench::signal::GuardEvent;

use crate::rig::{Rig, defaults};

#[test]
fn events_are_numbered_and_what_does_not_fit_is_counted() {
    let mut rig = Rig::new(&defaults());
    rig.run(1);
    for _ in 0..70 {
        rig.ask_code(9, rig.now);
        rig.period();
    }
    assert_eq!(rig.state.dropped_events(), 6);
    let numbers: Vec<u64> = rig.state.take_events().map(|event| event.sequence).collect();
    assert_eq!(numbers, (1..=64).collect::<Vec<_>>());
    assert_eq!(rig.state.take_events().count(), 0);
    // The ring goes round.
    for _ in 0..40 {
        rig.ask_code(9, rig.now);
        rig.period();
    }
    let events: Vec<GuardEvent> = rig.state.take_events().collect();
    assert_eq!((events.len(), events[0].sequence, events[39].sequence), (40, 71, 110));
    assert_eq!((events[0].value, events[0].cause), (9.0, Cause::RequestUnknown as u32));
    assert_eq!(rig.state.refusals(Cause::RequestUnknown), 110);
    assert_eq!(GuardState::default(), GuardState::new());
}
