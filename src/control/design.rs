//! Design of the discrete loop: margins, eigenvalues, advice.
