//! Discrete linear systems.

use nalgebra::{Complex, DMatrix, DVector};

/// A discrete linear system with one input and one output: x⁺ = A x + b u, y = cᵀ x + d u.
#[derive(Debug, Clone, PartialEq)]
pub struct SisoSystem {
    /// A.
    pub a: DMatrix<f64>,
    /// b.
    pub b: DVector<f64>,
    /// c.
    pub c: DVector<f64>,
    /// d.
    pub d: f64,
}

impl SisoSystem {
    pub(super) fn zeros(states: usize) -> Self {
        let zeros = DVector::zeros(states);
        Self { a: DMatrix::zeros(states, states), b: zeros.clone(), c: zeros, d: 0.0 }
    }

    /// cᵀ (z I - A)⁻¹ b + d; not a number at a pole.
    #[must_use]
    pub fn response(&self, z: Complex<f64>) -> Complex<f64> {
        let complex = |value: f64| Complex::new(value, 0.0);
        let states = self.b.len();
        let matrix = DMatrix::from_diagonal_element(states, states, z) - self.a.map(complex);
        match matrix.lu().solve(&self.b.map(complex)) {
            Some(x) => self.c.map(complex).dot(&x) + self.d,
            None => Complex::new(f64::NAN, f64::NAN),
        }
    }
}
