//! `unsafe` stands in few files, each for a need of its own.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::imports::read_sources;

/// The files that may hold it, and what for. Each function there says why with `#[allow(unsafe_code, reason = ...)]`.
const FILES: &[(&str, &str)] = &[
    ("can/multicast/socket.rs", "recvmmsg of datagrams, options of sockets, what a device is"),
    ("can/socket.rs", "recvmmsg, a send that never waits, a second bind"),
    ("can/timestamps.rs", "what an interface stamps"),
    ("cli/pipe.rs", "to end with the reader"),
    ("clock.rs", "the monotonic clock, to sleep until"),
    ("memory.rs", "an allocator, pages"),
    ("recording/writer.rs", "to leave the real-time scheduler"),
    ("rt/fault.rs", "to survive memory that is gone"),
    ("rt/rights.rs", "limits"),
    ("rt/shutdown.rs", "signals"),
    ("rt/thread.rs", "scheduler, locked memory, processors"),
    ("rt/usage.rs", "page faults and context switches"),
    ("rt/wait.rs", "ppoll"),
    ("session/machine/host.rs", "free bytes of /dev/shm"),
    ("shm/bell.rs", "FIFOs"),
    ("shm/ring.rs", "a type in shared memory"),
    ("shm/kept.rs", "what outlives its owner"),
    ("shm/place.rs", "users and groups"),
    ("shm/watch_thread.rs", "inotify, eventfd"),
];

/// Whether a line sets what becomes of it.
fn allows(line: &str) -> bool {
    line.trim_start().starts_with("#") && line.contains("(unsafe_code")
}

/// The compiler refuses it wherever no allow stands.
#[test]
fn unsafe_code_is_denied_at_the_root() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for (file, line) in [("lib.rs", "#![deny(unsafe_code)]"), ("main.rs", "#![forbid(unsafe_code)]")] {
        let text = fs::read_to_string(root.join(file)).expect("source is UTF-8");
        assert_eq!(text.lines().filter(|line| allows(line)).collect::<Vec<_>>(), [line], "{file}");
    }
}

#[test]
fn unsafe_code_stands_in_the_files_of_the_list() {
    let mut found = BTreeSet::new();
    for source in read_sources() {
        let mut allowed = source.text.lines().filter(|line| allows(line)).peekable();
        if allowed.peek().is_some() {
            found.insert(source.name.clone());
        }
        for line in allowed {
            let says_why = line.trim_start().starts_with("#[allow(unsafe_code, reason = \"");
            assert!(says_why, "{}: an allow for one item, with its reason: {line}", source.name);
        }
    }
    let listed: BTreeSet<String> = FILES.iter().map(|(file, _)| (*file).to_owned()).collect();
    assert_eq!(found, listed, "files that allow unsafe code (left), and those of this test (right)");
}
