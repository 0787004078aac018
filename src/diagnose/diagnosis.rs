//! What `diagnose` answers: the JSON of this is a contract.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::model::Model;
use crate::screening::Finding;
use crate::screening::attitude_units::DEGREES;

/// The verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Effects are missing, and they are named.
    MissingEffect,
    /// Nothing is missing that these data could show.
    Adequate,
    /// No effect is missing; parameters of the base have other values.
    ParametersChanged,
    /// Something is missing, and nothing in the catalogue carries the error to the noise floor.
    Unknown,
    /// These data cannot tell.
    InsufficientData,
}

/// A base parameter that has another value than the model says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChangedParameter {
    /// Name in the model file.
    pub name: String,
    /// Symbol in the paper.
    pub symbol: String,
    /// In the model, in `unit`.
    pub from: f64,
    /// Found in the data.
    pub to: f64,
    /// Of `to`.
    pub standard_error: Option<f64>,
    /// SI unit.
    pub unit: String,
}

impl ChangedParameter {
    /// An inertia as much smaller than the model's as a degree is than a radian.
    fn is_in_degrees(&self) -> bool {
        self.name == "inertia" && DEGREES.contains(&(self.from / self.to))
    }
}

/// A parameter found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundParameter {
    /// In `unit`.
    pub value: f64,
    /// `None`: the data do not determine it.
    pub standard_error: Option<f64>,
    /// SI unit.
    pub unit: String,
}

/// An error on both kinds of data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Both {
    /// On what was fitted.
    pub train: f64,
    /// On what was held out.
    pub validate: f64,
}

/// The error, and how far it falls.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorStory {
    /// What it is, with unit.
    pub measure: String,
    /// What sensor noise alone would leave.
    pub noise_floor: f64,
    /// The model as it is.
    pub base: Both,
    /// Its own parameters refitted.
    pub recalibrated: Both,
    /// With the missing effects.
    pub extended: Both,
}

/// Where the model fails.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Place {
    /// `actuator_1`, `actuator_2`, `body`.
    pub block: String,
    /// Share of all that is above the noise.
    pub share_of_error: f64,
    /// The channel that the error follows most.
    pub depends_on: String,
    /// Share of the error's slow part that this channel explains.
    pub explained: f64,
}

/// One rung of the ladder.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rung {
    /// Effects so far.
    pub effects: Vec<String>,
    /// Held-out error.
    pub validate: f64,
}

/// One candidate on its own.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Id.
    pub effect: String,
    /// The channel its errors are of, with its unit.
    pub channel: String,
    /// Error on training data; `None`: not tried.
    pub train: Option<f64>,
    /// Held-out error.
    pub validate: Option<f64>,
    /// How often a meaningless candidate does as well.
    pub chance: Option<f64>,
    /// Held-out error that one in twenty meaningless candidates reaches.
    #[serde(skip)]
    pub luck: Option<f64>,
    /// Held-out error of the answer without it; `None`: not in the answer.
    pub drop_one: Option<f64>,
    /// Why it was not tried, or what to know.
    pub note: String,
}

/// What to do next.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NextExperiment {
    /// The sets it would tell apart.
    pub separates: Vec<Vec<String>>,
    /// What to run.
    pub run: String,
}

/// The answer.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// The whole set that is missing, in the order added.
    pub effects: Vec<String>,
    /// Sets that the data cannot tell from it.
    pub alternatives: Vec<Vec<String>>,
    /// Base parameters that have changed.
    pub changed_parameters: Vec<ChangedParameter>,
    /// Parameters of the effects, by `effect.parameter`.
    pub parameters: BTreeMap<String, FoundParameter>,
    /// The error, and how far it falls.
    pub error: ErrorStory,
    /// Where the model fails.
    pub r#where: Vec<Place>,
    /// The error falling.
    pub ladder: Vec<Rung>,
    /// Every candidate.
    pub candidates: Vec<Candidate>,
    /// What to know about data and answer.
    pub findings: Vec<Finding>,
    /// What would tell more.
    pub next_experiment: Option<NextExperiment>,
    /// A body that moves, and not as the torque on it would have it, which no effect explains.
    #[serde(skip)]
    pub turns_against_torque: bool,
    /// The model with the effects, refitted.
    #[serde(skip)]
    pub model: Model,
}

impl Diagnosis {
    /// The answer in a sentence; names of effects between `mark`s.
    #[must_use]
    pub fn sentence(&self, mark: &str) -> String {
        let effects: Vec<String> = self.effects.iter().map(|id| format!("{mark}{id}{mark}")).collect();
        let effects = effects.join(" + ");
        match self.verdict {
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
                100.0 * self.error.explained()
            ),
            Verdict::InsufficientData => "These data cannot tell.".to_owned(),
        }
    }
}

impl Diagnosis {
    /// What to do next, sentence by sentence; commands between backticks. `model`, `train`, `validate` are the files as
    /// they were given.
    #[must_use]
    pub fn next_steps(&self, model: &str, train: &[String], validate: &[String]) -> Vec<String> {
        let logs = format!("--log {}", train.join(" "));
        let held_out =
            if validate.is_empty() { String::new() } else { format!(" --validate {}", validate.join(" ")) };
        let extend = |effects: &[String]| {
            let effects = effects.join(" ");
            format!(
                "`rotorbench extend --model {model} --effect {effects} {logs}{held_out} -o extended.toml`"
            )
        };
        let mut steps = match self.verdict {
            _ if self.turns_against_torque => vec![
                "Look whether the gyro's sign is that of the torque, and whether rotors 1 and 2 are exchanged; then diagnose \
                 again. What is named before that only comes nearest."
                    .to_owned(),
            ],
            Verdict::MissingEffect => vec![format!("Add it: {}", extend(&self.effects))],
            Verdict::Unknown if self.effects.is_empty() => {
                vec!["Write what you suspect as an effect of your own, `[[user_effects]]` in the model file, and diagnose \
                      again: it competes with the catalogue."
                    .to_owned()]
            }
            Verdict::Unknown => vec![
                format!("Add what explains a part: {}", extend(&self.effects)),
                "Then look at what is left with `rotorbench compare --model extended.toml`.".to_owned(),
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
        if let Some(inertia) = self.changed_parameters.iter().find(|changed| changed.is_in_degrees()) {
            steps.insert(
                0,
                format!(
                    "Look whether the body's rate (and its angle) are in degrees: J comes out as 1/{:.0} of the model's, and 180/π \
                     is 57. If so, `import` the log with the units `deg/s` and `deg`, and diagnose again.",
                    inertia.from / inertia.to
                ),
            );
        }
        let experiment = self.next_experiment.as_ref().filter(|_| !self.turns_against_torque);
        if let Some(next) = experiment.filter(|next| !next.run.is_empty()) {
            steps.push(format!("To tell the sets apart, record: {}", next.run));
        }
        steps
    }
}

impl ErrorStory {
    /// The unit of every error in it.
    #[must_use]
    pub fn unit(&self) -> &str {
        let inside = self.measure.rsplit_once('[').map_or("", |(_, rest)| rest);
        inside.trim_end_matches(']')
    }

    /// Whether it is told in the channel of a candidate.
    #[must_use]
    pub fn is_of(&self, channel: &str) -> bool {
        let name = channel.split(' ').next().unwrap_or(channel);
        self.measure.contains(name)
    }

    /// The share of the recalibrated base's held-out squared error above the noise that the extension takes off.
    #[must_use]
    pub fn explained(&self) -> f64 {
        let above = |error: f64| error.powi(2) - self.noise_floor.powi(2);
        let share = 1.0 - above(self.extended.validate) / above(self.recalibrated.validate);
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    }
}
