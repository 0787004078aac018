//! Numbers that decide something in reading logs.

crate::thresholds! {
    /// [-] median sampling intervals from which a gap is a hole: one lost sample is jitter, two are a hole.
    hole: f64 = 2.5, "-", "judgement";
    /// [-] median intervals of an input for which it is held over missing cells, at most.
    input_hold: f64 = 2.5, "-", "judgement";
    /// count: rows behind a backward stamp that are looked at to tell a glitch from a log that begins anew.
    restart_rows: usize = 10, "count", "judgement";
}
