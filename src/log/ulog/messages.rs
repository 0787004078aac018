//! The messages of a log, one behind the other, and how to find the next good one behind damage.

use std::collections::HashMap;

use super::layout::{FormatDefinitions, RowLayout};
use crate::cancel;
use crate::log::bytes::Bytes;
use crate::log::tables::Tables;

/// Bytes before the first message.
const FILE_HEADER: usize = 16;

/// What every synchronization message says.
const SYNC: [u8; 8] = [0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];

/// So many good messages in a row are no accident.
const CHAIN: usize = 3;

/// Letters of a key or a name; a longer one is damage.
const LONGEST_NAME: usize = 255;

/// Rows between two looks at whether the end was asked for.
const CHECK_EVERY: usize = 4096;

/// A topic, or one of several instances of it.
#[derive(Debug)]
pub(super) struct LoggedTopic {
    pub(super) name: String,
    pub(super) instance: u8,
    pub(super) layout: RowLayout,
    /// Where in the file each row begins.
    pub(super) rows: Vec<usize>,
}

/// A message, as its header says.
#[derive(Clone, Copy)]
struct Message<'a> {
    kind: u8,
    body: &'a [u8],
    next: usize,
}

/// What is known of a log while it is read.
pub(super) struct UlogFile<'a> {
    bytes: &'a [u8],
    definitions: FormatDefinitions,
    /// Topic of each message id; `None` for one whose definition is of no use.
    subscriptions: HashMap<u16, Option<usize>>,
    pub(super) topics: Vec<LoggedTopic>,
    /// Where data were appended, the end of the file among them.
    ends: Vec<usize>,
    /// What was left out, and what the log says of itself.
    pub(super) notes: Tables,
    /// Why it cannot be read at all.
    pub(super) refused: Option<String>,
}

impl<'a> UlogFile<'a> {
    /// Reads all messages of a file.
    pub(super) fn read(bytes: &'a [u8]) -> Self {
        let mut log = Self {
            bytes,
            definitions: FormatDefinitions::default(),
            subscriptions: HashMap::new(),
            topics: Vec::new(),
            ends: vec![bytes.len()],
            notes: Tables::default(),
            refused: None,
        };
        let mut at = FILE_HEADER;
        while let Some(end) = log.ends.iter().copied().find(|end| *end > at) {
            at = log.read_until(at, end);
            if log.refused.is_some() {
                break;
            }
        }
        log
    }

    /// Reads the messages from `at` to `end`, and says where to go on.
    fn read_until(&mut self, mut at: usize, mut end: usize) -> usize {
        let mut count = 0_usize;
        while at < end && self.refused.is_none() {
            count += 1;
            if count.is_multiple_of(CHECK_EVERY) {
                cancel::check();
            }
            let message = self.message(at, end);
            match message {
                Some(message) if self.is_good(&message, at) => {
                    self.take(&message, at);
                    at = message.next;
                    // The first message may say that the file goes on elsewhere.
                    end = self.ends.iter().copied().find(|end| *end >= at).unwrap_or(end);
                }
                // A kind of message that came later, or a damaged one between good ones.
                Some(message) if self.is_chain(message.next, end) => {
                    let kind = char::from(message.kind).escape_default().to_string();
                    let known = b"BFIMPQARDLCSO".contains(&message.kind);
                    self.notes.skip(
                        if known { "damaged_message" } else { "unknown_message" },
                        &kind,
                        at as u64,
                    );
                    at = message.next;
                }
                _ => {
                    let next = (at + 1..end).find(|next| self.is_chain(*next, end));
                    let code = if next.is_some() { "damaged_bytes" } else { "cut_off" };
                    self.notes.skip(code, "", at as u64);
                    at = next.unwrap_or(end);
                }
            }
        }
        at
    }

    fn message(&self, at: usize, end: usize) -> Option<Message<'a>> {
        let mut bytes = Bytes::new(self.bytes.get(at..end)?);
        let size = bytes.u16()?;
        let kind = bytes.u8()?;
        let body = bytes.take(usize::from(size))?;
        Some(Message { kind, body, next: at + bytes.at() })
    }

    /// Whether [`CHAIN`] good messages begin at `at`, or fewer that end where the bytes do.
    fn is_chain(&self, mut at: usize, end: usize) -> bool {
        for _ in 0..CHAIN {
            if at == end {
                return true;
            }
            match self.message(at, end) {
                Some(message) if self.is_good(&message, at) => at = message.next,
                _ => return false,
            }
        }
        true
    }

    /// Whether a message is as its kind demands.
    fn is_good(&self, message: &Message, at: usize) -> bool {
        let body = message.body;
        match message.kind {
            b'D' => body.first_chunk().is_some_and(|id| match self.topic(u16::from_le_bytes(*id)) {
                Some(Some(topic)) => (topic.layout.least..=topic.layout.most).contains(&(body.len() - 2)),
                Some(None) => true,
                None => false,
            }),
            b'S' => body == SYNC,
            b'O' | b'R' => body.len() == 2,
            b'L' => body.len() > 8,
            b'C' => body.len() > 10,
            b'I' | b'P' => key(body).is_some(),
            b'M' | b'Q' => key(body.get(1..).unwrap_or_default()).is_some(),
            b'A' => subscription(body).is_some_and(|(_, _, name)| self.definitions.knows(name)),
            b'F' => body.iter().take(LONGEST_NAME).any(|letter| *letter == b':'),
            b'B' => at == FILE_HEADER && body.len() >= 40,
            _ => false,
        }
    }

    fn topic(&self, id: u16) -> Option<Option<&LoggedTopic>> {
        let place = self.subscriptions.get(&id)?;
        Some(place.and_then(|place| self.topics.get(place)))
    }

    /// Takes in a good message that began at `at`.
    fn take(&mut self, message: &Message, at: usize) {
        let body = message.body;
        match message.kind {
            b'D' => {
                let id = body.first_chunk().map_or(0, |id| u16::from_le_bytes(*id));
                if let Some(topic) =
                    self.subscriptions.get(&id).copied().flatten().and_then(|it| self.topics.get_mut(it))
                {
                    topic.rows.push(message.next - body.len() + 2);
                }
            }
            b'A' => self.subscribe(body, at),
            b'F' => {
                let text = String::from_utf8_lossy(body);
                if self.definitions.add(&text).is_none() {
                    self.notes.skip("damaged_message", "F", at as u64);
                }
            }
            b'I' | b'P' => self.notes.about.extend(key(body).and_then(|(key, value)| about(key, value))),
            b'O' => self.notes.skip("logger_dropout", "", at as u64),
            b'B' => self.flags(body),
            _ => {}
        }
    }

    fn subscribe(&mut self, body: &[u8], at: usize) {
        let Some((instance, id, name)) = subscription(body) else { return };
        let known = self.topics.iter().position(|topic| topic.instance == instance && topic.name == name);
        let place = known.or_else(|| {
            let layout = self.definitions.layout(name)?;
            self.topics.push(LoggedTopic { name: name.to_owned(), instance, layout, rows: Vec::new() });
            Some(self.topics.len() - 1)
        });
        if place.is_none() {
            self.notes.skip("unusable_definition", name, at as u64);
        }
        self.subscriptions.insert(id, place);
    }

    /// The flags: whether this reader understands the file, and where data were appended.
    fn flags(&mut self, body: &[u8]) {
        let mut bytes = Bytes::new(body);
        let (Some(_), Some(incompatible)) = (bytes.array::<8>(), bytes.array::<8>()) else { return };
        let [first, rest @ ..] = incompatible;
        if first & !1 != 0 || rest != [0; 7] {
            self.refused =
                Some("a version of ULog that its own flags call incompatible with older readers".to_owned());
            return;
        }
        let offsets = (first & 1 != 0).then(|| [bytes.u64(), bytes.u64(), bytes.u64()]);
        let offsets =
            offsets.into_iter().flatten().flatten().filter_map(|offset| usize::try_from(offset).ok());
        self.ends.extend(offsets.filter(|offset| (FILE_HEADER + 3..self.bytes.len()).contains(offset)));
        self.ends.sort_unstable();
    }
}

/// Key, `type name`, and value.
fn key(body: &[u8]) -> Option<(&str, &[u8])> {
    let (length, rest) = body.split_first()?;
    let (key, value) = rest.split_at_checked(usize::from(*length))?;
    let key = std::str::from_utf8(key).ok()?;
    key.contains(' ').then_some((key, value))
}

/// Instance, message id and topic.
fn subscription(body: &[u8]) -> Option<(u8, u16, &str)> {
    let mut bytes = Bytes::new(body);
    let (instance, id) = (bytes.u8()?, bytes.u16()?);
    let name = bytes.rest();
    let name = (1..=LONGEST_NAME).contains(&name.len()).then(|| std::str::from_utf8(name).ok())??;
    Some((instance, id, name))
}

/// What a reader of an answer may need to know: hardware and firmware, and which topics are logged how often.
fn about(key: &str, value: &[u8]) -> Option<(String, String)> {
    let (kind, name) = key.split_once(' ')?;
    let text = if name == "SDLOG_PROFILE" {
        i32::from_le_bytes(*value.first_chunk()?).to_string()
    } else if ["sys_name", "ver_hw", "ver_sw"].contains(&name) && kind.starts_with("char[") {
        String::from_utf8_lossy(value.get(..LONGEST_NAME).unwrap_or(value)).trim_end_matches('\0').to_owned()
    } else {
        return None;
    };
    Some((name.to_owned(), text))
}
