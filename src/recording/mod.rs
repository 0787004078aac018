//! Recordings of a bench: written while it runs, read as they were. (As logs, with others, `log` reads them.)
//!
//! A recording is an MCAP file. Its topics are `/sensors`, `/command`, `/applied`, `/request`, `/guard_event`,
//! `/heartbeat`, `/cycle`, `/frame`, and `/control_step` and `/guard_step`, which say what each step consumed and
//! answered by naming messages of the other topics; `/recorder` counts what was written and what was lost. Messages
//! are CDR with `ros2msg` schemas. One metadata record, `rotorbench`, holds the bench file, the model, DBC files,
//! seeds and versions: all that is needed to run it again.

use std::io;
use std::path::PathBuf;

mod messages;

mod cdr;
mod metadata;
mod patient_disk;
pub(crate) mod raw_frame;
pub(crate) mod reader;
pub(crate) mod sender;
mod sensors;
mod sink;
pub mod thresholds;
mod topic;
mod writer;

pub use cdr::{CdrError, Difference, encode, first_difference};
pub use messages::RecorderStatus;
pub use metadata::{METADATA_NAME, RecordingMetadata};
pub use patient_disk::Disk;
pub use raw_frame::{FrameFlags, RawFrame};
pub use reader::{End, Recording};
pub use sender::{RecordSender, RecordedItem};
pub use sensors::encode_given;
pub use writer::{Recorder, RecorderOptions, RecorderSummary};

/// Why a recording cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file to record into cannot be made, or is there already.
    #[error("{}{path}", if source.kind() == io::ErrorKind::AlreadyExists { "no recording is overwritten: " } else { "" })]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The disk failed while recording.
    #[error("the recording cannot be written")]
    Write(#[from] mcap::McapError),
    /// The file cannot be opened or read.
    #[error("recording {path}")]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is no recording of ours.
    #[error("{path}: not a recording: {reason}; one is made by `record`, or by `--record` of `run` (MCAP)")]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What is missing or wrong.
        reason: String,
    },
    /// A whole, undamaged chunk holds a message that cannot be understood.
    #[error("{path}, byte {byte}, topic {topic}, message {ordinal}: {reason}")]
    Message {
        /// The file.
        path: PathBuf,
        /// Place in the file up to which was read.
        byte: u64,
        /// Name of the topic.
        topic: String,
        /// Ordinal of the message in its topic, from 1.
        ordinal: u64,
        /// What is wrong.
        reason: String,
    },
    /// A metadata value is not a number.
    #[error("metadata `{key}` reads `{value}`, which is not a whole number")]
    Metadata {
        /// The key.
        key: String,
        /// What is there.
        value: String,
    },
}
