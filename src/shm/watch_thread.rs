//! The thread that lets a process rejoin: it waits for changes of the claims, opens the new incarnation of a topic and
//! hands it to its subscriber. The cycles themselves never open, close or allocate anything.

use std::ffi::CString;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use crossbeam::queue::ArrayQueue;
use iceoryx2::node::Node;
use iceoryx2::prelude::ipc_threadsafe;

use super::claim;
use super::ring::Incarnation;
use super::{BenchPlace, Shareable, ShmError, Topic};

/// [ms] how often to look when nothing is announced: bounds what a missed change can cost.
const LOOK_PERIOD_MS: i32 = 250;

/// One subscription, seen from the watch thread.
pub(super) trait Watch: Send {
    fn look(&mut self, node: &Node<ipc_threadsafe::Service>, place: &BenchPlace);
}

pub(super) struct TopicWatch<T: Shareable> {
    pub topic: Topic<T>,
    /// Incarnation the subscriber has, or the last one that could not be opened for good.
    pub incarnation: Option<String>,
    pub arriving: Arc<ArrayQueue<Incarnation<T>>>,
    pub leaving: Arc<ArrayQueue<Incarnation<T>>>,
}

impl<T: Shareable> Watch for TopicWatch<T> {
    fn look(&mut self, node: &Node<ipc_threadsafe::Service>, place: &BenchPlace) {
        while self.leaving.pop().is_some() {}
        let Some(claimant) = claim::read(place, self.topic.name()) else { return };
        if self.incarnation.as_ref() == Some(&claimant.incarnation) {
            return;
        }
        // Failing to open is usual: a incarnation that ended, or one just being made. The next look tries again.
        if let Ok(incarnation) = Incarnation::open(node, &self.topic, &claimant.incarnation) {
            self.incarnation = Some(claimant.incarnation);
            self.arriving.force_push(incarnation);
        }
    }
}

/// The thread, for as long as the bench is joined.
pub(super) struct WatchThread {
    stop: Arc<AtomicBool>,
    watches: Arc<Mutex<Vec<Box<dyn Watch>>>>,
    wake: OwnedFd,
    thread: Option<JoinHandle<()>>,
}

impl WatchThread {
    #[allow(unsafe_code, reason = "std has no eventfd")]
    pub fn start(node: Arc<Node<ipc_threadsafe::Service>>, place: BenchPlace) -> Result<Self, ShmError> {
        let directory = claim::claims_directory(&place);
        let at = |error| ShmError::Place { path: directory.clone(), error };
        let changes = watch_directory(&directory).map_err(at)?;
        // SAFETY: eventfd has no pointer arguments; a valid descriptor is owned by nobody else.
        let wake = owned(unsafe { libc::eventfd(0, libc::EFD_CLOEXEC | libc::EFD_NONBLOCK) }).map_err(at)?;
        let wake_in_thread = wake.try_clone().map_err(at)?;
        let stop = Arc::new(AtomicBool::new(false));
        let watches: Arc<Mutex<Vec<Box<dyn Watch>>>> = Arc::default();
        let thread = std::thread::Builder::new()
            .name("watch".to_owned())
            .spawn({
                let (stop, watches) = (Arc::clone(&stop), Arc::clone(&watches));
                move || {
                    while !stop.load(Ordering::Relaxed) {
                        wait(&changes, &wake_in_thread);
                        if let Ok(mut watches) = watches.lock() {
                            watches.iter_mut().for_each(|watch| watch.look(&node, &place));
                        }
                    }
                }
            })
            .map_err(at)?;
        Ok(Self { stop, watches, wake, thread: Some(thread) })
    }

    pub fn add(&self, watch: Box<dyn Watch>) {
        if let Ok(mut watches) = self.watches.lock() {
            watches.push(watch);
        }
    }
}

impl Drop for WatchThread {
    #[allow(unsafe_code, reason = "a descriptor without a type of std is written to")]
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let one = 1_u64.to_ne_bytes();
        // SAFETY: the descriptor is open and `one` is 8 readable bytes.
        unsafe { libc::write(self.wake.as_raw_fd(), one.as_ptr().cast(), one.len()) };
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[allow(unsafe_code, reason = "a descriptor that a system call made gets its owner")]
fn owned(descriptor: i32) -> std::io::Result<OwnedFd> {
    if descriptor < 0 {
        return Err(std::io::Error::last_os_error());
    }
    // SAFETY: the system call just opened it for us.
    Ok(unsafe { OwnedFd::from_raw_fd(descriptor) })
}

#[allow(unsafe_code, reason = "std has no inotify")]
fn watch_directory(directory: &std::path::Path) -> std::io::Result<OwnedFd> {
    // SAFETY: no pointer arguments.
    let changes = owned(unsafe { libc::inotify_init1(libc::IN_CLOEXEC | libc::IN_NONBLOCK) })?;
    let path = CString::new(directory.as_os_str().as_bytes())?;
    // SAFETY: the descriptor is open and `path` ends with a zero byte.
    let code = unsafe { libc::inotify_add_watch(changes.as_raw_fd(), path.as_ptr(), libc::IN_MODIFY) };
    if code < 0 { Err(std::io::Error::last_os_error()) } else { Ok(changes) }
}

/// Waits for a change, for the end, or for [`LOOK_PERIOD_MS`]; leaves nothing unread.
#[allow(unsafe_code, reason = "std has no poll")]
fn wait(changes: &OwnedFd, wake: &OwnedFd) {
    let mut descriptors = [changes, wake].map(|descriptor| libc::pollfd {
        fd: descriptor.as_raw_fd(),
        events: libc::POLLIN,
        revents: 0,
    });
    // SAFETY: `descriptors` holds as many entries as said.
    unsafe { libc::poll(descriptors.as_mut_ptr(), descriptors.len() as libc::nfds_t, LOOK_PERIOD_MS) };
    let mut text = [0_u8; 4096];
    // SAFETY: `text` is as long as said; the descriptor does not block.
    while unsafe { libc::read(changes.as_raw_fd(), text.as_mut_ptr().cast(), text.len()) } > 0 {}
}
