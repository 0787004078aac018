//! Any sequence of frames, as (identifier, length, data) records: no value gets through that is not finite.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use rotorbench::can::{BusConfig, Frame, Id, Roles, RotorCommands};
use rotorbench::signal::{Channel, Sensors};

static ROLES: LazyLock<Roles> = LazyLock::new(|| Roles::build(&BusConfig::default(), 0.02).expect("sound"));

fuzz_target!(|bytes: &[u8]| {
    let (mut sensors, mut commands) = (Sensors::default(), RotorCommands::default());
    let (mut received, mut commanded) = (ROLES.sensor_receiver(), ROLES.command_receiver());
    for (stamp, record) in bytes.chunks(11).enumerate() {
        let [high, low, length, data @ ..] = record else { return };
        let extended = length & 0x80 != 0;
        let number = u32::from(*high) << 8 | u32::from(*low);
        let Some(id) = Id::new(number & if extended { u32::MAX } else { 0x7FF }, extended) else { return };
        let Some(frame) = data.get(..usize::from(length & 0xF)).and_then(|data| Frame::classic(id, data))
        else {
            continue;
        };
        ROLES.decode_sensors(&mut received, &frame, stamp as u64, &mut sensors);
        ROLES.decode_commands(&mut commanded, &frame, stamp as u64, &mut commands);
    }
    assert!(Channel::ALL.iter().all(|field| field.of(&sensors).value.is_finite()));
    assert!(commands.rotor.iter().all(|rotor| (0.0..=1.0 + 1e-6).contains(rotor)));
});
