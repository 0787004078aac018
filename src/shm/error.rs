//! What can go wrong with the shared memory of a bench.

use std::path::PathBuf;

/// What can go wrong with the shared memory of a bench.
#[derive(Debug, thiserror::Error)]
pub enum ShmError {
    /// The name of the bench cannot be a file name.
    #[error("`{bench}` cannot name a bench: 1 to 32 letters, digits, `-` or `_`")]
    Name {
        /// The name.
        bench: String,
    },
    /// The group of the bench does not exist.
    #[error("there is no Unix group `{name}` (shared_memory.group)")]
    Group {
        /// The name.
        name: String,
    },
    /// A file or directory of the bench could not be used.
    #[error("{}: {error}", path.display())]
    Place {
        /// Where.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// Somebody else's file or directory is where the bench's should be, or the bench's is open to others.
    #[error("{} belongs to user {user} with mode {mode:o}: not ours, or open to others; not used", path.display())]
    NotOurs {
        /// Where.
        path: PathBuf,
        /// Its owner's number.
        user: u32,
        /// Its permission bits.
        mode: u32,
    },
    /// The topic has a publisher.
    #[error("bench `{bench}` is taken: `{topic}` is published by {role} (process {process_id})")]
    Claimed {
        /// Name of the bench.
        bench: String,
        /// Name of the topic.
        topic: String,
        /// Role of the holder.
        role: String,
        /// Its process, 0 when it is not known.
        process_id: u32,
    },
    /// iceoryx2 refused.
    #[error("shared-memory service `{topic}`: {what}")]
    Service {
        /// Name of the topic, or `node`.
        topic: String,
        /// What iceoryx2 says.
        what: String,
    },
}
