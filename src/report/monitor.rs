//! The picture that `monitor` draws. What matters most stays when the terminal is small: the guard's state, then the
//! signals, the processes, the last events, the strips.

use std::collections::VecDeque;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Sparkline};

use crate::clock;
use crate::guard::{Cause, State};
use crate::runtime::monitor::{EVENTS, LOOK_PERIOD_MS, Process, View};
use crate::signal::{BusStatus, Health, MonitorRow, Multiplicity, Sample, Sensor, Sensors};

/// Rows of the frame around a table.
const FRAME: u16 = 2;
/// Rows of a strip with its frame, at least.
const STRIP_ROWS: u16 = 3;

/// Draws what `view` knows at `now_ns`.
pub fn draw(view: &View, now_ns: u64, frame: &mut Frame) {
    let (signals, processes) = (signal_lines(view, now_ns), process_lines(view, now_ns));
    let rows = |lines: &[Line]| lines.len() as u16 + FRAME;
    let left = frame.area().height.saturating_sub(1 + rows(&signals) + rows(&processes));
    // Two events at least, should there be room; then the strips; then more events.
    let events = (left / 3).clamp(2.min(left.saturating_sub(FRAME)), EVENTS as u16) + FRAME;
    let [head, signal_area, process_area, event_area, strips] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(rows(&signals)),
        Constraint::Length(rows(&processes)),
        Constraint::Length(events.min(left)),
        Constraint::Fill(1),
    ])
    .areas(frame.area());
    frame.render_widget(head_line(view, now_ns), head);
    let framed = |lines: Vec<Line<'static>>, title: String| {
        Paragraph::new(lines).block(Block::bordered().title(title))
    };
    frame.render_widget(framed(signals, age_title(view, now_ns)), signal_area);
    frame.render_widget(framed(processes, "processes (worst of each second)".to_owned()), process_area);
    frame.render_widget(framed(event_lines(view, now_ns), "guard, newest first".to_owned()), event_area);
    draw_strips(&view.strips, frame, strips);
}

/// [s] since `stamp_ns`.
fn age_s(now_ns: u64, stamp_ns: u64) -> f64 {
    clock::span_s(now_ns.saturating_sub(stamp_ns))
}

fn head_line(view: &View, now_ns: u64) -> Line<'static> {
    let applied = &view.newest.2;
    let state = view.state();
    let (text, color) = match state {
        _ if applied.stamp_ns == 0 => ("NOT RUNNING".to_owned(), Color::DarkGray),
        _ if !view.is_guarded(now_ns) => {
            let age = view.guard_age_s(now_ns);
            (format!("NOT RUNNING, {state} until {age:.0} s ago"), Color::DarkGray)
        }
        State::Armed => (state.to_string().to_uppercase(), Color::Green),
        State::PreArm | State::Degraded => (state.to_string().to_uppercase(), Color::Yellow),
        State::Disarmed => (state.to_string().to_uppercase(), Color::Blue),
        State::FailsafeLatched | State::EmergencyStop => (state.to_string().to_uppercase(), Color::Red),
    };
    let cause = Cause::from_code(applied.cause).unwrap_or_default();
    let is_why = applied.cause != Cause::None as u32 && view.is_guarded(now_ns);
    let why = if is_why { format!(" {cause} ") } else { String::new() };
    Line::from(vec![
        Span::raw(format!(" {} ", view.bench)).bold(),
        Span::styled(
            format!(" {text} "),
            Style::new().bg(color).fg(Color::White).add_modifier(Modifier::BOLD),
        ),
        Span::raw(why),
        Span::raw("  q leaves; the bench goes on").dim(),
    ])
}

fn age_title(view: &View, now_ns: u64) -> String {
    let stamp_ns = view.newest.0.stamp_ns;
    match stamp_ns {
        0 => "signals: none yet".to_owned(),
        _ if age_s(now_ns, stamp_ns) < 1.0 => "signals".to_owned(),
        _ => format!("signals of {:.0} s ago", age_s(now_ns, stamp_ns)),
    }
}

/// A measured value; red, with why, where it is bad.
fn measured(label: &str, sample: &Sample, digits: usize, unit: &str) -> Vec<Span<'static>> {
    const WORDS: [(u32, &str); 5] = [
        (Health::STALE, "STALE"),
        (Health::OUT_OF_RANGE, "OUT OF RANGE"),
        (Health::NOT_A_NUMBER, "NOT A NUMBER"),
        (Health::FROZEN, "FROZEN"),
        (Health::COUNTER, "COUNTER"),
    ];
    let label = Span::raw(format!("{label} "));
    if sample.stamp_ns == 0 {
        return vec![label, Span::raw("-   ").dim()];
    }
    let words: Vec<&str> =
        WORDS.iter().filter(|(bit, _)| sample.health & bit != 0).map(|(_, word)| *word).collect();
    let value = Span::raw(format!("{:+.digits$} {unit}", sample.value));
    if words.is_empty() {
        return vec![label, value, Span::raw("   ")];
    }
    vec![label, value.red(), Span::raw(format!(" {}   ", words.join(", "))).red().bold()]
}

/// The sensors of this multiplicity that are shown now.
fn shown(sensors: &Sensors, multiplicity: Multiplicity) -> impl Iterator<Item = (Sensor, MonitorRow)> + '_ {
    let of_multiplicity =
        Sensor::ALL.into_iter().filter(move |sensor| sensor.row().multiplicity == multiplicity);
    let is_given = |sensor: Sensor| sensor.channels().iter().any(|channel| channel.of(sensors).stamp_ns != 0);
    of_multiplicity
        .filter_map(|sensor| Some((sensor, sensor.row().monitor?)))
        .filter(move |(sensor, shown)| shown.always || is_given(*sensor))
}

/// A line for each sensor of the bench; the first have texts beside them.
fn single_lines<const N: usize>(sensors: &Sensors, beside: [Span<'static>; N]) -> Vec<Line<'static>> {
    let mut beside = beside.into_iter();
    let line = |(sensor, shown): (Sensor, MonitorRow)| {
        let values = sensor.channels().iter().map(|channel| channel.of(sensors));
        let value = |sample| measured(shown.label, sample, shown.digits, sensor.unit());
        Line::from_iter(values.flat_map(value).chain(beside.next()))
    };
    shown(sensors, Multiplicity::Single).map(line).collect()
}

/// The first sensor of a rotor with a text beside it, then the others.
fn rotor_lines(sensors: &Sensors, rotor: usize, beside: String) -> Vec<Line<'static>> {
    let value = |(sensor, shown): (Sensor, MonitorRow)| {
        let channel = sensor.channels().get(rotor)?;
        let label = format!("{} {}", shown.label, rotor + 1);
        Some(measured(&label, channel.of(sensors), shown.digits, sensor.unit()))
    };
    let mut values = shown(sensors, Multiplicity::Rotors).filter_map(value);
    let mut first = values.next().unwrap_or_default();
    first.push(Span::raw(beside));
    let others: Vec<Span> = values.flatten().collect();
    let others = (!others.is_empty()).then(|| Line::from(others));
    std::iter::once(Line::from(first)).chain(others).collect()
}

fn signal_lines(view: &View, now_ns: u64) -> Vec<Line<'static>> {
    let (sensors, command, applied) = &view.newest;
    let estimate = &command.estimate;
    let is_controlled = command.sequence > 0;
    let controlled =
        |text: String| if is_controlled { Span::raw(text) } else { Span::raw("no controller yet").dim() };
    let angle = format!("angle {:+.4} rad (wanted {:+.4})", estimate.body_angle, estimate.reference_angle);
    let disturbance = format!("disturbance {:+.4} N m", estimate.disturbance_torque);
    let mut lines = single_lines(sensors, [controlled(angle), controlled(disturbance)]);
    for (rotor, (wanted, applied)) in command.rotor.iter().zip(applied.rotor).enumerate() {
        let wanted = if is_controlled { format!("wanted {wanted:.4}  ") } else { String::new() };
        lines.extend(rotor_lines(sensors, rotor, format!("{wanted}applied {applied:.4}")));
    }
    if view.bus.sequence > 0 {
        lines.extend(bus_lines(&view.bus));
    }
    let is_old = age_s(now_ns, sensors.stamp_ns) >= 1.0;
    if is_old { lines.into_iter().map(Stylize::dim).collect() } else { lines }
}

/// What came and went; what was refused, only where something was.
fn bus_lines(bus: &BusStatus) -> Vec<Line<'static>> {
    let counted = |counts: &[(u64, &str)]| {
        let some = counts.iter().filter(|(count, _)| *count > 0);
        some.map(|(count, what)| format!("{count} {what}")).collect::<Vec<_>>().join(", ")
    };
    let mut lines = vec![Line::raw(format!(
        "bus: received {}  sent {}  echoes heard {}, the oldest missing for {:.0} ms",
        bus.received,
        bus.sent,
        bus.echoed,
        clock::span_s(bus.echo_age_ns) * 1e3
    ))];
    if bus.foreign_command > 0 {
        lines.push(Line::raw(format!("{} commands of ANOTHER SENDER", bus.foreign_command)).red().bold());
    }
    let refused = counted(&[
        (bus.lost, "lost"),
        (bus.not_sent, "not sent"),
        (bus.error_frames, "error frames"),
        (bus.unknown_id, "unknown"),
        (bus.wrong_length, "wrong length"),
        (bus.counter, "counter"),
        (bus.not_a_number, "not a number"),
        (bus.out_of_range, "out of range"),
    ]);
    if !refused.is_empty() {
        lines.push(Line::raw(refused).yellow());
    }
    lines
}

/// Who is here or was; who never was is not shown.
fn process_lines(view: &View, now_ns: u64) -> Vec<Line<'static>> {
    let line = |process: &Process| {
        let (name, id) = (process.role.name(), process.heartbeat.process_id);
        if !process.is_alive(now_ns) {
            let age = age_s(now_ns, process.heartbeat.stamp_ns);
            return Line::raw(format!("{name:8} {id:7}  SILENT for {age:.0} s")).red();
        }
        Line::raw(format!(
            "{name:8} {id:7} {:6.1} Hz  late {:6.1}  out {:6.1} µs  skipped {}  overruns {}",
            process.rate,
            process.shown_us.0,
            process.shown_us.1,
            process.cycle.skipped,
            process.cycle.overruns,
        ))
    };
    let known = view.processes.iter().filter(|process| process.heartbeat.count > 0);
    let lines: Vec<Line> = known.map(line).collect();
    if lines.is_empty() {
        return vec![
            Line::raw("nobody yet: start `rotorbench emulate --shm` or `bridge`, and `control`").dim(),
        ];
    }
    lines
}

fn event_lines(view: &View, now_ns: u64) -> Vec<Line<'static>> {
    let line = |event: &crate::signal::GuardEvent| {
        let (age, sentence) = (age_s(now_ns, event.stamp_ns), super::guard::event(event));
        Line::raw(format!("{age:8.1} s ago  {sentence}"))
    };
    view.said.iter().map(line).collect()
}

fn draw_strips(strips: &[VecDeque<f64>; 3], frame: &mut Frame, area: Rect) {
    let shown = usize::from((area.height / STRIP_ROWS).min(3));
    if shown == 0 {
        return;
    }
    let areas = Layout::vertical(vec![Constraint::Fill(1); shown]).split(area);
    let titles = ["angle [rad]", "rotor 1 [-]", "rotor 2 [-]"];
    for ((strip, title), area) in strips.iter().zip(titles).zip(areas.iter()) {
        let width = usize::from(area.width.saturating_sub(FRAME));
        let shown: Vec<f64> = strip.iter().skip(strip.len().saturating_sub(width)).copied().collect();
        let low = shown.iter().copied().fold(f64::INFINITY, f64::min);
        let high = shown.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let span = (high - low).max(1e-6);
        let data: Vec<u64> = shown.iter().map(|value| ((value - low) / span * 1000.0) as u64 + 1).collect();
        let seconds = shown.len() as f64 * LOOK_PERIOD_MS as f64 * 1e-3;
        let title = match shown.last() {
            None => title.to_owned(),
            Some(now) => format!("{title} {now:+.3}, {low:+.3} to {high:+.3} in {seconds:.0} s"),
        };
        frame.render_widget(
            Sparkline::default().block(Block::bordered().title(title)).data(data).max(1001),
            *area,
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Channel, ROTORS};

    fn text(sensors: &Sensors) -> String {
        let rotors = (0..ROTORS).flat_map(|rotor| rotor_lines(sensors, rotor, String::new()));
        single_lines(sensors, []).into_iter().chain(rotors).map(|line| format!("{line}\n")).collect()
    }

    #[test]
    fn each_sensor_is_shown_as_its_row_says() {
        for channel in Channel::ALL {
            let Some(row) = channel.sensor().row().monitor else { continue };
            let number = channel.rotor().map_or_else(String::new, |rotor| format!(" {}", rotor + 1));
            let label = format!("{}{number} ", row.label);
            let mut sensors = Sensors::default();
            assert_eq!(text(&sensors).contains(&label), row.always, "{label}");
            *channel.of_mut(&mut sensors) = Sample::good(312.5, 1, 1);
            assert!(text(&sensors).contains(&format!("{label}+312.5")), "{}", text(&sensors));
        }
    }
}
