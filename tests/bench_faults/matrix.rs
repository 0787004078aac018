//! A part of the fault matrix in real time: real processes over shared memory, hurt at random moments drawn from a seed.
//! In lockstep, with every row: tests/faults/.
//!
//! `ROTORBENCH_FAULTS_OUT` names a file that gets the rows as Markdown, `ROTORBENCH_FAULTS_DRAWS` says how many draws each
//! has; `tools/faults real-time` uses both.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rotorbench::clock;
use rotorbench::guard::{Cause, State};
use rotorbench::signal::{AppliedFlags, GuardEvent};

use crate::processes::{Process, TestBench, Watcher, late, say, up_to_six_times};

/// [s] that a run is looked at after the fault.
const AFTERWARDS: Duration = Duration::from_millis(1_500);

/// The bench of one draw.
struct Running {
    bench: TestBench,
    emulator: Process,
    control: Process,
    watcher: Watcher,
    dice: ChaCha8Rng,
}

impl Running {
    fn new(row: &str, draw: u64) -> Self {
        let bench = TestBench::new("matrix", |config| {
            // The hog and the loop share one processor.
            config.real_time.processor = (row == HOG).then_some(0);
        });
        let emulator = bench.start(&["emulate", "--shm"]);
        let control = bench.start(&["control"]);
        let mut watcher = bench.watch();
        bench.arm_and_wait(&mut watcher);
        watcher.said.clear();
        let mut dice = ChaCha8Rng::seed_from_u64(draw);
        std::thread::sleep(Duration::from_millis(dice.random_range(0..300)));
        Self { bench, emulator, control, watcher, dice }
    }

    /// Up to 0.6 s, as often short as long.
    fn span(&mut self) -> Duration {
        Duration::from_secs_f64(0.02 * f64::powf(30.0, self.dice.random::<f64>()))
    }
}

/// What one draw came to.
#[derive(Debug)]
struct Seen {
    first: Option<(f64, Cause)>,
    state: State,
    cause: Cause,
    highest: f64,
    /// Periods until both rotors were commanded to zero for good; `None` = they run on.
    turning: Option<f64>,
}

/// Looks on after a fault at `at_ns`, and holds what must hold in every row.
fn look(running: &mut Running, at_ns: u64) -> Seen {
    let period_ns = running.bench.period_ns() as f64;
    let periods = |stamp_ns: u64| stamp_ns.saturating_sub(at_ns) as f64 / period_ns;
    let maximum = running.bench.config.guard.rotor_maximum;
    let (mut highest, mut turning_ns, mut beyond, mut revived) = (0.0_f64, 0, None, None);
    let mut latched = false;
    let end = Instant::now() + AFTERWARDS;
    while Instant::now() < end {
        running.watcher.each(|applied| {
            let most = applied.rotor.into_iter().fold(0.0, f64::max);
            let is_ramp = applied.flags & AppliedFlags::RAMPING != 0;
            if applied.rotor.iter().any(|u| !(0.0..=maximum).contains(u)) {
                beyond = Some(*applied);
            }
            if latched && most > 0.0 && !is_ramp {
                revived = Some(*applied);
            }
            latched |= applied.state == State::FailsafeLatched as u32 && most == 0.0;
            if applied.stamp_ns >= at_ns {
                highest = highest.max(most);
                turning_ns = if most > 0.0 { applied.stamp_ns } else { turning_ns };
            }
        });
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(beyond.is_none(), "a command beyond the limits left: {beyond:?}");
    assert!(revived.is_none(), "a rotor got a command after the latch: {revived:?}");
    let newest = running.watcher.newest;
    let is_fault = |event: &&GuardEvent| event.stamp_ns >= at_ns && event.from != event.to;
    let first = running.watcher.said.iter().find(is_fault);
    let cause = |code| Cause::from_code(code).unwrap_or_default();
    let runs = newest.rotor.iter().any(|u| *u > 0.0);
    Seen {
        first: first.map(|event| (periods(event.stamp_ns), cause(event.cause))),
        state: State::from_code(newest.state).unwrap_or_default(),
        cause: cause(newest.cause),
        highest,
        turning: (!runs).then(|| periods(turning_ns) + 1.0),
    }
}

/// A row: what is done, and after how many periods beyond the hold the rotors must be at rest; `None` = it depends.
struct Row {
    name: &'static str,
    hurt: fn(&mut Running) -> u64,
    limit: Option<f64>,
}

const HOG: &str = "three threads that spin on the loop's processor";

const ROWS: [Row; 6] = [
    Row {
        name: "SIGKILL of control",
        hurt: |running| {
            running.control.signal(libc::SIGKILL);
            clock::monotonic_ns()
        },
        limit: Some(2.0),
    },
    Row {
        name: "SIGSTOP of control, SIGCONT within 0.6 s",
        hurt: |running| pause(running, true),
        limit: None,
    },
    Row {
        name: "SIGSTOP of the guard's process, SIGCONT within 0.6 s",
        hurt: |running| pause(running, false),
        limit: None,
    },
    Row { name: HOG, hurt: hog, limit: None },
    Row {
        name: "SIGKILL of the recorder",
        hurt: |running| hurt_recorder(running, libc::SIGKILL),
        limit: None,
    },
    Row {
        name: "SIGSTOP of the recorder",
        hurt: |running| hurt_recorder(running, libc::SIGSTOP),
        limit: None,
    },
];

fn pause(running: &mut Running, control: bool) -> u64 {
    let span = running.span();
    let victim = if control { &running.control } else { &running.emulator };
    let at_ns = clock::monotonic_ns();
    victim.signal(libc::SIGSTOP);
    std::thread::sleep(span);
    victim.signal(libc::SIGCONT);
    at_ns
}

/// Three threads that do nothing as hard as they can, on the processor to which the loop is bound.
fn hog(_: &mut Running) -> u64 {
    let at_ns = clock::monotonic_ns();
    let end = Instant::now() + Duration::from_millis(800);
    let spin = move || {
        // SAFETY: a cpu_set_t is plain data for which zero is valid; the calls only read and write it. 0 names this thread.
        unsafe {
            let mut set: libc::cpu_set_t = std::mem::zeroed();
            libc::CPU_SET(0, &mut set);
            libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set);
        }
        while Instant::now() < end {
            std::hint::spin_loop();
        }
    };
    let hogs: Vec<_> = (0..3).map(|_| std::thread::spawn(spin)).collect();
    hogs.into_iter().for_each(|hog| hog.join().expect("it only spins"));
    at_ns
}

fn hurt_recorder(running: &mut Running, signal: i32) -> u64 {
    let path = running.bench.file.with_file_name("matrix.mcap");
    let recorder = running.bench.start(&["record", "-o", &path.display().to_string()]);
    std::thread::sleep(Duration::from_millis(300) + running.span());
    recorder.signal(signal);
    let at_ns = clock::monotonic_ns();
    // It stays as it is while the loop is looked at.
    std::thread::sleep(Duration::from_millis(300));
    at_ns
}

fn run_row(row: &Row, draw: u64) -> Seen {
    let mut running = Running::new(row.name, draw);
    let at_ns = (row.hurt)(&mut running);
    let seen = look(&mut running, at_ns);
    if let Some(more) = row.limit {
        let limit = running.bench.hold_periods() + more;
        if seen.turning.is_none_or(|periods| periods > limit) {
            late(format!("{}: {seen:?}, at most {limit} periods", row.name));
        }
    }
    if row.name.contains("recorder") && !seen.state.is_active() {
        late(format!("{}: the loop noticed: {seen:?}", row.name));
    }
    seen
}

fn line(row: &Row, seen: &[Seen]) -> String {
    let most = |of: &dyn Fn(&Seen) -> Option<f64>| {
        let most = seen.iter().filter_map(of).reduce(f64::max);
        most.map_or_else(|| "-".to_owned(), |periods| format!("{periods:.1}"))
    };
    let mut found: Vec<String> = seen
        .iter()
        .map(|it| match (it.state.is_active(), it.first) {
            (false, _) => it.cause.to_string(),
            (true, Some((_, cause))) => cause.to_string(),
            (true, None) => "-".to_owned(),
        })
        .collect();
    let mut ends: Vec<String> = seen
        .iter()
        .map(|it| if it.turning.is_none() { "runs on".to_owned() } else { it.state.to_string() })
        .collect();
    for words in [&mut found, &mut ends] {
        words.sort();
        words.dedup();
    }
    let running = seen.iter().filter(|it| it.turning.is_none()).count();
    let turning = match (most(&|it| it.turning), running) {
        (_, running) if running == seen.len() => "runs on".to_owned(),
        (periods, 0) => periods,
        (periods, running) => format!("{periods}, or runs on ({running} of {})", seen.len()),
    };
    format!(
        "| {} | {} | {} | {} | {:.3} | {turning} |",
        row.name,
        found.join(", "),
        most(&|it| it.first.map(|(periods, _)| periods)),
        ends.join(", "),
        seen.iter().fold(0.0, |most: f64, it| most.max(it.highest)),
    )
}

#[test]
fn no_fault_of_a_process_at_any_moment_breaks_a_promise() {
    let draws = std::env::var("ROTORBENCH_FAULTS_DRAWS").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let mut table = String::new();
    for row in &ROWS {
        let mut seen = Vec::new();
        for draw in 1..=draws {
            up_to_six_times_with(|| run_row(row, draw), &mut seen);
        }
        let line = line(row, &seen);
        say(&line);
        let _ = writeln!(table, "{line}");
    }
    if let Some(path) = std::env::var_os("ROTORBENCH_FAULTS_OUT") {
        std::fs::write(path, table).expect("the table can be written");
    }
}

/// Keeps what the scenario that held came to.
fn up_to_six_times_with(scenario: impl Fn() -> Seen, into: &mut Vec<Seen>) {
    let kept = std::sync::Mutex::new(None);
    up_to_six_times(|| {
        let seen = scenario();
        *kept.lock().expect("nobody panics with it") = Some(seen);
    });
    into.extend(kept.into_inner().expect("nobody panics with it"));
}

/// Where shared memory has no room (here: for files of this size), a process says so in one sentence and ends.
#[test]
fn no_room_in_shared_memory_is_one_sentence_and_no_hang() {
    for command in [["emulate", "--shm"].as_slice(), &["control"]] {
        for room in [4_096, 300_000] {
            let bench = TestBench::new("room", |_| {});
            let mut process = bench.start_limited(room, command);
            assert_eq!(process.wait().code(), Some(2), "{command:?} with {room} bytes: {}", process.log());
            let log = process.log();
            let errors: Vec<&str> = log.lines().filter(|line| line.starts_with("error: ")).collect();
            assert_eq!(errors.len(), 1, "{command:?} with {room} bytes: {log}");
            assert!(!log.contains("panicked"), "{log}");
        }
        // Not even for the sentence: the exit code says it.
        let bench = TestBench::new("none", |_| {});
        assert_eq!(bench.start_limited(0, command).wait().code(), Some(2), "{command:?}");
    }
}
