//! The CAN codec: a signal and a frame, against the bitwise walk and a bare copy of the payload in the same run.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use rotorbench::can::{
    BusConfig, ByteOrder, Frame, MAXIMUM_LENGTH, NumberFormat, Payload, Roles, SignalCodec, SignalLayout,
    walk,
};
use rotorbench::signal::{Applied, Channel, Sample, Sensors};

fn payload() -> Payload {
    let mut payload = [0; MAXIMUM_LENGTH];
    payload.iter_mut().zip(1_u8..).for_each(|(byte, value)| *byte = value.wrapping_mul(37));
    payload
}

/// One signal of each kind, in the places where ESCs and IMUs have them.
fn signals() -> [(&'static str, SignalLayout); 4] {
    let layout = |start, size, order, number| SignalLayout { start, size, order, number };
    [
        ("little i16", layout(16, 16, ByteOrder::Little, NumberFormat::Signed)),
        ("big i32", layout(7, 32, ByteOrder::Big, NumberFormat::Signed)),
        ("little f32", layout(32, 32, ByteOrder::Little, NumberFormat::Float32)),
        ("big u12 across bytes", layout(11, 12, ByteOrder::Big, NumberFormat::Unsigned)),
    ]
}

fn one_signal(criterion: &mut Criterion) {
    let payload = payload();
    let mut group = criterion.benchmark_group("decode a signal");
    group.bench_function("baseline: copy the payload", |bencher| {
        bencher.iter(|| u64::from_le_bytes(black_box(&payload)[..8].try_into().expect("eight bytes")));
    });
    for (name, layout) in signals() {
        let codec = SignalCodec::build(layout, 8, 0.05, 1.0).expect("fits");
        group.bench_function(name, |bencher| bencher.iter(|| black_box(&codec).decode(black_box(&payload))));
        group.bench_function(format!("{name}, bitwise walk"), |bencher| {
            bencher
                .iter(|| black_box(&codec).scale(walk::decode_raw(black_box(layout), black_box(&payload))));
        });
    }
    group.finish();
    let mut group = criterion.benchmark_group("encode a signal");
    for (name, layout) in signals() {
        let codec = SignalCodec::build(layout, 8, 0.05, 1.0).expect("fits");
        let mut encoded = payload;
        group.bench_function(name, |bencher| {
            bencher.iter(|| black_box(&codec).encode(black_box(&mut encoded), black_box(12.3)));
        });
        group.bench_function(format!("{name}, bitwise walk"), |bencher| {
            bencher.iter(|| {
                let raw = black_box(&codec).unscale(black_box(12.3));
                walk::encode_raw(black_box(layout), black_box(&mut encoded), raw);
            });
        });
    }
    group.finish();
}

fn one_frame(criterion: &mut Criterion) {
    let roles = Roles::build(&BusConfig::default(), 0.001).expect("sound");
    let mut sent = Sensors::default();
    Channel::ALL.into_iter().for_each(|field| *field.of_mut(&mut sent) = Sample::good(1.0, 1, 1));
    let mut sender = roles.sensor_sender();
    let status =
        roles.sensor_messages().iter().position(|route| route.name == "ESC_1_STATUS").expect("there");
    // As many frames as the counter has values, so that each goes on from the one before.
    let frames: Vec<Frame> =
        (0..256).filter_map(|_| roles.encode_sensors(&mut sender, status, &sent)).collect();

    let mut group = criterion.benchmark_group("a frame");
    group.bench_function("baseline: copy the frame", |bencher| {
        bencher.iter(|| *black_box(&frames[0]));
    });
    let (mut state, mut sensors, mut next) = (roles.sensor_receiver(), Sensors::default(), 0);
    group.bench_function("decode 3 signals into Sensors, checked", |bencher| {
        bencher.iter(|| {
            next = (next + 1) % frames.len();
            roles.decode_sensors(&mut state, black_box(&frames[next]), 1, &mut sensors)
        });
    });
    assert_eq!(state.counts.frames, state.counts.accepted, "every frame was good");
    group.bench_function("encode 3 signals from Sensors", |bencher| {
        bencher.iter(|| roles.encode_sensors(&mut sender, black_box(status), black_box(&sent)));
    });
    let mut sender = roles.command_sender();
    let applied = Applied { rotor: [0.4, 0.6], state: 2, ..Applied::default() };
    group.bench_function("encode 3 signals from Applied", |bencher| {
        bencher.iter(|| roles.encode_commands(&mut sender, black_box(&applied)));
    });
    group.finish();
}

criterion_group!(benches, one_signal, one_frame);
criterion_main!(benches);
