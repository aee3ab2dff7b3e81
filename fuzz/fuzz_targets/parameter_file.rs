#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::parameter_file::run(bytes));
