//! Logs as models are held against them.

use crate::screening::many_rotors::{beyond_bench, body_left_out, of_rotors};
use crate::screening::{Finding, ScreenedLog};

/// Of a machine with many rotors its logs without the body.
pub(super) struct Modelled {
    pub train: Vec<ScreenedLog>,
    pub validate: Vec<ScreenedLog>,
    /// The rotors of a machine with many; else none.
    pub rotors: Vec<usize>,
    /// The body was left out.
    pub finding: Option<Finding>,
}

impl Modelled {
    pub fn of(train: &[ScreenedLog], validate: &[ScreenedLog]) -> Self {
        let rotors = beyond_bench(train);
        if rotors.is_empty() {
            return Self { train: train.to_vec(), validate: validate.to_vec(), rotors, finding: None };
        }
        let finding = body_left_out(train, &rotors);
        Self { train: of_rotors(train, &rotors), validate: of_rotors(validate, &rotors), rotors, finding }
    }
}
