//! Real-time set-up of a process that may lock only so much memory.

use std::process::Command;

use rotorbench::rt::RealTimeConfig;

const NAME: &str = "real_time::later_allocations_do_not_fail_at_the_limit_of_locked_memory";
/// [byte] more than a process needs at its start.
const LIMIT: u64 = 256 << 20;

/// The test runs itself again, as a process with a limit and without the right to pass it. Were what is allocated later
/// locked, too, the allocation beyond the limit would end that process.
#[test]
fn later_allocations_do_not_fail_at_the_limit_of_locked_memory() {
    if std::env::var_os("ROTORBENCH_TEST_CHILD").is_some() {
        let granted =
            RealTimeConfig { priority: 0, ..RealTimeConfig::default() }.apply().expect("not required");
        let big = vec![1_u8; (LIMIT + (64 << 20)) as usize];
        println!("child: {granted}; {} bytes", std::hint::black_box(&big).len());
        return;
    }
    // SAFETY: geteuid has no arguments and cannot fail.
    let is_root = unsafe { libc::geteuid() } == 0;
    let mut found = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: `found` is valid and writable for the call.
    assert_eq!(unsafe { libc::getrlimit(libc::RLIMIT_MEMLOCK, &raw mut found) }, 0);
    // A limit can be lowered by anybody, and raised only with a right that root may lack in a container. Below what a
    // process needs at its start nothing is locked at all.
    let bytes = LIMIT.min(found.rlim_max);
    let limit = format!("--memlock={bytes}");
    let mut arguments = vec!["prlimit", &limit];
    if is_root {
        // Root may lock as much as it likes: the right is given up for the child.
        let give_up = ["setpriv", "--bounding-set=-ipc_lock", "--inh-caps=-ipc_lock"];
        arguments.splice(0..0, give_up);
    }
    let child = Command::new(arguments[0])
        .args(&arguments[1..])
        .arg(std::env::current_exe().expect("there"))
        .args(["--exact", NAME, "--nocapture"])
        .env("ROTORBENCH_TEST_CHILD", "1")
        .output()
        .expect("util-linux is everywhere");
    let said = String::from_utf8_lossy(&child.stdout).into_owned();
    assert!(child.status.success(), "{said}{}", String::from_utf8_lossy(&child.stderr));
    assert!(
        said.contains(&format!("locked memory of later allocations (the limit is {} kB", bytes / 1024)),
        "{said}"
    );
    assert!(bytes < LIMIT || !said.contains(" 0 kB locked"), "what is there at the start is locked: {said}");
}
