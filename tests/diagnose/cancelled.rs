//! Ctrl-C while a command works on a long log: it ends soon, and leaves nothing behind.

use std::ffi::CString;
use std::fmt::Write as _;
use std::fs;
use std::io::Read as _;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// How long a machine that has other things to do may take for anything here: all of it takes a second on a free one.
const PATIENCE: Duration = Duration::from_secs(60);
/// Rows of a log that no search is done with before it is cancelled.
const ROWS: u32 = 150_000;

/// A rotor behind two lags, of which the paper's model knows one.
fn long_log() -> String {
    let mut text = "time_s,command_1,propeller_rate_1_rad_s\n".to_owned();
    let (mut behind, mut rate) = (600.0, 600.0);
    for row in 0..ROWS {
        // A new level every third of a second, from a multiplicative hash.
        let level = f64::from((row / 32).wrapping_mul(2_654_435_761) >> 20) / 4096.0;
        let noise = f64::from(row.wrapping_mul(2_246_822_519) >> 20) / 4096.0 - 0.5;
        let command = 0.3 + 0.3 * level;
        behind += 0.3 * (1124.5 * command + 447.1 * command * command - behind);
        rate += 0.15 * (behind - rate);
        writeln!(text, "{:.2},{command},{}", 0.01 * f64::from(row), rate + noise).expect("a string");
    }
    text
}

/// Waits until `is_so`, as long as the child runs.
fn wait_for(child: &mut Child, is_so: impl Fn(u32) -> bool) {
    let begun = Instant::now();
    while !is_so(child.id()) {
        assert_eq!(child.try_wait().expect("it can be asked"), None, "it ended by itself");
        assert!(begun.elapsed() < PATIENCE, "never");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Whether a process has a handler of its own for SIGINT.
fn hears_ctrl_c(process: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & 1 << (libc::SIGINT - 1) != 0
}

/// Cancels a command by a signal some time after it listens: how it ended, and what it said.
fn cancelled(folder: &Path, arguments: &[&str], after: Duration, signal: i32) -> (ExitStatus, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rotorbench"));
    command.args(arguments).current_dir(folder).stdout(Stdio::null()).stderr(Stdio::piped());
    // Whoever runs the tests may ignore SIGHUP (`nohup` does), and the command would rightly do so, too.
    // SAFETY: signal() is async-signal-safe, and SIG_DFL names no handler.
    unsafe {
        command.pre_exec(|| {
            libc::signal(libc::SIGHUP, libc::SIG_DFL);
            Ok(())
        });
    }
    let mut child = command.spawn().expect("the program starts");
    wait_for(&mut child, hears_ctrl_c);
    std::thread::sleep(after);
    assert_eq!(child.try_wait().expect("it can be asked"), None, "{arguments:?} ended by itself");
    // SAFETY: a signal to a child that was not waited for yet.
    assert_eq!(unsafe { libc::kill(child.id() as libc::pid_t, signal) }, 0);
    let begun = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("it can be asked") {
            break status;
        }
        if begun.elapsed() > PATIENCE {
            child.kill().expect("it can be killed");
            panic!("{arguments:?} did not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let mut said = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
    (status, said)
}

#[test]
fn ctrl_c_ends_a_command_and_leaves_nothing_behind() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("long.csv"), long_log()).expect("written");
    // A pipe that nobody writes to.
    let pipe = CString::new(folder.path().join("pipe.csv").as_os_str().as_bytes()).expect("no zero byte");
    // SAFETY: the name ends with a zero byte.
    assert_eq!(unsafe { libc::mkfifo(pipe.as_ptr(), 0o600) }, 0);
    // The first two in the midst of a search, the others wherever they are.
    let search = Duration::from_secs(1);
    let ctrl_c = libc::SIGINT;
    for (arguments, after, signal) in [
        (&["diagnose", "--log", "long.csv", "--report", "out.html"][..], search, ctrl_c),
        (&["extend", "--effect", "second_order_lag", "--log", "long.csv", "-o", "out.toml"], search, ctrl_c),
        (&["identify", "--log", "long.csv", "-o", "out.toml"], Duration::ZERO, libc::SIGTERM),
        (&["compare", "--log", "long.csv", "--report", "out.html"], Duration::ZERO, libc::SIGHUP),
        (&["compare", "--log", "pipe.csv", "--report", "out.html"], Duration::ZERO, ctrl_c),
    ] {
        let (status, said) = cancelled(folder.path(), arguments, after, signal);
        assert_eq!(status.code(), Some(1), "{arguments:?}: {status}, {said}");
        assert_eq!(said.trim_end(), "cancelled; nothing was written", "{arguments:?}");
        let left = fs::read_dir(folder.path()).expect("a folder").flatten().map(|entry| entry.file_name());
        let mut left: Vec<_> = left.collect();
        left.sort();
        assert_eq!(left, ["long.csv", "pipe.csv"], "{arguments:?}");
    }
}
