//! What iceoryx2 gives back in shared memory when it is dropped.

use std::mem::ManuallyDrop;
use std::ops::{Deref, DerefMut};

use crate::rt;

/// A port, an entry or a node: dropped as anything else, and left as it is where the memory it would be given back in was
/// taken away. iceoryx2 would find its own lists broken there, and panic.
pub(super) struct Kept<T>(ManuallyDrop<T>);

impl<T> Kept<T> {
    pub fn new(value: T) -> Self {
        Self(ManuallyDrop::new(value))
    }
}

impl<T> Deref for Kept<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T> DerefMut for Kept<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

impl<T> Drop for Kept<T> {
    #[allow(unsafe_code, reason = "what is kept is dropped, or left, at the end")]
    fn drop(&mut self) {
        if !rt::memory_is_lost() {
            // SAFETY: dropped once, here, and not used again.
            unsafe { ManuallyDrop::drop(&mut self.0) }
        }
    }
}
