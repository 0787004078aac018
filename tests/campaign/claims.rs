//! What screening claims of logs whose truth is known: of those that hide an effect or a law, and are honest about rows, commands and
//! rates, none of what takes rows or effects from them; of benches whose commands step between rows, that they do.

use rotorbench::diagnose::{DiagnoseConfig, Diagnosis, Verdict, diagnose};
use rotorbench::log::csv;
use rotorbench::model::Model;
use rotorbench::screening::ScreenedLog;

use crate::between_rows;
use crate::case::Question;
use crate::catalogue::{ENTRIES, Kind};
use crate::outside::{OUTSIDE_ACTUATOR, OUTSIDE_ATTITUDE};

/// Codes of what no such log is.
const CLAIMS: [&str; 8] = [
    "stalled",
    "end_stop",
    "uncommanded_motion",
    "rate_is_angle_difference",
    "command_follows_rate",
    "rates_lead_commands",
    "rate_falls_with_command",
    "steps_between_rows",
];

fn claimed(folder: &std::path::Path) -> Vec<String> {
    let log = csv::read(&folder.join("train.csv")).expect("a log");
    let log = ScreenedLog::from(log);
    log.findings().map(|it| it.code.to_string()).filter(|code| CLAIMS.contains(&code.as_str())).collect()
}

#[test]
fn nothing_is_claimed_of_a_third_of_the_logs_that_are_what_they_say() {
    nothing_is_claimed(|number| number % 3 == 0, 13);
}

/// Of those that are asked, which must be more than `fewest`: together more than 40.
fn nothing_is_claimed(is_asked: impl Fn(usize) -> bool, fewest: usize) {
    let both = [Kind::Actuator, Kind::Attitude];
    let singles = ENTRIES.iter().flat_map(|entry| {
        let shown = both.into_iter().filter(|kind| entry.shows_on(*kind));
        shown.map(|kind| (format!("{} on {kind:?}", entry.id), Question::Single(entry, kind)))
    });
    let laws = [(OUTSIDE_ACTUATOR, Kind::Actuator), (OUTSIDE_ATTITUDE, Kind::Attitude)];
    let outside = laws.into_iter().flat_map(|(count, kind)| {
        (0..count).map(move |number| (format!("law {number} on {kind:?}"), Question::Outside(number, kind)))
    });
    let mut asked = 0;
    for (number, (name, question)) in singles.chain(outside).enumerate().filter(|it| is_asked(it.0)) {
        let Some(case) = question.make(93_000 + number as u64) else { continue };
        let folder = tempfile::tempdir().expect("a folder");
        case.write(folder.path()).expect("written");
        let claimed = claimed(folder.path());
        assert!(claimed.is_empty(), "{name}: {claimed:?}, {}", case.truth);
        asked += 1;
    }
    assert!(asked > fewest, "{asked} cases");
}

/// What is missing on a bench, by its logs and its model.
fn diagnosed(case: &between_rows::Case) -> Diagnosis {
    let folder = tempfile::tempdir().expect("a folder");
    case.write(folder.path()).expect("written");
    let log = |name: &str| [csv::read(&folder.path().join(name)).expect("a log").into()];
    let model = Model::load(&folder.path().join("model.toml")).expect("a model");
    let config = DiagnoseConfig::default();
    diagnose(&model, &log("train.csv"), &log("validate.csv"), &config, &|_| {}).expect("an answer")
}

/// Where in their rows steps came on average nobody knows: half a row is uncertain, however many steps there are.
#[test]
fn a_dead_time_of_steps_between_rows_is_known_to_a_part_of_a_row() {
    let case = between_rows::Case::draw(1, 71_005);
    let found = diagnosed(&case);
    assert_eq!(found.effects, ["transport_delay"], "{}", case.truth);
    let delay = &found.parameters["transport_delay.delay"];
    let row = 1.0 / case.truth["rate_hz"].as_f64().expect("a number");
    let truth = case.truth["parameters"]["delay"].as_f64().expect("a number");
    let error = delay.standard_error.expect("known");
    assert!(
        error > 0.28 * row && (delay.value - truth).abs() < 2.0 * error,
        "{delay:?} of {row} s: {}",
        case.truth
    );
}

/// 60 s of it, its command stepping each 0.4 to 0.9 s: by the formula, from step to step.
fn late_stand(delay: f64, seed: u64) -> String {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let (mut steps, mut at) = (Vec::new(), 0.3);
    while at < 60.0 {
        steps.push((at, random.random_range(0.3..0.6)));
        at += random.random_range(0.4..0.9);
    }
    let first = (0.0, 0.4);
    let text = (0..3_000).map(|row| {
        let now = 0.02 * f64::from(row);
        let command = steps.iter().rfind(|step| step.0 <= now).unwrap_or(&first).1;
        let (mut rate, mut since, mut target) = (500.0, 0.0, 500.0);
        for (at, to) in steps.iter().take_while(|step| step.0 + delay <= now) {
            let at = at + delay;
            rate = target + (rate - target) * (-12.0 * (at - since)).exp();
            (since, target) = (at, 1250.0 * to);
        }
        // The sum of twelve is nearly normal.
        let noise = (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let rate: f64 = target + (rate - target) * (-12.0 * (now - since)).exp() + noise;
        format!("{now},{command},{rate:.4}\n")
    });
    "time_s,command_1,propeller_rate_1_rad_s\n".to_owned() + &text.collect::<String>()
}

/// `tools/test --all` runs them.
mod at_length {
    use super::*;

    #[test]
    fn commands_that_step_between_rows_are_seen() {
        let mut asked = 0;
        for number in 0..12 {
            let case = between_rows::Case::draw(number, 71_000 + number);
            let of = |name: &str| case.truth[name].as_f64().expect("a number");
            // [rad/s] what a step of 200 rad/s moves the rate by within a row: what noise hides nobody sees.
            let in_row = 200.0 * of("pole_1_s") / of("rate_hz");
            if in_row < 2.0 * case.truth["noise"]["propeller_rate_rad_s"].as_f64().expect("a number") {
                continue;
            }
            asked += 1;
            let folder = tempfile::tempdir().expect("a folder");
            case.write(folder.path()).expect("written");
            assert_eq!(claimed(folder.path()), ["steps_between_rows"], "{}", case.truth);
        }
        assert!(asked > 6, "{asked} cases");
    }

    #[test]
    fn nothing_is_claimed_of_the_other_two_thirds_of_the_logs() {
        nothing_is_claimed(|number| number % 3 != 0, 27);
    }

    /// A bench with nothing missing, whatever battery, hold and noise: a step that nobody can place, a voltage that gives way in a step and a
    /// dead time that one log has to a hundredth of a row and another has not are nothing that is missing.
    #[test]
    fn nothing_is_missing_where_commands_step_between_rows() {
        for number in 0..10 {
            // Every other hides nothing.
            let case = between_rows::Case::draw(2 * number, 71_200 + number);
            assert_eq!(case.truth["effect"], "none");
            let found = diagnosed(&case);
            assert_eq!(found.verdict, Verdict::Adequate, "{:?}: {}", found.effects, case.truth);
        }
    }

    /// A plain lag with a pole of 12 rad/s in rows of 20 ms, with a dead time of a part of a row: nobody can tell that from when the steps came, so
    /// nothing is named for it.
    #[test]
    fn a_dead_time_of_half_a_row_is_none_where_commands_step_between_rows() {
        for (number, rows_late) in [0.1, 0.2, 0.3, 0.5].into_iter().enumerate() {
            let folder = tempfile::tempdir().expect("a folder");
            let [train, validate] = [0, 1].map(|part| {
                let path = folder.path().join(format!("{part}.csv"));
                std::fs::write(&path, late_stand(0.02 * rows_late, 40 + 2 * number as u64 + part))
                    .expect("written");
                [ScreenedLog::from(csv::read(&path).expect("a log"))]
            });
            let mut model = Model::paper();
            (model.actuator.pole, model.actuator.voltage_gain) = (12.0, 0.0);
            model.actuator.steady_rate = vec![0.0, 1250.0, 0.0];
            let found =
                diagnose(&model, &train, &validate, &DiagnoseConfig::default(), &|_| {}).expect("an answer");
            println!("{rows_late} rows late: {:?}, {:?}", found.verdict, found.effects);
            assert_eq!(found.effects, [""; 0], "{rows_late}: {:?}", found.verdict);
        }
    }
}
