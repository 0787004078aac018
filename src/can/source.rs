//! Where things are in the text of a DBC file: the syntax tree keeps no lines, and truncates identifiers.

use std::collections::HashMap;

use super::error::CanError;

/// Marks a 29-bit identifier in a DBC file.
const EXTENDED: u64 = 1 << 31;
/// The message in which some tools keep signals that belong to no message. Its identifier does not exist.
pub(super) const NO_MESSAGE: &str = "VECTOR__INDEPENDENT_SIG_MSG";

/// Lines of the messages and signals of a DBC text.
pub(super) struct DbcLines {
    file: String,
    /// Line and identifier of each `BO_`, as written.
    ids: Vec<(usize, u64)>,
    messages: HashMap<u64, usize>,
    signals: HashMap<(u64, String), usize>,
}

impl DbcLines {
    /// Finds each `BO_` and `SG_` at the beginning of a line, outside quoted text.
    pub(super) fn scan(file: &str, text: &str) -> Self {
        let mut source = Self {
            file: file.to_owned(),
            ids: Vec::new(),
            messages: HashMap::new(),
            signals: HashMap::new(),
        };
        let mut quoted = false;
        let mut message = None;
        for (index, line) in text.lines().enumerate() {
            let mut words = line.split_whitespace();
            match (quoted, words.next(), words.next()) {
                (false, Some("BO_"), Some(id)) => {
                    message = id.parse::<u64>().ok();
                    let is_none = words.next().is_some_and(|name| name.starts_with(NO_MESSAGE));
                    if let Some(id) = message.filter(|_| !is_none) {
                        source.ids.push((index + 1, id));
                        source.messages.entry(id).or_insert(index + 1);
                    }
                }
                (false, Some("SG_"), Some(name)) => {
                    let name = name.split(':').next().unwrap_or(name).to_owned();
                    source.signals.entry((message.unwrap_or(0), name)).or_insert(index + 1);
                }
                _ => {}
            }
            quoted ^= line.replace("\\\"", "").matches('"').count() % 2 == 1;
        }
        source
    }

    /// Refuses identifiers with more than 11 bits, or 29 where bit 31 says so.
    pub(super) fn check_ids(&self) -> Result<(), CanError> {
        for &(line, id) in &self.ids {
            let fits = if id & EXTENDED == 0 { id <= 0x7FF } else { id < EXTENDED | 0x2000_0000 };
            if !fits {
                let reason = if id & EXTENDED == 0 {
                    format!("identifier {id} has more than 11 bits (a 29-bit identifier has bit 31 set)")
                } else {
                    format!("identifier {id} has more than 29 bits")
                };
                return Err(self.error(line, reason));
            }
        }
        Ok(())
    }

    /// Line of the message with this identifier as written, or 1.
    pub(super) fn message_line(&self, id: u32) -> usize {
        self.messages.get(&u64::from(id)).copied().unwrap_or(1)
    }

    /// Line of the second message with this identifier as written, or 1.
    pub(super) fn second_line(&self, id: u32) -> usize {
        let mut lines = self.ids.iter().filter(|(_, of_line)| *of_line == u64::from(id));
        lines.nth(1).map_or(1, |(line, _)| *line)
    }

    /// Line of a signal, or of its message.
    pub(super) fn signal_line(&self, id: u32, name: &str) -> usize {
        let line = self.signals.get(&(u64::from(id), name.to_owned()));
        line.copied().unwrap_or_else(|| self.message_line(id))
    }

    /// An error in a line of this file.
    pub(super) fn error(&self, line: usize, reason: String) -> CanError {
        CanError::Database { file: self.file.clone(), line, reason }
    }

    /// The parser's error, with the place that its text names (`--> line:column`) and the last line of that text,
    /// which says what was expected.
    pub(super) fn syntax_error(&self, error: &can_dbc::DbcError) -> CanError {
        let text = error.to_string();
        let place = text.split("-->").nth(1).and_then(|rest| rest.lines().next()).unwrap_or("");
        let mut numbers = place.trim().split(':').map(str::parse::<usize>);
        let mut number = || numbers.next().and_then(Result::ok).unwrap_or(1);
        let (line, column) = (number(), number());
        let reason = text.lines().last().unwrap_or("").trim().trim_start_matches("= ").to_owned();
        CanError::Syntax { file: self.file.clone(), line, column, reason: format!("not DBC: {reason}") }
    }
}
