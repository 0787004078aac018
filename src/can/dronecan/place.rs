//! A number of a message compiled once: where its bits lie in the payload and how they are read.

use super::bits;
use super::dsdl::{NumberKind, Structure, Type};
use super::transfer::Framing;
use super::value::{Value, number_of, raw_of};

/// Where a number lies in the payload of its message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitPlace {
    /// [bit] from the beginning of the payload of classical frames; in FD frames it may be further behind.
    pub at: usize,
    /// Its type.
    pub primitive: super::dsdl::Primitive,
    /// Of an item of the array that ends the message.
    item: Option<Item>,
}

/// An item of an array whose count stands before it in FD frames, and nowhere in classical ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Item {
    index: usize,
    /// [bit] where the array begins, and of its count.
    begin: usize,
    count_bits: u32,
}

impl BitPlace {
    /// The number at `path` in a message, such as `rpm`, `timestamp.usec` or `rate_gyro_latest[2]`.
    ///
    /// # Errors
    /// Why there is none: no such field, no number, or its place depends on what stands before it.
    pub fn find(message: &Structure, path: &str) -> Result<Self, String> {
        let mut words = path.split('.').peekable();
        let (mut within, mut at, mut item) = (message, 0, None);
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
                    item =
                        array.is_dynamic.then(|| Item { index, begin: at, count_bits: array.count_bits() });
                    let each = array.item.fixed_bits();
                    at += index * each.ok_or_else(|| format!("the items of `{name}` differ in length"))?;
                    &array.item
                }
                (Type::Array(_), None) => return Err(format!("`{name}` is an array: `{name}[0]`")),
                (_, Some(_)) => return Err(format!("`{name}` is no array")),
                (of, None) => of,
            };
            match (of, is_deeper) {
                (Type::Primitive(primitive), false) => return Ok(Self { at, primitive: *primitive, item }),
                (Type::Compound(compound), true) => {
                    within = compound.message().ok_or_else(|| format!("`{name}` is a service"))?;
                }
                (Type::Compound(_), false) => return Err(format!("`{name}` is no number")),
                _ => return Err(format!("`{name}` has no fields")),
            }
        }
    }

    /// The number in a payload of such frames; `None` when the payload ends before it, or the array that it is an item of.
    #[must_use]
    #[inline]
    pub fn read(&self, payload: &[u8], framing: Framing) -> Option<f64> {
        let at = match (framing, self.item) {
            (Framing::Fd, Some(item)) => {
                let count = bits::read(payload, item.begin, item.count_bits)?;
                if item.index as u64 >= count {
                    return None;
                }
                self.at + item.count_bits as usize
            }
            _ => self.at,
        };
        let raw = bits::read(payload, at, self.primitive.bits)?;
        Some(number_of(self.primitive.kind, self.primitive.bits, raw))
    }

    /// Writes the nearest number that the type has, into a payload for such frames. What is not a number becomes 0 where the type
    /// has nothing for it. An array gets as long as its item needs.
    #[inline]
    pub fn write(&self, payload: &mut [u8], framing: Framing, value: f64) {
        let value = match self.primitive.kind {
            NumberKind::Float => Value::Float(value),
            // A cast of a float saturates, and makes 0 of what is not a number.
            _ => Value::Integer(value.round_ties_even() as i128),
        };
        let Some(raw) = raw_of(self.primitive, &value) else { return };
        bits::write(payload, self.end(framing) - self.primitive.bits as usize, self.primitive.bits, raw);
        if let (Framing::Fd, Some(Item { index, begin, count_bits })) = (framing, self.item)
            && bits::read(payload, begin, count_bits).is_some_and(|count| count <= index as u64)
        {
            bits::write(payload, begin, count_bits, index as u64 + 1);
        }
    }

    /// How many items the array has that this is an item of; `None`: of none.
    #[must_use]
    pub(super) fn items(&self, payload: &[u8], framing: Framing) -> Option<usize> {
        let Item { begin, count_bits, .. } = self.item?;
        match framing {
            Framing::Classic => Some((8 * payload.len()).checked_sub(begin)? / self.primitive.bits as usize),
            Framing::Fd => bits::read(payload, begin, count_bits).map(|count| count as usize),
        }
    }

    /// [bit] where it ends in a payload of such frames.
    #[must_use]
    pub fn end(&self, framing: Framing) -> usize {
        let before = match (framing, self.item) {
            (Framing::Fd, Some(item)) => item.count_bits as usize,
            _ => 0,
        };
        self.at + before + self.primitive.bits as usize
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
            place(path).write(&mut payload, Framing::Classic, value);
            assert_eq!(place(path).read(&payload, Framing::Classic), Some(read), "{path} = {value}");
            assert_eq!(place(path).read(&payload, Framing::Fd), Some(read), "no array: the same in either");
        }
        place("current").write(&mut payload, Framing::Classic, f64::NAN);
        assert!(place("current").read(&payload, Framing::Classic).is_some_and(f64::is_nan));
        assert_eq!(place("rpm").read(&payload[..12], Framing::Classic), None);
        assert_eq!((place("rpm").span(), place("esc_index").span()), ((-131_072.0, 131_071.0), (0.0, 31.0)));
    }

    /// An item that the count does not reach is none, whatever fills the frame behind the array.
    #[test]
    fn in_fd_frames_an_item_is_there_as_the_count_says() {
        let library = Library::build(&[]).expect("sound");
        let message =
            library.get("uavcan.equipment.esc.RawCommand").and_then(|it| it.message()).expect("there");
        let places: Vec<BitPlace> =
            (0..20).map(|index| BitPlace::find(message, &format!("cmd[{index}]")).expect("there")).collect();
        let mut payload = [0; 47];
        let read =
            |payload: &[u8]| places.iter().map_while(|it| it.read(payload, Framing::Fd)).collect::<Vec<_>>();
        assert_eq!(read(&payload), [0.0; 0]);
        places[1].write(&mut payload, Framing::Fd, 700.0);
        assert_eq!(read(&payload), [0.0, 700.0]);
        places[0].write(&mut payload, Framing::Fd, -8192.0);
        assert_eq!(read(&payload), [-8192.0, 700.0], "the count stays");
        places[19].write(&mut payload, Framing::Fd, 1.0);
        assert_eq!(read(&payload).len(), 20);
        let whole = crate::can::dronecan::decode(message, &payload[..36], Framing::Fd);
        let Ok(Value::List(fields)) = whole else { panic!("{whole:?}") };
        let Value::List(items) = &fields[0] else { panic!("an array") };
        assert_eq!((items.len(), &items[1]), (20, &Value::Integer(700)));
        assert_eq!((places[19].end(Framing::Classic), places[19].end(Framing::Fd)), (280, 285));
        assert_eq!(places[0].read(&[], Framing::Fd), None);
    }
}
