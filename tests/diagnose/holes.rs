//! A logger that stalls when a command steps up: rows that are missing there must not decide what is found.

use std::fmt::Write;

use super::dead_time::{Draws, STEP, steady};
use super::desk::{Desk, diagnose, has_code};

/// [s] from a command to its effect.
const DELAY: f64 = 0.028;
/// [s] from the row that carries an up-step to the hole, and the hole.
const STALL: (f64, f64) = (0.01, 0.09);
/// Steps of the simulation from row to row, which commands come with.
const ROW: usize = 18;

/// A command, when its row says that it came, and when it took effect. The logger writes the row of an up-step, stalls, and
/// hands the command on at some time until then.
struct Sent {
    command: f64,
    written: f64,
    acts: f64,
    stalls: bool,
}

fn staircase(draws: &mut Draws) -> Vec<Sent> {
    let (mut rows, mut command) = (0, 0.45);
    let next = |_| {
        let time = STEP * (ROW * rows) as f64;
        let before = command;
        while f64::abs(command - before) < 0.06 {
            command = 0.5 + 0.2 * draws.next();
        }
        let stalls = command > before;
        let late = if stalls { STALL.1 * 0.5 * (1.0 + draws.next()) } else { 0.0 };
        let sent = Sent { command, written: time, acts: time + late + DELAY, stalls };
        rows += (165.0 + 33.0 * draws.next()) as usize;
        sent
    };
    (0..24).map(next).collect()
}

/// The paper's rotor under a staircase.
fn stand(seed: u64) -> String {
    let mut draws = Draws(seed);
    let sent = staircase(&mut draws);
    let end = sent.last().map_or(0.0, |last| last.written + 1.0);
    let mut text = "time_s,command_1,battery_voltage_v,propeller_rate_1_rad_s\n".to_owned();
    let mut rate = steady(sent[0].command);
    let share = -(-16.0 * STEP).exp_m1();
    for step in 0..(end / STEP) as usize {
        let time = STEP * step as f64;
        let now = |acts: fn(&Sent) -> f64| sent.iter().rev().find(|it| acts(it) <= time).unwrap_or(&sent[0]);
        let row = now(|it| it.written);
        let since = time - row.written - STALL.0;
        if step % ROW == 0 && !(row.stalls && (0.0..STALL.1).contains(&since)) {
            writeln!(text, "{time:.4},{},12.4,{:.3}", row.command, rate + draws.noise(1.0))
                .expect("a string");
        }
        rate += share * (steady(now(|it| it.acts).command) - rate);
    }
    text
}

/// Taken at their word, such rows are explained by half with an asymmetric pole that is not there.
#[test]
fn holes_right_behind_up_steps_hide_no_delay_and_invent_nothing() {
    let desk = Desk::new();
    for seed in [1, 3] {
        let train = desk.write("train.csv", &stand(seed));
        let held_out = desk.write("held_out.csv", &stand(seed + 1));
        let (answer, _) = diagnose("paper", &train, &held_out);
        assert_eq!(answer["effects"], serde_json::json!(["transport_delay"]), "{answer}");
        assert_eq!(answer["verdict"], "missing_effect", "{}", answer["warnings"]);
        // The down-steps alone tell it, from rows 9 ms apart.
        let found = answer["parameters"]["transport_delay.delay"]["value"].as_f64().expect("a number");
        assert!((found - DELAY).abs() < 1e-3, "{found}");
        let findings = answer["findings"].as_array().expect("a list");
        let hidden = findings.iter().find(|it| it["code"] == "transient_behind_hole").expect("said");
        assert!(hidden["rows"].as_u64() > Some(100), "{hidden}");
        // No load cell and no body says that it is the rotor that is late.
        assert!(findings.iter().any(|it| it["code"] == "delay_or_late_reading"), "{findings:?}");
    }
}

/// Levels of a stand, each 20 s behind the one before and without the way to it; each a little off the curve, and drifting a little: a
/// pole near zero would leave every level where its first reading is, and effects would explain what that gets wrong.
fn levels(seed: u64) -> String {
    let mut draws = Draws(seed);
    let mut text = "time_s,command_1,battery_voltage_v,propeller_rate_1_rad_s\n".to_owned();
    for level in 0..20_u32 {
        let command = 0.3 + 0.02 * f64::from(level * 7 % 20);
        let off = draws.noise(6.0);
        for row in 0..200 {
            let since = 0.026 * f64::from(row);
            let rate = steady(command) + off - 0.8 * since + draws.noise(2.5);
            writeln!(text, "{:.3},{command:.2},12.4,{rate:.2}", 25.0 * f64::from(level) + since)
                .expect("a string");
        }
    }
    text
}

#[test]
fn levels_at_rest_show_no_pole_and_nothing_of_the_way_between_them() {
    let desk = Desk::new();
    let logs = [3, 4].map(|seed| desk.write(&format!("levels{seed}.csv"), &levels(seed)));
    let (answer, _) = diagnose("paper", &logs[0], &logs[1]);
    assert!(has_code(&answer, "no_transients"), "{answer}");
    let changed = answer["changed_parameters"].as_array().expect("a list");
    assert!(changed.iter().all(|it| it["name"] != "pole"), "{changed:?}");
    let candidates = answer["candidates"].as_array().expect("a list");
    for effect in ["asymmetric_pole", "speed_dependent_pole", "telemetry_lag", "transport_delay"] {
        let candidate = candidates.iter().find(|it| it["effect"] == effect).expect("a candidate");
        assert_eq!(candidate["refusal"]["code"], "no_transients", "{candidate}");
    }
}
