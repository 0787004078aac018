//! Does to the bench what a row says, when its seed says.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rotorbench::can::{Frame, Roles, SenderState};
use rotorbench::signal::{Applied, Command, Sensors};

use crate::bench::Parts;
use crate::bus::{Interface, MemoryBus};
use crate::fault::{Fate, Kind, Row, Spoilt, Who, Whose, Wrong};

/// [s] between which the fault comes.
const BETWEEN_S: (f64, f64) = (1.1, 1.6);
/// [s] shortest span of a fault that goes away.
const SHORTEST_S: f64 = 0.02;

pub struct Injector {
    kind: Kind,
    dice: ChaCha8Rng,
    /// First slot of the fault, and the first slot after it, for one that goes away.
    pub from: u64,
    until: u64,
    hold: u64,
    /// Slots of 0.1 s.
    tenth: u64,
    period_ns: u64,
    /// Slot in which each process, when starved, runs again.
    asleep: [u64; 2],
    frozen_sensors: Option<Sensors>,
    repeated_frames: [Option<Frame>; 16],
    withheld: [Option<Frame>; 16],
    frozen: Option<Command>,
    foreign: Option<SenderState>,
}

impl Injector {
    pub fn new(row: &Row, parts: &Parts, seed: u64) -> Self {
        // Each row, rate and seed has a stream of its own.
        let name = row
            .name
            .bytes()
            .fold(parts.period_ns, |hash, byte| hash.wrapping_mul(31).wrapping_add(byte.into()));
        let mut dice = ChaCha8Rng::seed_from_u64(seed);
        dice.set_stream(name);
        let slots = |seconds: f64| (seconds * 1e9) as u64 / parts.period_ns;
        let from = slots(dice.random_range(BETWEEN_S.0..BETWEEN_S.1));
        let longest = match row.kind {
            Kind::Interface(_, span) => span,
            Kind::Frames(_, Spoilt::Gap(span))
            | Kind::Process(_, Fate::KilledAndBack(span) | Fate::Paused(span)) => Some(span),
            _ => None,
        };
        let until =
            longest.map_or(u64::MAX, |longest| from + slots(dice.random_range(SHORTEST_S..longest)).max(1));
        Self {
            kind: row.kind,
            dice,
            from,
            until,
            hold: parts.hold,
            tenth: slots(0.1),
            period_ns: parts.period_ns,
            asleep: [0; 2],
            frozen_sensors: None,
            repeated_frames: [None; 16],
            withheld: [None; 16],
            frozen: None,
            foreign: None,
        }
    }

    fn acts(&self, slot: u64) -> bool {
        (self.from..self.until).contains(&slot)
    }

    /// What is wrong with the bridge's interface, and which processes lose this slot.
    pub fn begin(&mut self, slot: u64, bus: &MemoryBus) {
        match self.kind {
            Kind::Interface(interface, _) if slot == self.from => bus.set(interface),
            Kind::Interface(..) if slot == self.until => bus.set(Interface::Up),
            Kind::SometimesFull(one_in) if slot >= self.from => {
                let is_full = self.dice.random_range(0..one_in) == 0;
                bus.set(if is_full { Interface::Full } else { Interface::Up });
            }
            Kind::ErrorFrame { class, state, repeated }
                if slot == self.from || repeated && slot > self.from =>
            {
                bus.complain(class, [0, state, 0, 0, 0, 0, 0, 0]);
            }
            Kind::Starved if slot >= self.from => {
                for asleep in &mut self.asleep {
                    if *asleep <= slot && self.dice.random_range(0..10) == 0 {
                        let lost = if self.dice.random_range(0..8) == 0 { 3 } else { 1 };
                        *asleep = slot + lost;
                    }
                }
            }
            _ => {}
        }
    }

    pub fn is_awake(&self, who: Who, slot: u64) -> bool {
        match (self.kind, who) {
            (Kind::Process(victim, _), _) if victim == who => !self.acts(slot),
            (Kind::Starved, Who::Control) => self.asleep[0] <= slot,
            (Kind::Starved, Who::Bridge) => self.asleep[1] <= slot,
            _ => true,
        }
    }

    pub fn is_alive(&self, who: Who, slot: u64) -> bool {
        !matches!(self.kind, Kind::Process(victim, Fate::Killed | Fate::KilledAndBack(_)) if victim == who)
            || !self.acts(slot)
    }

    pub fn dies(&self, who: Who, slot: u64) -> bool {
        slot == self.from && !self.is_alive(who, slot)
    }

    pub fn restarts(&self, who: Who, slot: u64) -> bool {
        slot == self.until && !self.is_alive(who, self.from)
    }

    /// What the sensors themselves say.
    pub fn seen(&mut self, slot: u64, sensors: Sensors) -> Sensors {
        let Kind::Frames(whose, Spoilt::FrozenValue) = self.kind else { return sensors };
        if slot < self.from {
            self.frozen_sensors = Some(sensors);
            return sensors;
        }
        let frozen = self.frozen_sensors.unwrap_or(sensors);
        let mut seen = sensors;
        match whose {
            Whose::Gyro => seen.body_rate = frozen.body_rate,
            _ => seen.propeller_rate[1] = frozen.propeller_rate[1],
        }
        seen
    }

    pub fn sensor_frame(&mut self, slot: u64, index: usize, name: &str, frame: Frame) -> Vec<(u64, Frame)> {
        let Kind::Frames(whose, spoilt) = self.kind else { return vec![(0, frame)] };
        let is_meant = match whose {
            Whose::Gyro => name == "GYRO",
            Whose::Esc2 => name == "ESC_2_STATUS",
            Whose::Sensors => true,
            Whose::Commands => false,
        };
        if is_meant { self.spoil(slot, spoilt, index, frame) } else { vec![(0, frame)] }
    }

    pub fn command_frame(&mut self, slot: u64, frame: Frame) -> Vec<(u64, Frame)> {
        match self.kind {
            Kind::Frames(Whose::Commands, spoilt) => self.spoil(slot, spoilt, 0, frame),
            _ => vec![(0, frame)],
        }
    }

    fn spoil(&mut self, slot: u64, spoilt: Spoilt, index: usize, frame: Frame) -> Vec<(u64, Frame)> {
        if !self.acts(slot) {
            self.repeated_frames[index] = Some(frame);
            return vec![(0, frame)];
        }
        let once = |frame| vec![(0, frame)];
        match spoilt {
            Spoilt::Dropped(share) if self.dice.random_bool(share) => vec![],
            Spoilt::Gap(_) => vec![],
            Spoilt::Late(0) => vec![(self.hold * 3 / 2, frame)],
            Spoilt::Late(periods) => vec![(periods, frame)],
            Spoilt::Jitter(periods) => vec![(self.dice.random_range(0..=periods), frame)],
            Spoilt::Doubled => vec![(0, frame), (0, frame)],
            Spoilt::Swapped => match self.withheld[index].take() {
                Some(earlier) => vec![(0, frame), (0, earlier)],
                None => {
                    self.withheld[index] = Some(frame);
                    vec![]
                }
            },
            Spoilt::Flipped(share) if self.dice.random_bool(share) => {
                let bits: Vec<u32> =
                    (0..self.dice.random_range(1..=8)).map(|_| self.dice.random_range(0..64)).collect();
                once(changed(&frame, |data| {
                    bits.iter().for_each(|bit| data[*bit as usize / 8] ^= 1 << (bit % 8));
                }))
            }
            Spoilt::RepeatedFrame => once(self.repeated_frames[index].unwrap_or(frame)),
            Spoilt::Counter => {
                let counter = self.dice.random();
                once(changed(&frame, |data| data[0] = counter))
            }
            Spoilt::CounterJump => once(changed(&frame, |data| data[0] = data[0].wrapping_add(50))),
            Spoilt::NotANumber => {
                once(changed(&frame, |data| data[4..8].copy_from_slice(&f32::NAN.to_le_bytes())))
            }
            Spoilt::OutOfRange => {
                once(changed(&frame, |data| data[4..8].copy_from_slice(&1e6_f32.to_le_bytes())))
            }
            Spoilt::Dropped(_) | Spoilt::Flipped(_) | Spoilt::FrozenValue => once(frame),
        }
    }

    /// Gyro frames of another node, which has a counter of its own and says that the body turns.
    pub fn foreign_sensors(&mut self, slot: u64, roles: &Roles, seen: &Sensors) -> Vec<Frame> {
        let Kind::Foreign(Whose::Gyro, each) = self.kind else { return vec![] };
        if !self.acts(slot) {
            return vec![];
        }
        let sender = self.foreign.get_or_insert_with(|| roles.sensor_sender());
        let mut lie = *seen;
        lie.body_rate.value = 1.5;
        let index = roles.sensor_messages().iter().position(|message| message.name == "GYRO");
        (0..each).filter_map(|_| roles.encode_sensors(sender, index?, &lie)).collect()
    }

    /// Command frames of another node, which has a counter of its own and wants full throttle.
    pub fn foreign_commands(&mut self, slot: u64, roles: &Roles) -> Vec<Frame> {
        let Kind::Foreign(Whose::Commands, each) = self.kind else { return vec![] };
        if !self.acts(slot) {
            return vec![];
        }
        let sender = self.foreign.get_or_insert_with(|| roles.command_sender());
        let full = Applied { rotor: [1.0, 1.0], state: 2, ..Applied::default() };
        (0..each).flat_map(|_| roles.encode_commands(sender, &full).to_vec()).collect()
    }

    pub fn command(&mut self, slot: u64, command: Command) -> Command {
        let Kind::Controller(wrong) = self.kind else { return command };
        if slot < self.from {
            self.frozen = Some(command);
            return command;
        }
        let frozen = self.frozen.unwrap_or(command);
        let rotor = |rotor| Command { rotor, ..command };
        match wrong {
            Wrong::NotANumber => rotor([f64::NAN, command.rotor[1]]),
            Wrong::Huge => rotor([1e300, 1e300]),
            Wrong::Negative => rotor([-1e300, -1e300]),
            Wrong::Oscillates(periods) => {
                let half = if periods == 0 { self.tenth } else { periods };
                let is_high = ((slot - self.from) / half).is_multiple_of(2);
                rotor(if is_high { [1.0, 0.0] } else { [0.0, 1.0] })
            }
            Wrong::Resent => frozen,
            Wrong::Hung => Command { sensors_sequence: frozen.sensors_sequence, ..command },
            Wrong::FromTheFuture => Command { stamp_ns: command.stamp_ns + 5 * self.period_ns, ..command },
            Wrong::Old => {
                Command { stamp_ns: command.stamp_ns - (self.hold + 2) * self.period_ns, ..command }
            }
        }
    }
}

fn changed(frame: &Frame, change: impl FnOnce(&mut [u8])) -> Frame {
    let mut data = frame.data().to_vec();
    change(&mut data);
    Frame::new(frame.id(), frame.kind(), &data).expect("as long as before")
}
