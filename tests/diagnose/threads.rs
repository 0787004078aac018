//! `--threads`: the same answer to the last digit, however many there are.

use super::desk::{Desk, run, said};

#[test]
fn no_answer_depends_on_the_number_of_threads() {
    let desk = Desk::new();
    let log = desk.record("log.csv", 1, &["--hide", "gravity_pendulum:moment=0.4"]).display().to_string();
    let model = desk.path("better.toml").display().to_string();
    let commands: [&[&str]; 4] = [
        &["compare", "--json"],
        &["identify", "--json"],
        &["diagnose", "--json"],
        &["extend", "--effect", "gravity_pendulum", "--json", "-o", &model, "--force"],
    ];
    for command in commands {
        let answer = |threads: &str| {
            let output = run(&[command, &["--log", &log, "--threads", threads]].concat());
            assert!(!output.stdout.is_empty(), "{command:?}: {}", said(&output));
            output.stdout
        };
        let one = answer("1");
        assert!(["2", "5"].iter().all(|threads| answer(threads) == one), "{command:?}");
    }
    let refused = run(&["compare", "--log", &log, "--threads", "0"]);
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
}
