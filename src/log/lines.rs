//! On which line of the file a CSV row stands. The `csv` crate counts only what it has consumed, so that it is wrong
//! behind `\r\n`, empty lines and remarks.

/// Finds the lines of rows, front to back.
pub(crate) struct Lines<'a> {
    text: &'a [u8],
    comment: Option<u8>,
    byte: usize,
    line: u64,
}

impl<'a> Lines<'a> {
    /// Lines of `text`, the first of which has number `first`.
    pub(crate) fn new(text: &'a [u8], comment: Option<u8>, first: u64) -> Self {
        Self { text, comment, byte: 0, line: first }
    }

    /// The line of the row that the reader began to look for at `position`.
    pub(crate) fn of(&mut self, position: Option<&csv::Position>) -> u64 {
        let begin = position.map_or(0, |position| position.byte() as usize);
        while self.byte < begin {
            self.advance();
        }
        let mut at_line_start = self.byte == 0 || self.text.get(self.byte.wrapping_sub(1)) == Some(&b'\n');
        loop {
            match self.text.get(self.byte) {
                Some(b'\n') => at_line_start = true,
                Some(b'\r') => {}
                Some(letter) if at_line_start && Some(*letter) == self.comment => {
                    while self.text.get(self.byte).is_some_and(|letter| *letter != b'\n') {
                        self.byte += 1;
                    }
                    continue;
                }
                _ => return self.line,
            }
            self.advance();
        }
    }

    fn advance(&mut self) {
        self.line += u64::from(self.text.get(self.byte) == Some(&b'\n'));
        self.byte += 1;
    }
}
