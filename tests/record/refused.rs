//! A run that is refused leaves nothing behind.

use rotorbench::model::{Actuator, Model};
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

/// What stands on standard error, and the exit code.
fn said(arguments: &[&str]) -> (String, Option<i32>) {
    let done = rotorbench(arguments);
    (String::from_utf8_lossy(&done.stderr).into_owned(), done.status.code())
}

/// Who takes one file for the other reads that, not which keys it lacks; an option is blamed where it is wrong, not the bench file.
#[test]
fn each_refusal_names_what_is_wrong_and_what_helps() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        path.to_str().expect("UTF-8").to_owned()
    };
    let bench = file("bench.toml", "period_s = 0.02\n[bus]\ninterface = 'nope0'\n");
    let paper = Model::paper();
    let model = file("m.toml", &paper.emit().expect("a model"));
    let steady_rate = vec![0.0, 3000.0, -6000.0, 3960.0];
    let falls = Model { actuator: Actuator { steady_rate, ..paper.actuator.clone() }, ..paper };
    let falls = file("falls.toml", &falls.emit().expect("a model"));
    let comma = file("comma.toml", "period_s = 0,02\n");
    let mapping = file("stand.toml", "description = 'a stand'\n[time]\ncolumn = 't'\nunit = 's'\n");
    let cases: [(&[&str], &[&str]); 10] = [
        (&["design", "--model", &bench], &["bench.toml is a bench file, and a model is wanted here"]),
        (&["check", "--config", &model], &["m.toml is a model, and a bench file is wanted here"]),
        (&["design", "--model", &mapping], &["stand.toml is a mapping, and a model is wanted here"]),
        (&["check", "--config", &mapping], &["stand.toml is a mapping, and a bench file is wanted here"]),
        (&["design", "--model", &falls], &["falls.toml: model `paper`", "0.455 and 0.555", "--degree 2"]),
        (&["check", "--config", &comma], &["comma.toml, line 1", "a decimal comma? write 0.02"]),
        (&["check", &bench], &["tip: a file needs its option: `--config "]),
        (&["emulate", "--can", "nope1", "--config", &bench], &["error: --can nope1: CAN interface `nope1`"]),
        (&["run", "--arm", "--config", &bench], &["bench.toml, line 3: CAN interface `nope0`: th"]),
        (&["run", "--lockstep", "--hide", "gravity_pendulum:moment=300"], &["must lie in -20..20 N m"]),
    ];
    for (arguments, wanted) in cases {
        let (said, code) = said(arguments);
        assert_eq!(code, Some(2), "{arguments:?}: {said}");
        assert!(wanted.iter().all(|part| said.contains(part)), "{arguments:?}: {said}");
    }
}

#[test]
fn what_a_run_on_virtual_time_leaves_unused_is_said() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = folder.path().join("bench.toml");
    for (text, is_said) in [("[bus]\ninterface = 'nope0'\n", true), ("period_s = 0.02\n", false)] {
        std::fs::write(&bench, text).expect("written");
        let (said, code) =
            said(&["run", "--lockstep", "--seconds", "1", "--config", &bench.display().to_string()]);
        assert_eq!((said.contains("`[bus]` is not used"), code), (is_said, Some(0)), "{said}");
    }
}

/// The file beside a log says every number, also of what was left to the program.
#[test]
fn what_was_hidden_is_written_down_with_its_numbers() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("prbs.csv").display().to_string();
    let signal = ["experiment", "prbs", "--lockstep", "--duration", "2", "-o", &log];
    let (said, code) = said(&[&signal[..], &["--hide", "asymmetric_pole"]].concat());
    assert_eq!(code, Some(0), "{said}");
    let written = std::fs::read_to_string(folder.path().join("prbs.toml")).expect("written");
    let table: toml::Table = written.parse().expect("TOML");
    let ratio = &table["emulator"]["hidden"][0]["parameters"]["ratio"];
    assert_eq!(ratio.as_float(), Some(1.6), "{written}");
}
