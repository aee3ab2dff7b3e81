//! The eight bytes of an SDO message.

use od::{AbortCode, Address};

/// The command of an abort, by either side. Between the segments of a block only this very byte is one.
pub(crate) const ABORT: u8 = 0x80;

/// What a client asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Request {
    /// Initiate download with the data in the message; `size` is `None` when not indicated.
    DownloadExpedited { address: Address, data: [u8; 4], size: Option<u8> },
    /// Initiate segmented download; `size` in bytes if indicated.
    DownloadInitiate { address: Address, size: Option<u32> },
    /// Download segment with `len` (0-7) bytes.
    DownloadSegment { toggle: bool, data: [u8; 7], len: u8, is_last: bool },
    /// Initiate upload.
    UploadInitiate { address: Address },
    /// Upload segment.
    UploadSegment { toggle: bool },
    /// Initiate block download; `size` in bytes if indicated, `crc` if the client can make one.
    BlockDownloadInitiate { address: Address, crc: bool, size: Option<u32> },
    /// End of a block download: the last segment has `unused` (0-7) bytes too many.
    BlockDownloadEnd { unused: u8, crc: u16 },
    /// Initiate block upload; up to `threshold` bytes may come by ordinary upload instead (0: none).
    BlockUploadInitiate { address: Address, crc: bool, block_size: u8, threshold: u8 },
    /// Start the first block of an upload.
    BlockUploadStart,
    /// Segments up to `sequence` arrived; the next block may have `block_size`.
    BlockUploadAcknowledge { sequence: u8, block_size: u8 },
    /// The client has the whole upload.
    BlockUploadEnd,
    /// The client ends the transfer.
    Abort,
    /// Anything else; `address` is what would be one in most of them.
    Unknown { address: Address },
}

impl Request {
    /// Reads a message; every message is something.
    pub(crate) fn decode(message: [u8; 8]) -> Self {
        let [command, low, high, sub, data @ ..] = message;
        let address = Address::new(u16::from_le_bytes([low, high]), sub);
        let toggle = command & 0x10 != 0;
        match command >> 5 {
            0 => {
                let [_, data @ ..] = message;
                let len = 7 - (command >> 1 & 0x07);
                Self::DownloadSegment { toggle, data, len, is_last: command & 0x01 != 0 }
            }
            1 => {
                let is_size_indicated = command & 0x01 != 0;
                if command & 0x02 != 0 {
                    let size = is_size_indicated.then_some(4 - (command >> 2 & 0x03));
                    Self::DownloadExpedited { address, data, size }
                } else {
                    let size = is_size_indicated.then_some(u32::from_le_bytes(data));
                    Self::DownloadInitiate { address, size }
                }
            }
            2 => Self::UploadInitiate { address },
            3 => Self::UploadSegment { toggle },
            4 => Self::Abort,
            5 => Self::block_upload(command, address, message),
            6 if command & 0x01 == 0 => {
                let size = (command & 0x02 != 0).then_some(u32::from_le_bytes(data));
                Self::BlockDownloadInitiate { address, crc: command & 0x04 != 0, size }
            }
            6 => Self::BlockDownloadEnd { unused: command >> 2 & 0x07, crc: u16::from_le_bytes([low, high]) },
            _ => Self::Unknown { address },
        }
    }
}

impl Request {
    /// The address in the message, where it has one for certain.
    pub(crate) fn address(&self) -> Option<Address> {
        match self {
            Self::DownloadExpedited { address, .. }
            | Self::DownloadInitiate { address, .. }
            | Self::UploadInitiate { address }
            | Self::BlockDownloadInitiate { address, .. }
            | Self::BlockUploadInitiate { address, .. } => Some(*address),
            Self::DownloadSegment { .. }
            | Self::UploadSegment { .. }
            | Self::BlockDownloadEnd { .. }
            | Self::BlockUploadStart
            | Self::BlockUploadAcknowledge { .. }
            | Self::BlockUploadEnd
            | Self::Abort
            | Self::Unknown { .. } => None,
        }
    }

    fn block_upload(command: u8, address: Address, message: [u8; 8]) -> Self {
        let [_, sequence, next_size, _, block_size, threshold, ..] = message;
        match command & 0x03 {
            0 => Self::BlockUploadInitiate { address, crc: command & 0x04 != 0, block_size, threshold },
            1 => Self::BlockUploadEnd,
            2 => Self::BlockUploadAcknowledge { sequence, block_size: next_size },
            _ => Self::BlockUploadStart,
        }
    }
}

/// What the server answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Response {
    /// Initiate download was taken.
    DownloadInitiate { address: Address },
    /// A segment was taken.
    DownloadSegment { toggle: bool },
    /// Initiate upload with `len` (1-4) bytes in the message.
    UploadExpedited { address: Address, data: [u8; 4], len: u8 },
    /// Initiate segmented upload of `size` bytes.
    UploadInitiate { address: Address, size: u32 },
    /// A segment of `len` (0-7) bytes.
    UploadSegment { toggle: bool, data: [u8; 7], len: u8, is_last: bool },
    /// Initiate block download was taken; a CRC is checked if the client makes one.
    BlockDownloadInitiate { address: Address, block_size: u8 },
    /// Segments up to `sequence` arrived; the next block may have `block_size`.
    BlockDownloadAcknowledge { sequence: u8, block_size: u8 },
    /// The whole download arrived.
    BlockDownloadEnd,
    /// Initiate block upload of `size` bytes, with a CRC at the end.
    BlockUploadInitiate { address: Address, size: u32 },
    /// A segment of a block.
    BlockSegment { sequence: u8, is_last: bool, data: [u8; 7] },
    /// End of a block upload: the last segment has `unused` (0-7) bytes too many.
    BlockUploadEnd { unused: u8, crc: u16 },
    /// The server ends the transfer.
    Abort { address: Address, code: AbortCode },
}

impl Response {
    /// The message as it goes on the wire.
    pub(crate) fn encode(self) -> [u8; 8] {
        match self {
            Self::DownloadInitiate { address } => initiate(0x60, address, [0; 4]),
            Self::DownloadSegment { toggle } => [0x20 | toggle_bit(toggle), 0, 0, 0, 0, 0, 0, 0],
            Self::UploadExpedited { address, data, len } => {
                initiate(0x43 | (4_u8.saturating_sub(len) & 0x03) << 2, address, data)
            }
            Self::UploadInitiate { address, size } => initiate(0x41, address, size.to_le_bytes()),
            Self::UploadSegment { toggle, data, len, is_last } => {
                let unused = 7_u8.saturating_sub(len) << 1;
                let [a, b, c, d, e, f, g] = data;
                [toggle_bit(toggle) | unused | u8::from(is_last), a, b, c, d, e, f, g]
            }
            Self::BlockDownloadInitiate { address, block_size } => {
                initiate(0xA4, address, [block_size, 0, 0, 0])
            }
            Self::BlockDownloadAcknowledge { sequence, block_size } => {
                [0xA2, sequence, block_size, 0, 0, 0, 0, 0]
            }
            Self::BlockDownloadEnd => [0xA1, 0, 0, 0, 0, 0, 0, 0],
            Self::BlockUploadInitiate { address, size } => initiate(0xC6, address, size.to_le_bytes()),
            Self::BlockSegment { sequence, is_last, data: [a, b, c, d, e, f, g] } => {
                [u8::from(is_last) << 7 | sequence, a, b, c, d, e, f, g]
            }
            Self::BlockUploadEnd { unused, crc } => {
                let [low, high] = crc.to_le_bytes();
                [0xC1 | (unused & 0x07) << 2, low, high, 0, 0, 0, 0, 0]
            }
            Self::Abort { address, code } => initiate(ABORT, address, code.code().to_le_bytes()),
        }
    }
}

fn toggle_bit(toggle: bool) -> u8 {
    u8::from(toggle) << 4
}

fn initiate(command: u8, address: Address, [a, b, c, d]: [u8; 4]) -> [u8; 8] {
    let [low, high] = address.index.to_le_bytes();
    [command, low, high, address.sub, a, b, c, d]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn requests_are_read_as_the_standard_prints_them() {
        let address = Address::new(0x1017, 0);
        let cases = [
            ([0x40, 0x17, 0x10, 0, 0, 0, 0, 0], Request::UploadInitiate { address }),
            (
                [0x2B, 0x17, 0x10, 0, 0xE8, 3, 0, 0],
                Request::DownloadExpedited { address, data: [0xE8, 3, 0, 0], size: Some(2) },
            ),
            (
                [0x22, 0x17, 0x10, 0, 0xE8, 3, 0, 0],
                Request::DownloadExpedited { address, data: [0xE8, 3, 0, 0], size: None },
            ),
            ([0x21, 0x17, 0x10, 0, 9, 0, 0, 0], Request::DownloadInitiate { address, size: Some(9) }),
            ([0x20, 0x17, 0x10, 0, 9, 0, 0, 0], Request::DownloadInitiate { address, size: None }),
            (
                [0x1B, 1, 2, 0, 0, 0, 0, 0],
                Request::DownloadSegment { toggle: true, data: [1, 2, 0, 0, 0, 0, 0], len: 2, is_last: true },
            ),
            ([0x70, 0, 0, 0, 0, 0, 0, 0], Request::UploadSegment { toggle: true }),
            ([0x80, 0, 0, 0, 0, 0, 0, 0], Request::Abort),
            ([0xE0, 0x17, 0x10, 0, 0, 0, 0, 0], Request::Unknown { address }),
        ];
        for (message, request) in cases {
            assert_eq!(Request::decode(message), request, "{message:02X?}");
        }
    }

    #[test]
    fn responses_are_written_as_the_standard_prints_them() {
        let address = Address::new(0x1000, 1);
        let cases = [
            (Response::DownloadInitiate { address }, [0x60, 0, 0x10, 1, 0, 0, 0, 0]),
            (Response::DownloadSegment { toggle: true }, [0x30, 0, 0, 0, 0, 0, 0, 0]),
            (
                Response::UploadExpedited { address, data: [7, 0, 0, 0], len: 1 },
                [0x4F, 0, 0x10, 1, 7, 0, 0, 0],
            ),
            (Response::UploadInitiate { address, size: 258 }, [0x41, 0, 0x10, 1, 2, 1, 0, 0]),
            (
                Response::UploadSegment { toggle: false, data: [5; 7], len: 7, is_last: false },
                [0x00, 5, 5, 5, 5, 5, 5, 5],
            ),
            (
                Response::UploadSegment { toggle: true, data: [0; 7], len: 0, is_last: true },
                [0x1F, 0, 0, 0, 0, 0, 0, 0],
            ),
            (Response::Abort { address, code: AbortCode::NoSubIndex }, [0x80, 0, 0x10, 1, 0x11, 0, 9, 6]),
        ];
        for (response, message) in cases {
            assert_eq!(response.encode(), message, "{response:?}");
        }
    }

    proptest! {
        #[test]
        fn every_message_is_something(message: [u8; 8]) {
            if let Request::DownloadSegment { len, .. } = Request::decode(message) {
                prop_assert!(len <= 7);
            }
        }
    }
}
