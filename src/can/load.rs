//! Worst-case load of the bus: every frame at full bit stuffing.

use super::config::BusConfig;
use super::frame::Id;
use super::roles::Roles;

/// Load of one message.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MessageLoad {
    /// Name of the message.
    pub message: String,
    /// [bit] worst-case length of a classic frame; of an FD frame, in bits of the arbitration phase.
    pub bits: f64,
    /// [%] of the bus.
    pub percent: f64,
}

/// Load of the bus.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct BusLoad {
    /// The messages: commands, then sensors.
    pub messages: Vec<MessageLoad>,
    /// [%] all together.
    pub percent: f64,
}

/// The load when every message of the roles is sent at its period, each as long as it can get.
#[must_use]
pub fn worst_case(roles: &Roles, config: &BusConfig) -> BusLoad {
    let bit_rate = f64::from(config.bit_rate.max(1));
    let data_ratio = bit_rate / f64::from(config.data_bit_rate.max(1));
    let load = |name: &str, id: Id, length: usize, fd: bool, period_s: f64| {
        let bits = if fd { fd_bits(id, length, data_ratio) } else { classic_bits(id, length) as f64 };
        MessageLoad { message: name.to_owned(), bits, percent: 100.0 * bits / (bit_rate * period_s) }
    };
    let commands = roles.command_messages().iter();
    let sensors = roles.sensor_messages().iter();
    let messages: Vec<MessageLoad> = commands
        .map(|route| load(&route.name, route.id, route.length, route.needs_fd(), route.period_s))
        .chain(
            sensors.map(|route| load(&route.name, route.id, route.length, route.needs_fd(), route.period_s)),
        )
        .collect();
    let percent = messages.iter().map(|message| message.percent).sum();
    BusLoad { messages, percent }
}

/// [bit] of a classic frame with all stuff bits and the three bits between frames. From start of frame to the
/// end of the CRC, 34 (11-bit) or 54 (29-bit) bits and the data are stuffed: one bit for each four after the
/// first. ISO 11898-1; K. Tindell, A. Burns, "Guaranteeing message latencies on Controller Area Network", 1994,
/// with R. Davis et al. 2007 for the stuffing.
#[must_use]
pub fn classic_bits(id: Id, length: usize) -> usize {
    let stuffed = if id.is_extended() { 54 } else { 34 } + 8 * length;
    // CRC delimiter, acknowledge and its delimiter, end of frame, intermission: never stuffed.
    let rest = 1 + 2 + 7 + 3;
    stuffed + (stuffed - 1) / 4 + rest
}

/// [bit of the arbitration phase] of an FD frame with all stuff bits, its data phase at `data_ratio` of the time
/// per bit. ISO 11898-1:2015.
#[must_use]
pub fn fd_bits(id: Id, length: usize, data_ratio: f64) -> f64 {
    // Start of frame, identifier, RRS (SRR, IDE), FDF, res, BRS.
    let head = if id.is_extended() { 36 } else { 17 };
    let head = head + (head - 1) / 4;
    // ESI, DLC and data, dynamically stuffed; then stuff count and CRC with a fixed stuff bit before each four.
    let body = 1 + 4 + 8 * length;
    let check = 4 + if length <= 16 { 17 } else { 21 };
    let body = body + body / 4 + check + check.div_ceil(4);
    let rest = 1 + 2 + 7 + 3;
    (head + rest) as f64 + body as f64 * data_ratio
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_at_full_stuffing() {
        let (short, long) = (Id::Standard(0), Id::Extended(0));
        assert_eq!(classic_bits(short, 8), 135);
        assert_eq!([8, 4, 2].map(|length| classic_bits(long, length)), [160, 120, 100]);
    }

    /// By hand, all stuff bits counted: head 17 + 4 (11 bits) or 36 + 8 (29 bits), ends 13, data phase
    /// 5 + 8 n and a stuff bit for each four of them, stuff count and CRC 4 + 17 (up to 16 bytes) or 4 + 21, and a stuff bit
    /// for each four of those begun.
    #[test]
    fn fd_frames_at_full_stuffing() {
        let (short, long) = (Id::Standard(0), Id::Extended(0));
        for (length, body) in [(0, 33.0), (8, 113.0), (12, 153.0), (16, 193.0), (20, 238.0), (64, 678.0)] {
            for ratio in [1.0, 0.25] {
                assert_eq!(fd_bits(short, length, ratio), 34.0 + body * ratio, "{length}");
                assert_eq!(fd_bits(long, length, ratio), 57.0 + body * ratio, "{length}");
            }
        }
    }

    #[test]
    fn the_bench_at_1_khz_loads_the_bus_by_67_percent() {
        let config = BusConfig::default();
        let roles = Roles::build(&config, 0.001).expect("the default bench is valid");
        let load = worst_case(&roles, &config);
        // Five frames of 135 bits in 1,000.
        assert!((load.percent - 67.5).abs() < 1e-9, "{load:?}");
    }
}
