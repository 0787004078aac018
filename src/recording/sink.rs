//! The MCAP file under construction. Chunks are built in memory and written whole, front to back: a file that was cut off can
//! be read up to the last whole chunk.

use std::collections::{BTreeMap, VecDeque};
use std::io::{BufWriter, Write};
use std::sync::{Arc, Mutex, PoisonError};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;

use super::RecordError;
use super::cdr::{CdrMessage, encode};
use super::messages::{ControlStepLine, GuardStepLine};
use super::metadata::{METADATA_NAME, RecordingMetadata};
use super::patient_disk::PatientDisk;
use super::sender::RecordedItem;
use super::topic::{PerTopic, RecordedTopic, TOPICS, WINDOW};

/// The MCAP file under construction.
pub(crate) struct Sink {
    mcap: mcap::Writer<NoSeek<BufWriter<SharedDisk>>>,
    disk: SharedDisk,
    metadata: RecordingMetadata,
    topics: PerTopic<TopicState>,
    bytes: Vec<u8>,
}

/// What the writer knows of one topic.
#[derive(Debug, Default)]
struct TopicState {
    channel: u16,
    /// Messages written.
    count: u64,
    /// The last messages, with their ordinals, if steps refer to them.
    recent: VecDeque<(u64, Vec<u8>)>,
}

/// The disk, reachable also behind the MCAP writer, which owns its output.
#[derive(Clone)]
struct SharedDisk(Arc<Mutex<PatientDisk>>);

impl SharedDisk {
    fn with<T>(&self, act: impl FnOnce(&mut PatientDisk) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Write for SharedDisk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.with(|disk| disk.write(bytes))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.with(PatientDisk::flush)
    }
}

impl Sink {
    pub(crate) fn create(disk: PatientDisk, metadata: RecordingMetadata) -> Result<Self, RecordError> {
        let disk = SharedDisk(Arc::new(Mutex::new(disk)));
        let mut mcap = mcap::WriteOptions::new()
            .compression(None)
            .profile("ros2")
            .library(concat!("rotorbench ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(4 << 20))
            // Chunks are built in memory and written once, whole: a seeking writer would leave a chunk
            // without a length behind when killed.
            .disable_seeking(true)
            .create(NoSeek::new(BufWriter::with_capacity(1 << 16, disk.clone())))?;
        mcap.write_metadata(&Metadata { name: METADATA_NAME.to_owned(), metadata: metadata.to_metadata() })?;
        let mut topics = PerTopic::new(|_| TopicState::default());
        for info in &TOPICS {
            let name = format!("rotorbench/msg/{}", info.message);
            let schema = mcap.add_schema(&name, "ros2msg", (info.schema)().as_bytes())?;
            topics.of(info.topic).channel = mcap.add_channel(schema, info.name, "cdr", &BTreeMap::new())?;
        }
        let mut sink = Self { mcap, disk, metadata, topics, bytes: Vec::new() };
        sink.flush()?;
        Ok(sink)
    }

    pub(crate) fn write(&mut self, record: &RecordedItem) -> Result<(), RecordError> {
        let stamp = record.stamp_ns();
        match record {
            RecordedItem::Sensors(it) => self.refer(RecordedTopic::Sensors, stamp, it).map(drop),
            RecordedItem::Command(it) => self.refer(RecordedTopic::Command, stamp, it).map(drop),
            RecordedItem::Applied(it) => self.refer(RecordedTopic::Applied, stamp, it).map(drop),
            RecordedItem::Request(it) => self.refer(RecordedTopic::Request, stamp, it).map(drop),
            RecordedItem::GuardEvent(it) => self.append(RecordedTopic::GuardEvent, stamp, it),
            RecordedItem::Heartbeat(it) => self.append(RecordedTopic::Heartbeat, stamp, it),
            RecordedItem::Cycle(it) => self.append(RecordedTopic::Cycle, stamp, it),
            RecordedItem::Frame(it) => self.append(RecordedTopic::Frame, stamp, it),
            RecordedItem::Status(it) => self.append(RecordedTopic::Recorder, stamp, it),
            RecordedItem::ControlStep(it) => {
                let line = ControlStepLine {
                    sensors: self.refer(RecordedTopic::Sensors, it.sensors.stamp_ns, &it.sensors)?,
                    applied: self.refer(RecordedTopic::Applied, it.applied.stamp_ns, &it.applied)?,
                    command: self.refer(RecordedTopic::Command, it.command.stamp_ns, &it.command)?,
                };
                self.append(RecordedTopic::ControlStep, stamp, &line)
            }
            RecordedItem::GuardStep(it) => {
                let mut line = GuardStepLine {
                    now_ns: it.now_ns,
                    trip_ns: it.trip_ns,
                    trip_cause: it.trip_cause,
                    sensors: self.refer(RecordedTopic::Sensors, it.sensors.stamp_ns, &it.sensors)?,
                    ..GuardStepLine::default()
                };
                if let Some(newest) = it.newest() {
                    line.newest = self.refer(RecordedTopic::Command, newest.stamp_ns, newest)?;
                }
                if let Some(request) = it.request() {
                    line.request = self.refer(RecordedTopic::Request, request.stamp_ns, request)?;
                }
                line.applied = self.refer(RecordedTopic::Applied, it.applied.stamp_ns, &it.applied)?;
                self.append(RecordedTopic::GuardStep, stamp, &line)
            }
        }
    }

    fn append<N: CdrMessage>(
        &mut self,
        topic: RecordedTopic,
        stamp_ns: u64,
        message: &N,
    ) -> Result<(), RecordError> {
        encode(message, &mut self.bytes);
        self.put(topic, stamp_ns).map(drop)
    }

    /// The ordinal of `message` in its topic: of the recent message with the same bytes, else of a new one. The same
    /// value reaches the recorder by several ways (published, consumed by a step) and is written once.
    fn refer<N: CdrMessage>(
        &mut self,
        topic: RecordedTopic,
        stamp_ns: u64,
        message: &N,
    ) -> Result<u64, RecordError> {
        encode(message, &mut self.bytes);
        let known = self.topics.of(topic).recent.iter().rev().find(|(_, bytes)| *bytes == self.bytes);
        if let Some((ordinal, _)) = known {
            return Ok(*ordinal);
        }
        let ordinal = self.put(topic, stamp_ns)?;
        let recent = &mut self.topics.of(topic).recent;
        // The oldest message's buffer becomes the newest's: memory stays flat.
        let oldest = if recent.len() == WINDOW { recent.pop_front() } else { None };
        let mut bytes = oldest.map_or_else(Vec::new, |(_, bytes)| bytes);
        bytes.clone_from(&self.bytes);
        recent.push_back((ordinal, bytes));
        Ok(ordinal)
    }

    fn put(&mut self, topic: RecordedTopic, stamp_ns: u64) -> Result<u64, RecordError> {
        let state = self.topics.of(topic);
        state.count += 1;
        let ordinal = state.count;
        let time = self.metadata.wall_ns(stamp_ns);
        let header = MessageHeader {
            channel_id: state.channel,
            // MCAP keeps 32 bits of it; they wrap.
            sequence: ordinal as u32,
            log_time: time,
            publish_time: time,
        };
        self.mcap.write_to_known_channel(&header, &self.bytes)?;
        Ok(ordinal)
    }

    pub(crate) fn flush(&mut self) -> Result<(), RecordError> {
        self.mcap.flush()?;
        self.disk.with(PatientDisk::mark_whole);
        Ok(())
    }

    pub(crate) fn finish(mut self) -> Result<(), RecordError> {
        self.flush()?;
        self.mcap.finish()?;
        let output = self.mcap.into_inner().into_inner();
        let closed = output.into_inner().map_err(std::io::IntoInnerError::into_error);
        Ok(closed.and_then(|disk| disk.with(PatientDisk::sync)).map_err(mcap::McapError::from)?)
    }
}
