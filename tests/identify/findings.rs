//! Every finding of the room has a sentence.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use rotorbench::identify::{IdentifySettings, identify};
use rotorbench::report::findings::sentence;
use rotorbench::screening::Finding;

use super::bench::{bench, prbs, run};
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

/// A rotor that slows down with time while its battery hardly falls: the fit calls all of it the battery's, and k_V comes out as
/// many hundreds.
#[test]
fn a_voltage_gain_that_no_motor_has_is_said() {
    const RATE: &str = "propeller_rate_1_rad_s";
    let honest = run(&bench(5), prbs(120.0, 3), "honest.csv");
    let rates = honest.column(RATE).expect("measured").iter().zip(honest.time());
    let drifted = rates.map(|(rate, time)| rate - 0.5 * time).collect();
    let mut drifting = honest.clone();
    drifting.replace(RATE, drifted).expect("as long");
    for (log, is_said) in [(honest, false), (drifting, true)] {
        let found = identify(&[log.into()], &[], &IdentifySettings::default()).expect("identified");
        let said = found.findings.iter().any(|it| it.code == "voltage_gain_impossible");
        assert_eq!(said, is_said, "k_V = {}: {:?}", found.actuator.voltage_gain, found.findings);
        // It bends neither pole nor curve: the model goes without.
        let gain = found.actuator.voltage_gain;
        assert!(if is_said { gain == 0.0 } else { (gain - 40.0).abs() < 20.0 }, "{gain}");
        assert!((found.actuator.pole - 16.0).abs() < 2.0, "{}", found.actuator.pole);
    }
}
