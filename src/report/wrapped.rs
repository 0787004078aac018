//! Text in lines of a small terminal.

use std::fmt::Write as _;

/// Columns of a small terminal.
const WIDTH: usize = 80;

/// `text` in lines of at most [`WIDTH`] columns, broken between words; the first line begins with `first`, the others
/// are indented by as much.
pub(super) fn wrapped(first: &str, text: &str) -> String {
    let indent = first.chars().count();
    let mut out = first.to_owned();
    let mut column = indent;
    for word in text.split_whitespace() {
        let length = word.chars().count();
        if column > indent && column + 1 + length > WIDTH {
            let _ = write!(out, "\n{}", " ".repeat(indent));
            column = indent;
        }
        if column > indent {
            out.push(' ');
            column += 1;
        }
        out.push_str(word);
        column += length;
    }
    out.push('\n');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_is_wider_than_a_small_terminal() {
        let text = wrapped("Note: ", &"a word or two and then some more of them ".repeat(9));
        assert!(text.lines().all(|line| line.chars().count() <= WIDTH), "{text}");
        assert!(text.lines().count() > 3 && text.lines().skip(1).all(|line| line.starts_with("      ")));
        // What cannot be broken stays whole.
        assert_eq!(wrapped("  ", &"x".repeat(100)).trim(), "x".repeat(100));
    }
}
