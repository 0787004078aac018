//! Numbers that decide who is served, and how much of a log a picture takes.

crate::thresholds! {
    /// a request's body above this is refused: an act is a few words
    largest_body: usize = 65_536, "byte", "judgement";
    /// connections beyond this end the oldest that has not shown the token; a browser opens six to a host
    most_connections: usize = 64, "count", "judgement";
    /// a connection that has not sent the head of a request for so long is closed
    head_within_s: u64 = 10, "s", "judgement";
    /// a request whose body has not come in so long is refused
    body_within_s: u64 = 10, "s", "judgement";
    /// time between two messages of progress to a page: faster than one reads
    message_period_ms: u64 = 100, "ms", "judgement";
    /// files and folders of one folder that are listed
    most_listed: usize = 2_000, "count", "judgement";
    /// widest picture that is answered: two of the widest screens
    widest_picture: usize = 8_192, "pixel", "judgement";
    /// bands of one finding in one picture; denser ones are drawn as one
    most_bands: usize = 200, "count", "judgement";
    /// curves of one picture
    most_curves: usize = 64, "count", "judgement";
    /// samples of a curve whose extremes and sums are taken once: a column of pixels over an hour at 1 kHz has some 3,000 samples
    chunk: usize = 512, "count", "judgement";
    /// parts of equal count in which an error is shown over a channel
    places_against: usize = 24, "count", "judgement";
    /// samples of an error that are looked at to show it over a channel: each part still has thousands
    most_against: usize = 200_000, "count", "judgement";
    /// sets of effects that are shown while a search goes on, the best ones
    shown_tried: usize = 6, "count", "judgement";
    /// how much of a running bench is kept to be plotted
    live_s: f64 = 60.0, "s", "judgement";
    /// time between two looks at a running bench: faster than a page draws
    live_period_ms: u64 = 50, "ms", "judgement";
    /// a running bench is listened to for so long after a page has asked
    live_asked_within_s: u64 = 10, "s", "judgement";
    /// length of the stretch with the largest error that is jumped to
    worst_stretch_s: f64 = 10.0, "s", "judgement";
    /// samples of a curve that say how often it has one
    looked_at: usize = 2_000, "count", "judgement";
}
