//! Any bytes as a DBC file; what is taken must decode and encode without a panic, as the bitwise walk does.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rotorbench::can::{Database, MAXIMUM_LENGTH, walk};

fuzz_target!(|bytes: &[u8]| {
    let Ok(database) = Database::parse("fuzz", bytes) else { return };
    let mut payload = [0; MAXIMUM_LENGTH];
    for (to, from) in payload.iter_mut().zip(bytes.iter().rev()) {
        *to = *from;
    }
    for message in &database.messages {
        let _ = message.decode(&payload).count();
        for signal in &message.signals {
            let raw = signal.codec.decode_raw(&payload);
            assert_eq!(raw, walk::decode_raw(signal.codec.layout(), &payload));
            let mut encoded = payload;
            signal.codec.encode_raw(&mut encoded, raw);
            assert_eq!(encoded, payload);
            signal.codec.encode(&mut encoded, f64::NAN);
        }
    }
});
