//! A gateway file: read or refused. No file beside it exists.

use std::io;

/// Reads `bytes` if they are a text.
pub fn run(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    if let Err(wrong) = config::load("fuzzed.toml", text, &|_| Err(io::ErrorKind::NotFound.into())) {
        assert!(!wrong.0.is_empty());
    }
}
