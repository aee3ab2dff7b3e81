//! What the kernel delivers: read or refused, and a frame that was read is written the same.

#[path = "../../daemon/src/link/wire_format.rs"]
#[allow(dead_code, unreachable_pub, reason = "it is part of the daemon")]
mod format;

use format::{Message, SIZE, decode, encode};

/// Reads the first bytes of `bytes`.
pub fn run(bytes: &[u8]) {
    let Some(bytes) = bytes.first_chunk::<SIZE>() else { return };
    if let Some(Message::Frame(frame)) = decode(bytes) {
        assert_eq!(decode(&encode(&frame)), Some(Message::Frame(frame)));
    }
}
