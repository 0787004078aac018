//! Every channel, row by row, beside the reference reader's.

use std::fs;

use super::reference::{RefTable, Reference};
use super::{format_of, logs, read};
use rotorbench::log::tables::Table;

/// Of sums and of functions that two libraries round differently: a few units in the last of 16 digits.
const ROUNDING: f64 = 1e-14;

fn same(ours: f64, theirs: Option<f64>) -> bool {
    let Some(theirs) = theirs else { return ours.is_nan() };
    (ours - theirs).abs() <= ROUNDING * theirs.abs().max(1e-3)
}

fn compare(ours: &Table, theirs: &RefTable, place: &str) -> usize {
    let names = |names: Vec<&str>| names.into_iter().map(str::to_owned).collect::<Vec<_>>();
    let of_ours = names(ours.columns.iter().map(|it| it.name.as_str()).collect());
    let of_theirs = names(theirs.columns.iter().map(|it| it.name.as_str()).collect());
    assert_eq!(of_ours, of_theirs, "{place}");
    for (ours, theirs) in ours.columns.iter().zip(&theirs.columns) {
        let unit = theirs.unit.as_deref();
        assert!(unit.is_none() || unit == Some(ours.unit.unwrap_or("")), "{place}, {}: {unit:?}", ours.name);
    }
    let columns = ours.columns.iter().zip(&theirs.columns);
    let pairs = columns.map(|(ours, theirs)| (ours.name.as_str(), &ours.values, &theirs.values));
    for (name, ours, theirs) in pairs.chain([("time", &ours.time, &theirs.time)]) {
        assert_eq!(ours.len(), theirs.len(), "{place}, {name}: rows");
        for (row, (ours, theirs)) in ours.iter().zip(theirs).enumerate() {
            assert!(same(*ours, *theirs), "{place}, {name}, row {row}: {ours}, but {theirs:?}");
        }
    }
    ours.columns.len() * ours.time.len()
}

#[test]
fn every_channel_is_the_reference_readers() {
    let (mut files, mut cells) = (0, 0);
    for (path, reference) in logs() {
        let bytes = fs::read(&path).expect("a log");
        let Reference::Tables { part, mut tables } = Reference::load(&reference);
        let format = format_of(&path, &bytes).unwrap_or_else(|| panic!("{}: unknown", path.display()));
        let ours = read(format, &path, &bytes, part).expect("a good log");
        let mut ours: Vec<&Table> = ours.tables.iter().collect();
        // The reference reader sorts its tables otherwise.
        ours.sort_by(|a, b| a.name.cmp(&b.name));
        tables.sort_by(|a, b| a.name.cmp(&b.name));
        let names = |tables: Vec<&str>| tables.join(" ");
        assert_eq!(
            names(ours.iter().map(|it| it.name.as_str()).collect()),
            names(tables.iter().map(|it| it.name.as_str()).collect()),
            "{}",
            path.display()
        );
        files += 1;
        for (ours, theirs) in ours.iter().zip(&tables) {
            cells += compare(ours, theirs, &format!("{}, {}", path.display(), ours.name));
        }
    }
    assert!(files > 0 && cells > 0, "there are golden files");
    println!("{files} logs, {cells} cells, as the reference readers read them");
}
