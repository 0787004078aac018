//! A number of a message compiled once: where its bits lie in the payload and how they are read.

use super::bits;
use super::dsdl::{NumberKind, Structure, Type};
use super::value::{Value, number_of, raw_of};

/// Where a number lies in the payload of its message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitPlace {
    /// [bit] from the beginning of the payload.
    pub at: usize,
    /// Its type.
    pub primitive: super::dsdl::Primitive,
}

impl BitPlace {
    /// The number at `path` in a message, such as `rpm`, `timestamp.usec` or `rate_gyro_latest[2]`.
    ///
    /// # Errors
    /// Why there is none: no such field, no number, or its place depends on what stands before it.
    pub fn find(message: &Structure, path: &str) -> Result<Self, String> {
        let mut words = path.split('.').peekable();
        let (mut within, mut at) = (message, 0);
        loop {
            let word = words.next().unwrap_or("");
            let is_deeper = words.peek().is_some();
            let (name, index) = split_index(word)?;
            let (before, of) = field(within, name)?;
            at += before;
            let is_last =
                std::ptr::eq(within, message) && message.fields.last().is_some_and(|last| last.name == name);
            let of = match (of, index) {
                (Type::Array(array), Some(index)) => {
                    if index >= array.most {
                        return Err(format!("`{name}` has {} items, counted from 0", array.most));
                    }
                    if array.is_dynamic && !(is_last && array.is_countless_at_end()) {
                        return Err(format!("the place of `{word}` depends on how many there are"));
                    }
                    let each = array.item.fixed_bits();
                    at += index * each.ok_or_else(|| format!("the items of `{name}` differ in length"))?;
                    &array.item
                }
                (Type::Array(_), None) => return Err(format!("`{name}` is an array: `{name}[0]`")),
                (_, Some(_)) => return Err(format!("`{name}` is no array")),
                (of, None) => of,
            };
            match (of, is_deeper) {
                (Type::Primitive(primitive), false) => return Ok(Self { at, primitive: *primitive }),
                (Type::Compound(compound), true) => {
                    within = compound.message().ok_or_else(|| format!("`{name}` is a service"))?;
                }
                (Type::Compound(_), false) => return Err(format!("`{name}` is no number")),
                _ => return Err(format!("`{name}` has no fields")),
            }
        }
    }

    /// The number in a payload; `None` when the payload ends before it.
    #[must_use]
    #[inline]
    pub fn read(&self, payload: &[u8]) -> Option<f64> {
        let raw = bits::read(payload, self.at, self.primitive.bits)?;
        Some(number_of(self.primitive.kind, self.primitive.bits, raw))
    }

    /// Writes the nearest number that the type has. What is not a number becomes 0 where the type has nothing for it.
    #[inline]
    pub fn write(&self, payload: &mut [u8], value: f64) {
        let value = match self.primitive.kind {
            NumberKind::Float => Value::Float(value),
            // A cast of a float saturates, and makes 0 of what is not a number.
            _ => Value::Integer(value.round_ties_even() as i128),
        };
        if let Some(raw) = raw_of(self.primitive, &value) {
            bits::write(payload, self.at, self.primitive.bits, raw);
        }
    }

    /// [bit] where it ends.
    #[must_use]
    pub fn end(&self) -> usize {
        self.at + self.primitive.bits as usize
    }

    /// Least and greatest number that it can be, infinities aside.
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        let greatest = bits::mask(self.primitive.bits);
        match (self.primitive.kind, self.primitive.bits) {
            (NumberKind::Float, 16) => (-bits::GREATEST_HALF, bits::GREATEST_HALF),
            (NumberKind::Float, 32) => (f64::from(f32::MIN), f64::from(f32::MAX)),
            (NumberKind::Float, _) => (f64::MIN, f64::MAX),
            (NumberKind::Signed, _) => (-((greatest >> 1) as f64) - 1.0, (greatest >> 1) as f64),
            (NumberKind::Boolean | NumberKind::Unsigned, _) => (0.0, greatest as f64),
        }
    }
}

/// `name[3]` as name and index.
fn split_index(word: &str) -> Result<(&str, Option<usize>), String> {
    let Some((name, rest)) = word.split_once('[') else { return Ok((word, None)) };
    let index = rest.strip_suffix(']').and_then(|digits| digits.parse().ok());
    Ok((name, Some(index.ok_or_else(|| format!("`{word}` is not of the form name[0]"))?)))
}

/// The field of this name, and the bits before it.
fn field<'a>(structure: &'a Structure, name: &str) -> Result<(usize, &'a Type), String> {
    let mut before = Some(0);
    for field in &structure.fields {
        if field.name == name && !name.is_empty() {
            return match before {
                Some(bits) if !structure.is_union => Ok((bits, &field.of)),
                _ => Err(format!("the place of `{name}` depends on what stands before it")),
            };
        }
        before = before.and_then(|bits: usize| Some(bits + field.of.fixed_bits()?));
    }
    let names = structure.fields.iter().map(|field| field.name.as_str()).filter(|name| !name.is_empty());
    let names = names.take(12).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    Err(format!("there is no field `{name}`; there are {names}"))
}

#[cfg(test)]
mod tests {
    use super::super::library::Library;
    use super::*;

    fn found(name: &str, path: &str) -> Result<(usize, u32), String> {
        let library = Library::build(&[]).expect("sound");
        let compound = library.get(name).expect("published");
        BitPlace::find(compound.message().expect("a message"), path).map(|it| (it.at, it.primitive.bits))
    }

    #[test]
    fn places_and_what_has_none() {
        let imu = "uavcan.equipment.ahrs.RawIMU";
        assert_eq!(found(imu, "timestamp.usec"), Ok((0, 56)));
        assert_eq!(found(imu, "rate_gyro_latest[2]"), Ok((56 + 32 + 32, 16)));
        assert_eq!(found("uavcan.equipment.esc.Status", "rpm"), Ok((80, 18)));
        assert_eq!(found("uavcan.equipment.esc.RawCommand", "cmd[3]"), Ok((42, 14)));
        for (name, path, words) in [
            (imu, "rate_gyro_latest", "is an array"),
            (imu, "rate_gyro_latest[3]", "has 3 items"),
            (imu, "rate_gyro_latest[x]", "not of the form"),
            (imu, "rate", "there is no field `rate`; there are `timestamp`"),
            (imu, "timestamp", "is no number"),
            (imu, "integration_interval.x", "has no fields"),
            (imu, "integration_interval[0]", "is no array"),
            ("uavcan.protocol.param.Value", "real_value", "depends on what stands before"),
            ("uavcan.protocol.HardwareVersion", "certificate_of_authenticity", "is an array"),
        ] {
            let said = found(name, path).expect_err(path);
            assert!(said.contains(words), "{path}: {said}");
        }
    }

    #[test]
    fn a_number_that_does_not_fit_saturates_and_none_is_zero() {
        let library = Library::build(&[]).expect("sound");
        let message = library.get("uavcan.equipment.esc.Status").and_then(|it| it.message()).expect("there");
        let place = |path| BitPlace::find(message, path).expect("there");
        let mut payload = [0xFF; 14];
        for (path, value, read) in [
            ("rpm", 200_000.0, 131_071.0),
            ("rpm", -200_000.0, -131_072.0),
            ("rpm", f64::NAN, 0.0),
            ("rpm", 2.5, 2.0),
            ("power_rating_pct", -3.0, 0.0),
            ("power_rating_pct", f64::INFINITY, 127.0),
            ("voltage", 1e9, 65_504.0),
            ("voltage", 12.5, 12.5),
        ] {
            place(path).write(&mut payload, value);
            assert_eq!(place(path).read(&payload), Some(read), "{path} = {value}");
        }
        place("current").write(&mut payload, f64::NAN);
        assert!(place("current").read(&payload).is_some_and(f64::is_nan));
        assert_eq!(place("rpm").read(&payload[..12]), None);
        assert_eq!((place("rpm").span(), place("esc_index").span()), ((-131_072.0, 131_071.0), (0.0, 31.0)));
    }
}
