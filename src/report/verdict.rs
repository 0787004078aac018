//! The verdict of `diagnose` in a sentence, and what to do next.

use crate::diagnose::{Diagnosis, Verdict};

/// The answer in a sentence; names of effects between `mark`s.
#[must_use]
pub fn sentence(diagnosis: &Diagnosis, mark: &str) -> String {
    let effects: Vec<String> = diagnosis.effects.iter().map(|id| format!("{mark}{id}{mark}")).collect();
    let effects = effects.join(" + ");
    match diagnosis.verdict {
        Verdict::MissingEffect => format!("The model is missing: {effects}."),
        Verdict::Adequate => "Nothing is missing that these data could show.".to_owned(),
        Verdict::ParametersChanged => {
            "No effect is missing; the model's own numbers have changed.".to_owned()
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

/// What to do next, sentence by sentence; commands between backticks. `model`, `train`, `validate` are the files as
/// they were given; `options` are those of the logs, each with a blank before it.
#[must_use]
pub fn next_steps(
    diagnosis: &Diagnosis,
    model: &str,
    (train, validate): (&[String], &[String]),
    options: &str,
) -> Vec<String> {
    let logs = format!("--log {}{options}", train.join(" "));
    let shown = if validate.is_empty() { train } else { validate };
    let shown = format!("--log {}{options}", shown.join(" "));
    let held_out =
        if validate.is_empty() { String::new() } else { format!(" --validate {}", validate.join(" ")) };
    let extend = |effects: &[String]| {
        let effects = effects.join(" ");
        format!("`rotorbench extend --model {model} --effect {effects} {logs}{held_out} -o extended.toml`")
    };
    let mut steps = match diagnosis.verdict {
        _ if diagnosis.turns_against_torque => vec![
            "Look whether the gyro's sign is that of the torque, and whether rotors 1 and 2 are exchanged; then diagnose \
             again. What is named before that only comes nearest."
                .to_owned(),
        ],
        Verdict::MissingEffect => vec![format!("Add it: {}", extend(&diagnosis.effects))],
        Verdict::Unknown if diagnosis.effects.is_empty() => {
            vec!["Write what you suspect as an effect of your own, `[[user_effects]]` in the model file, and diagnose \
                  again: it competes with the catalogue."
                .to_owned()]
        }
        Verdict::Unknown => vec![
            format!("Add what explains a part: {}", extend(&diagnosis.effects)),
            format!("Then look at what is left: `rotorbench compare --model extended.toml {shown}`"),
        ],
        Verdict::ParametersChanged => vec![format!(
            "Take the new numbers over: `rotorbench extend --model {model} --recalibrate {logs}{held_out} -o recalibrated.toml`"
        )],
        Verdict::Adequate => vec!["Use the model; a log that moves more could show more.".to_owned()],
        Verdict::InsufficientData => vec![
            "Record a longer log, in which something moves: `rotorbench experiment prbs`, for a minute or more."
                .to_owned(),
        ],
    };
    if let Some(inertia) = diagnosis.changed_parameters.iter().find(|changed| changed.is_in_degrees()) {
        steps.insert(
            0,
            format!(
                "Look whether the body's rate (and its angle) are in degrees: J comes out as 1/{:.0} of the model's, and 180/π \
                 is 57. If so, `import` the log with the units `deg/s` and `deg`, and diagnose again.",
                inertia.from / inertia.to
            ),
        );
    }
    let experiment = diagnosis.next_experiment.as_ref().filter(|_| !diagnosis.turns_against_torque);
    if let Some(next) = experiment.filter(|next| !next.run.is_empty()) {
        steps.push(format!("To tell the sets apart, record: {}", next.run));
    }
    steps
}
