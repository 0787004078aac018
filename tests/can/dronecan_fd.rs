//! DroneCAN in CAN FD frames: arrays with their counts, frames with zeros at their ends, and benches whose nodes send the one kind and
//! the other. What a message looks like there is held bit for bit in `dronecan.rs`.

use rotorbench::can::dronecan::{
    Assembler, CompoundBody, Framing, Library, Subscription, TransferFrames, TransferHeader, TransferKind,
    Value, decode, encode,
};
use rotorbench::can::{BusConfig, ForeignSender, Frame, FrameRefusal, RotorCommands, protocol};
use rotorbench::signal::{Applied, Sensors};

use super::dronecan_bench::{config, ends, integers, measured, sent};

const S: u64 = 1_000_000_000;
const ARMED: u32 = 2;

fn on_fd() -> BusConfig {
    BusConfig { fd: true, ..config() }
}

fn applied(rotor: [f64; 2]) -> Applied {
    Applied { state: ARMED, rotor, ..Applied::default() }
}

fn is_fd(frame: &Frame) -> bool {
    Framing::of(frame) == Framing::Fd
}

/// What this type's request, or message, or response is.
fn structure<'a>(
    library: &'a Library,
    name: &str,
    kind: TransferKind,
) -> (&'a rotorbench::can::dronecan::Structure, Subscription) {
    let compound = library.get(name).expect("published");
    let structure = match (&compound.body, kind) {
        (CompoundBody::Message(message), _) => message,
        (CompoundBody::Service(request, _), TransferKind::Request { .. }) => request,
        (CompoundBody::Service(_, response), _) => response,
    };
    let id = compound.id.expect("sent");
    (structure, Subscription::new(id, kind, compound.signature, structure.most_bits()))
}

/// A transfer of node 9.
fn transfer(name: &str, kind: TransferKind, transfer_id: u8, value: &Value, framing: Framing) -> Vec<Frame> {
    let library = Library::build(&[]).expect("sound");
    let (structure, of) = structure(&library, name, kind);
    let payload = encode(structure, value, framing).expect("of this type");
    let header = TransferHeader { priority: 16, type_id: of.type_id, source: 9, kind, discriminator: 0 };
    TransferFrames::new(header, of.seed, transfer_id, &payload).framed(framing).collect()
}

fn raw_command(transfer_id: u8, values: &[i128]) -> Vec<Frame> {
    let value = Value::List(vec![integers(values)]);
    transfer("uavcan.equipment.esc.RawCommand", TransferKind::Message, transfer_id, &value, Framing::Fd)
}

/// Sensors and commands cross, whoever of the two sends FD frames; each sends what its own file says.
#[test]
fn either_end_understands_the_frames_of_the_other() {
    for (near, far) in [(true, true), (true, false), (false, true)] {
        let at = |fd: bool| BusConfig { fd, ..config() };
        let (mut bridge, mut bench) = (ends(&at(near)).0, ends(&at(far)).1);
        let (sent_values, mut sensors, mut updated) = (measured(S), Sensors::default(), 0);
        for frame in sent(&mut *bench, S, &sent_values) {
            assert_eq!(is_fd(&frame), far);
            updated |= bridge.receive(&frame, S, &mut sensors).updated;
        }
        let [rate, speed] = [sensors.body_rate, sensors.propeller_rate[1]];
        assert!((rate.value - sent_values.body_rate.value).abs() < 0.02, "{rate:?}");
        assert!((speed.value - sent_values.propeller_rate[1].value).abs() < 0.06, "{speed:?}");
        assert_eq!(bridge.counts().accepted, 3, "an IMU and two ESCs");
        assert_eq!(updated.count_ones(), 11);
        let mut commands = RotorCommands::default();
        let frames = bridge.commands(&applied([0.25, 0.75])).to_vec();
        assert_eq!(
            frames.iter().map(is_fd).collect::<Vec<_>>(),
            [near],
            "a command of two ESCs is one frame"
        );
        let decoded = bench.receive(&frames[0], S, &mut commands);
        assert!(decoded.updated == 3 && (commands.rotor[1] - 0.75).abs() < 1e-4, "{commands:?}");
        for frame in bridge.due_frames(S, &applied([0.25, 0.75])).to_vec() {
            assert_eq!(is_fd(&frame), near);
            bench.receive(&frame, S, &mut commands);
        }
        assert!(bench.may_turn(S));
    }
}

/// The zeros that fill a frame are no commands: an ESC behind the end of the array hears nothing.
#[test]
fn zeros_at_the_end_of_a_frame_command_nobody() {
    let mut own = on_fd();
    own.dronecan.esc_index = [3, 4];
    let (mut bridge, mut bench) = ends(&own);
    let [frame] = raw_command(0, &[0, 0, 0, 8191])[..] else { panic!("one frame") };
    assert_eq!(frame.length(), 12, "61 bits, and 27 that fill it: the next number would be there");
    let mut commands = RotorCommands::default();
    assert_eq!(bench.receive(&frame, S, &mut commands).updated, 1, "the first rotor's");
    assert_eq!(commands.rotor, [1.0, 0.0]);
    let mut sensors = Sensors::default();
    assert_eq!(bridge.receive(&frame, S, &mut sensors).refused, Some(FrameRefusal::ForeignCommand));
    assert_eq!(bridge.foreign(), Some(ForeignSender::Commands { node: 9, last: 3, reaches_ours: true }));
    let [empty] = raw_command(1, &[])[..] else { panic!("one frame") };
    assert_eq!(bridge.receive(&empty, S, &mut sensors).refused, None, "nobody is commanded");
    // Twenty of them are one frame, too.
    let [longest] = raw_command(2, &[1; 20])[..] else { panic!("one frame") };
    assert_eq!(longest.length(), 48);
    assert_eq!(bridge.receive(&longest, S, &mut sensors).refused, Some(FrameRefusal::ForeignCommand));
    assert_eq!(bridge.foreign(), Some(ForeignSender::Commands { node: 9, last: 19, reaches_ours: true }));
}

/// What the nodes of both ends answer to `question`, whole.
fn answered(name: &str, to: u8, question: &Value, framing: Framing) -> Value {
    let library = Library::build(&[]).expect("sound");
    let (mut bridge, mut bench) = ends(&on_fd());
    for frame in transfer(name, TransferKind::Request { to }, 5, question, framing) {
        bridge.receive(&frame, S, &mut Sensors::default());
        bench.receive(&frame, S, &mut RotorCommands::default());
    }
    let (response, subscription) = structure(&library, name, TransferKind::Response { to: 9 });
    let mut assembler = Assembler::new(vec![subscription]);
    let mut whole = None;
    for turn in 0..20 {
        let mut frames = sent(&mut *bench, S + turn, &Sensors::default());
        frames.extend_from_slice(bridge.due_frames(S + turn, &Applied::default()));
        for frame in frames.iter().filter(|frame| frame.id().number() & 0x80 != 0) {
            assert_eq!(Framing::of(frame), framing, "an answer comes as the question did");
            if let Some(transfer) = assembler.receive(frame, S).expect("sound") {
                assert_eq!((transfer.header.source, transfer.transfer_id), (to, 5));
                whole = Some(decode(response, transfer.payload, transfer.framing).expect("an answer"));
            }
        }
    }
    whole.expect("an answer")
}

#[test]
fn an_answer_says_the_same_in_either_kind_of_frames() {
    let nothing = || Value::Union(0, Box::new(Value::List(Vec::new())));
    let text = |text: &str| Value::List(text.bytes().map(|it| Value::Integer(i128::from(it))).collect());
    let get = |index: i128, name: &str| Value::List(vec![Value::Integer(index), nothing(), text(name)]);
    let set = Value::Union(2, Box::new(Value::Float(0.25)));
    let questions = [
        ("uavcan.protocol.GetNodeInfo", 100, Value::List(Vec::new())),
        ("uavcan.protocol.GetNodeInfo", 21, Value::List(Vec::new())),
        ("uavcan.protocol.param.GetSet", 20, get(1, "")),
        ("uavcan.protocol.param.GetSet", 20, get(0, "reversed")),
        ("uavcan.protocol.param.GetSet", 20, get(0, "gain")),
        ("uavcan.protocol.param.GetSet", 20, get(77, "")),
        ("uavcan.protocol.param.GetSet", 21, Value::List(vec![Value::Integer(0), set, text("timeout_s")])),
        ("uavcan.protocol.param.ExecuteOpcode", 21, integers(&[0, 0])),
    ];
    for (name, to, question) in &questions {
        let [classic, fd] =
            [Framing::Classic, Framing::Fd].map(|framing| answered(name, *to, question, framing));
        assert_eq!(classic, fd, "{name}, node {to}");
    }
    let Value::List(fields) = answered(questions[6].0, 21, &questions[6].2, Framing::Fd) else {
        panic!("a list")
    };
    assert_eq!(fields[0], Value::Union(2, Box::new(Value::Float(0.25))));
    assert_eq!(fields[4], text("timeout_s"));
    let Value::List(fields) = answered(questions[0].0, 100, &questions[0].2, Framing::Fd) else {
        panic!("a list")
    };
    assert_eq!(fields[3], text("org.rotorbench.bridge"));
}

/// Frames of the two kinds are no parts of one transfer; a frame that is longer than its type is none of it.
#[test]
fn a_transfer_is_of_one_kind_of_frames() {
    let library = Library::build(&[]).expect("sound");
    let name = "uavcan.protocol.GetNodeInfo";
    let kind = TransferKind::Response { to: 100 };
    let (response, of) = structure(&library, name, kind);
    let value = rotorbench::can::dronecan::empty_message(response, 0.0);
    let Value::List(mut fields) = value else { panic!("a structure") };
    fields[3] = integers(&[i128::from(b'x'); 80]);
    let value = Value::List(fields);
    let [fd, classic] =
        [Framing::Fd, Framing::Classic].map(|framing| transfer(name, kind, 3, &value, framing));
    assert_eq!((fd.len(), classic.len()), (2, 18));
    let mut assembler = Assembler::new(vec![of]);
    assert_eq!(assembler.receive(&fd[0], S).map(|it| it.is_some()), Ok(false));
    assert_eq!(assembler.receive(&classic[1], S), Err(FrameRefusal::Incomplete));
    assert_eq!(assembler.receive(&fd[1], S), Err(FrameRefusal::Incomplete), "given up");
    assert_eq!(assembler.receive(&fd[0], S).map(|it| it.is_some()), Ok(false));
    assert_eq!(assembler.receive(&fd[1], S).map(|it| it.is_some()), Ok(true));
    let (status, of) = structure(&library, "uavcan.protocol.NodeStatus", TransferKind::Message);
    assert_eq!(status.most_bits(), 56);
    let long = Frame::new(fd[0].id(), fd[0].kind(), &[0xC0; 12]).expect("a length that there is");
    let id = rotorbench::can::Id::Extended(TransferHeader::message(24, 341, 9).id());
    let long = Frame::new(id, long.kind(), long.data()).expect("as long");
    assert_eq!(Assembler::new(vec![of]).receive(&long, S), Err(FrameRefusal::WrongLength));
}

/// `check` shows where the numbers are in FD frames, and what they cost the bus.
#[test]
fn check_shows_fd_frames_as_they_are() {
    let loaded = |fd: bool| {
        let own = BusConfig { fd, bit_rate: 1_000_000, data_bit_rate: 4_000_000, ..config() };
        let spoken = protocol(&own, 0.02).expect("sound");
        let command = spoken.messages().into_iter().find(|it| it.is_sent).expect("a command");
        (command.signals[1].place.clone(), command.bytes, spoken.load(&own).percent)
    };
    let (classic, fd) = (loaded(false), loaded(true));
    assert_eq!((classic.0.as_str(), classic.1), ("i14 at 14", 4));
    assert_eq!((fd.0.as_str(), fd.1), ("i14 at 19", 5));
    assert!(fd.2 < 0.5 * classic.2, "{fd:?} beside {classic:?}");
}
