//! The way between processes, and the way from frame to frame, each against a bare baseline of the same run.
//!
//! The second needs a bus: `cargo bench --config 'target."cfg(unix)".runner = ["tools/vcan"]' --bench cycle`.

use std::hint::black_box;
use std::os::fd::AsRawFd;
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use rotorbench::bench::{BenchConfig, StepTrigger};
use rotorbench::can::{Roles, kernel_has_can};
use rotorbench::clock;
use rotorbench::rt::{self, LogQueue, Shutdown};
use rotorbench::runtime::controller_plant;
use rotorbench::runtime::run::RunLoop;
use rotorbench::shm::{BenchMember, BenchPlace, ProcessRole, SENSORS, SharedMemoryConfig, Waiter};
use rotorbench::signal::{Sample, Sensors};
use socketcan::{CanSocket, Socket};

fn config(test: &str) -> BenchConfig {
    BenchConfig { name: format!("b{}-{test}", std::process::id()), ..BenchConfig::default() }
}

fn remove(config: &BenchConfig) {
    if let Ok(place) = BenchPlace::open(&config.name, &SharedMemoryConfig::default()) {
        let _ = place.remove();
    }
}

fn shared_memory(criterion: &mut Criterion) {
    let config = config("shm");
    let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Emulate).expect("joined");
    let mut publisher = bench.publish(&SENSORS).expect("the only publisher");
    let mut subscriber = bench.subscribe(&SENSORS).expect("subscribed");
    let sensors = Sensors { body_rate: Sample::good(0.1, 1, 1), ..Sensors::default() };
    let mut group = criterion.benchmark_group("shared-memory hop of Sensors");
    let mut copy = sensors;
    group.bench_function("baseline: memcpy", |bencher| {
        bencher.iter(|| copy = *black_box(&sensors));
    });
    group.bench_function("send and newest", |bencher| {
        bencher.iter(|| {
            publisher.send(black_box(&sensors));
            black_box(subscriber.newest())
        });
    });
    let (there, back) =
        (bench.bell(Waiter::Control).expect("bell"), bench.bell(Waiter::Guard).expect("bell"));
    let stop = Arc::new(AtomicBool::new(false));
    let echo = std::thread::spawn({
        let (stop, bell) = (Arc::clone(&stop), bench.bell(Waiter::Control).expect("bell"));
        let answer = bench.bell(Waiter::Guard).expect("bell");
        move || {
            while !stop.load(Ordering::Relaxed) {
                let _ = rt::wait([bell.descriptor()], clock::monotonic_ns() + 100_000_000);
                bell.quiet();
                answer.ring();
            }
        }
    });
    group.bench_function("send, wake another thread, be woken", |bencher| {
        bencher.iter(|| {
            publisher.send(black_box(&sensors));
            there.ring();
            let _ = rt::wait([back.descriptor()], clock::monotonic_ns() + 100_000_000);
            back.quiet();
            black_box(subscriber.newest())
        });
    });
    stop.store(true, Ordering::Relaxed);
    echo.join().expect("no panic");
    group.finish();
    drop((publisher, subscriber, there, back, bench));
    remove(&config);
}

/// A virtual bus that is there as long as the value.
struct OwnBus(String);

impl OwnBus {
    fn new(name: &str) -> Self {
        let bus = Self(format!("{name}{}", std::process::id()));
        bus.ip(&["link", "add", "dev", &bus.0, "type", "vcan"]);
        bus.ip(&["link", "set", &bus.0, "up"]);
        bus
    }

    fn ip(&self, words: &[&str]) {
        let done = Command::new("ip").args(words).status().expect("ip is there");
        assert!(done.success(), "{}: making a vcan needs root", self.0);
    }
}

impl Drop for OwnBus {
    fn drop(&mut self) {
        let _ = Command::new("ip").args(["link", "delete", &self.0]).status();
    }
}

/// The stopwatch, and the bare loop beside which it is read: a raw socket and nothing around it.
struct BusIo(CanSocket);

impl BusIo {
    fn open(bus: &OwnBus) -> Self {
        Self(CanSocket::open(&bus.0).expect("the bus is up"))
    }

    fn write(&self, frame: &libc::can_frame) {
        // SAFETY: the descriptor is open; the frame is as long as said. One that finds no room is not answered.
        unsafe { libc::write(self.0.as_raw_fd(), (&raw const *frame).cast(), size_of_val(frame)) };
    }

    /// The next frame; `None` when a non-blocking socket has none.
    fn read(&self) -> Option<libc::can_frame> {
        let mut frame = frame(0, &[]);
        // SAFETY: the descriptor is open; the frame is as long as said.
        let read =
            unsafe { libc::read(self.0.as_raw_fd(), (&raw mut frame).cast(), size_of::<libc::can_frame>()) };
        (read > 0).then_some(frame)
    }

    /// How long it takes [ns] until `frame` is answered, within a second: `write`, `poll`, `read`, two readings of the clock.
    fn turn_ns(&self, frame: &libc::can_frame) -> Option<f64> {
        while self.read().is_some() {}
        let start_ns = clock::monotonic_ns();
        self.write(frame);
        let mut wanted = libc::pollfd { fd: self.0.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        // SAFETY: one descriptor, as said.
        unsafe { libc::poll(&raw mut wanted, 1, 1_000) };
        let answer = self.read();
        let end_ns = clock::monotonic_ns();
        answer.map(|_| (end_ns - start_ns) as f64)
    }

    /// The bare loop: blocks in `read`, answers each frame with one of the same length; an empty one ends it.
    fn echo(&self) {
        let answer = frame(0x7FE, &[0; 8]);
        while self.read().is_some_and(|frame| frame.can_dlc > 0) {
            self.write(&answer);
        }
    }
}

fn frame(id: u32, data: &[u8]) -> libc::can_frame {
    // SAFETY: plain data for which zero is valid.
    let mut frame: libc::can_frame = unsafe { std::mem::zeroed() };
    (frame.can_id, frame.can_dlc) = (id, data.len() as u8);
    frame.data.iter_mut().zip(data).for_each(|(place, byte)| *place = *byte);
    frame
}

/// `run` as it is, until `stop`.
fn control_loop(config: &BenchConfig, stop: &AtomicBool) {
    let source = controller_plant::command_source(config).expect("the built-in bench");
    let mut run =
        RunLoop::open(config, source, LogQueue::new(16), &Shutdown::default()).expect("the only one");
    while !stop.load(Ordering::Relaxed) {
        run.turn();
    }
}

/// Frames of the gyro, each with the next counter and value.
fn gyro(config: &BenchConfig) -> impl FnMut() -> libc::can_frame {
    let roles = Roles::build(&config.bus, config.period_s).expect("the built-in bus");
    let index =
        roles.sensor_messages().iter().position(|message| message.name == "GYRO").expect("it has one");
    let mut sender = roles.sensor_sender();
    let mut sensors = Sensors::default();
    move || {
        sensors.body_rate = Sample::good(sensors.body_rate.value + 1e-6, 1, 1);
        let next = roles.encode_sensors(&mut sender, index, &sensors).expect("a frame");
        frame(next.id().number(), next.data())
    }
}

/// Turns of each loop, one of each in a control period.
const TURNS: usize = 400;

/// [ns] each turn of the bare loop and, half a period later, of `run`, each on a bus of its own: a machine that is busy with
/// other things is so for both. Ends where one is not answered.
fn turns(config: &BenchConfig, bare: &BusIo, ours: &BusIo) -> Vec<(f64, f64)> {
    let half_ns = clock::span_ns(config.period_s) / 2;
    let (ping, mut gyro) = (frame(0x7FF, &[0; 8]), gyro(config));
    let start_ns = clock::monotonic_ns() + half_ns;
    let turn = |turn| {
        let at_ns = start_ns + 2 * turn as u64 * half_ns;
        let _ = clock::sleep_until(at_ns);
        let bare_ns = bare.turn_ns(&ping)?;
        let next = gyro();
        let _ = clock::sleep_until(at_ns + half_ns);
        Some((bare_ns, ours.turn_ns(&next)?))
    };
    (0..TURNS).map_while(turn).collect()
}

/// Quartiles: a quarter, the half and three quarters of the values are below.
fn quartiles(values: impl Iterator<Item = f64>) -> [f64; 3] {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    [1, 2, 3].map(|quarter| values.get(values.len() * quarter / 4).copied().unwrap_or(f64::NAN))
}

fn frame_to_frame(_: &mut Criterion) {
    if !kernel_has_can() {
        eprintln!("frame to frame: NOT MEASURED, this kernel has no CAN (tools/vcan gives a bus)");
        return;
    }
    let (bare_bus, our_bus) = (OwnBus::new("bare"), OwnBus::new("ours"));
    let mut config = config("bus");
    config.trigger = StepTrigger::Imu;
    config.bus.interface.clone_from(&our_bus.0);
    let [bare, echo] = [&bare_bus; 2].map(BusIo::open);
    let ours = BusIo::open(&our_bus);
    for bus_io in [&bare, &ours] {
        bus_io.0.set_nonblocking(true).expect("set");
    }
    let stop = AtomicBool::new(false);
    let measured = std::thread::scope(|scope| {
        scope.spawn(|| echo.echo());
        scope.spawn(|| control_loop(&config, &stop));
        // Until `run` has opened the bench.
        std::thread::sleep(Duration::from_millis(500));
        let measured = turns(&config, &bare, &ours);
        bare.write(&frame(0x7FF, &[]));
        stop.store(true, Ordering::Relaxed);
        measured
    });
    let show = |[lower, median, upper]: [f64; 3]| format!("{median:.2} ({lower:.2} to {upper:.2})");
    println!(
        "frame to frame, {} turns, median and quartiles: bare read and write [µs] {}; gyro frame to command frame, whole turn of `run` [µs] {}; ratio of each pair {}",
        measured.len(),
        show(quartiles(measured.iter().map(|(bare, _)| bare * 1e-3))),
        show(quartiles(measured.iter().map(|(_, ours)| ours * 1e-3))),
        show(quartiles(measured.iter().map(|(bare, ours)| ours / bare))),
    );
    remove(&config);
}

criterion_group!(benches, shared_memory, frame_to_frame);
criterion_main!(benches);
