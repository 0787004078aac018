//! Horizontal bars with named levels: candidates against the noise floor and the level that chance reaches.

use std::fmt::Write as _;

use super::markup::{escape, inline};
use super::table::{Mark, number};

const LABEL: f64 = 290.0;
const WIDTH: f64 = 960.0;
const ROW: f64 = 24.0;
const VALUE: f64 = 170.0;

/// A chart of horizontal bars, in the order they were added, drawn as inline SVG.
#[derive(Debug, Clone)]
pub struct Bars {
    title: String,
    unit: String,
    bars: Vec<(String, f64, Mark, String)>,
    levels: Vec<(String, f64)>,
}

impl Bars {
    /// An empty chart; `unit` is the unit of every value.
    #[must_use]
    pub fn new(title: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { title: title.into(), unit: unit.into(), bars: Vec::new(), levels: Vec::new() }
    }

    /// Adds a bar; a value that is not finite is listed without one.
    #[must_use]
    pub fn bar(self, label: impl Into<String>, value: f64, mark: Mark) -> Self {
        self.noted_bar(label, value, mark, "")
    }

    /// Adds a bar with a few words behind its value.
    #[must_use]
    pub fn noted_bar(
        mut self,
        label: impl Into<String>,
        value: f64,
        mark: Mark,
        note: impl Into<String>,
    ) -> Self {
        self.bars.push((label.into(), value, mark, note.into()));
        self
    }

    /// Adds a named vertical line over all bars.
    #[must_use]
    pub fn level(mut self, label: impl Into<String>, value: f64) -> Self {
        if value.is_finite() {
            self.levels.push((label.into(), value));
        }
        self
    }

    pub(super) fn html(&self) -> String {
        let unit = if self.unit.is_empty() {
            String::new()
        } else {
            format!(" <span class=\"unit\">[{}]</span>", escape(&self.unit))
        };
        format!(
            "<figure class=\"bars\"><figcaption>{}{unit}</figcaption>{}</figure>\n",
            inline(&self.title),
            self.svg()
        )
    }

    /// The chart as SVG that takes its colours from the page.
    fn svg(&self) -> String {
        let values = self.bars.iter().map(|bar| bar.1).chain(self.levels.iter().map(|level| level.1));
        let highest = values.filter(|value| value.is_finite()).fold(0.0, f64::max);
        let scale = (WIDTH - LABEL - VALUE) / if highest > 0.0 { highest } else { 1.0 };
        let top = 20.0 * self.levels.len() as f64 + 6.0;
        let height = top + ROW * self.bars.len() as f64 + 6.0;
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\">",
            escape(&self.title)
        );
        // Values stand over the lines.
        let mut values = String::new();
        for (row, bar) in self.bars.iter().enumerate() {
            self.draw_bar(bar, top + ROW * row as f64, scale, [&mut svg, &mut values]);
        }
        for (row, level) in self.levels.iter().enumerate() {
            draw_level(level, 20.0 * row as f64 + 14.0, scale, height, &mut svg);
        }
        svg.push_str(&values);
        svg.push_str("</svg>");
        svg
    }

    /// One bar at `y` with its label, and apart what is written behind it. Writing to a String cannot fail.
    fn draw_bar(
        &self,
        (label, value, mark, note): &(String, f64, Mark, String),
        y: f64,
        scale: f64,
        [svg, values]: [&mut String; 2],
    ) {
        let middle = y + ROW * 0.66;
        let _ = write!(
            svg,
            "<text class=\"label\" x=\"{}\" y=\"{middle:.1}\" text-anchor=\"end\">{}</text>",
            LABEL - 8.0,
            escape(&shortened(label, 36))
        );
        let length = if value.is_finite() { position(*value, scale) - LABEL } else { 0.0 };
        let _ = write!(
            svg,
            "<rect class=\"{}\" x=\"{LABEL}\" y=\"{:.1}\" width=\"{length:.1}\" height=\"{}\" rx=\"2\"><title>{}: {} {}</title></rect>",
            mark.class(),
            y + 4.0,
            ROW - 8.0,
            escape(label),
            number(*value, 5),
            escape(&self.unit)
        );
        let _ = write!(
            values,
            "<text class=\"value\" x=\"{:.1}\" y=\"{middle:.1}\">{} <tspan class=\"note\">{}</tspan></text>",
            LABEL + length + 6.0,
            number(*value, 4),
            escape(note)
        );
    }
}

/// Where a value ends.
fn position(value: f64, scale: f64) -> f64 {
    LABEL + value.max(0.0) * scale
}

/// One line over all bars, with its label at `y`.
fn draw_level((label, value): &(String, f64), y: f64, scale: f64, height: f64, svg: &mut String) {
    let x = position(*value, scale);
    // A label near the right edge is written to the left of its line.
    let (anchor, shift) = if x > WIDTH - 260.0 { ("end", -6.0) } else { ("start", 6.0) };
    let _ = write!(
        svg,
        "<line class=\"level\" x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{:.1}\" y2=\"{height}\"/>\
         <text class=\"level\" x=\"{:.1}\" y=\"{y}\" text-anchor=\"{anchor}\">{} {}</text>",
        y - 10.0,
        x + shift,
        escape(label),
        number(*value, 4)
    );
}

fn shortened(label: &str, longest: usize) -> String {
    if label.chars().count() <= longest {
        return label.to_owned();
    }
    label.chars().take(longest - 1).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_bars_levels_and_survives_odd_values() {
        let svg = Bars::new("held-out <error>", "rad/s")
            .bar("transport_delay", 24.0, Mark::Good)
            .bar("refused", f64::NAN, Mark::Plain)
            .bar("negative", -3.0, Mark::Bad)
            .level("noise floor", 20.0)
            .level("none", f64::NAN)
            .html();
        assert_eq!(svg.matches("<rect").count(), 3);
        assert_eq!(svg.matches("<line").count(), 1);
        assert!(!svg.contains("NaN") && !svg.contains("width=\"-"), "{svg}");
        assert!(svg.contains("held-out &lt;error&gt;"));
    }
}
