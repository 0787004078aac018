//! What the program itself says of a bad bench file or database: one sentence with the place, and exit 2.

use std::path::Path;
use std::process::Command;

/// A database whose two signals share bits; the second stands in line 11.
const OVERLAP: &str = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: A\n\nBO_ 1 M: 8 A\n SG_ a : 0|8@1+ (1,0) [0|0] \"\" A\n \
                       SG_ b : 7|8@1+ (1,0) [0|0] \"\" A\n";

/// What `check` says of a bench file, and that it is one line and an end with 2.
fn said(folder: &Path, bench: Option<&str>) -> String {
    let file = folder.join("bench.toml");
    match bench {
        Some(text) => std::fs::write(&file, text).expect("written"),
        None => drop(std::fs::remove_file(&file)),
    }
    let program = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
        .args(["check", "--config"])
        .arg(&file)
        .output()
        .expect("the program runs");
    let said = String::from_utf8_lossy(&program.stderr).into_owned();
    assert_eq!(program.status.code(), Some(2), "{bench:?}: {said}");
    assert_eq!(program.stdout, b"", "{bench:?}");
    assert!(!said.contains("panicked"), "{bench:?}: {said}");
    said
}

#[test]
fn each_is_told_with_its_place_and_ends_with_2() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("over.dbc"), OVERLAP).expect("written");
    let cases: [(Option<&str>, &[&str]); 6] = [
        (None, &["bench.toml", "No such file"]),
        (Some("name = 'x'\nperiod_s = = 1\n"), &["bench.toml", "line 2"]),
        (
            Some("name = 'x'\n[bus.sensors]\nbody_rate = { signal = 'GYRO.nothing' }\n"),
            &["bench.toml, line 3", "no signal `nothing`"],
        ),
        (
            Some("name = 'x'\n[bus.sensors]\nbody_rate = { signal = 'GYRO.rate', unit = 'furlong' }\n"),
            &["bench.toml, line 3", "furlong"],
        ),
        (Some("name = 'x'\n[[bus.database]]\nfile = 'over.dbc'\n"), &["over.dbc:11", "overlap"]),
        (Some("name = 'x'\nperiod_s = 'soon'\n"), &["bench.toml", "line 2"]),
    ];
    for (bench, wanted) in cases {
        let said = said(folder.path(), bench);
        assert!(wanted.iter().all(|part| said.contains(part)), "{bench:?}: {said}");
    }
}
