//! The same plots as pictures: SVG files for papers, slides and the demo's folder, on white.

use std::fmt::Write as _;
use std::path::Path;

use super::markup::escape;
use super::plot::{Axis, CurveStyle, Plot, Series, Tone};
use super::table::number;
use super::{ReportError, write_atomically};

/// [px] of the whole picture.
const WIDTH: f64 = 1000.0;
/// [px] around the drawing: the title above, numbers and labels left and below.
const LEFT: f64 = 84.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 40.0;
const BOTTOM: f64 = 58.0;
/// [px] that a number on an axis needs, at least.
const TICK_WIDTH: f64 = 80.0;
const TICK_HEIGHT: f64 = 36.0;
const LEGEND_ROW: f64 = 20.0;
/// [px] of a letter in the legend, about.
const LETTER: f64 = 7.2;

const NEXT: [&str; 6] = ["#1f6feb", "#d9730d", "#1a8a4a", "#9333b8", "#0b8494", "#c2255c"];
const SOFT: &str = "#5b6675";
const GRID: &str = "#dfe4ea";
const SPAN: &str = "#b7791f";

impl Plot {
    /// The plot as an SVG picture.
    #[must_use]
    pub fn svg(&self) -> String {
        let x_values = self.series.iter().flat_map(|series| series.x.iter().copied());
        let spans = self.spans.iter().flat_map(|span| [span.1, span.2]);
        let y_values = self.series.iter().flat_map(|series| series.y.iter().chain(&series.upper).copied());
        let levels = self.levels.iter().map(|level| level.1);
        let bottom = TOP + f64::from(self.height);
        let drawing = Drawing {
            x: Scale::build(&self.x, x_values.chain(spans), 0.0, (LEFT, WIDTH - RIGHT)),
            y: Scale::build(&self.y, y_values.chain(levels), 0.06, (bottom, TOP)),
        };
        let height = bottom + BOTTOM;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} {height}\" \
             font-family=\"system-ui, sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
             <clipPath id=\"drawing\"><rect x=\"{LEFT}\" y=\"{TOP}\" width=\"{}\" height=\"{}\"/></clipPath>\n",
            WIDTH - RIGHT - LEFT,
            self.height
        );
        drawing.axes(self, &mut svg);
        svg.push_str("<g clip-path=\"url(#drawing)\">\n");
        for (_, from, to) in &self.spans {
            let (left, right) = (drawing.x.at(*from), drawing.x.at(*to));
            // Writing to a String cannot fail.
            let _ = writeln!(
                svg,
                "<rect x=\"{left:.1}\" y=\"{TOP}\" width=\"{:.1}\" height=\"{}\" fill=\"{SPAN}\" fill-opacity=\"0.2\"/>",
                (right - left).max(1.5),
                self.height
            );
        }
        let colours = colours(&self.series);
        for (series, colour) in self.series.iter().zip(&colours) {
            drawing.series(series, colour, &mut svg);
        }
        drawing.levels(&self.levels, &mut svg);
        svg.push_str("</g>\n");
        legend(&self.series, &colours, &mut svg);
        svg.push_str("</svg>\n");
        svg
    }

    /// Writes the plot as an SVG file; a file that was there is replaced only when all is written.
    ///
    /// # Errors
    /// [`ReportError`] with the path.
    pub fn save_svg(&self, path: &Path) -> Result<(), ReportError> {
        write_atomically(path, &self.svg())
    }
}

/// From a value to a place in the picture.
struct Scale<'a> {
    axis: &'a Axis,
    shown: (f64, f64),
    /// [px] where the ends of `shown` lie.
    ends: (f64, f64),
}

impl<'a> Scale<'a> {
    fn build(axis: &'a Axis, values: impl Iterator<Item = f64>, margin: f64, ends: (f64, f64)) -> Self {
        Self { axis, shown: shown(axis, values, margin), ends }
    }

    /// [px]
    fn at(&self, value: f64) -> f64 {
        let (low, high) = (self.axis.position(self.shown.0), self.axis.position(self.shown.1));
        let share = (self.axis.position(value) - low) / (high - low);
        // Far outside is as good as a little outside, and prints short.
        self.ends.0 + share.clamp(-10.0, 10.0) * (self.ends.1 - self.ends.0)
    }

    /// Round values no closer than `least` [px].
    fn ticks(&self, least: f64) -> Vec<f64> {
        let (low, high) = self.shown;
        let most = ((self.ends.1 - self.ends.0).abs() / least).max(2.0);
        if self.axis.logarithmic && (high / low).log10() >= 1.0 {
            // All decades, or every second, third ...; with 2 and 5 between them where there is room.
            let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
            let each = (f64::from(last - first) / most).ceil().max(1.0) as usize;
            let digits: &[f64] =
                if f64::from(3 * (last - first)) <= most { &[1.0, 2.0, 5.0] } else { &[1.0] };
            let decades = (first..=last).step_by(each);
            let all = decades.flat_map(|power| digits.iter().map(move |digit| digit * 10_f64.powi(power)));
            return all.filter(|tick| (low..=high).contains(tick)).collect();
        }
        let rough = (high - low) / most;
        let unit = 10_f64.powf(rough.log10().floor());
        let step = unit * [1.0, 2.0, 5.0].into_iter().find(|it| it * unit >= rough).unwrap_or(10.0);
        let (first, last) = ((low / step).ceil(), (high / step).floor());
        let count = (last - first).clamp(0.0, most.ceil()) as u32;
        // As the decimal that is meant: 0.3 and not 3 times 0.1.
        let tick = |index: u32| format!("{:.12e}", (first + f64::from(index)) * step).parse().unwrap_or(low);
        (0..=count).map(tick).collect()
    }
}

/// The two scales of a picture.
struct Drawing<'a> {
    x: Scale<'a>,
    y: Scale<'a>,
}

impl Drawing<'_> {
    fn axes(&self, plot: &Plot, svg: &mut String) {
        let (right, bottom) = (WIDTH - RIGHT, TOP + f64::from(plot.height));
        for tick in self.x.ticks(TICK_WIDTH) {
            let at = self.x.at(tick);
            let _ = writeln!(
                svg,
                "<path d=\"M{at:.1} {TOP}V{bottom}\" stroke=\"{GRID}\"/><text x=\"{at:.1}\" y=\"{}\" fill=\"{SOFT}\" \
                 text-anchor=\"middle\">{}</text>",
                bottom + 18.0,
                short(tick)
            );
        }
        for tick in self.y.ticks(TICK_HEIGHT) {
            let at = self.y.at(tick);
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {at:.1}H{right}\" stroke=\"{GRID}\"/><text x=\"{}\" y=\"{:.1}\" fill=\"{SOFT}\" \
                 text-anchor=\"end\">{}</text>",
                LEFT - 6.0,
                at + 4.5,
                short(tick)
            );
        }
        let (middle_x, middle_y) = (0.5 * (LEFT + right), 0.5 * (TOP + bottom));
        let _ = writeln!(
            svg,
            "<path d=\"M{LEFT} {TOP}V{bottom}H{right}\" fill=\"none\" stroke=\"{SOFT}\"/>\n\
             <text x=\"{}\" y=\"26\" font-size=\"18\" text-anchor=\"middle\">{}</text>\n\
             <text x=\"{middle_x}\" y=\"{}\" font-size=\"14\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(20 {middle_y}) rotate(-90)\" font-size=\"14\" text-anchor=\"middle\">{}</text>",
            0.5 * WIDTH,
            escape(&plot.title),
            bottom + 44.0,
            escape(&plot.x.label),
            escape(&plot.y.label)
        );
    }

    fn series(&self, series: &Series, colour: &str, svg: &mut String) {
        match series.kind {
            CurveStyle::Points => {
                let _ = write!(svg, "<g fill=\"{colour}\" fill-opacity=\"0.7\">");
                for (x, y) in points(series) {
                    let _ = write!(
                        svg,
                        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2\"/>",
                        self.x.at(x),
                        self.y.at(y)
                    );
                }
                svg.push_str("</g>\n");
            }
            CurveStyle::Band => {
                let outline = self.path(&outline(series));
                let _ =
                    writeln!(svg, "<polygon points=\"{outline}\" fill=\"{colour}\" fill-opacity=\"0.2\"/>");
            }
            CurveStyle::Line | CurveStyle::Steps => {
                let dashes = if series.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
                for piece in pieces(series) {
                    let path = self.path(&piece);
                    let _ = writeln!(
                        svg,
                        "<polyline points=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" \
                         stroke-linejoin=\"round\"{dashes}/>"
                    );
                }
            }
        }
    }

    fn path(&self, points: &[(f64, f64)]) -> String {
        let mut path = String::new();
        for (x, y) in points {
            let _ = write!(path, "{:.1},{:.1} ", self.x.at(*x), self.y.at(*y));
        }
        path
    }

    fn levels(&self, levels: &[(String, f64)], svg: &mut String) {
        for (label, value) in levels {
            let at = self.y.at(*value);
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {at:.1}H{}\" stroke=\"{SOFT}\" stroke-dasharray=\"6 4\"/>\
                 <text x=\"{}\" y=\"{:.1}\" fill=\"{SOFT}\" font-size=\"12\" stroke=\"#fff\" stroke-width=\"3\" \
                 paint-order=\"stroke\">{} ({})</text>",
                WIDTH - RIGHT,
                LEFT + 6.0,
                at - 4.0,
                escape(label),
                number(*value, 3)
            );
        }
    }
}

/// Names and colours in the upper right corner.
fn legend(series: &[Series], colours: &[&str], svg: &mut String) {
    let Some(longest) = series.iter().map(|series| series.name.chars().count()).max() else { return };
    let width = LETTER * longest as f64 + 42.0;
    let (left, top) = (WIDTH - RIGHT - 8.0 - width, TOP + 8.0);
    let _ = writeln!(
        svg,
        "<rect x=\"{left:.1}\" y=\"{top}\" width=\"{width:.1}\" height=\"{}\" fill=\"#fff\" fill-opacity=\"0.85\" \
         stroke=\"{GRID}\"/>",
        LEGEND_ROW * series.len() as f64 + 8.0
    );
    for (row, (series, colour)) in series.iter().zip(colours).enumerate() {
        let middle = top + 4.0 + LEGEND_ROW * (row as f64 + 0.5);
        let (thickness, opacity) =
            if series.kind == CurveStyle::Band { (10, " stroke-opacity=\"0.2\"") } else { (3, "") };
        let dashes = if series.dashed { " stroke-dasharray=\"6 4\"" } else { "" };
        let _ = writeln!(
            svg,
            "<path d=\"M{:.1} {middle}h18\" stroke=\"{colour}\" stroke-width=\"{thickness}\"{opacity}{dashes}/>\
             <text x=\"{:.1}\" y=\"{}\">{}</text>",
            left + 8.0,
            left + 34.0,
            middle + 4.5,
            escape(&series.name)
        );
    }
}

fn short(value: f64) -> String {
    let text = number(value, 4);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// The colour of each series; those without a tone of their own take the next free one.
fn colours(series: &[Series]) -> Vec<&'static str> {
    let mut free = NEXT.iter().cycle();
    let colour = |series: &Series| match series.tone {
        Tone::Measured => "#3d4653",
        Tone::Model => NEXT[0],
        Tone::Residual => "#d1402f",
        Tone::Quiet => "#9aa5b1",
        Tone::Next => free.next().unwrap_or(&NEXT[0]),
    };
    series.iter().map(colour).collect()
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
            if let (CurveStyle::Steps, Some(held)) = (series.kind, before) {
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
                .svg();
            assert!(svg.starts_with("<svg") && svg.contains("all &lt;kinds&gt;"));
            for needed in ["polyline", "circle", "polygon", "rect"] {
                assert!(svg.contains(needed), "no {needed} in the picture");
            }
        }
    }

    #[test]
    fn nothing_to_draw_is_still_a_picture() {
        let plot = Plot::new("empty", Axis::new("t", "s"), Axis::new("v", "V"));
        for (x, y) in [(&[][..], &[][..]), (&[1.0], &[f64::NAN]), (&[1.0], &[0.0])] {
            let svg = plot.clone().series(Series::line("a", x, y)).svg();
            assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn ticks_are_round_and_as_many_as_there_is_room_for() {
        let (even, logarithmic) = (Axis::new("x", ""), Axis::new("x", "").logarithmic());
        let ticks =
            |axis, low, high, least| Scale { axis, shown: (low, high), ends: (0.0, 400.0) }.ticks(least);
        assert_eq!(ticks(&even, -0.35, 0.35, 80.0), [-0.2, 0.0, 0.2]);
        assert_eq!(ticks(&even, 0.0, 19.0, 80.0), [0.0, 5.0, 10.0, 15.0]);
        assert_eq!(ticks(&logarithmic, 0.5, 30.0, 50.0), [1.0, 10.0]);
        assert_eq!(ticks(&logarithmic, 0.5, 30.0, 40.0), [0.5, 1.0, 2.0, 5.0, 10.0, 20.0]);
        assert_eq!(ticks(&logarithmic, 1e-6, 1e6, 80.0), [1e-6, 1e-3, 1.0, 1e3, 1e6]);
        assert_eq!(ticks(&logarithmic, 2.0, 4.0, 80.0), [2.0, 2.5, 3.0, 3.5, 4.0]);
    }
}
