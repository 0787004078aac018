//! Any text as a definition in DSDL, and any bytes as a message of it: what is read is written as the same value.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rotorbench::can::dronecan::{Definition, Framing, Library, decode, encode};

fuzz_target!(|bytes: &[u8]| {
    // The text ends at the first zero; the message stands behind it.
    let (text, payload) = bytes.split_at(bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len()));
    let Ok(text) = str::from_utf8(text) else { return };
    let Ok(definition) = Definition::new("20000.Own.uavcan", "own", text.to_owned()) else { return };
    let Ok(library) = Library::build(&[definition]) else { return };
    let Some(message) = library.get("own.Own").and_then(|own| own.message()) else { return };
    assert!(message.least_bits() <= message.most_bits());
    for framing in [Framing::Classic, Framing::Fd] {
        let Ok(value) = decode(message, payload, framing) else { continue };
        let again = encode(message, &value, framing).expect("of this type");
        let once_more = decode(message, &again, framing).expect("as written");
        // As text: what is not a number is equal to itself there.
        assert_eq!(format!("{value:?}"), format!("{once_more:?}"));
    }
});
