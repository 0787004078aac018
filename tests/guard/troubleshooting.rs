//! Who meets a cause finds its row in the guide.

use rotorbench::guard::Cause;

/// What is no trouble: nothing has happened, or it is as it should be.
const FINE: [Cause; 6] = [
    Cause::None,
    Cause::OperatorArm,
    Cause::OperatorDisarm,
    Cause::OperatorStop,
    Cause::ChecksPassed,
    Cause::Recovered,
];

#[test]
fn every_cause_has_its_row_in_the_guide() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/guide/troubleshooting.md");
    let page = std::fs::read_to_string(page).expect("the page is there");
    let causes = Cause::ALL.map(|(cause, ..)| cause).into_iter().filter(|cause| !FINE.contains(cause));
    let missing: Vec<String> =
        causes.map(|cause| format!("| `{cause}` |")).filter(|row| !page.contains(row)).collect();
    assert!(missing.is_empty(), "no row begins with {missing:#?}");
}
