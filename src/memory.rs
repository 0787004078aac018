//! Memory of long columns. A log of an hour makes and leaves columns of some 30 MB by the hundred; handed out by the kernel in pages of 4 kB
//! each of them costs thousands of faults, a sixth of the whole computation. Here long blocks lie in huge pages (2 MB, where the kernel has
//! them), grow without being copied, and go back to the kernel as soon as they are let go of. All else is the system's allocator.
//!
//! The program uses it, and so do tests of memory:
//!
//! ```
//! #[global_allocator]
//! static MEMORY: rotorbench::memory::LongBlocks = rotorbench::memory::LongBlocks;
//! # fn main() {}
//! ```

use std::alloc::{GlobalAlloc, Layout, System};
use std::ptr;

use libc::c_void;

/// [bytes] of a huge page; a multiple of every other page.
const HUGE: usize = 2 << 20;
/// [bytes] from which on a block has pages of its own: its last page is half empty on average, which is a quarter of it at most.
const LONG: usize = 2 * HUGE;

/// The allocator.
#[derive(Debug, Clone, Copy)]
pub struct LongBlocks;

fn is_long(layout: Layout) -> bool {
    layout.size() >= LONG && layout.align() <= HUGE
}

/// [bytes] in whole pages.
fn in_pages(size: usize) -> Option<usize> {
    size.checked_next_multiple_of(HUGE)
}

/// Fresh pages, all zero; null where there are none.
#[allow(unsafe_code, reason = "std maps no memory")]
fn map(size: usize) -> *mut u8 {
    let Some((size, with_room)) = in_pages(size).and_then(|size| Some((size, size.checked_add(HUGE)?)))
    else {
        return ptr::null_mut();
    };
    // SAFETY: the mapping is a fresh one that nobody else has; what is given back of it lies in it, before and behind the block.
    unsafe {
        let (rights, flags) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
        let all = libc::mmap(ptr::null_mut(), with_room, rights, flags, -1, 0);
        if all == libc::MAP_FAILED {
            return ptr::null_mut();
        }
        let all = all.cast::<u8>();
        let before = all.align_offset(HUGE).min(HUGE);
        if before > 0 {
            libc::munmap(all.cast(), before);
        }
        let block = all.add(before);
        if before < HUGE {
            libc::munmap(block.add(size).cast(), HUGE - before);
        }
        // A kernel without huge pages says no, and gives small ones.
        libc::madvise(block.cast(), size, libc::MADV_HUGEPAGE);
        block
    }
}

/// Gives the pages back of a block that [`map`] made.
#[allow(unsafe_code, reason = "std maps no memory")]
unsafe fn unmap(block: *mut u8, size: usize) {
    if let Some(size) = in_pages(size) {
        // SAFETY: the caller's block of this size, which nobody uses any more.
        unsafe { libc::munmap(block.cast(), size) };
    }
}

/// A block of another size with the same content: pages are moved, not copied.
#[allow(unsafe_code, reason = "std maps no memory")]
unsafe fn resize(block: *mut u8, from: usize, to: usize) -> *mut u8 {
    let (Some(had), Some(wanted)) = (in_pages(from), in_pages(to)) else { return ptr::null_mut() };
    if wanted == had {
        return block;
    }
    // SAFETY: the caller's block of the size `from`, and a fresh one that is longer; the pages of the one take the place of the
    // beginning of the other.
    unsafe {
        if wanted < had {
            libc::munmap(block.add(wanted).cast(), had - wanted);
            return block;
        }
        let longer = map(to);
        if longer.is_null() {
            return longer;
        }
        let flags = libc::MREMAP_MAYMOVE | libc::MREMAP_FIXED;
        let moved = libc::mremap(block.cast(), had, had, flags, longer.cast::<c_void>());
        if moved == libc::MAP_FAILED {
            // Its beginning may be unmapped already, and somebody else's by now.
            libc::munmap(longer.add(had).cast(), wanted - had);
            return ptr::null_mut();
        }
        longer
    }
}

// SAFETY: a block is made, resized and given back by the same of the two allocators, which its size tells; both hand out what nobody
// else has, of the size asked for and aligned to it.
#[allow(unsafe_code, reason = "an allocator is one by an unsafe trait")]
unsafe impl GlobalAlloc for LongBlocks {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        if is_long(layout) { map(layout.size()) } else { unsafe { System.alloc(layout) } }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        if is_long(layout) { map(layout.size()) } else { unsafe { System.alloc_zeroed(layout) } }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { if is_long(layout) { unmap(block, layout.size()) } else { System.dealloc(block, layout) } }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as the caller promises; the size fits a layout of the same alignment.
        unsafe {
            let wanted = Layout::from_size_align_unchecked(size, layout.align());
            match (is_long(layout), is_long(wanted)) {
                (true, true) => resize(block, layout.size(), size),
                (false, false) => System.realloc(block, layout, size),
                _ => {
                    let other = self.alloc(wanted);
                    if !other.is_null() {
                        ptr::copy_nonoverlapping(block, other, size.min(layout.size()));
                        self.dealloc(block, layout);
                    }
                    other
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells that make a block a long one.
    const MANY: usize = LONG / size_of::<f64>();

    /// From a short block over long ones to a longer one than there was, and back: what was written stays, and what is
    /// new is zero.
    #[test]
    fn blocks_keep_what_is_in_them_however_they_grow_and_shrink() {
        let mut column: Vec<f64> = Vec::new();
        for length in [10, MANY - 1, MANY, 3 * MANY + 5, 9 * MANY, 9 * MANY + 1] {
            column.reserve_exact(length - column.len());
            (column.len()..length).for_each(|row| column.push(row as f64));
            assert!(column.iter().enumerate().all(|(row, value)| *value == row as f64), "{length}");
        }
        for length in [8 * MANY, 2 * MANY + 1, MANY - 7, 3] {
            column.truncate(length);
            column.shrink_to_fit();
            assert!(column.iter().enumerate().all(|(row, value)| *value == row as f64), "{length}");
        }
        assert!(vec![0.0_f64; 5 * MANY].iter().all(|value| *value == 0.0));
    }

    #[test]
    fn long_blocks_begin_with_a_huge_page_and_do_not_overlap() {
        let blocks: Vec<Vec<u8>> = (0..5).map(|number| vec![number; LONG + usize::from(number)]).collect();
        assert!(blocks.iter().all(|block| block.as_ptr().align_offset(HUGE) == 0));
        assert!(blocks.iter().zip(0..).all(|(block, number)| block.iter().all(|byte| *byte == number)));
    }

    #[test]
    fn what_no_memory_holds_is_refused() {
        let mut bytes: Vec<u8> = vec![1; LONG];
        assert!(bytes.try_reserve(1 << 60).is_err());
        assert_eq!((bytes.len(), bytes.last()), (LONG, Some(&1)));
    }
}
