//! What the check of the rotors' speeds knows of them: the model, and what it does not know of itself.
//!
//! Beside the model run its neighbours: one for each number with a standard error, moved by it, and one whose motors are warm. How far they
//! are apart is what the model does not know; what it was off in its own logs ([`RotorError`]) is the rest. Both together, times
//! `band`, are allowed for ever and whatever their correlation; what lies beyond is summed (Page's test).

use super::thresholds::THRESHOLDS;
use crate::model::{Member, MemberState, Model, ModelError, RotorError};

impl From<ModelError> for SpeedCheckError {
    fn from(error: ModelError) -> Self {
        Self::Model(error.to_string())
    }
}

/// Why a bench's speeds cannot be held against its model.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SpeedCheckError {
    /// It is nobody's, or of another bench.
    #[error(
        "guard.speed_check is on, and needs a model that was identified on this bench: `model` names {0}"
    )]
    NotIdentified(Lacks),
    /// Whoever built the guard did not say which model.
    #[error("guard.speed_check is on, and this guard was built without the bench's model")]
    NoModel,
    /// One of its effects cannot be run.
    #[error("guard.speed_check is on, and the bench's model cannot be run: {0}")]
    Model(String),
}

/// What a model lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Lacks {
    /// It was never identified from logs.
    #[error("one that no log was identified for (`rotorbench identify --log LOG -o MODEL`)")]
    Logs,
    /// It was, and its file does not say how far it was from them.
    #[error(
        "one whose file has no `rotor_error`, as of an older version or after a step back (`identify` or `extend` write it)"
    )]
    Error,
    /// It has effects whose errors are not known.
    #[error("one whose file has no standard error of its numbers")]
    Errors,
}

/// What a check of speeds sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedCheck {
    /// [rad/s] off the model at hover from which three readings are enough.
    pub seen_from: f64,
    /// [-] the same as a share of the rate at hover.
    pub share: f64,
    /// [-] commands between which it is made.
    pub commands: (f64, f64),
}

/// Most members: the model, those of its numbers, and the warm one.
pub(super) const MOST_MEMBERS: usize = 16;
const _: () = assert!(THRESHOLDS.speed_numbers + 2 <= MOST_MEMBERS);

/// The model as the guard holds it.
#[derive(Debug, Clone)]
pub(super) struct SpeedModel {
    /// The model first, then its neighbours; at most [`MOST_MEMBERS`].
    pub(super) members: Vec<Member>,
    /// Whether the last member is the warm one.
    pub(super) has_warm: bool,
    /// [rad/s] standard deviation of what is left between model and reading.
    pub(super) scale: f64,
    pub(super) band: f64,
    /// [-] commands that are judged.
    pub(super) commands: (f64, f64),
    /// [rad/s] below which a rotor stands.
    pub(super) standing: f64,
    /// [ns] longest dead time of a member.
    pub(super) delay_ns: u64,
    /// What it was built from.
    model: Model,
}

impl PartialEq for SpeedModel {
    fn eq(&self, other: &Self) -> bool {
        self.model == other.model && self.band == other.band
    }
}

impl SpeedModel {
    /// What of `model` keeps it from being held against a bench; `None` = nothing.
    pub(super) fn lacks(model: &Model) -> Option<Lacks> {
        let rotor_errors = model.rotor_parameters();
        if model.identified_from.is_empty() {
            Some(Lacks::Logs)
        } else if model.rotor_error.is_none() {
            Some(Lacks::Error)
        } else if !rotor_errors.iter().any(|name| model.standard_errors.contains_key(*name)) {
            Some(Lacks::Errors)
        } else {
            None
        }
    }

    pub(super) fn build(model: &Model, band: f64) -> Result<Self, SpeedCheckError> {
        let Some(error) = model.rotor_error.filter(|_| Self::lacks(model).is_none()) else {
            return Err(SpeedCheckError::NotIdentified(Self::lacks(model).unwrap_or(Lacks::Error)));
        };
        let equations = model.equations()?;
        let mut members = vec![Member::new(equations.clone(), 0.0)];
        for neighbour in neighbours(model) {
            members.push(Member::new(neighbour.equations()?, 0.0));
        }
        let has_warm = members[0].is_slow();
        if has_warm {
            // As warm as hover makes it: how warm a motor is when the guard begins nobody knows.
            members.push(Member::new(equations, 1.0));
        }
        let longest = members.iter().map(Member::delay).fold(0.0, f64::max);
        Ok(Self {
            members,
            has_warm,
            scale: error.scale(),
            band,
            commands: judged(&error),
            standing: THRESHOLDS.speed_standing * model.actuator.hover_rate,
            delay_ns: crate::clock::span_ns(longest),
            model: model.clone(),
        })
    }

    /// What it sees of rotors that turn as hover has them, at full battery.
    pub(super) fn looks(&self) -> SpeedCheck {
        let actuator = &self.model.actuator;
        let mut readings = Vec::with_capacity(self.members.len());
        for member in &self.members {
            let mut state = MemberState::default();
            // To rest: whatever is slower than a rotor (heat) stays where it is for so long.
            for _ in 0..THRESHOLDS.speed_rest_steps {
                let span = THRESHOLDS.speed_rest_step / actuator.pole;
                member.advance(&mut state, span, self.model.hover_command(), actuator.full_voltage, 1.0);
            }
            readings.push(state.reading());
        }
        let apart = |reading: &f64| reading - readings[0];
        let (own, warm) = readings.split_at(readings.len() - usize::from(self.has_warm));
        let spread: f64 = own.iter().map(|reading| apart(reading).powi(2)).sum();
        let warm = warm.iter().map(|reading| apart(reading).abs()).sum();
        // Three readings of the most that one adds, which is what the limit takes at least.
        let beyond = (THRESHOLDS.speed_most + THRESHOLDS.speed_drift) * self.scale;
        SpeedCheck {
            seen_from: self.allowed(spread.sqrt(), warm) + beyond,
            share: (self.allowed(spread.sqrt(), warm) + beyond) / readings[0],
            commands: self.commands,
        }
    }

    /// [rad/s] by which a rotor that follows the model may read off it, where the members are as far apart as `spread`.
    pub(super) fn allowed(&self, spread: f64, warm: f64) -> f64 {
        self.band * self.scale.hypot(spread) + warm
    }
}

/// [-] the commands of the model's own logs, and a little around them.
fn judged(error: &RotorError) -> (f64, f64) {
    let margin = THRESHOLDS.speed_range_margin * (error.highest_command - error.lowest_command);
    (error.lowest_command - margin, error.highest_command + margin)
}

/// The model with one number each moved by its standard error: those of the rotors, the ones that are known worst first.
fn neighbours(model: &Model) -> impl Iterator<Item = Model> + '_ {
    let is_rotor = |name: &str| match name.split_once('.') {
        Some((id, _)) => model.effect(id).is_ok_and(|effect| effect.site.is_rotor()),
        None => model.rotor_parameters().contains(&name),
    };
    let mut known: Vec<(&String, f64)> = model
        .standard_errors
        .iter()
        .filter(|(name, error)| is_rotor(name) && error.is_finite())
        .map(|(name, error)| (name, *error))
        .collect();
    let share = |(name, error): &(&String, f64)| {
        error / model.parameter(name).unwrap_or(0.0).abs().max(f64::MIN_POSITIVE)
    };
    known.sort_by(|a, b| share(b).total_cmp(&share(a)));
    known.truncate(THRESHOLDS.speed_numbers);
    known.into_iter().filter_map(|(name, error)| {
        let mut neighbour = model.clone();
        neighbour.set_parameter(name, model.parameter(name)? + error);
        // A number at the end of its range, moved beyond it, is no model any more.
        neighbour.check().is_ok().then_some(neighbour)
    })
}
