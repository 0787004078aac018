//! The sockets of a group: the system calls that `std` does not give. All `unsafe` of multicast is here.

use std::io;
use std::mem::{size_of, zeroed};
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};

use crate::can::socket::{CONTROL, Control, control};

use super::datagram::LONGEST;

/// Most datagrams taken in one system call.
pub(super) const BATCH: usize = 16;

/// A network device as it is now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NetworkDevice {
    /// Its number.
    pub index: u32,
    /// Whether it is up.
    pub is_up: bool,
    /// Whether nothing on it leaves this machine.
    pub is_loopback: bool,
}

/// Room for datagrams of one `recvmmsg`.
pub(super) struct DatagramBatch {
    /// One byte more than the longest may have: a longer one is seen to be.
    data: [[u8; LONGEST + 1]; BATCH],
    senders: [libc::sockaddr_in; BATCH],
    /// As `u64`, because control messages must be aligned.
    control: [[u64; CONTROL / 8]; BATCH],
}

/// A datagram as the kernel gave it.
pub(super) struct Datagram<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) sender: SocketAddrV4,
    pub(super) control: Control,
}

impl DatagramBatch {
    #[allow(unsafe_code, reason = "buffers of the kernel, zero at first")]
    pub(super) fn new() -> Box<Self> {
        // SAFETY: all fields are arrays of integers, for which all-zero bytes are a value.
        Box::new(unsafe { zeroed() })
    }

    /// Takes the datagrams that are there now, [`BATCH`] at most, and hands each to `take`. The number taken.
    #[allow(unsafe_code, reason = "std has no recvmmsg")]
    pub(super) fn receive(&mut self, fd: RawFd, mut take: impl FnMut(Datagram<'_>)) -> io::Result<usize> {
        // SAFETY: `iovec` and `mmsghdr` are plain C structs of integers and pointers; zero is a value for both.
        let (mut vectors, mut headers): ([libc::iovec; BATCH], [libc::mmsghdr; BATCH]) =
            unsafe { (zeroed(), zeroed()) };
        let buffers = self.data.iter_mut().zip(&mut self.senders).zip(&mut self.control);
        for ((header, vector), ((data, sender), control)) in headers.iter_mut().zip(&mut vectors).zip(buffers)
        {
            vector.iov_base = data.as_mut_ptr().cast();
            vector.iov_len = data.len();
            header.msg_hdr.msg_name = (&raw mut *sender).cast();
            header.msg_hdr.msg_namelen = size_of::<libc::sockaddr_in>() as libc::socklen_t;
            header.msg_hdr.msg_iov = &raw mut *vector;
            header.msg_hdr.msg_iovlen = 1;
            header.msg_hdr.msg_control = control.as_mut_ptr().cast();
            header.msg_hdr.msg_controllen = CONTROL as _;
        }
        // SAFETY: every header points to one vector, one address and one control buffer, each valid and unshared for the call,
        // with its true length; a null timeout is allowed.
        let count = unsafe {
            let most = BATCH as libc::c_uint;
            libc::recvmmsg(fd, headers.as_mut_ptr(), most, libc::MSG_DONTWAIT, std::ptr::null_mut())
        };
        if count < 0 {
            let error = io::Error::last_os_error();
            return if error.kind() == io::ErrorKind::WouldBlock { Ok(0) } else { Err(error) };
        }
        let taken = headers.iter().zip(&self.data).zip(&self.senders).take(count as usize);
        for ((header, data), sender) in taken {
            let address = Ipv4Addr::from(u32::from_be(sender.sin_addr.s_addr));
            take(Datagram {
                bytes: data.get(..header.msg_len as usize).unwrap_or(&[]),
                sender: SocketAddrV4::new(address, u16::from_be(sender.sin_port)),
                control: control(&header.msg_hdr),
            });
        }
        Ok(count as usize)
    }
}

/// The network device of this name.
#[allow(unsafe_code, reason = "std has no ioctl")]
pub(super) fn device(name: &str) -> io::Result<Option<NetworkDevice>> {
    let socket = unbound()?;
    // SAFETY: an ifreq is plain data for which zero is valid.
    let mut request: libc::ifreq = unsafe { zeroed() };
    if name.len() >= request.ifr_name.len() {
        return Ok(None);
    }
    request.ifr_name.iter_mut().zip(name.bytes()).for_each(|(to, from)| *to = from as libc::c_char);
    // SAFETY: the name ends with a zero; `request` is valid and writable for the call, which fills in the flags.
    let (index, flags) = unsafe {
        let index = libc::if_nametoindex(request.ifr_name.as_ptr());
        let code = libc::ioctl(socket.as_raw_fd(), libc::SIOCGIFFLAGS as _, &raw mut request);
        if index == 0 || code < 0 {
            return Ok(None);
        }
        (index, libc::c_int::from(request.ifr_ifru.ifru_flags))
    };
    let has = |flag: libc::c_int| flags & flag != 0;
    Ok(Some(NetworkDevice { index, is_up: has(libc::IFF_UP), is_loopback: has(libc::IFF_LOOPBACK) }))
}

/// A socket that hears the group on one device, and nothing else: what comes to the same group on another one is not for it.
pub(super) fn listener(group: SocketAddrV4, device: &NetworkDevice) -> io::Result<UdpSocket> {
    let socket = unbound()?;
    let fd = socket.as_raw_fd();
    set(fd, libc::SOL_SOCKET, libc::SO_REUSEADDR, &1_i32)?;
    set(fd, libc::SOL_SOCKET, libc::SO_RXQ_OVFL, &1_i32)?;
    set(
        fd,
        libc::SOL_SOCKET,
        libc::SO_TIMESTAMPING,
        &(libc::SOF_TIMESTAMPING_RX_SOFTWARE | libc::SOF_TIMESTAMPING_SOFTWARE),
    )?;
    set(fd, libc::IPPROTO_IP, libc::IP_MULTICAST_ALL, &0_i32)?;
    set(fd, libc::IPPROTO_IP, libc::IP_ADD_MEMBERSHIP, &membership(*group.ip(), device))?;
    bind(fd, group)?;
    Ok(UdpSocket::from(socket))
}

/// A socket that says something to the group on one device. It has a port of its own, by which its datagrams are known.
pub(super) fn speaker(group: SocketAddrV4, device: &NetworkDevice) -> io::Result<UdpSocket> {
    let socket = unbound()?;
    let fd = socket.as_raw_fd();
    set(fd, libc::IPPROTO_IP, libc::IP_MULTICAST_IF, &membership(Ipv4Addr::UNSPECIFIED, device))?;
    // Not a hop further than the device; on the loopback not even one.
    set(fd, libc::IPPROTO_IP, libc::IP_MULTICAST_TTL, &i32::from(!device.is_loopback))?;
    set(fd, libc::IPPROTO_IP, libc::IP_MULTICAST_LOOP, &1_i32)?;
    let socket = UdpSocket::from(socket);
    socket.connect(group)?;
    Ok(socket)
}

fn membership(group: Ipv4Addr, device: &NetworkDevice) -> libc::ip_mreqn {
    libc::ip_mreqn {
        imr_multiaddr: libc::in_addr { s_addr: u32::from(group).to_be() },
        imr_address: libc::in_addr { s_addr: 0 },
        imr_ifindex: device.index as libc::c_int,
    }
}

/// A socket of UDP that never waits.
#[allow(unsafe_code, reason = "std binds before options can be set")]
fn unbound() -> io::Result<OwnedFd> {
    let kind = libc::SOCK_DGRAM | libc::SOCK_CLOEXEC | libc::SOCK_NONBLOCK;
    // SAFETY: a plain question to the kernel; the descriptor, where there is one, is nobody else's.
    unsafe {
        let fd = libc::socket(libc::AF_INET, kind, 0);
        if fd < 0 { Err(io::Error::last_os_error()) } else { Ok(OwnedFd::from_raw_fd(fd)) }
    }
}

#[allow(unsafe_code, reason = "std has no such options")]
fn set<T: Copy>(fd: RawFd, level: libc::c_int, option: libc::c_int, value: &T) -> io::Result<()> {
    // SAFETY: the kernel reads the value, which is plain data and as long as said.
    let code = unsafe {
        libc::setsockopt(fd, level, option, (&raw const *value).cast(), size_of::<T>() as libc::socklen_t)
    };
    if code < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

#[allow(unsafe_code, reason = "std binds before options can be set")]
fn bind(fd: RawFd, to: SocketAddrV4) -> io::Result<()> {
    // SAFETY: a sockaddr_in is plain data for which zero is valid.
    let mut address: libc::sockaddr_in = unsafe { zeroed() };
    address.sin_family = libc::AF_INET as libc::sa_family_t;
    address.sin_port = to.port().to_be();
    address.sin_addr.s_addr = u32::from(*to.ip()).to_be();
    // SAFETY: the kernel reads one address, which is as long as said.
    let code = unsafe {
        libc::bind(fd, (&raw const address).cast(), size_of::<libc::sockaddr_in>() as libc::socklen_t)
    };
    if code < 0 { Err(io::Error::last_os_error()) } else { Ok(()) }
}
