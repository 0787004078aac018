//! A run that is refused leaves nothing behind.

use rotorbench::shm::{PassingBench, SharedMemoryConfig};

use super::rotorbench;

#[test]
fn a_run_that_is_refused_leaves_no_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let (bench, recording) = (file("bench.toml"), file("run.mcap"));
    let name = format!("t{}-refused", std::process::id());
    let _gone_with_the_test = PassingBench::open(&name, &SharedMemoryConfig::default()).expect("a bench");
    let text = format!("name = '{name}'\n[bus]\ninterface = 'nope0'\n");
    std::fs::write(&bench, text).expect("written");
    let refused = rotorbench(&["run", "--config", &bench, "--record", &recording]);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(2), "{said}");
    assert!(said.contains("CAN interface `nope0`"), "{said}");
    assert!(!std::path::Path::new(&recording).exists(), "an empty recording was left behind");
    // A file that was there is not its to remove.
    std::fs::write(&recording, "somebody's").expect("written");
    let refused = rotorbench(&["run", "--config", &bench, "--record", &recording]);
    assert_eq!(refused.status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(&recording).expect("still there"), "somebody's");
}

/// Whoever writes half a name is shown the whole one.
#[test]
fn an_effect_that_is_not_emulated_is_answered_with_those_like_it() {
    for (hidden, words) in [
        (
            "gravity",
            "the emulator knows no such effect (like it: gravity_pendulum); `rotorbench effects` lists all",
        ),
        ("gyro_drift", "(like it: gyro_bias, gyro_scale, gyro_lag)"),
        ("xyz", "the emulator knows no such effect; `rotorbench effects`"),
    ] {
        let refused = rotorbench(&["run", "--lockstep", "--seconds", "1", "--hide", hidden]);
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{said}");
        assert!(said.contains(words), "{said}");
    }
}

/// Where nobody sends sensors a controller says so, and goes on waiting.
#[test]
fn a_controller_without_sensors_says_that_it_waits() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = folder.path().join("bench.toml");
    let name = format!("t{}-waits", std::process::id());
    let _gone_with_the_test = PassingBench::open(&name, &SharedMemoryConfig::default()).expect("a bench");
    std::fs::write(&bench, format!("name = '{name}'\n")).expect("written");
    let done = rotorbench(&["control", "--seconds", "2", "--config", &bench.display().to_string()]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(0), "{said}");
    assert_eq!(said.matches("waits for sensors").count(), 1, "{said}");
}
