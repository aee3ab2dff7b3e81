//! What a socketcand client sends: commands, refusals, and afterwards the next command is understood.
#![no_main]
#![allow(dead_code)]

#[path = "../../daemon/src/socketcand/protocol.rs"]
mod protocol;

use protocol::{Command, Scanner};

libfuzzer_sys::fuzz_target!(|noise: &[u8]| {
    let mut scanner = Scanner::default();
    for byte in noise {
        if let Some(Ok(Command::Send(frame))) = scanner.take(*byte) {
            assert!(frame.len() <= 8 && !frame.is_remote);
        }
    }
    let echo: Vec<_> = b"<echo>".iter().filter_map(|byte| scanner.take(*byte)).collect();
    assert_eq!(echo, [Ok(Command::Echo)]);
});
