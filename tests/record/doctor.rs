//! The doctor says true things of this machine, and mends what a killed bench left.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::{json_schema, rotorbench};

fn findings(arguments: &[&str]) -> (Option<i32>, Vec<serde_json::Value>) {
    let done = rotorbench(&[&["doctor", "--json"], arguments].concat());
    let findings = json_schema::answer("doctor", &done.stdout);
    (done.status.code(), findings.as_array().cloned().expect("a list"))
}

fn of<'a>(findings: &'a [serde_json::Value], check: &str) -> &'a serde_json::Value {
    findings.iter().find(|it| it["check"] == check).unwrap_or_else(|| panic!("no finding of {check}"))
}

fn waits(mut is_so: impl FnMut() -> bool) -> bool {
    // Generous: the machine may be busy; the loop ends as soon as it is so.
    let patience = Instant::now() + Duration::from_secs(60);
    while !is_so() {
        if Instant::now() > patience {
            return false;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    true
}

#[test]
fn says_true_things_of_this_machine() {
    let (code, findings) = findings(&[]);
    let wanting = findings.iter().any(|it| it["grade"] == "warning" || it["grade"] == "bad");
    assert_eq!(code, Some(i32::from(wanting)), "found wanting is exit 1");
    let has_can = rotorbench::can::kernel_has_can();
    assert_eq!(of(&findings, "CAN in the kernel")["grade"] == "good", has_can);
    let version = std::fs::read_to_string("/proc/sys/kernel/osrelease").expect("Linux");
    assert!(of(&findings, "versions")["found"].as_str().expect("text").contains(version.trim()));
    for check in
        ["real-time permission", "memory lock limit", "frequency governor", "/dev/shm", "clock source"]
    {
        of(&findings, check);
    }
    for finding in &findings {
        let is_good = finding["grade"] == "good" || finding["grade"] == "mended";
        assert_eq!(
            finding["mend"].is_null(),
            is_good,
            "each trouble comes with the command that mends it: {finding}"
        );
    }
}

#[test]
fn without_privileges_it_asks_for_them() {
    // As root in a test: give the rights up for the child only.
    // SAFETY: geteuid has no arguments and cannot fail.
    let is_root = unsafe { libc::geteuid() } == 0;
    let program = env!("CARGO_BIN_EXE_rotorbench");
    let mut command = if is_root {
        let mut command = Command::new("setpriv");
        command.args(["--bounding-set=-sys_nice,-ipc_lock", "--inh-caps=-sys_nice,-ipc_lock"]);
        command.args(["prlimit", "--rtprio=0", "--memlock=65536", program]);
        command
    } else {
        let mut command = Command::new("prlimit");
        command.args(["--rtprio=0", "--memlock=65536", program]);
        command
    };
    let done = command.args(["doctor", "--json"]).output().expect("util-linux is everywhere");
    let findings: Vec<serde_json::Value> =
        serde_json::from_slice(&done.stdout).expect("JSON and nothing else");
    for check in ["real-time permission", "memory lock limit"] {
        let finding = of(&findings, check);
        assert_eq!(finding["grade"], "warning", "{finding}");
        assert!(finding["mend"].as_str().expect("a command").contains("setcap"), "{finding}");
    }
}

#[test]
fn a_killed_bench_is_found_and_mended() {
    let bench = format!("doctor{}", std::process::id());
    let folder = tempfile::tempdir().expect("a folder");
    let config = folder.path().join("bench.toml");
    std::fs::write(&config, format!("name = \"{bench}\"\n")).expect("written");
    // Only this bench's: other tests run beside this one.
    let own = ["--config", config.to_str().expect("UTF-8")];
    let fix = [own[0], own[1], "--fix"];
    let recording = folder.path().join("run.mcap");
    let mut process = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
        .args(["record", "--config"])
        .arg(&config)
        .arg("-o")
        .arg(&recording)
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    assert!(waits(|| recording.metadata().is_ok_and(|it| it.len() > 0)), "it records");
    let mine = |findings: &[serde_json::Value]| {
        findings.iter().find(|it| it["found"].as_str().is_some_and(|text| text.contains(&bench))).cloned()
    };
    // Longer than the doctor calls a bench just starting.
    std::thread::sleep(Duration::from_millis(2500));
    assert_eq!(mine(&findings(&own).1), None, "a living bench is left alone");
    process.kill().expect("SIGKILL");
    process.wait().expect("ended");
    let found = mine(&findings(&own).1).expect("a dead bench is found");
    assert_eq!(found["grade"], "warning");
    assert_eq!(found["mend"], "rotorbench doctor --fix");
    let mended = mine(&findings(&fix).1).expect("it says what it did");
    assert_eq!(mended["grade"], "mended");
    assert_eq!(mine(&findings(&own).1), None, "nothing is left");
    let left: Vec<_> = std::fs::read_dir("/dev/shm")
        .expect("there")
        .filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned()))
        .filter(|name| name.contains(&bench))
        .collect();
    assert!(left.is_empty(), "{left:?}");
    // Killed in the middle, its recording can still be read.
    assert!(rotorbench::recording::Recording::open(Path::new(&recording)).is_ok());
}
