//! Reading a recording, front to back, in bounded memory, whole or cut off.

use std::collections::{HashMap, VecDeque};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

use mcap::records::{self, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::signal::{Applied, Command, ControlStep, GuardStep, Request, Sensors};

use super::RecordError;
use super::cdr::{CdrMessage, decode};
use super::messages::{ControlStepLine, GuardStepLine};
use super::metadata::{METADATA_NAME, RecordingMetadata};
use super::sender::RecordedItem;
use super::thresholds::THRESHOLDS;
use super::topic::{RecordedTopic, TOPICS, WINDOW};

/// How a recording ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// Closed properly.
    Whole,
    /// Cut off or damaged behind the last chunk that was read: the recorder was killed, or the disk was full.
    CutOff {
        /// Place in the file where reading stopped.
        byte: u64,
        /// What stood there.
        reason: String,
    },
}

/// A recording being read: an iterator over its records in the order they were written.
pub struct Recording {
    path: PathBuf,
    file: BufReader<File>,
    mcap: LinearReader,
    byte: u64,
    metadata: RecordingMetadata,
    channels: HashMap<u16, RecordedTopic>,
    ordinals: HashMap<u16, u64>,
    recent: Recent,
    first: Option<RecordedItem>,
    end: Option<End>,
}

/// The messages that steps may refer to.
#[derive(Default)]
struct Recent {
    sensors: Ring<Sensors>,
    command: Ring<Command>,
    applied: Ring<Applied>,
    request: Ring<Request>,
}

/// The last messages of a topic with their ordinals.
struct Ring<N>(VecDeque<(u64, N)>);

impl<N> Default for Ring<N> {
    fn default() -> Self {
        Self(VecDeque::with_capacity(WINDOW))
    }
}

impl<N: CdrMessage + Copy> Ring<N> {
    fn keep(&mut self, ordinal: u64, data: &[u8]) -> Result<N, String> {
        let message = decode::<N>(data).map_err(|error| error.to_string())?;
        if self.0.len() == WINDOW {
            self.0.pop_front();
        }
        self.0.push_back((ordinal, message));
        Ok(message)
    }

    fn find(&self, ordinal: u64) -> Result<N, String> {
        let known = self.0.iter().rev().find(|(known, _)| *known == ordinal);
        known
            .map(|(_, message)| *message)
            .ok_or_else(|| format!("it refers to {} {ordinal}, which is not there", N::NAME))
    }
}

impl Recording {
    /// Opens a recording and reads its metadata.
    ///
    /// # Errors
    /// [`RecordError`] when the file cannot be read or is no recording of ours.
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let open = |source| RecordError::Open { path: path.to_owned(), source };
        let file = File::open(path).map_err(open)?;
        if file.metadata().map_err(open)?.is_dir() {
            return Err(open(std::io::ErrorKind::IsADirectory.into()));
        }
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(THRESHOLDS.longest_record);
        let mut recording = Self {
            path: path.to_owned(),
            file: BufReader::with_capacity(1 << 16, file),
            mcap: LinearReader::new_with_options(options),
            byte: 0,
            metadata: RecordingMetadata::default(),
            channels: HashMap::new(),
            ordinals: HashMap::new(),
            recent: Recent::default(),
            first: None,
            end: None,
        };
        recording.first = recording.step()?;
        if recording.metadata.versions.is_empty() {
            let reason = match &recording.end {
                Some(End::CutOff { reason, .. }) => reason.clone(),
                _ => format!("it has no metadata record `{METADATA_NAME}`"),
            };
            return Err(RecordError::Foreign { path: path.to_owned(), reason });
        }
        Ok(recording)
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the recording knows about its own making.
    #[must_use]
    pub fn metadata(&self) -> &RecordingMetadata {
        &self.metadata
    }

    /// How the recording ends; `None` until it has been read to its end.
    #[must_use]
    pub fn end(&self) -> Option<&End> {
        self.end.as_ref()
    }

    /// The next record, or `None` at the end.
    fn step(&mut self) -> Result<Option<RecordedItem>, RecordError> {
        while self.end.is_none() {
            let Some(event) = self.mcap.next_event() else {
                self.cut_off("the file ends without its closing record".to_owned());
                break;
            };
            match event {
                Ok(LinearReadEvent::ReadRequest(wanted)) => self.read_more(wanted)?,
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    let data = data.to_vec();
                    if let Some(record) = self.take(opcode, &data)? {
                        return Ok(Some(record));
                    }
                }
                Err(error) => self.cut_off(error.to_string()),
            }
        }
        Ok(None)
    }

    fn read_more(&mut self, wanted: usize) -> Result<(), RecordError> {
        // A length that damage made up must not become an allocation: grow as the file really delivers.
        let count = self
            .file
            .read(self.mcap.insert(wanted.min(1 << 20)))
            .map_err(|source| RecordError::Open { path: self.path.clone(), source })?;
        self.mcap.notify_read(count);
        self.byte += count as u64;
        Ok(())
    }

    fn cut_off(&mut self, reason: String) {
        self.end = Some(End::CutOff { byte: self.byte, reason });
    }

    /// Looks at one MCAP record; answers the bench's record in it, if it is a message.
    fn take(&mut self, opcode: u8, data: &[u8]) -> Result<Option<RecordedItem>, RecordError> {
        // Only these are of interest; the crate's parser of attachments panics on short ones.
        if !matches!(opcode, op::METADATA | op::CHANNEL | op::MESSAGE | op::DATA_END) {
            return Ok(None);
        }
        match mcap::parse_record(opcode, data) {
            Err(error) => self.cut_off(error.to_string()),
            Ok(records::Record::Metadata(found)) if found.name == METADATA_NAME => {
                self.metadata = RecordingMetadata::from_metadata(&found.metadata).map_err(|error| {
                    RecordError::Foreign { path: self.path.clone(), reason: error.to_string() }
                })?;
            }
            Ok(records::Record::Channel(found)) => {
                if let Some(info) = TOPICS.iter().find(|info| info.name == found.topic) {
                    self.channels.insert(found.id, info.topic);
                }
            }
            Ok(records::Record::DataEnd(_)) => self.end = Some(End::Whole),
            Ok(records::Record::Message { header, data }) => return self.message(header.channel_id, &data),
            Ok(_) => {}
        }
        Ok(None)
    }

    fn message(&mut self, channel: u16, data: &[u8]) -> Result<Option<RecordedItem>, RecordError> {
        let Some(topic) = self.channels.get(&channel).copied() else { return Ok(None) };
        let ordinal = self.ordinals.entry(channel).or_default();
        *ordinal += 1;
        let ordinal = *ordinal;
        self.recent.understand(topic, ordinal, data).map(Some).map_err(|reason| RecordError::Message {
            path: self.path.clone(),
            byte: self.byte,
            topic: TOPICS.iter().find(|info| info.topic == topic).map_or("", |info| info.name).to_owned(),
            ordinal,
            reason,
        })
    }
}

impl Recent {
    fn understand(
        &mut self,
        topic: RecordedTopic,
        ordinal: u64,
        data: &[u8],
    ) -> Result<RecordedItem, String> {
        fn plain<N: CdrMessage + Into<RecordedItem>>(data: &[u8]) -> Result<RecordedItem, String> {
            decode::<N>(data).map(Into::into).map_err(|error| error.to_string())
        }
        Ok(match topic {
            RecordedTopic::Sensors => RecordedItem::Sensors(self.sensors.keep(ordinal, data)?),
            RecordedTopic::Command => RecordedItem::Command(self.command.keep(ordinal, data)?),
            RecordedTopic::Applied => RecordedItem::Applied(self.applied.keep(ordinal, data)?),
            RecordedTopic::Request => RecordedItem::Request(self.request.keep(ordinal, data)?),
            RecordedTopic::GuardEvent => plain::<crate::signal::GuardEvent>(data)?,
            RecordedTopic::Heartbeat => plain::<crate::signal::Heartbeat>(data)?,
            RecordedTopic::Cycle => plain::<crate::signal::CycleSample>(data)?,
            RecordedTopic::Frame => plain::<super::RawFrame>(data)?,
            RecordedTopic::Recorder => plain::<super::RecorderStatus>(data)?,
            RecordedTopic::ControlStep => {
                let line = decode::<ControlStepLine>(data).map_err(|error| error.to_string())?;
                RecordedItem::ControlStep(ControlStep {
                    sensors: self.sensors.find(line.sensors)?,
                    applied: self.applied.find(line.applied)?,
                    command: self.command.find(line.command)?,
                })
            }
            RecordedTopic::GuardStep => {
                let line = decode::<GuardStepLine>(data).map_err(|error| error.to_string())?;
                let given = |ordinal: u64| (ordinal != 0).then_some(ordinal);
                let newest = given(line.newest).map(|it| self.command.find(it)).transpose()?;
                let request = given(line.request).map(|it| self.request.find(it)).transpose()?;
                let (sensors, applied) = (self.sensors.find(line.sensors)?, self.applied.find(line.applied)?);
                let trip = (line.trip_cause != 0).then_some((line.trip_ns, line.trip_cause));
                let step = GuardStep::new(line.now_ns, &sensors, newest.as_ref(), request.as_ref(), &applied);
                RecordedItem::GuardStep(step.tripped(trip))
            }
        })
    }
}

impl Iterator for Recording {
    type Item = Result<RecordedItem, RecordError>;

    fn next(&mut self) -> Option<Self::Item> {
        match self.first.take() {
            Some(first) => Some(Ok(first)),
            None => {
                let next = self.step();
                if next.is_err() {
                    // After an error nothing more is read.
                    self.cut_off("an error ended the reading".to_owned());
                }
                next.transpose()
            }
        }
    }
}
