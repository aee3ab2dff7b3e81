//! What the kernel delivers as a frame: read or refused, and what was read is written the same.
#![no_main]
#![allow(dead_code)]

#[path = "../../daemon/src/link/wire_format.rs"]
mod wire_format;

libfuzzer_sys::fuzz_target!(|bytes: [u8; wire_format::SIZE]| {
    if let Some(frame) = wire_format::decode(&bytes) {
        assert_eq!(wire_format::decode(&wire_format::encode(&frame)), Some(frame));
    }
});
