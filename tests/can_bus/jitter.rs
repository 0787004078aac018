//! `jitter` with a bus: the whole loop, armed on the emulator, counted; and what it says of a bus it must not touch.

use std::os::fd::AsRawFd;
use std::process::{Command, Output};

use rotorbench::can::{Arrival, BusConfig, Roles, RotorCommands};
use rotorbench::guard::State;
use rotorbench::{clock, rt};
use serde_json::Value;

use super::bus::Bus;
use super::json_schema;
use super::processes::{late, up_to_six_times};

fn jitter(options: &[&str]) -> Output {
    let fixed = ["jitter", "--json", "--without-cyclictest", "--rounds", "1", "--period-us", "20000"];
    let mut program = Command::new(env!("CARGO_BIN_EXE_rotorbench"));
    program.args(fixed).args(options).output().expect("the program runs")
}

fn bus_of(done: &Output) -> Value {
    let measured = json_schema::answer("jitter", &done.stdout);
    let stages = measured["stages"].as_array().expect("stages");
    stages.iter().find(|it| it["stage"] == "bus").expect("its row").clone()
}

#[test]
fn a_virtual_bus_is_measured_from_frame_to_command() {
    let bus = Bus::new();
    let result = bus_of(&jitter(&["--duration-s", "1", "--interface", &bus.name]));
    assert!(result["finding"].is_null() && result["not_measured"].is_null(), "{result}");
    let timing = &result["timing"];
    let count = |value: &Value| value.as_u64().expect("a count");
    assert_eq!(count(&timing["slots"]), count(&timing["run"]) + count(&timing["skipped"]));
    assert!(count(&timing["slots"]) >= 50, "{timing}");
    assert!(count(&timing["sensor_to_command"]["count"]) > 0, "the emulator's gyro was heard: {timing}");
}

/// What is measured is an armed bench: it ends as every bench does, by its guard.
#[test]
fn the_measured_loop_ends_by_the_ramp() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let mut port = bus.port();
        let roles = Roles::build(&BusConfig::default(), 0.02).expect("sound");
        let (mut receiver, mut commands) = (roles.command_receiver(), RotorCommands::default());
        let mut states = Vec::new();
        std::thread::scope(|scope| {
            let measured = scope.spawn(|| jitter(&["--duration-s", "2", "--interface", &bus.name]));
            let mut is_over = false;
            while !is_over {
                // Once more after the end: what came last.
                is_over = measured.is_finished();
                let _ = rt::wait([port.as_raw_fd()], clock::monotonic_ns() + 10_000_000);
                let _ = port.receive(|arrival| {
                    let Arrival::Frame { frame, stamp_ns, .. } = arrival else { return };
                    let updated =
                        roles.decode_commands(&mut receiver, &frame, stamp_ns, &mut commands).updated;
                    if updated != 0 && states.last() != Some(&commands.state) {
                        states.push(commands.state);
                    }
                });
            }
        });
        let code = |state: State| state as u32;
        if !states.contains(&code(State::Armed)) {
            late(format!("it never ran: {states:?}"));
        }
        let latched = states.iter().position(|state| *state == code(State::FailsafeLatched));
        assert!(latched.is_some(), "it ended without its guard: {states:?}");
        assert_eq!(commands.rotor, [0.0, 0.0]);
    });
}

#[test]
fn an_interface_that_is_not_there_or_may_be_real_is_named_and_left_alone() {
    let result = bus_of(&jitter(&["--duration-s", "0.1", "--interface", "vt-none"]));
    assert_eq!(result["finding"]["code"], "bus_unusable", "{result}");
    assert_eq!(result["finding"]["subject"], "vt-none");
    assert!(result["timing"].is_null());

    // As real as an interface gets here: by its name.
    let bus = Bus::named("can7");
    let mut port = bus.port();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("bench.toml");
    std::fs::write(&file, "name = 'jitter-real'\n[bus]\ninterface = 'can7'\n").expect("written");
    let result = bus_of(&jitter(&["--duration-s", "0.1", "--config", file.to_str().expect("UTF-8")]));
    assert_eq!(
        (&result["finding"]["code"], &result["finding"]["subject"]),
        (&"interface_not_named".into(), &"can7".into())
    );
    let mut heard = 0;
    port.receive(|_| heard += 1).expect("it is up");
    assert_eq!(heard, 0, "not a word was said on it");
}
