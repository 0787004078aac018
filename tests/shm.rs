//! The shared memory of a bench, between threads and processes.

use std::time::{Duration, Instant};

use rotorbench::shm::{Bench, COMMAND, Role, SENSORS, SharedMemoryConfig, ShmError, Waiter};
use rotorbench::signal::{Command, Sensors};

/// A bench of its own for each test, so that tests of one machine never meet.
fn name(test: &str) -> String {
    format!("t{}-{test}", std::process::id())
}

fn join(name: &str, role: Role) -> Bench {
    Bench::join(name, &SharedMemoryConfig::default(), role).expect("the bench can be joined")
}

/// Waits for what another thread or process will do; the limit only ends a test that hangs.
fn eventually<T>(mut ready: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(value) = ready() {
            return value;
        }
        assert!(start.elapsed() < Duration::from_secs(20), "it never happened");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn sensors(sequence: u64) -> Sensors {
    Sensors { sequence, ..Sensors::default() }
}

#[test]
fn every_value_arrives_in_order_and_the_newest_at_once() {
    let name = name("order");
    let (there, here) = (join(&name, Role::Emulate), join(&name, Role::Control));
    let mut publisher = there.publish(&SENSORS).expect("first publisher");
    let mut all = here.subscribe(&SENSORS).expect("subscribed");
    let mut newest = here.subscribe(&SENSORS).expect("subscribed");
    assert!(all.next_in_order().is_none() && newest.newest().is_none());
    for sequence in 1..=700 {
        publisher.send(&sensors(sequence));
    }
    assert_eq!(newest.newest().map(|it| it.sequence), Some(700));
    assert!(newest.newest().is_none(), "the newest value is given once");
    let read: Vec<u64> = std::iter::from_fn(|| all.next_in_order()).map(|it| it.sequence).collect();
    assert_eq!(read, (1..=700).collect::<Vec<_>>());
    assert_eq!(all.lost(), 0);
}

#[test]
fn a_reader_that_is_overtaken_counts_what_it_lost() {
    let name = name("overtaken");
    let bench = join(&name, Role::Emulate);
    let mut publisher = bench.publish(&SENSORS).expect("first publisher");
    let mut reader = bench.subscribe(&SENSORS).expect("subscribed");
    for sequence in 1..=5_000 {
        publisher.send(&sensors(sequence));
    }
    let read: Vec<u64> = std::iter::from_fn(|| reader.next_in_order()).map(|it| it.sequence).collect();
    assert_eq!(read.len() as u64 + reader.lost(), 5_000);
    assert!(read.windows(2).all(|pair| pair[0] + 1 == pair[1]), "no hole after the loss");
    assert_eq!(read.last(), Some(&5_000));
}

#[test]
fn who_comes_late_starts_with_the_newest() {
    let name = name("late");
    let bench = join(&name, Role::Emulate);
    let mut publisher = bench.publish(&SENSORS).expect("first publisher");
    for sequence in 1..=10 {
        publisher.send(&sensors(sequence));
    }
    let mut late = join(&name, Role::Record).subscribe(&SENSORS).expect("subscribed");
    assert_eq!(late.next_in_order().map(|it| it.sequence), Some(10));
    assert!(late.next_in_order().is_none());
}

#[test]
fn a_second_publisher_is_refused_and_a_second_life_is_met() {
    let name = name("lives");
    let reader = join(&name, Role::Emulate);
    let mut commands = reader.subscribe(&COMMAND).expect("subscribed");
    for life in 1..=3 {
        let controller = join(&name, Role::Control);
        let mut publisher = controller.publish(&COMMAND).expect("the only publisher");
        let refused = join(&name, Role::Control).publish(&COMMAND).expect_err("there is one");
        let sentence = refused.to_string();
        assert!(matches!(refused, ShmError::Claimed { process_id, .. } if process_id == std::process::id()));
        assert!(sentence.contains("`command` is published by control"), "{sentence}");
        for sequence in 1..=3 {
            publisher.send(&Command { sequence, torque: f64::from(life), ..Command::default() });
        }
        for sequence in 1..=3 {
            let command = eventually(|| commands.next_in_order());
            assert_eq!((command.sequence, command.torque), (sequence, f64::from(life)));
        }
        assert_eq!(commands.lives(), life as u64);
    }
}

#[test]
fn two_benches_never_meet() {
    let (one, two) = (name("one"), name("two"));
    let (one, two) = (join(&one, Role::Control), join(&two, Role::Control));
    let mut from_one = one.publish(&COMMAND).expect("first publisher");
    let _from_two = two.publish(&COMMAND).expect("first publisher of the other bench");
    let mut at_two = two.subscribe(&COMMAND).expect("subscribed");
    from_one.send(&Command::default());
    assert!(at_two.newest().is_none());
}

#[test]
fn a_bell_wakes_once_however_often_it_rang() {
    let name = name("bell");
    let bench = join(&name, Role::Control);
    let (here, there) = (
        bench.bell(Waiter::Control).expect("opened"),
        join(&name, Role::Emulate).bell(Waiter::Control).expect("opened"),
    );
    // More than a FIFO holds: a bell that nobody answers must not block who rings it.
    for _ in 0..100_000 {
        there.ring();
    }
    let ready = |milliseconds: u64| {
        rotorbench::rt::wait(
            [here.descriptor()],
            rotorbench::clock::monotonic_ns() + milliseconds * 1_000_000,
        )
    };
    assert_eq!(ready(1_000), rotorbench::rt::Wake::Ready(1));
    here.quiet();
    assert_eq!(ready(1), rotorbench::rt::Wake::Deadline);
}

#[test]
fn a_name_that_is_no_file_name_is_refused() {
    for name in ["", "a/b", "../x", "a b", "é", &"n".repeat(33)] {
        let refused = Bench::join(name, &SharedMemoryConfig::default(), Role::Control).expect_err("refused");
        assert!(matches!(refused, ShmError::Name { .. }), "{refused}");
    }
}
