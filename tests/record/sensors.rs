//! The table of sensors, row by row: each has its role on the bus, its column in a log, its place in a recording, its limits in
//! the guard, and is emulated. A new row is checked without a line here.

use std::path::Path;

use rotorbench::bench::BenchConfig;
use rotorbench::can::{BusConfig, DatabaseConfig, Roles, SignalConfig};
use rotorbench::guard::{GuardConfig, SignalLimitsConfig};
use rotorbench::log::{LOG_SIGNALS, csv, export};
use rotorbench::recording::{End, RecordedItem, Recorder, RecorderOptions, Recording};
use rotorbench::runtime::lockstep::{Lockstep, Slot};
use rotorbench::runtime::replay::Replay;
use rotorbench::runtime::{controller_plant, record};
use rotorbench::signal::{Channel, Multiplicity, Sample, Sensor, Sensors};

/// The built-in bench with every sensor there is.
fn everything() -> BenchConfig {
    let mut bench = BenchConfig::default();
    for sensor in Sensor::ALL {
        let config = bench.emulator.sensors.of_mut(sensor);
        if config.rate_hz == 0.0 {
            config.rate_hz = 50.0;
        }
    }
    bench
}

/// Runs the bench in lockstep, and records it where a file is named.
fn record(bench: &BenchConfig, seconds: f64, file: Option<&Path>) -> Vec<Slot> {
    let emulator = bench.emulator.build().expect("a bench");
    let guard = bench.guard.build(bench.period_s).expect("a guard");
    let source = controller_plant::command_source(bench).expect("a controller");
    let lockstep = Lockstep::new(emulator, source, bench.period_s).guarded(guard);
    let Some(file) = file else { return lockstep.run(seconds, &mut ()) };
    let metadata = record::metadata(bench, "test", None).expect("the built-in model");
    let recorder = Recorder::start(file, &metadata, RecorderOptions::default()).expect("a new file");
    let slots = lockstep.run(seconds, &mut recorder.sender());
    assert_eq!(recorder.finish().expect("the disk works").dropped, 0);
    slots
}

#[test]
fn names_are_one_to_one_and_say_their_unit() {
    for channel in Channel::ALL {
        let same = |other: &Channel| other.name() == channel.name() || other.column() == channel.column();
        assert_eq!(Channel::ALL.iter().filter(|other| same(other)).count(), 1, "{channel}");
        assert!(channel.name().starts_with(channel.sensor().name()), "{channel}");
        let unit = channel.unit().to_lowercase().replace('/', "_").replace('^', "");
        assert_eq!(channel.column(), format!("{}_{unit}", channel.name()));
        let is_known = LOG_SIGNALS.iter().any(|it| it.name == channel.column() && it.unit == channel.unit());
        assert_eq!(is_known, channel.sensor().row().is_log_signal, "{channel}");
        assert!(export::COLUMNS.contains(&channel.column()), "{channel}");
    }
    for sensor in Sensor::ALL {
        let values = sensor.channels().len();
        assert_eq!(values == 1, sensor.row().multiplicity == Multiplicity::Single, "{}", sensor.name());
        assert!([0, values].contains(&sensor.row().bus.len()), "{}", sensor.name());
    }
}

/// In its SI unit, in the role that bench files name; and where the built-in bench has it.
#[test]
fn each_channel_has_a_role_on_the_bus() {
    let folder = tempfile::tempdir().expect("a folder");
    for channel in Channel::ALL {
        let file = folder.path().join(format!("{channel}.dbc"));
        let text = format!(
            "VERSION \"\"\n\nBU_: A\n\nBO_ 100 M: 8 A\n SG_ s : 0|32@1- (0.001,0) [-2000|2000] \"{}\" A\n",
            channel.unit()
        );
        std::fs::write(&file, text).expect("written");
        let mut bus: BusConfig =
            toml::from_str(&format!("[sensors]\n{channel} = {{ signal = \"M.s\" }}")).expect("a role");
        assert_eq!(bus.sensors.keys().collect::<Vec<_>>(), [&channel]);
        bus.messages.clear();
        bus.database.push(DatabaseConfig { file: file.display().to_string(), node_mask: None });
        let roles = Roles::build(&bus, 0.02).expect("sound");
        let mut sent = Sensors::default();
        *channel.of_mut(&mut sent) = Sample::good(123.456, 1, 1);
        let frame = roles.encode_sensors(&mut roles.sensor_sender(), 0, &sent).expect("a message");
        let mut received = Sensors::default();
        let decoded = roles.decode_sensors(&mut roles.sensor_receiver(), &frame, 7, &mut received);
        assert_eq!(decoded.updated, channel.bit());
        assert!((channel.of(&received).value - 123.456).abs() < 1e-9, "{channel}");
    }
    let built_in = BusConfig::default();
    for sensor in Sensor::ALL {
        for (place, channel) in sensor.channels().iter().enumerate() {
            let role = sensor.row().bus.get(place).map(|signal| SignalConfig::new(signal));
            assert_eq!(built_in.sensors.get(channel), role.as_ref(), "{channel}");
        }
    }
}

#[test]
fn each_watched_channel_has_its_limits_in_the_guard() {
    for sensor in Sensor::ALL {
        let text = format!("[{}]\nrequired = true\nminimum = -1.5", sensor.name());
        let Some(row) = sensor.guard() else {
            assert!(toml::from_str::<GuardConfig>(&text).is_err(), "{}", sensor.name());
            continue;
        };
        assert!(row.range.0 < row.range.1, "{}", sensor.name());
        let config: GuardConfig = toml::from_str(&text).expect("a table of the guard");
        let expected =
            SignalLimitsConfig { required: Some(true), minimum: Some(-1.5), ..SignalLimitsConfig::default() };
        assert_eq!(config.of(sensor), Some(&expected));
        let requires = |config: &GuardConfig, channel| {
            config.build(0.02).expect("valid").requirements().any(|(required, _)| required == channel)
        };
        for channel in sensor.channels() {
            assert!(requires(&config, *channel), "{channel}");
            assert_eq!(requires(&GuardConfig::default(), *channel), row.required, "{channel}");
            assert_eq!(Channel::of_subject(channel.subject()), Some(*channel));
        }
    }
}

/// From the emulated bench through the recording into a log, and back from there.
#[test]
fn each_channel_is_emulated_recorded_exported_and_read_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let (recording, log) = (folder.path().join("run.mcap"), folder.path().join("run.csv"));
    let slots = record(&everything(), 3.0, Some(&recording));
    let last = slots.last().expect("slots").sensors;
    let mut read = Vec::new();
    let mut file = Recording::open(&recording).expect("a recording");
    for found in file.by_ref() {
        if let RecordedItem::Sensors(sensors) = found.expect("readable") {
            read.push(sensors);
        }
    }
    assert_eq!(file.end(), Some(&End::Whole));
    assert!(read.contains(&last), "recorded to the bit");
    export::write_log(&recording, &log).expect("exported");
    let exported = csv::read(&log).expect("a log");
    for channel in Channel::ALL {
        let sample = channel.of(&last);
        assert!(sample.is_good() && sample.count > 0, "{channel}: {sample:?}");
        if let Some(guard) = channel.sensor().guard() {
            assert!((guard.range.0..=guard.range.1).contains(&sample.value), "{channel}: {sample:?}");
        }
        // A cell holds what came since the row before.
        let mut count = 0;
        let expected = slots.iter().map(|slot| {
            let sample = channel.of(&slot.sensors);
            let is_new = sample.is_good() && std::mem::replace(&mut count, sample.count) != sample.count;
            if is_new { sample.value.to_bits() } else { f64::NAN.to_bits() }
        });
        let column = exported.column(channel.column()).expect("a column");
        assert_eq!(
            column.iter().map(|value| value.to_bits()).collect::<Vec<_>>(),
            expected.collect::<Vec<_>>()
        );
    }
}

/// A sensor has its own random numbers, and one that is a passenger does not even change when the plant is integrated.
#[test]
fn a_sensor_of_its_own_changes_no_bit_of_another() {
    let with = record(&everything(), 3.0, None);
    let mut bench = everything();
    for sensor in Sensor::ALL.into_iter().filter(|sensor| sensor.row().emulated.is_passenger) {
        bench.emulator.sensors.of_mut(sensor).rate_hz = 0.0;
    }
    let without = record(&bench, 3.0, None);
    for (with, without) in with.iter().zip(&without) {
        let mut seen = with.sensors;
        for channel in Channel::ALL.into_iter().filter(|it| it.sensor().row().emulated.is_passenger) {
            assert_eq!(*channel.of(&without.sensors), Sample::never(), "{channel}");
            *channel.of_mut(&mut seen) = Sample::never();
        }
        assert_eq!((seen, with.applied), (without.sensors, without.applied), "slot {}", with.slot);
    }
}

/// Towards an end above ambient that the load decides, the ESC faster than the motor, each rotor by itself.
#[test]
fn emulated_temperatures_rise_with_the_load() {
    let mut config = everything().emulator;
    let emulator = config.build().expect("valid");
    let mut state = emulator.start(1);
    let mut at = |seconds: u64| {
        while state.now_ns() < seconds * 1_000_000_000 {
            emulator.command(&mut state, [0.5, 0.0]);
            let next = state.now_ns() + 20_000_000;
            emulator.advance(&mut state, next);
        }
        (emulator.truth(&state), *state.sensors())
    };
    let (cold, _) = at(0);
    assert_eq!((cold.esc_temperature, cold.motor_temperature), ([293.15; 2], [293.15; 2]));
    let (early, _) = at(5);
    let (late, seen) = at(300);
    assert!(early.esc_temperature[0] > early.motor_temperature[0], "{early:?}");
    assert!(late.esc_temperature[0] < late.motor_temperature[0], "{late:?}");
    assert!((300.0..310.0).contains(&late.esc_temperature[0]), "{late:?}");
    assert!((308.0..320.0).contains(&late.motor_temperature[0]), "{late:?}");
    assert_eq!((late.esc_temperature[1], late.motor_temperature[1]), (293.15, 293.15), "rotor 2 stands");
    // Five times the noise, and half a step of the quantizer.
    assert!((seen.motor_temperature[0].value - late.motor_temperature[0]).abs() < 1.05, "{seen:?}");
    config.sensors.motor_temperature.rate_hz = -1.0;
    assert!(config.build().expect_err("no rate").to_string().contains("`motor_temperature`"));
}

/// Twelve channels were all that a recording had at first. Such a file gives the same log, and runs again bit for bit.
#[test]
fn a_recording_of_the_first_twelve_channels_is_read_and_replayed() {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/record/kept");
    let path = kept.join("twelve-channels.mcap");
    let log = tempfile::tempdir().expect("a folder");
    let log = log.path().join("log.csv");
    export::write_log(&path, &log).expect("readable");
    let expected = std::fs::read_to_string(kept.join("twelve-channels.csv")).expect("there");
    assert_eq!(std::fs::read_to_string(&log).expect("written"), expected);
    let recording = Recording::open(&path).expect("a recording");
    let bench = BenchConfig::parse(&recording.metadata().bench, &path).expect("its bench file");
    let source = controller_plant::command_source(&bench).expect("a controller");
    let guard = bench.guard.build(bench.period_s).expect("a guard");
    let mut replay = Replay::new(&source, &guard);
    replay.run(recording).expect("readable");
    assert!(replay.controller.is_equal() && replay.controller.equal == 20, "{:?}", replay.controller);
    assert!(replay.guard_result.is_equal() && replay.guard_result.equal == 20, "{:?}", replay.guard_result);
}
