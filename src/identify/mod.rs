//! Section III of [LPC16] as a pipeline, and joint estimation.
//!
//! [`identify`] takes logs of any kind, finds what each of them permits (and whether each rotor's rates can be those of its
//! commands, `command_response`), and goes the paper's way as far as they reach:
//!
//! 1. k_V from stretches of constant command, [LPC16] Eq. (6) (`voltage_gain`);
//! 2. g(u) from slow ramps, Eq. (9), its degree by cross-validation, and whether the ramps were slow enough for
//!    Eq. (4) (`static_curve`, `ramp_lag`);
//! 3. p from exciting commands, section III.B, by output error (`pole`), against a delay and a second pole (`lag_order`),
//!    with the delay in the model where the data determine it (`dead_time`);
//! 4. the thrust curve where thrust was measured, Eq. (13) (`thrust_curve`), the body from attitude logs, Eq. (1)
//!    (`inertia`);
//! 5. validation on other logs as in Fig. 3 (`validate`).
//!
//! Where ramps or constant commands are missing, pole, curve and battery gain come from one joint estimation (`joint_fit`).
//! Standard errors allow for correlated residuals. What is found on the way is a [`Finding`](crate::screening::Finding) with a code and numbers.

mod actuator;
mod assemble;
mod command_response;
mod command_timing;
mod consistency;
mod dead_time;
mod error;
mod inertia;
mod inputs;
#[cfg(test)]
mod interval_coverage;
mod joint_fit;
mod lag_order;
mod missed_level;
mod mistaken_columns;
mod omitted_torque;
pub(crate) mod pipeline;
mod possible_gain;
mod ramp_lag;
mod regressors;
mod response_sign;
mod result;
mod rotor_error;
mod rotor_mismatch;
mod significance;
mod single_rotor_fit;
mod static_curve;
mod steady_rows;
mod step_times;
mod steps;
mod supply_gain;
pub mod thresholds;
mod thrust_curve;
mod unidentified;
mod validate;
mod voltage_gain;
mod voltage_instruments;
mod work;

pub use crate::estimation::estimate::Estimate;
pub(crate) use crate::estimation::estimate::Weighted;
pub use actuator::IdentifiedActuator;
pub use dead_time::Delay;
pub use error::IdentifyError;
pub use inertia::IdentifiedBody;
pub use joint_fit::JointFit;
pub use lag_order::LagAlternative;
pub use mistaken_columns::{check_columns, mistaken_and_lacking};
pub use pipeline::{STEPS, identify, identify_with_progress};
pub use result::{Identification, IdentifySettings, PipelineStep, PoleFit, RotorModel};
pub use rotor_error::rotor_error;
pub use static_curve::{DegreeScore, RampCheck, StaticCurve};
pub use steady_rows::HIGHEST_DEGREE;
pub use supply_gain::SupplyGain;
pub use thrust_curve::ThrustCurve;
pub use validate::Validation;
pub use voltage_gain::{BatteryGain, LevelGain};
