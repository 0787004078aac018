//! A number as a binary log holds it, the low byte first.

/// How a number is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberStyle {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
}

impl NumberStyle {
    /// Bytes it takes.
    pub(super) fn length(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Its value at the start of `bytes`; `None` where they end before it.
    pub(super) fn value(self, bytes: &[u8]) -> Option<f64> {
        macro_rules! read {
            ($kind:ty) => {
                bytes.first_chunk().map(|it| <$kind>::from_le_bytes(*it) as f64)
            };
        }
        match self {
            Self::I8 => read!(i8),
            Self::U8 => read!(u8),
            Self::I16 => read!(i16),
            Self::U16 => read!(u16),
            Self::I32 => read!(i32),
            Self::U32 => read!(u32),
            Self::I64 => read!(i64),
            Self::U64 => read!(u64),
            Self::F16 => bytes.first_chunk().map(|it| half(u16::from_le_bytes(*it))),
            Self::F32 => read!(f32),
            Self::F64 => read!(f64),
        }
    }
}

/// A number of 16 bits with a point that floats.
pub(super) fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1_023));
    let size = match exponent {
        0 => fraction * 2_f64.powi(-24),
        31 if fraction > 0.0 => f64::NAN,
        31 => f64::INFINITY,
        _ => (1_024.0 + fraction) * 2_f64.powi(exponent - 25),
    };
    if bits >> 15 == 1 { -size } else { size }
}
