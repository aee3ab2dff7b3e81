//! An SDO transfer as somebody sees it who only listens (CiA 301 v4.2, section 7.2.4.3).

use od::Address;

use crate::sdo::{ABORT, Request};

/// Bytes of a value that are kept; of a longer one the beginning.
const LONGEST: usize = 1 << 16;
/// Data bytes of a segment of a block.
const SEGMENT: usize = 7;

/// A message of a transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SdoMessage {
    /// Node-ID of the server.
    pub node_id: u8,
    /// Number of the server in its node: 0 is the default one.
    pub server: u8,
    /// Whether the client speaks.
    pub is_request: bool,
    /// The object, as far as it is known.
    pub address: Option<Address>,
    /// Whether the client writes; `None` if the begin of the transfer was not heard.
    pub is_write: Option<bool>,
    /// What is done.
    pub step: SdoStep,
}

/// What an SDO message does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SdoStep {
    /// The client begins an upload.
    Read,
    /// The client begins an upload in blocks.
    ReadBlocks {
        /// Segments that a block may have.
        block_size: u8,
    },
    /// The value follows in parts: so many bytes, if that is told.
    Announce(Option<u32>),
    /// The server takes a download in blocks.
    TakeBlocks {
        /// Segments that a block may have.
        block_size: u8,
    },
    /// A part of a value; so many bytes are there by now.
    Part(usize),
    /// The value, whole with this message. It is cut where `of` is more than it has.
    Value {
        /// The bytes, as far as they are kept.
        bytes: Vec<u8>,
        /// How many there were.
        of: usize,
    },
    /// The end of a value of which not everything was heard.
    End,
    /// The client asks for the next part, or the server has taken one.
    Next,
    /// The receiver has the segments of a block up to this one.
    Acknowledge {
        /// The last segment in order.
        sequence: u8,
        /// Segments that the next block may have.
        block_size: u8,
    },
    /// The client lets the first block come.
    Start,
    /// What was asked for is done.
    Done,
    /// One side ends the transfer for this reason.
    Abort(u32),
    /// No message of the protocol.
    Unknown,
}

/// What a message is about, and what it does.
pub(super) type Told = (Option<Address>, Option<bool>, SdoStep);

/// The transfer of one server.
#[derive(Debug, Default)]
pub(super) struct Channel {
    transfer: Option<Transfer>,
    written: Option<(Address, Vec<u8>)>,
}

#[derive(Debug)]
struct Transfer {
    address: Address,
    is_write: bool,
    /// Whether the next message of the sender is a segment of a block.
    in_block: bool,
    /// What has come, cut to [`LONGEST`], and how much it was.
    bytes: Vec<u8>,
    count: usize,
    /// How much of it earlier blocks had.
    confirmed: usize,
    /// The last segment of this block in order.
    sequence: u8,
    /// Whether the last part has come.
    is_last: bool,
}

impl Transfer {
    fn new(address: Address, is_write: bool) -> Self {
        let (bytes, count, confirmed) = (Vec::new(), 0, 0);
        Self { address, is_write, in_block: false, bytes, count, confirmed, sequence: 0, is_last: false }
    }

    fn told(&self, step: SdoStep) -> Told {
        (Some(self.address), Some(self.is_write), step)
    }

    fn add(&mut self, data: &[u8]) {
        let room = LONGEST.saturating_sub(self.bytes.len());
        self.bytes.extend(data.iter().take(room));
        self.count = self.count.saturating_add(data.len());
    }

    /// Forgets what came behind the first `count` bytes.
    fn cut(&mut self, count: usize) {
        self.count = self.count.min(count);
        self.bytes.truncate(count);
    }

    fn value(&self) -> SdoStep {
        SdoStep::Value { bytes: self.bytes.clone(), of: self.count }
    }

    /// Takes a segment of a block. One that does not follow is sent again.
    fn segment(&mut self, [head, data @ ..]: [u8; 8]) -> Told {
        let (sequence, is_last) = (head & 0x7F, head & 0x80 != 0);
        if self.sequence.checked_add(1) == Some(sequence) {
            self.sequence = sequence;
            self.is_last = is_last;
            self.in_block = !is_last;
            self.add(&data);
        }
        self.told(SdoStep::Part(self.count))
    }

    /// The receiver has the block up to `sequence`; the rest comes again.
    fn acknowledge(&mut self, sequence: u8, block_size: u8) -> Told {
        let is_whole = self.is_last && sequence == self.sequence;
        self.cut(self.confirmed.saturating_add(SEGMENT * usize::from(sequence)));
        self.confirmed = self.count;
        self.sequence = 0;
        self.in_block = !is_whole;
        self.is_last = is_whole;
        self.told(SdoStep::Acknowledge { sequence, block_size })
    }

    /// The last segment of all had `unused` bytes too many.
    fn end(&mut self, unused: u8) -> SdoStep {
        self.cut(self.count.saturating_sub(usize::from(unused)));
        self.value()
    }
}

impl Channel {
    /// The value that the server has just confirmed to have taken, once.
    pub(super) fn take_written(&mut self) -> Option<(Address, Vec<u8>)> {
        self.written.take()
    }

    /// What the client says.
    pub(super) fn request(&mut self, message: [u8; 8]) -> Told {
        let is_abort = message.first() == Some(&ABORT);
        if let Some(transfer) = self.transfer.as_mut().filter(|t| t.is_write && t.in_block && !is_abort) {
            return transfer.segment(message);
        }
        match Request::decode(message) {
            Request::DownloadExpedited { address, data, size } => {
                let mut transfer = Transfer::new(address, true);
                transfer.add(data.get(..usize::from(size.unwrap_or(4))).unwrap_or_default());
                let told = transfer.told(transfer.value());
                self.transfer = Some(transfer);
                told
            }
            Request::DownloadInitiate { address, size }
            | Request::BlockDownloadInitiate { address, size, .. } => {
                self.begin(address, true, SdoStep::Announce(size))
            }
            Request::UploadInitiate { address } => self.begin(address, false, SdoStep::Read),
            Request::BlockUploadInitiate { address, block_size, .. } => {
                self.begin(address, false, SdoStep::ReadBlocks { block_size })
            }
            Request::DownloadSegment { data, len, is_last, .. } => {
                self.part(true, data.get(..usize::from(len)).unwrap_or_default(), is_last)
            }
            Request::UploadSegment { .. } => self.known(SdoStep::Next),
            Request::BlockDownloadEnd { unused, .. } => self.end_of_blocks(true, unused),
            Request::BlockUploadStart => {
                if let Some(transfer) = self.transfer.as_mut().filter(|transfer| !transfer.is_write) {
                    transfer.in_block = true;
                }
                self.known(SdoStep::Start)
            }
            Request::BlockUploadAcknowledge { sequence, block_size } => {
                match self.transfer.as_mut().filter(|transfer| !transfer.is_write) {
                    Some(transfer) => transfer.acknowledge(sequence, block_size),
                    None => (None, Some(false), SdoStep::Acknowledge { sequence, block_size }),
                }
            }
            Request::BlockUploadEnd => self.finish(SdoStep::Done),
            Request::Abort { .. } => self.abort(message),
            Request::Unknown { .. } => self.known(SdoStep::Unknown),
        }
    }

    /// What the server says.
    pub(super) fn answer(&mut self, message: [u8; 8]) -> Told {
        let [command, low, high, sub, data @ ..] = message;
        let address = Address::new(u16::from_le_bytes([low, high]), sub);
        let sends_block = |t: &&mut Transfer| !t.is_write && t.in_block && command != ABORT;
        if let Some(transfer) = self.transfer.as_mut().filter(sends_block) {
            return transfer.segment(message);
        }
        match command >> 5 {
            0 => self.uploaded_part(message),
            1 => self.taken(),
            2 => self.uploaded(command, address, data),
            3 => self.confirmed(address),
            4 => self.abort(message),
            5 => self.blocks_taken(command, message),
            6 if command & 0x01 == 0 => {
                let size = (command & 0x02 != 0).then_some(u32::from_le_bytes(data));
                self.transfer.get_or_insert_with(|| Transfer::new(address, false));
                self.known(SdoStep::Announce(size))
            }
            6 => self.end_of_blocks(false, command >> 2 & 0x07),
            _ => self.known(SdoStep::Unknown),
        }
    }

    fn uploaded_part(&mut self, [command, data @ ..]: [u8; 8]) -> Told {
        let length = 7 - usize::from(command >> 1 & 0x07);
        let is_last = command & 0x01 != 0;
        let told = self.part(false, data.get(..length).unwrap_or_default(), is_last);
        if is_last {
            self.transfer = None;
        }
        told
    }

    /// The server has taken a segment; with the last one, the value.
    fn taken(&mut self) -> Told {
        match self.transfer.as_ref().filter(|transfer| transfer.is_last) {
            Some(transfer) => {
                self.written = Some((transfer.address, transfer.bytes.clone()));
                self.finish(SdoStep::Done)
            }
            None => self.known(SdoStep::Next),
        }
    }

    /// The server has taken the begin of a download or, if that was all, the value.
    fn confirmed(&mut self, address: Address) -> Told {
        match self.transfer.as_ref().filter(|transfer| transfer.is_write && transfer.address == address) {
            // An expedited one has its value, a segmented one has nothing yet.
            Some(transfer) if transfer.count > 0 => {
                self.written = Some((address, transfer.bytes.clone()));
                self.finish(SdoStep::Done)
            }
            Some(_) => self.known(SdoStep::Next),
            None => (Some(address), Some(true), SdoStep::Done),
        }
    }

    /// The server answers the begin of an upload.
    fn uploaded(&mut self, command: u8, address: Address, data: [u8; 4]) -> Told {
        if command & 0x02 != 0 {
            let mut transfer = Transfer::new(address, false);
            let length = if command & 0x01 != 0 { 4 - usize::from(command >> 2 & 0x03) } else { 4 };
            transfer.add(data.get(..length).unwrap_or_default());
            self.transfer = None;
            return transfer.told(transfer.value());
        }
        let size = (command & 0x01 != 0).then_some(u32::from_le_bytes(data));
        self.begin(address, false, SdoStep::Announce(size))
    }

    /// The server answers in a download in blocks.
    fn blocks_taken(&mut self, command: u8, [_, sequence, next_size, _, block_size, ..]: [u8; 8]) -> Told {
        let transfer = self.transfer.as_mut().filter(|transfer| transfer.is_write);
        match (command & 0x03, transfer) {
            (0, Some(transfer)) => {
                transfer.in_block = true;
                transfer.told(SdoStep::TakeBlocks { block_size })
            }
            (2, Some(transfer)) => transfer.acknowledge(sequence, next_size),
            (1, Some(transfer)) => {
                self.written = Some((transfer.address, transfer.bytes.clone()));
                self.finish(SdoStep::Done)
            }
            (0, None) => (None, Some(true), SdoStep::TakeBlocks { block_size }),
            (2, None) => (None, Some(true), SdoStep::Acknowledge { sequence, block_size: next_size }),
            (1, None) => (None, Some(true), SdoStep::Done),
            (_, _) => self.known(SdoStep::Unknown),
        }
    }

    fn begin(&mut self, address: Address, is_write: bool, step: SdoStep) -> Told {
        self.transfer = Some(Transfer::new(address, is_write));
        self.known(step)
    }

    fn part(&mut self, is_write: bool, data: &[u8], is_last: bool) -> Told {
        let Some(transfer) = self.transfer.as_mut().filter(|transfer| transfer.is_write == is_write) else {
            let step = if is_last { SdoStep::End } else { SdoStep::Part(data.len()) };
            return (None, Some(is_write), step);
        };
        transfer.add(data);
        transfer.is_last = is_last;
        let step = if is_last { transfer.value() } else { SdoStep::Part(transfer.count) };
        transfer.told(step)
    }

    fn end_of_blocks(&mut self, is_write: bool, unused: u8) -> Told {
        match self.transfer.as_mut().filter(|transfer| transfer.is_write == is_write) {
            Some(transfer) => {
                let step = transfer.end(unused);
                transfer.told(step)
            }
            None => (None, Some(is_write), SdoStep::End),
        }
    }

    fn abort(&mut self, [_, low, high, sub, a, b, c, d]: [u8; 8]) -> Told {
        let address = Address::new(u16::from_le_bytes([low, high]), sub);
        let is_write = self.transfer.take().map(|transfer| transfer.is_write);
        (Some(address), is_write, SdoStep::Abort(u32::from_le_bytes([a, b, c, d])))
    }

    fn finish(&mut self, step: SdoStep) -> Told {
        let told = self.known(step);
        self.transfer = None;
        told
    }

    fn known(&self, step: SdoStep) -> Told {
        let transfer = self.transfer.as_ref();
        (transfer.map(|t| t.address), transfer.map(|t| t.is_write), step)
    }
}
