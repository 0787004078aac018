//! Any frames, at any times, at both ends of a bench on DroneCAN and at whoever asks the nodes: no value gets through that is
//! not finite, and nothing is sent but whole frames.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rotorbench::can::dronecan::{NodeMonitor, Participant as _};
use rotorbench::can::{
    BenchEnd, BridgeEnd, BusConfig, Frame, FrameKind, Id, Protocol, ProtocolName, RotorCommands, protocol,
};
use rotorbench::signal::{Applied, Channel, Sensors};

/// Length of a record before its data: times, kind and length, identifier.
const HEAD: usize = 6;

/// Both ends of the bench, new.
fn ends(now_ns: u64) -> (Box<dyn BridgeEnd>, Box<dyn BenchEnd>) {
    thread_local! {
        static SPOKEN: Box<dyn Protocol> = {
            let config = BusConfig { protocol: ProtocolName::Dronecan, ..BusConfig::default() };
            protocol(&config, 0.02).expect("sound")
        };
    }
    SPOKEN.with(|spoken| (spoken.bridge_end(), spoken.bench_end(now_ns)))
}

fuzz_target!(|bytes: &[u8]| {
    let mut now_ns = 1_000_000_000;
    let (mut bridge, mut bench) = ends(now_ns);
    let mut monitor = NodeMonitor::new(127).expect("a node's id");
    let (mut sensors, mut commands) = (Sensors::default(), RotorCommands::default());
    let mut rest = bytes;
    while let Some((&[wait, form, a, b, c, d], behind)) = rest.split_first_chunk::<HEAD>() {
        // Up to four seconds, in steps that grow.
        now_ns += u64::from(wait).pow(4);
        let length = usize::from(form & 0x3F).min(behind.len());
        let (data, behind) = behind.split_at(length);
        rest = behind;
        let kind = if form & 0x40 == 0 {
            FrameKind::Classic
        } else {
            FrameKind::Fd { bit_rate_switch: false, error_state: false }
        };
        let number = u32::from_be_bytes([a, b, c, d]);
        let Some(id) = Id::new(number & 0x1FFF_FFFF, true) else { continue };
        let Some(frame) = Frame::new(id, kind, data) else { continue };
        bridge.receive(&frame, now_ns, &mut sensors);
        bench.receive(&frame, now_ns, &mut commands);
        monitor.receive(&frame, now_ns);
        assert!(monitor.due_frames(now_ns).len() < 1024);
        let applied = Applied { state: u32::from(form >> 7), rotor: commands.rotor, ..Applied::default() };
        assert!(bridge.commands(&applied).iter().all(|frame| !frame.data().is_empty()));
        assert!(bridge.due_frames(now_ns, &applied).len() < 64);
        let _ = (bridge.trouble(now_ns), bridge.foreign(), bench.may_turn(now_ns));
        bench.send_due(now_ns, &sensors, &mut |frame| assert!(!frame.data().is_empty()));
    }
    assert!(Channel::ALL.iter().all(|field| field.of(&sensors).value.is_finite()));
    assert!(commands.rotor.iter().all(|rotor| (0.0..=1.0 + 1e-6).contains(rotor)));
});
