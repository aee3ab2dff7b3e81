//! A whole node with its device: frames, time that passes and time jumps.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::story::tell(data));
