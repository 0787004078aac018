//! Every TOML block of the pages is read by the program's own reader of its kind, which stands behind `toml` in the block's first
//! line; in `... part` it is a part of such a file.

use std::fs;
use std::path::Path;

use rotorbench::bench::BenchConfig;
use rotorbench::fleet::Plan;
use rotorbench::log::mapping::Mapping;
use rotorbench::model::Model;

use super::{blocks, pages, rotorbench};

/// A block: the page, the line of its fence, what stands behind `toml`, the text.
struct Block {
    page: String,
    line: usize,
    kind: String,
    text: String,
}

/// Blocks that are TOML, and those that say nothing of what they are and read as TOML.
fn toml_blocks() -> Vec<Block> {
    let mut found = Vec::new();
    for (page, text) in pages() {
        let mut lines = text.lines().enumerate();
        while let Some((line, first)) = lines.next() {
            let Some(kind) = first.trim_start().strip_prefix("```") else { continue };
            let body: Vec<&str> = lines
                .by_ref()
                .map(|(_, line)| line)
                .take_while(|line| !line.trim_start().starts_with("```"))
                .collect();
            let Some(kind) = kind.strip_prefix("toml") else { continue };
            let (kind, text) = (kind.trim().to_owned(), body.join("\n") + "\n");
            found.push(Block { page: page.clone(), line: line + 1, kind, text });
        }
    }
    found
}

/// What the reader of this kind says of a text.
pub fn read(kind: &str, text: &str) -> Result<(), String> {
    let said = |error: &dyn std::error::Error| {
        let source = error.source().map_or_else(String::new, |source| format!(": {source}"));
        format!("{error}{source}")
    };
    let path = Path::new("block.toml");
    let kind = kind.split('=').next().unwrap_or_default();
    match kind {
        "bench" | "bench part" => BenchConfig::parse(text, path).map(drop).map_err(|error| said(&error)),
        "mapping" => Mapping::parse(text, path).map(drop).map_err(|error| said(&error)),
        "model part" => {
            let base = Model::paper().emit().map_err(|error| said(&error))?;
            let model = Model::parse(&format!("{base}\n{text}"), path).map_err(|error| said(&error))?;
            model.known_effects().map(drop).map_err(|error| said(&error))
        }
        "plan" => {
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("plan.toml");
            fs::write(&path, text).expect("written");
            Plan::load(&path).map(drop).map_err(|error| said(&error))
        }
        _ => Err("behind `toml` stands bench, bench part, mapping, model part or plan".to_owned()),
    }
}

#[test]
fn every_toml_block_is_read_by_the_programs_reader_of_its_kind() {
    let blocks = toml_blocks();
    for Block { page, line, kind, text } in &blocks {
        if let Err(said) = read(kind, text) {
            panic!("{page}, line {line}: ```toml {kind}: {said}");
        }
        // And a key that this reader does not know would not get through, whichever table stands last.
        let wrong = read(kind, &format!("{text}no_such_key = 1\n"));
        assert!(wrong.is_err(), "{page}, line {line}: any key is read in its last table");
    }
    let count = |kind: &str| blocks.iter().filter(|block| block.kind.starts_with(kind)).count();
    for (kind, fewest) in [("bench", 6), ("bench part", 2), ("mapping", 2), ("model part", 1), ("plan", 1)] {
        assert!(count(kind) >= fewest, "{} blocks of {kind}", count(kind));
    }
}

#[test]
fn bench_files_of_the_guide_are_bench_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut count = 0;
    for (page, text) in pages() {
        for block in blocks(&text, "toml bench") {
            fs::write(folder.path().join("bench.toml"), &block).expect("written");
            let done = rotorbench(folder.path(), &["check", "--config", "bench.toml"]);
            let said = String::from_utf8_lossy(&done.stderr);
            assert!(matches!(done.status.code(), Some(0 | 1)), "{page}:\n{block}\n{said}");
            count += 1;
        }
    }
    assert!(count >= 2, "{count} bench files were found");
}

/// What a mapping reads: its delimiter, and the columns that it names, the clock first.
fn columns(mapping: &str) -> (String, Vec<&str>) {
    let value = |key: &str, line: &str| {
        line.strip_prefix(key)?.strip_prefix(" = \"")?.split('"').next().map(str::to_owned)
    };
    let delimiter = mapping.lines().find_map(|line| value("delimiter", line));
    let names =
        mapping.lines().filter(|line| line.starts_with("column = ") || line.starts_with("columns = ["));
    let mut columns: Vec<&str> = Vec::new();
    // Between quotes stands every second part of a line.
    for column in names.flat_map(|line| line.split('"').skip(1).step_by(2)) {
        if !columns.contains(&column) {
            columns.push(column);
        }
    }
    (delimiter.unwrap_or_else(|| ",".to_owned()), columns)
}

/// Each reads a log with the columns that it names; `#4` is the fourth of a log without a header.
#[test]
fn mapping_files_of_the_guide_read_a_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut count = 0;
    for (page, text) in pages() {
        for block in blocks(&text, "toml mapping") {
            let (delimiter, columns) = columns(&block);
            let numbers: Vec<usize> =
                columns.iter().filter_map(|it| it.strip_prefix('#')?.parse().ok()).collect();
            let width = numbers.iter().copied().max().unwrap_or(columns.len());
            let row = |row: i32| {
                let others = (1..width).map(|_| (1500 + row % 7).to_string());
                let cells = [format!("{:.2}", f64::from(row) * 0.01)].into_iter().chain(others);
                cells.collect::<Vec<_>>().join(&delimiter)
            };
            let header = numbers.is_empty().then(|| columns.join(&delimiter));
            let rows = header.into_iter().chain((0..200).map(row)).collect::<Vec<_>>();
            fs::write(folder.path().join("log.csv"), rows.join("\n") + "\n").expect("written");
            fs::write(folder.path().join("mapping.toml"), &block).expect("written");
            let done = rotorbench(folder.path(), &["import", "log.csv", "--mapping", "mapping.toml"]);
            let said = String::from_utf8_lossy(&done.stderr);
            assert!(done.status.success(), "{page}:\n{block}\n{said}");
            count += 1;
        }
    }
    assert!(count >= 2, "{count} mapping files were found");
}
