//! The system calls that `socketcan` does not give: many frames with their stamps and the drop count in one
//! `recvmmsg`, a send that never waits, and a second bind.

use std::io;
use std::mem::{size_of, zeroed};
use std::os::fd::RawFd;

use socketcan::{CanSocket, Socket, SocketOptions};

use crate::clock::NANOSECONDS_PER_SECOND;

use super::frame::{Frame, FrameKind, Id};

/// Most frames taken in one system call.
pub(super) const BATCH: usize = 16;

/// [byte] room for the control messages of one frame: three stamps (64) and the drop count (24), and to spare.
pub(super) const CONTROL: usize = 128;

/// Buffers of one `recvmmsg`.
pub(super) struct Batch {
    frames: [libc::canfd_frame; BATCH],
    /// As `u64`, because control messages must be aligned.
    control: [[u64; CONTROL / 8]; BATCH],
}

/// One received frame as the kernel gave it.
pub(super) struct RawArrival {
    pub(super) id: u32,
    pub(super) frame: Option<Frame>,
    pub(super) data: [u8; 8],
    /// Sent by this very socket.
    pub(super) own: bool,
    /// Sent on this machine, by whomever.
    pub(super) is_local: bool,
    pub(super) control: Control,
}

/// What the kernel says beside what was received.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Control {
    /// [ns] CLOCK_REALTIME; 0 = none.
    pub(super) software_ns: u64,
    /// [ns] clock of the adapter; 0 = none.
    pub(super) hardware_ns: u64,
    /// What this socket has lost so far for want of room, where the kernel says so.
    pub(super) dropped: Option<u32>,
}

impl Batch {
    #[allow(unsafe_code, reason = "buffers of the kernel, zero at first")]
    pub(super) fn new() -> Box<Self> {
        // SAFETY: both fields are arrays of integers, for which all-zero bytes are a value.
        Box::new(unsafe { zeroed() })
    }

    /// Takes up to `N` frames, [`BATCH`] at most, that are there now and hands each to `take`. The number taken, 0 when
    /// none was there.
    #[allow(unsafe_code, reason = "socketcan has no recvmmsg")]
    pub(super) fn receive<const N: usize>(
        &mut self,
        fd: RawFd,
        mut take: impl FnMut(RawArrival),
    ) -> io::Result<usize> {
        const { assert!(N <= BATCH) };
        // SAFETY: `iovec` and `mmsghdr` are plain C structs of integers and pointers; zero is a value for both.
        let (mut vectors, mut headers): ([libc::iovec; N], [libc::mmsghdr; N]) =
            unsafe { (zeroed(), zeroed()) };
        let buffers = self.frames.iter_mut().zip(self.control.iter_mut());
        for ((header, vector), (frame, control)) in headers.iter_mut().zip(&mut vectors).zip(buffers) {
            vector.iov_base = (&raw mut *frame).cast();
            vector.iov_len = size_of::<libc::canfd_frame>();
            header.msg_hdr.msg_iov = &raw mut *vector;
            header.msg_hdr.msg_iovlen = 1;
            header.msg_hdr.msg_control = control.as_mut_ptr().cast();
            header.msg_hdr.msg_controllen = CONTROL as _;
        }
        // SAFETY: every header points to one vector and one control buffer, each valid and unshared for the call,
        // with its true length; a null timeout is allowed.
        let count = unsafe {
            libc::recvmmsg(
                fd,
                headers.as_mut_ptr(),
                N as libc::c_uint,
                libc::MSG_DONTWAIT,
                std::ptr::null_mut(),
            )
        };
        if count < 0 {
            let error = io::Error::last_os_error();
            return if error.kind() == io::ErrorKind::WouldBlock { Ok(0) } else { Err(error) };
        }
        let count = count as usize;
        for (header, raw) in headers.iter().zip(&self.frames).take(count) {
            take(read_arrival(header, raw));
        }
        Ok(count)
    }
}

fn read_arrival(header: &libc::mmsghdr, raw: &libc::canfd_frame) -> RawArrival {
    let mut arrival = RawArrival {
        id: raw.can_id,
        frame: read_frame(raw, header.msg_len as usize),
        data: [0; 8],
        own: header.msg_hdr.msg_flags & libc::MSG_CONFIRM != 0,
        is_local: header.msg_hdr.msg_flags & libc::MSG_DONTROUTE != 0,
        control: control(&header.msg_hdr),
    };
    arrival.data.copy_from_slice(&raw.data[..8]);
    arrival
}

/// What the control messages say, behind a header that `recvmmsg` has filled and whose control buffer is there still.
#[inline]
#[allow(unsafe_code, reason = "control messages are read behind their headers")]
pub(super) fn control(header: &libc::msghdr) -> Control {
    let mut found = Control::default();
    // SAFETY: the header was filled by recvmmsg and its control buffer is still borrowed by the caller, so the
    // macros walk only bytes that the kernel wrote; each message's data is read unaligned and only where its
    // length says that it is there.
    unsafe {
        let mut message = libc::CMSG_FIRSTHDR(&raw const *header);
        while let Some(control) = message.as_ref() {
            let data = libc::CMSG_DATA(message);
            let length = control.cmsg_len.saturating_sub(libc::CMSG_LEN(0) as usize);
            match (control.cmsg_level, control.cmsg_type) {
                (libc::SOL_SOCKET, libc::SCM_TIMESTAMPING) if length >= size_of::<[libc::timespec; 3]>() => {
                    let stamps: [libc::timespec; 3] = data.cast::<[libc::timespec; 3]>().read_unaligned();
                    found.software_ns = nanoseconds(&stamps[0]);
                    found.hardware_ns = nanoseconds(&stamps[2]);
                }
                (libc::SOL_SOCKET, libc::SO_RXQ_OVFL) if length >= size_of::<u32>() => {
                    found.dropped = Some(data.cast::<u32>().read_unaligned());
                }
                _ => {}
            }
            message = libc::CMSG_NXTHDR(&raw const *header, message);
        }
    }
    found
}

fn nanoseconds(stamp: &libc::timespec) -> u64 {
    let seconds_ns = stamp.tv_sec.unsigned_abs().saturating_mul(NANOSECONDS_PER_SECOND);
    seconds_ns.saturating_add(stamp.tv_nsec.unsigned_abs())
}

/// The frame in a buffer of `length` bytes; `None` for an error frame or a length that no frame has.
fn read_frame(raw: &libc::canfd_frame, length: usize) -> Option<Frame> {
    if raw.can_id & libc::CAN_ERR_FLAG != 0 {
        return None;
    }
    let extended = raw.can_id & libc::CAN_EFF_FLAG != 0;
    let id = Id::new(raw.can_id & libc::CAN_EFF_MASK, extended)?;
    let data = raw.data.get(..usize::from(raw.len))?;
    match length {
        libc::CAN_MTU if raw.can_id & libc::CAN_RTR_FLAG != 0 => Frame::remote(id, raw.len),
        libc::CAN_MTU => Frame::classic(id, data),
        libc::CANFD_MTU => {
            let flag = |bit: libc::c_int| i32::from(raw.flags) & bit != 0;
            let kind =
                FrameKind::Fd { bit_rate_switch: flag(libc::CANFD_BRS), error_state: flag(libc::CANFD_ESI) };
            Frame::new(id, kind, data)
        }
        _ => None,
    }
}

/// The filter through which every frame comes.
pub(super) const EVERYTHING: libc::can_filter = libc::can_filter { can_id: 0, can_mask: 0 };

/// Binds a socket again, to the interface that has the number `index` now. When an interface goes, the kernel unbinds its
/// sockets and forgets their `filters`; all other options stay.
#[allow(unsafe_code, reason = "socketcan binds a socket only once")]
pub(super) fn bind_again(fd: RawFd, index: libc::c_int, filters: &[libc::can_filter]) -> io::Result<()> {
    // SAFETY: the kernel reads the filters, which are as long as said.
    result(unsafe {
        libc::setsockopt(
            fd,
            libc::SOL_CAN_RAW,
            libc::CAN_RAW_FILTER,
            filters.as_ptr().cast(),
            size_of_val(filters) as libc::socklen_t,
        )
    })?;
    // SAFETY: a sockaddr_can is plain data for which zero is valid.
    let mut address: libc::sockaddr_can = unsafe { zeroed() };
    address.can_family = libc::AF_CAN as libc::sa_family_t;
    address.can_ifindex = index;
    let length = size_of::<libc::sockaddr_can>() as libc::socklen_t;
    // SAFETY: the kernel reads one address, which is as long as said.
    result(unsafe { libc::bind(fd, (&raw const address).cast(), length) })
}

fn result(code: libc::c_int) -> io::Result<()> {
    if code < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

/// An identifier as the kernel has it.
pub(super) fn raw_id(id: Id) -> u32 {
    id.number() | if id.is_extended() { libc::CAN_EFF_FLAG } else { 0 }
}

/// Sends a frame without waiting.
#[allow(unsafe_code, reason = "socketcan has no send that never waits")]
pub(super) fn send(fd: RawFd, frame: &Frame) -> io::Result<()> {
    let (mut id, mut flags) = (raw_id(frame.id()), 0);
    let size = match frame.kind() {
        FrameKind::Classic => libc::CAN_MTU,
        FrameKind::Remote => {
            id |= libc::CAN_RTR_FLAG;
            libc::CAN_MTU
        }
        FrameKind::Fd { bit_rate_switch, error_state } => {
            flags |= if bit_rate_switch { libc::CANFD_BRS as u8 } else { 0 };
            flags |= if error_state { libc::CANFD_ESI as u8 } else { 0 };
            libc::CANFD_MTU
        }
    };
    // SAFETY: a plain C struct of integers, for which zero is a value.
    let mut raw: libc::canfd_frame = unsafe { zeroed() };
    raw.can_id = id;
    raw.len = frame.length() as u8;
    raw.flags = flags;
    raw.data = *frame.payload();
    // SAFETY: `raw` lives through the call and is at least `size` bytes long: `can_frame` (CAN_MTU) is the
    // beginning of `canfd_frame` (CANFD_MTU), field by field.
    let sent = unsafe { libc::send(fd, (&raw const raw).cast(), size, libc::MSG_DONTWAIT) };
    if sent < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

/// Sets what a port asks of its socket: no waiting, every error frame, its own frames, stamps and the count of drops.
pub(super) fn configure(socket: &CanSocket, fd: bool) -> io::Result<()> {
    socket.set_nonblocking(true)?;
    socket.set_socket_option_int(libc::SOL_CAN_RAW, libc::CAN_RAW_FD_FRAMES, i32::from(fd))?;
    socket.set_error_filter_accept_all()?;
    socket.set_recv_own_msgs(true)?;
    socket.set_timestamping(
        libc::SOF_TIMESTAMPING_RX_SOFTWARE
            | libc::SOF_TIMESTAMPING_SOFTWARE
            | libc::SOF_TIMESTAMPING_RX_HARDWARE
            | libc::SOF_TIMESTAMPING_RAW_HARDWARE,
    )?;
    socket.set_socket_option_int(libc::SOL_SOCKET, libc::SO_RXQ_OVFL, 1)?;
    // The kernel raises this to its least, room for a handful of frames: see the head of this file.
    socket.set_socket_option_int(libc::SOL_SOCKET, libc::SO_SNDBUF, 0)
}
