//! What runs period by period: controllers, guard and loop, on time that the test sets, and what a process asks of the
//! kernel first. One program, with an allocator that counts per thread.

#[path = "allocation.rs"]
mod allocation;
#[path = "bus_guard.rs"]
mod bus_guard;
#[path = "control/main.rs"]
mod control;
#[path = "processes/counting.rs"]
mod counting;
#[path = "loop.rs"]
mod lockstep;
#[path = "real_time.rs"]
mod real_time;
