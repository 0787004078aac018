//! What to do next: commands, and what to record.

use std::path::Path;

use super::number;
use super::thresholds::THRESHOLDS;
use super::verdict::{ONE_DIRECTION, is_of_other_bench};
use crate::diagnose::{Diagnosis, Verdict};
use crate::effect::{self, Site, Term, find};
use crate::screening::checks::rate_is_angle_difference::RATE_OF_ANGLE;
use crate::signal::columns;

/// `stem.toml`, or the first of `stem_2.toml`, `stem_3.toml`, ... that is neither there nor the model that it starts from:
/// nothing is written over what is there.
fn free_name(stem: &str, model: &str) -> String {
    let is_free = |name: &String| {
        Path::new(name).file_name() != Path::new(model).file_name() && !Path::new(name).exists()
    };
    let numbered = (2..1000).map(|number| format!("{stem}_{number}.toml"));
    let mut names = std::iter::once(format!("{stem}.toml")).chain(numbered);
    names.find(is_free).unwrap_or_else(|| format!("{stem}.toml"))
}

/// How fast to sample, where a delay is among the sets in question.
fn sampling(diagnosis: &Diagnosis) -> String {
    let cards = diagnosis.effects.iter().filter_map(|id| find(id));
    let delays = cards.filter(|card| card.acts_as == Some(Term::DeadTime));
    let names = delays.filter_map(|card| Some(format!("{}.{}", card.id, card.parameters.first()?.name)));
    let mut found = names.filter_map(|name| diagnosis.model.parameter(&name));
    let at_least = |delay: f64| {
        let sampled_ms = number(1e3 * delay / THRESHOLDS.samples_in_delay, 2);
        let delay_ms = number(1e3 * delay, 2);
        let samples = THRESHOLDS.samples_in_delay;
        format!(" Here: every {sampled_ms} ms or faster, {samples:.0} times within the {delay_ms} ms found.")
    };
    found.find(|delay| *delay > 0.0).map(at_least).unwrap_or_default()
}

/// What to do next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NextStep {
    /// In words; what is named is between backticks.
    pub words: String,
    /// The command that does it.
    pub command: Option<String>,
}

impl NextStep {
    fn by(words: &str, command: String) -> Self {
        Self { words: words.to_owned(), command: Some(command) }
    }

    fn say(words: impl Into<String>) -> Self {
        Self { words: words.into(), command: None }
    }

    /// Both, the command between backticks.
    #[must_use]
    pub fn text(&self) -> String {
        let command = self.command.iter().map(|command| format!(" `{command}`"));
        self.words.clone() + &command.collect::<String>()
    }
}

/// What a changed inertia may be instead: only d c / J shows in the motion of a body that rotors drive (torque / J of
/// one that a commanded torque drives), and a gyro of another scale looks the same where
/// no angle was logged.
fn inertia_stands_for(diagnosis: &Diagnosis) -> Option<String> {
    // Signs come first: behind a gyro that reads the other way round J is any number.
    let changed = diagnosis.changed_parameters.iter().find(|changed| changed.is_inertia())?;
    if diagnosis.turns_against_torque {
        return None;
    }
    let needs_angle = |id: &str| {
        let card = effect::find(id);
        card.is_some_and(|card| {
            card.site == Site::BodyRateSensor && card.needs.contains(&columns::BODY_ANGLE)
        })
    };
    let is_gyro_unchecked = diagnosis
        .candidates
        .iter()
        .any(|it| it.refusal.is_some() && it.validate.is_none() && needs_angle(&it.effect));
    let gyro = if is_gyro_unchecked {
        ", and so would a gyro whose scale is off by that: log the angle, too"
    } else {
        ""
    };
    let ratio = changed.from / changed.to;
    Some(if diagnosis.is_torque_driven {
        format!(
            "Check the scale of `{}` before you believe J: only torque / J shows. {ratio:.2} times the torque would look the \
             same{gyro}.",
            columns::TORQUE_COMMAND
        )
    } else {
        format!(
            "Weigh or measure before you believe J: arm d and thrust c show only as d c / J. {ratio:.2} times their product would \
             look the same{gyro}."
        )
    })
}

/// Options as they were given, each with a blank before it.
#[derive(Debug, Clone, Default)]
pub struct Typed {
    /// Of the logs.
    pub logs: String,
    /// Of the windows over which a body runs freely.
    pub windows: String,
}

/// What to do next, step by step. `model`, `train`, `validate` are the files as they were given.
#[must_use]
pub fn next_steps(
    diagnosis: &Diagnosis,
    model: &str,
    logs: (&[String], &[String]),
    options: &Typed,
) -> Vec<NextStep> {
    steps_into(diagnosis, model, logs, options, "")
}

/// The same of one rotor among many, whose results have names of their own.
#[must_use]
pub fn next_steps_of_rotor(
    diagnosis: &Diagnosis,
    rotor: usize,
    model: &str,
    logs: (&[String], &[String]),
    options: &Typed,
) -> Vec<NextStep> {
    steps_into(diagnosis, model, logs, options, &format!("rotor_{rotor}_"))
}

/// The command that asks what is missing: of the options `logs` are behind those fitted on, `windows` behind all.
#[must_use]
pub fn diagnose(model: &str, (train, validate): (&[String], &[String]), options: &Typed) -> String {
    let Typed { logs, windows } = options;
    let held_out = held_out(validate);
    format!("rotorbench diagnose --model {model} --log {}{logs}{held_out}{windows}", train.join(" "))
}

/// The option of the logs held out, with a blank before it.
fn held_out(validate: &[String]) -> String {
    if validate.is_empty() { String::new() } else { format!(" --validate {}", validate.join(" ")) }
}

/// What to do next, its results in files whose names begin with `prefix`.
fn steps_into(
    diagnosis: &Diagnosis,
    model: &str,
    (train, validate): (&[String], &[String]),
    options: &Typed,
    prefix: &str,
) -> Vec<NextStep> {
    let free_name = |stem: &str| free_name(&format!("{prefix}{stem}"), model);
    let ask_again = |model: &str| diagnose(model, (train, validate), options);
    let Typed { logs: options, windows } = options;
    let logs = format!("--log {}{options}", train.join(" "));
    let shown = if validate.is_empty() { train } else { validate };
    let shown = format!("--log {}{options}{windows}", shown.join(" "));
    let held_out = held_out(validate) + windows;
    let (extended, own) = (free_name("extended"), free_name("bench_model"));
    let commands = Commands {
        extend: format!(
            "rotorbench extend --model {model} --effect {} {logs}{held_out} -o {extended}",
            diagnosis.effects.join(" ")
        ),
        compare: format!("rotorbench compare --model {model} --model {extended} {shown}"),
        recalibrate: format!(
            "rotorbench extend --model {model} --recalibrate {logs}{held_out} -o {}",
            free_name("recalibrated")
        ),
        identify: format!("rotorbench identify {logs} -o {own}"),
        ask_again: ask_again(&own),
        discover: format!("rotorbench discover --model {model} {logs}{held_out} -o {}", free_name("law")),
    };
    let mut steps = of_verdict(diagnosis, commands);
    look_first(diagnosis, &mut steps);
    steps.extend(records(diagnosis));
    steps
}

/// What to look at before anything else.
fn look_first(diagnosis: &Diagnosis, steps: &mut Vec<NextStep>) {
    if let Some(inertia) = diagnosis.changed_parameters.iter().find(|changed| changed.is_in_degrees()) {
        steps.insert(
            0,
            NextStep::say(format!(
                "Look whether the body's rate (and its angle) are in degrees: J comes out as 1/{:.0} of the model's, and 180/π \
                 is 57. If so, `import` the log with the units `deg/s` and `deg`, and diagnose again.",
                inertia.from / inertia.to
            )),
        );
    }
    steps.extend(inertia_stands_for(diagnosis).map(NextStep::say));
}

/// What to record.
fn records(diagnosis: &Diagnosis) -> Vec<NextStep> {
    let mut steps = Vec::new();
    if let Some(one_way) = diagnosis.findings.iter().find(|finding| finding.code == ONE_DIRECTION) {
        let lacking =
            if one_way.count("rising_rows") < one_way.count("falling_rows") { "up" } else { "down" };
        steps.push(NextStep::say(format!(
            "Record {lacking}-steps too, with a logger that does not stall at them: what is said of the rotor then holds both ways."
        )));
    }
    let is_usable = !diagnosis.turns_against_torque && !is_of_other_bench(diagnosis);
    let experiment = diagnosis.next_experiment.as_ref().filter(|_| is_usable);
    if let Some(next) = experiment.filter(|next| !next.run.is_empty()) {
        let sampled = sampling(diagnosis);
        steps.push(NextStep::say(format!("To tell the sets apart, record: {}{sampled}", next.run)));
    }
    steps
}

/// Commands that a step may end with.
struct Commands {
    extend: String,
    compare: String,
    recalibrate: String,
    identify: String,
    ask_again: String,
    discover: String,
}

fn has(diagnosis: &Diagnosis, code: &str) -> bool {
    diagnosis.findings.iter().any(|finding| finding.code == code)
}

/// The steps that a verdict asks for.
fn of_verdict(diagnosis: &Diagnosis, commands: Commands) -> Vec<NextStep> {
    match diagnosis.verdict {
        _ if diagnosis.turns_against_torque && has(diagnosis, RATE_OF_ANGLE) => vec![NextStep::say(
            "Look whether the angle's sign is that of the torque, and whether rotors 1 and 2 are exchanged; then diagnose again. What \
             is named before that only comes nearest.",
        )],
        _ if diagnosis.turns_against_torque => vec![NextStep::say(
            "Look whether the gyro's sign is that of the torque, and whether rotors 1 and 2 are exchanged; then diagnose \
             again. What is named before that only comes nearest.",
        )],
        _ if is_of_other_bench(diagnosis) => vec![
            NextStep::by("Make a model of this bench:", commands.identify),
            NextStep::by("Then ask again:", commands.ask_again),
        ],
        Verdict::MissingEffect => vec![NextStep::by("Add it:", commands.extend)],
        Verdict::Unknown if diagnosis.effects.is_empty() => {
            vec![
                NextStep::by("Look for the law itself:", commands.discover),
                NextStep::say(
                    "Or write what you suspect as an effect of your own, `[[user_effects]]` in the model file, and diagnose \
                     again: it competes with the catalogue.",
                ),
            ]
        }
        Verdict::Unknown => vec![
            NextStep::by("Add what explains a part:", commands.extend),
            NextStep::by("Then look at what is left:", commands.compare),
            NextStep::by("Or look for a law outside the catalogue:", commands.discover),
        ],
        Verdict::ParametersChanged => {
            vec![NextStep::by("Take the new numbers over:", commands.recalibrate)]
        }
        Verdict::Adequate => vec![NextStep::say("Use the model; a log that moves more could show more.")],
        Verdict::InsufficientData => vec![NextStep::say(
            "Record a longer log, in which something moves: `rotorbench experiment prbs`, for a minute or more.",
        )],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::screening::Finding;

    #[test]
    fn a_name_is_free_that_is_not_the_models_own() {
        assert_eq!(free_name("extended", "stand.toml"), "extended.toml");
        assert_eq!(free_name("extended", "models/extended.toml"), "extended_2.toml");
        // `Cargo.toml` is there, in whose folder tests run.
        assert_eq!(free_name("Cargo", "paper"), "Cargo_2.toml");
    }

    #[test]
    fn another_benches_model_is_identified_first() {
        let mut said = Diagnosis::of(Verdict::Unknown, &["battery_sag"]);
        said.findings.push(Finding::new("model_of_other_bench", "actuator_1"));
        let steps = next_steps(&said, "m.toml", (&["a.csv".to_owned()], &[]), &Typed::default());
        let commands: Vec<_> = steps.iter().filter_map(|step| step.command.as_deref()).collect();
        assert!(commands[0].starts_with("rotorbench identify --log a.csv"), "{commands:?}");
    }

    #[test]
    fn commands_that_look_over_windows_take_their_length_along() {
        let typed = Typed { logs: " --from-s 3".to_owned(), windows: " --horizon-s 1".to_owned() };
        let steps = |said: &Diagnosis| -> Vec<String> {
            let steps = next_steps(said, "m.toml", (&["a.csv".to_owned()], &["b.csv".to_owned()]), &typed);
            steps.into_iter().filter_map(|step| step.command).collect()
        };
        let found = steps(&Diagnosis::of(Verdict::Unknown, &["battery_sag"]));
        assert_eq!(found.len(), 3, "{found:?}");
        assert!(
            found.iter().all(|it| it.contains(" --from-s 3") && it.contains(" --horizon-s 1")),
            "{found:?}"
        );
        let mut other = Diagnosis::of(Verdict::Unknown, &["battery_sag"]);
        other.findings.push(Finding::new("model_of_other_bench", "actuator_1"));
        let found = steps(&other);
        assert!(!found[0].contains("--horizon-s"), "identify has no windows: {found:?}");
        assert!(found[1].contains("--horizon-s 1"), "{found:?}");
    }

    #[test]
    fn a_changed_inertia_may_be_arm_or_thrust_unless_the_signs_are_wrong() {
        let steps = |said: &Diagnosis| {
            let steps = next_steps(said, "m.toml", (&["a.csv".to_owned()], &[]), &Typed::default());
            steps.iter().map(NextStep::text).collect::<Vec<_>>().join("\n")
        };
        let mut said = Diagnosis::of(Verdict::ParametersChanged, &[]).with_changed("inertia", 0.3, 0.2);
        assert!(steps(&said).contains("1.50 times their product"), "{}", steps(&said));
        said.is_torque_driven = true;
        let of_torque = "Check the scale of `torque_command_nm` before you believe J: only torque / J shows. 1.50 times the torque";
        assert!(steps(&said).contains(of_torque) && !steps(&said).contains("arm d"), "{}", steps(&said));
        said.is_torque_driven = false;
        said.turns_against_torque = true;
        assert!(!steps(&said).contains("their product"), "{}", steps(&said));
        let other = Diagnosis::of(Verdict::ParametersChanged, &[]).with_changed("k_v", 0.3, 0.2);
        assert!(!steps(&other).contains("their product"), "{}", steps(&other));
    }
}
