//! What README and guide show is true: commands run, options and bench files exist, links lead somewhere.
//!
//! Blocks marked `sh` are run, line by line (the same diagnosis of the same logs once), in a folder that holds `train.csv` and
//! `held_out.csv`; each line of a block marked `text output` is a line that one of the page's commands says; each block of TOML is
//! marked with its kind, whose reader accepts it:
//! `toml bench` and `toml plan` (`toml bench=FILE`, `toml plan=FILE`: that the page's commands read), `toml mapping`, and parts of
//! files, `toml bench part` and `toml model part`; all others are for reading.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

#[path = "documents/codes.rs"]
mod codes;
#[path = "documents/form.rs"]
mod form;
mod json_schema;
#[path = "documents/names.rs"]
mod names;
#[path = "documents/numbers.rs"]
mod numbers;
#[path = "documents/options.rs"]
mod options;
#[path = "documents/sentences.rs"]
mod sentences;
#[path = "documents/toml_blocks.rs"]
mod toml_blocks;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every page of README and docs, its name and its text.
fn pages() -> Vec<(String, String)> {
    fn gather(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("readable").map(|entry| entry.expect("an entry").path()) {
            if entry.is_dir() {
                gather(&entry, found);
            } else if entry.extension().is_some_and(|it| it == "md") {
                found.push(entry);
            }
        }
    }
    let mut files: Vec<_> =
        ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|name| root().join(name)).into();
    gather(&root().join("docs"), &mut files);
    files.sort();
    let name = |file: &Path| file.strip_prefix(root()).expect("below").display().to_string();
    let pages: Vec<_> =
        files.iter().map(|file| (name(file), fs::read_to_string(file).expect("UTF-8"))).collect();
    assert!(pages.len() > 20, "the pages were found");
    pages
}

/// The blocks of a page whose first line is ```` ```KIND ````.
fn blocks(text: &str, kind: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if let Some(of) = line.strip_prefix("```").filter(|of| !of.is_empty() || kind.is_empty()) {
            let block: Vec<&str> = lines.by_ref().take_while(|line| !line.starts_with("```")).collect();
            if of == kind {
                found.push(block.join("\n"));
            }
        }
    }
    found
}

/// Blocks marked `toml bench=FILE` or `toml plan=FILE`: files that the page's commands read.
fn named_files(text: &str) -> Vec<(String, String)> {
    let named = text.lines().filter_map(|line| line.strip_prefix("```toml "));
    let named = named.filter_map(|kind| Some((kind, kind.split_once('=')?.1)));
    named.map(|(kind, name)| (name.to_owned(), blocks(text, &format!("toml {kind}")).concat())).collect()
}

fn rotorbench(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rotorbench"));
    command.args(arguments).current_dir(folder).output().expect("the program starts")
}

/// Two logs of so many seconds, such as the guide's commands work on: an attitude bench with a pendulum that nobody mentioned.
fn logs(folder: &Path, seconds: &str) {
    for (name, more) in [("train.csv", vec![]), ("held_out.csv", vec!["--seed", "2", "--sequence", "2"])] {
        let common = [
            "experiment",
            "prbs",
            "--lockstep",
            "--closed-loop",
            "--amplitude",
            "0.03",
            "--duration",
            seconds,
        ];
        let hidden = ["--hide", "gravity_pendulum:moment=0.4", "-o", name];
        let done = rotorbench(folder, &[&common[..], &hidden[..], &more[..]].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
}

/// Each command ends with 0 or 1 (found wanting); its words are split at blanks, `>` writes its output to a file. What it said.
fn run_line(folder: &Path, page: &str, line: &str) -> String {
    let line = line.split(" #").next().unwrap_or_default().trim();
    let Some(command) = line.strip_prefix("rotorbench ") else {
        panic!("{page}: only `rotorbench` can be run in a block marked sh: {line}")
    };
    let (command, file) = command.split_once(" > ").map_or((command, None), |(a, b)| (a, Some(b.trim())));
    let arguments: Vec<&str> = command.split_whitespace().collect();
    let done = rotorbench(folder, &arguments);
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(matches!(done.status.code(), Some(0 | 1)) && !said.contains("error:"), "{page}: {line}\n{said}");
    if let Some(file) = file {
        fs::write(folder.join(file), &done.stdout).expect("written");
    }
    String::from_utf8(done.stdout).expect("UTF-8")
}

/// What a line of a page says. A diagnosis that another page has made of the same files is not made again.
fn said_by(folder: &Path, page: &str, line: &str, known: &mut BTreeMap<Vec<u8>, String>) -> String {
    if !line.starts_with("rotorbench diagnose ") || line.contains(" -o ") || line.contains('>') {
        return run_line(folder, page, line);
    }
    let words = line.split(" #").next().unwrap_or_default().split_whitespace();
    let asked = words
        .flat_map(|word| [word.as_bytes(), b" ", &fs::read(folder.join(word)).unwrap_or_default()].concat());
    known.entry(asked.collect()).or_insert_with(|| run_line(folder, page, line)).clone()
}

/// Lines that a page shows as output are lines that its commands said, blanks aside.
fn check_shown(page: &str, text: &str, said: &str) -> usize {
    let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    let lines: BTreeSet<String> = said.lines().map(words).collect();
    let shown: Vec<String> = blocks(text, "text output")
        .iter()
        .flat_map(|block| block.lines().map(words).collect::<Vec<_>>())
        .collect();
    for line in &shown {
        assert!(lines.contains(line), "{page}: no command of it says: {line}\n{said}");
    }
    shown.len()
}

/// A thrust stand's log in another program's words, whose columns are to be guessed.
const FOREIGN: &str = "Time (s),ESC signal (µs),Motor Electrical Speed (RPM),Voltage (V)\n0,1200,3000,12\n0.1,1300,3600,12\n0.2,1250,3300,12\n";

/// The answers that need no other process, by their schemas.
const ANSWERS: [(&str, &str); 25] = [
    ("check", "check --json"),
    ("compare", "compare --model paper --log held_out.csv --json"),
    ("compare-runs", "compare --runs run.mcap --json"),
    ("design", "design --json"),
    ("design", "design --controller pid --delay-ms 200 --json"),
    ("diagnose", "diagnose --model paper --log train.csv --validate held_out.csv --json"),
    ("discover", "discover --model paper --log train.csv --validate held_out.csv --json"),
    ("doctor", "doctor --json"),
    ("effects", "effects --json"),
    ("effects-card", "effects gravity_pendulum --json"),
    ("effects-card", "effects creaking_pivot --model mine.toml --json"),
    ("emulate-shm", "emulate --shm --seconds 0.5 --config bench.toml --json"),
    ("experiment", "experiment steps --count 3 --lockstep --hide transport_delay -o steps.csv --json"),
    ("export", "export run.mcap -o run.csv --candump run.log --json"),
    ("extend", "extend --effect gravity_pendulum --log train.csv -o better.toml --json"),
    ("diagnose", "diagnose --model better.toml --log train.csv --json"),
    ("extend-step-back", "extend --model better.toml --step-back -o back.toml --json"),
    ("fleet-merge", "fleet merge answers --plan plan.toml --json"),
    ("identify", "identify --log train.csv --json"),
    ("import", "import train.csv --json"),
    ("import-guess", "import foreign.csv --json"),
    ("jitter", "jitter --duration-s 0.2 --rounds 1 --without-cyclictest --json"),
    ("replay", "replay run.mcap --json"),
    ("replay", "replay run.mcap --set controller.reference.angle_rad=0.1 --json"),
    ("run-lockstep", "run --lockstep --seconds 10 --impulse 5:0.05:0.6 --json"),
];

/// The words of every test, to see what is held against a schema where several processes run.
fn words_of_tests(folder: &Path) -> String {
    let entries = fs::read_dir(folder).expect("readable").map(|entry| entry.expect("an entry").path());
    let text = |path: PathBuf| match path.extension() {
        _ if path.is_dir() => words_of_tests(&path),
        Some(extension) if extension == "rs" => fs::read_to_string(&path).expect("UTF-8"),
        _ => String::new(),
    };
    entries.map(text).collect()
}

/// An answer of each command that has a schema, beside that schema.
#[test]
fn answers_fit_their_schemas() {
    let folder = tempfile::tempdir().expect("a folder");
    logs(folder.path(), "20");
    fs::write(folder.path().join("foreign.csv"), FOREIGN).expect("written");
    let bench = format!("name = \"answers-{}\"\n", std::process::id());
    fs::write(folder.path().join("bench.toml"), bench).expect("written");
    let run = |line: &str| rotorbench(folder.path(), &line.split(' ').collect::<Vec<_>>());
    assert!(run("run --lockstep --seconds 10 --impulse 5:0.05:0.6 --record run.mcap").status.success());
    fs::write(folder.path().join("plan.toml"), "[[bench]]\nname = \"one\"\nlog = [\"train.csv\"]\n")
        .expect("written");
    assert!(run("fleet run plan.toml -o answers").status.success());
    fs::write(folder.path().join("mine.toml"), run("effects --template").stdout).expect("written");
    for (name, line) in ANSWERS {
        let answer = run(line);
        assert!(!answer.stdout.is_empty(), "{line}: {}", String::from_utf8_lossy(&answer.stderr));
        json_schema::answer(name, &answer.stdout);
        // An answer without an effect has less to hold against its schema.
        if line.starts_with("diagnose --model paper") {
            assert!(String::from_utf8_lossy(&answer.stdout).contains("gravity_pendulum.moment"), "{line}");
        }
    }
    let (names, tests) = (run("schema").stdout, words_of_tests(&root().join("tests")));
    for name in String::from_utf8(names).expect("UTF-8").lines() {
        let held = ANSWERS.iter().any(|(it, _)| *it == name) || tests.contains(&format!("answer(\"{name}\""));
        assert!(held, "no test holds an answer against the schema {name}");
        let table = fs::read_to_string(root().join("docs/schema/README.md")).expect("UTF-8");
        assert!(table.contains(&format!("({name}.json)")), "docs/schema/README.md does not lead to {name}");
    }
}

/// Pages whose commands make their logs.
const OWN_LOGS: [&str; 2] = ["README.md", "docs/tutorial.md"];

/// Pages that show no number of their logs: logs a third as long as the README's do for them.
const SHORT_LOGS: [&str; 2] = ["docs/guide/discover.md", "docs/guide/json.md"];

#[test]
fn commands_marked_as_runnable_run() {
    let [short, long] = ["20", "60"].map(|seconds| {
        let folder = tempfile::tempdir().expect("a folder");
        logs(folder.path(), seconds);
        folder
    });
    let (mut count, mut shown, mut known) = (0, 0, BTreeMap::new());
    for (page, text) in pages() {
        let commands: Vec<String> = blocks(&text, "sh")
            .iter()
            .flat_map(|it| it.lines().map(str::to_owned).collect::<Vec<_>>())
            .collect();
        if commands.is_empty() {
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        for log in ["train.csv", "held_out.csv"].iter().filter(|_| !OWN_LOGS.contains(&page.as_str())) {
            let made = if SHORT_LOGS.contains(&page.as_str()) { &short } else { &long };
            fs::copy(made.path().join(log), folder.path().join(log)).expect("copied");
        }
        for (name, block) in named_files(&text) {
            fs::write(folder.path().join(name), block).expect("written");
        }
        let mut said = String::new();
        for line in commands.iter().filter(|line| !line.trim().is_empty()) {
            said += &said_by(folder.path(), &page, line, &mut known);
            count += 1;
        }
        shown += check_shown(&page, &text, &said);
        sentences::check(&page, &text, &said, folder.path());
    }
    assert!(count >= 30 && shown >= 25, "{count} commands and {shown} lines of output were found");
}

/// What `check --template` prints is what lies in `examples/benches/`; each file there is a bench that could be armed.
#[test]
fn benches_to_start_from_are_accepted() {
    let folder = root().join("examples/benches");
    let check = |arguments: &[&str]| {
        let done = rotorbench(&folder, &[&["check"], arguments].concat());
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.success(), "{arguments:?}: {said}");
        String::from_utf8(done.stdout).expect("UTF-8")
    };
    let files = fs::read_dir(&folder).expect("readable").map(|entry| entry.expect("an entry").path());
    let files: Vec<PathBuf> = files.collect();
    assert!(files.len() >= 3, "{files:?}");
    for file in &files {
        check(&["--config", &file.display().to_string()]);
        let name = file.file_stem().expect("a name").to_string_lossy();
        assert_eq!(check(&["--template", &name]), fs::read_to_string(file).expect("UTF-8"));
    }
    assert_eq!(check(&["--config", "bench.toml"]), check(&[]), "the template is the bench that is built in");
}
