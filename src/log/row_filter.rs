//! Which rows of a foreign log count, by the value of one of its columns: `phase == 2`.

/// `COLUMN COMPARISON NUMBER`, as a mapping's `where` has it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RowFilter {
    /// Name of the column.
    pub column: String,
    comparison: Comparison,
    number: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Comparison {
    Equal,
    NotEqual,
    Below,
    AtMost,
    Above,
    AtLeast,
}

/// Spellings, those first of which another is the beginning.
const COMPARISONS: [(&str, Comparison); 6] = [
    ("==", Comparison::Equal),
    ("!=", Comparison::NotEqual),
    ("<=", Comparison::AtMost),
    (">=", Comparison::AtLeast),
    ("<", Comparison::Below),
    (">", Comparison::Above),
];

impl RowFilter {
    /// Parses `text`.
    ///
    /// # Errors
    /// What is wrong with it, in a sentence.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let found = COMPARISONS
            .iter()
            .filter_map(|(sign, comparison)| text.find(sign).map(|at| (at, sign.len(), *comparison)));
        // The first of the longest: `<=` stands where `<` does.
        let first = found.min_by_key(|(at, length, _)| (*at, std::cmp::Reverse(*length)));
        let Some((at, length, comparison)) = first else {
            return Err(format!(
                "`where = \"{text}\"` compares nothing: write `COLUMN == NUMBER` (or !=, <, <=, >, >=)"
            ));
        };
        let (column, number) = (text[..at].trim(), text[at + length..].trim());
        let parsed = number.parse().ok().filter(|value: &f64| value.is_finite());
        match parsed {
            Some(number) if !column.is_empty() => Ok(Self { column: column.to_owned(), comparison, number }),
            Some(_) => Err(format!("`where = \"{text}\"` names no column")),
            None => Err(format!("`where = \"{text}\"`: `{number}` is not a number")),
        }
    }

    /// Whether a row with this value counts; one without a value does not.
    pub(crate) fn keeps(&self, value: f64) -> bool {
        match self.comparison {
            Comparison::Equal => value == self.number,
            Comparison::NotEqual => value != self.number && !value.is_nan(),
            Comparison::Below => value < self.number,
            Comparison::AtMost => value <= self.number,
            Comparison::Above => value > self.number,
            Comparison::AtLeast => value >= self.number,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_comparison_is_read_and_kept() {
        for (text, kept) in [
            ("phase == 2", [false, true, false]),
            ("phase != 2", [true, false, true]),
            ("phase<2", [true, false, false]),
            ("phase <= 2", [true, true, false]),
            ("phase > 2", [false, false, true]),
            ("phase >=2", [false, true, true]),
        ] {
            let filter = RowFilter::parse(text).expect("good");
            assert_eq!(filter.column, "phase");
            assert_eq!([1.0, 2.0, 3.0].map(|value| filter.keeps(value)), kept, "{text}");
            assert!(!filter.keeps(f64::NAN), "{text}");
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        assert!(RowFilter::parse("phase").unwrap_err().contains("compares nothing"));
        assert!(RowFilter::parse("== 2").unwrap_err().contains("names no column"));
        assert!(RowFilter::parse("phase == two").unwrap_err().contains("`two` is not a number"));
    }
}
