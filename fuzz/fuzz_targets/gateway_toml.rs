//! A gateway file: read or refused. No file beside it exists.
#![no_main]

use std::io;

libfuzzer_sys::fuzz_target!(|text: &str| {
    if let Err(wrong) = config::load("fuzzed.toml", text, &|_| Err(io::ErrorKind::NotFound.into())) {
        assert!(!wrong.0.is_empty());
    }
});
