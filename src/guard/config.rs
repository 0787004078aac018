//! Settings of the guard, and their check.

use serde::{Deserialize, Serialize};

use super::built::{Guard, Limits};
use super::signals::SignalLimit;
use super::speed_config::SpeedCheckConfig;
use super::speed_model::{SpeedCheckError, SpeedModel};
use super::thresholds::{THRESHOLDS, share_of};
use crate::clock::span_ns;
use crate::model::Model;
use crate::signal::channels::sensor_table;
use crate::signal::{After, Channel, GuardRow, Sensor};

macro_rules! guard_config {
    ($(
        $(#[$doc:meta])*
        $field:ident: $type:ty as $sensor:ident, $unit:literal $suffix:literal,
        [$($channels:tt)+],
        guard($($watched:ident = $guard:expr)?),
        $row:expr;
    )+) => {
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
            /// Whether the rotors' reported speeds are held against the commands, by the bench's model.
            pub speed_check: SpeedCheckConfig,
            $($(
                #[doc = concat!("Limits of `", stringify!($watched), "`.")]
                pub $watched: SignalLimitsConfig,
            )?)+
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
                    speed_check: SpeedCheckConfig::default(),
                    $($($watched: SignalLimitsConfig::default(),)?)+
                }
            }
        }

        impl GuardConfig {
            /// The settings of a sensor; `None` where the guard does not watch it.
            #[must_use]
            pub fn of(&self, sensor: Sensor) -> Option<&SignalLimitsConfig> {
                match sensor {
                    $($(Sensor::$sensor => Some(&self.$watched),)?)+
                    _ => None,
                }
            }

            /// The settings of a sensor, to change.
            #[must_use]
            pub fn of_mut(&mut self, sensor: Sensor) -> Option<&mut SignalLimitsConfig> {
                match sensor {
                    $($(Sensor::$sensor => Some(&mut self.$watched),)?)+
                    _ => None,
                }
            }
        }
    };
}
sensor_table!(guard_config);

/// Limits of one signal. Unset = the signal's own default, in the table of docs/guide/guard.md.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SignalLimitsConfig {
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
        /// What people call it: a setting, or a signal's.
        name: String,
        /// Its key in the bench file, from the top.
        key: String,
        /// Value found.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
    /// The rotors' speeds cannot be held against the model.
    #[error(transparent)]
    SpeedCheck(#[from] SpeedCheckError),
}

impl GuardConfig {
    /// Checks every number and builds the guard for this control period, of a bench whose speeds are not held against its model.
    ///
    /// # Errors
    /// [`GuardError::Setting`] names the setting; [`GuardError::SpeedCheck`] where they are to be.
    pub fn build(&self, period_s: f64) -> Result<Guard, GuardError> {
        self.build_with(period_s, None)
    }

    /// The same of a bench with this model.
    ///
    /// # Errors
    /// As [`GuardConfig::build`]; [`GuardError::SpeedCheck`] where the model cannot say what speeds to expect.
    pub fn build_on(&self, period_s: f64, model: &Model) -> Result<Guard, GuardError> {
        self.build_with(period_s, Some(model))
    }

    fn build_with(&self, period_s: f64, model: Option<&Model>) -> Result<Guard, GuardError> {
        self.check(period_s)?;
        let speed = match (self.speed_check.on, model) {
            (false, _) => None,
            (true, None) => return Err(SpeedCheckError::NoModel.into()),
            (true, Some(model)) => Some(SpeedModel::build(model, self.speed_check.band)?),
        };
        // The sliver keeps 0.1 s at 0.02 s five periods, not six.
        let hold_periods = (self.hold_s / period_s - 1e-9).ceil().max(1.0);
        let time_to_live = self.command_time_to_live_s.unwrap_or((hold_periods + 1.0) * period_s);
        within("command_time_to_live_s", time_to_live, period_s, 60.0, "from one period to 60")?;
        let bucket_limit = self.bucket_limit.unwrap_or(THRESHOLDS.bucket_holds * hold_periods);
        within("bucket_limit", bucket_limit, f64::MIN_POSITIVE, f64::MAX, "a positive number")?;
        let period_ns = span_ns(period_s);
        let hold_ns = period_ns.saturating_mul(hold_periods as u64);
        let mut signals = [SignalLimit::default(); Channel::WATCHED.len()];
        for (limit, channel) in signals.iter_mut().zip(Channel::WATCHED) {
            let sensor = channel.sensor();
            if let (Some(settings), Some(row)) = (self.of(sensor), sensor.guard()) {
                *limit = settings.resolve(&row, channel, hold_ns)?;
            }
        }
        Ok(Guard {
            limits: Limits { maximum: self.rotor_maximum, slew_per_s: self.slew_per_s },
            period_ns,
            hold_ns,
            lateness_ns: share_of(THRESHOLDS.lateness_share, period_ns),
            held_ns: share_of(THRESHOLDS.held_share, period_ns),
            // As with a signal, half of the hold degrades; a controller that just missed a frame is not deaf.
            unanswered_ns: share_of(THRESHOLDS.warning_share, hold_ns)
                .max(share_of(THRESHOLDS.unanswered_periods, period_ns)),
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
            speed,
            signals,
        })
    }

    /// Checks the numbers that stand for themselves.
    fn check(&self, period_s: f64) -> Result<(), GuardError> {
        const POSITIVE: &str = "a positive number";
        const NOT_NEGATIVE: &str = "zero or a positive number";
        let of_bench = ("period_s", "period_s".to_owned());
        in_range(of_bench, period_s, 1e-5, 10.0, "from 0.00001 to 10")?;
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
        within("speed_check.band", self.speed_check.band, 1.0, 1000.0, "from 1 to 1000")?;
        within("ramp_periods", f64::from(self.ramp_periods), 0.0, 1000.0, "at most 1000")?;
        within("swing_limit", f64::from(self.swing_limit), 1.0, 1e6, "at least 1")
    }
}

impl SignalLimitsConfig {
    fn resolve(&self, row: &GuardRow, channel: Channel, hold_ns: u64) -> Result<SignalLimit, GuardError> {
        let minimum = self.minimum.unwrap_or(row.range.0);
        let maximum = self.maximum.unwrap_or(row.range.1);
        // Both rotors have one table.
        let (label, table) = (channel.label(), channel.sensor().name());
        let check = |field: &str, value: f64, lowest: f64, highest: f64, rule: &'static str| {
            let name = format!("{label} {field}");
            in_range((&name, format!("guard.{table}.{field}")), value, lowest, highest, rule)
        };
        check("minimum", minimum, -f64::MAX, f64::MAX, "a number")?;
        check("maximum", maximum, minimum, f64::MAX, "a number not below the minimum")?;
        if let Some(given) = self.stale_after_s {
            check("stale_after_s", given, f64::MIN_POSITIVE, 60.0, "above 0 and at most 60")?;
        }
        if let Some(given) = self.frozen_after_s {
            check("frozen_after_s", given, 0.0, 3600.0, "from 0 to 3600")?;
        }
        let span = |given: Option<f64>, row: After, never_ns: u64| match given.map_or(row, After::Seconds) {
            After::Hold => hold_ns,
            After::Seconds(seconds) => span_ns(seconds),
            After::Never => never_ns,
        };
        let stale_after_ns = span(self.stale_after_s, row.stale_after, u64::MAX);
        Ok(SignalLimit {
            required: self.required.unwrap_or(row.required),
            stale_after_ns,
            warning_ns: share_of(THRESHOLDS.warning_share, stale_after_ns),
            minimum,
            maximum,
            frozen_after_ns: span(self.frozen_after_s, row.frozen_after, 0),
        })
    }
}

/// Checks a setting of the guard's own table.
fn within(name: &str, value: f64, lowest: f64, highest: f64, rule: &'static str) -> Result<(), GuardError> {
    in_range((name, format!("guard.{name}")), value, lowest, highest, rule)
}

fn in_range(
    (name, key): (&str, String),
    value: f64,
    lowest: f64,
    highest: f64,
    rule: &'static str,
) -> Result<(), GuardError> {
    if value >= lowest && value <= highest {
        return Ok(());
    }
    Err(GuardError::Setting { name: name.to_owned(), key, value, rule })
}
