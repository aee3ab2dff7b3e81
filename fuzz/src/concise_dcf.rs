//! Any bytes as a concise DCF: read or refused, and one that was read is written the same.

/// Reads `bytes`.
pub fn run(bytes: &[u8]) {
    if let Ok(entries) = canopen::decode_dcf(bytes)
        && !bytes.is_empty()
    {
        assert_eq!(canopen::encode_dcf(&entries), bytes);
    }
}
