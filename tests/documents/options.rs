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

/// The program's commands, the commands of these, and the options of each, those of its own commands among them.
pub struct Commands {
    pub names: BTreeSet<String>,
    pub own: BTreeMap<String, Vec<String>>,
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
        let is_name = |word: &&str| {
            word.starts_with(|it: char| it.is_ascii_lowercase())
                && word.chars().all(|it| it.is_ascii_lowercase() || it == '-')
        };
        let names: BTreeSet<String> = general
            .lines()
            .filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next())
            .filter(|word| is_name(word) && *word != "help")
            .map(str::to_owned)
            .collect();
        assert!(names.contains("diagnose") && names.len() > 20, "{names:?}");
        let (mut own, mut options) = (BTreeMap::new(), BTreeMap::new());
        for command in &names {
            let text = help(command);
            let (below, mut words) = (own_commands(&text), option_words(&text));
            below.iter().for_each(|it| words.extend(option_words(&help(&format!("{command} {it}")))));
            own.insert(command.clone(), below);
            options.insert(command.clone(), words);
        }
        Self { names, own, options }
    }
}

/// The commands of a command, as its help lists them.
fn own_commands(help: &str) -> Vec<String> {
    let listed = help.split_once("\nCommands:\n").map_or("", |(_, behind)| behind);
    let lines = listed.lines().take_while(|line| !line.is_empty());
    // What goes on from the line before stands further in.
    let names = lines.filter_map(|line| line.strip_prefix("  ")?.split(' ').next());
    names.filter(|name| !["", "help"].contains(name)).map(str::to_owned).collect()
}

/// A command that lacks only a command answers with its help, as one that asks for help.
#[test]
fn a_command_alone_shows_its_help() {
    let commands = Commands::of_the_program();
    let with_own = commands.own.iter().filter(|(_, own)| !own.is_empty());
    let with_own: Vec<&str> = with_own.map(|(command, _)| command.as_str()).collect();
    for command in ["experiment", "fleet", "dronecan"] {
        assert!(with_own.contains(&command), "{command}: {:?}", commands.own);
    }
    for command in with_own.into_iter().chain([""]) {
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
