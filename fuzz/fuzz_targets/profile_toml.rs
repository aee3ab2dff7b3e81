//! A profile file: read or refused with a place in it, and what is read can be shown.
#![no_main]

use profiles::Profile;

libfuzzer_sys::fuzz_target!(|text: &str| match Profile::parse("fuzzed.toml", text, None) {
    Ok(profile) => assert!(!profile.eds().is_empty()),
    Err(wrong) => assert!(!wrong.0.is_empty()),
});
