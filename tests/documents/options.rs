//! Options and commands that README and guide show exist.

use std::collections::{BTreeMap, BTreeSet};

use super::{pages, root, rotorbench};

/// Options that other programs have: cargo, and the scripts in tools/.
const OTHERS: &[&str] = &[
    "--release",
    "--all",
    "--lib",
    "--test",
    "--example",
    "--open",
    "--bench",
    "--draws",
    "--only",
    "--brief",
    "--out",
    "--require-all",
    "--locked",
    "--profile",
    "--config",
    "--real-time",
    "--write",
    "--quick",
    "--help",
    "--path",
    "--array",
];

/// The words of a text that are options.
fn option_words(text: &str) -> BTreeSet<String> {
    let is_word = |letter: char| letter.is_ascii_alphanumeric() || letter == '-';
    text.split(|letter| !is_word(letter))
        .filter(|word| word.starts_with("--") && word.len() > 3)
        .map(str::to_owned)
        .collect()
}

/// The program's commands, and the options of each, those of its own commands among them.
pub struct Commands {
    pub names: BTreeSet<String>,
    pub options: BTreeMap<String, BTreeSet<String>>,
}

impl Commands {
    pub fn of_the_program() -> Self {
        let help = |command: &str| {
            let words: Vec<&str> = command.split(' ').chain(["--help"]).collect();
            let done = rotorbench(root(), &words);
            assert!(done.status.success(), "`rotorbench {command} --help`");
            String::from_utf8(done.stdout).expect("UTF-8")
        };
        let general = String::from_utf8(rotorbench(root(), &["--help"]).stdout).expect("UTF-8");
        let names: BTreeSet<String> = general
            .lines()
            .filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next())
            .filter(|word| word.chars().all(|it| it.is_ascii_lowercase()) && *word != "help")
            .map(str::to_owned)
            .collect();
        assert!(names.contains("diagnose") && names.len() > 20, "{names:?}");
        let own = |command: &str| match command {
            "experiment" => &["constant", "ramp", "steps", "prbs", "chirp"][..],
            "fleet" => &["plan", "run", "merge"],
            "dronecan" => &["list", "param", "allocate"],
            _ => &[],
        };
        let options = |command: &String| {
            let mut options = option_words(&help(command));
            own(command)
                .iter()
                .for_each(|it| options.extend(option_words(&help(&format!("{command} {it}")))));
            (command.clone(), options)
        };
        Self { options: names.iter().map(options).collect(), names }
    }
}

/// A command that lacks only a command answers with its help, as one that asks for help.
#[test]
fn a_command_alone_shows_its_help() {
    for command in ["", "experiment", "fleet", "dronecan"] {
        let words: Vec<&str> = command.split_whitespace().collect();
        let done = rotorbench(root(), &words);
        let asked = rotorbench(root(), &[&words[..], &["-h"]].concat());
        assert_eq!((done.status.code(), done.stderr.len()), (Some(0), 0), "`rotorbench {command}`");
        assert_eq!(String::from_utf8(done.stdout), String::from_utf8(asked.stdout), "`rotorbench {command}`");
    }
    // Where more than a command is missing it is an error still.
    for command in ["diagnose", "fleet plan", "fleet merge", "nonsense"] {
        let done = rotorbench(root(), &command.split(' ').collect::<Vec<_>>());
        assert_eq!((done.status.code(), done.stdout.len()), (Some(2), 0), "`rotorbench {command}`");
    }
}

#[test]
fn options_and_commands_that_are_shown_exist() {
    let commands = Commands::of_the_program();
    let mut known: BTreeSet<String> = OTHERS.iter().map(|word| (*word).to_owned()).collect();
    known.extend(commands.options.values().flatten().cloned());
    for (page, text) in pages().iter().filter(|(page, _)| !page.starts_with("docs/evidence")) {
        for word in option_words(text) {
            let word = word.trim_end_matches('-').to_owned();
            assert!(known.contains(&word), "{page}: no command has {word}");
        }
        for line in text.lines().filter_map(|line| line.trim_start().strip_prefix("rotorbench ")) {
            let command = line.split_whitespace().next().unwrap_or_default();
            assert!(commands.names.contains(command) || command == "COMMAND", "{page}: rotorbench {command}");
        }
    }
}
