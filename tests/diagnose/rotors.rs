//! A quadrotor's log: each rotor by itself, under its own number, and what all have in common.

use std::fs;
use std::path::{Path, PathBuf};

use super::desk::{Desk, has_code, number, refused, run, said, said_out};
use crate::json_schema;

/// A log of four rotors, put together of two benches': rotors 1 and 2 with `hidden[0]`, 3 and 4 with `hidden[1]`.
fn quadrotor(desk: &Desk, name: &str, sequence: u32, hidden: [&str; 2]) -> PathBuf {
    let bench = |at: u32| {
        let (path, own) = (desk.path(&format!("bench_{at}_{name}")), (sequence + at).to_string());
        let place = path.display().to_string();
        let drive =
            ["experiment", "prbs", "--lockstep", "--rotors", "both", "--duration", "20", "-o", &place];
        let hide = ["--seed", &own, "--sequence", &own, "--hide", hidden[at as usize]];
        let output = run(&[&drive[..], &hide[..]].concat());
        assert!(output.status.success(), "{}", said(&output));
        fs::read_to_string(path).expect("a log")
    };
    let wanted = ["command_1", "command_2", "propeller_rate_1_rad_s", "propeller_rate_2_rad_s"];
    let cells = |text: &str, wanted: &[&str]| -> Vec<String> {
        let names: Vec<&str> = text.lines().next().expect("a header").split(',').collect();
        let place = |name: &&str| names.iter().position(|it| it == name).expect("the column");
        let places: Vec<usize> = wanted.iter().map(place).collect();
        let row = |line: &str| {
            let cells: Vec<&str> = line.split(',').collect();
            places.iter().map(|at| cells[*at]).collect::<Vec<_>>().join(",")
        };
        text.lines().skip(1).map(row).collect()
    };
    let (first, second) = (bench(0), bench(1));
    let own = ["time_s", "battery_voltage_v", "body_rate_rad_s"];
    let parts = [cells(&first, &own), cells(&first, &wanted), cells(&second, &wanted)];
    let header = "time_s,battery_voltage_v,body_rate_rad_s,command_1,command_2,propeller_rate_1_rad_s,\
         propeller_rate_2_rad_s,command_3,command_4,propeller_rate_3_rad_s,propeller_rate_4_rad_s\n";
    let rows = (0..parts[0].len().min(parts[2].len()))
        .map(|row| parts.iter().map(|part| part[row].as_str()).collect::<Vec<_>>().join(",") + "\n");
    desk.write(name, &(header.to_owned() + &rows.collect::<String>()))
}

/// The one to fit on and the one held out.
fn both_logs(desk: &Desk, hidden: [&str; 2]) -> (String, String) {
    (text(&quadrotor(desk, "train.csv", 1, hidden)), text(&quadrotor(desk, "held_out.csv", 11, hidden)))
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

#[test]
fn each_rotor_of_a_quadrotor_is_diagnosed_and_what_they_share_is_said() {
    let desk = Desk::new();
    let hidden = ["transport_delay:delay=0.03", "transport_delay:delay=0.05"];
    let (train, held_out) = both_logs(&desk, hidden);
    let asked = ["diagnose", "--model", "paper", "--log", &train, "--validate", &held_out];
    let answer = json_schema::answer("diagnose-rotors", run(&[&asked[..], &["--json"]].concat()).stdout);
    assert_eq!(answer["verdict"], "missing_effect");
    assert_eq!(answer["effects"], serde_json::json!(["transport_delay"]));
    let delay = &answer["parameters"]["transport_delay.delay"];
    assert_eq!(delay["unit"], "s");
    // Three standard errors of 0.03 ms each.
    let near = |key: &str, truth: f64| (number(delay, &[key]) - truth).abs() < 1e-4;
    assert!(near("least", 0.03) && near("greatest", 0.05), "{delay}");
    let rotors = answer["rotors"].as_array().expect("a list");
    let own: Vec<u64> = rotors.iter().filter_map(|of| of["rotor"].as_u64()).collect();
    assert_eq!(own, [1, 2, 3, 4]);
    for of in rotors {
        assert_eq!(of["effects"], serde_json::json!(["transport_delay"]), "{of}");
        assert_eq!(of["where"][0]["block"], format!("actuator_{}", of["rotor"]));
    }
    let left_out = rotors[0]["findings"].as_array().expect("a list").iter();
    assert!(left_out.filter(|it| it["code"] == "body_of_many_rotors").count() == 1, "{answer}");

    let shown = said_out(&run(&asked));
    assert!(shown.starts_with("4 rotors, each by itself. All of them miss: transport_delay."), "{shown}");
    assert!(shown.contains("--effect transport_delay") && shown.contains("--rotors 4"), "{shown}");
    assert!(shown.lines().count() < 40, "four rotors, and still one screen: {shown}");
    // A model of all holds for none of them, and each one's own is judged, too.
    let found = json_schema::answer("identify", run(&["identify", "--log", &train, "--json"]).stdout);
    let of_rotors = |code: &str| {
        let findings = found["findings"].as_array().expect("a list").iter();
        findings.filter(|it| it["code"] == code).map(|it| it["subject"].clone()).collect::<Vec<_>>()
    };
    assert_eq!(of_rotors("rotor_differs_from_all"), ["rotor 1", "rotor 2"], "{}", found["findings"]);
    // A delay of 50 ms beside a battery that hardly moves is more than `identify` finds its way to.
    assert_eq!(of_rotors("own_model_worse"), ["rotor 3", "rotor 4"], "{}", found["findings"]);
    let shown = said_out(&run(&["identify", "--log", &train]));
    assert!(
        shown.contains("rotor 3; rotor 4: its own model leaves"),
        "what is said of a rotor is said beside the others: {shown}"
    );
    let page = text(&desk.path("page.html"));
    refused(&[&asked[..], &["--report", &page]].concat(), &["--report is a page of one rotor", "--rotors 1"]);
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    /// The number of its columns apart. One of each bench will do.
    #[test]
    fn each_rotor_is_diagnosed_as_it_is_alone() {
        let desk = Desk::new();
        let hidden = ["transport_delay:delay=0.03", "transport_delay:delay=0.05"];
        let (train, held_out) = both_logs(&desk, hidden);
        let asked = ["diagnose", "--model", "paper", "--log", &train, "--validate", &held_out, "--json"];
        let answer = json_schema::answer("diagnose-rotors", run(&asked).stdout);
        for at in [1, 2] {
            let of = &answer["rotors"][at];
            let rotor = of["rotor"].to_string();
            let alone = run(&[&asked[..], &["--rotors", &rotor]].concat());
            let alone: serde_json::Value = serde_json::from_slice(&alone.stdout).expect("JSON");
            let both = [of, &alone].map(|it| (&it["parameters"], &it["error"]));
            assert_eq!(both[0], both[1], "rotor {rotor}");
        }
    }

    #[test]
    fn an_effect_of_two_rotors_only_is_theirs_and_not_common() {
        let desk = Desk::new();
        let hidden = ["transport_delay:delay=0.03", "command_dead_zone:width=0.2"];
        let (train, held_out) = both_logs(&desk, hidden);
        let asked = ["diagnose", "--model", "paper", "--log", &train, "--validate", &held_out, "--json"];
        let answer = json_schema::answer("diagnose-rotors", run(&asked).stdout);
        assert_eq!(answer["effects"], serde_json::json!([]));
        let has = |at: usize| answer["rotors"][at]["effects"].to_string().contains("transport_delay");
        assert_eq!([0, 1, 2, 3].map(has), [true, true, false, false], "{answer}");

        let compared = run(&["compare", "--log", &train, "--json"]);
        let compared: serde_json::Value = serde_json::from_slice(&compared.stdout).expect("JSON");
        let blocks = compared["comparisons"][0]["blocks"].as_array().expect("a list");
        let names: Vec<&str> = blocks.iter().filter_map(|block| block["name"].as_str()).collect();
        assert_eq!(names, ["actuator_1", "actuator_2", "actuator_3", "actuator_4"], "and no body");

        let model = text(&desk.path("model.toml"));
        let found = run(&["identify", "--log", &train, "--validate", &held_out, "-o", &model, "--json"]);
        let found = json_schema::answer("identify", found.stdout);
        let rotors = found["rotors"].as_array().expect("a list");
        assert_eq!(rotors.len(), 4);
        assert!(
            has_code(&found, "no_common_model"),
            "a dead zone of a fifth in two of them, and none in the others"
        );
        // The delay is rotors 1 and 2's, and each model has its own.
        let delay = |at: usize| number(&rotors[at], &["actuator", "delay"]);
        assert!([0, 1].iter().all(|at| (delay(*at) - 0.03).abs() < 1e-3), "{rotors:?}");
        let own = fs::read_to_string(desk.path("model_rotor_2.toml")).expect("beside the model of all");
        assert!(own.contains("transport_delay"), "{own}");
        assert!(desk.path("model_rotor_4.toml").exists() && desk.path("model.toml").exists());
        // Each rotor's own file is written over as little as the model that was named.
        let other = text(&desk.path("other.toml"));
        desk.write("other_rotor_3.toml", "mine");
        refused(&["identify", "--log", &train, "-o", &other], &["other_rotor_3.toml", "is there already"]);
        assert!(!Path::new(&other).exists() && !desk.path("other_rotor_1.toml").exists());
        assert_eq!(fs::read_to_string(desk.path("other_rotor_3.toml")).expect("as it was"), "mine");
    }
}
