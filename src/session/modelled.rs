//! Logs as models are held against them.

use crate::screening::many_rotors::{beyond_bench, body_left_out, of_rotors};
use crate::screening::same_bench::of_one_bench;
use crate::screening::{Finding, ScreenedLog};

/// Each judged with what the others of the bench show; of a machine with many rotors without the body.
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
        let mut train = of_one_bench(&[train, validate].concat());
        let validate = train.split_off(train.len() - validate.len());
        let rotors = beyond_bench(&train);
        if rotors.is_empty() {
            return Self { train, validate, rotors, finding: None };
        }
        let finding = body_left_out(&train, &rotors);
        Self { train: of_rotors(&train, &rotors), validate: of_rotors(&validate, &rotors), rotors, finding }
    }
}
