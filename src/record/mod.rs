//! Recordings and logs: write, read, import, `Dataset`.
