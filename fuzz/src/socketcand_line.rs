//! What a socketcand client sends: commands, refusals, and afterwards the next command is understood.

#[path = "../../daemon/src/socketcand/protocol.rs"]
#[allow(dead_code, unreachable_pub, reason = "it is part of the daemon")]
mod protocol;

use protocol::{Command, Scanner};

/// Lets a server hear `noise`.
pub fn run(noise: &[u8]) {
    let mut scanner = Scanner::default();
    for byte in noise {
        if let Some(Ok(Command::Send(frame))) = scanner.take(*byte) {
            assert!(frame.len() <= 8 && !frame.is_remote);
        }
    }
    let echo: Vec<_> = b"<echo>".iter().filter_map(|byte| scanner.take(*byte)).collect();
    assert_eq!(echo, [Ok(Command::Echo)]);
}
