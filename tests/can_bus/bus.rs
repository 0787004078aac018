//! A virtual bus of a test's own, so that tests can run side by side and pull their interfaces down.

use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use rotorbench::can::{Arrival, Port};
use rotorbench::clock;

use crate::processes::Patience;

static MADE: AtomicU32 = AtomicU32::new(0);

/// A `vcan` interface that is there as long as the value.
pub struct Bus {
    pub name: String,
}

impl Bus {
    pub fn new() -> Self {
        let number = MADE.fetch_add(1, Ordering::Relaxed);
        Self::named(&format!("vt{}n{number}", std::process::id()))
    }

    pub fn named(name: &str) -> Self {
        let name = name.to_owned();
        ip(&["link", "add", "dev", &name, "type", "vcan"]);
        ip(&["link", "set", &name, "mtu", "72", "up"]);
        Self { name }
    }

    pub fn up(&self) {
        ip(&["link", "set", &self.name, "up"]);
    }

    /// [ns] when it was asked for. By the kernel's own call where that is permitted: in User-Mode Linux the program needs
    /// longer to start and to end than the guard holds a command.
    pub fn down(&self) -> u64 {
        let at_ns = clock::monotonic_ns();
        if down(&self.name) {
            return at_ns;
        }
        ip(&["link", "set", &self.name, "down"]);
        clock::monotonic_ns()
    }

    pub fn port(&self) -> Port {
        Port::open(&self.name, true).expect("the bus is up")
    }
}

/// Takes an interface down; whether that was permitted.
fn down(name: &str) -> bool {
    // SAFETY: zeros are a value of every field of it, and the name, shorter than the field, stays terminated.
    let mut request: libc::ifreq = unsafe { std::mem::zeroed() };
    assert!(name.len() < request.ifr_name.len(), "an interface's name");
    request.ifr_name.iter_mut().zip(name.bytes()).for_each(|(to, byte)| *to = byte as libc::c_char);
    // SAFETY: a plain socket, closed below; both calls read and write the one request, which outlives them, and the flags are
    // what the first of them has put there.
    unsafe {
        let socket = libc::socket(libc::AF_INET, libc::SOCK_DGRAM | libc::SOCK_CLOEXEC, 0);
        let mut is_down = socket >= 0 && libc::ioctl(socket, libc::SIOCGIFFLAGS, &raw mut request) == 0;
        if is_down {
            request.ifr_ifru.ifru_flags &= !(libc::IFF_UP as libc::c_short);
            is_down = libc::ioctl(socket, libc::SIOCSIFFLAGS, &raw const request) == 0;
        }
        libc::close(socket);
        is_down
    }
}

impl Drop for Bus {
    fn drop(&mut self) {
        // A test may have deleted it.
        let _ = as_root("ip").args(["link", "delete", &self.name]).output();
    }
}

pub fn ip(arguments: &[&str]) {
    run("ip", arguments);
}

pub fn run(program: &str, arguments: &[&str]) {
    let output = as_root(program).args(arguments).output().expect("the program is there");
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{program} {arguments:?} failed, as it does without CAN or root: {text}"
    );
}

fn as_root(program: &str) -> Command {
    // SAFETY: a plain question to the kernel.
    if unsafe { libc::geteuid() } == 0 {
        return Command::new(program);
    }
    let mut command = Command::new("sudo");
    command.args(["-n", program]);
    command
}

/// Everything that arrives until `enough` says so. Ten seconds without are a failure, not a measurement.
pub fn receive(port: &mut Port, enough: impl Fn(&[Arrival]) -> bool) -> Vec<Arrival> {
    let mut arrivals = Vec::new();
    let mut patience = Patience::seconds(10);
    while !enough(&arrivals) {
        assert!(patience.lasts(), "only {} arrived: {arrivals:?}", arrivals.len());
        port.receive(|arrival| arrivals.push(arrival)).expect("the interface is up");
        std::thread::sleep(Duration::from_millis(1));
    }
    arrivals
}
