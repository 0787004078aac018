//! Signals in their roles: a received frame into [`Sensors`] or into rotor commands, and back into frames.
//!
//! Both ends of the bus are here, from the same table: the bridge decodes sensors and encodes commands; an
//! emulated bench decodes commands and encodes sensors. Nothing here allocates.

use crate::signal::{Applied, Channel, ROTORS, Sensors};

use super::counter::Counter;
use super::field::CommandField;
use super::frame::Frame;
use super::route::{FrameReading, FrameRefusal, Route, Routes};

/// The `[bus]` table, resolved against its DBC files.
#[derive(Debug, Clone)]
pub struct Roles {
    pub(super) sensors: Routes<Channel>,
    pub(super) commands: Routes<CommandField>,
}

/// What the receiver of frames remembers: each sender's counter, and what it refused, by cause.
#[derive(Debug, Clone)]
pub struct ReceiverState {
    counters: Vec<Counter>,
    /// Frames and values received, by what became of them.
    pub counts: Counts,
}

/// What the sender of frames remembers: the counter of each message.
#[derive(Debug, Clone)]
pub struct SenderState {
    counters: Vec<u64>,
}

/// Frames and values received, by what became of them. All wrap.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Frames offered to the decoder.
    pub frames: u64,
    /// Frames that gave at least one good value.
    pub accepted: u64,
    /// Frames with an identifier that no role names, and remote requests.
    pub unknown_id: u64,
    /// Frames with the identifier of our own command, of whatever length, from another sender.
    pub foreign_command: u64,
    /// Frames with the right identifier and the wrong number of bytes.
    pub wrong_length: u64,
    /// Frames refused because the sender's counter repeated, went back or jumped too far.
    pub counter: u64,
    /// Frames lost on the way, by the gaps in the senders' counters.
    pub lost: u64,
    /// Frames of a transfer that came twice, or behind one that is missing.
    #[serde(skip_serializing_if = "is_zero")]
    pub toggle: u64,
    /// Transfers that are not what their checksum says.
    #[serde(skip_serializing_if = "is_zero")]
    pub checksum: u64,
    /// Frames of a transfer whose beginning is missing, or that was not ended in time.
    #[serde(skip_serializing_if = "is_zero")]
    pub incomplete: u64,
    /// Values of a second node, where one says the same already.
    #[serde(skip_serializing_if = "is_zero")]
    pub other_node: u64,
    /// Values that are not a number.
    pub not_a_number: u64,
    /// Values outside the allowed range.
    pub out_of_range: u64,
}

/// What one frame did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decoded {
    /// Fields that got a good new value: bits of [`Channel::bit`], or `1 << rotor` for commands.
    pub updated: u32,
    /// Why the frame, or its last refused value, was refused.
    pub refused: Option<FrameRefusal>,
}

/// Rotor commands as an ESC understands them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RotorCommands {
    /// [-] u_1, u_2; the last good ones.
    pub rotor: [f64; ROTORS],
    /// [ns] CLOCK_MONOTONIC when each arrived; 0 = never.
    pub stamp_ns: [u64; ROTORS],
    /// Guard state code that came along, where the bus carries it.
    pub state: u32,
}

/// The command frames of one period, in the order of sending.
#[derive(Debug, Clone, Copy)]
pub struct CommandFrames {
    frames: [Frame; CommandField::ALL.len()],
    length: usize,
}

impl CommandFrames {
    /// Of no period yet.
    pub(super) const NONE: Self = Self { frames: [Frame::EMPTY; CommandField::ALL.len()], length: 0 };
}

impl std::ops::Deref for CommandFrames {
    type Target = [Frame];

    fn deref(&self) -> &[Frame] {
        self.frames.get(..self.length).unwrap_or(&[])
    }
}

impl Roles {
    /// The same for frames of a capture: one may be shorter than its message, as long as all signals that the roles name
    /// lie in it. On a bus the length is exact.
    pub(super) fn of_capture(&self) -> Self {
        Self { sensors: self.sensors.of_capture(), commands: self.commands.of_capture() }
    }

    /// Messages that carry sensors, in order of priority.
    #[must_use]
    pub fn sensor_messages(&self) -> &[Route<Channel>] {
        self.sensors.messages()
    }

    /// Messages that carry commands, in order of priority.
    #[must_use]
    pub fn command_messages(&self) -> &[Route<CommandField>] {
        self.commands.messages()
    }

    /// State of a fresh receiver of sensor frames.
    #[must_use]
    pub fn sensor_receiver(&self) -> ReceiverState {
        ReceiverState::new(self.sensors.messages().len())
    }

    /// State of a fresh receiver of command frames.
    #[must_use]
    pub fn command_receiver(&self) -> ReceiverState {
        ReceiverState::new(self.commands.messages().len())
    }

    /// State of a fresh sender of command frames.
    #[must_use]
    pub fn command_sender(&self) -> SenderState {
        SenderState { counters: vec![0; self.commands.messages().len()] }
    }

    /// State of a fresh sender of sensor frames.
    #[must_use]
    pub fn sensor_sender(&self) -> SenderState {
        SenderState { counters: vec![0; self.sensors.messages().len()] }
    }

    /// Whether `frame` has the identifier of a command: on the bench's side of the bus a command, on the bridge's side
    /// somebody else who commands the rotors.
    #[must_use]
    pub fn is_command(&self, frame: &Frame) -> bool {
        self.commands.has(frame)
    }

    /// Takes a received frame's good values into `sensors`; flags the bad ones there and keeps their last good
    /// value and stamp. `stamp_ns` is CLOCK_MONOTONIC at reception. The frame is another sender's, so that one with the
    /// identifier of a command is [`FrameRefusal::ForeignCommand`].
    #[inline]
    pub fn decode_sensors(
        &self,
        state: &mut ReceiverState,
        frame: &Frame,
        stamp_ns: u64,
        sensors: &mut Sensors,
    ) -> Decoded {
        let mut updated = 0;
        let received = state.receive(&self.sensors, frame, |field, reading| {
            let sample = field.of_mut(sensors);
            sample.count = sample.count.wrapping_add(1);
            match reading {
                FrameReading::Value(value) => {
                    sample.value = value;
                    sample.stamp_ns = stamp_ns;
                    sample.health = 0;
                    updated |= field.bit();
                }
                FrameReading::Refused(refusal) => sample.health |= refusal.health(),
            }
        });
        let refused = match received {
            Err(FrameRefusal::UnknownId) if self.commands.has(frame) => {
                state.refuse(FrameRefusal::ForeignCommand)
            }
            Err(refusal) => state.refuse(refusal),
            Ok(refused) => refused,
        };
        state.counts.accepted = state.counts.accepted.wrapping_add(u64::from(updated != 0));
        Decoded { updated, refused }
    }

    /// Takes a received command frame's good values into `commands`; the bad ones leave it as it was.
    #[inline]
    pub fn decode_commands(
        &self,
        state: &mut ReceiverState,
        frame: &Frame,
        stamp_ns: u64,
        commands: &mut RotorCommands,
    ) -> Decoded {
        let mut updated = 0;
        let received = state.receive(&self.commands, frame, |field, reading| {
            let FrameReading::Value(value) = reading else { return };
            let rotor = match field {
                CommandField::Rotor1 => 0,
                CommandField::Rotor2 => 1,
                CommandField::State => {
                    commands.state = value as u32;
                    return;
                }
            };
            commands.rotor[rotor] = value;
            commands.stamp_ns[rotor] = stamp_ns;
            updated |= 1 << rotor;
        });
        let refused = received.unwrap_or_else(|refusal| state.refuse(refusal));
        state.counts.accepted = state.counts.accepted.wrapping_add(u64::from(updated != 0));
        Decoded { updated, refused }
    }

    /// The frames that carry `applied`. A rotor command that is not a number becomes 0; others are cut to 0..1.
    #[must_use]
    #[inline]
    pub fn encode_commands(&self, state: &mut SenderState, applied: &Applied) -> CommandFrames {
        let mut out = CommandFrames::NONE;
        for (route, (counter, frame)) in
            self.commands.messages().iter().zip(state.counters.iter_mut().zip(&mut out.frames))
        {
            *frame = route.emit(counter, |field| match field {
                CommandField::Rotor1 => safe_command(applied.rotor[0]),
                CommandField::Rotor2 => safe_command(applied.rotor[1]),
                CommandField::State => f64::from(applied.state),
            });
            out.length += 1;
        }
        out
    }

    /// Goes on behind a command of another sender that ESCs which follow the counter take for the next of ours: they would refuse
    /// what the guard says from then on, as repeated. Where the message has no counter nothing can be done.
    pub(super) fn go_on_behind(&self, state: &mut SenderState, foreign: &Frame) {
        let Ok((index, route)) = self.commands.find(foreign) else { return };
        if let Some(next) = state.counters.get_mut(index) {
            route.go_on_behind(next, foreign);
        }
    }

    /// The frame of the sensor message with this index in [`Self::sensor_messages`], from `sensors`; `None` when
    /// there is no such message.
    #[must_use]
    #[inline]
    pub fn encode_sensors(&self, state: &mut SenderState, index: usize, sensors: &Sensors) -> Option<Frame> {
        let route = self.sensors.messages().get(index)?;
        let counter = state.counters.get_mut(index)?;
        Some(route.emit(counter, |field| field.of(sensors).value))
    }
}

/// Of causes that a bus on DBC files does not know, nothing is said there.
fn is_zero(count: &u64) -> bool {
    *count == 0
}

pub(super) fn safe_command(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}

impl ReceiverState {
    fn new(messages: usize) -> Self {
        Self { counters: vec![Counter::default(); messages], counts: Counts::default() }
    }

    /// Hands every bound value of the frame to `take`; counts the values that are refused and says the last cause. A
    /// frame that is refused as a whole is the error, and for the caller to count.
    #[inline]
    fn receive<F: Copy>(
        &mut self,
        routes: &Routes<F>,
        frame: &Frame,
        mut take: impl FnMut(F, FrameReading),
    ) -> Result<Option<FrameRefusal>, FrameRefusal> {
        self.counts.frames = self.counts.frames.wrapping_add(1);
        let (index, route) = routes.find(frame)?;
        let counter = self.counters.get_mut(index);
        match counter.map_or(Ok(0), |counter| route.check_counter(counter, frame)) {
            Ok(lost) => {
                self.counts.lost = self.counts.lost.wrapping_add(lost);
                Ok(self.read(route, frame, take))
            }
            Err(refusal) => {
                route.bindings().iter().for_each(|binding| {
                    take(binding.field, FrameReading::Refused(refusal));
                });
                Err(refusal)
            }
        }
    }

    fn refuse(&mut self, refusal: FrameRefusal) -> Option<FrameRefusal> {
        self.counts.add(refusal);
        Some(refusal)
    }

    #[inline]
    fn read<F: Copy>(
        &mut self,
        route: &Route<F>,
        frame: &Frame,
        mut take: impl FnMut(F, FrameReading),
    ) -> Option<FrameRefusal> {
        let mut last = None;
        for binding in route.bindings() {
            let Some(reading) = binding.read(frame.payload()) else { continue };
            if let FrameReading::Refused(refusal) = reading {
                self.counts.add(refusal);
                last = Some(refusal);
            }
            take(binding.field, reading);
        }
        last
    }
}

impl Counts {
    pub(super) fn add(&mut self, refusal: FrameRefusal) {
        let count = match refusal {
            FrameRefusal::UnknownId => &mut self.unknown_id,
            FrameRefusal::ForeignCommand => &mut self.foreign_command,
            FrameRefusal::WrongLength => &mut self.wrong_length,
            FrameRefusal::Counter => &mut self.counter,
            FrameRefusal::Toggle => &mut self.toggle,
            FrameRefusal::Checksum => &mut self.checksum,
            FrameRefusal::Incomplete => &mut self.incomplete,
            FrameRefusal::OtherNode => &mut self.other_node,
            FrameRefusal::NotANumber => &mut self.not_a_number,
            FrameRefusal::OutOfRange => &mut self.out_of_range,
        };
        *count = count.wrapping_add(1);
    }

    /// Frames and values refused, by cause; transfers apart.
    #[must_use]
    pub fn refused(&self) -> [(FrameRefusal, u64); 6] {
        [
            (FrameRefusal::UnknownId, self.unknown_id),
            (FrameRefusal::ForeignCommand, self.foreign_command),
            (FrameRefusal::WrongLength, self.wrong_length),
            (FrameRefusal::Counter, self.counter),
            (FrameRefusal::NotANumber, self.not_a_number),
            (FrameRefusal::OutOfRange, self.out_of_range),
        ]
    }
}
