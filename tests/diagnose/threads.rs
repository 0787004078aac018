//! `--threads`: the same answer to the last digit, however many there are.

use super::desk::{Desk, run, said};

#[test]
fn no_answer_depends_on_the_number_of_threads() {
    all_are_the_same(&["5"]);
}

fn all_are_the_same(others: &[&str]) {
    let desk = Desk::new();
    let log = desk.record("log.csv", 1, &["--hide", "gravity_pendulum:moment=0.4"]).display().to_string();
    let model = desk.path("better.toml").display().to_string();
    let commands: [&[&str]; 4] = [
        &["compare", "--json"],
        &["identify", "--json"],
        &["diagnose", "--json"],
        &["extend", "--effect", "gravity_pendulum", "--json", "-o", &model, "--force"],
    ];
    commands.iter().for_each(|command| is_the_same(&[command, &["--log", &log][..]].concat(), others));
    let refused = run(&["compare", "--log", &log, "--threads", "0"]);
    assert_eq!(refused.status.code(), Some(2), "{}", said(&refused));
}

/// The same bytes with one thread and with so many others.
fn is_the_same(command: &[&str], others: &[&str]) {
    let answer = |threads: &str| {
        let output = run(&[command, &["--threads", threads]].concat());
        assert!(!output.stdout.is_empty(), "{command:?}: {}", said(&output));
        output.stdout
    };
    let one = answer("1");
    assert!(others.iter().all(|threads| answer(threads) == one), "{command:?}");
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    #[test]
    fn no_answer_depends_on_whether_there_are_two_threads() {
        all_are_the_same(&["2"]);
    }

    /// Of a log that is long enough for its fits, its columns and its rows to be spread over threads, too.
    #[test]
    fn no_answer_about_a_long_log_depends_on_the_number_of_threads() {
        let desk = Desk::new();
        let bench = "name = \"fast\"\nperiod_s = 0.001\n[guard]\nslew_per_s = 100\n";
        let bench = desk.write("bench.toml", bench).display().to_string();
        let (log, model) =
            (desk.path("log.csv").display().to_string(), desk.path("better.toml").display().to_string());
        let drive =
            ["experiment", "prbs", "--lockstep", "--closed-loop", "--amplitude", "0.03", "--config", &bench];
        // Two readings of 27,000 rows each: more residuals than `parallel_residuals`.
        let own = ["--duration", "27", "--hide", "gravity_pendulum:moment=0.4", "-o", &log];
        let output = run(&[&drive[..], &own[..]].concat());
        assert!(output.status.success(), "{}", said(&output));
        is_the_same(&["import", &log, "--json"], &["2", "5"]);
        is_the_same(&["compare", "--log", &log, "--json"], &["2", "5"]);
        is_the_same(&["identify", "--log", &log, "--json"], &["2", "5"]);
        let extend =
            ["extend", "--effect", "gravity_pendulum", "--log", &log, "--json", "--force", "-o", &model];
        is_the_same(&extend, &["2", "5"]);
    }
}
