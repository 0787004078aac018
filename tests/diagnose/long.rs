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

#[test]
fn a_search_on_stretches_names_the_same_and_all_rows_decide_the_numbers() {
    let desk = Desk::new();
    let mut with_alternatives = 0;
    for (seed, hidden, id) in [
        (31, "gravity_pendulum:moment=0.3", "gravity_pendulum"),
        (41, "transport_delay:delay=0.03", "transport_delay"),
        (51, "command_dead_zone:width=0.1", "command_dead_zone"),
    ] {
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
        // What cannot be told from it was judged by the search, each with its error.
        assert_eq!(part.alternatives.len(), part.alternative_errors.len(), "{id}");
        with_alternatives += usize::from(!part.alternatives.is_empty());
        assert!(all.findings.iter().all(|it| it.code != "searched_on_stretches"), "{id}");
        let said: Vec<_> = part.findings.iter().filter(|it| it.code == "searched_on_stretches").collect();
        assert_eq!(said.len(), 2, "of the log and of the held-out one");
        assert_eq!((said[0].count("rows_fitted"), said[0].count("rows_searched")), (rows, rows / 3));
        assert_eq!(said[0].numbers("from_s").len(), 2, "{}", said[0]);
    }
    assert!(with_alternatives > 0, "one of them has another that does as well");
}
