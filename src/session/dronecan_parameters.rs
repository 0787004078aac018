//! Parameters of a node on DroneCAN: read, and written while no rotor can turn.

use super::dronecan_error::ParameterError;
use super::dronecan_own_id::own_node_id;
use super::dronecan_wire::{PortWire, Wire};
use super::thresholds::THRESHOLDS;
use crate::can::dronecan::{
    NodeParameter, ParameterClient, ParameterRequest, ParameterResponse, ParameterValue,
};
use crate::guard::State;
use crate::runtime::operator::{self, GuardLook};

/// Most parameters of a node: its number has thirteen bits.
const MOST_PARAMETERS: u16 = 1 << 13;

/// What is wished of a node's parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ParameterTask {
    /// The node.
    pub node: u8,
    /// Which parameter; `None` = all.
    pub name: Option<String>,
    /// What it is to be, as text.
    pub value: Option<String>,
    /// Whether the node is to keep its parameters over a restart.
    pub save: bool,
}

/// Does what is wished, as the node with the number `own` or one that nobody has; the parameters that it is about, as they are then.
///
/// # Errors
/// [`ParameterError`]; nothing is written unless every bench of this machine and everybody on the bus is disarmed.
pub fn dronecan_parameters(
    interface: &str,
    own: Option<u8>,
    task: &ParameterTask,
) -> Result<Vec<NodeParameter>, ParameterError> {
    let mut wire = PortWire::open(interface)?;
    let own = own_node_id(&mut wire, own, |id| id == task.node)?;
    let client = ParameterClient::new(own, task.node)?;
    Asking { wire, client, own, node: task.node, benches: &operator::look }.fulfil(task)
}

/// What the guards of this machine's benches say.
type Benches<'a> = &'a dyn Fn() -> Vec<(String, GuardLook)>;

/// Somebody who asks a node on a bus.
struct Asking<'a, W: Wire> {
    wire: W,
    client: ParameterClient,
    own: u8,
    node: u8,
    benches: Benches<'a>,
}

impl<W: Wire> Asking<'_, W> {
    fn fulfil(&mut self, task: &ParameterTask) -> Result<Vec<NodeParameter>, ParameterError> {
        let writes = task.value.is_some() || task.save;
        if writes {
            self.check_benches()?;
            // Who may turn rotors says so again and again.
            let until_ns = self.wire.now_ns().saturating_add(THRESHOLDS.disarmed_for_ns);
            while self.wire.turn(&mut self.client, until_ns)? < until_ns {}
            self.check_bus()?;
        }
        let mut parameters = match (&task.name, &task.value) {
            (Some(name), Some(value)) => vec![self.set(name, value)?],
            (Some(name), None) => vec![self.named(name)?],
            (None, _) => self.all()?,
        };
        if task.save {
            self.check_benches()?;
            match self.ask(&ParameterRequest::Save)? {
                ParameterResponse::Done(true) => {}
                _ => return Err(ParameterError::NotSaved { node: self.node }),
            }
        }
        parameters.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(parameters)
    }

    /// Asks, and waits for the answer.
    fn ask(&mut self, question: &ParameterRequest) -> Result<ParameterResponse, ParameterError> {
        self.client.ask(question)?;
        let until_ns = self.wire.now_ns().saturating_add(THRESHOLDS.longest_exchange_ns);
        let writes = matches!(question, ParameterRequest::Set(..) | ParameterRequest::Save);
        let mut now_ns = 0;
        while now_ns < until_ns {
            if writes {
                // Asked again, it would be written again.
                self.check_bus()?;
            }
            now_ns = self.wire.turn(&mut self.client, until_ns)?;
            if self.client.heard().is_id_taken {
                return Err(ParameterError::Taken { own: self.own });
            }
            match self.client.take_answer() {
                Some(ParameterResponse::Silence) => break,
                Some(answer) => return Ok(answer),
                None => {}
            }
        }
        Err(ParameterError::Silent { node: self.node })
    }

    fn all(&mut self) -> Result<Vec<NodeParameter>, ParameterError> {
        let mut all = Vec::new();
        for index in 0..MOST_PARAMETERS {
            match self.ask(&ParameterRequest::At(index))? {
                ParameterResponse::Parameter(Some(parameter)) => all.push(parameter),
                _ => break,
            }
        }
        Ok(all)
    }

    fn named(&mut self, name: &str) -> Result<NodeParameter, ParameterError> {
        match self.ask(&ParameterRequest::Named(name.to_owned()))? {
            ParameterResponse::Parameter(Some(parameter)) => Ok(parameter),
            _ => Err(ParameterError::NoSuch { node: self.node, name: name.to_owned() }),
        }
    }

    fn set(&mut self, name: &str, text: &str) -> Result<NodeParameter, ParameterError> {
        let before = self.named(name)?;
        let value = wanted(&before, text)?;
        self.check_benches()?;
        let question = ParameterRequest::Set(name.to_owned(), value.clone());
        let ParameterResponse::Parameter(Some(after)) = self.ask(&question)? else {
            return Err(ParameterError::NoSuch { node: self.node, name: name.to_owned() });
        };
        if after.value.as_ref() == Some(&value) {
            return Ok(after);
        }
        Err(ParameterError::NotTaken { node: self.node, name: name.to_owned(), kept: after.value })
    }

    fn check_benches(&self) -> Result<(), ParameterError> {
        for (bench, look) in (self.benches)() {
            match look {
                GuardLook::State(State::Disarmed) | GuardLook::NoGuard => {}
                GuardLook::State(state) => return Err(ParameterError::Armed { bench, state }),
                GuardLook::Silent => return Err(ParameterError::Unknown { bench }),
            }
        }
        Ok(())
    }

    fn check_bus(&self) -> Result<(), ParameterError> {
        let now_ns = self.wire.now_ns();
        let is_recent = |heard: Option<(u8, u64)>| {
            heard
                .filter(|(_, stamp_ns)| now_ns.saturating_sub(*stamp_ns) <= THRESHOLDS.disarmed_for_ns)
                .map(|(node, _)| node)
        };
        let heard = self.client.heard();
        if let Some(node) = is_recent(heard.armed) {
            return Err(ParameterError::ArmedOnBus { node });
        }
        match is_recent(heard.commanded) {
            Some(node) => Err(ParameterError::Commanded { node }),
            None => Ok(()),
        }
    }
}

/// The value that `text` is of the parameter's type, if that may be.
fn wanted(parameter: &NodeParameter, text: &str) -> Result<ParameterValue, ParameterError> {
    let name = || parameter.name.clone();
    let kind = parameter.value.as_ref().or(parameter.default.as_ref());
    let kind = kind.ok_or_else(|| ParameterError::NoValue { name: name() })?;
    let value = kind.read_as(text).ok_or_else(|| ParameterError::WrongType {
        name: name(),
        kind: kind.clone(),
        value: text.to_owned(),
    })?;
    if value.is_within(parameter.least.as_ref(), parameter.greatest.as_ref()) {
        return Ok(value);
    }
    let (least, greatest) = (parameter.least.clone(), parameter.greatest.clone());
    Err(ParameterError::OutOfRange { name: name(), value: text.to_owned(), least, greatest })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::dronecan::Participant;
    use crate::can::{BenchEnd, BusConfig, CanError, Frame, ProtocolName, RotorCommands, protocol};
    use crate::signal::Sensors;

    const S: u64 = crate::clock::NANOSECONDS_PER_SECOND;

    /// The emulated ESCs, on a clock that goes on by 10 ms a turn, and what others say.
    struct Emulated {
        bench: Box<dyn BenchEnd>,
        now_ns: u64,
        others: Vec<(u64, Frame)>,
    }

    impl Wire for Emulated {
        fn turn(&mut self, client: &mut dyn Participant, _until_ns: u64) -> Result<u64, CanError> {
            self.now_ns += S / 100;
            for frame in client.due_frames(self.now_ns) {
                self.bench.receive(&frame, self.now_ns, &mut RotorCommands::default());
            }
            let now_ns = self.now_ns;
            self.bench.send_due(now_ns, &Sensors::default(), &mut |frame| client.receive(frame, now_ns));
            for (_, frame) in self.others.extract_if(.., |(at_ns, _)| *at_ns <= now_ns) {
                client.receive(&frame, now_ns);
            }
            Ok(now_ns)
        }

        fn now_ns(&self) -> u64 {
            self.now_ns
        }
    }

    /// What `task` comes to, beside what others say at the given times.
    fn fulfilled(
        task: &ParameterTask,
        others: Vec<(u64, Frame)>,
        benches: Benches<'_>,
    ) -> (Result<Vec<NodeParameter>, ParameterError>, u64) {
        let bus = BusConfig { protocol: ProtocolName::Dronecan, ..BusConfig::default() };
        let bench = protocol(&bus, 0.02).expect("sound").bench_end(S);
        let wire = Emulated { bench, now_ns: S, others };
        let client = ParameterClient::new(127, task.node).expect("numbers");
        let mut asking = Asking { wire, client, own: 127, node: task.node, benches };
        let result = asking.fulfil(task);
        (result, asking.wire.now_ns)
    }

    fn nobody() -> Vec<(String, GuardLook)> {
        Vec::new()
    }

    fn write(name: &str, value: &str) -> ParameterTask {
        let (name, value) = (Some(name.to_owned()), Some(value.to_owned()));
        ParameterTask { node: 20, name, value, save: false }
    }

    fn armed_by(node: u8, at_ns: u64) -> (u64, Frame) {
        let id = crate::can::Id::new(0x1004_4C00 | u32::from(node), true).expect("29 bits");
        (at_ns, Frame::classic(id, &[255, 0xC0]).expect("short"))
    }

    #[test]
    fn all_are_read_at_once_and_one_is_written_after_nobody_armed_for_three_seconds() {
        let read = ParameterTask { node: 21, ..ParameterTask::default() };
        let (all, now_ns) = fulfilled(&read, Vec::new(), &nobody);
        let names: Vec<String> = all.expect("read").into_iter().map(|it| it.name).collect();
        assert_eq!(names, ["esc_index", "reversed", "timeout_s"]);
        assert!(now_ns < 2 * S, "reading waits for nobody");
        let (written, now_ns) = fulfilled(&write("timeout_s", "0.1"), Vec::new(), &nobody);
        let [only] = &written.expect("written")[..] else { panic!("one") };
        assert_eq!(only.value, Some(ParameterValue::Real(0.1)));
        assert!(now_ns >= 4 * S);
        let save = ParameterTask { save: true, ..write("esc_index", "3") };
        let (written, _) = fulfilled(&save, Vec::new(), &nobody);
        assert_eq!(written.expect("saved")[0].value, Some(ParameterValue::Integer(3)));
    }

    #[test]
    fn what_cannot_be_is_refused_in_a_sentence() {
        let said =
            |task: &ParameterTask| fulfilled(task, Vec::new(), &nobody).0.expect_err("refused").to_string();
        assert_eq!(said(&write("esc_index", "20")), "`esc_index` takes 0 to 19: 20 is out of range");
        assert_eq!(said(&write("esc_index", "1.5")), "`esc_index` is a whole number: `1.5` is none");
        assert_eq!(said(&write("timeout_s", "nan")), "`timeout_s` is a number: `nan` is none");
        assert_eq!(said(&write("timeout_s", "6")), "`timeout_s` takes 0.05 to 5: 6 is out of range");
        assert_eq!(said(&write("reversed", "no")), "`reversed` is true or false: `no` is none");
        let none = "node 20 has no parameter `gain`; without a name all are shown";
        assert_eq!(said(&write("gain", "1")), none);
        let read = ParameterTask { node: 20, name: Some("gain".to_owned()), ..ParameterTask::default() };
        assert_eq!(said(&read), none);
        let silent = ParameterTask { node: 99, ..ParameterTask::default() };
        assert_eq!(said(&silent), "node 99 does not answer");
    }

    #[test]
    fn nothing_is_written_while_somebody_arms_or_commands() {
        let task = write("timeout_s", "0.1");
        let (armed, _) = fulfilled(&task, vec![armed_by(100, 2 * S)], &nobody);
        assert!(matches!(armed, Err(ParameterError::ArmedOnBus { node: 100 })), "{armed:?}");
        // Between the listening and the writing: the last look is before the frame that writes.
        let (armed, _) = fulfilled(&task, vec![armed_by(100, 4 * S + S / 100)], &nobody);
        assert!(matches!(armed, Err(ParameterError::ArmedOnBus { node: 100 })), "{armed:?}");
        let save = ParameterTask { node: 20, save: true, ..ParameterTask::default() };
        let (armed, _) = fulfilled(&save, vec![armed_by(100, 4 * S + S / 100)], &nobody);
        assert!(matches!(armed, Err(ParameterError::ArmedOnBus { node: 100 })), "{armed:?}");
        let id = crate::can::Id::new(0x0804_0607, true).expect("29 bits");
        let command = Frame::classic(id, &[0x10, 0x00, 0xC0]).expect("short");
        let (commanded, _) = fulfilled(&task, vec![(2 * S, command)], &nobody);
        assert!(matches!(commanded, Err(ParameterError::Commanded { node: 7 | 6 })), "{commanded:?}");
        // Reading harms nobody.
        let read = ParameterTask { value: None, ..task };
        fulfilled(&read, vec![armed_by(100, S)], &nobody).0.expect("read");
        let (taken, _) = fulfilled(&read, vec![armed_by(127, S)], &nobody);
        assert!(matches!(taken, Err(ParameterError::Taken { own: 127 })), "{taken:?}");
    }

    #[test]
    fn nothing_is_written_while_a_bench_of_this_machine_is_not_disarmed() {
        let task = write("timeout_s", "0.1");
        let look = |look: GuardLook| fulfilled(&task, Vec::new(), &|| vec![("one".to_owned(), look)]).0;
        look(GuardLook::State(State::Disarmed)).expect("written");
        look(GuardLook::NoGuard).expect("a recorder harms nobody");
        for state in
            [State::PreArm, State::Armed, State::Degraded, State::FailsafeLatched, State::EmergencyStop]
        {
            let refused = look(GuardLook::State(state));
            assert!(matches!(refused, Err(ParameterError::Armed { .. })), "{state}: {refused:?}");
        }
        let refused = look(GuardLook::Silent);
        assert!(matches!(refused, Err(ParameterError::Unknown { .. })), "{refused:?}");
    }
}
