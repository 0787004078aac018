//! How the values of a column become numbers.

use crate::log::number::half;

/// How a value is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Physical {
    Truth,
    I32,
    I64,
    /// Nanoseconds of a day and the day: a stamp of old writers.
    I96,
    F32,
    F64,
    /// Of any length: a text.
    Text,
    /// Of one length.
    Bytes,
}

impl Physical {
    pub(super) fn of(code: i64) -> Option<Self> {
        let kinds =
            [Self::Truth, Self::I32, Self::I64, Self::I96, Self::F32, Self::F64, Self::Text, Self::Bytes];
        kinds.get(usize::try_from(code).ok()?).copied()
    }
}

/// The day of 1970-01-01 as stamps of 96 bits count them.
const JULIAN_DAY_OF_1970: i64 = 2_440_588;

/// How the values of a column become numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NumberConversion {
    pub(super) physical: Physical,
    /// Bytes of a value of [`Physical::Bytes`].
    pub(super) length: usize,
    /// Digits behind the point of a decimal number.
    pub(super) scale: i32,
    /// [1/s] of a stamp or a time of day.
    pub(super) per_second: Option<i64>,
    pub(super) is_unsigned: bool,
    pub(super) is_half: bool,
}

impl NumberConversion {
    /// A float of 16 bits.
    pub(super) fn half() -> Self {
        Self {
            physical: Physical::Bytes,
            length: 2,
            scale: 0,
            per_second: None,
            is_unsigned: false,
            is_half: true,
        }
    }

    /// Bytes that a value takes; 0 for truth values, which take a bit.
    pub(super) fn size(&self) -> usize {
        match self.physical {
            Physical::Truth | Physical::Text => 0,
            Physical::I32 | Physical::F32 => 4,
            Physical::I64 | Physical::F64 => 8,
            Physical::I96 => 12,
            Physical::Bytes => self.length,
        }
    }

    /// Unit of the values, where the file says it.
    pub(super) fn unit(&self) -> Option<&'static str> {
        (self.per_second.is_some() || self.physical == Physical::I96).then_some("s")
    }

    /// The value in the bytes that it takes.
    pub(super) fn value(&self, bytes: &[u8]) -> f64 {
        fn of<const N: usize, T>(bytes: &[u8], from: fn([u8; N]) -> T) -> Option<T> {
            bytes.first_chunk().map(|bytes| from(*bytes))
        }
        let value = match self.physical {
            Physical::I32 => of(bytes, i32::from_le_bytes).map(|it| self.of_integer(i64::from(it))),
            Physical::I64 => of(bytes, i64::from_le_bytes).map(|it| self.of_integer(it)),
            Physical::F32 => of(bytes, f32::from_le_bytes).map(f64::from),
            Physical::F64 => of(bytes, f64::from_le_bytes),
            Physical::Bytes if self.is_half => of(bytes, u16::from_le_bytes).map(half),
            Physical::Bytes => Some(decimal(bytes, self.scale)),
            Physical::I96 => of(bytes, i64::from_le_bytes)
                .zip(bytes.get(8..).and_then(|it| of(it, u32::from_le_bytes)))
                .map(|(nanoseconds, day)| {
                    86_400.0 * (i64::from(day) - JULIAN_DAY_OF_1970) as f64 + nanoseconds as f64 / 1e9
                }),
            Physical::Truth | Physical::Text => None,
        };
        value.unwrap_or(f64::NAN)
    }

    /// The value of a stored integer.
    pub(super) fn of_integer(&self, stored: i64) -> f64 {
        if let Some(per_second) = self.per_second {
            // In two parts: nanoseconds since 1970 have more digits than a float.
            return (stored / per_second) as f64 + (stored % per_second) as f64 / per_second as f64;
        }
        let value = match (self.is_unsigned, self.physical) {
            (false, _) => stored as f64,
            (true, Physical::I32) => f64::from(stored as u32),
            (true, _) => stored as u64 as f64,
        };
        if self.scale == 0 { value } else { value / 10_f64.powi(self.scale) }
    }
}

/// A signed number of up to 16 bytes, the highest first, `scale` digits of it behind the point.
fn decimal(bytes: &[u8], scale: i32) -> f64 {
    let negative = bytes.first().is_some_and(|first| *first >= 0x80);
    let start = if negative { -1_i128 } else { 0 };
    let unscaled = bytes.iter().fold(start, |number, byte| number << 8 | i128::from(*byte));
    unscaled as f64 / 10_f64.powi(scale)
}
