//! Mathematics of estimation, without rotors and without logs: least squares, output error, variable projection, spectra,
//! noise floors, tests of dependence.

pub mod dependence;
pub mod least_squares;
pub mod noise_floor;
pub mod normal_equations;
pub mod output_error;
pub mod quantile;
pub mod spectrum;
pub mod variable_projection;
