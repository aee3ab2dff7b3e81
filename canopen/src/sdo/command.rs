//! The eight bytes of an SDO message.

use od::Address;

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
    Abort { address: Address, code: u32 },
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
            4 => Self::Abort { address, code: u32::from_le_bytes(data) },
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
            | Self::Abort { .. }
            | Self::Unknown { .. } => None,
        }
    }

    /// The message as it goes on the wire; what is unknown goes as an abort without a reason.
    pub(crate) fn encode(self) -> [u8; 8] {
        match self {
            Self::DownloadExpedited { address, data, size } => {
                let size = size.map_or(0, |size| 0x01 | (4_u8.saturating_sub(size) & 0x03) << 2);
                initiate(0x22 | size, address, data)
            }
            Self::DownloadInitiate { address, size } => sized(0x20, 0x01, address, size),
            Self::DownloadSegment { toggle, data, len, is_last } => segment(toggle, data, len, is_last),
            Self::UploadInitiate { address } => initiate(0x40, address, [0; 4]),
            Self::UploadSegment { toggle } => short(0x60 | toggle_bit(toggle)),
            Self::BlockDownloadInitiate { address, crc, size } => {
                sized(0xC0 | u8::from(crc) << 2, 0x02, address, size)
            }
            Self::BlockDownloadEnd { unused, crc } => block_end(unused, crc),
            Self::BlockUploadInitiate { address, crc, block_size, threshold } => {
                initiate(0xA0 | u8::from(crc) << 2, address, [block_size, threshold, 0, 0])
            }
            Self::BlockUploadStart => short(0xA3),
            Self::BlockUploadAcknowledge { sequence, block_size } => acknowledge(sequence, block_size),
            Self::BlockUploadEnd => short(0xA1),
            Self::Abort { address, code } => initiate(ABORT, address, code.to_le_bytes()),
            Self::Unknown { address } => initiate(ABORT, address, [0; 4]),
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
    /// Initiate upload with `len` (1-4) bytes in the message; four if that is not indicated.
    UploadExpedited { address: Address, data: [u8; 4], len: u8 },
    /// Initiate segmented upload; `size` in bytes if indicated.
    UploadInitiate { address: Address, size: Option<u32> },
    /// A segment of `len` (0-7) bytes.
    UploadSegment { toggle: bool, data: [u8; 7], len: u8, is_last: bool },
    /// Initiate block download was taken; `crc` if the server checks one.
    BlockDownloadInitiate { address: Address, crc: bool, block_size: u8 },
    /// Segments up to `sequence` arrived; the next block may have `block_size`.
    BlockDownloadAcknowledge { sequence: u8, block_size: u8 },
    /// The whole download arrived.
    BlockDownloadEnd,
    /// Initiate block upload; `size` in bytes if indicated, `crc` if one comes at the end.
    BlockUploadInitiate { address: Address, crc: bool, size: Option<u32> },
    /// End of a block upload: the last segment has `unused` (0-7) bytes too many.
    BlockUploadEnd { unused: u8, crc: u16 },
    /// The server ends the transfer.
    Abort { address: Address, code: u32 },
    /// Anything else.
    Unknown,
}

impl Response {
    /// Reads a message; every message is something.
    pub(crate) fn decode(message: [u8; 8]) -> Self {
        let [command, low, high, sub, data @ ..] = message;
        let address = Address::new(u16::from_le_bytes([low, high]), sub);
        let toggle = command & 0x10 != 0;
        let size = u32::from_le_bytes(data);
        match command >> 5 {
            0 => {
                let [_, data @ ..] = message;
                let len = 7 - (command >> 1 & 0x07);
                Self::UploadSegment { toggle, data, len, is_last: command & 0x01 != 0 }
            }
            1 => Self::DownloadSegment { toggle },
            2 if command & 0x02 == 0 => {
                Self::UploadInitiate { address, size: (command & 0x01 != 0).then_some(size) }
            }
            2 => {
                let unused = if command & 0x01 != 0 { command >> 2 & 0x03 } else { 0 };
                Self::UploadExpedited { address, data, len: 4 - unused }
            }
            3 => Self::DownloadInitiate { address },
            4 => Self::Abort { address, code: size },
            5 => {
                let [block_size, ..] = data;
                match command & 0x03 {
                    0 => Self::BlockDownloadInitiate { address, crc: command & 0x04 != 0, block_size },
                    1 => Self::BlockDownloadEnd,
                    2 => Self::BlockDownloadAcknowledge { sequence: low, block_size: high },
                    _ => Self::Unknown,
                }
            }
            6 if command & 0x01 == 0 => {
                let size = (command & 0x02 != 0).then_some(size);
                Self::BlockUploadInitiate { address, crc: command & 0x04 != 0, size }
            }
            6 => Self::BlockUploadEnd { unused: command >> 2 & 0x07, crc: u16::from_le_bytes([low, high]) },
            _ => Self::Unknown,
        }
    }

    /// The message as it goes on the wire; what is unknown goes as an abort without a reason.
    pub(crate) fn encode(self) -> [u8; 8] {
        match self {
            Self::DownloadInitiate { address } => initiate(0x60, address, [0; 4]),
            Self::DownloadSegment { toggle } => short(0x20 | toggle_bit(toggle)),
            Self::UploadExpedited { address, data, len } => {
                initiate(0x43 | (4_u8.saturating_sub(len) & 0x03) << 2, address, data)
            }
            Self::UploadInitiate { address, size } => sized(0x40, 0x01, address, size),
            Self::UploadSegment { toggle, data, len, is_last } => segment(toggle, data, len, is_last),
            Self::BlockDownloadInitiate { address, crc, block_size } => {
                initiate(0xA0 | u8::from(crc) << 2, address, [block_size, 0, 0, 0])
            }
            Self::BlockDownloadAcknowledge { sequence, block_size } => acknowledge(sequence, block_size),
            Self::BlockDownloadEnd => short(0xA1),
            Self::BlockUploadInitiate { address, crc, size } => {
                sized(0xC0 | u8::from(crc) << 2, 0x02, address, size)
            }
            Self::BlockUploadEnd { unused, crc } => block_end(unused, crc),
            Self::Abort { address, code } => initiate(ABORT, address, code.to_le_bytes()),
            Self::Unknown => short(ABORT),
        }
    }
}

/// Data bytes of a segment.
pub(crate) const SEGMENT: usize = 7;

/// A segment of a block, which either side may send (CiA 301 v4.2, sections 7.2.4.3.10 and 7.2.4.3.14). It has no command: what it
/// is follows from where it comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BlockSegment {
    /// 1-127; zero is no segment.
    pub(crate) sequence: u8,
    pub(crate) is_last: bool,
    pub(crate) data: [u8; SEGMENT],
}

impl BlockSegment {
    pub(crate) fn decode([head, data @ ..]: [u8; 8]) -> Self {
        Self { sequence: head & 0x7F, is_last: head & 0x80 != 0, data }
    }

    pub(crate) fn encode(self) -> [u8; 8] {
        let [a, b, c, d, e, f, g] = self.data;
        [u8::from(self.is_last) << 7 | self.sequence & 0x7F, a, b, c, d, e, f, g]
    }
}

/// The first `SEGMENT` bytes of `rest` with zeros behind them, how many they are, and whether nothing is behind them.
pub(crate) fn cut(rest: &[u8]) -> ([u8; SEGMENT], u8, bool) {
    let mut data = [0; SEGMENT];
    for (to, from) in data.iter_mut().zip(rest) {
        *to = *from;
    }
    (data, rest.len().min(SEGMENT) as u8, rest.len() <= SEGMENT)
}

fn short(command: u8) -> [u8; 8] {
    [command, 0, 0, 0, 0, 0, 0, 0]
}

/// An initiating message that has `indication` in its command if it tells a size.
fn sized(command: u8, indication: u8, address: Address, size: Option<u32>) -> [u8; 8] {
    let command = command | size.map_or(0, |_| indication);
    initiate(command, address, size.unwrap_or(0).to_le_bytes())
}

fn segment(toggle: bool, [a, b, c, d, e, f, g]: [u8; SEGMENT], len: u8, is_last: bool) -> [u8; 8] {
    let unused = 7_u8.saturating_sub(len) << 1;
    [toggle_bit(toggle) | unused | u8::from(is_last), a, b, c, d, e, f, g]
}

fn acknowledge(sequence: u8, block_size: u8) -> [u8; 8] {
    [0xA2, sequence, block_size, 0, 0, 0, 0, 0]
}

fn block_end(unused: u8, crc: u16) -> [u8; 8] {
    let [low, high] = crc.to_le_bytes();
    [0xC1 | (unused & 0x07) << 2, low, high, 0, 0, 0, 0, 0]
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
    use od::AbortCode;

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
            ([0x80, 0x17, 0x10, 0, 0, 0, 4, 5], Request::Abort { address, code: 0x0504_0000 }),
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
            (Response::UploadInitiate { address, size: Some(258) }, [0x41, 0, 0x10, 1, 2, 1, 0, 0]),
            (
                Response::UploadSegment { toggle: false, data: [5; 7], len: 7, is_last: false },
                [0x00, 5, 5, 5, 5, 5, 5, 5],
            ),
            (
                Response::UploadSegment { toggle: true, data: [0; 7], len: 0, is_last: true },
                [0x1F, 0, 0, 0, 0, 0, 0, 0],
            ),
            (
                Response::Abort { address, code: AbortCode::NoSubIndex.code() },
                [0x80, 0, 0x10, 1, 0x11, 0, 9, 6],
            ),
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

        #[test]
        fn a_request_means_the_same_when_it_is_written_again(message: [u8; 8]) {
            let request = Request::decode(message);
            prop_assume!(!matches!(request, Request::Unknown { .. }));
            prop_assert_eq!(Request::decode(request.encode()), request);
        }

        #[test]
        fn a_response_means_the_same_when_it_is_written_again(message: [u8; 8]) {
            let response = Response::decode(message);
            prop_assume!(response != Response::Unknown);
            prop_assert_eq!(Response::decode(response.encode()), response);
        }

        #[test]
        fn a_segment_of_a_block_keeps_every_byte(message: [u8; 8]) {
            prop_assert_eq!(BlockSegment::decode(message).encode(), message);
        }
    }
}
