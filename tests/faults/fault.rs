//! The rows of the matrix: what is done to the bench, and what must come of it.

use rotorbench::emulate::RotorFaultKind;

use crate::bus::Interface;
use crate::nodes::NodeFault;

/// Whose frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whose {
    Gyro,
    Esc2,
    Sensors,
    Commands,
}

/// What happens to frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spoilt {
    /// Lost, with this probability.
    Dropped(f64),
    /// Lost for a while of random length, up to this many seconds.
    Gap(f64),
    /// All late by as many periods.
    Late(u64),
    /// Each late by up to as many periods, at random.
    Jitter(u64),
    /// Each comes twice.
    Doubled,
    /// Each second one comes after its successor.
    Swapped,
    /// One to eight bits flipped, with this probability; the bus's own check sum would catch nearly all of these.
    Flipped(f64),
    /// The value stands still, the counter goes on.
    FrozenValue,
    /// The very same frame again and again.
    RepeatedFrame,
    /// A random counter in each.
    Counter,
    /// The counter jumps by fifty, once.
    CounterJump,
    NotANumber,
    OutOfRange,
}

/// Which process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Who {
    Control,
    Bridge,
    /// ESCs and IMU: their power is cut.
    Bench,
}

/// What becomes of a process. [s] spans are drawn up to these.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fate {
    Killed,
    KilledAndBack(f64),
    Paused(f64),
}

/// What the controller says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrong {
    NotANumber,
    Huge,
    Negative,
    /// From limit to limit, as many periods each.
    Oscillates(u64),
    /// The same command for ever.
    Resent,
    /// Stamped and numbered anew, the same sensors answered for ever.
    Hung,
    FromTheFuture,
    Old,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Nothing,
    Frames(Whose, Spoilt),
    /// For a random while of up to so many seconds, or for ever.
    Interface(Interface, Option<f64>),
    /// One send in so many finds no room.
    SometimesFull(u64),
    ErrorFrame {
        class: u32,
        state: u8,
        repeated: bool,
    },
    /// Another node sends with our identifier, as often each period.
    Foreign(Whose, u32),
    Process(Who, Fate),
    Controller(Wrong),
    /// Each process loses a slot now and then, and three in a row at times.
    Starved,
    /// The recorder's disk is full.
    RecorderStuck,
    /// The bench on DroneCAN.
    Dronecan(NodeFault),
    /// A bench whose speeds are held against its model; something of the second rotor breaks, or nothing.
    Rotor(Option<RotorFaultKind>),
}

impl Kind {
    /// What goes wrong on DroneCAN, of a bench that speaks it.
    pub fn of_node(self) -> Option<NodeFault> {
        match self {
            Self::Dronecan(fault) => Some(fault),
            _ => None,
        }
    }

    /// Whether the rotors are held against the bench's model.
    pub fn has_speed_check(self) -> bool {
        matches!(self, Self::Rotor(_))
    }
}

/// What must come of it, beyond what must be true of every row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Expect {
    RunsOn,
    /// Both rotors commanded to zero for good at most N + this many periods after the fault, N the hold.
    Stops(u64),
    /// The same with a limit in seconds of its own.
    StopsBy(f64),
    /// Depends on the draw.
    Either,
    /// Another node commands the rotors past the guard: the guard says zero, and cannot do more.
    Beyond,
}

pub struct Row {
    pub name: &'static str,
    pub kind: Kind,
    pub expect: Expect,
}

impl Row {
    /// Periods in which an ESC may obey another node beyond the limits: where the count of its first frame happens to go on from
    /// the bridge's, until the bridge goes on behind it.
    pub fn periods_beyond(&self) -> usize {
        if matches!(self.kind, Kind::Foreign(Whose::Commands, 1)) { 2 } else { 0 }
    }
}

const fn row(name: &'static str, kind: Kind, expect: Expect) -> Row {
    Row { name, kind, expect }
}

/// CAN_ERR_CRTL with the controller's state in byte 1, CAN_ERR_BUSOFF. Linux, `include/uapi/linux/can/error.h`.
const CONTROLLER: u32 = 0x004;
const BUS_OFF: u32 = 0x040;
const PASSIVE: u8 = 0x30;

#[rustfmt::skip]
pub const ROWS: &[Row] = &[
    row("none", Kind::Nothing, Expect::RunsOn),
    row("gyro frames lost, all", Kind::Frames(Whose::Gyro, Spoilt::Dropped(1.0)), Expect::Stops(2)),
    row("frames of one ESC lost, all", Kind::Frames(Whose::Esc2, Spoilt::Dropped(1.0)), Expect::Stops(2)),
    row("sensor frames lost, 1 in 10", Kind::Frames(Whose::Sensors, Spoilt::Dropped(0.1)), Expect::Either),
    row("sensor frames lost, half", Kind::Frames(Whose::Sensors, Spoilt::Dropped(0.5)), Expect::Either),
    row("sensor frames lost for up to 0.3 s", Kind::Frames(Whose::Sensors, Spoilt::Gap(0.3)), Expect::Either),
    row("command frames lost, all", Kind::Frames(Whose::Commands, Spoilt::Dropped(1.0)), Expect::Stops(2)),
    row("command frames lost, half", Kind::Frames(Whose::Commands, Spoilt::Dropped(0.5)), Expect::Either),
    row("sensor frames late by 2 periods", Kind::Frames(Whose::Sensors, Spoilt::Late(2)), Expect::Either),
    row("sensor frames late by 1.5 times the hold", Kind::Frames(Whose::Sensors, Spoilt::Late(0)), Expect::Stops(2)),
    row("sensor frames late by 0 to 3 periods", Kind::Frames(Whose::Sensors, Spoilt::Jitter(3)), Expect::Either),
    row("command frames late by 2 periods", Kind::Frames(Whose::Commands, Spoilt::Late(2)), Expect::Either),
    row("sensor frames doubled", Kind::Frames(Whose::Sensors, Spoilt::Doubled), Expect::Stops(2)),
    row("command frames doubled", Kind::Frames(Whose::Commands, Spoilt::Doubled), Expect::RunsOn),
    row("sensor frames out of order", Kind::Frames(Whose::Sensors, Spoilt::Swapped), Expect::Either),
    row("command frames out of order", Kind::Frames(Whose::Commands, Spoilt::Swapped), Expect::Either),
    row("bits of sensor frames flipped, 1 in 10", Kind::Frames(Whose::Sensors, Spoilt::Flipped(0.1)), Expect::Either),
    row("bits of sensor frames flipped, all", Kind::Frames(Whose::Sensors, Spoilt::Flipped(1.0)), Expect::Either),
    row("gyro value frozen, frames live", Kind::Frames(Whose::Gyro, Spoilt::FrozenValue), Expect::Stops(2)),
    row("speed of one ESC frozen, frames live", Kind::Frames(Whose::Esc2, Spoilt::FrozenValue), Expect::StopsBy(0.5)),
    row("gyro frame repeated", Kind::Frames(Whose::Gyro, Spoilt::RepeatedFrame), Expect::Stops(2)),
    row("gyro counter random", Kind::Frames(Whose::Gyro, Spoilt::Counter), Expect::Either),
    row("gyro counter jumps once", Kind::Frames(Whose::Gyro, Spoilt::CounterJump), Expect::RunsOn),
    row("gyro not a number", Kind::Frames(Whose::Gyro, Spoilt::NotANumber), Expect::Stops(2)),
    row("gyro out of range", Kind::Frames(Whose::Gyro, Spoilt::OutOfRange), Expect::Stops(2)),
    row("bus off", Kind::Interface(Interface::Off, None), Expect::Stops(2)),
    row("error frame: bus off", Kind::ErrorFrame { class: BUS_OFF, state: 0, repeated: false }, Expect::Stops(2)),
    row("error frames: passive", Kind::ErrorFrame { class: CONTROLLER, state: PASSIVE, repeated: true }, Expect::RunsOn),
    row("no room to send (ENOBUFS)", Kind::Interface(Interface::Full, None), Expect::Stops(2)),
    row("no room for 1 send in 3", Kind::SometimesFull(3), Expect::Either),
    row("interface down, back within 0.5 s", Kind::Interface(Interface::Down, Some(0.5)), Expect::Either),
    row("interface removed, made again within 0.5 s", Kind::Interface(Interface::Gone, Some(0.5)), Expect::Either),
    row("interface removed", Kind::Interface(Interface::Gone, None), Expect::Stops(2)),
    row("second node sends the gyro's frames", Kind::Foreign(Whose::Gyro, 1), Expect::Either),
    row("second node commands full throttle, once a period", Kind::Foreign(Whose::Commands, 1), Expect::Stops(2)),
    row("second node commands full throttle, 4 times a period", Kind::Foreign(Whose::Commands, 4), Expect::Beyond),
    row("SIGKILL of control", Kind::Process(Who::Control, Fate::Killed), Expect::Stops(2)),
    row("SIGKILL of control, back within 0.5 s", Kind::Process(Who::Control, Fate::KilledAndBack(0.5)), Expect::Stops(2)),
    row("SIGSTOP of control, SIGCONT within 0.5 s", Kind::Process(Who::Control, Fate::Paused(0.5)), Expect::Either),
    row("SIGKILL of bridge", Kind::Process(Who::Bridge, Fate::Killed), Expect::Stops(2)),
    row("SIGKILL of bridge, back within 0.5 s", Kind::Process(Who::Bridge, Fate::KilledAndBack(0.5)), Expect::Stops(2)),
    row("SIGSTOP of bridge, SIGCONT within 0.5 s", Kind::Process(Who::Bridge, Fate::Paused(0.5)), Expect::Either),
    row("power of ESCs and IMU cut", Kind::Process(Who::Bench, Fate::Killed), Expect::Stops(2)),
    row("power of ESCs and IMU cut, back within 0.5 s", Kind::Process(Who::Bench, Fate::KilledAndBack(0.5)), Expect::Either),
    row("every process loses slots (CPU hog)", Kind::Starved, Expect::Either),
    row("command not a number", Kind::Controller(Wrong::NotANumber), Expect::Stops(2)),
    row("command of 1e300", Kind::Controller(Wrong::Huge), Expect::Either),
    row("command of -1e300", Kind::Controller(Wrong::Negative), Expect::Either),
    row("command from limit to limit each period", Kind::Controller(Wrong::Oscillates(1)), Expect::Either),
    row("command from limit to limit each 0.1 s", Kind::Controller(Wrong::Oscillates(0)), Expect::Either),
    row("command sent again and again", Kind::Controller(Wrong::Resent), Expect::Stops(2)),
    row("command new, answers old sensors (hung)", Kind::Controller(Wrong::Hung), Expect::Stops(3)),
    row("command stamped in the future", Kind::Controller(Wrong::FromTheFuture), Expect::Stops(2)),
    row("command stamped long ago", Kind::Controller(Wrong::Old), Expect::Stops(2)),
    row("recorder's disk full", Kind::RecorderStuck, Expect::RunsOn),
    row("DroneCAN: none", Kind::Dronecan(NodeFault::Nothing), Expect::RunsOn),
    row("DroneCAN: every node begins anew", Kind::Dronecan(NodeFault::Restarts), Expect::Either),
    row("DroneCAN: checksums of one ESC wrong", Kind::Dronecan(NodeFault::Checksum), Expect::Stops(2)),
    row("DroneCAN: toggle bits of the IMU wrong", Kind::Dronecan(NodeFault::Toggle), Expect::Stops(2)),
    row("DroneCAN: second node with one ESC's number", Kind::Dronecan(NodeFault::Twice), Expect::StopsBy(4.0)),
    row("DroneCAN: second node with the bridge's number", Kind::Dronecan(NodeFault::OwnTwice), Expect::Stops(2)),
    row("DroneCAN: who gave the bridge its number dies", Kind::Dronecan(NodeFault::AllocatorDies), Expect::RunsOn),
    row("DroneCAN: one ESC silent about how it is", Kind::Dronecan(NodeFault::Silent), Expect::StopsBy(3.1)),
    row("DroneCAN: one ESC in health ERROR", Kind::Dronecan(NodeFault::Unwell), Expect::StopsBy(1.1)),
    row("DroneCAN: ESCs report at 10 Hz", Kind::Dronecan(NodeFault::Slow), Expect::Either),
    row("DroneCAN: ArmingStatus lost on its way", Kind::Dronecan(NodeFault::ArmingLost), Expect::StopsBy(2.1)),
    row("DroneCAN: another node says that no rotor may turn", Kind::Dronecan(NodeFault::Disarmed), Expect::Stops(2)),
    row("speed check: none", Kind::Rotor(None), Expect::RunsOn),
    row("speed check: a propeller loses 30 % of its thrust", Kind::Rotor(Some(RotorFaultKind::BrokenPropeller)), Expect::StopsBy(0.3)),
    row("speed check: a rotor loses step and stops", Kind::Rotor(Some(RotorFaultKind::Desync)), Expect::StopsBy(0.3)),
    row("speed check: an ESC turns by itself", Kind::Rotor(Some(RotorFaultKind::TurnsByItself)), Expect::StopsBy(0.3)),
    row("speed check: an ESC obeys no more", Kind::Rotor(Some(RotorFaultKind::Deaf)), Expect::Either),
];
