//! What is hidden is found, added, and the error falls; where nothing is, nothing is named.

use std::fs;
use std::path::Path;

use serde_json::Value;

use super::desk::{Desk, diagnose, finding, has_code, number, refused, run, said, said_out};

#[test]
fn a_hidden_pendulum_is_named_added_and_the_error_falls_to_the_noise() {
    let desk = Desk::new();
    let hide = ["--hide", "gravity_pendulum:moment=0.3"];
    let (train, held_out) = (desk.record("train.csv", 1, &hide), desk.record("held_out.csv", 2, &hide));
    let (answer, code) = diagnose("paper", &train, &held_out);
    assert_eq!(code, Some(1), "something is wanting");
    assert_eq!(answer["verdict"], "missing_effect");
    assert_eq!(answer["effects"], serde_json::json!(["gravity_pendulum"]));
    let moment = &answer["parameters"]["gravity_pendulum.moment"];
    let off = (number(moment, &["value"]) - 0.3).abs();
    // The promise: within 10 % or three standard errors.
    assert!(off < 0.03 || off < 3.0 * number(moment, &["standard_error"]), "{moment}");
    let floor = number(&answer, &["error", "noise_floor"]);
    let (before, after) = (
        number(&answer, &["error", "recalibrated", "validate"]),
        number(&answer, &["error", "extended", "validate"]),
    );
    unnamed_say_why(&answer);
    // Within 10 % of the noise is the promise; that the base fails plainly gives it a meaning.
    assert!(before > 3.0 * floor && after < 1.1 * floor, "{before} -> {after}, noise {floor}");

    let better = desk.path("better.toml").display().to_string();
    let (train, held_out) = (train.display().to_string(), held_out.display().to_string());
    let arguments = ["extend", "--model", "paper", "--effect", "gravity_pendulum", "--log", &train];
    let output = run(&[&arguments[..], &["--validate", &held_out, "-o", &better]].concat());
    assert!(output.status.success(), "{}", said(&output));
    let (answer, code) = diagnose(&better, Path::new(&train), Path::new(&held_out));
    assert_eq!((&answer["verdict"], code), (&"adequate".into(), Some(0)), "{answer}");
    let back = desk.path("back.toml").display().to_string();
    let output = run(&["extend", "--model", &better, "--step-back", "-o", &back]);
    assert!(output.status.success(), "{}", said(&output));
    let text = fs::read_to_string(&back).expect("written");
    assert!(!text.contains("gravity_pendulum"), "{text}");
}

/// Each candidate that was tried and not named says which condition it failed, those with a small p-value among them.
fn unnamed_say_why(answer: &Value) {
    let candidates = answer["candidates"].as_array().expect("a list");
    let is_named =
        |it: &Value| answer["effects"].as_array().is_some_and(|named| named.contains(&it["effect"]));
    let tried = |it: &&Value| it["validate"].is_number() && it["refusal"].is_null();
    for it in candidates {
        assert_eq!(it["not_named"]["code"].is_string(), tried(&it) && !is_named(it), "{it}");
    }
    let is_significant =
        |it: &&Value| !is_named(it) && it["chance"].as_f64().is_some_and(|p_value| p_value <= 0.05);
    let significant: Vec<&Value> = candidates.iter().filter(tried).filter(is_significant).collect();
    assert!(!significant.is_empty(), "{candidates:#?}");
    assert!(significant.iter().all(|it| it["not_named"]["code"] != "chance"), "{significant:#?}");
}

#[test]
fn where_nothing_is_hidden_nothing_is_named() {
    let desk = Desk::new();
    let (answer, code) = diagnose("paper", &desk.record("a.csv", 3, &[]), &desk.record("b.csv", 4, &[]));
    assert_eq!((&answer["verdict"], code), (&"adequate".into(), Some(0)), "{answer}");
    assert_eq!(answer["effects"], serde_json::json!([]));
}

/// The page that shows how a user writes an effect.
fn guide() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide/diagnose.md")
}

/// The guide's own lines, taken from the guide: a law of the user's in the plant, and in the model's list.
#[test]
fn an_effect_of_the_users_own_competes_with_the_catalogue() {
    let guide = fs::read_to_string(guide()).expect("the guide is there");
    let ten_lines: String = guide
        .lines()
        .skip_while(|line| !line.contains("[[user_effects]]"))
        .take_while(|line| !line.starts_with("```"))
        .map(|line| format!("{line}\n"))
        .collect();
    assert!(ten_lines.contains("creaking_pivot"), "the guide has lost its example");
    let desk = Desk::new();
    let paper = desk.path("paper.toml").display().to_string();
    let bench_log = desk.record("plain.csv", 1, &[]).display().to_string();
    let arguments =
        ["extend", "--model", "paper", "--effect", "torque_bias", "--log", &bench_log, "-o", &paper];
    // The error does not fall, which is exit 1, and a model file all the same.
    assert_eq!(run(&arguments).status.code(), Some(1), "a model file to start from");
    let back = desk.path("back.toml").display().to_string();
    assert!(run(&["extend", "--model", &paper, "--step-back", "-o", &back]).status.success());
    let base = fs::read_to_string(&back).expect("a model file");
    let base = format!("{base}\n{ten_lines}");
    let mine = desk.write("mine.toml", &base).display().to_string();
    let hidden = "[[effects]]\nid = \"creaking_pivot\"\nparameters = { k = 0.06 }\n";
    let plant = desk.write("plant.toml", &format!("{base}\n{hidden}")).display().to_string();
    let (train, held_out) = (
        desk.record("train.csv", 5, &["--model", &plant]),
        desk.record("held_out.csv", 6, &["--model", &plant]),
    );
    let (answer, _) = diagnose(&mine, &train, &held_out);
    assert_eq!(answer["effects"], serde_json::json!(["creaking_pivot"]), "{}", answer["candidates"]);
    let k = &answer["parameters"]["creaking_pivot.k"];
    let off = (number(k, &["value"]) - 0.06).abs();
    assert!(off < 0.006 || off < 3.0 * number(k, &["standard_error"]), "{k}");
    // Its card is what the model file says of it, on the screen and on the page.
    let with_words = base.replace("site = \"torque\"", "meaning = \"The pivot creaks.\"\nsite = \"torque\"");
    let mine = desk.write("words.toml", &with_words).display().to_string();
    let (log, validate) = (train.display().to_string(), held_out.display().to_string());
    let [better, page] = ["better.toml", "page.html"].map(|name| desk.path(name).display().to_string());
    let logs = ["--log", &log, "--validate", &validate, "-o", &better, "--report", &page];
    let text =
        said_out(&run(&[&["extend", "--model", &mine, "--effect", "creaking_pivot"][..], &logs].concat()));
    let page = fs::read_to_string(&page).expect("a page");
    for words in ["-k*body_rate*abs(body_rate)^0.5", "The pivot creaks."] {
        assert!(text.contains(words) && page.contains(words), "{words}: {text}");
    }
}

/// A rotor is identified with the body held still, and its log has the body's columns, too. With them as a body, its inertia
/// came out as 320 kg m², ten thousand times the model's.
#[test]
fn a_body_that_is_held_says_nothing_of_its_inertia() {
    let desk = Desk::new();
    let log = desk.path("held.csv").display().to_string();
    let recorded = run(&["experiment", "prbs", "--lockstep", "--duration", "30", "-o", &log]);
    assert!(recorded.status.success(), "{}", said(&recorded));
    let output = run(&["diagnose", "--log", &log, "--json"]);
    let answer: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((output.status.code(), answer["verdict"].as_str()), (Some(0), Some("adequate")), "{answer:#}");
    assert!(has_code(&answer, "body_held_still"), "{}", answer["findings"]);
    let model = desk.path("late.toml").display().to_string();
    run(&["extend", "--effect", "transport_delay", "--log", &log, "-o", &model]);
    let text = fs::read_to_string(&model).expect("a model");
    assert!(text.contains("inertia = 0.032\n"), "{text}");
    let swinging = ["extend", "--effect", "gravity_pendulum", "--log", &log, "-o", &model, "--force"];
    refused(&swinging, &["the body was held still in "]);
}

/// A rotor's exact answer to steps, without noise: the paper's rotor, or one with a limit of the command.
fn exact_rotor(limit: f64, seed: u32) -> String {
    let mut text = "time_s,command_1,battery_voltage_v,propeller_rate_1_rad_s\n".to_owned();
    let (mut state, mut command, mut rate) = (seed, 0.5, f64::NAN);
    for row in 0..3000 {
        if row % 25 == 0 {
            // A linear congruential generator: any spread of levels will do.
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            command = 0.35 + 0.3 * f64::from(state >> 16) / 65_536.0;
        }
        let reached = f64::min(command, limit);
        let steady = 1124.5 * reached + 447.1 * reached * reached - 40.0 * (12.6 - 12.3);
        rate = if rate.is_nan() { steady } else { rate };
        text += &format!("{},{command},12.3,{rate}\n", 0.02 * f64::from(row));
        rate = steady + (rate - steady) * f64::exp(-16.0 * 0.02);
    }
    text
}

/// Without noise nothing divides by zero: a model that is right is adequate, and one effect is one effect.
#[test]
fn data_without_noise_are_judged_honestly() {
    let desk = Desk::new();
    for (limit, verdict, effects) in
        [(9.0, "adequate", vec![]), (0.55, "missing_effect", vec!["command_saturation"])]
    {
        let train = desk.write("train.csv", &exact_rotor(limit, 3));
        let validate = desk.write("validate.csv", &exact_rotor(limit, 4));
        let (answer, _) = diagnose("paper", &train, &validate);
        assert_eq!(answer["verdict"], verdict, "{answer}");
        assert_eq!(answer["effects"], serde_json::json!(effects), "{answer}");
        assert!(answer["error"]["extended"]["validate"].is_number(), "{answer}");
    }
    let log = desk.write("exact.csv", &exact_rotor(9.0, 3)).display().to_string();
    assert_eq!(run(&["compare", "--log", &log]).status.code(), Some(0));
}

#[test]
fn a_log_that_is_fitted_and_judged_is_told_and_a_step_back_answers_in_json() {
    let desk = Desk::new();
    let log = desk.write("log.csv", &exact_rotor(0.55, 3));
    let (answer, _) = diagnose("paper", &log, &log);
    assert!(has_code(&answer, "log_fitted_and_validated"), "{answer}");
    let (log, model) = (log.display().to_string(), desk.path("one.toml").display().to_string());
    let extend = ["extend", "--effect", "command_saturation", "--log", &log, "-o", &model];
    assert_eq!(run(&extend).status.code(), Some(0));
    let back = desk.path("back.toml").display().to_string();
    let undone = run(&["extend", "--model", &model, "--step-back", "-o", &back, "--json"]);
    let undone: Value = serde_json::from_slice(&undone.stdout).expect("JSON");
    assert_eq!(undone["undone"], serde_json::json!(["command_saturation"]));
    assert_eq!(undone["model"]["ladder"], Value::Null, "an empty ladder is left out");
}

/// A model with another body than the bench has: the base's number is reported, taken over by `extend`, and enough then.
#[test]
fn a_number_that_has_changed_is_taken_over_and_the_step_can_be_undone() {
    let desk = Desk::new();
    let template = said_out(&run(&["effects", "--template"]));
    let paper = template.split_once("[[user_effects]]").expect("an effect").0;
    let text = paper.replace("inertia = 0.032", "inertia = 0.040");
    let heavy = desk.write("heavy.toml", &text).display().to_string();
    let (train, held_out) = (desk.record("train.csv", 1, &[]), desk.record("held_out.csv", 2, &[]));
    let (answer, _) = diagnose(&heavy, &train, &held_out);
    assert_eq!(answer["verdict"], "parameters_changed", "{answer}");
    let (log, validate) = (train.display().to_string(), held_out.display().to_string());
    let mended = desk.path("mended.toml").display().to_string();
    let take_over = |model: &str, output: &str| {
        run(&[
            "extend",
            "--model",
            model,
            "--recalibrate",
            "--log",
            &log,
            "--validate",
            &validate,
            "-o",
            output,
        ])
    };
    let output = take_over(&heavy, &mended);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let text = said_out(&output);
    assert!(text.contains("inertia (J): 0.04") && text.contains("its own numbers refitted"), "{text}");
    let (answer, code) = diagnose(&mended, &train, &held_out);
    assert_eq!((&answer["verdict"], code), (&"adequate".into(), Some(0)), "{answer}");
    let again = desk.path("again.toml").display().to_string();
    // Nothing is left to change: nothing is written, and the error is at the floor.
    assert_eq!(take_over(&mended, &again).status.code(), Some(0));
    assert!(!Path::new(&again).exists());
    let back = desk.path("back.toml").display().to_string();
    let output = run(&["extend", "--model", &mended, "--step-back", "-o", &back]);
    assert!(output.status.success(), "{}", said(&output));
    assert!(fs::read_to_string(&back).expect("written").contains("inertia = 0.04"));
}

/// The guide's way to an effect of one's own: the template is a model file, and its effect competes.
#[test]
fn the_template_is_a_model_file_with_an_effect_of_ones_own() {
    let desk = Desk::new();
    let template = said_out(&run(&["effects", "--template"]));
    let guide = fs::read_to_string(guide()).expect("the guide is there");
    let own = template.split_once("[[user_effects]]").expect("an effect").1;
    for line in own.lines().filter(|line| !line.is_empty()) {
        assert!(guide.contains(line), "the guide lacks: {line}");
    }
    let mine = desk.write("mine.toml", &template).display().to_string();
    assert!(said_out(&run(&["effects", "--model", &mine])).contains("creaking_pivot"));
    let log = desk.record("log.csv", 1, &[]);
    let root = own.replace("-k*body_rate*abs(body_rate)^0.5", "-k*sqrt(body_rate)");
    let root = desk.write("root.toml", &template.replace(own, &root)).display().to_string();
    let log = log.display().to_string();
    let output = desk.path("no.toml").display().to_string();
    let parts = ["creaking_pivot", "not a number", "log.csv", "body_rate = -"];
    refused(
        &["extend", "--model", &root, "--effect", "creaking_pivot", "--log", &log, "-o", &output],
        &parts,
    );
    assert!(!desk.path("no.toml").exists());
}

/// What happens in one log only, here a hit on the body, is no effect; nor is it passed over.
#[test]
fn what_only_the_training_log_shows_is_told() {
    let desk = Desk::new();
    let hit = ["--impulse", "10:0.05:0.6"];
    let (train, held_out) = (desk.record("train.csv", 1, &hit), desk.record("held_out.csv", 2, &[]));
    let (answer, _) = diagnose("paper", &train, &held_out);
    assert_eq!(answer["effects"], serde_json::json!([]), "{}", answer["ladder"]);
    assert!(has_code(&answer, "only_in_training"), "{answer:#}");
    assert_eq!(answer["verdict"], "unknown", "the model does not explain the hit");
}

/// Where the base's refitted numbers reach the noise as well, the effect that was hidden has made the error fall all the same.
#[test]
fn an_effect_that_reaches_the_noise_has_made_the_error_fall() {
    let desk = Desk::new();
    let hide = ["--hide", "quadratic_rotor_drag:coefficient=0.0005"];
    let log = desk.record("log.csv", 1, &hide).display().to_string();
    let model = desk.path("model.toml").display().to_string();
    let extend = ["extend", "--effect", "quadratic_rotor_drag", "--log", &log, "-o", &model];
    let output = run(&extend);
    assert_eq!(output.status.code(), Some(0), "{}", said_out(&output));
}

/// Nobody measured the rotors: at the log's beginning they are not where their commands are.
#[test]
fn a_body_driven_by_commands_is_judged_once_the_rotors_have_forgotten_where_they_began() {
    let desk = Desk::new();
    let log = |name: &str, seed| {
        let whole = desk.record(&format!("whole_{name}"), seed, &[]);
        desk.changed(&whole, name, 1e9, |name| !name.starts_with("propeller_rate"), |_, value| value)
    };
    let (answer, _) = diagnose("paper", &log("train.csv", 1), &log("held_out.csv", 2));
    assert_eq!(answer["verdict"], "adequate", "{}", answer["error"]);
}

/// `tools/test --all` runs them.
mod at_length {
    use super::*;

    /// Seven seconds held out are seventeen windows of the body: with fifteen shifts no chance is below a sixteenth. The signs of
    /// the windows tell more.
    #[test]
    fn a_short_log_held_out_is_enough_for_a_strong_effect() {
        let desk = Desk::new();
        let hide = ["--hide", "gravity_pendulum:moment=0.3"];
        let train = desk.record("train.csv", 1, &hide);
        let held_out = desk.changed(
            &desk.record("whole.csv", 2, &hide),
            "held_out.csv",
            7.0,
            |_| true,
            |_, value| value,
        );
        let (answer, _) = diagnose("paper", &train, &held_out);
        assert_eq!(answer["effects"], serde_json::json!(["gravity_pendulum"]), "{}", answer["candidates"]);
        assert_eq!(answer["verdict"], "missing_effect");
        let candidates = answer["candidates"].as_array().expect("candidates");
        let pendulum = candidates.iter().find(|it| it["effect"] == "gravity_pendulum").expect("a candidate");
        assert!(pendulum["chance"].as_f64().expect("a number") <= 0.02, "{pendulum}");
    }

    /// A gyro that is mounted the other way round: all the inertia in the world is the best that its torque can be made of, and yet it
    /// is not held. It was reported as that, and nothing was missing.
    #[test]
    fn a_body_that_turns_against_its_torque_is_not_one_that_is_held() {
        let desk = Desk::new();
        let turned = |name: &str, seed: u32| {
            let bench_log = desk.record(&format!("as-{name}"), seed, &[]);
            let sign = |name: &str, value: f64| if name == "body_rate_rad_s" { -value } else { value };
            desk.changed(&bench_log, name, f64::INFINITY, |name| name != "body_angle_rad", sign)
        };
        let (answer, code) = diagnose("paper", &turned("train.csv", 1), &turned("held-out.csv", 2));
        assert_eq!((code, answer["verdict"].as_str()), (Some(1), Some("unknown")), "{answer:#}");
        assert!(has_code(&answer, "turns_against_torque"), "{}", answer["findings"]);
        let [train, held_out] =
            ["train.csv", "held-out.csv"].map(|name| desk.path(name).display().to_string());
        let story = said_out(&run(&["diagnose", "--log", &train, "--validate", &held_out]));
        let commands: Vec<&str> = story.lines().filter(|line| line.contains("rotorbench extend")).collect();
        assert!(commands.is_empty(), "nothing is to be added before the sign is known: {commands:?}");
    }

    /// Two rotors of which one turns a hundredth faster: heat, whose start each run may choose, would explain it.
    #[test]
    fn rotors_that_are_not_alike_are_no_effect_and_told() {
        let desk = Desk::new();
        let log = |name: &str, seed| {
            let whole = desk.record(&format!("whole_{name}"), seed, &[]);
            let faster =
                |name: &str, value| if name == "propeller_rate_2_rad_s" { 1.01 * value } else { value };
            desk.changed(&whole, name, 1e9, |name| !name.starts_with("body"), faster)
        };
        let (answer, _) = diagnose("paper", &log("train.csv", 1), &log("held_out.csv", 2));
        assert_eq!(
            (&answer["verdict"], &answer["effects"]),
            (&"unknown".into(), &serde_json::json!([])),
            "{answer:#}"
        );
        let differ = finding(&answer, "rotors_differ");
        let rotors = ["faster_rotor", "slower_rotor"].map(|rotor| differ["evidence"][rotor].as_u64());
        assert_eq!(rotors, [Some(2), Some(1)], "{differ}");
        let share = differ["evidence"]["share"].as_f64().expect("a share");
        assert!((0.0095..0.0105).contains(&share), "{share}");
    }

    /// What the search finds by looking at every value, and what only the body can decide.
    #[test]
    fn a_grid_and_the_lags_of_rotor_torque_and_sensor_are_told_apart() {
        let desk = Desk::new();
        for (seed, hidden, parameter) in [
            (11, "command_quantization", "step=0.012"),
            (13, "telemetry_lag", "pole=40"),
            (15, "second_order_lag", "pole=40"),
            // Faster than the samples, and later than they are apart in a log whose first command differs from the next.
            (17, "rotor_lag", "pole=150"),
            (19, "transport_delay", "delay=0.03"),
        ] {
            let hide = format!("{hidden}:{parameter}");
            let log =
                |name: &str, seed| desk.record(&format!("{hidden}_{name}.csv"), seed, &["--hide", &hide]);
            let (answer, _) = diagnose("paper", &log("train", seed), &log("held_out", seed + 1));
            assert_eq!(answer["effects"], serde_json::json!([hidden]), "{}", answer["ladder"]);
            let (name, truth) = parameter.split_once('=').expect("name=value");
            let truth: f64 = truth.parse().expect("a number");
            let found = &answer["parameters"][&format!("{hidden}.{name}")];
            let off = (number(found, &["value"]) - truth).abs();
            assert!(off < 0.1 * truth || off < 3.0 * number(found, &["standard_error"]), "{hidden}: {found}");
        }
    }
}
