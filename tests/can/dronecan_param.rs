//! Parameters: who asks reads and writes by the published definitions, the emulated ESCs byte by byte.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use rotorbench::can::dronecan::{
    NodeParameter, ParameterClient, ParameterRequest, ParameterResponse, ParameterValue, Participant,
    TransferKind, Value,
};
use rotorbench::can::{BenchEnd, Frame, Id, RotorCommands};

use super::dronecan_bench::{config, ends, integers, measured, raw_command, sent, transfer};

const MS: u64 = 1_000_000;
const S: u64 = 1_000 * MS;
const GET_SET: &str = "uavcan.protocol.param.GetSet";

/// Asks, and lets both client for six seconds at most; `lost` says which of the frames get lost, counted from 0.
fn ask(
    client: &mut ParameterClient,
    bench: &mut dyn BenchEnd,
    question: &ParameterRequest,
    now_ns: &mut u64,
    lost: &mut dyn FnMut() -> bool,
) -> Option<ParameterResponse> {
    client.ask(question).expect("short");
    for _ in 0..300 {
        *now_ns += 20 * MS;
        for frame in client.due_frames(*now_ns) {
            if !lost() {
                bench.receive(&frame, *now_ns, &mut RotorCommands::default());
            }
        }
        for frame in sent(bench, *now_ns, &measured(*now_ns)) {
            if !lost() {
                client.receive(&frame, *now_ns);
            }
        }
        if let Some(answer) = client.take_answer() {
            return Some(answer);
        }
    }
    None
}

fn parameter(answer: Option<ParameterResponse>) -> Option<NodeParameter> {
    match answer {
        Some(ParameterResponse::Parameter(parameter)) => parameter,
        other => panic!("no parameter: {other:?}"),
    }
}

#[test]
fn an_emulated_esc_says_its_parameters_one_by_one() {
    let (_, mut bench) = ends(&config());
    let mut client = ParameterClient::new(127, 21).expect("numbers");
    let mut now_ns = S;
    let mut all = Vec::new();
    for index in 0..10 {
        let answer = ask(&mut client, &mut *bench, &ParameterRequest::At(index), &mut now_ns, &mut || false);
        let Some(parameter) = parameter(answer) else { break };
        all.push(parameter);
    }
    let names: Vec<&str> = all.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["esc_index", "timeout_s", "reversed"]);
    let [index, timeout, reversed] = &all[..] else { panic!("three") };
    assert_eq!(index.value, Some(ParameterValue::Integer(1)), "node 21 is the ESC with index 1");
    let limits = (Some(ParameterValue::Integer(0)), Some(ParameterValue::Integer(19)));
    assert_eq!((index.least.clone(), index.greatest.clone()), limits);
    assert_eq!((&timeout.value, &timeout.default), (&Some(ParameterValue::Real(0.5)), &timeout.value));
    let limits = (Some(ParameterValue::Real(0.05)), Some(ParameterValue::Real(5.0)));
    assert_eq!((timeout.least.clone(), timeout.greatest.clone()), limits);
    assert_eq!(
        (&reversed.value, &reversed.least, &reversed.greatest),
        (&Some(ParameterValue::Boolean(false)), &None, &None)
    );
}

#[test]
fn what_is_written_is_there_and_what_cannot_be_is_not() {
    let (_, mut bench) = ends(&config());
    let mut client = ParameterClient::new(127, 20).expect("numbers");
    let mut now_ns = S;
    let mut said =
        |question: &ParameterRequest| ask(&mut client, &mut *bench, question, &mut now_ns, &mut || false);
    let set = |name: &str, value: ParameterValue| ParameterRequest::Set(name.to_owned(), value);
    for (name, wish, kept) in [
        ("timeout_s", ParameterValue::Real(0.125), ParameterValue::Real(0.125)),
        ("timeout_s", ParameterValue::Real(9.0), ParameterValue::Real(0.125)),
        ("timeout_s", ParameterValue::Real(f32::NAN), ParameterValue::Real(0.125)),
        ("timeout_s", ParameterValue::Integer(1), ParameterValue::Real(0.125)),
        ("timeout_s", ParameterValue::Text("timeout_s".to_owned()), ParameterValue::Real(0.125)),
        ("esc_index", ParameterValue::Integer(-1), ParameterValue::Integer(0)),
        ("esc_index", ParameterValue::Integer(7), ParameterValue::Integer(7)),
        ("reversed", ParameterValue::Boolean(true), ParameterValue::Boolean(true)),
    ] {
        let after = parameter(said(&set(name, wish.clone()))).expect("it is there");
        assert_eq!(after.value, Some(kept.clone()), "{name} = {wish}");
        assert_eq!(
            parameter(said(&ParameterRequest::Named(name.to_owned()))).expect("there").value,
            Some(kept)
        );
    }
    assert_eq!(parameter(said(&ParameterRequest::Named("esc_inde".to_owned()))), None);
    assert_eq!(parameter(said(&set("esc_index2", ParameterValue::Integer(1)))), None);
    assert_eq!(said(&ParameterRequest::Save), Some(ParameterResponse::Done(true)));
}

#[test]
fn a_node_that_does_not_answer_is_silent_after_four_questions() {
    let (_, mut bench) = ends(&config());
    let mut client = ParameterClient::new(127, 50).expect("numbers");
    let mut now_ns = S;
    let question = ParameterRequest::At(0);
    // The IMU has no parameters, and the battery's node is not there.
    assert_eq!(
        ask(&mut client, &mut *bench, &question, &mut now_ns, &mut || false),
        Some(ParameterResponse::Silence)
    );
    assert_eq!(now_ns - S, 2020 * MS);
    assert!(ParameterClient::new(0, 20).is_err() && ParameterClient::new(127, 128).is_err());
    assert!(ParameterClient::new(20, 20).is_err());
    assert!(client.ask(&ParameterRequest::Named("n".repeat(93))).is_err());
}

/// Only the node that was asked is believed, and only on the question that was asked last.
#[test]
fn an_answer_of_another_node_or_to_another_question_is_none() {
    let mut client = ParameterClient::new(127, 20).expect("numbers");
    client.ask(&ParameterRequest::At(0)).expect("short");
    let nothing = || Value::Union(0, Box::new(Value::List(Vec::new())));
    let name = Value::List(b"gain".iter().map(|it| Value::Integer(i128::from(*it))).collect());
    let value = Value::List(vec![
        Value::Union(4, Box::new(integers(&[104, 105]))),
        nothing(),
        nothing(),
        nothing(),
        name,
    ]);
    let mut said = |source: u8, to: u8, transfer_id: u8| {
        for frame in transfer(GET_SET, TransferKind::Response { to }, source, transfer_id, &value) {
            client.receive(&frame, S);
        }
        client.take_answer()
    };
    assert_eq!(said(20, 127, 0), None, "before it was asked");
    assert_eq!(client.due_frames(S).len(), 2, "our state, and the question");
    let mut said = |source: u8, to: u8, transfer_id: u8| {
        for frame in transfer(GET_SET, TransferKind::Response { to }, source, transfer_id, &value) {
            client.receive(&frame, S + MS);
        }
        client.take_answer()
    };
    assert_eq!(said(21, 127, 0), None);
    assert_eq!(said(20, 126, 0), None);
    assert_eq!(said(20, 127, 5), None);
    let answer = said(20, 127, 0);
    let Some(ParameterResponse::Parameter(Some(found))) = answer else { panic!("{answer:?}") };
    assert_eq!(
        (found.name.as_str(), found.value, found.least),
        ("gain", Some(ParameterValue::Text("hi".to_owned())), None)
    );
}

#[test]
fn who_arms_who_commands_and_who_has_our_number_is_heard() {
    let mut client = ParameterClient::new(127, 20).expect("numbers");
    let arming = |status: i128, source: u8, id: u8| {
        transfer(
            "uavcan.equipment.safety.ArmingStatus",
            TransferKind::Message,
            source,
            id,
            &Value::List(vec![Value::Integer(status)]),
        )
    };
    let mut hear = |frames: Vec<Frame>, at_ns: u64| {
        frames.iter().for_each(|frame| client.receive(frame, at_ns));
        client.heard()
    };
    hear(arming(0, 9, 0), S);
    let heard = hear(raw_command(9, 0, &[0, 0]), S);
    assert_eq!((heard.armed, heard.commanded, heard.is_id_taken), (None, None, false));
    assert_eq!(hear(arming(255, 9, 1), 2 * S).armed, Some((9, 2 * S)));
    assert_eq!(hear(raw_command(8, 0, &[0, -1]), 3 * S).commanded, Some((8, 3 * S)));
    // Beyond one frame, and in the other message.
    assert_eq!(hear(raw_command(7, 0, &[0, 0, 0, 0, 0, 5]), 4 * S).commanded, Some((7, 4 * S)));
    let rpm = Value::List(vec![integers(&[0, 900])]);
    let rpm = transfer("uavcan.equipment.esc.RPMCommand", TransferKind::Message, 6, 0, &rpm);
    assert_eq!(hear(rpm, 5 * S).commanded, Some((6, 5 * S)));
    assert!(hear(arming(0, 127, 0), 6 * S).is_id_taken);
}

fn fixed(cases: u32) -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(0x9A2A),
        failure_persistence: None,
        ..ProptestConfig::with_cases(cases)
    }
}

proptest! {
    #![proptest_config(fixed(64))]

    /// Whatever is asked, in frames of any content: no panic, and an answer that is one by the published definition. Whatever
    /// is answered: no panic.
    #[test]
    fn any_request_is_answered_or_left(
        requests in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..8), 1..40),
        answers in prop::collection::vec((prop::collection::vec(any::<u8>(), 0..8), 0_u8..8), 1..60),
    ) {
        let (_, mut bench) = ends(&config());
        let mut client = ParameterClient::new(127, 20).expect("numbers");
        let mut now_ns = S;
        for (index, data) in requests.iter().enumerate() {
            let bytes: Vec<u8> = data.iter().copied().chain([0xC0 | index as u8 & 31]).collect();
            for service in [10, 11] {
                let id = Id::Extended(0x1800_94FF | service << 16);
                let frame = Frame::classic(id, &bytes).expect("short");
                bench.receive(&frame, now_ns, &mut RotorCommands::default());
                now_ns += 20 * MS;
                sent(&mut *bench, now_ns, &measured(now_ns));
            }
        }
        let answer = ask(&mut client, &mut *bench, &ParameterRequest::At(1), &mut now_ns, &mut || false);
        let found = parameter(answer).expect("there");
        prop_assert_eq!(found.name.as_str(), "timeout_s");
        let range = 0.05..=5.0;
        prop_assert!(matches!(found.value, Some(ParameterValue::Real(value)) if range.contains(&value)));
        client.ask(&ParameterRequest::At(0)).expect("short");
        for (data, tail) in answers {
            now_ns += 20 * MS;
            client.due_frames(now_ns);
            let bytes: Vec<u8> = data.into_iter().chain([tail << 5 | 2]).collect();
            for service in [10, 11] {
                let id = Id::Extended(0x1800_7F94 | service << 16);
                client.receive(&Frame::classic(id, &bytes).expect("short"), now_ns);
            }
            client.take_answer();
        }
    }

    /// Frames get lost: it is asked again until the answer is whole, and what is written is then written.
    #[test]
    fn a_bus_that_loses_frames_delays_an_answer(lost in prop::collection::vec(prop::bool::weighted(0.03), 4000)) {
        let (_, mut bench) = ends(&config());
        let mut client = ParameterClient::new(127, 20).expect("numbers");
        let mut now_ns = S;
        let mut lost = lost.into_iter().cycle();
        let mut lose = || lost.next().unwrap_or(false);
        let question = ParameterRequest::Set("timeout_s".to_owned(), ParameterValue::Real(0.25));
        match ask(&mut client, &mut *bench, &question, &mut now_ns, &mut lose) {
            Some(ParameterResponse::Parameter(Some(found))) => prop_assert_eq!(found.value, Some(ParameterValue::Real(0.25))),
            Some(ParameterResponse::Silence) => prop_assert!(now_ns - S > 1900 * MS),
            other => prop_assert!(false, "{other:?}"),
        }
    }
}
