//! The iceoryx2 services of a bench, their names, heartbeats.
//!
//! A process [`joins`](BenchMember::join) a bench in a [`ProcessRole`], publishes topics and subscribes to topics:
//!
//! ```no_run
//! use rotorbench::shm::{BenchMember, ProcessRole, SENSORS, SharedMemoryConfig};
//!
//! let bench = BenchMember::join("bench", &SharedMemoryConfig::default(), ProcessRole::Monitor)?;
//! let mut sensors = bench.subscribe(&SENSORS)?;
//! if let Some(newest) = sensors.newest() {
//!     println!("{:.3} rad/s", newest.body_rate.value);
//! }
//! # Ok::<(), rotorbench::shm::ShmError>(())
//! ```
//!
//! Each topic has one publisher at a time, any number of subscribers, and no history before their coming. A publisher
//! or subscriber may be killed and started again at any time: the others go on, and meet it again by themselves.

mod bell;
mod claim;
mod error;
mod kept;
mod leftover;
mod place;
mod ring;
pub mod thresholds;
mod topic;
mod watch_thread;

use std::sync::Arc;

use crossbeam::queue::ArrayQueue;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::prelude::{LogLevel, SignalHandlingMode, ipc_threadsafe, set_log_level};

pub use bell::{Bell, Waiter};
pub use error::ShmError;
pub use leftover::{
    Leftover, PassingBench, guard_without_place, is_guarded, leftovers, running, running_places,
};
pub use place::{BenchPlace, SharedMemoryConfig, effective_user};
pub use ring::{Publisher, Subscriber};
pub use topic::{
    APPLIED, BUS, COMMAND, CONTROL_STEPS, GUARD_EVENTS, GUARD_STEPS, LOCKSTEP_ANSWERS, LOCKSTEP_STEPS,
    ProcessRole, REQUEST, SENSORS, STOPS, Shareable, Topic,
};

/// This process's membership of a bench.
pub struct BenchMember {
    place: BenchPlace,
    role: ProcessRole,
    // Before the node, so that its thread has ended when the node goes.
    watch_thread: watch_thread::WatchThread,
    node: kept::Kept<Arc<Node<ipc_threadsafe::Service>>>,
}

impl std::fmt::Debug for BenchMember {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("BenchMember")
            .field("place", &self.place)
            .field("role", &self.role)
            .finish_non_exhaustive()
    }
}

impl BenchMember {
    /// Joins the bench called `bench`. Removes what killed processes left behind.
    ///
    /// # Errors
    /// A place that is not ours; iceoryx2's refusals.
    pub fn join(bench: &str, config: &SharedMemoryConfig, role: ProcessRole) -> Result<Self, ShmError> {
        Self::join_at(BenchPlace::open(bench, config)?, role)
    }

    /// The same of a bench that is there, one of [`running_places`].
    ///
    /// # Errors
    /// As [`BenchMember::join`].
    pub fn join_at(place: BenchPlace, role: ProcessRole) -> Result<Self, ShmError> {
        // Its messages are formatted where they happen; in a cycle that would allocate. Errors come back as values.
        set_log_level(LogLevel::Fatal);
        crate::rt::survive_lost_memory()
            .map_err(|error| ShmError::Place { path: place.directory().to_owned(), error })?;
        let node = NodeBuilder::new()
            .config(&place.iceoryx()?)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc_threadsafe::Service>()
            .map_err(|error| ShmError::Service { topic: "node".to_owned(), what: error.to_string() })?;
        place.set_access()?;
        let node = Arc::new(node);
        let watch_thread = watch_thread::WatchThread::start(Arc::clone(&node), place.clone())?;
        Ok(Self { place, role, watch_thread, node: kept::Kept::new(node) })
    }

    /// Where the bench lives.
    #[must_use]
    pub fn place(&self) -> &BenchPlace {
        &self.place
    }

    /// In which role this process joined.
    #[must_use]
    pub fn role(&self) -> ProcessRole {
        self.role
    }

    /// Becomes the publisher of `topic`.
    ///
    /// # Errors
    /// [`ShmError::Claimed`] when the topic has one; iceoryx2's refusals.
    pub fn publish<T: Shareable>(&self, topic: &Topic<T>) -> Result<Publisher<T>, ShmError> {
        Publisher::create(&self.node, &self.place, topic, self.role)
    }

    /// Reads `topic`, from its publisher if there is one and from every later one.
    ///
    /// # Errors
    /// None today; a topic without a publisher is not an error.
    pub fn subscribe<T: Shareable>(&self, topic: &Topic<T>) -> Result<Subscriber<T>, ShmError> {
        let claimant = claim::read(&self.place, topic.name());
        let opened = claimant.and_then(|it| {
            ring::Incarnation::open(&self.node, topic, &it.incarnation)
                .ok()
                .map(|incarnation| (incarnation, it.incarnation))
        });
        let (incarnation, name) = opened.unzip();
        let (arriving, leaving) = (Arc::new(ArrayQueue::new(2)), Arc::new(ArrayQueue::new(8)));
        self.watch_thread.add(Box::new(watch_thread::TopicWatch {
            topic: topic.clone(),
            incarnation: name,
            arriving: Arc::clone(&arriving),
            leaving: Arc::clone(&leaving),
        }));
        Ok(Subscriber::new(incarnation, arriving, leaving))
    }

    /// The bell of `waiter`.
    ///
    /// # Errors
    /// The operating system's, with the path.
    pub fn bell(&self, waiter: Waiter) -> Result<Bell, ShmError> {
        Bell::open(&self.place, waiter)
    }
}
