//! The verdict of `diagnose` in a sentence, and what to do next.

use crate::diagnose::{Diagnosis, Verdict};
use crate::effect::{self, Site};

/// The answer in a sentence; names of effects between `mark`s.
#[must_use]
pub fn sentence(diagnosis: &Diagnosis, mark: &str) -> String {
    let effects: Vec<String> = diagnosis.effects.iter().map(|id| format!("{mark}{id}{mark}")).collect();
    let effects = effects.join(" + ");
    match diagnosis.verdict {
        Verdict::MissingEffect => format!("The model is missing: {effects}."),
        Verdict::Adequate => "Nothing is missing that these data could show.".to_owned(),
        Verdict::ParametersChanged => {
            "None of the effects tried is missing; the model's own numbers have changed.".to_owned()
        }
        Verdict::Unknown if effects.is_empty() => {
            "Something is missing, and nothing in the catalogue explains it.".to_owned()
        }
        Verdict::Unknown => format!(
            "Something is missing. {effects} explains {:.0} % of it (of the squared error above the noise); \
             nothing in the catalogue explains the rest.",
            100.0 * diagnosis.error.explained()
        ),
        Verdict::InsufficientData => "These data cannot tell.".to_owned(),
    }
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

/// What a changed inertia may be instead: only d c / J shows in a body's motion, and a gyro that reads too much looks the same
/// where no angle was logged.
fn inertia_stands_for(diagnosis: &Diagnosis) -> Option<String> {
    let changed = diagnosis.changed_parameters.iter().find(|changed| changed.is_inertia())?;
    let needs_angle = |id: &str| {
        let card = effect::find(id);
        card.is_some_and(|card| card.site == Site::BodyRateSensor && card.needs.contains(&"body_angle_rad"))
    };
    let is_gyro_unchecked = diagnosis
        .candidates
        .iter()
        .any(|it| it.refusal.is_some() && it.validate.is_none() && needs_angle(&it.effect));
    let gyro =
        if is_gyro_unchecked { ", and so would a gyro that reads too much: log the angle, too" } else { "" };
    Some(format!(
        "Weigh or measure before you believe J: arm d and thrust c show only as d c / J. {:.2} times their product would look the \
         same{gyro}.",
        changed.from / changed.to
    ))
}

/// What to do next, step by step. `model`, `train`, `validate` are the files as
/// they were given; `options` are those of the logs, each with a blank before it.
#[must_use]
pub fn next_steps(
    diagnosis: &Diagnosis,
    model: &str,
    (train, validate): (&[String], &[String]),
    options: &str,
) -> Vec<NextStep> {
    let logs = format!("--log {}{options}", train.join(" "));
    let shown = if validate.is_empty() { train } else { validate };
    let shown = format!("--log {}{options}", shown.join(" "));
    let held_out =
        if validate.is_empty() { String::new() } else { format!(" --validate {}", validate.join(" ")) };
    let commands = Commands {
        extend: format!(
            "rotorbench extend --model {model} --effect {} {logs}{held_out} -o extended.toml",
            diagnosis.effects.join(" ")
        ),
        compare: format!("rotorbench compare --model extended.toml {shown}"),
        recalibrate: format!(
            "rotorbench extend --model {model} --recalibrate {logs}{held_out} -o recalibrated.toml"
        ),
    };
    let mut steps = of_verdict(diagnosis, commands);
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
    let experiment = diagnosis.next_experiment.as_ref().filter(|_| !diagnosis.turns_against_torque);
    if let Some(next) = experiment.filter(|next| !next.run.is_empty()) {
        steps.push(NextStep::say(format!("To tell the sets apart, record: {}", next.run)));
    }
    steps
}

/// Commands that a step may end with.
struct Commands {
    extend: String,
    compare: String,
    recalibrate: String,
}

/// The steps that a verdict asks for.
fn of_verdict(diagnosis: &Diagnosis, commands: Commands) -> Vec<NextStep> {
    match diagnosis.verdict {
        _ if diagnosis.turns_against_torque => vec![NextStep::say(
            "Look whether the gyro's sign is that of the torque, and whether rotors 1 and 2 are exchanged; then diagnose \
             again. What is named before that only comes nearest.",
        )],
        Verdict::MissingEffect => vec![NextStep::by("Add it:", commands.extend)],
        Verdict::Unknown if diagnosis.effects.is_empty() => {
            vec![NextStep::say(
                "Write what you suspect as an effect of your own, `[[user_effects]]` in the model file, and diagnose \
                 again: it competes with the catalogue.",
            )]
        }
        Verdict::Unknown => vec![
            NextStep::by("Add what explains a part:", commands.extend),
            NextStep::by("Then look at what is left:", commands.compare),
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
