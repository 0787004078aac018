//! A model ready to run: its effects sorted by where they act, their parameters bound.

use std::sync::Arc;

use super::{AddedEffect, Effect, Model, ModelError, polynomial};
use crate::effect::{Expression, Law, Memory, Point, Site, StaticLaw, Term};
use crate::signal::columns;

/// One effect at its site.
#[derive(Debug, Clone)]
pub(super) enum Hook {
    /// Without memory.
    Static(StaticLaw, Vec<f64>),
    /// A user's expression.
    Expression(Arc<Expression>, Vec<f64>),
    /// With a state.
    Memory(Memory, Vec<f64>),
}

impl Hook {
    /// What a law without memory adds; a law with memory answers zero.
    #[inline]
    pub(super) fn add(&self, point: &Point) -> f64 {
        match self {
            Self::Static(law, parameters) => law(parameters, point),
            Self::Expression(expression, parameters) => value_of(expression, parameters, point),
            Self::Memory(..) => 0.0,
        }
    }

    /// Its memory, where it has one.
    #[inline]
    pub(super) fn memory(&self) -> Option<Remembers<'_>> {
        match self {
            Self::Memory(memory, parameters) => Some(Remembers::Law(memory, parameters)),
            Self::Expression(expression, parameters) if expression.remembers() => {
                Some(Remembers::Own(expression, parameters))
            }
            _ => None,
        }
    }
}

// Inside the loops of a free run an expression's stack and a copy of the point would crowd out what every law needs, at a third
// of the time: each of these is a call of its own.

#[inline(never)]
fn value_of(expression: &Expression, parameters: &[f64], point: &Point) -> f64 {
    expression.value(parameters, point)
}

#[inline(never)]
fn value_with(expression: &Expression, parameters: &[f64], state: f64, point: &Point) -> f64 {
    expression.value(parameters, &Point { memory: Some(state), ..*point })
}

#[inline(never)]
fn memory_after(expression: &Expression, parameters: &[f64], state: f64, point: &Point, span: f64) -> f64 {
    expression.memory_after(parameters, state, point, span)
}

/// A law with a state, of the catalogue or of the user's own.
#[derive(Clone, Copy)]
pub(super) enum Remembers<'a> {
    Law(&'a Memory, &'a [f64]),
    Own(&'a Expression, &'a [f64]),
}

impl Remembers<'_> {
    /// The state at rest at a point.
    pub(super) fn steady_state(&self, point: &Point) -> f64 {
        match self {
            Self::Law(memory, parameters) => (memory.steady_state)(parameters, point),
            Self::Own(expression, parameters) => expression.memory_at_rest(parameters, point),
        }
    }

    /// The state a span [s] later, the point held.
    #[inline]
    pub(super) fn advance(&self, state: f64, point: &Point, span: f64) -> f64 {
        self.advance_by(state, point, self.transition(span))
    }

    /// What spans of one length [s] have in common.
    #[inline]
    pub(super) fn transition(&self, span: f64) -> f64 {
        match self {
            Self::Law(memory, parameters) => (memory.transition)(parameters, span),
            Self::Own(..) => span,
        }
    }

    /// The state after a span with this transition, the point held.
    #[inline]
    pub(super) fn advance_by(&self, state: f64, point: &Point, transition: f64) -> f64 {
        match self {
            Self::Law(memory, parameters) => (memory.advance)(parameters, state, point, transition),
            Self::Own(expression, parameters) => {
                memory_after(expression, parameters, state, point, transition)
            }
        }
    }

    /// What it adds to its site.
    #[inline]
    pub(super) fn add(&self, state: f64, point: &Point) -> f64 {
        match self {
            Self::Law(memory, parameters) => (memory.add)(parameters, state, point),
            Self::Own(expression, parameters) => value_with(expression, parameters, state, point),
        }
    }

    /// [1/s] the fastest rate a simulation has to resolve.
    pub(super) fn rate(&self) -> f64 {
        match self {
            Self::Law(memory, parameters) => (memory.rate)(parameters),
            Self::Own(expression, parameters) => expression.memory_rate(parameters),
        }
    }

    /// [s] until its state stops at a corner, the point held, where it has one.
    #[inline]
    pub(super) fn corner(&self, state: f64, point: &Point) -> Option<f64> {
        match self {
            Self::Law(memory, parameters) => memory.corner.map(|corner| corner(parameters, state, point)),
            Self::Own(..) => None,
        }
    }

    /// Whether the state at a log's start matters for long.
    pub(super) fn is_slow(&self) -> bool {
        matches!(self, Self::Law(memory, _) if memory.slow)
    }
}

/// A model ready to run.
#[derive(Debug, Clone)]
pub struct Equations {
    pub(super) steady_rate: Vec<f64>,
    pub(super) voltage_gain: f64,
    pub(super) pole: f64,
    /// [1/(kg m²)] a division in each of the many calls would cost as much as a law.
    pub(super) per_inertia: f64,
    /// Whether a law turns round within a few milliseconds, or may.
    pub(super) is_stiff: bool,
    /// Whether no law on the body looks at anything but how it moves.
    pub(super) sees_motion_only: bool,
    /// Whether a law on the command may look at the time.
    pub(super) looks_at_time: bool,
    /// Whether one reads the battery.
    pub(super) reads_battery: bool,
    /// Whether a law on the steady rate stops at a corner.
    pub(super) has_corner: bool,
    /// The constants every law may look at.
    pub(super) constants: Point,
    pub(super) command_delay: f64,
    pub(super) command: Vec<Hook>,
    pub(super) steady: Vec<Hook>,
    pub(super) acceleration: Vec<Hook>,
    pub(super) rotor_sensor: Vec<Hook>,
    pub(super) thrust: Vec<Hook>,
    pub(super) actuator_delay: f64,
    /// Laws with memory on the actuators' torque, before the body.
    pub(super) torque_stream: Vec<Hook>,
    pub(super) torque: Vec<Hook>,
    /// Expressions that remember, on the torque: they see the body as it was measured.
    pub(super) remembered_torque: Vec<Hook>,
    pub(super) rate_sensor: Vec<Hook>,
}

impl Model {
    /// The model without its effects.
    #[must_use]
    pub fn bare_equations(&self) -> Equations {
        Equations {
            steady_rate: self.actuator.steady_rate.clone(),
            voltage_gain: self.actuator.voltage_gain,
            pole: self.actuator.pole,
            per_inertia: 1.0 / self.body.inertia,
            is_stiff: false,
            sees_motion_only: true,
            looks_at_time: false,
            reads_battery: false,
            has_corner: false,
            constants: Point {
                full_voltage: self.actuator.full_voltage,
                battery_voltage: self.actuator.full_voltage,
                pole: self.actuator.pole,
                hover_rate: self.actuator.hover_rate,
                hover_command: self.hover_command(),
                arm: self.body.arm,
                thrust_coefficient: self.actuator.thrust_coefficient,
                side: 1.0,
                ..Point::default()
            },
            command_delay: 0.0,
            command: Vec::new(),
            steady: Vec::new(),
            acceleration: Vec::new(),
            rotor_sensor: Vec::new(),
            thrust: Vec::new(),
            actuator_delay: 0.0,
            torque_stream: Vec::new(),
            torque: Vec::new(),
            remembered_torque: Vec::new(),
            rate_sensor: Vec::new(),
        }
    }

    /// Binds the model's effects to their laws.
    ///
    /// # Errors
    /// [`ModelError`] when an effect is unknown.
    pub fn equations(&self) -> Result<Equations, ModelError> {
        let mut equations = self.bare_equations();
        let bound = |added: &AddedEffect| -> Result<(Effect, Vec<f64>), ModelError> {
            let effect = self.effect(&added.id)?;
            let value = |name: &String| added.parameters.get(name).copied().unwrap_or(f64::NAN);
            let parameters = effect.parameters.iter().map(|parameter| value(&parameter.name)).collect();
            Ok((effect, parameters))
        };
        let mut effects = self.effects.iter().map(bound).collect::<Result<Vec<_>, _>>()?;
        // Those of one place stay in the order in which they were added.
        effects.sort_by_key(|(effect, _)| place(effect));
        effects.into_iter().for_each(|(effect, parameters)| equations.bind(&effect, parameters));
        Ok(equations)
    }

    /// Whether the first of two effects of this model acts where the other one does, and before it.
    #[must_use]
    pub fn acts_before(&self, one: &Effect, other: &Effect) -> bool {
        let added = |effect: &Effect| self.effects.iter().position(|added| added.id == effect.id);
        one.site == other.site && (place(one), added(one)) < (place(other), added(other))
    }
}

/// Where an effect stands among those of its site, in whatever order they were added to a model.
///
/// On the command: a grid is that of the link, and the greatest command need not be one of its steps, so the command is cut off behind
/// it; a battery scales what the speed controller has made of all that. On the steady rate: what goes towards it goes towards all of it.
/// First the curve and the battery; a warm motor makes less of that; then laws of one's own; the speed controller ramps towards what they
/// come to, and what lags follows the ramp.
fn place(effect: &Effect) -> u8 {
    let term = effect.card.and_then(|card| card.acts_as);
    match (effect.site, term, &effect.law) {
        (Site::Command, Some(Term::VoltageScaling), _) => 2,
        (Site::Command, Some(Term::Saturation), _) => 1,
        (Site::SteadyRate, Some(Term::Lag), _) => 4,
        (Site::SteadyRate, Some(Term::SlewLimit), _) => 3,
        (Site::SteadyRate, _, Law::Expression(_)) => 2,
        (Site::SteadyRate, _, Law::Memory(_)) => 1,
        _ => 0,
    }
}

impl Equations {
    /// [N m] torque of two rotors at the given rates, before any effect. [LPC16] Eqs. (1), (12).
    #[must_use]
    pub fn rotor_torque(&self, rate_1: f64, rate_2: f64) -> f64 {
        self.constants.arm * self.constants.thrust_coefficient * (rate_1 * rate_1 - rate_2 * rate_2)
    }

    /// The same with commands that act `delay` [s] later.
    #[must_use]
    pub fn with_command_delay(mut self, delay: f64) -> Self {
        self.command_delay += delay;
        self
    }

    /// [s] by which commands act later than they are given.
    #[must_use]
    pub fn command_delay(&self) -> f64 {
        self.command_delay
    }

    /// [rad/s] the pole of a rotor.
    #[must_use]
    pub fn rotor_pole(&self) -> f64 {
        self.pole
    }

    fn bind(&mut self, effect: &Effect, parameters: Vec<f64>) {
        let Effect { site, ref law, .. } = *effect;
        let is_motion = |need: &String| [columns::BODY_RATE, columns::BODY_ANGLE].contains(&need.as_str());
        let sees_motion_only = effect.needs.iter().all(is_motion);
        self.sees_motion_only &= !matches!(site, Site::Thrust | Site::Torque) || sees_motion_only;
        self.is_stiff |= matches!(law, Law::Stiff(_) | Law::Expression(_));
        let hook = match law {
            Law::Delay(delay) => {
                let dead_time = delay(&parameters);
                if site == Site::Torque {
                    self.actuator_delay += dead_time
                } else {
                    self.command_delay += dead_time
                }
                return;
            }
            Law::Static(law) | Law::Stiff(law) | Law::PiecewiseConstant(law) => {
                Hook::Static(*law, parameters)
            }
            Law::Expression(expression) => Hook::Expression(Arc::clone(expression), parameters),
            Law::Memory(memory) => Hook::Memory(*memory, parameters),
        };
        let remembers = hook.memory().is_some();
        self.looks_at_time |= site == Site::Command && matches!(hook, Hook::Expression(..));
        self.reads_battery |=
            site == Site::Command && effect.needs.iter().any(|need| need == columns::BATTERY_VOLTAGE);
        self.has_corner |= matches!(&hook, Hook::Memory(memory, _) if memory.corner.is_some());
        match site {
            Site::Command => self.command.push(hook),
            Site::SteadyRate => self.steady.push(hook),
            Site::RotorAcceleration => self.acceleration.push(hook),
            Site::RotorRateSensor => self.rotor_sensor.push(hook),
            Site::Thrust => self.thrust.push(hook),
            Site::Torque if matches!(hook, Hook::Expression(..)) && remembers => {
                self.remembered_torque.push(hook);
            }
            Site::Torque if remembers => self.torque_stream.push(hook),
            Site::Torque => self.torque.push(hook),
            Site::BodyRateSensor => self.rate_sensor.push(hook),
        }
    }

    /// The point that a row of a log stands for: `at` reads a column, missing ones take what the model expects.
    #[must_use]
    pub fn point_at(&self, time: f64, at: &dyn Fn(&str) -> Option<f64>) -> Point {
        let read =
            |name: &str, otherwise: f64| at(name).filter(|value| value.is_finite()).unwrap_or(otherwise);
        let constants = self.constants;
        let command = read(columns::COMMANDS[0], constants.hover_command);
        let voltage = read(columns::BATTERY_VOLTAGE, constants.full_voltage);
        let mut point = self.steady_point(time, command, voltage, 1.0);
        point.propeller_rate_1 = read(columns::PROPELLER_RATES[0], constants.hover_rate);
        point.propeller_rate_2 = read(columns::PROPELLER_RATES[1], constants.hover_rate);
        point.propeller_rate = point.propeller_rate_1;
        point.thrust = constants.thrust_coefficient * point.propeller_rate * point.propeller_rate;
        point.torque =
            read(columns::TORQUE_COMMAND, self.rotor_torque(point.propeller_rate_1, point.propeller_rate_2));
        point.body_angle = read(columns::BODY_ANGLE, 0.0);
        point.body_rate = read(columns::BODY_RATE, 0.0);
        point
    }

    /// [-] what the laws on the command make of one, at a full battery.
    #[must_use]
    pub fn command_behind_laws(&self, command: f64) -> f64 {
        self.steady_point(0.0, command, self.constants.full_voltage, 1.0).command
    }

    /// [rad/s] z and the point it belongs to, before the laws that act on z. [LPC16] Eq. (2).
    fn steady_point(&self, time: f64, command: f64, voltage: f64, side: f64) -> Point {
        let mut point = Point { time, side, ..self.constants };
        point.steady_rate = self.steady_rate_at(&mut point, command, voltage);
        point
    }

    /// [rad/s] z at a command and a voltage, which the point learns, and what becomes of the command.
    #[inline]
    pub(super) fn steady_rate_at(&self, point: &mut Point, command: f64, voltage: f64) -> f64 {
        self.at_voltage(self.curve_at(point, command, voltage), voltage)
    }

    /// [rad/s] the same of a full battery, what laws on the command read of it apart.
    #[inline]
    pub(super) fn curve_at(&self, point: &mut Point, command: f64, voltage: f64) -> f64 {
        (point.command, point.battery_voltage) = (command, voltage);
        for hook in &self.command {
            point.command += hook.add(point);
        }
        polynomial(&self.steady_rate, point.command)
    }

    /// [rad/s] what a voltage leaves of a curve.
    #[inline]
    pub(super) fn at_voltage(&self, curve: f64, voltage: f64) -> f64 {
        // **Deviation:** Eq. (2) prints a plus, which contradicts Eq. (6).
        curve - self.voltage_gain * (self.constants.full_voltage - voltage)
    }
}
