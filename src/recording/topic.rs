//! The topics of a recording.

use super::cdr::schema;
use super::messages::{ControlStepLine, GuardStepLine, RecorderStatus};
use super::raw_frame::RawFrame;
use crate::signal::{Applied, Command, CycleSample, GuardEvent, Heartbeat, Request, Sensors};

/// How many recent messages of a topic a step may refer to; older ones are written again.
pub(crate) const WINDOW: usize = 64;

/// A topic; the number is its place in [`TOPICS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RecordedTopic {
    Sensors = 0,
    Command = 1,
    Applied = 2,
    Request = 3,
    GuardEvent = 4,
    Heartbeat = 5,
    Cycle = 6,
    Frame = 7,
    ControlStep = 8,
    GuardStep = 9,
    Recorder = 10,
}

/// Name in the file, message, schema.
pub(crate) struct TopicInfo {
    pub(crate) topic: RecordedTopic,
    pub(crate) name: &'static str,
    pub(crate) message: &'static str,
    pub(crate) schema: fn() -> String,
}

macro_rules! topics {
    ($($topic:ident $name:literal $message:ident),* $(,)?) => {
        /// Every topic, in the order of their numbers.
        pub(crate) const TOPICS: [TopicInfo; 11] = [
            $(TopicInfo { topic: RecordedTopic::$topic, name: $name, message: stringify!($message), schema: schema::<$message> }),*
        ];
    };
}
topics!(
    Sensors "/sensors" Sensors,
    Command "/command" Command,
    Applied "/applied" Applied,
    Request "/request" Request,
    GuardEvent "/guard_event" GuardEvent,
    Heartbeat "/heartbeat" Heartbeat,
    Cycle "/cycle" CycleSample,
    Frame "/frame" RawFrame,
    ControlStep "/control_step" ControlStepLine,
    GuardStep "/guard_step" GuardStepLine,
    Recorder "/recorder" RecorderStatus,
);

/// One value for each topic.
#[derive(Debug)]
pub(crate) struct PerTopic<T>([T; TOPICS.len()]);

impl<T> PerTopic<T> {
    pub(crate) fn new(make: impl FnMut(usize) -> T) -> Self {
        Self(std::array::from_fn(make))
    }

    pub(crate) fn of(&mut self, topic: RecordedTopic) -> &mut T {
        // A topic's number is below the array's length, which the test below holds.
        &mut self.0[topic as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_topic_stands_at_its_number() {
        for (place, info) in TOPICS.iter().enumerate() {
            assert_eq!(info.topic as usize, place);
        }
    }
}
