//! Unit names and conversions to SI, used at the edges only.

use std::f64::consts::TAU;

/// Standard gravity, for thrust in gram-force. [m/s²]
pub const STANDARD_GRAVITY: f64 = 9.806_65;

/// A unit somebody wrote does not exist here, or does not measure what the signal needs.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnitError {
    /// No unit has this spelling.
    #[error("unknown unit `{unit}`; for what is measured in {needed}: {known}")]
    Unknown {
        /// Spelling found.
        unit: String,
        /// SI unit of what is needed.
        needed: &'static str,
        /// The spellings that there are for it.
        known: String,
    },
    /// The unit exists and measures something else.
    #[error("unit `{unit}` measures {measures}, but {needed} is needed: {known}")]
    Mismatch {
        /// Spelling found.
        unit: String,
        /// SI unit of what it measures.
        measures: &'static str,
        /// SI unit of what is needed.
        needed: &'static str,
        /// The spellings that there are for it.
        known: String,
    },
}

/// A named unit: `si = value * scale + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Spelling in files.
    pub name: &'static str,
    /// What it measures, by the SI unit's name: `rad/s`, `V`, ...
    pub si: &'static str,
    /// Factor to SI.
    pub scale: f64,
    /// Offset in SI after scaling.
    pub offset: f64,
}

const fn unit(name: &'static str, si: &'static str, scale: f64) -> Unit {
    Unit { name, si, scale, offset: 0.0 }
}

/// Every unit the house knows. Spellings are those of DBC files, data sheets and vendors' logs.
#[rustfmt::skip]
pub const UNITS: &[Unit] = &[
    unit("", "-", 1.0), unit("-", "-", 1.0), unit("1", "-", 1.0), unit("%", "-", 0.01),
    unit("s", "s", 1.0), unit("ms", "s", 1e-3), unit("us", "s", 1e-6), unit("µs", "s", 1e-6), unit("ns", "s", 1e-9),
    unit("rad", "rad", 1.0), unit("deg", "rad", TAU / 360.0), unit("°", "rad", TAU / 360.0), unit("rev", "rad", TAU),
    unit("rad/s", "rad/s", 1.0), unit("deg/s", "rad/s", TAU / 360.0), unit("°/s", "rad/s", TAU / 360.0),
    unit("dps", "rad/s", TAU / 360.0), unit("rpm", "rad/s", TAU / 60.0), unit("RPM", "rad/s", TAU / 60.0),
    unit("Hz", "rad/s", TAU), unit("rev/s", "rad/s", TAU), unit("krpm", "rad/s", TAU * 1000.0 / 60.0),
    unit("m/s^2", "m/s^2", 1.0), unit("m/s²", "m/s^2", 1.0), unit("g", "m/s^2", STANDARD_GRAVITY),
    unit("m/s", "m/s", 1.0), unit("m", "m", 1.0), unit("mm", "m", 1e-3), unit("cm", "m", 1e-2),
    unit("N", "N", 1.0), unit("mN", "N", 1e-3), unit("gf", "N", STANDARD_GRAVITY * 1e-3), unit("kgf", "N", STANDARD_GRAVITY),
    unit("lbf", "N", 4.448_221_615_260_5), unit("ozf", "N", 0.278_013_850_953_781_2),
    unit("N m", "N m", 1.0), unit("Nm", "N m", 1.0), unit("N·m", "N m", 1.0), unit("mN m", "N m", 1e-3), unit("mNm", "N m", 1e-3),
    unit("V", "V", 1.0), unit("mV", "V", 1e-3), unit("A", "A", 1.0), unit("mA", "A", 1e-3),
    unit("kg m^2", "kg m^2", 1.0), unit("g", "kg", 1e-3), unit("kg", "kg", 1.0),
    unit("K", "K", 1.0), Unit { name: "degC", si: "K", scale: 1.0, offset: 273.15 }, Unit { name: "°C", si: "K", scale: 1.0, offset: 273.15 },
];

/// Every spelling of a unit that measures the same as the SI unit `si`.
fn spellings(si: &str) -> String {
    let named = UNITS.iter().filter(|unit| unit.si == si && !unit.name.is_empty());
    named.map(|unit| format!("`{}`", unit.name)).collect::<Vec<_>>().join(", ")
}

impl Unit {
    /// The unit spelled `name` that measures the same as the SI unit `si`.
    ///
    /// # Errors
    /// [`UnitError`] when no unit has that spelling, or the ones that have measure something else.
    pub fn parse(name: &str, si: &'static str) -> Result<Self, UnitError> {
        let name = name.trim();
        let mut other = None;
        for candidate in UNITS.iter().filter(|unit| unit.name == name) {
            if candidate.si == si {
                return Ok(*candidate);
            }
            other = Some(candidate.si);
        }
        Err(match other {
            Some(measures) => {
                UnitError::Mismatch { unit: name.to_owned(), measures, needed: si, known: spellings(si) }
            }
            None => UnitError::Unknown { unit: name.to_owned(), needed: si, known: spellings(si) },
        })
    }

    /// A value of this unit, in SI.
    #[must_use]
    pub fn to_si(&self, value: f64) -> f64 {
        value.mul_add(self.scale, self.offset)
    }
}

/// `value` for a message: six digits, and an exponent where it would be longer than anybody reads.
#[must_use]
pub fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if rounded == 0.0 || !rounded.is_finite() || (1e-6..1e9).contains(&rounded.abs()) {
        return rounded.to_string();
    }
    format!("{rounded:e}")
}

/// `value ± error`, both to the error's second digit: an error that is there never shows as zero.
#[must_use]
pub fn with_error(value: f64, error: f64) -> String {
    /// More show the rounding of the value.
    const MOST_DECIMALS: usize = 9;
    // The formatter says which power of ten the error is rounded to: 0.0996 is 0.10.
    let rounded = format!("{error:.1e}");
    let exponent: Option<i32> = rounded.rsplit('e').next().and_then(|text| text.parse().ok());
    let decimals = exponent.filter(|_| error > 0.0).map(|it| usize::try_from(1 - it).unwrap_or(0));
    match decimals {
        Some(decimals) if decimals <= MOST_DECIMALS => format!("{value:.decimals$} ± {error:.decimals$}"),
        _ => format!("{} ± {}", short(value), short(error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_messages_are_short() {
        for (value, text) in [
            (0.02, "0.02"),
            (-5.0, "-5"),
            (86_400.0, "86400"),
            (5.624_999_999_999_999, "5.625"),
            (1e300, "1e300"),
            (-1e-12, "-1e-12"),
            (0.0, "0"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn an_error_that_is_there_shows() {
        for (value, error, text) in [
            (20.000_12, 0.001_23, "20.0001 ± 0.0012"),
            (2.3421, 0.0996, "2.34 ± 0.10"),
            (20.0, 1.5, "20.0 ± 1.5"),
            (1234.5, 123.4, "1234 ± 123"),
            (20.0, 1e-12, "20 ± 1e-12"),
            (20.0, 0.0, "20 ± 0"),
            (20.0, f64::NAN, "20 ± NaN"),
            (20.0, f64::INFINITY, "20 ± inf"),
        ] {
            assert_eq!(with_error(value, error), text);
        }
    }

    #[test]
    fn names_the_unit_that_does_not_fit() {
        assert!((Unit::parse("rpm", "rad/s").expect("known").to_si(60.0) - TAU).abs() < 1e-12);
        assert_eq!(
            Unit::parse("g", "N").unwrap_err().to_string(),
            "unit `g` measures kg, but N is needed: `N`, `mN`, `gf`, `kgf`, `lbf`, `ozf`"
        );
        assert_eq!(
            Unit::parse("furlong", "m").unwrap_err().to_string(),
            "unknown unit `furlong`; for what is measured in m: `m`, `mm`, `cm`"
        );
        assert!((Unit::parse("g", "m/s^2").expect("known").to_si(1.0) - STANDARD_GRAVITY).abs() < 1e-12);
        assert!((Unit::parse("degC", "K").expect("known").to_si(20.0) - 293.15).abs() < 1e-12);
    }
}
