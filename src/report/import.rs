//! What `import` says of a log.

use super::findings::text as sentence;
use crate::log::can_capture::CaptureNotes;
use crate::log::guess::may_be_command;
use crate::log::import_notes::{Instead, Occurrences};
use crate::log::narrow_range::NarrowRange;
use crate::log::signals::{log_signal, rotor_of};
use crate::log::tables::Skipped;
use crate::log::{Dataset, Notes};
use crate::screening::summary::LogSummary;
use crate::signal::columns;
use crate::unit::short;

/// Columns that may be a command, shown at most.
const SHOWN_COLUMNS: usize = 4;

/// What a log is like, and what reading it left out.
#[must_use]
pub fn text(log: &Dataset, notes: &Notes, findings: &LogSummary) -> String {
    let mut lines = Vec::new();
    let [start, end] = findings.time_s;
    let rate = if findings.median_interval_s > 0.0 { 1.0 / findings.median_interval_s } else { 0.0 };
    let [low, high, longest] = findings.interval_s.map(|interval| 1e3 * interval);
    lines.push(format!("{} (sha256 {:.12})", log.source_name(), log.sha256()));
    lines.push(format!(
        "{} samples from {start:.3} s to {end:.3} s, {rate:.1} Hz; intervals 5-95 %: {low:.2} to {high:.2} ms, longest \
         {longest:.2} ms (holes not counted)",
        findings.samples
    ));
    lines.push(format!(
        "{:<24}{:>9}{:>9}{:>10}{:>14}{:>14}",
        "channel", "values", "missing", "every ms", "least", "greatest"
    ));
    for channel in &findings.channels {
        let [least, greatest] = channel.range;
        lines.push(format!(
            "{:<24}{:>9}{:>9}{:>10.2}{:>14}{:>14}{}",
            channel.name,
            channel.samples,
            channel.missing,
            1e3 * channel.median_interval_s,
            cell(least),
            cell(greatest),
            if log_signal(&channel.name).is_none() { "  carried along, not used" } else { "" }
        ));
    }
    lines.extend(note_lines(notes));
    for warning in &findings.findings {
        // What is of the whole log comes once for each rotor.
        let line = format!("warning: {}", sentence(warning));
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    lines.join("\n") + "\n"
}

/// A value of a channel, in a column of 14 letters: with a power of ten where its digits need more.
fn cell(value: f64) -> String {
    let digits = format!("{value:.6}");
    if digits.len() < 14 { digits } else { format!("{value:.5e}") }
}

/// What became of the frames of a capture.
#[must_use]
pub fn frames(notes: &CaptureNotes) -> String {
    let CaptureNotes {
        frames,
        other_interfaces,
        sensors,
        commands,
        rows_by,
        out_of_order,
        skipped: left_out,
    } = notes;
    let mut text = format!(
        "note: {frames} frames; {} carry sensors, {} commands; a row for each `{rows_by}`\n",
        sensors.accepted, commands.accepted
    );
    let counts = [
        (*other_interfaces as u64, "frames of other interfaces, left out"),
        (sensors.wrong_length + commands.wrong_length, "frames of the wrong length"),
        (sensors.counter + commands.counter, "frames whose counter is wrong"),
        (sensors.lost + commands.lost, "frames missing by their counters"),
        (sensors.not_a_number + commands.not_a_number, "values that are not a number"),
        (sensors.out_of_range + commands.out_of_range, "values out of range"),
        (*out_of_order, "rows out of order, left out"),
    ];
    for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
        text += &format!("note: {count} {what}\n");
    }
    text.extend(left_out.iter().map(|it| skipped(it) + "\n"));
    text
}

/// What the reader left out, cut or merged, in words.
#[must_use]
pub fn note_lines(notes: &Notes) -> Vec<String> {
    let mut lines: Vec<String> = of_rows(notes);
    if notes.remarks > 0 {
        let first = notes.first_remark.as_deref().unwrap_or("");
        lines.push(match notes.remarks {
            1 => format!("note: a remark between the rows, not read: {first}"),
            remarks => format!("note: {remarks} remarks between the rows, not read; the first: {first}"),
        });
    }
    lines.extend(notes.skipped.iter().map(skipped));
    if notes.not_chosen > 0 {
        lines.push(format!(
            "note: {} rows left out for which the mapping's `where` does not hold",
            notes.not_chosen
        ));
    }
    if notes.greatest_shift_s > 0.0 {
        let shift = 1e3 * notes.greatest_shift_s;
        lines.push(format!(
            "note: channels have clocks of their own: values were moved by {shift:.3} ms at most, to the nearest row"
        ));
    }
    lines.extend(notes.narrow_ranges.iter().map(narrow));
    // A mapping for sixteen rotors lacks most of them on every machine.
    let absent: Vec<&str> = notes
        .absent
        .iter()
        .filter(|name| rotor_of(name).is_none_or(|rotor| rotor <= 2))
        .map(String::as_str)
        .collect();
    if !absent.is_empty() {
        lines.push(format!("note: columns absent for {}", absent.join(", ")));
    }
    lines.extend(notes.instead.iter().map(|it| {
        let Instead { signal, read, dead } = it;
        format!("note: `{signal}` is read from `{read}`, for `{dead}` holds no value but 0")
    }));
    lines.extend(without_command(notes));
    if !notes.unused_columns.is_empty() {
        lines.push(format!("note: columns not used: {}", notes.unused_columns.join(", ")));
    }
    lines
}

/// That a mapping's range of commands ends too early, and the one that does not.
fn narrow(of: &NarrowRange) -> String {
    let NarrowRange { signal, column, above, share, from_to_log: [from, to, log], scale, offset, .. } = of;
    let rates = of.rates_rad_s.map_or_else(String::new, |[end, top]| {
        format!(", and the rate is {} rad/s at {}, {} rad/s there", short(end), short(*to), short(top))
    });
    format!(
        "warning: the mapping's range is too narrow for this log: {above} values of `{signal}` ({:.0} %) lie above {}, up to {} in \
         `{column}`{rates}: g(u) near full command will be wrong. In a mapping of your own (`--write-mapping` makes one) give `{signal}` \
         `scale = {}`, `offset = {}`: {} to {}",
        1e2 * share,
        short(*to),
        short(*log),
        short(*scale),
        short(*offset),
        short(*from),
        short(*log)
    )
}

/// Which columns may be the command, where none was read.
fn without_command(notes: &Notes) -> Option<String> {
    let lacks_command = notes.absent.iter().any(|name| columns::is_command(name));
    let unused = notes.unused_columns.iter().filter(|_| lacks_command);
    let may_be = unused.filter_map(|it| may_be_command(it).map(|unit| format!("`{it}` ({unit})")));
    let may_be: Vec<String> = may_be.take(SHOWN_COLUMNS).collect();
    (!may_be.is_empty()).then(|| {
        format!(
            "note: no command was read; of the columns not used {} may be it: name it in a copy of the mapping, or look at the guess \
             (`import` without --mapping)",
            may_be.join(", ")
        )
    })
}

/// What was odd in rows and cells, each with the first lines where it was.
fn of_rows(notes: &Notes) -> Vec<String> {
    let cut =
        "cell at the end of the file, whose last line has no end, may have been cut in writing: left out";
    let counted = [
        (&notes.short_rows, "row(s) end before the header does: the rest of their cells is missing"),
        (&notes.long_rows, "row(s) go on behind the header: the surplus is not read"),
        (&notes.repeated_header, "line(s) say the header again, left out"),
        (&notes.text_behind, "line(s) of text behind the last row, without a number in them: not read"),
        (&notes.cut_cell, cut),
        (&notes.without_time, "row(s) without a time, left out"),
        (&notes.repeated_time, "row(s) repeat the time of the row before: merged into it"),
        (&notes.conflicting_cells, "cell(s) contradict the row of the same time: left out"),
        (&notes.backward_time, "row(s) whose time lies before an earlier row's: left out"),
    ];
    let counted = counted.into_iter().filter_map(|(places, what)| at_lines(places, what));
    let clamped = notes.clamped.iter().filter_map(|(signal, places)| {
        at_lines(places, &format!("values of `{signal}` cut to the mapping's `clamp`"))
    });
    let invalid = notes.invalid.iter().filter_map(|(signal, places)| {
        at_lines(places, &format!("values of `{signal}` outside the mapping's `valid`: left out"))
    });
    let texts = notes.texts.iter().filter_map(|(column, places)| {
        at_lines(places, &format!("cell(s) of `{column}`, which is only carried along, hold text: missing"))
    });
    counted.chain(texts).chain(clamped).chain(invalid).collect()
}

/// How often something was, and the first lines where; `None` where it was nowhere.
fn at_lines(places: &Occurrences, what: &str) -> Option<String> {
    let shown: Vec<String> = places.first_lines.iter().map(u64::to_string).collect();
    let more = if places.count > shown.len() { ", ..." } else { "" };
    let mark = if places.count == 1 { "line" } else { "lines" };
    (places.count > 0).then(|| format!("note: {} {what} ({mark} {}{more})", places.count, shown.join(", ")))
}

/// What a reader of a format left out.
fn skipped(of: &Skipped) -> String {
    let Skipped { code, subject, count, first_byte } = of;
    let what = match *code {
        "damaged_bytes" => "stretches of damaged bytes, passed over",
        "damaged_header_line" => "lines of the header that cannot be read",
        "damaged_format" => "descriptions of messages that cannot be read",
        "damaged_message" | "damaged_frame" | "damaged_container" => "damaged messages, left out",
        "damaged_rows" | "damaged_column" => "damaged parts of a column, left out",
        "frame_without_reference" => "frames that build on one that is lost, left out",
        "jump_in_time" => "frames whose time jumps, left out",
        "no_scale_in_header" => "columns whose scale the header does not say, left out",
        "no_time" | "no_clock" => "messages without a time, left out",
        "damaged_line" => "lines of frames that cannot be read, left out",
        "unknown_message" => "messages of an unknown kind, passed over",
        "cut_off" => "places where the file breaks off",
        "logger_dropout" => "times at which the logger lost data",
        "not_a_number" => "values that are no number",
        "several_values_in_a_row" => "columns with several values in a row, left out",
        "unusable_definition" => "definitions of messages that cannot be used",
        "never_updated" => "topics that never gave a value",
        other => other,
    };
    let subject = if subject.is_empty() { String::new() } else { format!(" ({subject})") };
    format!("note: {count} {what}{subject}, the first at byte {first_byte}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_that_is_too_narrow_is_said_with_one_that_is_not() {
        let range = NarrowRange {
            signal: "command_1".to_owned(),
            column: "ESC signal (µs)".to_owned(),
            above: 179,
            share: 0.222,
            from_to_log: [1000.0, 2000.0, 2270.0],
            rates_rad_s: Some([383.6, 459.1]),
            scale: 1.0 / 1270.0,
            offset: -1000.0 / 1270.0,
        };
        let notes = Notes { narrow_ranges: vec![range], ..Notes::default() };
        let said = note_lines(&notes).concat();
        assert_eq!(
            said,
            "warning: the mapping's range is too narrow for this log: 179 values of `command_1` (22 %) lie above 2000, up to 2270 in \
             `ESC signal (µs)`, and the rate is 383.6 rad/s at 2000, 459.1 rad/s there: g(u) near full command will be wrong. In a \
             mapping of your own (`--write-mapping` makes one) give `command_1` `scale = 0.000787402`, `offset = -0.787402`: 1000 to 2270"
        );
        assert!(said.chars().count() <= 400, "{}", said.chars().count());
    }

    #[test]
    fn a_log_without_a_command_names_columns_that_may_be_one() {
        let columns = ["Servo 1 (µs)", "Servo 3 (µs)", "Motor Efficiency (%)", "AccX (g)"].map(str::to_owned);
        let mut notes = Notes { unused_columns: columns.to_vec(), ..Notes::default() };
        assert!(!note_lines(&notes).concat().contains("may be it"));
        notes.absent.push("command_1".to_owned());
        let said = note_lines(&notes).concat();
        assert!(
            said.contains("of the columns not used `Servo 1 (µs)` (us), `Servo 3 (µs)` (us) may be it"),
            "{said}"
        );
    }

    #[test]
    fn values_keep_to_their_column() {
        let cells = [0.4, -12_345.678, 3.234_567_89e14, -1e300, f64::NAN].map(cell);
        assert_eq!(cells, ["0.400000", "-12345.678000", "3.23457e14", "-1.00000e300", "NaN"]);
    }
}
