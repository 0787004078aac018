//! What was probably meant where the command line has a word too many.

/// A file without the option that it is for.
#[must_use]
pub fn of_file(option: &str, file: &str) -> String {
    format!("a file needs its option: `--{option} {file}`")
}

/// An option that kinds of `command` have, before the kind: the `first` of them, and the `others`.
#[must_use]
pub fn of_kind(command: &str, option: &str, first: &str, others: &[&str]) -> String {
    let others: Vec<String> = others.iter().map(|kind| format!("`{kind}`")).collect();
    let others = if others.is_empty() { String::new() } else { format!(" (or {})", others.join(", ")) };
    format!("the kind comes first: `rotorbench {command} {first} --{option} ...`{others}")
}
