//! Memory of long columns. A log of an hour makes and leaves columns of some 30 MB by the hundred; handed out by the kernel in pages of 4 kB
//! each of them costs thousands of faults, a sixth of the whole computation. Here long blocks lie in huge pages (2 MB, where the kernel has
//! them), and grow without being copied. What is let go of waits for the next column of its size (an eighth of the computation on a
//! virtual machine, whose own pages come from its host), or goes back to the kernel where it would make the whole larger than what was in
//! use at some time already. All else is the system's allocator.
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
use std::sync::{Mutex, MutexGuard, PoisonError};

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

/// Most blocks that wait for another use.
const MOST_WAITING: usize = 16;

/// Long blocks, in whole pages [bytes].
struct Blocks {
    /// What is in use, and the most that was.
    in_use: usize,
    most: usize,
    /// Blocks that wait for another use, each its address and its size, and how much they are together.
    waiting: [(usize, usize); MOST_WAITING],
    bytes_waiting: usize,
}

static BLOCKS: Mutex<Blocks> =
    Mutex::new(Blocks { in_use: 0, most: 0, waiting: [(0, 0); MOST_WAITING], bytes_waiting: 0 });

/// Nothing under the lock panics, and the lock itself takes no memory.
fn blocks() -> MutexGuard<'static, Blocks> {
    BLOCKS.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Blocks {
    /// A block of this size that waits, as it was left, is in use again; `None` where there is none.
    fn reuse(&mut self, size: usize) -> Option<*mut u8> {
        let place = self.waiting.iter().position(|(_, waiting)| *waiting == size)?;
        self.in_use += size;
        Some(self.leave(place))
    }

    /// A block that waits is taken out.
    fn leave(&mut self, place: usize) -> *mut u8 {
        let (block, size) = std::mem::take(&mut self.waiting[place]);
        self.bytes_waiting -= size;
        ptr::with_exposed_provenance_mut(block)
    }

    /// So much more is in use, and less waits where all together would be more than ever was.
    fn grow(&mut self, size: usize) {
        self.in_use += size;
        self.most = self.most.max(self.in_use);
        self.let_wait(self.most.saturating_sub(self.in_use));
    }

    /// Gives back to the kernel what waits beyond so much.
    #[allow(unsafe_code, reason = "std maps no memory")]
    fn let_wait(&mut self, most: usize) {
        for place in 0..MOST_WAITING {
            let size = self.waiting[place].1;
            if size > 0 && self.bytes_waiting > most {
                // SAFETY: a block of this size that nobody uses.
                unsafe { unmap(self.leave(place), size) };
            }
        }
    }

    /// A block is no longer in use; whether there is room for it to wait. All together stay what they are.
    fn keep(&mut self, block: *mut u8, size: usize) -> bool {
        self.in_use -= size;
        let Some(place) = self.waiting.iter_mut().find(|(_, waiting)| *waiting == 0) else {
            return false;
        };
        *place = (block.expose_provenance(), size);
        self.bytes_waiting += size;
        true
    }
}

/// Gives back to the kernel what waits for another use: behind a long computation, who goes on would hold it for nothing.
pub fn give_back() {
    let mut blocks = blocks();
    blocks.let_wait(0);
    blocks.most = blocks.in_use;
}

/// A long block with whatever is in it, or with zeros.
#[allow(unsafe_code, reason = "std maps no memory")]
fn long(size: usize, is_zero: bool) -> *mut u8 {
    let Some(pages) = in_pages(size) else { return ptr::null_mut() };
    let reused = blocks().reuse(pages);
    if let Some(block) = reused {
        if is_zero {
            // SAFETY: the block is at least so long, and nobody else's.
            unsafe { ptr::write_bytes(block, 0, size) };
        }
        return block;
    }
    let block = map(size);
    if !block.is_null() {
        blocks().grow(pages);
    }
    block
}

/// Lets go of a long block.
#[allow(unsafe_code, reason = "std maps no memory")]
unsafe fn let_go(block: *mut u8, size: usize) {
    let waits = in_pages(size).is_some_and(|pages| blocks().keep(block, pages));
    if !waits {
        // SAFETY: the caller's block of this size, which nobody uses any more.
        unsafe { unmap(block, size) };
    }
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
    // SAFETY: the caller's block of the size `from`, and a fresh one that is longer; the pages of the one take the place of
    // the other.
    unsafe {
        if wanted < had {
            libc::munmap(block.add(wanted).cast(), had - wanted);
            blocks().in_use -= had - wanted;
            return block;
        }
        let longer = map(to);
        if longer.is_null() {
            return longer;
        }
        let flags = libc::MREMAP_MAYMOVE | libc::MREMAP_FIXED;
        // All of the fresh one is replaced: beside a part of it the block would be two mappings, which kernels before 6.17 do not
        // move together another time.
        let moved = libc::mremap(block.cast(), had, wanted, flags, longer.cast::<c_void>());
        if moved == libc::MAP_FAILED {
            // What was mapped there may be unmapped already, and somebody else's by now: it is left alone, and lost where it is not.
            return ptr::null_mut();
        }
        blocks().grow(wanted - had);
        longer
    }
}

// SAFETY: a block is made, resized and given back by the same of the two allocators, which its size tells; both hand out what nobody
// else has, of the size asked for and aligned to it.
#[allow(unsafe_code, reason = "an allocator is one by an unsafe trait")]
unsafe impl GlobalAlloc for LongBlocks {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        if is_long(layout) { long(layout.size(), false) } else { unsafe { System.alloc(layout) } }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        if is_long(layout) { long(layout.size(), true) } else { unsafe { System.alloc_zeroed(layout) } }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { if is_long(layout) { let_go(block, layout.size()) } else { System.dealloc(block, layout) } }
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

    /// Kernels before 6.17 move one mapping at a time: a block of two, as it is grown here, could not grow again.
    #[test]
    fn a_block_that_has_grown_is_one_mapping() {
        let mut column = vec![1.0_f64; 2 * MANY];
        for times in [4, 8, 16] {
            column.reserve_exact(times * MANY - column.len());
            column.resize(times * MANY, 1.0);
            let start = column.as_ptr().addr();
            let end = start + size_of_val(&column[..]);
            let maps = std::fs::read_to_string("/proc/self/maps").expect("Linux");
            let holds_all = |line: &str| {
                let (range, _) = line.split_once(' ')?;
                let (from, to) = range.split_once('-')?;
                let [from, to] = [from, to].map(|at| usize::from_str_radix(at, 16).expect("an address"));
                (from <= start && end <= to).then_some(())
            };
            assert!(maps.lines().any(|line| holds_all(line).is_some()), "{start:x} to {end:x} in\n{maps}");
        }
    }

    /// Of a size that no other test asks for: what waits is found again, not larger than what was in use, and zero for who asks for zeros.
    #[test]
    fn a_block_that_was_let_go_of_serves_the_next_of_its_size() {
        const CELLS: usize = 37 * MANY;
        let one = vec![1.0_f64; CELLS];
        let at = one.as_ptr();
        drop(one);
        let again = vec![0.0_f64; CELLS];
        assert_eq!(again.as_ptr(), at);
        assert!(again.iter().all(|value| *value == 0.0));
        let other = vec![2.0_f64; CELLS];
        assert_ne!(other.as_ptr(), at);
    }

    /// Counted by itself: other tests have blocks, too.
    #[test]
    fn what_waits_and_what_is_in_use_are_never_more_than_what_was_in_use() {
        let mut counted = Blocks { in_use: 0, most: 0, waiting: [(0, 0); MOST_WAITING], bytes_waiting: 0 };
        // Blocks of their own, which the counted ones give back.
        let take = |counted: &mut Blocks, pages: usize| {
            let block = map(pages * HUGE);
            counted.grow(pages * HUGE);
            block
        };
        let first: Vec<*mut u8> = (0..3).map(|_| take(&mut counted, 4)).collect();
        assert!(first.iter().all(|block| counted.keep(*block, 4 * HUGE)));
        assert_eq!((counted.in_use, counted.bytes_waiting, counted.most), (0, 12 * HUGE, 12 * HUGE));
        assert!(counted.reuse(5 * HUGE).is_none());
        // Another size: what waits makes room for it.
        let other = take(&mut counted, 6);
        assert_eq!((counted.in_use, counted.bytes_waiting, counted.most), (6 * HUGE, 4 * HUGE, 12 * HUGE));
        assert!(counted.reuse(4 * HUGE).is_some_and(|block| counted.keep(block, 4 * HUGE)));
        assert!(counted.keep(other, 6 * HUGE));
        counted.let_wait(0);
        assert_eq!((counted.in_use, counted.bytes_waiting), (0, 0));
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
