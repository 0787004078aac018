//! Parameters of a node: asks it, one question at a time, and hears meanwhile whether rotors may turn on this bus.

use std::fmt;

use crate::can::error::CanError;
use crate::can::frame::Frame;
use crate::can::resolve::fail;
use crate::can::thresholds::THRESHOLDS;

use super::assembler::{Assembler, Subscription};
use super::common::{Common, name};
use super::dsdl::Structure;
use super::library::Library;
use super::node::Node;
use super::participant::Participant;
use super::service::Service;
use super::transfer::{Framing, GREATEST_NODE, TransferFrames, TransferId, TransferKind};
use super::value::{Value, decode, encode};

/// How this node names itself while it asks.
const NAME: &str = "org.rotorbench.param";
/// `ExecuteOpcode`: keep what is set over a restart.
const SAVE: i128 = 0;
/// [byte] of a text.
const LONGEST_TEXT: usize = 128;
/// What it listens to: the places of its subscriptions.
const STATUS: usize = 0;
const ARMING: usize = 1;
const RAW: usize = 2;
const RPM: usize = 3;
const PARAMETER: usize = 4;
const INFO_REQUEST: usize = 6;

/// What a parameter may be.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterValue {
    /// A whole number.
    Integer(i64),
    /// A number.
    Real(f32),
    /// Yes or no.
    Boolean(bool),
    /// Text.
    Text(String),
}

/// A parameter as its node says it. What it does not say is missing.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeParameter {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: Option<ParameterValue>,
    /// What it is unless somebody sets it.
    pub default: Option<ParameterValue>,
    /// Least value; of numbers only.
    pub least: Option<ParameterValue>,
    /// Greatest value; of numbers only.
    pub greatest: Option<ParameterValue>,
}

/// What a node is asked.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterRequest {
    /// The parameter with this number, from 0.
    At(u16),
    /// The parameter of this name.
    Named(String),
    /// To give the parameter of this name this value.
    Set(String, ParameterValue),
    /// To keep its parameters over a restart.
    Save,
}

/// What it answers.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterResponse {
    /// A parameter; `None` where it has none of this number or name.
    Parameter(Option<NodeParameter>),
    /// Whether it did what was asked for.
    Done(bool),
    /// Nothing, though asked again and again.
    Silence,
}

/// What was heard of others: the node, and when [ns].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Heard {
    /// Said that rotors may turn.
    pub armed: Option<(u8, u64)>,
    /// Commanded a rotor to turn.
    pub commanded: Option<(u8, u64)>,
    /// Sent under our own number.
    pub is_id_taken: bool,
}

/// A question that waits for its answer.
#[derive(Debug)]
struct Pending {
    is_opcode: bool,
    payload: Vec<u8>,
    transfer_id: u8,
    /// [ns] when it was asked last; 0 = not yet.
    asked_ns: u64,
    tries: u32,
}

/// Asks a node for its parameters.
#[derive(Debug)]
pub struct ParameterClient {
    node: u8,
    common: Common,
    commands: [Structure; 2],
    assembler: Assembler,
    own: Node,
    transfer_ids: [TransferId; 2],
    pending: Option<Pending>,
    answer: Option<ParameterResponse>,
    heard: Heard,
}

impl ParameterClient {
    /// Asks `node` as the node with the number `own`.
    ///
    /// # Errors
    /// [`CanError::Role`] when one of them is no node's number, or both are the same.
    pub fn new(own: u8, node: u8) -> Result<Self, CanError> {
        for (place, id) in [("dronecan.node_id", own), ("dronecan", node)] {
            if !(1..=GREATEST_NODE).contains(&id) {
                return Err(fail(place, format!("{id} is no node id of 1 to {GREATEST_NODE}")));
            }
        }
        if own == node {
            return Err(fail("dronecan.node_id", format!("node {own} cannot ask itself")));
        }
        let library = Library::build(&[])?;
        let common = Common::build(&library)?;
        let message = |name: &str| {
            let compound = library.get(name).ok_or_else(|| fail("dronecan", format!("no type `{name}`")))?;
            let missing = || fail("dronecan", format!("`{name}` is no message"));
            let (message, id) = compound.message().zip(compound.id).ok_or_else(missing)?;
            let subscription =
                Subscription::new(id, TransferKind::Message, compound.signature, message.most_bits());
            Ok::<_, CanError>((message.clone(), subscription))
        };
        let (raw, raw_subscription) = message(name::RAW_COMMAND)?;
        let (rpm, rpm_subscription) = message(name::RPM_COMMAND)?;
        let subscriptions = vec![
            common.status,
            common.arming,
            raw_subscription,
            rpm_subscription,
            common.get_set.responses_to(own),
            common.execute_opcode.responses_to(own),
            common.info_request(own),
        ];
        Ok(Self {
            node,
            assembler: Assembler::new(subscriptions),
            own: Node::new(&common, own, NAME),
            commands: [raw, rpm],
            transfer_ids: [TransferId::default(); 2],
            pending: None,
            answer: None,
            heard: Heard::default(),
            common,
        })
    }

    /// Asks; what was asked before and has no answer is given up.
    ///
    /// # Errors
    /// [`CanError::Role`] for a name or text that is longer than a message may hold.
    pub fn ask(&mut self, question: &ParameterRequest) -> Result<(), CanError> {
        let is_opcode = *question == ParameterRequest::Save;
        let service = self.service(is_opcode);
        let payload = encode(&service.request, &request(question), Framing::Classic)
            .map_err(|_| fail("dronecan", "a name of 92 bytes at most, a text of 128".to_owned()))?;
        self.pending = Some(Pending { is_opcode, payload, transfer_id: 0, asked_ns: 0, tries: 0 });
        self.answer = None;
        Ok(())
    }

    /// The answer, once.
    pub fn take_answer(&mut self) -> Option<ParameterResponse> {
        self.answer.take()
    }

    /// What was heard of others so far.
    #[must_use]
    pub fn heard(&self) -> Heard {
        self.heard
    }

    fn service(&self, is_opcode: bool) -> &Service {
        if is_opcode { &self.common.execute_opcode } else { &self.common.get_set }
    }
}

impl Participant for ParameterClient {
    fn receive(&mut self, frame: &Frame, now_ns: u64) {
        let Self { node, common, commands, assembler, own, pending, answer, heard, .. } = self;
        // What is not whole is asked for again.
        let Ok(Some(transfer)) = assembler.receive(frame, now_ns) else { return };
        let source = transfer.header.source;
        heard.is_id_taken |= source == own.id;
        match transfer.subscription {
            STATUS => {}
            INFO_REQUEST => own.ask(&transfer),
            ARMING if transfer.payload == [255] => heard.armed = Some((source, now_ns)),
            ARMING => {}
            RAW | RPM => {
                let structure = &commands[usize::from(transfer.subscription == RPM)];
                if decode(structure, transfer.payload, transfer.framing).is_ok_and(|command| turns(&command))
                {
                    heard.commanded = Some((source, now_ns));
                }
            }
            response => {
                let is_opcode = response != PARAMETER;
                let is_meant = pending.as_ref().is_some_and(|it| {
                    it.is_opcode == is_opcode && it.tries > 0 && it.transfer_id == transfer.transfer_id
                });
                if source != *node || !is_meant {
                    return;
                }
                let service = if is_opcode { &common.execute_opcode } else { &common.get_set };
                let Ok(Value::List(fields)) = decode(&service.response, transfer.payload, transfer.framing)
                else {
                    return;
                };
                if let Some(said) = understood(&fields, is_opcode) {
                    (*answer, *pending) = (Some(said), None);
                }
            }
        }
    }

    fn due_frames(&mut self, now_ns: u64) -> Vec<Frame> {
        let mut frames: Vec<Frame> = self.own.status(now_ns, 0).into_iter().collect();
        frames.extend(std::iter::from_fn(|| self.own.answer()));
        let Self { node, common, own, pending, answer, transfer_ids, .. } = self;
        let Some(question) = pending else { return frames };
        if question.tries > 0 && now_ns.saturating_sub(question.asked_ns) < THRESHOLDS.ask_again_ns {
            return frames;
        }
        if question.tries == THRESHOLDS.most_asked {
            (*answer, *pending) = (Some(ParameterResponse::Silence), None);
            return frames;
        }
        let service = if question.is_opcode { &common.execute_opcode } else { &common.get_set };
        let transfer_id = transfer_ids[usize::from(question.is_opcode)].take();
        (question.transfer_id, question.asked_ns) = (transfer_id, now_ns);
        question.tries += 1;
        let header = service.request(own.id, *node);
        frames.extend(TransferFrames::new(header, service.seed(), transfer_id, &question.payload));
        frames
    }
}

/// Whether a command turns a rotor.
fn turns(command: &Value) -> bool {
    match command {
        Value::Integer(number) => *number != 0,
        Value::List(values) => values.iter().any(turns),
        _ => false,
    }
}

/// The request that a question is.
fn request(question: &ParameterRequest) -> Value {
    let text = |text: &str| Value::List(text.bytes().map(|it| Value::Integer(i128::from(it))).collect());
    let nothing = || Value::Union(0, Box::new(Value::List(Vec::new())));
    let (index, value, name) = match question {
        ParameterRequest::At(index) => (i128::from(*index), nothing(), ""),
        ParameterRequest::Named(name) => (0, nothing(), name.as_str()),
        ParameterRequest::Set(name, value) => {
            let (kind, value) = match value {
                ParameterValue::Integer(value) => (1, Value::Integer(i128::from(*value))),
                ParameterValue::Real(value) => (2, Value::Float(f64::from(*value))),
                ParameterValue::Boolean(value) => (3, Value::Integer(i128::from(*value))),
                ParameterValue::Text(value) => (4, text(value)),
            };
            (0, Value::Union(kind, Box::new(value)), name.as_str())
        }
        ParameterRequest::Save => return Value::List(vec![Value::Integer(SAVE), Value::Integer(0)]),
    };
    Value::List(vec![Value::Integer(index), value, text(name)])
}

/// What a response says; `None`: nothing that can be understood.
fn understood(fields: &[Value], is_opcode: bool) -> Option<ParameterResponse> {
    if is_opcode {
        let [_, Value::Integer(ok)] = fields else { return None };
        return Some(ParameterResponse::Done(*ok != 0));
    }
    let [value, default, greatest, least, name] = fields else { return None };
    let name = text(name)?;
    // Without a name there is none, whatever else stands there.
    let parameter = (!name.is_empty()).then(|| NodeParameter {
        name,
        value: read(value),
        default: read(default),
        least: read(least),
        greatest: read(greatest),
    });
    Some(ParameterResponse::Parameter(parameter))
}

fn text(value: &Value) -> Option<String> {
    let Value::List(bytes) = value else { return None };
    let byte = |value: &Value| match value {
        Value::Integer(byte) => u8::try_from(*byte).ok(),
        _ => None,
    };
    let bytes: Option<Vec<u8>> = bytes.iter().map(byte).collect();
    // Control characters would move what is shown around it.
    let shown = |letter: char| if letter.is_control() { '\u{FFFD}' } else { letter };
    Some(String::from_utf8_lossy(&bytes?).chars().map(shown).collect())
}

/// The value that a union holds; `None`: none. The first three kinds are those of `NumericValue`, too.
fn read(value: &Value) -> Option<ParameterValue> {
    let Value::Union(kind, value) = value else { return None };
    match (kind, &**value) {
        (1, Value::Integer(value)) => i64::try_from(*value).ok().map(ParameterValue::Integer),
        (2, Value::Float(value)) => Some(ParameterValue::Real(*value as f32)),
        (3, Value::Integer(value)) => Some(ParameterValue::Boolean(*value != 0)),
        (4, value) => text(value).map(ParameterValue::Text),
        _ => None,
    }
}

impl ParameterValue {
    /// What such a value is, as a word.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Integer(_) => "a whole number",
            Self::Real(_) => "a number",
            Self::Boolean(_) => "true or false",
            Self::Text(_) => "a text",
        }
    }

    /// The value of the same type that `text` is.
    #[must_use]
    pub fn read_as(&self, text: &str) -> Option<Self> {
        match self {
            Self::Integer(_) => text.parse().ok().map(Self::Integer),
            Self::Real(_) => text.parse().ok().filter(|it: &f32| it.is_finite()).map(Self::Real),
            Self::Boolean(_) => match text {
                "true" | "1" => Some(Self::Boolean(true)),
                "false" | "0" => Some(Self::Boolean(false)),
                _ => None,
            },
            Self::Text(_) => (text.len() <= LONGEST_TEXT).then(|| Self::Text(text.to_owned())),
        }
    }

    /// Whether it is in a range of which either end may be missing. A limit of another type is none.
    #[must_use]
    pub fn is_within(&self, least: Option<&Self>, greatest: Option<&Self>) -> bool {
        let is_above = |limit: &Self| match (self, limit) {
            (Self::Integer(value), Self::Integer(limit)) => value >= limit,
            (Self::Real(value), Self::Real(limit)) => value >= limit,
            _ => true,
        };
        let is_below = |limit: &Self| match (self, limit) {
            (Self::Integer(value), Self::Integer(limit)) => value <= limit,
            (Self::Real(value), Self::Real(limit)) => value <= limit,
            _ => true,
        };
        least.is_none_or(is_above) && greatest.is_none_or(is_below)
    }
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(value) => write!(formatter, "{value}"),
            Self::Real(value) => write!(formatter, "{value}"),
            Self::Boolean(value) => write!(formatter, "{value}"),
            Self::Text(value) => write!(formatter, "{value}"),
        }
    }
}
