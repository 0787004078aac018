//! Settings of the guard, and their check at the door.

use serde::{Deserialize, Serialize};

use super::signals::{Signal, SignalLimit};
use super::{Guard, Limits};
use crate::clock::span_ns;

/// The `[guard]` table of the bench file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GuardConfig {
    /// [s] how long a command is held when no fresh one comes: N whole periods, rounded up. The rotors' own
    /// time constant (62 ms in the paper) is what a hold can be short of.
    pub hold_s: f64,
    /// Periods from the end of the hold to zero.
    pub ramp_periods: u32,
    /// [s] age at which a command may no longer leave; unset = N + 1 periods.
    pub command_time_to_live_s: Option<f64>,
    /// [-] highest command that leaves, at most 1.
    pub rotor_maximum: f64,
    /// [1/s] fastest change of a command, up and down.
    pub slew_per_s: f64,
    /// [s] time after arming in which the limit rises from 0 to `rotor_maximum`.
    pub spin_up_s: f64,
    /// [periods] level of the leaky bucket at which misses are too many, though never N in a row; unset = 3 N.
    pub bucket_limit: Option<f64>,
    /// [-] what each clean period takes out of the bucket; each missed one puts 1 in.
    pub bucket_leak: f64,
    /// Swings of one rotor's command from limit to limit that are too many; about a third of them leak away
    /// in each second.
    pub swing_limit: u32,
    /// [s] how long everything must be good before the bench is armed.
    pub arm_checks_s: f64,
    /// [s] when it is given up.
    pub arm_timeout_s: f64,
    /// [s] age at which an `arm` or `disarm` is no longer obeyed.
    pub request_time_to_live_s: f64,
    /// Gyroscope.
    pub body_rate: SignalConfig,
    /// Encoder at the pivot.
    pub body_angle: SignalConfig,
    /// Battery.
    pub battery_voltage: SignalConfig,
    /// Rotor speeds, both.
    pub propeller_rate: SignalConfig,
    /// Currents, both.
    pub current: SignalConfig,
    /// Load cells, both.
    pub thrust: SignalConfig,
}

impl Default for GuardConfig {
    fn default() -> Self {
        Self {
            hold_s: 0.1,
            ramp_periods: 2,
            command_time_to_live_s: None,
            rotor_maximum: 0.9,
            slew_per_s: 10.0,
            spin_up_s: 0.5,
            bucket_limit: None,
            bucket_leak: 0.5,
            swing_limit: 10,
            arm_checks_s: 0.2,
            arm_timeout_s: 2.0,
            request_time_to_live_s: 1.0,
            body_rate: SignalConfig::default(),
            body_angle: SignalConfig::default(),
            battery_voltage: SignalConfig::default(),
            propeller_rate: SignalConfig::default(),
            current: SignalConfig::default(),
            thrust: SignalConfig::default(),
        }
    }
}

/// Limits of one signal. Unset = the signal's own default, in the README's table.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SignalConfig {
    /// Whether the bench may run only while this signal is good.
    pub required: Option<bool>,
    /// [s] age of the last good value at which the rotors are stopped; default: the hold time.
    pub stale_after_s: Option<f64>,
    /// Lowest possible value, in SI.
    pub minimum: Option<f64>,
    /// Highest possible value, in SI.
    pub maximum: Option<f64>,
    /// [s] how long the value may stay the same to the last bit while frames go on and a rotor is commanded;
    /// 0 = for ever. A sensor that is coarse against its own noise needs a longer time than the default.
    pub frozen_after_s: Option<f64>,
}

/// Why a guard cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GuardError {
    /// A number out of its range.
    #[error("guard {name} is {value}: it must be {rule}")]
    Setting {
        /// Name in the file.
        name: String,
        /// Value found.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
}

/// Default limits of one signal: required, stale after [s] (0 = hold), minimum, maximum, frozen after [s]
/// (negative = hold, 0 = never).
struct Defaults(bool, f64, f64, f64, f64);

#[rustfmt::skip]
fn defaults(signal: Signal) -> Defaults {
    match signal {
        Signal::BodyRate => Defaults(true, 0.0, -20.0, 20.0, -1.0),
        Signal::BodyAngle => Defaults(false, 0.0, -3.2, 3.2, 0.0),
        Signal::BatteryVoltage => Defaults(true, 1.0, 6.0, 60.0, 0.0),
        Signal::PropellerRate1 | Signal::PropellerRate2 => Defaults(true, 0.0, -10.0, 3000.0, 0.5),
        Signal::Current1 | Signal::Current2 => Defaults(false, 1.0, -50.0, 200.0, 0.0),
        Signal::Thrust1 | Signal::Thrust2 => Defaults(false, 1.0, -50.0, 500.0, 0.0),
    }
}

impl GuardConfig {
    /// Checks every number and builds the guard for this control period.
    ///
    /// # Errors
    /// [`GuardError::Setting`] names the setting.
    pub fn build(&self, period_s: f64) -> Result<Guard, GuardError> {
        const POSITIVE: &str = "a positive number";
        const NOT_NEGATIVE: &str = "zero or a positive number";
        within("period_s", period_s, 1e-5, 10.0, "from 0.00001 to 10")?;
        within("hold_s", self.hold_s, f64::MIN_POSITIVE, 10.0, "above 0 and at most 10")?;
        within("rotor_maximum", self.rotor_maximum, f64::MIN_POSITIVE, 1.0, "above 0 and at most 1")?;
        within("slew_per_s", self.slew_per_s, f64::MIN_POSITIVE, f64::MAX, POSITIVE)?;
        within("spin_up_s", self.spin_up_s, 0.0, 60.0, "from 0 to 60")?;
        within("bucket_leak", self.bucket_leak, 0.0, f64::MAX, NOT_NEGATIVE)?;
        within("arm_checks_s", self.arm_checks_s, 0.0, 60.0, "from 0 to 60")?;
        within("arm_timeout_s", self.arm_timeout_s, self.arm_checks_s, 3600.0, "from arm_checks_s to 3600")?;
        within(
            "request_time_to_live_s",
            self.request_time_to_live_s,
            f64::MIN_POSITIVE,
            60.0,
            "above 0 and at most 60",
        )?;
        within("ramp_periods", f64::from(self.ramp_periods), 0.0, 1000.0, "at most 1000")?;
        within("swing_limit", f64::from(self.swing_limit), 1.0, 1e6, "at least 1")?;
        // The sliver keeps 0.1 s at 0.02 s five periods, not six.
        let hold_periods = (self.hold_s / period_s - 1e-9).ceil().max(1.0);
        let time_to_live = self.command_time_to_live_s.unwrap_or((hold_periods + 1.0) * period_s);
        within("command_time_to_live_s", time_to_live, period_s, 60.0, "from one period to 60")?;
        let bucket_limit = self.bucket_limit.unwrap_or(3.0 * hold_periods);
        within("bucket_limit", bucket_limit, f64::MIN_POSITIVE, f64::MAX, POSITIVE)?;
        let period_ns = span_ns(period_s);
        let hold_ns = period_ns.saturating_mul(hold_periods as u64);
        let mut signals = [SignalLimit::default(); Signal::COUNT];
        for (limit, signal) in signals.iter_mut().zip(Signal::ALL) {
            *limit = self.signal(signal).resolve(signal, hold_ns)?;
        }
        Ok(Guard {
            limits: Limits { maximum: self.rotor_maximum, slew_per_s: self.slew_per_s },
            period_ns,
            hold_ns,
            hold_periods: hold_periods as u32,
            ramp_periods: self.ramp_periods,
            time_to_live_ns: span_ns(time_to_live),
            spin_up_ns: span_ns(self.spin_up_s),
            bucket_limit,
            bucket_leak: self.bucket_leak,
            swing_limit: f64::from(self.swing_limit),
            arm_checks_ns: span_ns(self.arm_checks_s),
            arm_timeout_ns: span_ns(self.arm_timeout_s),
            request_time_to_live_ns: span_ns(self.request_time_to_live_s),
            signals,
        })
    }

    fn signal(&self, signal: Signal) -> &SignalConfig {
        match signal {
            Signal::BodyRate => &self.body_rate,
            Signal::BodyAngle => &self.body_angle,
            Signal::BatteryVoltage => &self.battery_voltage,
            Signal::PropellerRate1 | Signal::PropellerRate2 => &self.propeller_rate,
            Signal::Current1 | Signal::Current2 => &self.current,
            Signal::Thrust1 | Signal::Thrust2 => &self.thrust,
        }
    }
}

impl SignalConfig {
    fn resolve(&self, signal: Signal, hold_ns: u64) -> Result<SignalLimit, GuardError> {
        let Defaults(required, stale_s, lowest, highest, frozen_s) = defaults(signal);
        let minimum = self.minimum.unwrap_or(lowest);
        let maximum = self.maximum.unwrap_or(highest);
        let named = |field: &str| format!("{signal} {field}");
        within(&named("minimum"), minimum, -f64::MAX, f64::MAX, "a number")?;
        within(&named("maximum"), maximum, minimum, f64::MAX, "a number not below the minimum")?;
        if let Some(given) = self.stale_after_s {
            within(&named("stale_after_s"), given, f64::MIN_POSITIVE, 60.0, "above 0 and at most 60")?;
        }
        if let Some(given) = self.frozen_after_s {
            within(&named("frozen_after_s"), given, 0.0, 3600.0, "from 0 to 3600")?;
        }
        let span = |seconds: f64, hold: bool| if hold { hold_ns } else { span_ns(seconds) };
        let frozen_s = self.frozen_after_s.unwrap_or(frozen_s);
        let stale_s = self.stale_after_s.unwrap_or(stale_s);
        Ok(SignalLimit {
            required: self.required.unwrap_or(required),
            stale_after_ns: span(stale_s, stale_s == 0.0),
            minimum,
            maximum,
            frozen_after_ns: span(frozen_s, frozen_s < 0.0),
        })
    }
}

fn within(name: &str, value: f64, lowest: f64, highest: f64, rule: &'static str) -> Result<(), GuardError> {
    if value >= lowest && value <= highest {
        return Ok(());
    }
    Err(GuardError::Setting { name: name.to_owned(), value, rule })
}
