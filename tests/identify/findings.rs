//! Every finding of the room has a sentence.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use rotorbench::report::findings::sentence;
use rotorbench::screening::Finding;

use crate::sources::sources;

/// What a code stands behind in the source.
const BEFORE: [&str; 7] = ["Finding::new(", ".finding(", "found(", "of(", "lacks(STEP, ", "code: ", "=> "];

/// The codes that a source makes findings of.
fn codes(text: &str) -> BTreeSet<&str> {
    let mut codes = BTreeSet::new();
    for before in BEFORE {
        for (at, _) in text.match_indices(before) {
            let literal = text[at + before.len()..].trim_start().strip_prefix('"');
            let Some((code, _)) = literal.and_then(|rest| rest.split_once('"')) else { continue };
            if code.contains('_') && code.chars().all(|letter| letter.is_ascii_lowercase() || letter == '_') {
                codes.insert(code);
            }
        }
    }
    codes
}

#[test]
fn every_code_has_a_sentence() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/identify");
    let text: String =
        sources(&root).iter().map(|file| fs::read_to_string(file).expect("readable")).collect();
    let codes = codes(&text);
    assert!(codes.len() > 60, "the walk found them: {codes:?}");
    for code in codes {
        let finding = Finding::new(String::leak(code.to_owned()), "");
        let text = sentence(&finding);
        assert!(text.contains(' ') && text.trim() != code, "`{code}` has no sentence: {text}");
    }
}
