//! What the kernel delivers: read or refused, and a frame that was read is written the same.
#![no_main]
#![allow(dead_code)]

#[path = "../../daemon/src/link/wire_format.rs"]
mod wire_format;

libfuzzer_sys::fuzz_target!(|bytes: [u8; wire_format::SIZE]| {
    if let Some(wire_format::Message::Frame(frame)) = wire_format::decode(&bytes) {
        assert_eq!(
            wire_format::decode(&wire_format::encode(&frame)),
            Some(wire_format::Message::Frame(frame))
        );
    }
});
