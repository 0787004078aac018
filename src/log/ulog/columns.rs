//! Tables of the rows of a log's topics.

use std::collections::BTreeSet;

use super::layout::{RowField, ValueKind};
use super::messages::LoggedTopic;
use crate::cancel;
use crate::log::number::NumberStyle;
use crate::log::tables::{Column, Table, Tables};

/// Whether a column is wanted, by the names of its table and its own.
type Wants<'a> = &'a dyn Fn(&str, &str) -> bool;

/// First of the numbers by which PX4 calls its motors (`actuator_function`), and how many there are.
const MOTOR_FUNCTIONS: std::ops::RangeInclusive<u32> = 101..=112;

/// Adds the tables of a topic: one of its own fields, and one for each nested message that has a stamp of its own.
pub(super) fn add(bytes: &[u8], topic: &LoggedTopic, wants: Wants, tables: &mut Tables) {
    cancel::check();
    let name = match topic.instance {
        0 => topic.name.clone(),
        instance => format!("{}[{instance}]", topic.name),
    };
    let Some(first) = topic.rows.first().copied() else { return };
    let rows = Rows { bytes, starts: topic.rows.clone() };
    let Some(clock) = topic.layout.fields.iter().find(|field| field.name == "timestamp") else {
        tables.skip("no_clock", &name, first as u64);
        return;
    };
    let time = rows.seconds(clock);
    let parts = parts(topic);
    let is_own = |field: &&RowField| !parts.iter().any(|part| part.field(field).is_some());
    let fields = topic.layout.fields.iter().filter(is_own).map(|field| (field.name.as_str(), field));
    let mut table = rows.table(&name, &time, fields, wants);
    if topic.name == "vehicle_attitude" {
        table.columns.extend(angles(&topic.layout.fields, &rows, |angle| wants(&name, angle)));
    }
    tables.tables.extend((!table.columns.is_empty()).then_some(table));
    let stamped: Vec<Rows> = parts.iter().map(|part| rows.stamped(part.clock)).collect();
    for ((part, own), motor) in parts.iter().zip(&stamped).zip(motors(topic, &parts, &rows)) {
        let of_a_kind = parts.iter().zip(&stamped).filter(|(other, _)| other.array() == part.array());
        let some_stamped = of_a_kind.map(|(_, rows)| rows).any(|rows| !rows.starts.is_empty());
        let fields = topic.layout.fields.iter().filter_map(|field| Some((part.field(field)?, field)));
        let subject = format!("{name}.{}", motor.unwrap_or_else(|| part.name.to_owned()));
        if !own.starts.is_empty() {
            let table = own.table(&subject, &own.seconds(part.clock), fields, wants);
            tables.tables.extend((!table.columns.is_empty()).then_some(table));
        } else if some_stamped || rows.are_zero(fields.clone()) {
            tables.skip("never_updated", &subject, first as u64);
        } else {
            let table = rows.table(&subject, &time, fields, wants);
            tables.tables.extend((!table.columns.is_empty()).then_some(table));
        }
    }
}

/// A nested message with a stamp of its own, as `esc[0]` of `esc_status`.
struct Part<'a> {
    name: &'a str,
    clock: &'a RowField,
}

impl Part<'_> {
    /// The name of a field in here.
    fn field<'b>(&self, field: &'b RowField) -> Option<&'b str> {
        field.name.strip_prefix(self.name)?.strip_prefix('.')
    }

    /// What it is one of.
    fn array(&self) -> &str {
        self.name.rsplit_once('[').map_or(self.name, |(array, _)| array)
    }
}

fn parts(topic: &LoggedTopic) -> Vec<Part<'_>> {
    let clocks = topic.layout.fields.iter().filter(|field| field.kind == ValueKind::Number(NumberStyle::U64));
    let named = clocks.filter_map(|clock| Some((clock.name.strip_suffix(".timestamp")?, clock)));
    let outermost = named.filter(|(name, _)| !name.contains('.'));
    outermost.map(|(name, clock)| Part { name, clock }).collect()
}

/// What the parts of `esc_status` are called: by the motor that the ESC drives, where any of them says that; else by its place.
fn motors(topic: &LoggedTopic, parts: &[Part], rows: &Rows) -> Vec<Option<String>> {
    if topic.name != "esc_status" {
        return parts.iter().map(|_| None).collect();
    }
    let function_of = |part: &Part| {
        let field = topic.layout.fields.iter().find(|it| part.field(it) == Some("actuator_function"))?;
        let values = rows.stamped(part.clock);
        let mut values = values.values(field);
        let first = values.next()?;
        let function = MOTOR_FUNCTIONS.clone().find(|it| f64::from(*it) == first)?;
        values.all(|value| value == first).then(|| function - MOTOR_FUNCTIONS.start())
    };
    let functions: Vec<Option<u32>> = parts.iter().map(function_of).collect();
    let used: Vec<u32> = functions.iter().copied().flatten().collect();
    let says = !used.is_empty() && used.len() == used.iter().collect::<BTreeSet<_>>().len();
    let name = |(part, function): (&Part, Option<u32>)| match function {
        Some(motor) if says => format!("motor[{motor}]"),
        // Nothing is there, or no motor: the place of one is filled all the same.
        None if says => part.name.to_owned(),
        _ => part.name.replacen("esc", "motor", 1),
    };
    parts.iter().zip(functions).map(|it| Some(name(it))).collect()
}

/// Rows of a topic.
struct Rows<'a> {
    bytes: &'a [u8],
    starts: Vec<usize>,
}

impl<'a> Rows<'a> {
    fn values<'b>(&'b self, field: &'b RowField) -> impl Iterator<Item = f64> + use<'a, 'b> {
        let at = |start: &usize| self.bytes.get(start + field.offset..).unwrap_or_default();
        self.starts.iter().map(move |start| field.kind.value(at(start)))
    }

    fn column(&self, field: &RowField) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.starts.len());
        values.extend(self.values(field));
        values
    }

    /// [s] The stamps in `clock`, which are in microseconds.
    fn seconds(&self, clock: &RowField) -> Vec<f64> {
        self.values(clock).map(|stamp| stamp / 1e6).collect()
    }

    /// The rows whose own stamp is new.
    fn stamped(&self, clock: &RowField) -> Self {
        let mut last = 0.0;
        let starts = self.starts.iter().zip(self.values(clock)).filter(|(_, stamp)| {
            let is_new = *stamp != last && *stamp != 0.0;
            last = *stamp;
            is_new
        });
        Self { bytes: self.bytes, starts: starts.map(|(start, _)| *start).collect() }
    }

    fn are_zero<'b>(&self, mut fields: impl Iterator<Item = (&'b str, &'b RowField)>) -> bool {
        fields.all(|(_, field)| self.values(field).all(|value| value == 0.0))
    }

    fn table<'b>(
        &self,
        name: &str,
        time: &[f64],
        fields: impl Iterator<Item = (&'b str, &'b RowField)>,
        wants: Wants,
    ) -> Table {
        let fields = fields.filter(|(column, _)| *column != "timestamp" && wants(name, column));
        let column = |(column, field): (&str, &RowField)| {
            cancel::check();
            Column { name: column.to_owned(), unit: None, values: self.column(field) }
        };
        // Places of an array that nothing fills, as `actuator_motors.control[11]`, are no columns.
        let has_values = |column: &Column| column.values.iter().any(|value| !value.is_nan());
        let columns = fields.map(column).filter(has_values).collect();
        Table { columns, ..Table::new(name, time.to_vec()) }
    }
}

/// Roll, pitch and yaw of the attitude's quaternion: PX4 logs no angles.
fn angles(fields: &[RowField], rows: &Rows, wanted: impl Fn(&str) -> bool) -> Vec<Column> {
    let names = ["roll", "pitch", "yaw"];
    if !names.iter().any(|name| wanted(name)) {
        return Vec::new();
    }
    let of = |name: &str| fields.iter().find(|field| field.name == name).map(|field| rows.column(field));
    let (Some(w), Some(x), Some(y), Some(z)) = (of("q[0]"), of("q[1]"), of("q[2]"), of("q[3]")) else {
        return Vec::new();
    };
    let quaternions = || w.iter().zip(&x).zip(&y).zip(&z).map(|(((w, x), y), z)| [*w, *x, *y, *z]);
    let angle: [fn([f64; 4]) -> f64; 3] = [
        |[w, x, y, z]| (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y)),
        // Rounding of a nose straight up leaves the sine's range.
        |[w, x, y, z]| (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin(),
        |[w, x, y, z]| (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z)),
    ];
    let named = names.into_iter().zip(angle).filter(|(name, _)| wanted(name));
    let column = |(name, angle): (&str, fn([f64; 4]) -> f64)| Column {
        name: name.to_owned(),
        unit: Some("rad"),
        values: quaternions().map(angle).collect(),
    };
    named.map(column).collect()
}
