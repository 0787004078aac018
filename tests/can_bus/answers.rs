//! What `run --json` says of a run on a bus, beside its schema.

use crate::bus::Bus;
use crate::faults::{Hardware, bench};
use crate::json_schema;

#[test]
fn the_answer_of_a_run_fits_its_schema() {
    let bus = Bus::new();
    let bench = bench("answer", &bus);
    let _hardware = Hardware::start(&bench);
    let mut run = bench.start(&["run", "--arm", "--seconds", "2", "--json"]);
    assert!(run.wait().success(), "{}", run.log());
    let answer = json_schema::answer("run", run.output());
    assert!(answer["timing"]["run"].as_u64().is_some_and(|it| it > 0), "{answer:#}");
}
