//! A column's name in words: the unit that it says, the number of its rotor, the part that it is.

use super::meanings::{MEANINGS, Meaning};
use crate::unit::UNITS;

/// Words that end a name and say its unit.
const ENDINGS: [(&[&str], &str); 19] = [
    (&["rad", "s"], "rad/s"),
    (&["deg", "s"], "deg/s"),
    (&["rpm"], "rpm"),
    (&["mv"], "mV"),
    (&["v"], "V"),
    (&["ma"], "mA"),
    (&["a"], "A"),
    (&["gf"], "gf"),
    (&["kg"], "kg"),
    (&["g"], "g"),
    (&["n"], "N"),
    (&["ms"], "ms"),
    (&["us"], "us"),
    (&["ns"], "ns"),
    (&["s"], "s"),
    (&["deg"], "deg"),
    (&["rad"], "rad"),
    (&["k"], "K"),
    (&["c"], "degC"),
];

/// Axes of a body: with a letter before it each of them is a voltage, a rate or a torque of that axis, whatever unit it has.
const AXES: [&str; 3] = ["pitch", "roll", "yaw"];

/// How revolutions a minute are written, too.
const PER_MINUTE: [&str; 5] = ["1/min", "u/min", "r/min", "rev/min", "min-1"];

/// How the two sides of a machine are called, the first rotor's first.
const SIDES: [[&str; 2]; 4] = [["left", "right"], ["links", "rechts"], ["izquierda", "derecha"], ["l", "r"]];

/// Gives names that say a side the number of its rotor, from `first` on, where the other side is there, too.
pub(super) fn number_sides(all: &mut [Words], first: usize) {
    let numbers: Vec<Option<usize>> = all.iter().map(|words| words.side_beside(all)).collect();
    for (words, side) in all.iter_mut().zip(numbers) {
        words.number = words.number.or(side.map(|side| first + side));
    }
}

/// A name in words, its unit, and its number.
pub(super) struct Words {
    pub words: Vec<String>,
    pub unit: Option<&'static str>,
    pub number: Option<usize>,
    /// Whether it names a part: `4N76`, a probe, is no number of a rotor.
    pub has_part_name: bool,
    /// Whether what stands in its brackets is a unit that nobody here knows: `steps/s`.
    pub is_of_unknown_unit: bool,
}

impl Words {
    pub fn of(name: &str) -> Self {
        let (bare, bracket) = parted(name);
        let mut unit = bracket.and_then(spelled);
        let (mut words, said) = words_and_number(bare);
        let mut number = bracket.and_then(|text| text.parse().ok()).or(said);
        if bracket.is_some_and(|text| text.eq_ignore_ascii_case("erpm")) {
            words.push("erpm".to_owned());
        }
        // Stands for two motors call them A and B: `ESC A (µs)`.
        let letter = words.last().filter(|_| bracket.is_some() && words.len() > 1);
        if let Some(of) = letter.and_then(|word| ["a", "b"].iter().position(|it| it == word)) {
            number = number.or(Some(of + 1));
            words.pop();
        }
        // A unit may end the name: `speed_rpm`, `body_rate_rad_s`.
        let ends = |end: &[&str]| words.len() > end.len() && words[words.len() - end.len()..] == *end;
        if let Some((end, spelling)) = ENDINGS.iter().find(|(end, _)| unit.is_none() && ends(end)) {
            unit = Some(spelling);
            words.truncate(words.len() - end.len().min(usize::from(*spelling != "rpm") * end.len()));
        }
        if unit.is_none() && words.iter().any(|word| word == "rpm") {
            unit = Some("rpm");
        }
        let is_of_unknown_unit = unit.is_none() && bracket.is_some_and(|text| text.contains('/'));
        Self { words, unit, number, has_part_name: has_part_name(bare), is_of_unknown_unit }
    }

    /// Its unit, for this meaning.
    pub fn unit_for(&self, meaning: &Meaning) -> Option<&'static str> {
        if meaning.si == "N" { self.unit.map(weight) } else { self.unit }
    }

    /// Whether it is a rate of the motor's field, in electrical revolutions.
    pub fn is_electrical(&self) -> bool {
        ["erpm", "e_rpm", "electrical_rpm"].iter().any(|word| self.has(word))
    }

    /// Whether it is what stands of RCbenchmark call the electrical speed: turns of the field, which their software has divided by
    /// the pole pairs that its user gave it (`setMotorPoles` of its scripts).
    pub fn is_by_poles(&self) -> bool {
        self.has("electrical_speed") && !self.is_electrical()
    }

    /// Whether it is a letter of a formula before the words of another column: `W_YAW` beside `YAW` is something else of it. An `eRPM`
    /// beside `RPM` is known, `m1_throttle` beside `throttle` is a rotor's, and of `V_battery [V]` the unit says what it is.
    pub fn is_letter_and(&self, other: &Self) -> bool {
        let is_letter = |word: &String| word.chars().count() == 1;
        let is_said = self.unit.is_some() && !AXES.iter().any(|axis| self.has(axis));
        let begins = |(first, rest): (&String, &[String])| is_letter(first) && rest == other.words;
        !(other.words.is_empty() || is_said || self.is_electrical() || self.number != other.number)
            && self.words.split_first().is_some_and(begins)
    }

    /// Whether this word says that, and nothing more.
    pub fn is_electrical_by(&self, word: &str) -> bool {
        word == "electrical" && (self.is_electrical() || self.is_by_poles())
    }

    /// Which side of a machine it is of, 0 or 1, where one of `all` is the same of the other side.
    fn side_beside(&self, all: &[Self]) -> Option<usize> {
        let (sides, side) = SIDES.iter().find_map(|sides| {
            let side = sides.iter().position(|side| self.words.iter().any(|word| word == side))?;
            Some((sides, side))
        })?;
        let other: Vec<&str> = self
            .words
            .iter()
            .map(|word| if word == sides[side] { sides[1 - side] } else { word.as_str() })
            .collect();
        all.iter().any(|it| it.words == other && it.unit == self.unit).then_some(side)
    }

    /// Whether it is the same of another rotor, or of this one.
    pub fn is_like(&self, other: &Self) -> bool {
        let is_side = |word: &&String| SIDES.iter().flatten().any(|side| word == side);
        let bare = |of: &Self| of.words.iter().filter(|word| !is_side(word)).cloned().collect::<Vec<_>>();
        // The number of `motor[1]` is spelled as a unit, too.
        let unit = |of: &Self| of.unit.filter(|unit| *unit != "1");
        unit(self) == unit(other) && bare(self) == bare(other)
    }

    pub fn has(&self, wanted: &str) -> bool {
        let parts: Vec<&str> = wanted.split('_').collect();
        self.words.windows(parts.len()).any(|words| words == parts)
    }
}

/// The words of a name in small letters, and the first number among them.
fn words_and_number(bare: &str) -> (Vec<String>, Option<usize>) {
    let (mut words, mut number, mut word) = (Vec::new(), None, String::new());
    let mut before = ' ';
    let mut letters = bare.chars().chain([' ']).peekable();
    while let Some(letter) = letters.next() {
        // `mV`, `cA`: the letters of one unit, not the beginning of a word.
        let ends = letters.peek().is_none_or(|next| !next.is_alphanumeric());
        let is_electric = ends && matches!(letter, 'V' | 'A');
        if let Some(quantity) = word.strip_suffix('m').filter(|word| is_electric && is_quantity(word)) {
            // `currentmA`: no `currentm` in A.
            words.push(quantity.to_owned());
            word = "m".to_owned();
        }
        let is_unit = is_electric && word.chars().count() == 1;
        let begins = letter.is_uppercase() && before.is_lowercase() && !is_unit;
        let turns = letter.is_ascii_digit() != before.is_ascii_digit() && !word.is_empty();
        if !letter.is_alphanumeric() || begins || turns {
            if let Ok(digits) = word.parse::<usize>() {
                number = number.or(Some(digits));
            } else if !word.is_empty() {
                words.push(std::mem::take(&mut word));
            }
            word.clear();
        }
        if letter.is_alphanumeric() {
            word.extend(letter.to_lowercase());
        }
        before = letter;
    }
    (words, number)
}

/// Whether a word means a voltage or a current.
fn is_quantity(word: &str) -> bool {
    MEANINGS.iter().any(|meaning| matches!(meaning.si, "V" | "A") && meaning.words.contains(&word))
}

/// Whether a word of a name begins with a digit, and letters and digits follow: the name of a part.
fn has_part_name(bare: &str) -> bool {
    let mut words = bare.split(|letter: char| !letter.is_alphanumeric());
    words.any(|word| {
        let rest = word.trim_start_matches(|letter: char| letter.is_ascii_digit());
        rest.len() < word.len()
            && rest.starts_with(char::is_alphabetic)
            && rest.contains(|it: char| it.is_ascii_digit())
    })
}

/// A name without what stands in its last brackets, and that.
fn parted(name: &str) -> (&str, Option<&str>) {
    let name = name.trim();
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let (Some(from), true) = (name.rfind(open), name.ends_with(close)) {
            return (&name[..from], name.get(from + 1..name.len() - 1).map(str::trim));
        }
    }
    (name, None)
}

/// A unit however it is capitalized.
fn spelled(text: &str) -> Option<&'static str> {
    if PER_MINUTE.iter().any(|it| it.eq_ignore_ascii_case(text)) {
        return Some("rpm");
    }
    let exact = UNITS.iter().find(|unit| unit.name == text && !text.is_empty());
    let close = || UNITS.iter().find(|unit| unit.name.eq_ignore_ascii_case(text) && !text.is_empty());
    exact.or_else(close).map(|unit| unit.name)
}

/// What a unit measures.
pub(super) fn measures(unit: &str, si: &str) -> bool {
    UNITS.iter().any(|known| known.name == unit && known.si == si)
}

/// The force that a unit of mass means where a force is read: load cells are labelled in grams.
pub(super) fn weight(unit: &'static str) -> &'static str {
    match unit {
        "g" => "gf",
        "kg" => "kgf",
        _ => unit,
    }
}
