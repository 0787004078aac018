//! Tables, in HTML and as text, and numbers written for people.

use super::markup::{escape, inline};
use crate::estimation::moments::mean;
use crate::estimation::quantile::extremes;

/// How a row, a bar or a verdict should be read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Mark {
    /// Nothing special.
    #[default]
    Plain,
    /// As it should be; the winner.
    Good,
    /// To be looked at.
    Warning,
    /// Wrong; the failure.
    Bad,
}

impl Mark {
    /// CSS class.
    pub(super) fn class(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Good => "good",
            Self::Warning => "warning",
            Self::Bad => "bad",
        }
    }
}

/// A table: headers carry units, columns of numbers are aligned right.
#[derive(Debug, Clone, Default)]
pub struct TextTable {
    caption: String,
    headers: Vec<String>,
    rows: Vec<(Mark, Vec<String>)>,
}

impl TextTable {
    /// A table with these column headers; put the unit in the header: `pole [rad/s]`.
    pub fn new<H: Into<String>>(headers: impl IntoIterator<Item = H>) -> Self {
        Self { headers: headers.into_iter().map(Into::into).collect(), ..Self::default() }
    }

    /// Words above the table.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    /// Adds a row; missing cells stay empty.
    #[must_use]
    pub fn row<C: Into<String>>(self, cells: impl IntoIterator<Item = C>) -> Self {
        self.marked_row(Mark::Plain, cells)
    }

    /// Adds a row that is to be read as `mark`.
    #[must_use]
    pub fn marked_row<C: Into<String>>(mut self, mark: Mark, cells: impl IntoIterator<Item = C>) -> Self {
        self.rows.push((mark, cells.into_iter().map(Into::into).collect()));
        self
    }

    /// Whether it has no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The table as text for a terminal, columns aligned, no trailing spaces.
    #[must_use]
    pub fn text(&self) -> String {
        let columns = self.columns();
        let width_of = |column: usize| {
            let cells = self.rows.iter().filter_map(|(_, cells)| cells.get(column));
            cells.chain(self.headers.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width_of).collect();
        let line = |cells: &[String]| {
            let mut line = String::new();
            for (column, width) in widths.iter().enumerate() {
                let cell = cells.get(column).map_or("", String::as_str);
                let padding = " ".repeat(width - cell.chars().count());
                let right = self.is_numeric(column);
                line.push_str(if column > 0 { "  " } else { "" });
                line.push_str(if right { &padding } else { "" });
                line.push_str(cell);
                line.push_str(if right { "" } else { &padding });
            }
            line.trim_end().to_owned() + "\n"
        };
        let mut text = String::new();
        if !self.caption.is_empty() {
            text.push_str(&self.caption);
            text.push('\n');
        }
        text.push_str(&line(&self.headers));
        let rule: Vec<String> = widths.iter().map(|width| "─".repeat(*width)).collect();
        text.push_str(&line(&rule));
        self.rows.iter().for_each(|(_, cells)| text.push_str(&line(cells)));
        text
    }

    /// The table as HTML.
    pub(super) fn html(&self) -> String {
        let cell = |tag: &str, column: usize, text: &str| {
            let class = if self.is_numeric(column) { " class=\"number\"" } else { "" };
            format!("<{tag}{class}>{}</{tag}>", inline(text))
        };
        let mut html = String::from("<div class=\"table\"><table>");
        if !self.caption.is_empty() {
            html.push_str(&format!("<caption><span>{}</span></caption>", inline(&self.caption)));
        }
        html.push_str("<thead><tr>");
        for column in 0..self.columns() {
            html.push_str(&cell(
                "th",
                column,
                &whole_unit(self.headers.get(column).map_or("", String::as_str)),
            ));
        }
        html.push_str("</tr></thead><tbody>");
        for (mark, cells) in &self.rows {
            html.push_str(&format!("<tr class=\"{}\">", escape(mark.class())));
            for column in 0..self.columns() {
                html.push_str(&cell("td", column, cells.get(column).map_or("", String::as_str)));
            }
            html.push_str("</tr>");
        }
        html.push_str("</tbody></table></div>\n");
        html
    }

    fn columns(&self) -> usize {
        self.rows.iter().map(|(_, cells)| cells.len()).fold(self.headers.len(), usize::max)
    }

    /// Whether most cells of the column begin like a number.
    fn is_numeric(&self, column: usize) -> bool {
        let cells = self.rows.iter().filter_map(|(_, cells)| cells.get(column));
        let filled: Vec<&String> = cells.filter(|cell| !cell.is_empty() && *cell != "-").collect();
        let starts_like_a_number = |cell: &&&String| {
            cell.trim_start_matches(['-', '−', '+', '±', '<', '>', ' ', '.'])
                .starts_with(|c: char| c.is_ascii_digit())
        };
        !filled.is_empty() && 2 * filled.iter().filter(starts_like_a_number).count() > filled.len()
    }
}

/// A header whose unit, in brackets, is not broken over two lines.
fn whole_unit(header: &str) -> String {
    match header.split_once('[') {
        Some((name, unit)) => format!("{name}[{}", unit.replace(' ', "\u{a0}")),
        None => header.to_owned(),
    }
}

/// `value` with this many significant digits, as a person would write it; not-a-number becomes `-`.
#[must_use]
pub fn number(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return if value.is_nan() {
            "-".to_owned()
        } else if value > 0.0 {
            "∞".to_owned()
        } else {
            "-∞".to_owned()
        };
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = digits.max(1);
    // Rounding may carry into a new digit (9.996 to 10.00): ask the formatter which power of ten it came to.
    let scientific = format!("{value:.*e}", digits - 1);
    let exponent: i32 = scientific.rsplit('e').next().and_then(|text| text.parse().ok()).unwrap_or(0);
    if !(-4..7).contains(&exponent) {
        return scientific;
    }
    let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
    format!("{value:.decimals$}")
}

/// A signal in one line of `width` characters; missing stretches stay blank.
#[must_use]
pub fn sparkline(values: &[f64], width: usize) -> String {
    const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let (low, high) = extremes(values.iter().copied());
    let width = width.min(values.len());
    (0..width)
        .map(|column| {
            let bucket = &values[column * values.len() / width..(column + 1) * values.len() / width];
            let good: Vec<f64> = bucket.iter().copied().filter(|value| value.is_finite()).collect();
            if good.is_empty() {
                return ' ';
            }
            let mean = mean(&good);
            let level = if high > low { (mean - low) / (high - low) * 7.0 } else { 0.0 };
            LEVELS[(level.round() as usize).min(7)]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_significant_digits() {
        for (value, digits, text) in [
            (16.0123, 4, "16.01"),
            (9.996, 3, "10.0"),
            (0.000_014_299, 3, "1.43e-5"),
            (1124.5, 5, "1124.5"),
            (-0.5, 2, "-0.50"),
            (0.0, 3, "0"),
            (447.1, 2, "447"),
        ] {
            assert_eq!(number(value, digits), text);
        }
        assert_eq!(number(f64::NAN, 3), "-");
        assert_eq!(number(f64::INFINITY, 3), "∞");
    }

    #[test]
    fn text_aligns_by_characters_and_html_escapes() {
        let table =
            TextTable::new(["symbol", "value [rad/s]"]).row(["c_g1", "447.1"]).row(["ω<0>", "1124.5"]);
        assert_eq!(
            table.text(),
            "symbol  value [rad/s]\n──────  ─────────────\nc_g1            447.1\nω<0>           1124.5\n"
        );
        let html = table.html();
        assert!(html.contains("ω&lt;0&gt;") && !html.contains("<0>"));
        assert!(html.contains("<td class=\"number\">447.1</td>"));
        assert_eq!(whole_unit("effort [N m]"), "effort [N\u{a0}m]");
    }

    #[test]
    fn a_sparkline_shows_shape_and_holes() {
        assert_eq!(sparkline(&[0.0, 1.0, f64::NAN, 7.0], 4), "▁▂ █");
        assert_eq!(sparkline(&[], 10), "");
        assert_eq!(sparkline(&[3.0; 5], 5), "▁▁▁▁▁");
    }
}
