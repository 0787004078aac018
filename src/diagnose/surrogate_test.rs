//! How often a meaningless candidate does as well: the trace an effect leaves in the simulation, shifted in time.

use super::candidate_fit::CandidateFit;
use super::thresholds::THRESHOLDS;
use crate::estimation::surrogate_test::SurrogateConfig;
pub use crate::estimation::surrogate_test::SurrogateTest;

const CONFIG: SurrogateConfig = SurrogateConfig {
    surrogates: THRESHOLDS.surrogates,
    quantile: THRESHOLDS.surrogate_quantile,
    rare_p_value: THRESHOLDS.rare_p_value,
    fewest_windows: THRESHOLDS.fewest_windows,
    patchy: THRESHOLDS.patchy,
    least_shared_power: THRESHOLDS.least_shared_power,
    least_shift: THRESHOLDS.least_surrogate_shift,
};

/// What shifted traces of what `with` adds to `without` do for the held-out residual. `period` is the length of a window of
/// the residual vector (1 = none).
#[must_use]
pub fn surrogate(without: &CandidateFit, with: &CandidateFit, period: usize) -> SurrogateTest {
    let before = without.held_out.residuals.all();
    let trace = without.held_out.residuals.minus(&with.held_out.residuals);
    SurrogateTest::of(&trace, &before, period, &CONFIG)
}
