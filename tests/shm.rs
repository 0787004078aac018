//! The shared memory of a bench, between threads and processes.

use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::{DirBuilderExt, PermissionsExt};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use rotorbench::shm::{
    BenchMember, BenchPlace, COMMAND, ProcessRole, REQUEST, SENSORS, SharedMemoryConfig, ShmError, Waiter,
};
use rotorbench::signal::{Command, Request, Sensors};

/// A bench of its own for each test, so that tests of one machine never meet; removed at the end.
struct Name(String);

impl std::ops::Deref for Name {
    type Target = str;
    fn deref(&self) -> &str {
        &self.0
    }
}

impl Drop for Name {
    fn drop(&mut self) {
        if let Ok(place) = BenchPlace::open(&self.0, &SharedMemoryConfig::default()) {
            place.remove().expect("the bench can be removed");
        }
    }
}

fn name(test: &str) -> Name {
    Name(format!("t{}-{test}", std::process::id()))
}

fn join(name: &str, role: ProcessRole) -> BenchMember {
    BenchMember::join(name, &SharedMemoryConfig::default(), role).expect("the bench can be joined")
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
    let (there, here) = (join(&name, ProcessRole::Emulate), join(&name, ProcessRole::Control));
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
    let bench = join(&name, ProcessRole::Emulate);
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
    let bench = join(&name, ProcessRole::Emulate);
    let mut publisher = bench.publish(&SENSORS).expect("first publisher");
    for sequence in 1..=10 {
        publisher.send(&sensors(sequence));
    }
    let mut late = join(&name, ProcessRole::Record).subscribe(&SENSORS).expect("subscribed");
    assert_eq!(late.next_in_order().map(|it| it.sequence), Some(10));
    assert!(late.next_in_order().is_none());
}

/// Who joins looks over everything with the bench's name, also over what another process is just making. That it
/// leaves alone: what is finished between the look and the change would be undone, and nobody could ever open it.
#[test]
fn who_joins_leaves_alone_what_is_just_being_made() {
    let name = name("making");
    let here = join(&name, ProcessRole::Emulate);
    let directory = here.place().directory().file_name().expect("a name").to_string_lossy().into_owned();
    let segment = PathBuf::from(format!("/dev/shm/{directory}.being_made"));
    fs::write(&segment, "").expect("written");
    let mode = || fs::metadata(&segment).expect("there").permissions().mode() & 0o777;
    for (before, after) in [(0o222, 0o222), (0o666, 0o600)] {
        fs::set_permissions(&segment, fs::Permissions::from_mode(before)).expect("ours");
        drop(join(&name, ProcessRole::Monitor));
        assert_eq!(mode(), after, "{before:o} became {:o}", mode());
    }
    fs::remove_file(&segment).expect("ours");
}

#[test]
fn a_second_publisher_is_refused_and_a_second_life_is_met() {
    let name = name("incarnations");
    let reader = join(&name, ProcessRole::Emulate);
    let mut commands = reader.subscribe(&COMMAND).expect("subscribed");
    for life in 1..=3 {
        let controller = join(&name, ProcessRole::Control);
        let mut publisher = controller.publish(&COMMAND).expect("the only publisher");
        let refused = join(&name, ProcessRole::Control).publish(&COMMAND).expect_err("there is one");
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
        assert_eq!(commands.incarnations(), life as u64);
    }
}

#[test]
fn two_benches_never_meet() {
    let (first, second) = (name("one"), name("two"));
    let (one, two) = (join(&first, ProcessRole::Control), join(&second, ProcessRole::Control));
    let mut from_one = one.publish(&COMMAND).expect("first publisher");
    let _from_two = two.publish(&COMMAND).expect("first publisher of the other bench");
    let mut at_two = two.subscribe(&COMMAND).expect("subscribed");
    from_one.send(&Command::default());
    assert!(at_two.newest().is_none());
}

#[test]
fn a_bell_wakes_once_however_often_it_rang() {
    let name = name("bell");
    let bench = join(&name, ProcessRole::Control);
    let (here, there) = (
        bench.bell(Waiter::Control).expect("opened"),
        join(&name, ProcessRole::Emulate).bell(Waiter::Control).expect("opened"),
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
        let refused = BenchMember::join(name, &SharedMemoryConfig::default(), ProcessRole::Control)
            .expect_err("refused");
        assert!(matches!(refused, ShmError::Name { .. }), "{refused}");
    }
}

/// Runs `act` as another user. Credentials of a Linux thread are its own, as long as libc's wrappers, which set those
/// of all threads, are not used. `None` where this process may not change its user.
fn as_user<T: Send>(user: u32, group: u32, act: impl FnOnce() -> T + Send) -> Option<T> {
    std::thread::scope(|scope| {
        let other = scope.spawn(move || {
            let (user, group) = (libc::c_long::from(user), libc::c_long::from(group));
            // SAFETY: raw system calls without pointers to be written; they change this thread's credentials only.
            let changed = unsafe {
                libc::syscall(libc::SYS_setgroups, 0, std::ptr::null::<libc::gid_t>()) == 0
                    && libc::syscall(libc::SYS_setresgid, group, group, group) == 0
                    && libc::syscall(libc::SYS_setresuid, user, user, user) == 0
            };
            changed.then(act)
        });
        other.join().expect("no panic as the other user")
    })
}

/// Says what a test did not show, where the test runner does not swallow it.
fn not_shown(what: &str) {
    writeln!(std::io::stderr(), "NOT SHOWN (needs root): {what}").expect("standard error can be written");
}

/// Everything of a bench in the file system, except below directories that cannot be listed.
fn files(place: &BenchPlace) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = fs::read_dir("/dev/shm")
        .expect("listed")
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(place.prefix()))
        .map(|entry| entry.path())
        .collect();
    let mut directories = vec![place.directory().to_owned()];
    while let Some(directory) = directories.pop() {
        for entry in fs::read_dir(directory).expect("listed").flatten() {
            let path = entry.path();
            if path.is_dir() { directories.push(path) } else { found.push(path) }
        }
    }
    found
}

/// A bench with everything it can have, at work.
fn busy_bench(name: &str, config: &SharedMemoryConfig) -> impl Sized + use<> {
    let bench = BenchMember::join(name, config, ProcessRole::Emulate).expect("joined");
    let mut sensors_out = bench.publish(&SENSORS).expect("published");
    let commands = bench.publish(&COMMAND).expect("published");
    let reader = bench.subscribe(&SENSORS).expect("subscribed");
    let bells = (bench.bell(Waiter::Control).expect("bell"), bench.bell(Waiter::Guard).expect("bell"));
    sensors_out.send(&sensors(1));
    (sensors_out, commands, reader, bells, bench)
}

#[test]
fn another_user_can_neither_command_nor_listen() {
    const NOBODY: u32 = 65_534;
    let name = name("alien");
    let _bench = busy_bench(&name, &SharedMemoryConfig::default());
    let place = BenchPlace::open(&name, &SharedMemoryConfig::default()).expect("there");
    let files = files(&place);
    assert!(files.len() > 10, "the test looks at segments, claims, bells and services: {files:?}");
    let attempt = as_user(NOBODY, NOBODY, || {
        let denied = |path: &PathBuf, write: bool| {
            let opened = OpenOptions::new().read(!write).write(write).open(path);
            matches!(opened, Err(error) if error.kind() == ErrorKind::PermissionDenied)
        };
        let open: Vec<&PathBuf> =
            files.iter().filter(|path| !denied(path, false) || !denied(path, true)).collect();
        let listed = fs::read_dir(place.directory()).is_ok();
        // The same name, joined by another user, is another bench.
        let own = BenchMember::join(&name, &SharedMemoryConfig::default(), ProcessRole::Control)
            .expect("a bench of their own");
        let heard = own.subscribe(&SENSORS).expect("subscribed").newest();
        let commanding = own.publish(&COMMAND).is_ok();
        let own_place = own.place().clone();
        drop(own);
        own_place.remove().expect("removed");
        (open.into_iter().cloned().collect::<Vec<_>>(), listed, heard, commanding)
    });
    let Some((open, listed, heard, commanding)) = attempt else {
        return not_shown("another user can neither command nor listen");
    };
    assert!(open.is_empty(), "open to another user: {open:?}");
    assert!(!listed && heard.is_none() && commanding);
}

#[test]
fn with_a_group_its_members_join_and_others_do_not() {
    let config = SharedMemoryConfig { group: Some("games".to_owned()) };
    let name = format!("t{}-group", std::process::id());
    // Debian's `games` has number 60 everywhere; the test asks the system what it is.
    let Ok(place) = BenchPlace::open(&name, &config) else {
        return not_shown("a group shares a bench (no group `games`, or not a member)");
    };
    let games = std::os::unix::fs::MetadataExt::gid(&fs::metadata(place.directory()).expect("there"));
    let bench = busy_bench(&name, &config);
    let here = BenchMember::join(&name, &config, ProcessRole::Bridge).expect("joined");
    let mut requests = here.subscribe(&REQUEST).expect("subscribed");
    let member = as_user(20_001, games, || {
        let mine = BenchMember::join(&name, &config, ProcessRole::Record).expect("a member joins");
        mine.bell(Waiter::Control).expect("a member rings").ring();
        let refused = mine.publish(&COMMAND).expect_err("there is one");
        let heard = mine.subscribe(&SENSORS).expect("subscribed").newest().map(|it| it.sequence);
        let mut word = mine.publish(&REQUEST).expect("nobody else speaks");
        word.send(&Request { sequence: 7, ..Request::default() });
        // What another user made, and has not left yet.
        (refused.to_string(), heard, eventually(|| requests.next_in_order()).sequence)
    });
    let stranger = as_user(20_002, 20_002, || {
        BenchMember::join(&name, &config, ProcessRole::Record).map(|_| ()).map_err(|it| it.to_string())
    });
    drop(bench);
    drop(here);
    let (Some((refused, heard, word)), Some(stranger)) = (member, stranger) else {
        place.remove().expect("removed");
        return not_shown("a group shares a bench");
    };
    place.remove().expect("removed");
    assert!(refused.contains("published by emulate"), "{refused}");
    assert_eq!((heard, word), (Some(1), 7), "a member listens and is heard");
    assert!(stranger.expect_err("a stranger is kept out").contains("Permission denied"));
}

#[test]
fn a_directory_that_somebody_put_in_the_way_is_refused() {
    let name = name("squat");
    let place = BenchPlace::open(&name, &SharedMemoryConfig::default()).expect("made");
    fs::set_permissions(place.directory(), fs::Permissions::from_mode(0o707)).expect("opened to others");
    let refused = BenchMember::join(&name, &SharedMemoryConfig::default(), ProcessRole::Control)
        .expect_err("open to others");
    assert!(matches!(refused, ShmError::NotOurs { .. }), "{refused}");
    place.remove().expect("removed");
    let squatted = as_user(65_534, 65_534, || {
        fs::DirBuilder::new().mode(0o700).create(place.directory()).expect("anybody may write to /dev/shm");
    });
    if squatted.is_none() {
        return not_shown("a directory of another user is refused");
    }
    let refused =
        BenchMember::join(&name, &SharedMemoryConfig::default(), ProcessRole::Control).expect_err("not ours");
    assert!(matches!(refused, ShmError::NotOurs { user: 65_534, .. }), "{refused}");
    fs::remove_dir(place.directory()).expect("removed");
}
