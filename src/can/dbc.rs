//! The protocol of DBC files: each message is a frame, and what it means stands in a file.

use crate::clock;
use crate::signal::{Applied, Channel, Sensors};

use super::config::BusConfig;
use super::field::CommandField;
use super::frame::Frame;
use super::layout::{ByteOrder, NumberFormat};
use super::load::{BusLoad, worst_case};
use super::protocol::{BenchEnd, BridgeEnd, IdFilter, MessageDescription, Protocol, SignalDescription};
use super::roles::{CommandFrames, Counts, Decoded, ReceiverState, Roles, RotorCommands, SenderState};
use super::route::{Binding, FrameRefusal, Route};

impl Protocol for Roles {
    fn bridge_end(&self) -> Box<dyn BridgeEnd> {
        Box::new(DbcBridge {
            receiver: self.sensor_receiver(),
            sender: self.command_sender(),
            frames: CommandFrames::NONE,
            roles: self.clone(),
        })
    }

    fn bench_end(&self, now_ns: u64) -> Box<dyn BenchEnd> {
        // A period too short to keep would starve the receiver; roles with one were refused by their bus load.
        let period = |period_s| clock::span_ns(period_s).max(50_000);
        let schedule = self.sensor_messages().iter().map(|message| (period(message.period_s), now_ns));
        Box::new(DbcBench {
            receiver: self.command_receiver(),
            sender: self.sensor_sender(),
            schedule: schedule.collect(),
            roles: self.clone(),
        })
    }

    fn capture_ends(&self) -> (Box<dyn BridgeEnd>, Box<dyn BenchEnd>) {
        let roles = self.of_capture();
        (roles.bridge_end(), roles.bench_end(0))
    }

    fn messages(&self) -> Vec<MessageDescription> {
        let command = |route: &Route<CommandField>| {
            let role = |binding: &Binding<CommandField>| format!("commands.{}", binding.field);
            describe(route, true, |binding| signal(binding, role(binding), None, binding.field.si()))
        };
        let sensor = |route: &Route<Channel>| {
            let role = |binding: &Binding<Channel>| format!("sensors.{}", binding.field);
            describe(route, false, |binding| {
                signal(binding, role(binding), Some(binding.field), binding.field.unit())
            })
        };
        let commands = self.command_messages().iter().map(command);
        commands.chain(self.sensor_messages().iter().map(sensor)).collect()
    }

    fn load(&self, config: &BusConfig) -> BusLoad {
        worst_case(self, config)
    }
}

/// For who has the roles in hand: a bus in memory.
impl From<Roles> for Box<dyn BridgeEnd> {
    fn from(roles: Roles) -> Self {
        roles.bridge_end()
    }
}

fn describe<F: Copy>(
    route: &Route<F>,
    is_sent: bool,
    signal: impl Fn(&Binding<F>) -> SignalDescription,
) -> MessageDescription {
    MessageDescription {
        name: route.name.clone(),
        is_sent,
        id: route.id,
        bytes: route.length,
        period_s: route.period_s,
        counter: route.counter.as_ref().map(|(name, _)| name.clone()),
        may_have_counter: true,
        lacks_node: route.lacks_node,
        signals: route.bindings().iter().map(signal).collect(),
    }
}

fn signal<F>(
    binding: &Binding<F>,
    role: String,
    channel: Option<Channel>,
    si_unit: &'static str,
) -> SignalDescription {
    let layout = binding.codec.layout();
    let order = if layout.order == ByteOrder::Little { "little" } else { "big" };
    let number = match layout.number {
        NumberFormat::Unsigned => format!("u{}", layout.size),
        NumberFormat::Signed => format!("i{}", layout.size),
        NumberFormat::Float32 => "f32".to_owned(),
        NumberFormat::Float64 => "f64".to_owned(),
    };
    SignalDescription {
        role,
        channel,
        name: binding.signal.clone(),
        place: format!("{number} {order} at {}", layout.start),
        unit: binding.unit.clone(),
        si_unit,
        factor: binding.codec.factor() * binding.scale,
        offset: binding.codec.offset() * binding.scale + binding.offset,
        range: binding.range,
    }
}

#[derive(Debug)]
struct DbcBridge {
    roles: Roles,
    receiver: ReceiverState,
    sender: SenderState,
    frames: CommandFrames,
}

impl BridgeEnd for DbcBridge {
    fn own(&self) -> Vec<IdFilter> {
        self.roles.command_messages().iter().map(|message| IdFilter::exactly(message.id)).collect()
    }

    fn receive(&mut self, frame: &Frame, stamp_ns: u64, sensors: &mut Sensors) -> Decoded {
        let decoded = self.roles.decode_sensors(&mut self.receiver, frame, stamp_ns, sensors);
        if decoded.refused == Some(FrameRefusal::ForeignCommand) {
            self.roles.go_on_behind(&mut self.sender, frame);
        }
        decoded
    }

    fn commands(&mut self, applied: &Applied) -> &[Frame] {
        self.frames = self.roles.encode_commands(&mut self.sender, applied);
        &self.frames
    }

    fn counts(&self) -> Counts {
        self.receiver.counts
    }
}

#[derive(Debug)]
struct DbcBench {
    roles: Roles,
    receiver: ReceiverState,
    sender: SenderState,
    /// [ns] period of each sensor message, and when it is due next.
    schedule: Vec<(u64, u64)>,
}

impl BenchEnd for DbcBench {
    fn is_command(&self, frame: &Frame) -> bool {
        self.roles.is_command(frame)
    }

    fn receive(&mut self, frame: &Frame, stamp_ns: u64, commands: &mut RotorCommands) -> Decoded {
        self.roles.decode_commands(&mut self.receiver, frame, stamp_ns, commands)
    }

    fn due_ns(&self) -> u64 {
        self.schedule.iter().map(|(_, due)| *due).min().unwrap_or(u64::MAX)
    }

    fn send_due(&mut self, now_ns: u64, sensors: &Sensors, send: &mut dyn FnMut(&Frame)) -> bool {
        let mut any = false;
        for (index, (period, due)) in self.schedule.iter_mut().enumerate() {
            if *due > now_ns {
                continue;
            }
            // Messages missed while the machine slept are not sent in a burst.
            *due = due.saturating_add(period.saturating_mul((now_ns - *due) / *period + 1));
            let fields = self.roles.sensor_messages().get(index).map(Route::bindings);
            let has_values = |bindings: &[Binding<Channel>]| {
                bindings.iter().any(|binding| binding.field.of(sensors).stamp_ns > 0)
            };
            if !fields.is_some_and(has_values) {
                continue;
            }
            if let Some(frame) = self.roles.encode_sensors(&mut self.sender, index, sensors) {
                send(&frame);
                any = true;
            }
        }
        any
    }

    fn counts(&self) -> Counts {
        self.receiver.counts
    }
}
