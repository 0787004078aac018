//! A law that no catalogue has is found with its place, its form and its numbers, and its file is a model like any other; where the
//! catalogue has the answer, or nothing is missing, there is no law.

use std::fs;
use std::path::Path;

use rotorbench::model::Model;
use serde_json::Value;

use super::desk::{Desk, diagnose, number, run, said, said_out};

/// Teeth in the pivot.
const TEETH: &str = r#"
[[user_effects]]
id = "teeth"
site = "torque"
expression = "k*sin(n*body_angle)"
[[user_effects.parameters]]
name = "k"
unit = "N m"
start = 0.04
lower = -1.0
upper = 1.0
[[user_effects.parameters]]
name = "n"
unit = "1/rad"
start = 30.0
lower = 1.0
upper = 100.0
[[effects]]
id = "teeth"
parameters = { k = 0.04, n = 30.0 }
"#;

/// The paper's model as a file.
fn paper(desk: &Desk) -> String {
    let log = desk.record("plain.csv", 1, &[]).display().to_string();
    let [extended, back] = ["extended.toml", "paper.toml"].map(|name| desk.path(name).display().to_string());
    run(&["extend", "--effect", "torque_bias", "--log", &log, "-o", &extended]);
    assert!(run(&["extend", "--model", &extended, "--step-back", "-o", &back]).status.success());
    fs::read_to_string(&back).expect("a model file")
}

fn discover(log: &Path, validate: &Path, more: &[&str]) -> (Value, Option<i32>) {
    let (log, validate) = (log.display().to_string(), validate.display().to_string());
    let arguments = ["discover", "--model", "paper", "--log", &log, "--validate", &validate, "--json"];
    let output = run(&[&arguments[..], more].concat());
    let answer = serde_json::from_slice(&output.stdout);
    (answer.unwrap_or_else(|error| panic!("{error}: {}", said(&output))), output.status.code())
}

/// The shape's band holds the truth, and it is as large, but for what straight lines between nine knots leave of a wave.
fn shape_holds(points: &Value, truth: impl Fn(f64) -> f64) {
    let points = points.as_array().expect("points");
    let centred = |values: Vec<f64>| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.into_iter().map(|value| value - mean).collect::<Vec<f64>>()
    };
    let found = centred(points.iter().map(|point| number(point, &["value"])).collect());
    let truth =
        centred(points.iter().map(|point| truth(point["at"][0].as_f64().expect("an angle"))).collect());
    let size = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let ratio = size(&found) / size(&truth);
    assert!((0.9..1.1).contains(&ratio), "{ratio} times the truth");
    for (point, (found, truth)) in points.iter().zip(found.iter().zip(&truth)) {
        let error = number(point, &["standard_error"]);
        assert!((found - truth).abs() < 3.0 * error, "{found} ± {error}, and {truth}: {point}");
    }
}

/// What the catalogue explains is not discovered anew, and no file is written.
#[test]
fn where_the_catalogue_has_the_answer_there_is_no_law() {
    let desk = Desk::new();
    let hide = ["--hide", "gravity_pendulum:moment=0.3"];
    let (train, held_out) = (desk.record("train.csv", 1, &hide), desk.record("held_out.csv", 2, &hide));
    let law = desk.path("law.toml").display().to_string();
    let (answer, code) = discover(&train, &held_out, &["-o", &law]);
    assert_eq!((&answer["verdict"], code), (&"catalogue".into(), Some(1)), "{answer:#}");
    assert_eq!(answer["effects"], serde_json::json!(["gravity_pendulum"]));
    assert!(answer["expression"].is_null() && answer["user_effect"].is_null(), "{answer:#}");
    assert!(!fs::exists(&law).expect("a folder"), "a model without a law was written");
    let plain = [desk.record("a.csv", 3, &[]), desk.record("b.csv", 4, &[])];
    let (answer, code) = discover(&plain[0], &plain[1], &[]);
    assert_eq!((&answer["verdict"], code), (&"adequate".into(), Some(0)), "{answer:#}");
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    #[test]
    fn a_law_that_no_catalogue_has_is_found_and_its_file_is_a_model() {
        let desk = Desk::new();
        let base = paper(&desk);
        let plant = desk.write("plant.toml", &format!("{base}\n{TEETH}")).display().to_string();
        let (train, held_out) = (
            desk.record("train.csv", 5, &["--model", &plant]),
            desk.record("held_out.csv", 6, &["--model", &plant]),
        );
        let [law, page] = ["law.toml", "law.html"].map(|name| desk.path(name).display().to_string());
        let (answer, code) = discover(&train, &held_out, &["-o", &law, "--report", &page]);
        assert_eq!((&answer["verdict"], code), (&"law".into(), Some(0)), "{answer:#}");
        assert_eq!((&answer["block"], &answer["site"]), (&"body".into(), &"torque".into()), "{answer:#}");
        assert_eq!(answer["channels"], serde_json::json!(["body_angle_rad"]), "{answer:#}");
        assert!(number(&answer, &["confidence"]) > 0.9, "{answer:#}");
        for (name, truth) in [("k", 0.04), ("n", 30.0)] {
            let found = &answer["parameters"][name];
            let off = (number(found, &["value"]) - truth).abs();
            // The promise: within 10 % or three standard errors.
            assert!(off < 0.1 * truth || off < 3.0 * number(found, &["standard_error"]), "{name}: {found}");
        }
        let floor = number(&answer, &["error", "noise_floor"]);
        let (before, after) = (
            number(&answer, &["error", "recalibrated", "validate"]),
            number(&answer, &["error", "extended", "validate"]),
        );
        assert!(before > 3.0 * floor && after < 1.25 * floor, "{before} -> {after}, noise {floor}");
        shape_holds(&answer["shape"]["points"], |angle| 0.04 * (30.0 * angle).sin());
        let page = fs::read_to_string(&page).expect("a page");
        assert!(page.contains("sin(n*body_angle)") && page.contains("smooth function"), "the picture");

        // The law is a step that can be taken back.
        let back = desk.path("back.toml").display().to_string();
        assert!(run(&["extend", "--model", &law, "--step-back", "-o", &back]).status.success());
        let back = fs::read_to_string(&back).expect("a model file");
        assert!(back.contains("[[user_effects]]") && !back.contains("[[effects]]"), "{back}");

        // The model with the law lacks nothing any more, and the emulator runs it.
        let (answer, _) = diagnose(&law, &train, &held_out);
        assert_eq!(answer["verdict"], "adequate", "{answer:#}");
        desk.record("again.csv", 7, &["--model", &law]);
        // The law alone, as a user writes it: `extend` fits the same numbers.
        let text = fs::read_to_string(&law).expect("written");
        let (with_law, _) = text.split_once("[[effects]]").expect("the law is in the model");
        let mine = desk.write("mine.toml", with_law).display().to_string();
        let (train, held_out) = (train.display().to_string(), held_out.display().to_string());
        let found = Model::load(Path::new(&law)).expect("a model");
        let better = desk.path("better.toml").display().to_string();
        let logs = ["--log", &train, "--validate", &held_out, "-o", &better, "--json"];
        let output = run(&[&["extend", "--model", &mine, "--effect", "discovered_law"][..], &logs].concat());
        assert!(output.status.success(), "{}{}", said_out(&output), said(&output));
        let extended: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let again = number(&extended, &["error", "extended", "validate"]);
        // The same law, data and windows. `discover` weighs rate and angle by what the base leaves, `extend` by the noise that the law
        // leaves: that takes no more of the rate's error.
        assert!(again < 1.01 * after && again > 0.8 * floor, "{again} after {after}, noise {floor}");
        let extended = Model::load(Path::new(&better)).expect("a model");
        for name in ["discovered_law.k", "discovered_law.n"] {
            let [one, two] = [&found, &extended].map(|model| model.parameter(name).expect("in the model"));
            let error = found.standard_errors[name];
            // Other weights move a number within what is said of it.
            assert!((one - two).abs() < 2.0 * error, "{name}: {one} ± {error}, and {two}");
        }
        // `compare` and `emulate` take the file as it is.
        let compared = run(&["compare", "--model", &law, "--log", &held_out, "--json"]);
        let compared: Value = serde_json::from_slice(&compared.stdout).expect("JSON");
        assert_eq!(
            compared["comparisons"][0]["effects"],
            serde_json::json!(["discovered_law"]),
            "{compared:#}"
        );
    }
}
