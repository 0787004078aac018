//! What `discover` found: the text and the page.

use std::fmt::Write as _;
use std::path::Path;

use super::diagnosis::{key_numbers, signals};
use super::findings::sentence;
use super::measure::measure;
use super::notes::{self, Detail};
use super::story::{error_table, errors, measured, wrapped};
use super::verdict;
use super::{Axis, Mark, Page, Plot, Series, TextTable, Tone, number};
use crate::compare::Comparison;
use crate::diagnose::diagnosis::{FoundParameter, Verdict};
use crate::discover::answer::{ChannelDirection, OtherLaw, Shape, ShapePoint, TellApart};
use crate::discover::{Discovery, LawVerdict};
use crate::effect::Site;
use crate::screening::ScreenedLog;

/// Other formulas that are listed.
const SHOWN: usize = 5;

/// Behind the channel of what looks at its direction, too.
const DIRECTION: &str = " and which way it went last";

/// Where a law acts, in words.
fn at(site: Site) -> &'static str {
    match site {
        Site::Command => "the command",
        Site::SteadyRate => "the steady rate",
        Site::RotorAcceleration => "the rotor's acceleration",
        Site::RotorRateSensor => "the rotor's rate sensor",
        Site::Thrust => "each rotor's thrust",
        Site::Torque => "the torque on the body",
        Site::BodyRateSensor => "the gyro",
    }
}

/// What kind of function a term is, in words.
fn kind(form: &str) -> &'static str {
    match form {
        "linear" | "drift" => "in proportion",
        "drift_since" => "in proportion to the time since some moment",
        "square" | "cube" | "signed_square" | "root" | "signed_root_cube" => "a power",
        "absolute" => "in proportion to the size, whatever the sign",
        "saturation" => "in proportion near zero, and no more than a limit",
        "stribeck" => "strongest at low speed, and less beyond",
        "dead_zone" => "nothing up to a threshold on either side, and in proportion beyond it",
        "rising_ramp" => "nothing up to a threshold, and in proportion above it",
        "falling_ramp" => "nothing down to a threshold, and in proportion below it",
        "threshold" => "a step at a threshold",
        "peak" => "a peak about one place",
        "wave" | "sine" | "cosine" => "a wave along the channel, as of teeth or poles",
        "bend" => "a bend, written as a part of a wave: it says nothing beyond the range that was logged",
        "warm_up" => "a change that dies out after the start",
        "play" => "play: it stands still until the command has gone a way, and then is dragged along",
        "hysteresis" => {
            "a force that builds up over a way, stays there, and turns with the motion: hysteresis"
        }
        "relay" => {
            "a relay: two levels, and which of them holds between its thresholds is from where it came"
        }
        "creep" => "a part of the command that follows late",
        "line" => "a swing of one frequency, whatever the channels do",
        "product" | "product_of_square" | "product_of_absolute" => "a product of two channels",
        "product_of_saturation" | "product_of_peak" | "product_of_dead_zone" | "product_of_ramp" => {
            "one channel, scaled by a function of another"
        }
        _ => "a function",
    }
}

/// The answer in a sentence; names between `mark`s.
#[must_use]
pub fn headline(found: &Discovery, mark: &str) -> String {
    let site = found.site.map_or("", at);
    let channels = found.channels.iter().map(|name| format!("{mark}{name}{mark}")).collect::<Vec<_>>();
    let channels = channels.join(" and ");
    let sure = found.confidence.map_or(String::new(), |share| format!(" ({:.0} % sure)", 100.0 * share));
    match found.verdict {
        LawVerdict::Law => {
            let kinds: Vec<&str> = found.forms.iter().map(|form| kind(form)).collect();
            format!(
                "A law outside the catalogue acts on {site}, by {channels}{sure}: {}.",
                kinds.join("; and ")
            )
        }
        LawVerdict::Shape => {
            let by_direction = found.shape.as_ref().is_some_and(|shape| shape.by_direction);
            format!(
                "What is missing acts on {site}, by {channels}{}{sure}: a smooth function of it explains {:.0} % of the error above \
                 noise. No formula that was tried does.",
                if by_direction { DIRECTION } else { "" },
                100.0 * found.shape.as_ref().map_or(0.0, |shape| shape.explained)
            )
        }
        LawVerdict::Diagnosed(Verdict::Unknown) => {
            let effects = &found.effects;
            let named = effects.iter().map(|id| format!("{mark}{id}{mark}")).collect::<Vec<_>>().join(" + ");
            let best = if effects.is_empty() {
                String::new()
            } else {
                format!(" What is extended below has {named}, the best of the catalogue.")
            };
            format!("Something is missing, and no function of the signals that laws know explains it.{best}")
        }
        LawVerdict::Catalogue | LawVerdict::Diagnosed(Verdict::Adequate) => {
            format!("No law is to be discovered. {}", catalogue(found, mark))
        }
        LawVerdict::Diagnosed(_) => verdict::sentence(&found.diagnosis, mark),
    }
}

fn catalogue(found: &Discovery, mark: &str) -> String {
    let effects: Vec<String> = found.effects.iter().map(|id| format!("{mark}{id}{mark}")).collect();
    match found.verdict {
        LawVerdict::Catalogue if found.diagnosis.verdict == Verdict::Unknown => format!(
            "No formula does better than {} of the catalogue, and with {} something is still missing.",
            effects.join(" + "),
            if effects.len() == 1 { "it" } else { "them" }
        ),
        LawVerdict::Catalogue if found.effects == found.diagnosis.effects => {
            format!("The catalogue explains it as well: {}.", verdict::missing(&found.diagnosis, mark))
        }
        LawVerdict::Catalogue => format!("The catalogue explains it as well: {}.", effects.join(" + ")),
        _ => verdict::sentence(&found.diagnosis, mark),
    }
}

/// What the data cannot tell from the formula.
fn other(other: &OtherLaw, unit: &str) -> String {
    let far = match other.differs_by {
        Some(share) => format!(", at most {:.0} % of the law apart over the visited range", 100.0 * share),
        None => format!(", on {} by {}", at(other.site), other.channels.join(" and ")),
    };
    format!("{} (held out {} {unit}{far})", other.expression, number(other.validate, 3))
}

/// What to record.
fn experiment(next: &TellApart) -> String {
    match (&next.channels[..], next.to) {
        ([only], Some(to)) => format!(
            "To tell the formulas apart, record a log in which {only} goes to {}: there they differ most.",
            number(to, 3)
        ),
        (several, _) => format!(
            "To tell the formulas apart, record a log in which {} move apart from each other.",
            several.join(" and ")
        ),
    }
}

/// What stands beneath the headline: what else it may be, and what would tell.
#[must_use]
pub fn beneath(found: &Discovery) -> Vec<String> {
    let unit = found.error.unit;
    let mut lines: Vec<String> = Vec::new();
    if found.verdict == LawVerdict::Catalogue && found.effects == found.diagnosis.effects {
        lines.extend(verdict::beneath(&found.diagnosis, ""));
    }
    if !found.alternatives.is_empty() {
        lines.push("These data cannot tell it from:".to_owned());
        lines.extend(found.alternatives.iter().take(SHOWN).map(|it| format!("  {}", other(it, unit))));
    }
    lines.extend(found.next_experiment.as_ref().map(experiment));
    if found.verdict == LawVerdict::Law && !found.effects.is_empty() {
        lines.push(format!("Beside it the catalogue's {} are missing.", found.effects.join(" + ")));
    }
    lines
}

/// The answer as text; `detail` says how much of the notes is said.
#[must_use]
pub fn text(found: &Discovery, detail: Detail) -> String {
    let mut out = wrapped("", &headline(found, ""));
    if let Some(expression) = &found.expression {
        let head = if found.verdict == LawVerdict::Law { "" } else { "nearest: " };
        let _ = writeln!(out, "  {head}+ {expression}");
        for (name, FoundParameter { value, standard_error, unit }) in &found.parameters {
            let _ = writeln!(out, "    {name} = {}", measured(*value, *standard_error, unit));
        }
    }
    for changed in &found.changed_parameters {
        let to = measured(changed.to, changed.standard_error, &changed.unit);
        let _ = writeln!(out, "  {} ({}): {} -> {to}", changed.name, changed.symbol, number(changed.from, 5));
    }
    for line in beneath(found) {
        let first = if line.starts_with("  ") { "  " } else { "" };
        out += &wrapped(first, &line);
    }
    out.push('\n');
    out += &errors(&found.error);
    out += &places(found).map_or(String::new(), |table| format!("\n{}", table.text()));
    out + &notes::lines(&notes::of_all(&found.findings), "Note: ", detail)
}

/// Places that were looked at.
fn places(found: &Discovery) -> Option<TextTable> {
    let mut table = TextTable::new(["smooth function of", "acts on", "explains [%]"]);
    for place in found.r#where.iter().take(SHOWN) {
        let direction = if place.by_direction { DIRECTION } else { "" };
        table = table.row([
            format!("{}{direction}", place.channels.join(", ")),
            place.site.name().to_owned(),
            number(100.0 * place.explained, 3),
        ]);
    }
    (!table.is_empty()).then_some(table)
}

/// Whether a file was written.
#[must_use]
pub fn written(is_law: bool, path: &Path) -> String {
    if is_law {
        format!("written: {}", path.display())
    } else {
        format!("not written: {} takes a model with a law, and there is none", path.display())
    }
}

/// The page; `compared` are the model and the one with the law on each of `logs`.
#[must_use]
pub fn page(found: &Discovery, compared: &[Vec<Comparison>], logs: &[ScreenedLog]) -> Page {
    let mut page = Page::new("A law that no catalogue has");
    let mark = match found.verdict {
        LawVerdict::Diagnosed(Verdict::Adequate) | LawVerdict::Law => Mark::Good,
        LawVerdict::Diagnosed(Verdict::Unknown) => Mark::Bad,
        _ => Mark::Warning,
    };
    page.verdict(mark, headline(found, "**"));
    key_numbers(&mut page, &found.error);
    if let Some(expression) = &found.expression {
        page.formula(expression.clone());
        let mut table = TextTable::new(["parameter", "value", "standard error", "unit"]);
        for (name, it) in &found.parameters {
            let error = it.standard_error.map_or("-".to_owned(), |error| number(error, 2));
            table = table.row([name.clone(), number(it.value, 5), error, it.unit.clone()]);
        }
        page.table(table);
    }
    let lines = beneath(found);
    if !lines.is_empty() {
        page.list(lines);
    }
    if let Some(shape) = &found.shape {
        page.heading("Its shape").plot(drawn(shape));
    }
    page.heading("How far the error falls");
    page.table(
        error_table(&found.error, ["model", "fitted on", "held out"]).caption(measure(&found.error.measure)),
    );
    if let Some(table) = places(found) {
        page.heading("Where it acts").table(table.caption(
            "Share of the held-out squared error above noise that a smooth function explains, without a formula",
        ));
    }
    if !found.findings.is_empty() {
        page.heading("Notes").list(found.findings.iter().map(sentence));
    }
    signals(&mut page, compared, logs);
    page
}

/// The formula over the smooth function and its band; of two channels along the first, at the middle of the second. What looks at the
/// direction has two curves.
fn drawn(shape: &Shape) -> Plot {
    let middle = shape.points.len() / 2;
    let second = shape.points.get(middle).and_then(|point| point.at.get(1)).copied();
    let channel = shape.channels.first().map_or("", String::as_str);
    let title = match second {
        Some(value) => format!("What is added, at {} {}", shape.channels[1], number(value, 3)),
        None => "What is added".to_owned(),
    };
    let mut plot = Plot::new(title, Axis::new(channel, ""), Axis::new("added", &shape.unit));
    if shape.by_direction {
        let of = |direction| shape.points.iter().filter(move |it| it.direction == Some(direction)).collect();
        let [rising, falling]: [Vec<&ShapePoint>; 2] =
            [of(ChannelDirection::Rising), of(ChannelDirection::Falling)];
        plot = with_curve(plot, &rising, ["95 % band, rising", "smooth function, rising"], Tone::Measured);
        return with_curve(plot, &falling, ["95 % band, falling", "smooth function, falling"], Tone::Model);
    }
    let shown: Vec<&ShapePoint> =
        shape.points.iter().filter(|point| point.at.get(1).copied() == second).collect();
    // A constant is the base's own numbers' to take up: both are drawn about their means.
    let value = mean(shown.iter().map(|point| point.value));
    let centred: Vec<ShapePoint> =
        shown.iter().map(|point| ShapePoint { value: point.value - value, ..(*point).clone() }).collect();
    plot = with_curve(
        plot,
        &centred.iter().collect::<Vec<_>>(),
        ["95 % band", "smooth function"],
        Tone::Measured,
    );
    let formula: Vec<f64> = shown.iter().map(|point| point.formula.unwrap_or(f64::NAN)).collect();
    if formula.iter().any(|value| value.is_finite()) {
        let x: Vec<f64> = shown.iter().filter_map(|point| point.at.first().copied()).collect();
        let centre = mean(formula.iter().copied());
        let formula: Vec<f64> = formula.iter().map(|value| value - centre).collect();
        plot = plot.series(Series::line("formula", &x, &formula).tone(Tone::Model));
    }
    plot
}

/// Of the values that are numbers.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values
        .filter(|value| value.is_finite())
        .fold((0.0, 0.0_f64), |(sum, count), value| (sum + value, count + 1.0));
    sum / count.max(1.0)
}

/// The curve through the points, and its band where that is known.
fn with_curve(mut plot: Plot, points: &[&ShapePoint], [band, curve]: [&str; 2], tone: Tone) -> Plot {
    let x: Vec<f64> = points.iter().filter_map(|point| point.at.first().copied()).collect();
    let y: Vec<f64> = points.iter().map(|point| point.value).collect();
    let edge = |sign: f64| -> Vec<f64> {
        let error = |point: &&ShapePoint| 2.0 * point.standard_error.unwrap_or(f64::NAN);
        points.iter().map(|point| point.value + sign * error(point)).collect()
    };
    if points.iter().any(|point| point.standard_error.is_some()) {
        plot = plot.series(Series::band(band, &x, &edge(-1.0), &edge(1.0)));
    }
    plot.series(Series::line(curve, &x, &y).tone(tone))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::Diagnosis;
    use crate::discover::assemble::of_catalogue;

    #[test]
    fn what_the_extended_error_is_of_is_said() {
        let said = |effects: &[&str]| headline(&of_catalogue(Diagnosis::of(Verdict::Unknown, effects)), "`");
        let begin = "Something is missing, and no function of the signals that laws know explains it.";
        assert_eq!(said(&[]), begin);
        assert_eq!(
            said(&["transport_delay"]),
            format!("{begin} What is extended below has `transport_delay`, the best of the catalogue.")
        );
    }

    #[test]
    fn the_catalogue_is_no_surer_than_its_sets() {
        let mut diagnosed = Diagnosis::of(Verdict::MissingEffect, &["gyro_lag", "gyro_bias"]);
        diagnosed.alternatives.push(vec!["gyro_lag".to_owned(), "torque_bias".to_owned()]);
        diagnosed.common_effects = vec!["gyro_lag".to_owned()];
        let mut found = of_catalogue(diagnosed);
        let begin = "No law is to be discovered. The catalogue explains it as well: ";
        let said =
            format!("{begin}`gyro_lag`, and beside it `gyro_bias` or something else that does as well.");
        assert_eq!(headline(&found, "`"), said);
        found.diagnosis.alternative_errors = vec![(0.1, "rad/s")];
        assert_eq!(
            beneath(&found),
            ["These data cannot tell it from gyro_lag + torque_bias (held out 0.100 rad/s)."]
        );
        found.effects = vec!["torque_bias".to_owned()];
        assert_eq!(
            headline(&found, "`"),
            format!("{begin}`torque_bias`."),
            "what a formula was held against"
        );
    }
}
