//! Every channel, row by row, beside the reference reader's.

use std::fs;

use super::reference::{RefFrame, RefTable, Reference};
use super::{capture, format_of, logs, read};
use rotorbench::log::candump::CandumpFrame;
use rotorbench::log::tables::Table;
use rotorbench::recording::FrameFlags;

/// Of sums and of functions that two libraries round differently: a few units in the last of 16 digits.
const ROUNDING: f64 = 1e-14;

fn same(ours: f64, theirs: f64) -> bool {
    let both_none = ours.is_nan() && theirs.is_nan();
    both_none || ours == theirs || (ours - theirs).abs() <= ROUNDING * theirs.abs().max(1e-3)
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
            let theirs = theirs.value();
            assert!(same(*ours, theirs), "{place}, {name}, row {row}: {ours}, but {theirs}");
        }
    }
    ours.columns.iter().map(|column| column.values.len()).sum()
}

#[test]
fn every_channel_is_the_reference_readers() {
    let (mut files, mut cells) = (0, 0);
    for (path, reference) in logs() {
        let bytes = fs::read(&path).expect("a log");
        let Reference::Tables { part, mut tables } = Reference::load(&reference) else { continue };
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

/// [s] A stamp of the reference is a float of seconds since 1970, which has so many digits.
const STAMP: f64 = 3e-7;

fn compare_frame(ours: &CandumpFrame, theirs: &RefFrame, place: &str) {
    let frame = &ours.frame;
    let letters = [
        ('x', FrameFlags::EXTENDED),
        ('r', FrameFlags::REMOTE),
        ('e', FrameFlags::ERROR),
        ('f', FrameFlags::FD),
        ('b', FrameFlags::BIT_RATE_SWITCH),
        ('s', FrameFlags::ERROR_STATE),
        ('t', FrameFlags::SENT),
    ];
    let flags: String =
        letters.iter().filter(|(_, flag)| frame.is(*flag)).map(|(letter, _)| *letter).collect();
    let data: String = frame.payload().iter().map(|byte| format!("{byte:02x}")).collect();
    let data = if frame.is(FrameFlags::REMOTE) { String::new() } else { data };
    let (stamp, channel, id, their_flags, length, their_data) = theirs;
    assert_eq!(
        (&ours.interface, frame.id, &flags, frame.length, &data),
        (&channel.to_string(), *id, their_flags, *length, their_data),
        "{place}"
    );
    let seconds = frame.stamp_ns as f64 / 1e9;
    assert!((seconds - stamp).abs() < STAMP, "{place}: {seconds} s, but {stamp} s");
}

#[test]
fn every_frame_is_the_reference_readers() {
    let (mut files, mut frames) = (0, 0);
    for (path, reference) in logs() {
        let Reference::Frames { frames: theirs } = Reference::load(&reference) else { continue };
        let bytes = fs::read(&path).expect("a capture");
        let ours = capture(&path, &bytes).unwrap_or_else(|| panic!("{}: unknown", path.display()));
        let ours = ours.expect("a good capture");
        assert_eq!(ours.len(), theirs.len(), "{}", path.display());
        for (row, (ours, theirs)) in ours.iter().zip(&theirs).enumerate() {
            compare_frame(ours, theirs, &format!("{}, frame {row}", path.display()));
        }
        files += 1;
        frames += ours.len();
    }
    assert!(files > 0 && frames > 0, "there are golden files");
    println!("{files} captures, {frames} frames, as the reference readers read them");
}
