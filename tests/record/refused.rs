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
