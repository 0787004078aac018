//! `paper`, what it leaves behind, and recorded runs side by side.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use rotorbench::log::csv;
use rotorbench::rt::Shutdown;
use rotorbench::studies::paper::{self, PaperSettings};
use serde_json::Value;

use crate::json_schema;

/// Starts `paper` with these options and that report; what it says is kept.
fn start_paper(options: &[&str], report: &Path) -> Child {
    let mut program = Command::new(env!("CARGO_BIN_EXE_rotorbench"));
    program.arg("paper").args(options).arg("--report").arg(report);
    program.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts")
}

/// `paper` on short experiments.
#[test]
fn the_paper_comes_out_of_one_process() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let report = folder.path().join("paper.html");
    let program = start_paper(&["--json", "--prbs-s", "60", "--hold-s", "40"], &report);
    let output = program.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let paper: Value = json_schema::answer("paper", &output.stdout);
    let rows = paper["beside"].as_array().expect("rows");
    let number = |row: &Value, key: &str| row[key].as_f64().unwrap_or(f64::NAN);
    let identified: Vec<&Value> = rows.iter().filter(|row| row["standard_error"].is_number()).collect();
    assert_eq!(identified.len(), 4, "c_g1, c_g2, k_V, p: {rows:?}");
    for row in identified {
        let away = (number(row, "ours") - number(row, "printed")).abs() / number(row, "standard_error");
        // Four numbers at a fixed seed; 3.3 standard errors is a chance of one in a thousand each.
        assert!(away < 3.3, "{away}: {row}");
    }
    let run = |controller: &str, delay: f64| {
        let runs = paper["runs"].as_array().expect("runs");
        let found = runs.iter().find(|it| it["controller"] == controller && it["delay"] == delay);
        found.expect("a run")["answer"].clone()
    };
    // What `design` says of the same loops: the report has it beside the 30 ms.
    let limit = |row: &Value| 1e3 * row["delay_limit"].as_f64().expect("a delay");
    let page =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/guide/paper.md")).expect("a page");
    assert!(
        page.contains("unstable from 32.6 ms on (EMC's from 92.5 ms)"),
        "the limits below are those of the guide"
    );
    for row in paper["runs"].as_array().expect("runs") {
        // The pole that was identified in a minute is off by some tenths of a percent.
        let expected = if row["controller"] == "PID" { 32.6 } else { 92.5 };
        assert!((limit(row) - expected).abs() < 0.02 * expected, "{}: {}", row["controller"], limit(row));
    }
    let text = std::fs::read_to_string(&report).expect("a report");
    let said = ["stable up to a delay of 9", "up to 32.", "30.0 ms run here leave the PID little"];
    assert!(said.iter().all(|it| text.contains(it)) && !text.contains("tuned to lose"), "{said:?}");
    for delay in [0.0, 0.03] {
        let (emc, pid) = (run("EMC", delay), run("PID", delay));
        let swings = |answer: &Value| answer["swings"].as_u64().expect("a count");
        // One small overshoot and no ringing, and an estimate that follows the impulse; the PID rings with delay.
        assert!(swings(&emc) <= 1 + u64::from(delay > 0.0), "{emc}");
        // The predictor takes about 0.5 s, ten times the impulse: it sees a tenth of it. The PID's integral hardly moves.
        assert!(number(&emc, "disturbance_peak") > 3.0 * number(&pid, "disturbance_peak"), "{emc} {pid}");
        assert!(delay == 0.0 || swings(&pid) >= 3, "{pid}");
        // On the bare model the PID has the smaller peak.
        assert!(delay > 0.0 || number(&pid, "peak") < number(&emc, "peak"), "{emc} {pid}");
    }
    assert!(std::fs::metadata(&report).is_ok_and(|file| file.len() > 100_000), "a report with its plots");
}

/// A seed with which the gyro of the first bench reads the same in seven periods on end, by chance, 42 s into the
/// constant commands: what the guard of a bench that runs calls frozen.
const STILL: u64 = 374;

#[test]
fn a_gyro_that_stands_still_stops_no_experiment_on_a_body_that_is_held() {
    let settings = PaperSettings { seed: STILL, prbs_s: 20.0, hold_s: 20.0 };
    let shutdown = Shutdown::default();
    // Only the constant commands are of interest.
    let mut tell = |what: &str, _: f64| {
        if what == "ramps" {
            shutdown.request();
        }
    };
    let error = paper::run(&settings, &shutdown, &mut tell).expect_err("it is stopped").to_string();
    assert_eq!(error, "stopped in the middle of ramps: done");

    let folder = tempfile::tempdir().expect("a temporary folder");
    // `experiment` holds the body likewise, and its guard is not asked about the gyro unless the file says so.
    let bench =
        "[emulator.sensors]\nbody_rate = { rate_hz = 50, noise = 0.004, quantization = 0.0009765625 }\n";
    let strict = "[guard.body_rate]\nfrozen_after_s = 0.1\n";
    for (guard, code) in [("", 0), (strict, 1)] {
        std::fs::write(folder.path().join("held.toml"), format!("{bench}{guard}")).expect("written");
        let line = format!(
            "experiment constant --lockstep --config held.toml --seed {STILL} --lead-in 4 -o {code}.csv"
        );
        let output = rotorbench(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(code), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

/// Whether the process has said what it does when it is interrupted.
fn catches_interrupts(process: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap_or("0");
    u64::from_str_radix(caught.trim(), 16).unwrap_or(0) & (1 << 1) != 0
}

#[test]
fn a_paper_that_is_interrupted_leaves_no_report() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let report = folder.path().join("paper.html");
    // Long enough that it cannot be over before the signal comes: ten hours of simulated time.
    let program = start_paper(&["--prbs-s", "36000"], &report);
    let process = program.id();
    while !catches_interrupts(process) {
        std::thread::sleep(Duration::from_millis(1));
    }
    let sent = Command::new("kill").args(["-INT", &process.to_string()]).status().expect("kill is there");
    assert!(sent.success());
    let output = program.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("interrupted (Ctrl-C); no report was written"), "{said}");
    assert!(!report.exists());
}

fn rotorbench(folder: &Path, arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_rotorbench"));
    program.current_dir(folder).args(arguments).output().expect("the program starts")
}

/// Fifteen seconds on virtual time into `NAME.mcap`.
fn record(folder: &Path, name: &str, bench: &str, impulse: &[&str]) {
    std::fs::write(folder.join("bench.toml"), format!("name = \"{name}\"\n{bench}")).expect("written");
    let recording = format!("{name}.mcap");
    let arguments =
        ["run", "--lockstep", "--seconds", "15", "--config", "bench.toml", "--record", &recording];
    let output = rotorbench(folder, &[&arguments, impulse].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn compared(folder: &Path, arguments: &[&str]) -> Value {
    let output = rotorbench(folder, &[&["compare", "--json", "--runs"], arguments].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    json_schema::answer("compare-runs", &output.stdout)
}

const IMPULSE: [&str; 2] = ["--impulse", "5:0.05:0.6"];
const PID: &str = "[controller]\nkind = \"pid\"\n";
const LATE: &str = "[emulator]\ncommand_delay_s = 0.03\n";

#[test]
fn recorded_runs_are_compared_side_by_side() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    record(folder, "emc", "", &IMPULSE);
    record(folder, "pid", PID, &IMPULSE);
    record(folder, "emc_late", LATE, &IMPULSE);
    record(folder, "pid_late", &format!("{PID}{LATE}"), &IMPULSE);
    let files = ["emc.mcap", "pid.mcap", "emc_late.mcap", "pid_late.mcap"];
    let found = compared(folder, &[&files[..], &["--report", "runs.html"]].concat());
    assert_eq!(found["warnings"], serde_json::json!([]), "{found:#}");
    let runs = found["runs"].as_array().expect("runs");
    let number = |index: usize, key: &str| runs[index]["answer"][key].as_f64().expect("a number");
    for (index, (controller, delay)) in
        [("EMC", 0.0), ("PID", 0.0), ("EMC", 0.03), ("PID", 0.03)].iter().enumerate()
    {
        let run = &runs[index];
        assert_eq!(run["controller"], *controller);
        assert_eq!(run["delay"].as_f64(), Some(*delay));
        assert_eq!((run["struck_from"].as_str(), run["struck_s"].as_f64()), (Some("recording"), Some(5.0)));
    }
    // As `paper` finds it: on the bare model PID has the smaller peak, with delay it rings.
    assert!(
        number(1, "peak") < number(0, "peak") && number(2, "swings") <= 2.0 && number(3, "swings") > 10.0
    );
    // The peak in the log that `export` writes, in a second way: the grid of its rows is the guard's.
    rotorbench(folder, &["export", "emc.mcap", "-o", "emc.csv"]);
    let log = csv::read(&folder.join("emc.csv")).expect("a log");
    let angles: Vec<f64> =
        log.column("body_angle_rad").expect("measured").iter().copied().filter(|it| it.is_finite()).collect();
    let peak = angles.iter().fold(0.0_f64, |most, angle| most.max(angle.abs()));
    // Counted from the angle just before: the encoder's noise, a few milliradians.
    assert!((number(0, "peak") - peak).abs() < 5e-3, "{peak} {}", number(0, "peak"));
    assert!(std::fs::metadata(folder.join("runs.html")).is_ok_and(|file| file.len() > 50_000));

    // Said instead of recorded: the same.
    let given = compared(folder, &[&["emc.mcap"], &IMPULSE[..]].concat());
    assert_eq!(given["runs"][0]["struck_from"], "given");
    assert_eq!(given["runs"][0]["answer"], runs[0]["answer"]);
    assert_eq!(given["warnings"], serde_json::json!([]), "{given:#}");
    // Said otherwise than recorded: both are named.
    let given = compared(folder, &["emc.mcap", "--impulse", "6:0.05:0.6"]);
    let differs = &given["findings"][0];
    assert_eq!(differs["code"], "recorded_impulse_differs", "{given:#}");
    let [said, recorded] = ["", "recorded_"].map(|which| {
        ["torque_nm", "duration_s", "at_s"].map(|name| differs["evidence"][format!("{which}{name}")].as_f64())
    });
    assert_eq!((said, recorded), ([0.6, 0.05, 6.0].map(Some), [0.6, 0.05, 5.0].map(Some)));
}

#[test]
fn a_run_that_does_not_say_when_it_was_struck_is_scored_from_its_angle_and_says_so() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    // Nobody strikes: the reference jumps in a quarter of a second, so that the angle is far from it.
    let moves = "[[controller.reference.moves]]\nat_s = 6.0\nangle_rad = 0.2\nduration_s = 0.25\n";
    record(folder, "moved", moves, &[]);
    record(folder, "alone", "", &[]);
    record(folder, "weak", "", &["--impulse", "5:0.05:0.3"]);
    record(folder, "strong", "", &["--impulse", "5:0.05:0.6"]);
    let found = compared(folder, &["moved.mcap"]);
    let run = &found["runs"][0];
    assert_eq!(run["struck_from"], "angle");
    let struck = run["struck_s"].as_f64().expect("a number");
    assert!((5.8..6.4).contains(&struck), "{struck}");
    assert!(run["answer"]["disturbance_error"].is_null());
    assert_eq!(found["findings"][0]["code"], "impulse_unknown", "{found:#}");
    let different = compared(folder, &["weak.mcap", "strong.mcap"]);
    assert_eq!(different["findings"][0]["code"], "impulses_differ", "{different:#}");

    std::fs::write(folder.join("log.csv"), "time_s,command_1\n0,0.5\n").expect("written");
    for (arguments, sentence) in [
        (&["--runs", "log.csv"][..], "not a recording"),
        (&["--runs", "strong.mcap", "alone.mcap"], "alone.mcap: nothing struck the body in this run"),
        (&["--runs", "strong.mcap", "--impulse", "14.9:1:1"], "the run lasts from"),
        (&["--runs", "strong.mcap", "--impulse", "1:0:1"], "three numbers, the first not below zero"),
        (&["--runs", "strong.mcap", "--log", "log.csv"], "cannot be used with"),
    ] {
        let output = rotorbench(folder, &[&["compare"], arguments].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(sentence), "{said}");
    }
}

/// A run is measured over the window that `paper` judges, however long it lasts: a drift that crosses the band later, or
/// the next impulse, is not part of the answer.
#[test]
fn a_long_run_is_scored_over_the_window_behind_each_impulse() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    let bench =
        "name = \"long\"\n[emulator.sensors.body_rate]\nrate_hz = 50\nnoise = 0.02\nquantization = 0.0\n";
    std::fs::write(folder.join("bench.toml"), bench).expect("written");
    let record = |seconds: &str, file: &str, more: &[&str]| {
        let arguments =
            ["run", "--lockstep", "--config", "bench.toml", "--seconds", seconds, "--record", file];
        let output = rotorbench(folder, &[&arguments, &IMPULSE[..], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    record("14", "short.mcap", &[]);
    record("120", "long.mcap", &[]);
    record("60", "twice.mcap", &["--impulse", "30:0.1:-0.3"]);
    let found = compared(folder, &["short.mcap", "long.mcap"]);
    for run in found["runs"].as_array().expect("runs") {
        assert_eq!(run["judged_s"].as_f64(), Some(8.0));
        // The same bits in lockstep: what comes after the window does not count.
        assert_eq!(run["answer"], found["runs"][0]["answer"]);
        assert_eq!(run["later"], serde_json::json!([]));
    }
    let found = compared(folder, &["twice.mcap"]);
    let later = &found["runs"][0]["later"];
    assert_eq!(later.as_array().map(Vec::len), Some(1));
    assert_eq!((later[0]["struck_s"].as_f64(), later[0]["judged_s"].as_f64()), (Some(30.0), Some(8.0)));
    // As much push, 0.03 N m s, the other way: nearly the same swing. A twentieth for noise and the longer push.
    let peak = |answer: &Value| answer["peak"].as_f64().expect("a number");
    let ratio = peak(&later[0]["answer"]) / peak(&found["runs"][0]["answer"]);
    assert!((0.85..1.15).contains(&ratio), "{ratio}");
    let text = rotorbench(folder, &["compare", "--runs", "twice.mcap"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(
        text.contains("judged for 8.00 s behind it") && text.contains("EMC, 30.00 s, -0.300 N m"),
        "{text}"
    );
}

/// Margins that nobody can reach with a loop of any use: it is said what they cost.
#[test]
fn a_loop_that_is_stable_and_of_no_use_is_a_finding() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let warning = |line: &str| {
        let output = rotorbench(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        let design: Value = json_schema::answer("design", &output.stdout);
        design["warning"].as_str().map(str::to_owned)
    };
    for useful in ["design --json", "design --json --pid-margins 55,2.5", "design --json --alpha-c 2"] {
        assert_eq!(warning(useful), None, "{useful}");
    }
    let note = |line: &str| {
        let output = rotorbench(folder.path(), &line.split(' ').collect::<Vec<_>>());
        String::from_utf8_lossy(&output.stdout).contains("note: --pid-margins makes a PID")
    };
    let lines = ["", " --controller pid"].map(|more| note(&format!("design --pid-margins 55,2.5{more}")));
    assert_eq!(lines, [true, false], "the bench's own controller is EMC");
    let said = warning("design --json --pid-margins 89,10").expect("a warning");
    assert!(said.contains("of little use") && said.contains("0.18 rad/s; ask for smaller margins"), "{said}");
}

/// What would do nothing is refused by its name; what is out of range gets a sentence of ours, however it is written.
#[test]
fn options_that_do_nothing_or_cannot_be_are_refused_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let folder = folder.path();
    std::fs::write(folder.join("log.csv"), "time_s,command_1\n0,0.5\n").expect("written");
    for (line, sentence) in [
        ("design --controller emc --pid-margins 55,2.5", "--pid-margins would do nothing"),
        ("design --controller pid --alpha 1.1", "--alpha would do nothing"),
        ("design --pid-margins 55,2.5 --beta zoh", "--beta would do nothing"),
        ("design --feedback-gain 0.076,0.83,2 --alpha-c 1", "--alpha-c would do nothing"),
        ("design --alpha -1", "alpha is -1: it must be zero or a positive number"),
        ("design --delay-ms -5", "delay is -0.005: it must be from 0 to 1 s"),
        ("design --pid-margins -5,2", "--pid-margins needs degrees between 0 and 180"),
        ("design --feedback-gain 1e300,1,1", "must be 3 numbers"),
        ("design --gamma-0 1e300", "gamma_0 is 1e300: "),
        ("design --period-s 1e300", "period_s: 1e300 is outside 0.0001..1 s"),
        ("design --angle-deg 1e300", "--angle-deg must lie in -180..180, not 1e300"),
        ("design --angle-deg 30", "--angle-deg would do nothing: model `paper` has no effect"),
        ("design --model no.toml", "model file no.toml: No such file"),
        ("design --config no.toml", "bench file no.toml: No such file"),
        ("experiment prbs --lockstep --amplitude 0", "`amplitude` must lie in 0.0001..1, not 0"),
        ("experiment chirp --lockstep --amplitude -0.1", "`amplitude` must lie in 0.0001..1, not -0.1"),
        ("experiment steps --lockstep --count 1", "`count` must lie in 2..10000, not 1"),
        ("experiment constant --lockstep --levels -0.1,0.3", "commanded to -0."),
        ("experiment constant --lockstep --levels 1e300", "commanded to 1.3"),
        ("experiment ramp --lockstep --slope 1e300", "`slope` must lie in 0.0001..5.625, not 1e300"),
        ("experiment constant --lockstep --around 0.5", "--around would do nothing"),
        ("experiment prbs --lockstep --closed-loop --around 0.5", "--around would do nothing"),
        ("experiment prbs --lockstep --closed-loop --rotors both", "--rotors would do nothing"),
        ("experiment prbs --lockstep --closed-loop --free-body", "cannot be used with"),
        ("experiment prbs --lockstep --impulse 1:0.1:1", "--impulse would do nothing"),
        ("experiment prbs --lockstep --hide gravity_pendulum", "--hide gravity_pendulum would do nothing"),
        ("experiment prbs --seed 3", "--seed would do nothing"),
        ("identify --log log.csv --arm-m -1", "--arm-m must lie in 0.001..100, not -1"),
        ("identify --log log.csv --hover-rate 1e300", "--hover-rate must lie in 1..10000, not 1e300"),
        ("identify --log log.csv --template no.toml", "model file no.toml: No such file"),
        ("identify --log no.csv", "log no.csv: No such file"),
        ("compare --log log.csv --horizon -1", "must lie in 0.01..600 s"),
        ("compare --runs no.mcap", "recording no.mcap: No such file"),
        ("paper --prbs-s -5", "--prbs-s must lie in 20..86400, not -5"),
        ("paper --prbs-s 1e300", "--prbs-s must lie in 20..86400, not 1e300"),
    ] {
        let output = rotorbench(folder, &line.split(' ').collect::<Vec<_>>());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(said.contains(sentence) && said.len() < 600, "{line}: {said}");
    }
    // Nobody has to wait for a bench that is not there.
    let output = rotorbench(folder, &["experiment", "ramp"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("is not running") && !said.contains("waiting for"), "{said}");
    assert_eq!(std::fs::read_dir(folder).expect("there").count(), 1, "nothing was written");
}
