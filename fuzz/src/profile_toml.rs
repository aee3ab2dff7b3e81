//! A profile file: read or refused with a place in it, and what is read can be shown.

use profiles::Profile;

/// Reads `bytes` if they are a text.
pub fn run(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    match Profile::parse("fuzzed.toml", text, None) {
        Ok(profile) => assert!(!profile.eds().is_empty()),
        Err(wrong) => assert!(!wrong.0.is_empty()),
    }
}
