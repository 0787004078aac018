//! The same plots as pictures: SVG files for papers, slides and the demo's folder.

use std::path::Path;

use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;

use super::plot::{Axis, Kind, Plot, Series, Tone};
use super::table::number;
use super::{ReportError, write_atomically};

const WIDTH: u32 = 1000;
const NEXT: [RGBColor; 6] = [
    RGBColor(31, 111, 235),
    RGBColor(217, 115, 13),
    RGBColor(26, 138, 74),
    RGBColor(147, 51, 184),
    RGBColor(11, 132, 148),
    RGBColor(194, 37, 92),
];
const SOFT: RGBColor = RGBColor(91, 102, 117);
const GRID: RGBColor = RGBColor(223, 228, 234);

impl Plot {
    /// The plot as an SVG picture.
    ///
    /// # Errors
    /// [`ReportError::Draw`] with the drawing library's words.
    pub fn svg(&self) -> Result<String, ReportError> {
        let mut svg = String::new();
        self.draw(&mut svg).map_err(|reason| ReportError::Draw { title: self.title.clone(), reason })?;
        Ok(svg)
    }

    /// Writes the plot as an SVG file; a file that was there is replaced only when all is written.
    ///
    /// # Errors
    /// [`ReportError`] with the title or the path.
    pub fn save_svg(&self, path: &Path) -> Result<(), ReportError> {
        write_atomically(path, &self.svg()?)
    }

    fn draw(&self, svg: &mut String) -> Result<(), String> {
        let area = SVGBackend::with_string(svg, (WIDTH, self.height + 110)).into_drawing_area();
        area.fill(&WHITE).map_err(words)?;
        let x_values = self.series.iter().flat_map(|series| series.x.iter().copied());
        let spans = self.spans.iter().flat_map(|span| [span.1, span.2]);
        let y_values = self.series.iter().flat_map(|series| series.y.iter().chain(&series.upper).copied());
        let levels = self.levels.iter().map(|level| level.1);
        let x = shown(&self.x, x_values.chain(spans), 0.0);
        let y = shown(&self.y, y_values.chain(levels), 0.06);
        // One match per pair of axis types: plotters' coordinates are types of their own.
        match (self.x.logarithmic, self.y.logarithmic) {
            (false, false) => self.draw_on(&area, x.0..x.1, y.0..y.1),
            (true, false) => self.draw_on(&area, (x.0..x.1).log_scale(), y.0..y.1),
            (false, true) => self.draw_on(&area, x.0..x.1, (y.0..y.1).log_scale()),
            (true, true) => self.draw_on(&area, (x.0..x.1).log_scale(), (y.0..y.1).log_scale()),
        }?;
        area.present().map_err(words)
    }

    fn draw_on<X, Y>(
        &self,
        area: &DrawingArea<SVGBackend, plotters::coord::Shift>,
        x: X,
        y: Y,
    ) -> Result<(), String>
    where
        X: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: AsRangedCoord<Value = f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        let mut chart = ChartBuilder::on(area)
            .caption(&self.title, ("sans-serif", 18))
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(72)
            .build_cartesian_2d(x, y)
            .map_err(words)?;
        chart
            .configure_mesh()
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .axis_style(SOFT)
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .label_style(("sans-serif", 13, &SOFT))
            .axis_desc_style(("sans-serif", 14))
            .x_label_formatter(&|value| short(*value))
            .y_label_formatter(&|value| short(*value))
            .draw()
            .map_err(words)?;
        let (x_range, y_range) = (chart.x_range(), chart.y_range());
        for (_, from, to) in &self.spans {
            let corners = [(*from, y_range.start), (*to, y_range.end)];
            chart
                .draw_series([Rectangle::new(corners, RGBColor(183, 121, 31).mix(0.2).filled())])
                .map_err(words)?;
        }
        let mut free = 0;
        for series in &self.series {
            let colour = colour(series.tone, &mut free);
            let legend =
                move |(x, y): (i32, i32)| Rectangle::new([(x, y - 3), (x + 16, y + 3)], colour.filled());
            let drawn = match series.kind {
                Kind::Points => chart
                    .draw_series(points(series).map(|point| Circle::new(point, 2, colour.mix(0.7).filled()))),
                Kind::Band => chart.draw_series([Polygon::new(outline(series), colour.mix(0.2))]),
                // The list of lines outlives the match: each piece between holes is its own line.
                Kind::Line | Kind::Steps => chart.draw_series(
                    pieces(series).into_iter().map(|piece| PathElement::new(piece, colour.stroke_width(2))),
                ),
            };
            drawn.map_err(words)?.label(&series.name).legend(legend);
        }
        for (label, value) in &self.levels {
            let line = vec![(x_range.start, *value), (x_range.end, *value)];
            chart.draw_series(DashedLineSeries::new(line, 6, 4, SOFT.stroke_width(1))).map_err(words)?;
            let name = format!("{label} ({})", number(*value, 3));
            chart
                .draw_series([Text::new(
                    name,
                    (x_range.start, *value),
                    ("sans-serif", 12).into_font().color(&SOFT),
                )])
                .map_err(words)?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.85))
            .border_style(GRID)
            .label_font(("sans-serif", 13))
            .draw()
            .map_err(words)
    }
}

fn words(error: impl std::fmt::Display) -> String {
    error.to_string()
}

fn short(value: f64) -> String {
    let text = number(value, 4);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

fn colour(tone: Tone, free: &mut usize) -> RGBColor {
    match tone {
        Tone::Measured => RGBColor(61, 70, 83),
        Tone::Model => NEXT[0],
        Tone::Better => NEXT[2],
        Tone::Residual => RGBColor(209, 64, 47),
        Tone::Quiet => RGBColor(154, 165, 177),
        Tone::Next => {
            *free += 1;
            NEXT[(*free - 1) % NEXT.len()]
        }
    }
}

fn points(series: &Series) -> impl Iterator<Item = (f64, f64)> + '_ {
    series.x.iter().copied().zip(series.y.iter().copied()).filter(|(_, y)| y.is_finite())
}

/// Lines between holes; steps get their corners.
fn pieces(series: &Series) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = vec![Vec::new()];
    let mut before: Option<f64> = None;
    for (&x, &y) in series.x.iter().zip(&series.y) {
        if !y.is_finite() {
            pieces.push(Vec::new());
            before = None;
            continue;
        }
        if let Some(piece) = pieces.last_mut() {
            if let (Kind::Steps, Some(held)) = (series.kind, before) {
                piece.push((x, held));
            }
            piece.push((x, y));
        }
        before = Some(y);
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

fn outline(series: &Series) -> Vec<(f64, f64)> {
    let back = series.x.iter().copied().zip(series.upper.iter().copied()).rev();
    points(series).chain(back.filter(|(_, y)| y.is_finite())).collect()
}

/// What an axis shows: its fixed range, or all values with a margin; never empty.
fn shown(axis: &Axis, values: impl Iterator<Item = f64>, margin: f64) -> (f64, f64) {
    if let Some(range) = axis.range {
        return range;
    }
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values.filter(|&value| axis.shows(value)) {
        low = low.min(value);
        high = high.max(value);
    }
    if low > high {
        return if axis.logarithmic { (0.1, 10.0) } else { (0.0, 1.0) };
    }
    if axis.logarithmic {
        return if low < high { (low, high) } else { (low / 2.0, high * 2.0) };
    }
    let width = if low < high { high - low } else { low.abs().max(1.0) };
    let extra = if low < high { margin } else { 0.5 };
    (low - extra * width, high + extra * width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_series_on_every_kind_of_axis() {
        let x = [1.0, 2.0, 3.0, 10.0];
        let y = [1.0, f64::NAN, 2.0, 3.0];
        for (x_axis, y_axis) in [
            (Axis::new("t", "s"), Axis::new("v", "V")),
            (Axis::new("f", "Hz").logarithmic(), Axis::new("v", "V").logarithmic()),
        ] {
            let svg = Plot::new("all <kinds>", x_axis, y_axis)
                .series(Series::line("line", &x, &y))
                .series(Series::steps("steps", &x, &y).tone(Tone::Quiet))
                .series(Series::points("points", &x, &y))
                .series(Series::band("band", &x, &[1.0; 4], &[2.0; 4]))
                .level("floor", 1.5)
                .span("hole", 2.0, 3.0)
                .svg()
                .unwrap();
            assert!(svg.starts_with("<svg") && svg.contains("all &lt;kinds&gt;"));
            for needed in ["polyline", "circle", "polygon", "rect"] {
                assert!(svg.contains(needed), "no {needed} in the picture");
            }
        }
    }

    #[test]
    fn nothing_to_draw_is_still_a_picture() {
        let plot = Plot::new("empty", Axis::new("t", "s"), Axis::new("v", "V"));
        assert!(plot.clone().series(Series::line("a", &[], &[])).svg().is_ok());
        assert!(plot.series(Series::line("a", &[1.0], &[f64::NAN])).svg().is_ok());
    }
}
