//! How long an error may be: what it quotes is a user's own text, of any length and with anything in it.

/// [characters] of a line of an error, with the word before it below 400: what a person reads at once.
const LONGEST: usize = 390;
/// [characters] of one quotation.
const LONGEST_QUOTE: usize = 60;
/// [characters] that are kept of the end of a line that is too long: there the reason stands, and at its beginning the file.
const END: usize = 130;

/// The error with short lines: long quotations cut, then the middle of a line; nothing in it moves a terminal's cursor.
pub(super) fn brief(sentence: &str) -> String {
    // The sentence before it says the same to people.
    let sentence = &without_numbers(sentence);
    let plain = |letter: char| if letter.is_control() { ' ' } else { letter };
    let parts = sentence.split('`').enumerate().map(|(index, part)| match index % 2 {
        1 => cut(part, LONGEST_QUOTE, 0).chars().map(plain).collect(),
        _ => part.to_owned(),
    });
    let short = parts.collect::<Vec<String>>().join("`");
    let lines = short.split('\n').map(|line| cut(line, LONGEST, END).chars().map(plain).collect());
    lines.collect::<Vec<String>>().join("\n")
}

/// The error without the numbers that the system's errors have.
fn without_numbers(sentence: &str) -> String {
    const BEGIN: &str = " (os error ";
    let mut parts = sentence.split(BEGIN);
    let mut kept = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        match part.split_once(')') {
            Some((number, rest)) if number.bytes().all(|byte| byte.is_ascii_digit()) => kept.push_str(rest),
            _ => {
                kept.push_str(BEGIN);
                kept.push_str(part);
            }
        }
    }
    kept
}

/// At most `longest` characters of a text, the last `end` of them its last ones.
fn cut(text: &str, longest: usize, end: usize) -> String {
    const GAP: &str = "...";
    let count = text.chars().count();
    if count <= longest {
        return text.to_owned();
    }
    let begin: String = text.chars().take(longest - end - GAP.len()).collect();
    let rest: String = text.chars().skip(count - end).collect();
    // Between words, where they are short: half a key is none.
    let begin =
        begin.rfind(' ').filter(|at| begin.len() - at < LONGEST_QUOTE).map_or(&begin[..], |at| &begin[..=at]);
    let rest = rest.find(' ').filter(|at| *at < LONGEST_QUOTE).map_or(&rest[..], |at| &rest[at..]);
    format!("{begin}{GAP}{rest}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_short_whatever_they_quote() {
        assert_eq!(brief("a.toml: `x` is no number"), "a.toml: `x` is no number");
        assert_eq!(
            brief("a.toml: Not there (os error 2); b (os error x)"),
            "a.toml: Not there; b (os error x)"
        );
        let quoted = brief(&format!("a.toml: `{}` is no number", "é".repeat(1_000)));
        assert_eq!(quoted, format!("a.toml: `{}...` is no number", "é".repeat(57)));
        let long = brief(&format!("a.toml: {}: the reason", "(".repeat(200_000)));
        assert!(long.starts_with("a.toml: (") && long.ends_with(": the reason"), "{long}");
        assert!((LONGEST - 2 * LONGEST_QUOTE..=LONGEST).contains(&long.chars().count()), "{long}");
        let keys =
            brief(&format!("a.toml: unknown field `x`, expected one of {}", "`period_s`, ".repeat(80)));
        assert!(keys.contains("`period_s`, ... `period_s`,"), "{keys}");
        assert_eq!(brief("a\u{1b}[2J\nb `c\nd`"), "a [2J\nb `c d`");
    }
}
