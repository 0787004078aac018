//! Step after step: what `extend` makes of a model, and what a controller makes of that.

use serde_json::Value;

use super::desk::{Desk, diagnose, number, run, said};

/// What one step of a ladder leaves is what the next one begins with, and two steps lead where one with both leads.
#[test]
fn the_rungs_of_a_ladder_agree_whatever_the_order() {
    let desk = Desk::new();
    let hide = ["--hide", "gravity_pendulum:moment=0.3", "--hide", "pivot_viscous_friction:coefficient=0.05"];
    let logs = [("train.csv", 1), ("held_out.csv", 2)]
        .map(|(name, sequence)| desk.record(name, sequence, &hide).display().to_string());
    let extend = |model: &str, effects: &[&str], to: &str| {
        let to = desk.path(to).display().to_string();
        let [train, held_out] = [logs[0].as_str(), logs[1].as_str()];
        let files =
            ["--model", model, "--log", train, "--validate", held_out, "-o", &to, "--json", "--effect"];
        let output = run(&[&["extend"][..], &files, effects].concat());
        let answer: Value =
            serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", said(&output)));
        let error = |rung: &str, part: &str| number(&answer, &["error", rung, part]);
        (
            to,
            [("base", "train"), ("extended", "train"), ("extended", "validate")]
                .map(|(rung, part)| error(rung, part)),
        )
    };
    let (pendulum, first) = extend("paper", &["gravity_pendulum"], "pendulum.toml");
    let (_, second) = extend(&pendulum, &["pivot_viscous_friction"], "both.toml");
    let (_, at_once) = extend("paper", &["pivot_viscous_friction", "gravity_pendulum"], "at_once.toml");
    // The same windows, the same numbers, the noise known to a hundredth: with weights of their own they were 8 % apart.
    assert!((second[0] / first[1] - 1.0).abs() < 0.01, "{first:?}, {second:?}");
    for part in [1, 2] {
        assert!((at_once[part] / second[part] - 1.0).abs() < 0.01, "{second:?}, {at_once:?}");
    }
}

/// The circle: what was hidden is learnt from one run, and the controller that knows it is better.
#[test]
fn the_controller_with_the_extended_model_tracks_at_least_twice_as_well() {
    let desk = Desk::new();
    let hide = ["--hide", "gravity_pendulum:moment=0.3", "--hide", "pivot_viscous_friction:coefficient=0.05"];
    let (train, held_out) = (desk.record("train.csv", 1, &hide), desk.record("held_out.csv", 2, &hide));
    let (answer, _) = diagnose("paper", &train, &held_out);
    let set = |set: &Value| -> Vec<String> {
        let ids = set.as_array().into_iter().flatten().filter_map(|id| id.as_str().map(str::to_owned));
        let mut ids: Vec<String> = ids.collect();
        ids.sort_unstable();
        ids
    };
    // Beside rotors whose mean rate hardly changes their inflow damps as a viscous pivot does: both sets are reported.
    let effects = set(&answer["effects"]);
    let others = answer["alternatives"].as_array().into_iter().flatten().map(set);
    let mut sets = std::iter::once(effects.clone()).chain(others);
    assert!(sets.any(|set| set == ["gravity_pendulum", "pivot_viscous_friction"]), "{answer:#}");
    let effects: Vec<&str> = effects.iter().map(String::as_str).collect();
    let (train, held_out) = (train.display().to_string(), held_out.display().to_string());
    let better = desk.path("better.toml").display().to_string();
    let logs = ["--log", &train, "--validate", &held_out, "-o", &better];
    let output = run(&[&["extend", "--effect"][..], &effects, &logs].concat());
    assert!(output.status.success(), "{}", said(&output));
    let tracking = |model: &str| {
        let moves = "{ at_s = 3, angle_rad = 0.3, duration_s = 1.0 }, { at_s = 7, angle_rad = -0.3, duration_s = 1.5 }";
        let text =
            format!("name = \"circle\"\nmodel = \"{model}\"\n[controller.reference]\nmoves = [{moves}]\n");
        let bench = desk.write("bench.toml", &text).display().to_string();
        let arguments = ["run", "--lockstep", "--seconds", "12", "--config", &bench, "--json"];
        let output = run(&[&arguments[..], &hide].concat());
        let summary: Value =
            serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", said(&output)));
        assert_eq!(summary["state"], "armed", "{summary}");
        number(&summary, &["angle", "rms"])
    };
    let (before, after) = (tracking("paper"), tracking(&better));
    assert!(after < 0.5 * before, "rms of the angle error [rad]: {before} -> {after}");
}
