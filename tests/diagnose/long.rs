//! Long logs: searched on stretches, fitted on all rows. The same is named, with the same numbers, as by a search on all rows.

use rotorbench::cancel::Cancel;
use rotorbench::diagnose::{DiagnoseConfig, Diagnosis};
use rotorbench::model::Model;
use rotorbench::screening::ScreenedLog;
use rotorbench::session::{self, Job, OpenConfig};

use super::desk::{Desk, run, said};

fn opened(desk: &Desk, name: &str, sequence: u32, hidden: &str) -> Vec<ScreenedLog> {
    let (path, sequence) = (desk.path(name), sequence.to_string());
    let place = path.display().to_string();
    let drive =
        ["experiment", "prbs", "--lockstep", "--closed-loop", "--amplitude", "0.03", "--duration", "60"];
    let own = ["--seed", &sequence, "--sequence", &sequence, "--hide", hidden, "-o", &place];
    let output = run(&[&drive[..], &own[..]].concat());
    assert!(output.status.success(), "{}", said(&output));
    session::open_all(&[path], &OpenConfig::default(), &Job::unwatched(&Cancel::default())).expect("a log")
}

fn found(train: &[ScreenedLog], validate: &[ScreenedLog], searched_rows: usize) -> Diagnosis {
    let config = DiagnoseConfig { searched_rows, ..DiagnoseConfig::default() };
    let job = Cancel::default();
    session::diagnose(&Model::paper(), train, validate, &config, &Job::unwatched(&job)).expect("an answer")
}

/// By a search on all rows and by one on a third of them, with the numbers of all.
fn the_same_is_named(seed: u32, hidden: &str, id: &str) {
    let desk = Desk::new();
    let train = opened(&desk, &format!("{id}_train.csv"), seed, hidden);
    let held_out = opened(&desk, &format!("{id}_held_out.csv"), seed + 1, hidden);
    let rows = train[0].raw().len();
    let (all, part) = (found(&train, &held_out, rows), found(&train, &held_out, rows / 3));
    assert_eq!((&part.effects, part.verdict), (&all.effects, all.verdict), "{id}");
    assert_eq!(all.effects, [id]);
    for (name, value) in &all.parameters {
        let error = value.standard_error.expect("determined");
        let other = &part.parameters[name];
        assert!((other.value - value.value).abs() < error, "{name}: {value:?} and {other:?}");
    }
    // Fits of the same rows that end within a hundred-thousandth of their cost, one from another start than the other.
    let ratio = part.error.extended.validate / all.error.extended.validate;
    assert!((ratio - 1.0).abs() < 1e-2, "{id}: {ratio}");
    assert!(all.findings.iter().all(|it| it.code != "searched_on_stretches"), "{id}");
    let said: Vec<_> = part.findings.iter().filter(|it| it.code == "searched_on_stretches").collect();
    assert_eq!(said.len(), 2, "of the log and of the held-out one");
    assert_eq!((said[0].count("rows_fitted"), said[0].count("rows_searched")), (rows, rows / 3));
    assert_eq!(said[0].numbers("from_s").len(), 2, "{}", said[0]);
}

/// `tools/test --all` runs them.
mod at_length {
    use super::*;

    #[test]
    fn a_search_on_stretches_names_the_same_and_all_rows_decide_the_numbers() {
        the_same_is_named(31, "gravity_pendulum:moment=0.3", "gravity_pendulum");
    }

    #[test]
    fn a_search_on_stretches_names_the_same_delay_and_the_same_dead_zone() {
        the_same_is_named(41, "transport_delay:delay=0.03", "transport_delay");
        the_same_is_named(51, "command_dead_zone:width=0.1", "command_dead_zone");
    }

    /// Rotors that differ by a share, and a torque that does not end: a minute near one level does not tell them apart. The search on a
    /// part may put the other one first; both are said, each with its held-out error.
    #[test]
    fn what_a_search_on_stretches_cannot_tell_apart_is_said_with_its_error() {
        let desk = Desk::new();
        let train = opened(&desk, "train.csv", 61, "actuator_mismatch");
        let held_out = opened(&desk, "held_out.csv", 62, "actuator_mismatch");
        let rows = train[0].raw().len();
        for searched in [rows, rows / 3] {
            let found = found(&train, &held_out, searched);
            let mut sets = [vec![found.effects.clone()], found.alternatives.clone()].concat();
            sets.sort();
            assert_eq!(sets, [["actuator_mismatch"], ["torque_bias"]], "{searched}");
            let [(error, unit)] = found.alternative_errors[..] else {
                panic!("an error for each: {found:?}")
            };
            let ratio = error / found.error.extended.validate;
            assert!(
                unit == "rad/s" && (0.9..1.1).contains(&ratio),
                "{searched}: {error} {unit}, ratio {ratio}"
            );
        }
    }
}
