//! Who stamps the frames of an interface: asked of its driver.

use std::os::fd::AsRawFd;

/// Linux, `include/uapi/linux/ethtool.h`.
const ETHTOOL_GET_TS_INFO: u32 = 0x41;
/// Linux, `include/uapi/linux/sockios.h`.
const SIOCETHTOOL: libc::Ioctl = 0x8946;

/// `struct ethtool_ts_info`.
#[repr(C)]
#[derive(Default)]
struct TimestampInfo {
    command: u32,
    so_timestamping: u32,
    phc_index: i32,
    tx_types: u32,
    tx_reserved: [u32; 3],
    rx_filters: u32,
    rx_reserved: [u32; 3],
}

/// Who can stamp received frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timestamps {
    /// The kernel, on arrival.
    pub software: bool,
    /// The adapter, on the wire.
    pub hardware: bool,
}

/// Who can stamp the frames of `interface`; `None` when its driver does not say.
#[must_use]
#[allow(unsafe_code, reason = "std has no ioctl")]
pub fn timestamps(interface: &str) -> Option<Timestamps> {
    let socket = std::net::UdpSocket::bind(("127.0.0.1", 0)).ok()?;
    let mut info = TimestampInfo { command: ETHTOOL_GET_TS_INFO, ..TimestampInfo::default() };
    // SAFETY: an ifreq is plain data for which zero is valid.
    let mut request: libc::ifreq = unsafe { std::mem::zeroed() };
    let (name, end) = request.ifr_name.split_at_mut_checked(libc::IFNAMSIZ - 1)?;
    end.fill(0);
    if interface.len() > name.len() {
        return None;
    }
    name.iter_mut().zip(interface.bytes()).for_each(|(to, from)| *to = from as libc::c_char);
    request.ifr_ifru.ifru_data = (&raw mut info).cast();
    // SAFETY: `request` and the `info` it points to are valid and writable for the duration of the call, and `info`
    // has the layout this request answers with.
    let code = unsafe { libc::ioctl(socket.as_raw_fd(), SIOCETHTOOL, &raw mut request) };
    let can = |bit: libc::c_uint| info.so_timestamping & bit != 0;
    (code == 0).then(|| Timestamps {
        software: can(libc::SOF_TIMESTAMPING_RX_SOFTWARE),
        hardware: can(libc::SOF_TIMESTAMPING_RX_HARDWARE),
    })
}
