//! The way between processes, and the way from frame to frame, each against a bare baseline of the same run.
//!
//! The second needs a bus: `cargo bench --config 'target."cfg(unix)".runner = ["tools/vcan"]' --bench cycle`.

use std::hint::black_box;
use std::os::fd::AsRawFd;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use rotorbench::bench::{BenchConfig, Trigger};
use rotorbench::can::{Arrival, Frame, Id, Port, Roles, kernel_has_can};
use rotorbench::clock;
use rotorbench::process::plant;
use rotorbench::process::run::RunLoop;
use rotorbench::rt::{self, LogQueue};
use rotorbench::shm::{Bench, Place, Role, SENSORS, SharedMemoryConfig, Waiter};
use rotorbench::signal::{Sample, Sensors};

fn config(test: &str) -> BenchConfig {
    BenchConfig { name: format!("b{}-{test}", std::process::id()), ..BenchConfig::default() }
}

fn remove(config: &BenchConfig) {
    if let Ok(place) = Place::open(&config.name, &SharedMemoryConfig::default()) {
        let _ = place.remove();
    }
}

fn shared_memory(criterion: &mut Criterion) {
    let config = config("shm");
    let bench = Bench::join(&config.name, &config.shared_memory, Role::Emulate).expect("joined");
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
    let (there, back) = (bench.bell(Waiter::Control).expect("bell"), bench.bell(Waiter::Gate).expect("bell"));
    let stop = Arc::new(AtomicBool::new(false));
    let echo = std::thread::spawn({
        let (stop, bell) = (Arc::clone(&stop), bench.bell(Waiter::Control).expect("bell"));
        let answer = bench.bell(Waiter::Gate).expect("bell");
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

/// Sends a frame and waits for the next one of another sender.
fn round_trip(port: &mut Port, frame: &Frame) {
    port.send(frame).expect("sent");
    let mut answered = false;
    while !answered {
        let _ = rt::wait([port.as_raw_fd()], clock::monotonic_ns() + 100_000_000);
        let _ = port.receive(|arrival| answered |= matches!(arrival, Arrival::Frame { .. }));
    }
}

/// How long `count` round trips take [ns]. Each begins a control period after the one before, because the controller
/// steps no faster however fast the gyro is; the time between is not counted, for neither loop.
fn paced(count: usize, port: &mut Port, period_ns: u64, mut next: impl FnMut() -> Frame) -> Vec<u64> {
    let trip = |_| {
        let _ = clock::sleep_until(clock::monotonic_ns() + period_ns);
        while port.receive(|_| {}) != Ok(0) {}
        let frame = next();
        let start = Instant::now();
        round_trip(port, &frame);
        start.elapsed().as_nanos() as u64
    };
    (0..count).map(trip).collect()
}

/// The bare `read`/`write` loop: blocks in `read`, answers each frame with one of the same length.
fn bare_echo(interface: &str, stop: Arc<AtomicBool>) {
    use socketcan::{CanSocket, Socket};
    let socket = CanSocket::open(interface).expect("the bus is up");
    socket.set_read_timeout(Duration::from_millis(100)).expect("set");
    let mut frame = empty_frame();
    frame.can_id = 0x7FE;
    frame.can_dlc = 8;
    let mut received = [0_u8; size_of::<libc::can_frame>()];
    while !stop.load(Ordering::Relaxed) {
        // SAFETY: the descriptor is open; the buffers are as long as said.
        unsafe {
            let descriptor = socket.as_raw_fd();
            if libc::read(descriptor, received.as_mut_ptr().cast(), received.len()) > 0 {
                libc::write(descriptor, (&raw const frame).cast(), size_of::<libc::can_frame>());
            }
        }
    }
}

fn empty_frame() -> libc::can_frame {
    // SAFETY: plain data for which zero is valid.
    unsafe { std::mem::zeroed() }
}

/// Rounds in which the two loops take turns, and round trips of each in one.
const ROUNDS: usize = 9;
const TRIPS: usize = 50;

/// Runs `work` on a thread of its own while `measure` measures.
fn beside<T>(work: impl FnOnce(Arc<AtomicBool>) + Send + 'static, measure: impl FnOnce() -> T) -> T {
    let stop = Arc::new(AtomicBool::new(false));
    let thread = std::thread::spawn({
        let stop = Arc::clone(&stop);
        move || work(stop)
    });
    std::thread::sleep(Duration::from_millis(500));
    let measured = measure();
    stop.store(true, Ordering::Relaxed);
    thread.join().expect("no panic");
    measured
}

fn run_loop(config: &BenchConfig, stop: &AtomicBool) {
    let pilot = plant::pilot(config).expect("the built-in bench");
    let mut run = RunLoop::open(config, pilot, LogQueue::new(16)).expect("the only one");
    while !stop.load(Ordering::Relaxed) {
        run.turn();
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The bare loop and `run`, taking turns: a machine that is busy with other things is so for both. Medians, and the median
/// of the rounds' ratios.
fn frame_to_frame(_: &mut Criterion) {
    let mut config = config("bus");
    config.trigger = Trigger::Imu;
    if !kernel_has_can() {
        eprintln!("frame to frame: NOT MEASURED, this kernel has no CAN (tools/vcan gives a bus)");
        return;
    }
    let period_ns = clock::span_ns(config.period_s);
    let interface = config.bus.interface.clone();
    let mut port = Port::open(&interface, false).expect("the bus is up");
    let frame = Frame::classic(Id::new(0x7FF, false).expect("an id"), &[0; 8]).expect("a frame");
    let roles = Roles::build(&config.bus, config.period_s).expect("the built-in bus");
    let mut sender = roles.sensor_sender();
    let gyro = roles.sensor_messages().iter().position(|message| message.name == "GYRO").expect("it has one");
    let mut sensors = Sensors::default();
    let mut rounds = Vec::new();
    for _ in 0..ROUNDS {
        let name = interface.clone();
        let bare =
            beside(move |stop| bare_echo(&name, stop), || paced(TRIPS, &mut port, period_ns, || frame));
        let theirs = config.clone();
        let ours = beside(
            move |stop| run_loop(&theirs, &stop),
            || {
                paced(TRIPS, &mut port, period_ns, || {
                    sensors.body_rate = Sample::good(sensors.body_rate.value + 1e-6, 1, 1);
                    roles.encode_sensors(&mut sender, gyro, &sensors).expect("a frame")
                })
            },
        );
        let [bare, ours] =
            [bare, ours].map(|times| median(times.iter().map(|time| *time as f64 * 1e-3).collect()));
        rounds.push((bare, ours, ours / bare));
    }
    let ratios: Vec<String> = rounds.iter().map(|(_, _, ratio)| format!("{ratio:.2}")).collect();
    println!(
        "frame to frame, p50: bare read and write {:.1} µs; gyro frame to command frame, whole turn of `run`, {:.1} µs; ratio {:.2} (rounds: {})",
        median(rounds.iter().map(|round| round.0).collect()),
        median(rounds.iter().map(|round| round.1).collect()),
        median(rounds.iter().map(|round| round.2).collect()),
        ratios.join(" ")
    );
    remove(&config);
}

criterion_group!(benches, shared_memory, frame_to_frame);
criterion_main!(benches);
