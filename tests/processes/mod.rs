//! A bench of real processes: started, armed, hurt, and watched from outside.

pub mod reference;

use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use rotorbench::bench::BenchConfig;
use rotorbench::clock::{self, NANOSECONDS_PER_SECOND};
use rotorbench::guard::{Cause, OperatorAct, State};
use rotorbench::runtime::operator;
use rotorbench::shm::{
    APPLIED, BenchMember, BenchPlace, GUARD_EVENTS, ProcessRole, SharedMemoryConfig, Subscriber,
};
use rotorbench::signal::{Applied, GuardEvent};

static MADE: AtomicU32 = AtomicU32::new(0);

/// The bench of one test: its file, its processes; all gone at the end.
pub struct TestBench {
    pub config: BenchConfig,
    pub file: PathBuf,
    folder: tempfile::TempDir,
}

impl TestBench {
    /// The built-in bench with a name of its own, changed by `change`.
    pub fn new(test: &str, change: impl FnOnce(&mut BenchConfig)) -> Self {
        let number = MADE.fetch_add(1, Ordering::Relaxed);
        let mut config = BenchConfig {
            name: format!("t{}n{number}-{test}", std::process::id()),
            ..BenchConfig::default()
        };
        change(&mut config);
        let folder = tempfile::tempdir().expect("a folder for the test");
        let file = folder.path().join("bench.toml");
        std::fs::write(&file, toml::to_string(&config).expect("written")).expect("written");
        Self { config, file, folder }
    }

    /// Starts a process of the bench. What it says goes to a file, shown when the test fails.
    pub fn start(&self, command: &[&str]) -> Process {
        self.start_limited(libc::RLIM_INFINITY, command)
    }

    /// The same, in a process whose files cannot grow beyond `largest` bytes: a disk, or shared memory, that is full.
    pub fn start_limited(&self, largest: libc::rlim_t, command: &[&str]) -> Process {
        let log = self.folder.path().join(format!("{}.log", MADE.fetch_add(1, Ordering::Relaxed)));
        let output = |path: &PathBuf| std::fs::File::create(path).expect("created");
        let mut program = Command::new(env!("CARGO_BIN_EXE_rotorbench"));
        program.args(command);
        // Who names a protocol plays the bench that is built in for it.
        if !command.contains(&"--protocol") {
            program.arg("--config").arg(&self.file);
        }
        // Whoever runs the tests may ignore SIGHUP (`nohup` does), and the bench would rightly do so, too.
        // SAFETY: signal() is async-signal-safe, and SIG_DFL names no handler.
        // setrlimit() is async-signal-safe, too, and reads a value of the closure's own.
        unsafe {
            program.pre_exec(move || {
                libc::signal(libc::SIGHUP, libc::SIG_DFL);
                if largest != libc::RLIM_INFINITY {
                    libc::signal(libc::SIGXFSZ, libc::SIG_DFL);
                    let limit = libc::rlimit { rlim_cur: largest, rlim_max: largest };
                    libc::setrlimit(libc::RLIMIT_FSIZE, &raw const limit);
                }
                Ok(())
            });
        }
        let child = program
            .stdin(Stdio::null())
            .stdout(output(&log.with_extension("out")))
            .stderr(output(&log))
            .spawn()
            .expect("the program starts");
        Process { child, log, name: command.join(" ") }
    }

    /// Makes every file of the bench's shared memory that is mapped into processes shorter, as somebody of the bench's group
    /// could: to nothing. Whoever looks at it from then on gets a SIGBUS.
    pub fn truncate_memory(&self) {
        let place = BenchPlace::open(&self.config.name, &SharedMemoryConfig::default()).expect("a place");
        let mut count = 0;
        for entry in std::fs::read_dir("/dev/shm").expect("there").flatten() {
            if entry.file_name().to_string_lossy().starts_with(place.prefix()) {
                std::fs::OpenOptions::new().write(true).truncate(true).open(entry.path()).expect("ours");
                count += 1;
            }
        }
        assert!(count > 10, "only {count} segments");
    }

    /// Runs a command of the bench to its end.
    pub fn run(&self, command: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_rotorbench"))
            .args(command)
            .arg("--config")
            .arg(&self.file)
            .output()
            .expect("the program runs")
    }

    /// Listens.
    pub fn watch(&self) -> Watcher {
        let bench =
            BenchMember::join(&self.config.name, &SharedMemoryConfig::default(), ProcessRole::Monitor)
                .expect("joined");
        Watcher {
            applied: bench.subscribe(&APPLIED).expect("subscribed"),
            events: bench.subscribe(&GUARD_EVENTS).expect("subscribed"),
            newest: Applied::default(),
            said: Vec::new(),
            _bench: bench,
        }
    }

    /// Arms a running bench and waits until its rotors turn. Starting programs on one emulated processor may hold everything
    /// up for longer than the guard allows, so this is done without a program, and again if need be.
    pub fn arm_and_wait(&self, watcher: &mut Watcher) {
        let act = |act| operator::act(&self.config, act).expect("the bench runs");
        watcher.until("a guard", |it| it.sequence > 10);
        for _ in 0..6 {
            std::thread::sleep(Duration::from_millis(500));
            act(OperatorAct::Disarm);
            if act(OperatorAct::Arm).obeyed {
                let at_ns = clock::monotonic_ns();
                // Where commands are missed again and again, but never long enough to latch, the guard need not ever call
                // the run clean again before it ends (seen at 1 kHz, with 0.5 s to hold and as long to recover).
                let degraded_ns = at_ns + 2 * NANOSECONDS_PER_SECOND;
                let runs = |it: &Applied| is_running(it, it.stamp_ns > degraded_ns);
                let settled = watcher.until("armed or latched", |it| {
                    it.stamp_ns > at_ns && (runs(it) || it.state == State::FailsafeLatched as u32)
                });
                if runs(&settled) {
                    return;
                }
            }
        }
        late(format!("the rotors do not turn: {:?}", watcher.said));
    }

    pub fn period_ns(&self) -> u64 {
        clock::span_ns(self.config.period_s)
    }

    /// N, the periods that the guard holds a command.
    pub fn hold_periods(&self) -> f64 {
        let guard = self.config.guard.build(self.config.period_s).expect("valid");
        f64::from(guard.hold_periods())
    }

    /// Prints how many periods a reaction took, where the test runner does not swallow it, and holds it against the
    /// promise: hold limit + 2.
    pub fn judge(&self, fault: &str, since_ns: u64, until_ns: u64) {
        let periods = until_ns.saturating_sub(since_ns) as f64 / self.period_ns() as f64;
        let limit = self.hold_periods() + 2.0;
        say(&format!("{fault}: rotors commanded to zero after {periods:.1} periods (at most {limit:.0})"));
        if periods > limit {
            late(format!("{fault}: {periods:.1} periods, more than {limit}"));
        }
    }
}

impl Drop for TestBench {
    fn drop(&mut self) {
        if let Ok(place) = BenchPlace::open(&self.config.name, &SharedMemoryConfig::default()) {
            let _ = place.remove();
        }
    }
}

/// A time to wait in which a machine that stands still for a while uses up no more than one look's worth: this
/// kernel, emulated or not, may be stopped for seconds, and what is waited for was stopped with it.
pub struct Patience {
    left: Duration,
    looked: Instant,
}

impl Patience {
    const LOOK: Duration = Duration::from_millis(200);

    pub fn seconds(seconds: u64) -> Self {
        Self { left: Duration::from_secs(seconds), looked: Instant::now() }
    }

    /// Whether to look once more.
    pub fn lasts(&mut self) -> bool {
        self.left = self.left.saturating_sub(self.looked.elapsed().min(Self::LOOK));
        self.looked = Instant::now();
        !self.left.is_zero()
    }
}

/// A scenario in which something took too long.
struct Late(String);

/// Ends a scenario of [`up_to_six_times`] that a busy machine may have spoilt.
pub fn late(what: String) -> ! {
    say(&what);
    std::panic::resume_unwind(Box::new(Late(what)))
}

/// Runs a scenario up to six times, as far as only time was against it. These processes share the processors with the
/// rest of the test run (what priority they are granted counts among themselves only where the kernel is User-Mode
/// Linux) and have one emulated processor there: the machine may hold any of them up for longer than the guard allows,
/// and then the reaction is late, for another cause, or before there was a fault. On a machine that is short of
/// processor time that is every other attempt. A defect makes each of the six late. What is wrong at any speed, such as
/// a rotor that turns after the latch, fails at once.
pub fn up_to_six_times(scenario: impl Fn()) {
    let mut last = String::new();
    for attempt in 1..=6 {
        match std::panic::catch_unwind(std::panic::AssertUnwindSafe(&scenario)) {
            Ok(()) => return,
            Err(panic) => match panic.downcast::<Late>() {
                Ok(late) => {
                    say(&format!("attempt {attempt} of six was late"));
                    last = late.0;
                }
                Err(panic) => std::panic::resume_unwind(panic),
            },
        }
    }
    panic!("six times of six: {last}");
}

/// Says something that a passing test says, too.
pub fn say(line: &str) {
    use std::io::Write;
    writeln!(std::io::stderr(), "    {line}").expect("standard error can be written");
}

/// A process of a bench; killed at the end.
pub struct Process {
    child: Child,
    log: PathBuf,
    name: String,
}

impl Process {
    pub fn signal(&self, signal: i32) {
        // SAFETY: a child of this process that was not waited for: its number is its own.
        let code = unsafe { libc::kill(self.child.id() as libc::pid_t, signal) };
        assert_eq!(code, 0, "{} is there to be signalled:\n{}", self.name, self.log());
    }

    /// Waits for the end; the exit status.
    pub fn wait(&mut self) -> std::process::ExitStatus {
        let mut patience = Patience::seconds(60);
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                return status;
            }
            assert!(patience.lasts(), "{} does not end:\n{}", self.name, self.log());
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    pub fn is_running(&mut self) -> bool {
        self.child.try_wait().expect("a child").is_none()
    }

    /// What it has said on standard error.
    pub fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// What each of its threads waits for, as the kernel says.
    fn threads(&self) -> String {
        let tasks =
            std::fs::read_dir(format!("/proc/{}/task", self.child.id())).into_iter().flatten().flatten();
        let line = |task: std::fs::DirEntry| {
            let read = |name| std::fs::read_to_string(task.path().join(name)).unwrap_or_default();
            let [name, stat, place, call] = ["comm", "stat", "wchan", "syscall"].map(read);
            let state =
                stat.rsplit(')').next().and_then(|rest| rest.split_whitespace().next()).unwrap_or("?");
            format!("thread {}: {state}, in {place}, system call {call}\n", name.trim())
        };
        tasks.map(line).collect()
    }

    /// What it has said on standard output.
    pub fn output(&self) -> String {
        std::fs::read_to_string(self.log.with_extension("out")).unwrap_or_default()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("--- {}\n{}{}", self.name, self.log(), self.threads());
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn is_running(applied: &Applied, may_be_degraded: bool) -> bool {
    let is_degraded = applied.state == State::Degraded as u32;
    let is_active = applied.state == State::Armed as u32 || may_be_degraded && is_degraded;
    is_active && applied.rotor.iter().all(|command| *command > 0.3)
}

/// Sees what the guard lets through.
pub struct Watcher {
    applied: Subscriber<Applied>,
    events: Subscriber<GuardEvent>,
    pub newest: Applied,
    pub said: Vec<GuardEvent>,
    _bench: BenchMember,
}

impl Watcher {
    /// Everything the guard let through since the last call, each looked at.
    pub fn each(&mut self, mut look: impl FnMut(&Applied)) {
        while let Some(applied) = self.applied.next_in_order() {
            look(&applied);
            self.newest = applied;
        }
        while let Some(event) = self.events.next_in_order() {
            self.said.push(event);
        }
    }

    /// Waits until the guard lets through what `wanted` accepts. The limit only ends a test that hangs.
    pub fn until(&mut self, what: &str, wanted: impl Fn(&Applied) -> bool) -> Applied {
        let mut patience = Patience::seconds(30);
        loop {
            let mut found = None;
            self.each(|applied| found = found.or(wanted(applied).then_some(*applied)));
            if let Some(found) = found {
                return found;
            }
            let causes: Vec<String> = self.said.iter().map(rotorbench::report::guard::event).collect();
            assert!(patience.lasts(), "{what} never came; {:?}; {causes:#?}", self.newest);
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Waits for the safe command after `since_ns`: both rotors at zero.
    pub fn until_safe(&mut self, since_ns: u64) -> Applied {
        self.until("the safe command", |it| it.stamp_ns >= since_ns && it.rotor == [0.0, 0.0])
    }

    /// Asserts that the guard has latched, for `cause`, and stays so.
    pub fn assert_latched(&mut self, causes: &[Cause]) {
        // What was let through on the way here is not what is asked about.
        self.each(|_| {});
        std::thread::sleep(Duration::from_millis(200));
        let mut turned = false;
        self.each(|applied| turned |= applied.rotor != [0.0, 0.0]);
        assert!(!turned, "the rotors got a command after the latch");
        assert_eq!(self.newest.state, State::FailsafeLatched as u32, "{:?}", self.newest);
        let cause = Cause::from_code(self.newest.cause).unwrap_or_default();
        if !causes.contains(&cause) {
            late(format!("latched for another cause: {cause}"));
        }
    }
}
