//! Words of commands that are shown, to be copied into a shell.

/// A word as a shell takes it for one.
#[must_use]
pub fn quoted(word: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./:=,+@%".contains(letter);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_stays_one_word_in_a_shell() {
        let words = ["plain-1.csv", "a b.csv", "it's.csv", "<img>.csv", "$(x).csv", ""];
        let shown = words.map(quoted);
        assert_eq!(shown, ["plain-1.csv", "'a b.csv'", "'it'\\''s.csv'", "'<img>.csv'", "'$(x).csv'", "''"]);
        for (word, shown) in words.iter().zip(&shown) {
            let said = std::process::Command::new("sh").args(["-c", &format!("printf %s {shown}")]).output();
            assert_eq!(String::from_utf8_lossy(&said.expect("a shell").stdout), *word);
        }
    }
}
