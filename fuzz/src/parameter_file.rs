//! A parameter file: read or refused, and one that was read is written the same. Bytes that are no such file are one with the
//! right last line, for a fuzzer does not find a checksum.

use daemon::storage::{decode, encode};

/// Reads `bytes` as they are, and with a checksum.
pub fn run(bytes: &[u8]) {
    read(bytes);
    let mut file = bytes.to_vec();
    if !file.ends_with(b"\n") {
        file.push(b'\n');
    }
    file.extend(format!("crc32 {:08X}\n", crc32(&file)).into_bytes());
    read(&file);
}

fn read(file: &[u8]) {
    if let Ok(parameters) = decode(file) {
        assert_eq!(encode(&parameters).as_bytes(), file);
    }
}

/// CRC-32 of IEEE 802.3, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc, byte| {
        (0..8).fold(
            crc ^ u32::from(*byte),
            |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 },
        )
    })
}
