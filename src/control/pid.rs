//! PID. [LPC16] section IV.B.

use super::allocate::Allocator;
use super::compensation::Compensation;
use super::config::{ControllerConfig, PidConfig};
use super::controller::{Controller, code};
use super::error::{ControlError, check_period};
use super::fresh_readings::{AngleCorrection, FreshReadings};
use super::parameters::PlantParameters;
use crate::signal::{Applied, Command, CommandFlags, Reference, Sensors, StateEstimate};

/// A built PID.
#[derive(Debug, Clone, PartialEq)]
pub struct Pid {
    gains: PidConfig,
    /// [s] T_c.
    period_s: f64,
    /// [N m s/rad] torque of one rad/s of rotor difference.
    torque_slope: f64,
    allocator: Allocator,
    known: Option<Compensation>,
    angle: AngleCorrection,
    start_angle: f64,
    full_voltage: f64,
}

/// The integrated angle, the integral, and what the last step asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct PidState {
    /// [rad] integral of the gyro.
    angle: f64,
    /// [rad/s] last rate used.
    rate: f64,
    /// [rad] x_I, sum of the errors.
    x_i: f64,
    /// [N m] torque asked for in the last step.
    asked: f64,
    saturated: bool,
    sequence: u64,
    readings: FreshReadings,
}

impl Pid {
    /// Builds from the whole controller configuration, since reference and angle settings belong to it.
    ///
    /// # Errors
    /// [`ControlError`] names the parameter.
    pub fn build(
        config: &ControllerConfig,
        plant: &PlantParameters,
        known: &Compensation,
        period_s: f64,
    ) -> Result<Self, ControlError> {
        check_period(period_s)?;
        config.pid.validate()?;
        config.reference.build(period_s)?;
        Ok(Self {
            gains: config.pid,
            period_s,
            torque_slope: plant.inertia * plant.torque_gain(),
            allocator: Allocator::build(plant, known)?,
            known: known.acts_on_body().then_some(*known),
            angle: AngleCorrection::build(config.use_body_angle, period_s),
            start_angle: config.reference.angle_rad,
            full_voltage: plant.full_voltage,
        })
    }

    /// The gains in use.
    #[must_use]
    pub fn gains(&self) -> PidConfig {
        self.gains
    }

    /// [N m] known torque on the body at the angle [rad] and the rate [rad/s].
    #[inline(always)]
    fn known_torque(&self, angle: f64, rate: f64) -> f64 {
        self.known.as_ref().map_or(0.0, |known| torque_of(known, angle, rate))
    }

    /// Whether the rotors gave less than was asked for, in the direction in which `error` would ask for more.
    #[inline(always)]
    fn winds_up(&self, state: &PidState, applied: &Applied, voltage: f64, error: f64) -> bool {
        if applied.flags == 0 && !state.saturated {
            return false;
        }
        let got = self.allocator.difference(applied.rotor, voltage) * self.torque_slope;
        (state.asked - got) * error >= 0.0
    }
}

// Apart, so that the sines of the few do not spill the registers of the many.
#[inline(never)]
fn torque_of(known: &Compensation, angle: f64, rate: f64) -> f64 {
    known.torque(angle, rate)
}

impl Pid {
    /// Takes in angle and rate of the body as they were measured; whether the rate was.
    #[inline]
    fn take_in(&self, state: &mut PidState, sensors: &Sensors, resting: bool) -> bool {
        let measured = state.readings.body_rate(sensors);
        if resting {
            state.angle = self.angle.measured(sensors).unwrap_or(self.start_angle);
            state.x_i = 0.0;
        } else {
            state.angle = self.angle.correct(state.angle, sensors);
        }
        state.rate = measured.unwrap_or(state.rate);
        measured.is_some()
    }
}

impl Controller for Pid {
    type State = PidState;

    fn start(&self) -> PidState {
        PidState {
            angle: self.start_angle,
            rate: 0.0,
            x_i: 0.0,
            asked: 0.0,
            saturated: false,
            sequence: 0,
            readings: FreshReadings::start(self.full_voltage),
        }
    }

    fn step(
        &self,
        state: &mut PidState,
        sensors: &Sensors,
        reference: &Reference,
        applied: &Applied,
    ) -> Command {
        let (t_c, PidConfig { k_p, k_i, k_d }) = (self.period_s, self.gains);
        let (voltage, voltage_assumed) = state.readings.voltage(sensors);
        let resting = applied.command_sequence == 0;
        let is_measured = self.take_in(state, sensors, resting);

        // [LPC16] Eq. (30), with x_2 / T_c the body rate; a slew's own rate is no reason to brake.
        let e = reference.angle - state.angle;
        let integral = k_i * t_c * state.x_i;
        let feedback = k_p * e - k_d * (state.rate - reference.rate) + integral;
        let torque = feedback - self.known_torque(state.angle, state.rate);
        let allocation = self.allocator.allocate(torque / self.torque_slope, voltage);

        let estimate = StateEstimate {
            reference_angle: reference.angle,
            body_angle: state.angle,
            body_rate: state.rate,
            actuator_acceleration: 0.0,
            // The torque on the body that the integral has grown against; from zero, lest rest be reported as -0.
            disturbance_torque: 0.0 - integral,
            model_error: 0.0,
        };
        if !resting && !self.winds_up(state, applied, voltage, e) {
            state.x_i += e;
        }
        state.angle += t_c * state.rate;
        state.asked = torque;
        state.saturated = allocation.saturated;
        state.sequence += 1;

        Command {
            sequence: state.sequence,
            stamp_ns: 0,
            sensors_sequence: sensors.sequence,
            rotor: allocation.rotor,
            torque,
            flags: CommandFlags::of(allocation.saturated, !is_measured, voltage_assumed),
            controller: code::PID,
            estimate,
        }
    }
}
