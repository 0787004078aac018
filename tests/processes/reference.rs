//! DroneCAN's reference implementation in Python, a node of its own beside a bench.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Output, Stdio};

use super::{Patience, TestBench};

/// A Python program on the bus that says a line now and then.
pub struct Reference {
    pub child: Child,
    said: BufReader<ChildStdout>,
}

impl Reference {
    /// Starts it and waits until it has said that it is there.
    pub fn start(program: &str, arguments: &[&str]) -> Self {
        let mut child = Command::new(python())
            .args(["-c", program])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("Python runs");
        let said = BufReader::new(child.stdout.take().expect("piped"));
        let mut reference = Self { child, said };
        assert_eq!(reference.line(), "there", "the reference is on the bus");
        reference
    }

    /// The next line that it says.
    pub fn line(&mut self) -> String {
        let mut line = String::new();
        self.said.read_line(&mut line).expect("text");
        line.trim().to_owned()
    }
}

impl Drop for Reference {
    fn drop(&mut self) {
        // On multicast its driver is a process of its own, which ends when it is asked to, and not when its parent is killed.
        // SAFETY: a child of this process that was not waited for.
        unsafe { libc::kill(self.child.id() as libc::pid_t, libc::SIGTERM) };
        let _ = self.child.wait();
    }
}

/// Python with the reference implementation; `tools/witnesses` installs it.
pub fn python() -> PathBuf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/dronecan-venv/bin/python");
    assert!(path.exists(), "{} is there after tools/witnesses", path.display());
    path
}

/// All that a program said.
pub fn text(output: &Output) -> String {
    let [out, error] = [&output.stdout, &output.stderr].map(|it| String::from_utf8_lossy(it).into_owned());
    out + &error
}

/// `rotorbench dronecan ...`, again until somebody answers: an emulator may not be there yet.
pub fn asked(bench: &TestBench, arguments: &[&str]) -> Output {
    let command: Vec<&str> = ["dronecan"].iter().chain(arguments).copied().collect();
    let mut patience = Patience::seconds(30);
    loop {
        let output = bench.run(&command);
        if output.status.code() != Some(1) || !patience.lasts() {
            return output;
        }
    }
}
