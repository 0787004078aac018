//! A disk that is full from the start, once the recording has begun.

use std::io::{self, ErrorKind, Write};

use rotorbench::recording::{Disk, Recorder, RecorderOptions, RecordingMetadata};

/// [byte] what it takes: the head of a recording and a little of a run.
const ROOM: usize = 100_000;

struct FullDisk {
    taken: usize,
}

impl Write for FullDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.taken + bytes.len() > ROOM {
            return Err(ErrorKind::StorageFull.into());
        }
        self.taken += bytes.len();
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Disk for FullDisk {
    fn truncate(&mut self, _: u64) -> io::Result<()> {
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A recorder on it, with a queue that is soon full, too.
pub fn full() -> Recorder {
    let options = RecorderOptions { queue_records: 64, chunk_ms: 1 };
    Recorder::start_on(Box::new(FullDisk { taken: 0 }), &RecordingMetadata::default(), options)
        .expect("room for the head")
}
