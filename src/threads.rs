//! Work on several threads, with the same result whatever their number: items are cut without regard to it, and answers
//! come in the items' order.
//!
//! How many may be used is a property of the work that a thread does, as its wish to end is ([`crate::cancel`]): every core,
//! unless [`limited`] says less. Threads that are started here share what their caller may use.
//!
//! ```
//! use std::num::NonZeroUsize;
//! use rotorbench::threads::{limited, spread};
//!
//! let squares = || spread(&[1, 2, 3], |number| number * number);
//! assert_eq!(squares(), [1, 4, 9]);
//! assert_eq!(limited(NonZeroUsize::new(1), squares), [1, 4, 9]);
//! ```

use std::cell::Cell;
use std::cmp::Reverse;
use std::num::NonZeroUsize;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use crate::cancel::{self, Cancel};

thread_local! {
    /// Threads that the work of this one may keep busy, itself included; `None` = as many as there are cores.
    static MOST: Cell<Option<NonZeroUsize>> = const { Cell::new(None) };
}

/// Does the work on at most so many threads; `None` = on every core.
pub fn limited<T>(most: Option<NonZeroUsize>, work: impl FnOnce() -> T) -> T {
    let _restore = Restore(MOST.replace(most));
    work()
}

/// Puts a thread's limit back, also when the work is left by unwinding.
struct Restore(Option<NonZeroUsize>);

impl Drop for Restore {
    fn drop(&mut self) {
        MOST.set(self.0);
    }
}

/// How many threads the work of this one may keep busy, itself included.
#[must_use]
pub fn most() -> usize {
    MOST.get().or_else(|| thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get)
}

/// Does the work for every item; answers in the items' order. The workers hear of the same wish to end as their caller.
pub fn spread<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let workers = most().min(items.len());
    if workers < 2 {
        let one = |item| {
            cancel::check();
            work(item)
        };
        return items.iter().map(one).collect();
    }
    let next = AtomicUsize::new(0);
    let answers: Mutex<Vec<Option<R>>> = Mutex::new(items.iter().map(|_| None).collect());
    take_turns(workers, &|| {
        let index = next.fetch_add(1, Ordering::Relaxed);
        let Some(item) = items.get(index) else { return false };
        let answer = work(item);
        answers.lock().unwrap_or_else(PoisonError::into_inner)[index] = Some(answer);
        true
    });
    answers.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().flatten().collect()
}

/// The same where some items take much longer than others: those of the greatest `length` are begun first, so that nobody waits for
/// one that was begun last.
pub fn spread_longest_first<T: Sync, R: Send>(
    items: &[T],
    length: impl Fn(&T) -> usize,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let mut order: Vec<usize> = (0..items.len()).collect();
    order.sort_by_cached_key(|at| Reverse(length(&items[*at])));
    let done = spread(&order, |at| work(&items[*at]));
    let mut answers: Vec<(usize, R)> = order.into_iter().zip(done).collect();
    answers.sort_unstable_by_key(|(at, _)| *at);
    answers.into_iter().map(|(_, answer)| answer).collect()
}

/// Has so many workers, this thread one of them, take turns until there are no more. What they do hides behind a pointer: the code
/// that starts threads would else be there once for each kind of work.
fn take_turns(workers: usize, turn: &(dyn Fn() -> bool + Sync)) {
    let (token, share) = (Cancel::current(), NonZeroUsize::new(most() / workers));
    let all_turns = || {
        while {
            cancel::check();
            turn()
        } {}
    };
    thread::scope(|scope| {
        let start = |_| scope.spawn(|| token.during(|| limited(share, all_turns)));
        // To start another thread in this one's place takes as long as a small piece of work.
        let workers: Vec<_> = (1..workers).map(start).collect();
        limited(share, all_turns);
        let left = workers.into_iter().filter_map(|worker| worker.join().err()).collect::<Vec<_>>();
        if let Some(reason) = left.into_iter().next() {
            resume_unwind(reason);
        }
    });
}

/// The same for items that the work uses up.
pub fn spread_out<T: Send, R: Send>(items: Vec<T>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
    let items: Vec<Mutex<Option<T>>> = items.into_iter().map(|item| Mutex::new(Some(item))).collect();
    let done = spread(&items, |item| {
        let item = item.lock().unwrap_or_else(PoisonError::into_inner).take();
        item.map(&work)
    });
    done.into_iter().flatten().collect()
}

/// Does two pieces of work side by side where more than one thread may be used, else one after the other.
pub fn both<A: Send, B>(first: impl FnOnce() -> A + Send, second: impl FnOnce() -> B) -> (A, B) {
    let (mut first, mut second) = (Some(first), Some(second));
    let (mut one, mut other) = (None, None);
    side_by_side(&mut || one = first.take().map(|work| work()), &mut || {
        other = second.take().map(|work| work());
    });
    match (one, other) {
        (Some(one), Some(other)) => (one, other),
        _ => unreachable!("work that was not left by unwinding is done"),
    }
}

/// As [`take_turns`] it is there once.
fn side_by_side(first: &mut (dyn FnMut() + Send), second: &mut dyn FnMut()) {
    let most = most();
    if most < 2 {
        first();
        return second();
    }
    let token = Cancel::current();
    thread::scope(|scope| {
        let first = scope.spawn(|| token.during(|| limited(NonZeroUsize::new(most / 2), first)));
        limited(NonZeroUsize::new(most - most / 2), second);
        if let Err(reason) = first.join() {
            resume_unwind(reason);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_inside_work_shares_the_threads() {
        let inside = || spread(&[(), ()], |()| most());
        assert_eq!(limited(NonZeroUsize::new(5), inside), [2, 2]);
        assert_eq!(limited(NonZeroUsize::new(1), inside), [1, 1]);
        assert_eq!(limited(NonZeroUsize::new(3), || both(most, most)), (1, 2));
        assert_eq!(limited(NonZeroUsize::new(7), most), 7);
    }

    #[test]
    fn answers_come_in_the_items_order() {
        let items: Vec<String> = (0..100).map(|number| number.to_string()).collect();
        let done = limited(NonZeroUsize::new(4), || spread_out(items.clone(), |item| item));
        assert_eq!(done, items);
    }

    #[test]
    fn the_longest_is_begun_first_and_answers_in_its_place() {
        let begun = Mutex::new(Vec::new());
        let work = |item: &usize| {
            begun.lock().expect("nobody panics").push(*item);
            10 * item
        };
        let done = limited(NonZeroUsize::new(1), || spread_longest_first(&[2, 7, 1, 7], |item| *item, work));
        assert_eq!(
            (done, begun.into_inner().expect("nobody panics")),
            (vec![20, 70, 10, 70], vec![7, 7, 2, 1])
        );
    }

    #[test]
    fn a_wish_to_end_reaches_every_worker() {
        let cancel = Cancel::default();
        cancel.request();
        let work = || both(|| spread(&[1, 2], |_| ()), || spread(&[1, 2], |_| ()));
        assert_eq!(cancel.run(|| limited(NonZeroUsize::new(4), work)), Err(cancel::Cancelled));
    }
}
