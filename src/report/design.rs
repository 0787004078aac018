//! What `design` says: its answer, notes and proposals in words.

mod answer;
mod page;

use std::fmt::Write as _;

pub use answer::Design;
pub use page::{page, tables};

/// The answer as text, for a terminal.
#[must_use]
pub fn text(design: &Design) -> String {
    let mut text = String::new();
    tables(design).iter().for_each(|table| text += &format!("{}\n", table.text()));
    let said = [
        ("refused", &design.refusal),
        ("note", &design.note),
        ("warning", &design.warning),
        ("advice", &design.advice),
    ];
    for (what, sentence) in said {
        if let Some(sentence) = sentence {
            let _ = writeln!(text, "{what}: {sentence}");
        }
    }
    text
}

/// That the answer is of another controller than the bench has.
#[must_use]
pub fn pid_on_an_emc_bench() -> String {
    "--pid-margins makes a PID, and the bench's own controller is EMC; --controller pid says that it is meant"
        .to_owned()
}
