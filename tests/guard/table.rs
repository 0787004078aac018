//! The state table and the words for its parts.

use std::collections::BTreeSet;

use rotorbench::guard::{Cause, OperatorAct, State, TRANSITIONS, Trigger};
use rotorbench::signal::Channel;

#[test]
fn the_table_is_what_is_written() {
    let mut seen = BTreeSet::new();
    for (from, trigger, to) in TRANSITIONS {
        assert!(seen.insert((*from as u32, format!("{trigger:?}"))), "two ways out of {from} by {trigger:?}");
        assert_eq!(from.next(*trigger), Some(*to));
    }
    let pairs = State::ALL.into_iter().flat_map(|state| Trigger::ALL.map(|trigger| (state, trigger)));
    let taken = pairs.filter(|(state, trigger)| state.next(*trigger).is_some()).count();
    assert_eq!(taken, TRANSITIONS.len(), "every transition is in the table once, and no other exists");
    // What the words of the table promise.
    for (from, trigger, to) in TRANSITIONS {
        if *to == State::Armed {
            assert!(matches!(
                (from, trigger),
                (State::PreArm, Trigger::ChecksPassed) | (State::Degraded, Trigger::Recover)
            ));
        }
        if *to == State::PreArm {
            assert_eq!((*from, *trigger), (State::Disarmed, Trigger::Arm));
        }
        if matches!(from, State::FailsafeLatched | State::EmergencyStop) {
            assert!(matches!(trigger, Trigger::Disarm | Trigger::Stop), "a latch is left by {trigger:?}");
            assert!(!to.is_active() && *to != State::PreArm);
        }
    }
    assert!(
        State::ALL.iter().all(|state| *state == State::EmergencyStop || state.next(Trigger::Stop).is_some())
    );
}

#[test]
fn codes_and_words_are_one_to_one() {
    for (code, state) in (0..).zip(State::ALL) {
        assert_eq!((state as u32, State::from_code(code)), (code, Some(state)));
    }
    for (code, (cause, name, label)) in (0..).zip(Cause::ALL) {
        assert_eq!((cause as u32, Cause::from_code(code)), (code, Some(cause)));
        assert_eq!((cause.name(), cause.to_string().as_str()), (name, label));
    }
    for (code, signal) in (0..).zip(Channel::WATCHED) {
        assert_eq!((signal.subject(), Channel::of_subject(code)), (code, Some(signal)));
    }
    for act in [OperatorAct::Arm, OperatorAct::Disarm, OperatorAct::Stop] {
        assert_eq!(OperatorAct::from_code(act as u32), Some(act));
    }
    assert_eq!(State::from_code(6), None);
    assert_eq!(Cause::from_code(Cause::COUNT as u32), None);
    assert_eq!(Channel::of_subject(Channel::WATCHED.len() as u32), None);
    assert_eq!((OperatorAct::from_code(0), OperatorAct::from_code(4)), (None, None));
    let words =
        |texts: Vec<String>| texts.iter().filter(|text| !text.is_empty()).collect::<BTreeSet<_>>().len();
    assert_eq!(words(State::ALL.map(|state| state.to_string()).to_vec()), 6);
    assert_eq!(words(Channel::WATCHED.map(Channel::label).to_vec()), Channel::WATCHED.len());
    assert_eq!(words(Cause::ALL.map(|(cause, ..)| cause.to_string()).to_vec()), Cause::COUNT);
    assert_eq!(words(Cause::ALL.map(|(_, name, _)| name.to_owned()).to_vec()), Cause::COUNT);
}
