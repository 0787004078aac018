//! More frames than the bus is for, and garbage with the right identifiers.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rotorbench::can::{Frame, Id};
use rotorbench::clock;
use rotorbench::guard::{Cause, State};

use crate::bus::Bus;
use crate::faults::{Hardware, Lie, armed_bench, bench, safe_on_the_bus};
use crate::json_schema;
use crate::processes::{late, say, up_to_six_times};

fn frame(id: u32, data: &[u8]) -> Frame {
    Frame::classic(Id::new(id, false).expect("an id"), data).expect("fits")
}

/// Frames that the third party sends at once, and then it sleeps 10 ms: 4000 a second are all that a wire of 500 kbit/s carries.
/// Without a pause the emulated kernel never sleeps, and its host takes the processor away from it for longer than a hold.
const BURST: u32 = 40;

/// Does something while a third party fills the bus with one frame; how many it took.
fn while_flooded(bus: &Bus, act: impl FnOnce()) -> u64 {
    let frame = frame(0x555, &[0xAA; 8]);
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let flood = scope.spawn(|| {
            let (mut port, mut sent) = (bus.port(), 0_u64);
            while !is_over.load(Ordering::Relaxed) {
                sent += (0..BURST).map(|_| u64::from(port.send(&frame).is_ok())).sum::<u64>();
                while port.receive(|_| {}).is_ok_and(|taken| taken > 0) {}
                std::thread::sleep(Duration::from_millis(10));
            }
            sent
        });
        // Also when `act` ends the scenario, which is by a panic: the flood would go on, and be waited for.
        let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(act));
        is_over.store(true, Ordering::Relaxed);
        let sent = flood.join().expect("no panic");
        ended.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        sent
    })
}

/// On a wire the sensors lose each arbitration against a flood of a stronger identifier.
#[test]
fn sensors_that_drown_in_a_flood_end_in_the_safe_command() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("drown", &bus);
        let hardware = Hardware::start(&bench);
        let mut port = bus.port();
        let (_bridge, _control, mut watcher) = armed_bench(&bench);
        let sent = while_flooded(&bus, || {
            std::thread::sleep(Duration::from_millis(100));
            watcher.each(|_| {});
            if !State::from_code(watcher.newest.state).unwrap_or_default().is_active() {
                late(format!("the flood alone ended the run: {:?}", watcher.said));
            }
            let at_ns = hardware.lie(Lie::ImuSilent);
            let safe_ns = safe_on_the_bus(&bench, &mut port, at_ns);
            bench.judge("a flood, and no IMU through it", at_ns, safe_ns);
            watcher.assert_latched(&[Cause::SignalStale, Cause::CommandAnswersOldSensors]);
        });
        say(&format!("{sent} frames of flood meanwhile"));
        if sent < 50 {
            late(format!("{sent} frames are no flood"));
        }
    });
}

#[test]
fn a_flood_and_garbage_move_no_rotor_and_are_counted_by_cause() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("flood", &bus);
        let _hardware = Hardware::start(&bench);
        let mut bridge = bench.start(&["bridge", "--json"]);
        let control = bench.start(&["control"]);
        let mut watcher = bench.watch();
        bench.arm_and_wait(&mut watcher);
        let mut port = bus.port();
        let flood = frame(0x555, &[0xAA; 8]);
        let maximum = bench.config.guard.rotor_maximum;
        let mut highest = 0.0_f64;
        let mut sent = 0_u32;
        while sent < 20_000 {
            sent += u32::from(port.send(&flood).is_ok());
            let _ = port.receive(|_| {});
            if sent.is_multiple_of(64) {
                watcher.each(|applied| highest = applied.rotor.into_iter().fold(highest, f64::max));
            }
        }
        // The right ids: wrong length, not a number, out of range; and the same of an ESC.
        let not_a_number = f32::NAN.to_le_bytes();
        let too_fast = 1e6_f32.to_le_bytes();
        for _ in 0..3 {
            let _ = port.send(&frame(0x20, &[1, 2, 3]));
            let _ = port.send(&frame(0x41, &[]));
            for rate in [not_a_number, too_fast] {
                let _ = port.send(&frame(0x20, &[0, 0, 0, 0, rate[0], rate[1], rate[2], rate[3]]));
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_millis(100));
        watcher.each(|applied| highest = applied.rotor.into_iter().fold(highest, f64::max));
        assert!(highest <= maximum, "a rotor got {highest}");
        let state = State::from_code(watcher.newest.state).unwrap_or_default();
        say(&format!(
            "{sent} frames of flood, then garbage with right ids: highest command {highest:.3}, guard {state}"
        ));
        drop(control);
        let at_ns = clock::monotonic_ns();
        bridge.signal(libc::SIGTERM);
        let safe_ns = safe_on_the_bus(&bench, &mut port, at_ns);
        bench.judge("SIGTERM of bridge after the flood", at_ns, safe_ns);
        assert!(bridge.wait().success());
        let summary = json_schema::answer("bridge", bridge.output());
        let decoded = &summary["bus"]["decoded"];
        say(&format!("counted by cause: {decoded}"));
        let count = |cause: &str| decoded[cause].as_u64().expect("a number");
        let lost = summary["bus"]["port"]["dropped"].as_u64().expect("a number");
        assert!(
            count("unknown_id") + lost >= u64::from(sent),
            "each frame of the flood is seen or counted as lost"
        );
        assert!(count("wrong_length") <= 6 && count("wrong_length") + lost >= 6, "{decoded}");
        assert!(count("not_a_number") + count("out_of_range") + count("counter") + lost >= 6, "{decoded}");
    });
}
