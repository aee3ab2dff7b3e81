#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::sdo_client::run(bytes));
