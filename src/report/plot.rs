//! Plots: time series, curves, scatter, bands. One description serves the page and the picture.

use serde_json::{Value, json};

use super::decimate;

/// What a curve stands for; the same thing has the same colour in every report.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Tone {
    /// The next free colour.
    #[default]
    Next,
    /// What was measured.
    Measured,
    /// What the model says.
    Model,
    /// Measured minus model; what is wrong.
    Residual,
    /// Background: references, limits, the paper's values.
    Quiet,
}

impl Tone {
    fn name(self) -> &'static str {
        match self {
            Self::Next => "next",
            Self::Measured => "measured",
            Self::Model => "model",
            Self::Residual => "residual",
            Self::Quiet => "quiet",
        }
    }
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CurveStyle {
    Line,
    Steps,
    Points,
    Band,
}

/// An axis: what it shows, and in which unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub(super) label: String,
    pub(super) logarithmic: bool,
    pub(super) range: Option<(f64, f64)>,
}

impl Axis {
    /// An axis labelled `quantity [unit]`.
    #[must_use]
    pub fn new(quantity: &str, unit: &str) -> Self {
        let label = if unit.is_empty() { quantity.to_owned() } else { format!("{quantity} [{unit}]") };
        Self { label, logarithmic: false, range: None }
    }

    /// Makes it logarithmic; values that are not positive are not drawn.
    #[must_use]
    pub fn logarithmic(mut self) -> Self {
        self.logarithmic = true;
        self
    }

    /// Fixes what is shown before zooming.
    #[must_use]
    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// Where on the screen a value lies.
    pub(super) fn position(&self, value: f64) -> f64 {
        if self.logarithmic { value.max(f64::MIN_POSITIVE).ln() } else { value }
    }

    /// Whether a value can be drawn.
    pub(super) fn shows(&self, value: f64) -> bool {
        value.is_finite() && (!self.logarithmic || value > 0.0)
    }

    fn json(&self) -> Value {
        json!({ "label": self.label, "log": self.logarithmic, "range": self.range })
    }
}

/// One curve of a plot, already thinned to what the eye can see.
#[derive(Debug, Clone)]
pub struct Series {
    pub(super) name: String,
    pub(super) kind: CurveStyle,
    pub(super) tone: Tone,
    pub(super) dashed: bool,
    pub(super) x: Vec<f64>,
    /// Lower edge of a band, else the values; not-a-number is a hole.
    pub(super) y: Vec<f64>,
    /// Upper edge of a band.
    pub(super) upper: Vec<f64>,
}

impl Series {
    /// A line through samples; not-a-number in `y` leaves a hole.
    #[must_use]
    pub fn line(name: impl Into<String>, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, CurveStyle::Line, x, y, &[])
    }

    /// A line that holds each value until the next: commands.
    #[must_use]
    pub fn steps(name: impl Into<String>, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, CurveStyle::Steps, x, y, &[])
    }

    /// Separate points.
    #[must_use]
    pub fn points(name: impl Into<String>, x: &[f64], y: &[f64]) -> Self {
        Self::new(name, CurveStyle::Points, x, y, &[])
    }

    /// The area between `lower` and `upper`.
    #[must_use]
    pub fn band(name: impl Into<String>, x: &[f64], lower: &[f64], upper: &[f64]) -> Self {
        Self::new(name, CurveStyle::Band, x, lower, upper)
    }

    fn new(name: impl Into<String>, kind: CurveStyle, x: &[f64], y: &[f64], upper: &[f64]) -> Self {
        let mut length = x.len().min(y.len());
        if kind == CurveStyle::Band {
            length = length.min(upper.len());
        }
        let upper = if kind == CurveStyle::Band { &upper[..length] } else { &[] };
        Self {
            name: name.into(),
            kind,
            tone: Tone::default(),
            dashed: false,
            x: x[..length].to_vec(),
            y: y[..length].to_vec(),
            upper: upper.to_vec(),
        }
    }

    /// What it stands for.
    #[must_use]
    pub fn tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }

    /// Draws it dashed.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dashed = true;
        self
    }

    /// Breaks the line wherever two samples are further apart than `longest` [unit of x]: a hole in a log is
    /// not a straight line.
    #[must_use]
    pub fn break_over(mut self, longest: f64) -> Self {
        let mut at = 1;
        while at < self.x.len() {
            if self.x[at] - self.x[at - 1] > longest {
                self.x.insert(at, 0.5 * (self.x[at] + self.x[at - 1]));
                self.y.insert(at, f64::NAN);
                if self.kind == CurveStyle::Band {
                    self.upper.insert(at, f64::NAN);
                }
                at += 1;
            }
            at += 1;
        }
        self
    }

    /// Keeps the rows that the eye can tell apart on these axes.
    fn thinned(self, x_axis: &Axis, y_axis: &Axis) -> Self {
        let x: Vec<f64> =
            self.x.iter().map(|&value| if x_axis.shows(value) { value } else { f64::NAN }).collect();
        let hide = |values: &[f64]| -> Vec<f64> {
            values.iter().map(|&value| if y_axis.shows(value) { value } else { f64::NAN }).collect()
        };
        let (y, upper) = (hide(&self.y), hide(&self.upper));
        let position = |value: f64| x_axis.position(value);
        let rows = match self.kind {
            CurveStyle::Points => decimate::scatter_rows(&x, &y, position),
            CurveStyle::Line | CurveStyle::Steps => decimate::line_rows(&x, &y, position),
            CurveStyle::Band => {
                let mut rows = decimate::line_rows(&x, &y, position);
                rows.extend(decimate::line_rows(&x, &upper, position));
                rows.sort_by(|&a, &b| x[a].total_cmp(&x[b]).then(a.cmp(&b)));
                rows.dedup();
                rows
            }
        };
        let pick = |values: &[f64]| -> Vec<f64> {
            rows.iter().filter_map(|&row| values.get(row)).copied().collect()
        };
        Self { x: pick(&x), y: pick(&y), upper: pick(&upper), ..self }
    }

    fn json(&self) -> Value {
        let kind = match self.kind {
            CurveStyle::Line => "line",
            CurveStyle::Steps => "steps",
            CurveStyle::Points => "points",
            CurveStyle::Band => "band",
        };
        let values = |values: &[f64], digits| -> Vec<Option<f64>> {
            values.iter().map(|&value| rounded(value, digits)).collect()
        };
        json!({
            "name": self.name, "kind": kind, "tone": self.tone.name(), "dashed": self.dashed,
            "x": values(&self.x, 8), "y": values(&self.y, 6), "upper": values(&self.upper, 6),
        })
    }
}

/// `value` to this many significant digits; `None` (a hole) when it is not finite.
fn rounded(value: f64, digits: usize) -> Option<f64> {
    if !value.is_finite() {
        return None;
    }
    if value == 0.0 {
        return Some(0.0);
    }
    // By way of the decimal: the double nearest to it prints short, and no power of ten has to be exact.
    Some(format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value))
}

/// One plot with its axes, curves and marks.
#[derive(Debug, Clone)]
pub struct Plot {
    pub(super) title: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) height: u32,
    pub(super) group: String,
    pub(super) series: Vec<Series>,
    pub(super) levels: Vec<(String, f64)>,
    pub(super) spans: Vec<(String, f64, f64)>,
}

impl Plot {
    /// An empty plot.
    #[must_use]
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            title: title.into(),
            x,
            y,
            height: 260,
            group: String::new(),
            series: Vec::new(),
            levels: Vec::new(),
            spans: Vec::new(),
        }
    }

    /// Plots of one group share the cursor and zoom along x together.
    #[must_use]
    pub fn group(mut self, group: impl Into<String>) -> Self {
        self.group = group.into();
        self
    }

    /// [px] Height of the drawing.
    #[must_use]
    pub fn height(mut self, pixels: u32) -> Self {
        self.height = pixels;
        self
    }

    /// Adds a curve.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series.thinned(&self.x, &self.y));
        self
    }

    /// Adds a labelled horizontal line at `y`: noise floor, limit, printed value.
    #[must_use]
    pub fn level(mut self, label: impl Into<String>, y: f64) -> Self {
        if y.is_finite() {
            self.levels.push((label.into(), y));
        }
        self
    }

    /// Adds a labelled shaded stretch of x: a hole, an impulse, the validation part; `from == to` is a line.
    #[must_use]
    pub fn span(mut self, label: impl Into<String>, from: f64, to: f64) -> Self {
        if from.is_finite() && to.is_finite() {
            self.spans.push((label.into(), from, to));
        }
        self
    }

    /// What `page.js` draws.
    pub(super) fn json(&self) -> Value {
        json!({
            "x": self.x.json(), "y": self.y.json(), "height": self.height, "group": self.group,
            "series": self.series.iter().map(Series::json).collect::<Vec<_>>(),
            "levels": self.levels, "spans": self.spans,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_prints_short_and_holes_are_null() {
        let series = Series::line("a", &[0.1 + 0.2, 1.0], &[1.0 / 3.0, f64::NAN]);
        let text = series.json().to_string();
        assert!(text.contains("\"x\":[0.3,1.0]") && text.contains("\"y\":[0.333333,null]"), "{text}");
        assert_eq!(rounded(123_456_789.0, 6), Some(123_457_000.0));
        assert_eq!(rounded(1e-300, 6), Some(1e-300));
        assert_eq!(rounded(f64::MIN_POSITIVE / 4.0, 6).map(f64::is_finite), Some(true));
    }

    #[test]
    fn holes_are_broken_and_lengths_may_differ() {
        let series = Series::line("a", &[0.0, 1.0, 5.0, 6.0], &[1.0, 2.0, 3.0]).break_over(2.0);
        assert_eq!(series.x, [0.0, 1.0, 3.0, 5.0]);
        assert!(series.y[2].is_nan() && series.y[3] == 3.0);
    }

    #[test]
    fn a_logarithmic_axis_drops_what_it_cannot_show() {
        let plot = Plot::new("p", Axis::new("f", "Hz").logarithmic(), Axis::new("m", ""))
            .series(Series::line("a", &[0.0, 1.0, 10.0], &[1.0, 2.0, 3.0]));
        assert_eq!(plot.series[0].x, [1.0, 10.0]);
    }
}
