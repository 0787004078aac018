//! Numbers that decide something: each with its unit, why it is what it is, and what it was calibrated on.
//!
//! A room keeps them in one `thresholds.rs`, declared by [`thresholds!`](crate::thresholds) as a struct `Thresholds` with one
//! value, `THRESHOLDS`. The table behind it becomes `docs/thresholds.md`. Constants of physics and sizes of buffers are no
//! thresholds and stay where they are used.

use std::fmt::Write;

/// One threshold, as the documentation tells it.
#[derive(Debug, Clone, PartialEq)]
pub struct Threshold {
    /// Name of the field.
    pub name: &'static str,
    /// The value as it stands in the code.
    pub value: &'static str,
    /// Unit; `-` for a share or a ratio, `count` for a number of things, and what it is measured in by name (`standard errors`, `rows`).
    pub unit: &'static str,
    /// What it decides and why, in one line that stands without its neighbours and does not repeat the unit.
    pub decides: &'static str,
    /// What it was calibrated on: data, a distribution, a standard, or `judgement`.
    pub calibrated: &'static str,
}

/// Declares the thresholds of a room: the struct, its value and its table.
///
/// ```
/// rotorbench::thresholds! {
///     /// a gyro rate beyond this is an outlier; no bench here turns faster.
///     greatest_rate: f64 = 50.0, "rad/s", "judgement";
/// }
/// assert_eq!(THRESHOLDS.greatest_rate, 50.0);
/// assert_eq!(TABLE[0].unit, "rad/s");
/// ```
#[macro_export]
macro_rules! thresholds {
    ($( $(#[doc = $doc:expr])+ $name:ident: $kind:ty = $value:expr, $unit:literal, $calibrated:literal; )+) => {
        /// Numbers of this room that decide something.
        #[derive(Debug, Clone, Copy)]
        pub struct Thresholds {
            $( $(#[doc = $doc])+ pub $name: $kind, )+
        }

        /// The values in force.
        pub const THRESHOLDS: Thresholds = Thresholds { $( $name: $value, )+ };

        /// The same for the documentation.
        pub const TABLE: &[$crate::threshold::Threshold] = &[
            $( $crate::threshold::Threshold {
                name: stringify!($name),
                value: stringify!($value),
                unit: $unit,
                decides: concat!($($doc),+),
                calibrated: $calibrated,
            }, )+
        ];
    };
}

/// The page of all thresholds, room by room, in Markdown; `used_in` says where the threshold of a room is used.
#[must_use]
pub fn page(rooms: &[(&str, &[Threshold])], used_in: impl Fn(&str, &str) -> String) -> String {
    let mut page = String::from(
        "# Thresholds\n\nThe numbers of the rooms that decide something: its value, its unit, what it decides, what it was \
         calibrated on, and the file of its room (or, with its path, of another) that uses it. This page is generated from the code (`tests/architecture/` holds it current).\n",
    );
    for (room, table) in rooms {
        // Writing to a string cannot fail.
        let _ = write!(
            page,
            "\n## {room}\n\n| threshold | value | unit | what it decides | calibrated on | used in |\n|---|---|---|---|---|---|\n"
        );
        for it in *table {
            let decides = it.decides.trim().replace('|', "\\|");
            // A long value stands on several lines in the code.
            let value = it.value.split_whitespace().collect::<Vec<&str>>().join(" ");
            let _ = writeln!(
                page,
                "| `{}` | {} | {} | {} | {} | {} |",
                it.name,
                value,
                it.unit,
                decides,
                it.calibrated,
                used_in(room, it.name)
            );
        }
    }
    page
}
