//! Frames of many senders, one through the other, to whole transfers.
//!
//! Each sender of each type has a place of its own, made at the start: nothing is allocated later, no sender takes another
//! one's room, and a frame costs the same whatever it is. A transfer that is not whole moves nothing and is counted by cause.

use crate::can::frame::{Frame, FrameKind, Id};
use crate::can::route::FrameRefusal;
use crate::can::thresholds::THRESHOLDS;

use super::crc;
use super::transfer::{
    FD_FRAME_BYTES, FRAME_BYTES, Framing, GREATEST_NODE, Tail, TransferHeader, TransferKind,
};

/// Places for senders: the node ids, 0 among them.
const SENDERS: usize = GREATEST_NODE as usize + 1;
/// Numbers of transfers, after which they begin again.
const TRANSFER_IDS: u8 = 32;

/// A kind of transfer that is listened to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Subscription {
    /// Data type id.
    pub type_id: u16,
    /// A message, or a request or response to the node named in it.
    pub kind: TransferKind,
    /// What the checksum begins with.
    pub seed: u16,
    /// [byte] greatest length of a payload, zeros at the end of FD frames aside.
    pub most: usize,
}

impl Subscription {
    /// To transfers of the type with this signature.
    #[must_use]
    pub fn new(type_id: u16, kind: TransferKind, signature: u64, most_bits: usize) -> Self {
        Self { type_id, kind, seed: crc::transfer_seed(signature), most: most_bits.div_ceil(8) }
    }

    /// [byte] that the frames of a transfer of several have together at most, their tail bytes aside.
    #[inline]
    fn room(&self, framing: Framing) -> usize {
        match framing {
            Framing::Classic => self.most + 2,
            Framing::Fd => framing.sent_bytes(self.most),
        }
    }

    /// [byte] of the place for one sender.
    fn stride(&self) -> usize {
        self.room(Framing::Classic).max(self.room(Framing::Fd))
    }
}

/// A whole transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Transfer<'a> {
    /// Which of the subscriptions.
    pub subscription: usize,
    /// What its identifier says.
    pub header: TransferHeader,
    /// In which frames it came, and how it is to be read.
    pub framing: Framing,
    /// Its number.
    pub transfer_id: u8,
    /// [ns] when its first frame came.
    pub stamp_ns: u64,
    /// Transfers missing before it, by its number.
    pub lost: u64,
    /// What it carries; from FD frames with the zeros at its end.
    pub payload: &'a [u8],
}

/// Of one sender of one type.
#[derive(Debug, Clone, Copy, Default)]
struct Session {
    /// Number and end [ns] of the last whole transfer.
    last: Option<(u8, u64)>,
    /// The transfer under way.
    current: Option<Current>,
}

#[derive(Debug, Clone, Copy)]
struct Current {
    framing: Framing,
    transfer_id: u8,
    toggle: bool,
    /// Bytes so far, the checksum's two included.
    length: usize,
    first_ns: u64,
    newest_ns: u64,
    lost: u64,
}

/// Puts transfers together.
#[derive(Debug, Clone)]
pub struct Assembler {
    subscriptions: Vec<Subscription>,
    /// Kind, type and place of the subscriptions, sorted.
    index: Vec<(TransferKind, u16, usize)>,
    sessions: Vec<Session>,
    /// Room for the payloads of each subscription, one for each sender.
    rooms: Vec<Vec<u8>>,
    /// The payload of the last transfer of one frame.
    short: [u8; FD_FRAME_BYTES],
}

impl Assembler {
    /// Listens to these; of two for the same the first.
    #[must_use]
    pub fn new(subscriptions: Vec<Subscription>) -> Self {
        let each = subscriptions.iter().enumerate();
        let mut index: Vec<_> = each.map(|(at, it)| (it.kind, it.type_id, at)).collect();
        index.sort_unstable();
        let room = |it: &Subscription| {
            if it.most > FRAME_BYTES { vec![0; SENDERS * it.stride()] } else { Vec::new() }
        };
        Self {
            sessions: vec![Session::default(); SENDERS * subscriptions.len()],
            rooms: subscriptions.iter().map(room).collect(),
            index,
            subscriptions,
            short: [0; FD_FRAME_BYTES],
        }
    }

    /// What is listened to.
    #[must_use]
    pub fn subscriptions(&self) -> &[Subscription] {
        &self.subscriptions
    }

    /// Which subscription a frame belongs to, and what its identifier says.
    #[inline]
    pub fn find(&self, frame: &Frame) -> Option<(usize, TransferHeader)> {
        let Id::Extended(id) = frame.id() else { return None };
        if frame.kind() == FrameKind::Remote {
            return None;
        }
        let header = TransferHeader::parse(id);
        let at = self.index.partition_point(|entry| (entry.0, entry.1) < (header.kind, header.type_id));
        let (kind, type_id, place) = self.index.get(at)?;
        ((*kind, *type_id) == (header.kind, header.type_id)).then_some((*place, header))
    }

    /// Takes a frame that came at `stamp_ns`; the transfer that it completes.
    ///
    /// # Errors
    /// Why the frame is not part of one.
    #[inline]
    pub fn receive(&mut self, frame: &Frame, stamp_ns: u64) -> Result<Option<Transfer<'_>>, FrameRefusal> {
        let (subscription, header) = self.find(frame).ok_or(FrameRefusal::UnknownId)?;
        let [data @ .., tail] = frame.data() else { return Err(FrameRefusal::WrongLength) };
        let (tail, framing) = (Tail::parse(*tail), Framing::of(frame));
        let most = match framing {
            Framing::Classic => FRAME_BYTES,
            // Longer than any message of the type.
            Framing::Fd => {
                self.subscriptions.get(subscription).map_or(0, |it| it.room(framing)).max(FRAME_BYTES)
            }
        };
        if data.len() > most {
            return Err(FrameRefusal::WrongLength);
        }
        let session = SENDERS * subscription + usize::from(header.source);
        if header.source == 0 {
            return self.anonymous((subscription, header, tail, framing), data, stamp_ns);
        }
        let session = self.sessions.get_mut(session).ok_or(FrameRefusal::UnknownId)?;
        let lost = if tail.start { session.begin(tail, framing, stamp_ns)? } else { 0 };
        if tail.start && tail.end {
            if tail.toggle {
                return Err(FrameRefusal::Toggle);
            }
            session.last = Some((tail.transfer_id, stamp_ns));
            self.short[..data.len()].copy_from_slice(data);
            let payload = self.short.get(..data.len()).unwrap_or(&[]);
            let transfer_id = tail.transfer_id;
            return Ok(Some(Transfer {
                subscription,
                header,
                framing,
                transfer_id,
                stamp_ns,
                lost,
                payload,
            }));
        }
        self.go_on((subscription, header, tail, framing), data, stamp_ns)
    }

    /// The next frame of a transfer of several.
    fn go_on(
        &mut self,
        (subscription, header, tail, framing): (usize, TransferHeader, Tail, Framing),
        data: &[u8],
        stamp_ns: u64,
    ) -> Result<Option<Transfer<'_>>, FrameRefusal> {
        let (Some(of), Some(rooms)) =
            (self.subscriptions.get(subscription).copied(), self.rooms.get_mut(subscription))
        else {
            return Err(FrameRefusal::UnknownId);
        };
        let sender = usize::from(header.source);
        let session =
            self.sessions.get_mut(SENDERS * subscription + sender).ok_or(FrameRefusal::UnknownId)?;
        let current = session.part(tail, framing, stamp_ns)?;
        let begin = sender * of.stride();
        let room = rooms.get_mut(begin..begin + of.room(framing)).unwrap_or(&mut []);
        let end = current.length + data.len();
        let Some(place) = room.get_mut(current.length..end) else {
            session.current = None;
            return Err(FrameRefusal::WrongLength);
        };
        place.copy_from_slice(data);
        current.length = end;
        current.toggle = !current.toggle;
        current.newest_ns = stamp_ns;
        // Only the last frame may have room left: else the parts would not be where they belong.
        if !tail.end {
            if data.len() < framing.frame_bytes() {
                session.current = None;
                return Err(FrameRefusal::WrongLength);
            }
            return Ok(None);
        }
        let Current { transfer_id, first_ns, lost, length, .. } = *current;
        session.current = None;
        let Some(([low, high], payload)) = room.get(..length).and_then(|all| all.split_first_chunk()) else {
            return Err(FrameRefusal::WrongLength);
        };
        if crc::transfer_crc(of.seed, payload) != u16::from_le_bytes([*low, *high]) {
            return Err(FrameRefusal::Checksum);
        }
        session.last = Some((transfer_id, stamp_ns));
        Ok(Some(Transfer { subscription, header, framing, transfer_id, stamp_ns: first_ns, lost, payload }))
    }

    /// A transfer of a node without an id: always one frame, and no two belong together.
    fn anonymous(
        &mut self,
        (subscription, header, tail, framing): (usize, TransferHeader, Tail, Framing),
        data: &[u8],
        stamp_ns: u64,
    ) -> Result<Option<Transfer<'_>>, FrameRefusal> {
        if !(tail.start && tail.end && header.kind == TransferKind::Message) {
            return Err(FrameRefusal::Incomplete);
        }
        if tail.toggle {
            return Err(FrameRefusal::Toggle);
        }
        self.short[..data.len()].copy_from_slice(data);
        let payload = self.short.get(..data.len()).unwrap_or(&[]);
        let transfer_id = tail.transfer_id;
        Ok(Some(Transfer { subscription, header, framing, transfer_id, stamp_ns, lost: 0, payload }))
    }
}

impl Session {
    /// A transfer begins: transfers missing before it. One that was under way is given up; one that was whole already is
    /// refused, as a controller may send a frame twice.
    #[inline]
    fn begin(&mut self, tail: Tail, framing: Framing, stamp_ns: u64) -> Result<u64, FrameRefusal> {
        self.current = None;
        let fresh = self
            .last
            .filter(|(_, end_ns)| stamp_ns.saturating_sub(*end_ns) <= THRESHOLDS.transfer_id_kept_ns);
        let lost = match fresh {
            Some((last, _)) if last == tail.transfer_id => return Err(FrameRefusal::Counter),
            Some((last, _)) => {
                let missing = tail.transfer_id.wrapping_sub(last).wrapping_sub(1) & (TRANSFER_IDS - 1);
                // Beyond half of the numbers nobody knows whether it goes on or back: a node that began anew.
                if missing < TRANSFER_IDS / 2 { u64::from(missing) } else { 0 }
            }
            None => 0,
        };
        if !tail.end {
            if tail.toggle {
                return Err(FrameRefusal::Toggle);
            }
            self.current = Some(Current {
                framing,
                transfer_id: tail.transfer_id,
                toggle: false,
                length: 0,
                first_ns: stamp_ns,
                newest_ns: stamp_ns,
                lost,
            });
        }
        Ok(lost)
    }

    /// The transfer under way that a frame goes on with. A frame that was sent twice has the wrong toggle and is left out; what
    /// belongs to no transfer is the rest of one whose beginning was not seen.
    #[inline]
    fn part(&mut self, tail: Tail, framing: Framing, stamp_ns: u64) -> Result<&mut Current, FrameRefusal> {
        let current = self.current.as_mut().ok_or(FrameRefusal::Incomplete)?;
        let is_late = stamp_ns.saturating_sub(current.newest_ns) > THRESHOLDS.transfer_under_way_ns;
        if is_late || (current.transfer_id, current.framing) != (tail.transfer_id, framing) {
            self.current = None;
            return Err(FrameRefusal::Incomplete);
        }
        if current.toggle != tail.toggle {
            return Err(FrameRefusal::Toggle);
        }
        self.current.as_mut().ok_or(FrameRefusal::Incomplete)
    }
}
