//! The SDO server behind nothing but the requests of one client.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| fuzz::story::request(data));
