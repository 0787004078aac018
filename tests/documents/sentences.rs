//! Numbers in sentences about what a page's commands said are the numbers that they said.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use rotorbench::model::Model;

use super::numbers::words;
use super::rotorbench;

/// The numbers behind `begin` in the `at`-th of the lines that begin so and have numbers behind it.
fn numbers(said: &str, begin: &str, at: usize) -> Vec<f64> {
    let begin = words(begin);
    let is_mark = |it: char| !it.is_ascii_digit() && it != '-';
    let behind = |line: &str| -> Vec<f64> {
        let rest = words(line);
        let rest = rest.strip_prefix(&begin).unwrap_or_default();
        rest.split_whitespace().filter_map(|word| word.trim_matches(is_mark).parse().ok()).collect()
    };
    let mut rows = said.lines().map(behind).filter(|row| !row.is_empty());
    rows.nth(at).unwrap_or_else(|| panic!("no line {at} begins with `{begin}`:\n{said}"))
}

/// A number as a page has it, with so many significant digits: 0.0277 of two is 0.028, 24.6 of two is 25.
fn rounded(number: f64, digits: i32) -> String {
    let places = (digits - 1 - number.abs().log10().floor() as i32).max(0);
    format!("{number:.*}", places as usize)
}

/// Whole numbers in words.
const WORDS: [&str; 13] = [
    "none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve",
];

fn word(number: f64) -> &'static str {
    WORDS[number.round() as usize]
}

/// What sentences say of what was said.
struct Page<'a> {
    name: &'a str,
    text: String,
    said: &'a str,
    held: Vec<String>,
}

impl Page<'_> {
    fn holds(&mut self, phrase: String) {
        let phrase = words(&phrase);
        assert!(self.text.contains(&phrase), "{} does not say: {phrase}\n{}", self.name, self.said);
        self.held.push(phrase);
    }

    /// The error of the body's rate is so many times its noise floor, in words.
    fn times_its_floor(&self) -> &'static str {
        let row = numbers(self.said, "body rate", 0);
        word(row[0] / row[1])
    }
}

/// What stands outside of blocks, with the descriptions of pictures.
fn prose(text: &str) -> String {
    let mut is_block = false;
    let outside = text.lines().filter(|line| {
        let is_fence = line.starts_with("```");
        is_block ^= is_fence;
        !is_block && !is_fence && !line.starts_with("    ")
    });
    words(&outside.collect::<Vec<_>>().join("\n"))
}

/// Holds the sentences of `page` against what its commands said, which they did in `folder`.
pub fn check(page: &str, text: &str, said: &str, folder: &Path) {
    let mut page = Page { name: page, text: prose(text), said, held: Vec::new() };
    match page.name {
        "README.md" => readme(&mut page),
        "docs/tutorial.md" => tutorial(&mut page, folder),
        "docs/guide/compare.md" => {
            let times = page.times_its_floor();
            page.holds(format!("The body's rate is not: its error is {times} times the floor"));
        }
        "docs/guide/diagnose.md" => {
            let rung = numbers(said, "1 + gravity_pendulum:", 0);
            let (before, after) = (rounded(rung[0], 3), rounded(rung[1], 2));
            page.holds(format!("the error falls from {before} to {after} rad/s, which is the noise"));
            assert!(rung[1] < numbers(said, "noise floor", 0)[0], "it is the noise");
        }
        "docs/guide/identify.md" => {
            page.holds(format!("{}, p = 16 and J = 0.032: J is off", emulated_rotor()));
        }
        "docs/guide/design.md" => design(&mut page, folder),
        _ => {}
    }
}

/// The numbers of the emulated rotor, as a page that identifies it has them; pole and inertia are held beside them.
fn emulated_rotor() -> String {
    let it = Model::paper();
    assert_eq!((it.actuator.pole, it.body.inertia), (16.0, 0.032));
    let curve = &it.actuator.steady_rate;
    format!("The emulator has k_V = {}, c_g2 = {}, c_g1 = {}", it.actuator.voltage_gain, curve[1], curve[2])
}

/// The picture is of the story's own run.
fn readme(page: &mut Page) {
    let said = words(page.said);
    let (_, fall) = said.split_once("takes the held-out error from ").expect("what `extend` begins with");
    let (before, rest) = fall.split_once(" (").expect("as it is");
    let after =
        rest.split(") to ").nth(1).and_then(|it| it.split(';').next()).expect("extended, with its unit");
    page.holds(format!(
        "adding gravity_pendulum takes the held-out error from {before} to {after}, which is the noise"
    ));
}

/// The table of two controllers: the page shows the command of one of them.
fn design(page: &mut Page, folder: &Path) {
    let done = rotorbench(folder, &["design", "--model", "paper", "--controller", "pid", "--delay-ms", "13"]);
    let pid = String::from_utf8(done.stdout).expect("UTF-8");
    let row = |begin: &str| [page.said, &pid].map(|said| numbers(said, begin, 0)[0]);
    let [grow, fall] = [row("gain may grow by"), row("gain may fall to")];
    let [phase, delay] = [row("phase margin [°]"), row("further delay up to [ms]")];
    let [peak, band] = [row("sensitivity peak"), row("bandwidth (-3 dB) [rad/s]")];
    let gains = [0, 1].map(|at| format!("{}, {}", rounded(grow[at], 2), rounded(fall[at], 2)));
    page.holds(format!("| gain may grow by, fall to | {} | {} |", gains[0], gains[1]));
    page.holds(format!("| phase margin | {:.0}° | {:.0}° |", phase[0], phase[1]));
    let delays = delay.map(|it| rounded(it, 3));
    page.holds(format!("| further delay | {} ms | {} ms |", delays[0], delays[1]));
    page.holds(format!("| sensitivity peak | {} | {}:", rounded(peak[0], 3), rounded(peak[1], 2)));
    page.holds(format!("| bandwidth | {} rad/s | {} rad/s |", rounded(band[0], 3), rounded(band[1], 3)));
}

/// Settings that the tutorial's own files and commands have, and what follows from them by a difference.
const SETTINGS: [&str; 23] = [
    // Its sections, and what is said of them.
    "1.",
    "2.",
    "3.",
    "4.",
    "5.",
    "6.",
    "7.",
    "8.",
    "0 and no warning",
    "95 % interval",
    "Exit code 1",
    // The hidden effect, with the angle that `--hide` takes where none is given.
    "0.4 N m",
    "0.1 rad",
    // The moves and the hit of the last runs.
    "0.3 rad",
    "0.6 N m for 50 ms at 12 s",
    "begins 7 s before the hit",
    // The experiments, and what they are on a bench of one's own.
    "`rotor_maximum = 0.5`",
    "ramps above go to 0.7",
    "`ramp --high 0.45`",
    "`prbs --around 0.4`",
    "about a hover of 0.46",
    "`--amplitude 0.03`",
    "`--amplitude 0.01`",
];

fn tutorial(page: &mut Page, folder: &Path) {
    let said = page.said;
    let it = Model::paper();
    page.holds(format!("The emulator has k_V = {} and p = {}.", it.actuator.voltage_gain, it.actuator.pole));
    let inertia = it.body.inertia;
    page.holds(format!("J is {inertia} in the emulator"));

    let runs: BTreeSet<String> =
        (0..2).map(|at| rounded(numbers(said, "body.csv, rotor", at)[1], 2)).collect();
    page.holds(format!("The free runs of the rotors leave {} rad/s", Vec::from_iter(runs).join(" to ")));
    let unbroken = words(said);
    let (_, errors) = unbroken.split_once("goes with the body's angle shows (").expect("the note");
    let (errors, _) = errors.split_once(" standard").expect("its number");
    page.holds(format!("*a torque that goes with the body's angle shows ({errors} standard errors)*"));

    let times = page.times_its_floor();
    page.holds(format!("The body's rate is wrong by {times} times its floor"));
    page.holds(format!("and their difference, which is {times} times the noise floor"));

    let refitted = numbers(said, "its own parameters refitted", 0)[1];
    let (extended, floor) = (numbers(said, "extended", 0)[1], numbers(said, "noise floor", 0)[0]);
    page.holds(format!(
        "leaves {} rad/s; with the pendulum {} is left, and the noise floor is {}. The best of the others leaves {} times that.",
        rounded(refitted, 3),
        rounded(extended, 2),
        rounded(floor, 2),
        word(numbers(said, "torque_bias", 0)[0] / extended),
    ));
    // However wide its names are: which candidates come last in it is a matter of the last digits.
    let is_header = |line: &&str| line.starts_with("effect ") && line.contains("alone [rad/s]");
    let tried = said.lines().skip_while(|line| !is_header(line)).skip(2);
    let p_values: Vec<f64> = tried.map_while(|line| line.split_whitespace().last()?.parse().ok()).collect();
    let least = p_values.iter().filter(|it| **it == p_values[0]).count();
    assert!(p_values[0] < 0.01, "of a hundred");
    page.holds(format!(
        "{} of the {} candidates that are shown have the same p-value",
        word(least as f64),
        word(p_values.len() as f64)
    ));
    page.holds("in less than one of a hundred tries".to_owned());

    let found = [numbers(said, "moment (m) =", 1)[0], numbers(said, "angle_offset (θ_0) =", 1)[0]];
    assert_eq!(format!("{:.3} {:.3}", found[0], found[1]), "0.400 0.100", "what was hidden");
    let (_, to) = said.rsplit_once("inertia (J): 0.030608 -> ").expect("extend's inertia");
    let to: f64 = to.split(' ').next().unwrap_or_default().parse().expect("a number");
    assert_eq!(rounded(to, 2), inertia.to_string());
    page.holds(format!("holds what the emulator has, 0.4 N m, 0.1 rad and {inertia} kg m²"));

    for begin in ["phase margin [°]", "further delay up to [ms]", "sensitivity peak"] {
        let [before, after] = [0, 1].map(|at| numbers(said, begin, at)[0]);
        assert!((after / before - 1.0).abs() < 0.1, "nearly the same: {begin} {before} {after}");
    }
    assert!(said.contains("advice: raise γ_0"), "`design` would let one of them grow");

    let [before, after] = [0, 1].map(|at| numbers(said, "angle error: rms", at)[0]);
    assert_eq!((10.0 * after / before).round(), 5.0, "halved: {before} {after}");
    page.holds("and run again with half the error".to_owned());
    page.holds("The angle's error over the run is halved".to_owned());
    let window = numbers(said, "Response to the impulse, judged for", 0)[0];
    let [hit, hit_after] = ["EMC (before.mcap)", "EMC (after.mcap)"].map(|run| numbers(said, run, 0));
    assert!(said.contains("not settled within the window"), "the first run");
    let (settled, overshoot) = (hit_after[2], [hit_after[3], hit[2]]);
    page.holds(format!("the body settles in {settled} s, where it did not within {window:.0} s"));
    page.holds(format!(
        "the overshoot, {:.0} % of the peak where it was {:.0} %",
        overshoot[0], overshoot[1]
    ));
    let share = hit_after.last().expect("columns") / hit.last().expect("columns");
    assert_eq!((3.0 * share).round(), 1.0, "a third");
    page.holds("The disturbance estimate is off by a third of what it was".to_owned());

    page.holds(format!("the PRBS to {:.2}", greatest(&folder.join("prbs.csv"))));
    let clipped = share_above(&folder.join("body.csv"), 0.5);
    assert!((0.4..0.5).contains(&clipped), "nearly half: {clipped}");
    page.holds("is clipped at 0.5 in nearly half of the rows".to_owned());

    nothing_else(page);
}

/// The commands of each row of a log of ours.
fn commands(log: &Path) -> Vec<f64> {
    let text = fs::read_to_string(log).expect("there");
    let mut rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = rows.next().expect("a header");
    let columns: Vec<usize> = (0..header.len()).filter(|at| header[*at].starts_with("command_")).collect();
    let greatest = |row: Vec<&str>| columns.iter().filter_map(|at| row[*at].parse().ok()).fold(0.0, f64::max);
    rows.map(greatest).collect()
}

fn greatest(log: &Path) -> f64 {
    commands(log).into_iter().fold(0.0, f64::max)
}

fn share_above(log: &Path, limit: f64) -> f64 {
    let commands = commands(log);
    commands.iter().filter(|it| **it > limit).count() as f64 / commands.len() as f64
}

/// Numbers that no phrase holds and no setting is.
fn nothing_else(page: &Page) {
    let mut rest = page.text.clone();
    for known in page.held.iter().map(String::as_str).chain(SETTINGS.map(|it| it)) {
        assert!(page.text.contains(known), "{}: it does not say: {known}", page.name);
        rest = rest.replace(known, "");
    }
    // Names: of a rotor, of symbols (θ_0), of a unit of time in the title.
    let is_number = |word: &&str| word.starts_with(|it: char| it.is_ascii_digit());
    let left: Vec<&str> = rest.split_whitespace().filter(is_number).collect();
    assert!(left.is_empty(), "{}: no command is held against these numbers: {left:?}\n{rest}", page.name);
}
