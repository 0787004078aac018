//! Mathematics of estimation, without rotors and without logs, each tool once.

pub mod autocorrelation;
pub mod consistency;
pub mod cross_correlation;
pub mod dependence;
pub mod frequency_response;
pub mod golden_section;
pub mod inversion;
pub mod lag_products;
mod lagged_products;
pub mod least_squares;
pub mod moments;
pub mod noise_by_blocks;
pub mod noise_floor;
pub mod normal_equations;
pub mod output_error;
pub mod quantile;
pub mod quantization_step;
mod ranks;
pub(crate) mod ridge;
pub mod robust_errors;
pub mod slope;
pub mod smoother;
pub mod surrogate_test;
pub mod third_differences;
pub mod thresholds;
pub mod variable_projection;
pub mod welch;
