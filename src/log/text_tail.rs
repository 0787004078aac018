//! Lines of text behind the last row of a table, which programs write when they are done: `Test complete.`

use super::csv_blocks::number;
use super::mapping::MappingConfig;

/// The cells of a line.
pub(super) fn cells(line: &str, delimiter: char) -> Vec<&str> {
    line.split(delimiter).map(|cell| cell.trim().trim_matches('"')).collect()
}

/// Whether a cell is neither a number nor empty.
pub(super) fn is_text(cell: &str, decimal_comma: bool) -> bool {
    let parsed = if decimal_comma { number(&cell.replace(',', ".")) } else { number(cell) };
    parsed.is_none()
}

/// Whether the cells of a line are words: text in some of them, and a number in none.
pub(super) fn are_words(cells: &[&str], decimal_comma: bool) -> bool {
    let is_word = |cell: &&str| is_text(cell, decimal_comma) && cell.contains(char::is_alphabetic);
    let is_empty = |cell: &&str| cell.is_empty();
    cells.iter().any(is_word) && cells.iter().all(|cell| is_empty(cell) || is_text(cell, decimal_comma))
}

/// Where the rows of a text end, in bytes: behind it are lines with fewer cells than the header's `columns`, words in them, empty lines
/// and remarks. All of the text, where no words stand at its end.
pub(super) fn begin(body: &str, config: &MappingConfig, columns: usize) -> usize {
    let (mut end, mut has_words) = (body.len(), false);
    for line in body.split_inclusive('\n').rev() {
        let is_remark = config.comment.is_some_and(|comment| line.starts_with(comment));
        if !is_remark && !line.trim().is_empty() {
            let cells = cells(line.trim_end_matches(['\r', '\n']), config.delimiter);
            // What the mapping says means no value is as good as a number.
            let is_said = cells.iter().any(|cell| config.missing.iter().any(|it| it == cell));
            if is_said || cells.len() >= columns || !are_words(&cells, config.decimal_comma) {
                break;
            }
            has_words = true;
        }
        end -= line.len();
    }
    if has_words { end } else { body.len() }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::log::Mapping;
    use crate::log::mapped::parse;

    const MAPPING: &str =
        "[time]\ncolumn = \"t\"\n[[signal]]\nname = \"command_1\"\ncolumn = \"u\"\nunit = \"-\"\n";

    #[test]
    fn lines_of_text_behind_the_rows_end_the_table() {
        let mapping = Mapping::parse(MAPPING, Path::new("m.toml")).expect("a mapping");
        let read = |text: &str| parse(text.as_bytes(), Path::new("log.csv"), &mapping, None);
        for tail in ["Top: 5.90\nTop: 7.10", "\n\nTop: 5.90\nTop: 7.10\n\n", "01:31:39,done.\nbye\n"] {
            let text = format!("t,u,w\n0,0.1,1\n1,0.2,2\n{tail}");
            for text in [text.clone(), text.replace('\n', "\r\n")] {
                let (log, notes) = read(&text).expect("a log");
                assert_eq!((log.len(), notes.text_behind.count), (2, 2), "{text:?}");
                let first = notes.text_behind.first_lines.first().copied();
                assert_eq!(first, Some(if tail.starts_with('\n') { 6 } else { 4 }), "{text:?}");
                assert_eq!(log.column("command_1").map(|it| it[1]), Some(0.2));
            }
        }
        // A number, or a cell for each column: that is a row.
        for row in ["x,3", "x,y,z", "x,y,z\nTop: 5.90"] {
            let refused = read(&format!("t,u,w\n0,0.1,1\n{row}\n")).expect_err("no number").to_string();
            assert!(refused.contains("line 3, column `t`: `x` is not a number"), "{refused}");
        }
        // Text between rows is none behind them.
        assert!(read("t,u,w\n0,0.1,1\nTop: 5.90\n1,0.2,2\n").is_err());
    }
}
