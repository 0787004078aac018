//! Numbers that decide what is said of a changed model.

crate::thresholds! {
    /// [-] an error that keeps more than this share has not fallen: half a percent is what any free parameter takes from noise
    fallen_share: f64 = 0.995, "-", "judgement";
}
