//! How a foreign text file is laid out, found out from its beginning: the character between cells, the header, decimal commas,
//! remarks; and the first rows as numbers.

use super::limits::not_names;
use super::text_tail::{are_words, cells, is_text};
use super::thresholds::THRESHOLDS;

/// Characters that may stand between cells, the likeliest first.
const DELIMITERS: [char; 4] = [',', ';', '\t', '|'];

/// A column as far as it was looked at.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SampledColumn {
    /// Its name in the header, or `#1`, `#2`, ...
    pub name: String,
    /// The first values; not-a-number where a cell holds none.
    pub values: Vec<f64>,
    /// Cells among them that a log cannot be read with: they are neither numbers nor empty. Each once, and no more than are asked about.
    pub texts: Vec<String>,
}

/// The layout of a text file.
#[derive(Debug, Clone, PartialEq)]
pub struct TextLayout {
    /// Character between cells.
    pub delimiter: char,
    /// Numbers are written 1,5.
    pub decimal_comma: bool,
    /// Whether the first line names the columns.
    pub header: bool,
    /// Lines that begin with this are remarks.
    pub comment: Option<char>,
    /// The encoding by its WHATWG name.
    pub encoding: &'static str,
    /// The columns, in order.
    pub columns: Vec<SampledColumn>,
}

/// Looks at the beginning of a text file; `None` where it is no table.
#[must_use]
pub fn layout(bytes: &[u8]) -> Option<TextLayout> {
    let part = bytes.get(..THRESHOLDS.guess_bytes.min(bytes.len()))?;
    let encoding =
        if std::str::from_utf8(bytes).is_ok() { encoding_rs::UTF_8 } else { encoding_rs::WINDOWS_1252 };
    let (text, _, _) = encoding.decode(part);
    let whole_lines =
        if part.len() < bytes.len() { text.rfind('\n').map_or(&*text, |end| &text[..end]) } else { &*text };
    let first = whole_lines.lines().find(|line| !line.trim().is_empty())?;
    // A header may begin with the mark, too, as numpy writes it: such lines are in cells.
    let is_header = first.starts_with('#') && first.contains(DELIMITERS);
    let is_marked = first.starts_with('#') || bytes.windows(2).any(|pair| pair == b"\n#");
    let comment = (is_marked && !is_header).then_some('#');
    let lines: Vec<&str> = whole_lines
        .lines()
        .filter(|line| !line.trim().is_empty() && !comment.is_some_and(|mark| line.starts_with(mark)))
        .take(THRESHOLDS.guess_rows + 1)
        .collect();
    let delimiter = delimiter(&lines)?;
    let rows: Vec<Vec<&str>> = lines.iter().map(|line| cells(line, delimiter)).collect();
    let decimal_comma = delimiter != ',' && {
        let all = || rows.iter().skip(1).flatten().filter(|cell| !cell.is_empty());
        let (point, comma) = (all().filter(|it| number(it, false)), all().filter(|it| number(it, true)));
        comma.count() > point.count()
    };
    let first = rows.first()?;
    let is_number = |cell: &&str| number(cell, decimal_comma);
    let header = !first.iter().any(is_number);
    // Cells behind the first row's have no name by which a mapping could read them.
    let width = first.len();
    let is_behind = |row: &[&str]| row.len() < width && are_words(row, decimal_comma);
    if not_names(first.iter().copied()).is_some() {
        return None;
    }
    Some(TextLayout {
        delimiter,
        decimal_comma,
        header,
        comment,
        encoding: encoding.name(),
        columns: columns(first, header, &rows_under(&rows, header, is_behind), decimal_comma),
    })
}

/// The rows under a header, without lines that say it again and without those at the end that `is_behind` says are none.
fn rows_under<'a, 'b>(
    rows: &'b [Vec<&'a str>],
    header: bool,
    is_behind: impl Fn(&[&str]) -> bool,
) -> Vec<&'b [&'a str]> {
    let is_row = |row: &&Vec<&str>| !header || rows.first() != Some(*row);
    let mut under: Vec<&[&str]> = rows.iter().filter(is_row).map(Vec::as_slice).collect();
    let end = under.iter().rposition(|row| !is_behind(row)).map_or(0, |last| last + 1);
    under.truncate(end);
    under
}

/// The columns, each with its name (where there is no header, its number) and its values.
fn columns(first: &[&str], header: bool, rows: &[&[&str]], decimal_comma: bool) -> Vec<SampledColumn> {
    let names = first
        .iter()
        .enumerate()
        .map(|(at, name)| if header { (*name).to_owned() } else { format!("#{}", at + 1) });
    let value = |cell: &str| -> f64 {
        let text = if decimal_comma { cell.replace(',', ".") } else { cell.to_owned() };
        text.parse().ok().filter(|value: &f64| value.is_finite()).unwrap_or(f64::NAN)
    };
    let column = names.enumerate().map(|(at, name)| {
        let cells = || rows.iter().map(|row| row.get(at).copied().unwrap_or(""));
        SampledColumn { name, values: cells().map(value).collect(), texts: texts(cells(), decimal_comma) }
    });
    column.collect()
}

/// The cells that are no numbers where a log is read, each once.
fn texts<'a>(cells: impl Iterator<Item = &'a str>, decimal_comma: bool) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for cell in cells.filter(|cell| is_text(cell, decimal_comma)) {
        if found.len() <= THRESHOLDS.guess_texts && !found.iter().any(|it| it == cell) {
            found.push(cell.to_owned());
        }
    }
    found
}

/// The character that parts most lines into the same number of cells, more than one.
fn delimiter(lines: &[&str]) -> Option<char> {
    let agreeing = |delimiter: char| {
        let counts: Vec<usize> = lines.iter().map(|line| cells(line, delimiter).len()).collect();
        let usual = *counts.get(counts.len() / 2)?;
        let same = counts.iter().filter(|count| **count == usual).count();
        (usual > 1).then_some((same * usual.min(2), delimiter))
    };
    let found = DELIMITERS.into_iter().filter_map(agreeing);
    // The first of equals: `max_by_key` would take the last.
    found.rev().max_by_key(|(agreement, _)| *agreement).map(|(_, delimiter)| delimiter)
}

fn number(cell: &str, decimal_comma: bool) -> bool {
    let text = if decimal_comma { cell.replace(',', ".") } else { cell.to_owned() };
    text.parse::<f64>().is_ok_and(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_are_recognised() {
        let plain = layout(b"t,u\n0,1\n1,.0132\n").expect("a table");
        assert_eq!((plain.delimiter, plain.header, plain.decimal_comma), (',', true, false));
        assert_eq!(plain.columns[1].values, [1.0, 0.0132]);
        let german = layout("Zeit (s);Drehzahl (rpm)\n0,0;1000,5\n0,1;1001\n".as_bytes()).expect("a table");
        assert_eq!((german.delimiter, german.decimal_comma), (';', true));
        assert_eq!(german.columns[1].values, [1000.5, 1001.0]);
        let bare = layout(b"0\t5\n1\t6\n").expect("a table");
        assert_eq!((bare.header, bare.columns[0].name.as_str()), (false, "#1"));
        let remarks = layout(b"a,b\n0,1\n# landed\n1,2\n").expect("a table");
        assert_eq!((remarks.comment, remarks.columns[0].values.len()), (Some('#'), 2));
        let ended = layout(b"t,u\n0,1\nt,u\n1,2\nTop: 5.9\n").expect("a table");
        assert_eq!(ended.columns[0].values, [0.0, 1.0]);
        let latin = layout(b"t,\xb0\n0,1\n").expect("a table");
        assert_eq!(latin.encoding, "windows-1252");
    }

    #[test]
    fn cells_of_text_are_told_from_numbers_and_empty_ones() {
        let found = layout(b"t,mode,u\n0,0,1\n1,ANGLE,nan\n2,ANGLE,\n3,OFF,N/A\n").expect("a table");
        let texts: Vec<&[String]> = found.columns.iter().map(|it| &it.texts[..]).collect();
        assert_eq!(texts, [&[][..], &["ANGLE".to_owned(), "OFF".to_owned()], &["N/A".to_owned()]]);
    }

    /// What is written down of a guess names columns of the header alone.
    #[test]
    fn cells_behind_the_header_make_no_column() {
        let found = layout(b"t,u\n0,1,7\n1,2,7\n").expect("a table");
        assert_eq!(found.columns.iter().map(|it| &it.name[..]).collect::<Vec<_>>(), ["t", "u"]);
    }

    #[test]
    fn what_is_no_table_is_none() {
        assert_eq!(layout(b""), None);
        assert_eq!(layout(b"just one word\n"), None);
        let wide = format!("{}\n{}\n", "a,".repeat(50_000), "1,".repeat(50_000));
        assert_eq!(layout(wide.as_bytes()), None);
        let one_row = format!("t,u\n0,1\n{}\n2,1\n", "1,".repeat(50_000));
        assert_eq!(layout(one_row.as_bytes()).map(|it| it.columns.len()), Some(2));
    }
}
