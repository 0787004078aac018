//! The header of a flight: lines of text that name each field of each kind of frame, and how it is packed and predicted.

use super::bits::{BrokenOff, Cursor, sign};
use super::interval::Interval;

/// Begins the header of each flight.
pub(super) const MARKER: &[u8] = b"H Product:Blackbox";

/// Longer lines are no header: the longest there are name a hundred fields.
const LONGEST_LINE: usize = 16_384;
/// More fields have no frame: firmwares write up to 170.
const MOST_FIELDS: usize = 512;

/// What a field's number is added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Predictor {
    Zero,
    Previous,
    StraightLine,
    Average,
    /// A number of the header.
    Constant(i32),
    /// The field of the first motor, which is here.
    Motor0(usize),
    Increment,
    /// Which of the coordinates of home.
    Home(usize),
    LastTime,
}

/// How a field's number is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Signed,
    Unsigned,
    Negative14,
    Tag8_8,
    Tag2_3,
    Tag8_4,
    Tag8_4First,
    Nothing,
    Tag2_3Variable,
}

/// Fields that are packed together: `count` of them from `first`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FieldGroup {
    pub(super) encoding: Encoding,
    pub(super) first: usize,
    pub(super) count: usize,
}

/// One kind of frame.
#[derive(Debug, Clone, Default)]
pub(super) struct FrameFields {
    pub(super) names: Vec<String>,
    pub(super) predictors: Vec<Predictor>,
    pub(super) groups: Vec<FieldGroup>,
    /// Whether the number is below zero where its top bit is set.
    pub(super) signed: Vec<bool>,
    /// Fields whose predictor needs a number that the header does not give: what they hold is not known.
    pub(super) lost: Vec<bool>,
}

impl FrameFields {
    /// Where the field of that name is.
    pub(super) fn place(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|it| it == name)
    }
}

/// A header, read.
#[derive(Debug, Clone, Default)]
pub(super) struct FlightHeader {
    lines: Vec<(String, String)>,
    /// Frames by themselves, and those that are differences to the one before.
    pub(super) intra: FrameFields,
    pub(super) inter: Option<FrameFields>,
    pub(super) slow: Option<FrameFields>,
    pub(super) gps: Option<FrameFields>,
    pub(super) home: Option<FrameFields>,
    /// Where `time` is in the main frames, and the count of the loop.
    pub(super) time: usize,
    pub(super) iteration: Option<usize>,
    /// Bytes from the start of the flight to its first frame.
    pub(super) length: usize,
    /// Lines that are none, and where the first begins.
    pub(super) damaged_lines: Vec<usize>,
    interval: Interval,
}

impl FlightHeader {
    /// Reads the header at the start of a flight's bytes; the error says what is wrong with it.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, String> {
        let mut header = Self::default();
        header.read_lines(bytes);
        header.interval = Interval::read(header.text("I interval"), header.text("P interval"));
        let fields = |header: &Self, kind: char| header.fields(kind, None);
        header.intra = fields(&header, 'I')?.ok_or("the header names no fields (`Field I name`)")?;
        header.inter = header.fields('P', Some(&header.intra))?;
        header.slow = fields(&header, 'S')?;
        header.gps = fields(&header, 'G')?;
        header.home = fields(&header, 'H')?;
        header.time = header.intra.place("time").ok_or("its frames have no field `time`")?;
        header.iteration = header.intra.place("loopIteration");
        Ok(header)
    }

    /// How many turns of the loop after `iteration` are left out on purpose.
    pub(super) fn left_out_after(&self, iteration: u32) -> u32 {
        self.interval.left_out_after(iteration)
    }

    /// The text behind a key.
    pub(super) fn text(&self, key: &str) -> Option<&str> {
        self.lines.iter().find(|(name, _)| name == key).map(|(_, text)| text.as_str())
    }

    /// The number behind a key, or the one at `place` where several are separated by commas.
    pub(super) fn number(&self, key: &str, place: usize) -> Option<f64> {
        self.text(key)?.split(',').nth(place)?.trim().parse().ok().filter(|it: &f64| it.is_finite())
    }

    fn integer(&self, key: &str, place: usize) -> Option<i32> {
        self.text(key)?.split(',').nth(place)?.trim().parse().ok()
    }

    /// The number whose bits are written in hexadecimal. Keys with a point have got an underscore since.
    pub(super) fn bits(&self, key: &str) -> Option<f64> {
        let found = self.lines.iter().find(|(name, _)| name.replace('_', ".") == key);
        let text = found?.1.trim();
        let bits = u32::from_str_radix(text.strip_prefix("0x").unwrap_or(text), 16).ok()?;
        Some(f64::from(f32::from_bits(bits))).filter(|it| it.is_finite())
    }

    /// Takes lines `H key:value` until the first frame. A damaged line among them is passed over.
    fn read_lines(&mut self, bytes: &[u8]) {
        let mut at = 0;
        while let Some(rest) = bytes.get(at..).filter(|rest| !rest.is_empty()) {
            let window = rest.get(..LONGEST_LINE).unwrap_or(rest);
            let Some(length) = window.iter().position(|byte| *byte == b'\n') else { break };
            let line = window.get(..length).unwrap_or_default();
            let split = line.iter().position(|byte| *byte == b':');
            match (line.strip_prefix(b"H "), split) {
                (Some(_), Some(colon)) => {
                    let text = |part: Option<&[u8]>| {
                        String::from_utf8_lossy(part.unwrap_or_default()).trim().to_owned()
                    };
                    self.lines.push((text(line.get(2..colon)), text(line.get(colon + 1..))));
                }
                // Behind the header stand frames, which only by rare chance are a line of text before another header line.
                _ if line.iter().all(|byte| (0x20..0x7f).contains(byte))
                    && rest[length..].starts_with(b"\nH ") =>
                {
                    self.damaged_lines.push(at);
                }
                _ => break,
            }
            at += length + 1;
        }
        self.length = at;
    }

    /// The fields of one kind of frame, where the header has it. Frames of differences have the names of `base`.
    fn fields(&self, kind: char, base: Option<&FrameFields>) -> Result<Option<FrameFields>, String> {
        let line = |what: &str| self.text(&format!("Field {kind} {what}"));
        let (Some(encodings), Some(predictors)) = (line("encoding"), line("predictor")) else {
            return Ok(None);
        };
        let names: Vec<String> = match base {
            Some(base) => base.names.clone(),
            None => match line("name") {
                Some(names) => names.split(',').map(|name| one_name(name.trim())).collect(),
                None => return Ok(None),
            },
        };
        let (encodings, predictors) = (codes(encodings), codes(predictors));
        let count = names.len();
        if count > MOST_FIELDS || encodings.len() != count || predictors.len() != count {
            return Err(format!(
                "`Field {kind}` has {count} names, {} encodings and {} predictors ({MOST_FIELDS} at most, as many of each)",
                encodings.len(),
                predictors.len()
            ));
        }
        let mut fields = FrameFields { names, ..FrameFields::default() };
        self.predictors(kind, &predictors, &mut fields)?;
        fields.groups = self.groups(kind, &encodings, &fields)?;
        fields.signed = match base {
            Some(base) => base.signed.clone(),
            None => {
                let signs = line("signed").map(codes).unwrap_or_default();
                // Fields that are predicted from something can come out below zero for a moment, whatever their sign says.
                let unsigned = |place: usize, predictor| {
                    signs.get(place) == Some(&Some(0)) && predictor == Predictor::Zero
                };
                fields.predictors.iter().enumerate().map(|(place, it)| !unsigned(place, *it)).collect()
            }
        };
        Ok(Some(fields))
    }

    fn predictors(&self, kind: char, codes: &[Option<u8>], fields: &mut FrameFields) -> Result<(), String> {
        let motor = fields.place("motor[0]");
        let mut coordinate = 0;
        for (place, code) in codes.iter().enumerate() {
            let mut lost = false;
            let mut constant = |key: &str, other: &str| {
                let number = self.integer(key, 0).or_else(|| self.integer(other, 0));
                lost = number.is_none();
                Predictor::Constant(number.unwrap_or(0))
            };
            let predictor = match code {
                Some(0) => Predictor::Zero,
                Some(1) => Predictor::Previous,
                Some(2) => Predictor::StraightLine,
                Some(3) => Predictor::Average,
                Some(4) => constant("minthrottle", "minthrottle"),
                Some(5) if motor.is_some_and(|motor| motor < place) => Predictor::Motor0(motor.unwrap_or(0)),
                Some(6) => Predictor::Increment,
                Some(7) => {
                    coordinate += 1;
                    Predictor::Home(coordinate - 1)
                }
                Some(8) => Predictor::Constant(1_500),
                Some(9) => constant("vbatref", "vbatref"),
                Some(10) => Predictor::LastTime,
                Some(11) => constant("motorOutput", "minthrottle"),
                _ => {
                    let name = fields.names.get(place).map_or("", String::as_str);
                    return Err(format!(
                        "no reader knows the predictor of `{name}` (`Field {kind} predictor`)"
                    ));
                }
            };
            if let Predictor::Motor0(motor) = predictor {
                lost = fields.lost.get(motor).copied().unwrap_or(false);
            }
            fields.predictors.push(predictor);
            fields.lost.push(lost);
        }
        Ok(())
    }

    fn groups(
        &self,
        kind: char,
        codes: &[Option<u8>],
        fields: &FrameFields,
    ) -> Result<Vec<FieldGroup>, String> {
        let first_version = self.number("Data version", 0).is_some_and(|version| version < 2.0);
        let mut groups = Vec::new();
        let mut first = 0;
        while let Some(code) = codes.get(first) {
            let name = fields.names.get(first).map_or("", String::as_str);
            let (encoding, count) = match code {
                // Nothing is written of a count.
                _ if fields.predictors.get(first) == Some(&Predictor::Increment) => (Encoding::Nothing, 1),
                Some(0) => (Encoding::Signed, 1),
                Some(1) => (Encoding::Unsigned, 1),
                Some(3) => (Encoding::Negative14, 1),
                Some(6) => {
                    let count = codes.iter().skip(first).take(8).take_while(|other| *other == code).count();
                    (Encoding::Tag8_8, count)
                }
                Some(7) => (Encoding::Tag2_3, 3),
                Some(8) if first_version => (Encoding::Tag8_4First, 4),
                Some(8) => (Encoding::Tag8_4, 4),
                Some(9) => (Encoding::Nothing, 1),
                Some(10) => (Encoding::Tag2_3Variable, 3),
                _ => {
                    return Err(format!(
                        "no reader knows the encoding of `{name}` (`Field {kind} encoding`)"
                    ));
                }
            };
            if first + count > codes.len() {
                return Err(format!(
                    "the encoding of `{name}` packs {count} fields (`Field {kind} encoding`)"
                ));
            }
            groups.push(FieldGroup { encoding, first, count });
            first += count;
        }
        Ok(groups)
    }
}

/// The name of a field with Betaflight, whatever the oldest logs and INAV call it.
fn one_name(name: &str) -> String {
    match name {
        "vbat" => "vbatLatest".to_owned(),
        "amperage" => "amperageLatest".to_owned(),
        _ => name.replace("gyroData[", "gyroADC["),
    }
}

/// Small numbers separated by commas.
fn codes(text: &str) -> Vec<Option<u8>> {
    text.split(',').map(|code| code.trim().parse().ok()).collect()
}

/// Reads one group of fields.
pub(super) fn read_group(
    group: &FieldGroup,
    cursor: &mut Cursor,
    values: &mut [i32; 8],
) -> Result<(), BrokenOff> {
    match group.encoding {
        Encoding::Signed => values[0] = cursor.signed()?,
        Encoding::Unsigned => values[0] = cursor.unsigned()?.cast_signed(),
        Encoding::Negative14 => values[0] = -sign(cursor.unsigned()?, 14),
        Encoding::Tag8_8 => cursor.tag8_8svb(group.count, values)?,
        Encoding::Tag2_3 => cursor.tag2_3s32(values)?,
        Encoding::Tag2_3Variable => cursor.tag2_3svariable(values)?,
        Encoding::Tag8_4 => cursor.tag8_4s16(values)?,
        Encoding::Tag8_4First => cursor.tag8_4s16_first(values)?,
        Encoding::Nothing => values[0] = 0,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_says_what_is_wrong_with_it() {
        let error = |text: &str| FlightHeader::parse(text.as_bytes()).expect_err("a bad header");
        assert_eq!(error("H Product:Blackbox\nI"), "the header names no fields (`Field I name`)");
        let fields = |name: &str, predictor: &str, encoding: &str| {
            format!("H Field I name:{name}\nH Field I predictor:{predictor}\nH Field I encoding:{encoding}\n")
        };
        assert_eq!(error(&fields("a", "0", "0")), "its frames have no field `time`");
        assert_eq!(
            error(&fields("time", "12", "0")),
            "no reader knows the predictor of `time` (`Field I predictor`)"
        );
        assert_eq!(
            error(&fields("time", "0", "2")),
            "no reader knows the encoding of `time` (`Field I encoding`)"
        );
        assert_eq!(
            error(&fields("time,a", "0,0", "0,7")),
            "the encoding of `a` packs 3 fields (`Field I encoding`)"
        );
        assert_eq!(
            error(&fields("time,a", "0", "0,0")),
            "`Field I` has 2 names, 2 encodings and 1 predictors (512 at most, as many of each)"
        );
    }

    #[test]
    fn a_damaged_line_of_the_header_is_passed_over() {
        let text = "H Product:Blackbox\nX looptime:500\nH Field I name:time\nH Field I predictor:0\nH Field I encoding:1\nI\x05";
        let header = FlightHeader::parse(text.as_bytes()).expect("good enough");
        assert_eq!(header.damaged_lines, [19]);
        assert_eq!(header.length, text.len() - 2);
    }
}
