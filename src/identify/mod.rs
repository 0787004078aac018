//! Section III of the paper, then general fitting.

pub mod fit;
