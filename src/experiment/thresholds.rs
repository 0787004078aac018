//! Numbers that decide which experiments are refused.

crate::thresholds! {
    /// a smaller amplitude moves nothing that can be measured, and of none at all nothing is learned
    least_amplitude: f64 = 1e-4, "-", "judgement";
    /// periods that a ramp takes from one end to the other at least: faster, and nothing of it is left on their grid
    fewest_ramp_periods: f64 = 4.0, "periods", "judgement";
    /// a slower ramp never ends
    slowest_ramp: f64 = 1e-4, "1/s", "judgement";
    /// longest experiment: a day
    longest_s: f64 = 86_400.0, "s", "judgement";
    /// longest lead-in
    longest_lead_in_s: f64 = 600.0, "s", "judgement";
}
