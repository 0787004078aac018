//! DroneCAN against its reference implementation, bit for bit: vectors made by `tools/golden-dronecan`, which says their
//! format.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use rotorbench::can::dronecan::{
    Assembler, BitPlace, Compound, CompoundBody, Definition, Framing, Library, Structure, Subscription,
    TransferFrames, TransferHeader, TransferKind, Type, Value, decode, empty_message, encode,
};
use rotorbench::can::{Frame, FrameKind, FrameRefusal, Id};
use serde_json::Value as Json;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const MS: u64 = 1_000_000;

/// The published types, and those of vendors in `tests/can/dsdl/`.
pub static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let vendors = [
        ("com.hobbywing.esc", "20050.StatusMsg1"),
        ("com.tmotor.esc", "1039.PUSHCAN"),
        ("uavcan.equipment.gnss", "1063.Fix2"),
        ("uavcan.equipment.gnss", "ECEFPositionVelocity"),
    ];
    let others = vendors.map(|(namespace, name)| {
        let file = format!("{}/{name}.uavcan", namespace.replace('.', "/"));
        let text = fs::read_to_string(Path::new(ROOT).join("tests/can/dsdl").join(&file)).expect("readable");
        Definition::new(&file, namespace, text).expect("named")
    });
    Library::build(&others).expect("sound")
});

fn part<'a>(compound: &'a Compound, part: &str) -> &'a Structure {
    match (&compound.body, part) {
        (CompoundBody::Message(message), "message") => message,
        (CompoundBody::Service(request, _), "request") => request,
        (CompoundBody::Service(_, response), "response") => response,
        _ => panic!("{} has no {part}", compound.name),
    }
}

/// A transfer as the reference made it.
struct Vector {
    compound: &'static Compound,
    part: String,
    header: TransferHeader,
    transfer_id: u8,
    framing: Framing,
    given: Value,
    read: Value,
    frames: Vec<Frame>,
}

impl Vector {
    fn parse(line: &str) -> Self {
        let json: Json = serde_json::from_str(line).expect("JSON");
        let number = |key: &str| json[key].as_u64().unwrap_or(0);
        let compound = LIBRARY.get(json["type"].as_str().expect("a name")).expect("defined");
        let name = json["part"].as_str().expect("a name").to_owned();
        let to = number("to") as u8;
        let kind = match name.as_str() {
            "request" => TransferKind::Request { to },
            "response" => TransferKind::Response { to },
            _ => TransferKind::Message,
        };
        let is_fd = json["fd"] == true;
        let fd = FrameKind::Fd { bit_rate_switch: true, error_state: false };
        let kind_of_frame = if is_fd { fd } else { FrameKind::Classic };
        let frame = |frame: &Json| {
            let text = |index: usize| frame[index].as_str().expect("text");
            let id = u32::from_str_radix(text(0), 16).expect("an identifier");
            let bytes: Vec<u8> = (0..text(1).len() / 2)
                .map(|at| u8::from_str_radix(&text(1)[2 * at..2 * at + 2], 16).expect("a byte"))
                .collect();
            Frame::new(Id::Extended(id), kind_of_frame, &bytes).expect("a length that there is")
        };
        let structure = part(compound, &name);
        Self {
            header: TransferHeader {
                priority: number("priority") as u8,
                type_id: compound.id.expect("a transfer has one"),
                source: number("source") as u8,
                kind,
                discriminator: number("discriminator") as u16,
            },
            transfer_id: number("transfer_id") as u8,
            framing: Framing::of_bus(is_fd),
            given: message(structure, &json["given"]),
            read: message(structure, &json["read"]),
            frames: json["frames"].as_array().expect("frames").iter().map(frame).collect(),
            compound,
            part: name,
        }
    }

    fn subscription(&self) -> Subscription {
        let structure = part(self.compound, &self.part);
        let (id, signature) = (self.header.type_id, self.compound.signature);
        Subscription::new(id, self.header.kind, signature, structure.most_bits())
    }
}

fn message(structure: &Structure, json: &Json) -> Value {
    if structure.is_union {
        let index = json["field"].as_u64().expect("a number") as usize;
        return Value::Union(index, Box::new(value(&structure.fields[index].of, &json["value"])));
    }
    let fields = structure.fields.iter().filter(|field| !field.name.is_empty());
    let values = json.as_array().expect("a list");
    Value::List(fields.zip(values).map(|(field, json)| value(&field.of, json)).collect())
}

fn value(of: &Type, json: &Json) -> Value {
    match of {
        Type::Void(_) => unreachable!("left out"),
        Type::Primitive(primitive) if primitive.kind == rotorbench::can::dronecan::NumberKind::Float => {
            Value::Float(
                json.as_f64().unwrap_or_else(|| json.as_str().expect("a name").parse().expect("a float")),
            )
        }
        // What no 64 bits hold is beyond any field, too.
        Type::Primitive(_) => Value::Integer(
            json.as_i64()
                .map(i128::from)
                .or(json.as_u64().map(i128::from))
                .unwrap_or_else(|| json.as_f64().expect("a number") as i128),
        ),
        Type::Array(array) => Value::List(
            json.as_array().expect("a list").iter().map(|item| value(&array.item, item)).collect(),
        ),
        Type::Compound(compound) => message(compound.message().expect("a part"), json),
    }
}

/// Equal to the bit; any not-a-number is as good as another.
pub fn same(one: &Value, other: &Value) -> bool {
    match (one, other) {
        (Value::Float(one), Value::Float(other)) => {
            one.to_bits() == other.to_bits() || one.is_nan() && other.is_nan()
        }
        (Value::List(one), Value::List(other)) => {
            one.len() == other.len() && one.iter().zip(other).all(|(one, other)| same(one, other))
        }
        (Value::Union(at, one), Value::Union(other_at, other)) => at == other_at && same(one, other),
        (one, other) => one == other,
    }
}

fn vectors() -> Vec<Vector> {
    let mut folders = vec![Path::new(ROOT).join("tests/can/dronecan")];
    folders.extend(std::env::var_os("ROTORBENCH_GOLDEN_DRONECAN").map(PathBuf::from));
    let mut all = Vec::new();
    for folder in folders {
        let entries = fs::read_dir(folder).expect("readable");
        let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
        paths.sort();
        for path in paths {
            all.extend(fs::read_to_string(path).expect("readable").lines().map(Vector::parse));
        }
    }
    all
}

#[test]
fn agrees_with_the_reference_bit_for_bit_both_ways() {
    let vectors = vectors();
    let mut types: Vec<(&str, &str, bool)> = Vec::new();
    for vector in &vectors {
        let Vector { compound, header, framing, .. } = vector;
        let name = (compound.name.as_str(), vector.part.as_str(), *framing == Framing::Fd);
        let structure = part(compound, &vector.part);
        let subscription = vector.subscription();
        let payload = encode(structure, &vector.given, *framing).expect("of this type");
        let frames: Vec<Frame> =
            TransferFrames::new(*header, subscription.seed, vector.transfer_id, &payload)
                .framed(*framing)
                .collect();
        assert!(frames == vector.frames, "{name:?}: {:?}\n{frames:x?}\n{:x?}", vector.given, vector.frames);
        let mut assembler = Assembler::new(vec![subscription]);
        let (last, before) = vector.frames.split_last().expect("one at least");
        for frame in before {
            assert_eq!(assembler.receive(frame, MS), Ok(None), "{name:?}");
        }
        let transfer = assembler.receive(last, MS).expect("sound").expect("whole");
        // Of a message by nobody the identifier holds two bits of the type.
        assert_eq!((transfer.header, transfer.transfer_id), (*header, vector.transfer_id), "{name:?}");
        assert_eq!(transfer.framing, *framing, "{name:?}");
        let read = decode(structure, transfer.payload, transfer.framing).expect("sound");
        assert!(same(&read, &vector.read), "{name:?}: {read:?}, not {:?}", vector.read);
        types.push(name);
    }
    types.sort_unstable();
    types.dedup();
    println!("{} transfers of {} types and kinds of frames", vectors.len(), types.len());
    let fd = types.iter().filter(|it| it.2).count();
    assert!(vectors.len() >= 600 && types.len() - fd >= 12 && fd >= 12, "the vectors were there");
}

/// One place of a message, read as a cycle does, holds what the whole message says.
#[test]
fn a_place_holds_what_the_message_says() {
    let mut count = 0;
    for vector in vectors().iter().filter(|it| it.compound.name == "uavcan.equipment.esc.Status") {
        let message = part(vector.compound, "message");
        let framing = vector.framing;
        let payload = encode(message, &vector.given, framing).expect("of this type");
        let (Value::List(read), Value::List(given)) = (&vector.read, &vector.given) else { panic!("a list") };
        let mut written = vec![0; payload.len()];
        for (field, (read, given)) in message.fields.iter().zip(read.iter().zip(given)) {
            let place = BitPlace::find(message, &field.name).expect("fixed");
            let found = place.read(&payload, framing).expect("there");
            match read {
                Value::Integer(integer) => assert_eq!(found, *integer as f64, "{}", field.name),
                Value::Float(float) => assert!(same(&Value::Float(found), &Value::Float(*float))),
                _ => panic!("a number"),
            }
            match given {
                Value::Integer(integer) => place.write(&mut written, framing, *integer as f64),
                Value::Float(float) => place.write(&mut written, framing, *float),
                _ => panic!("a number"),
            }
        }
        assert_eq!(written, payload);
        count += 1;
    }
    assert!(count >= 40);
}

fn of_type(name: &str) -> &'static Compound {
    LIBRARY.get(name).expect("published")
}

pub fn listening(name: &str) -> (Assembler, Subscription) {
    let compound = of_type(name);
    let most = compound.message().expect("a message").most_bits();
    let subscription =
        Subscription::new(compound.id.expect("sent"), TransferKind::Message, compound.signature, most);
    (Assembler::new(vec![subscription]), subscription)
}

/// The frames of an `esc.Status` of this node, three of them.
fn status(source: u8, transfer_id: u8, rpm: i128) -> Vec<Frame> {
    let (_, subscription) = listening("uavcan.equipment.esc.Status");
    let message = of_type("uavcan.equipment.esc.Status").message().expect("a message");
    let Value::List(mut values) = empty_message(message, 0.0) else { panic!("a structure") };
    values[4] = Value::Integer(rpm);
    let payload = encode(message, &Value::List(values), Framing::Classic).expect("of this type");
    let header = TransferHeader::message(16, 1034, source);
    TransferFrames::new(header, subscription.seed, transfer_id, &payload).collect()
}

fn rpm(
    assembler: &mut Assembler,
    frame: &Frame,
    now_ns: u64,
) -> Result<Option<(u8, f64, u64)>, FrameRefusal> {
    let place = BitPlace::find(of_type("uavcan.equipment.esc.Status").message().expect("it is"), "rpm");
    let transfer = assembler.receive(frame, now_ns)?;
    Ok(transfer.map(|it| {
        (it.header.source, place.expect("there").read(it.payload, it.framing).expect("whole"), it.lost)
    }))
}

/// What `frames` give, one each millisecond.
fn received(frames: &[Frame]) -> (Vec<(u8, f64, u64)>, Vec<FrameRefusal>) {
    let (mut assembler, _) = listening("uavcan.equipment.esc.Status");
    let (mut whole, mut refused) = (Vec::new(), Vec::new());
    for (index, frame) in frames.iter().enumerate() {
        match rpm(&mut assembler, frame, MS * (index as u64 + 1)) {
            Ok(transfer) => whole.extend(transfer),
            Err(refusal) => refused.push(refusal),
        }
    }
    (whole, refused)
}

#[test]
fn senders_whose_frames_alternate_do_not_disturb_each_other() {
    let (one, two, three) = (status(9, 4, 100), status(10, 4, 200), status(11, 31, 300));
    let mixed: Vec<Frame> = (0..3).flat_map(|at| [one[at], two[at], three[at]]).collect();
    assert_eq!(received(&mixed), (vec![(9, 100.0, 0), (10, 200.0, 0), (11, 300.0, 0)], vec![]));
}

#[test]
fn a_frame_sent_twice_is_left_out_and_a_transfer_sent_twice_is_not_taken_twice() {
    let frames = status(9, 4, 100);
    for doubled in 0..3 {
        let mut twice = frames.clone();
        twice.insert(doubled, frames[doubled]);
        let (whole, refused) = received(&twice);
        assert_eq!(whole, [(9, 100.0, 0)], "frame {doubled}");
        assert_eq!(refused.len(), usize::from(doubled > 0), "frame {doubled}: {refused:?}");
    }
    let again = [frames.clone(), frames].concat();
    let (whole, refused) = received(&again);
    assert_eq!((whole.len(), refused[0]), (1, FrameRefusal::Counter));
}

#[test]
fn a_lost_frame_costs_its_transfer_and_no_other() {
    for lost in 0..3 {
        let mut frames = [status(9, 31, 100), status(9, 0, 200)].concat();
        frames.remove(lost);
        let (whole, refused) = received(&frames);
        assert_eq!(whole, [(9, 200.0, 0)], "frame {lost}: {refused:?}");
    }
    // And what is missing is counted by the numbers of the transfers.
    let (whole, _) = received(&[status(9, 31, 100), status(9, 3, 200)].concat());
    assert_eq!(whole, [(9, 100.0, 0), (9, 200.0, 3)]);
}

#[test]
fn a_wrong_bit_or_toggle_is_refused_by_cause() {
    let change = |at: usize, byte: usize, bits: u8| {
        let mut frames = status(9, 4, 100);
        let mut data = frames[at].data().to_vec();
        data[byte] ^= bits;
        frames[at] = Frame::classic(frames[at].id(), &data).expect("short");
        received(&frames)
    };
    assert_eq!(change(1, 3, 0x10), (vec![], vec![FrameRefusal::Checksum]));
    assert_eq!(change(0, 0, 0x01), (vec![], vec![FrameRefusal::Checksum]));
    assert_eq!(change(0, 7, 0x20).1[0], FrameRefusal::Toggle);
    assert_eq!(change(1, 7, 0x20).1[0], FrameRefusal::Toggle);
    // The number of another transfer.
    assert_eq!(change(1, 7, 0x01).1, [FrameRefusal::Incomplete, FrameRefusal::Incomplete]);
}

#[test]
fn a_node_that_begins_anew_is_followed_at_once_and_one_that_was_silent_too() {
    let (whole, refused) = received(&[status(9, 17, 100), status(9, 0, 200), status(9, 1, 300)].concat());
    assert_eq!((whole.len(), refused.len()), (3, 0));
    let (mut assembler, _) = listening("uavcan.equipment.esc.Status");
    let mut at = |frames: &[Frame], now_ns: u64| {
        frames.iter().fold(None, |_, frame| rpm(&mut assembler, frame, now_ns).ok().flatten())
    };
    assert!(at(&status(9, 5, 1), MS).is_some());
    assert!(at(&status(9, 5, 2), 1_000 * MS).is_none(), "the same number, and a second later");
    assert!(at(&status(9, 5, 3), 3_000 * MS).is_some(), "after as long as numbers are kept");
}

#[test]
fn a_transfer_that_stops_midway_does_not_end_later() {
    let (mut assembler, _) = listening("uavcan.equipment.esc.Status");
    let frames = status(9, 5, 1);
    for (frame, now_ns) in frames.iter().zip([MS, 2 * MS]) {
        assert_eq!(rpm(&mut assembler, frame, now_ns), Ok(None));
    }
    assert_eq!(rpm(&mut assembler, &frames[2], 1_500 * MS), Err(FrameRefusal::Incomplete));
    // The stamp is that of the first frame: the values are no younger.
    for (frame, now_ns) in status(9, 6, 1).iter().zip([2_000 * MS, 2_001 * MS, 2_002 * MS]) {
        let transfer = assembler.receive(frame, now_ns).expect("sound");
        assert!(transfer.is_none_or(|it| it.stamp_ns == 2_000 * MS));
    }
}

#[test]
fn what_is_no_transfer_is_refused() {
    let (mut assembler, _) = listening("uavcan.equipment.esc.Status");
    let id = status(9, 0, 0)[0].id();
    let classic = |id, data: &[u8]| Frame::classic(id, data).expect("short");
    let mut refused = |frame: Frame| assembler.receive(&frame, MS).expect_err("refused");
    assert_eq!(refused(classic(Id::Standard(0x10), &[0xC0])), FrameRefusal::UnknownId);
    assert_eq!(refused(classic(Id::Extended(0x1004_0B09), &[0xC0])), FrameRefusal::UnknownId);
    assert_eq!(refused(Frame::remote(id, 8).expect("short")), FrameRefusal::UnknownId);
    assert_eq!(refused(classic(id, &[])), FrameRefusal::WrongLength);
    // Longer than any message of the type, and a part that is not full.
    assert_eq!(refused(classic(id, &[1, 0x00])), FrameRefusal::Incomplete);
    let begin = classic(id, &[1, 2, 3, 4, 5, 6, 7, 0x80]);
    let mut turn = |frames: &[Frame]| {
        let each = |_, frame| assembler.receive(frame, MS).map(|it| it.is_some());
        frames.iter().fold(Ok(false), each)
    };
    assert_eq!(turn(&[begin, classic(id, &[1, 0x20])]), Err(FrameRefusal::WrongLength));
    let on = |toggle: u8| classic(id, &[1, 2, 3, 4, 5, 6, 7, toggle]);
    assert_eq!(turn(&[begin, on(0x20), on(0x00)]), Err(FrameRefusal::WrongLength));
    assert_eq!(turn(&[classic(id, &[0x80])]), Err(FrameRefusal::WrongLength));
}

/// A message of a node without an id is one frame; nothing puts two together.
#[test]
fn an_anonymous_message_is_one_frame() {
    let (mut assembler, _) = listening("uavcan.protocol.dynamic_node_id.Allocation");
    let header = TransferHeader {
        priority: 20,
        type_id: 1,
        source: 0,
        kind: TransferKind::Message,
        discriminator: 0x2AB,
    };
    let frame = |tail: u8| Frame::classic(Id::Extended(header.id()), &[1, 2, 3, tail]).expect("short");
    for _ in 0..2 {
        let transfer = assembler.receive(&frame(0xC0), MS).expect("sound").expect("whole");
        assert_eq!((transfer.header, transfer.payload), (header, &[1, 2, 3][..]), "and a second one, too");
    }
    assert_eq!(assembler.receive(&frame(0x80), MS), Err(FrameRefusal::Incomplete));
    assert_eq!(assembler.receive(&frame(0xE0), MS), Err(FrameRefusal::Toggle));
}
