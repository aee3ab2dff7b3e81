//! Block transfers (CiA 301 v4.2, sections 7.2.4.3.8-15): many segments, one acknowledgement.

use od::AbortCode;

use super::command::{BlockSegment, SEGMENT, cut};
use super::crc;

/// Most segments of a block.
pub(crate) const MAX_BLOCK: u8 = 127;

/// The side that collects the data in a buffer: the server of a download, the client of an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Receiver {
    announced: Option<usize>,
    longest: usize,
    has_crc: bool,
    block_size: u8,
    /// The last segment of this block that came in order.
    sequence: u8,
    /// How much of the buffer `crc` is of; the last segment may have bytes too many.
    checked: usize,
    crc: u16,
    is_complete: bool,
}

impl Receiver {
    /// A transfer of at most `longest` bytes in blocks of `block_size`.
    pub(crate) fn new(announced: Option<usize>, longest: usize, has_crc: bool, block_size: u8) -> Self {
        Self { announced, longest, has_crc, block_size, sequence: 0, checked: 0, crc: 0, is_complete: false }
    }

    /// Whether the next message is a segment.
    pub(crate) fn expects_segment(&self) -> bool {
        !self.is_complete
    }

    /// Takes a segment. Only the one that follows counts; the last of a block is answered with the last that did, so
    /// that the other side sends the rest again. Returns that number when the block is over.
    pub(crate) fn segment(
        &mut self,
        message: [u8; 8],
        buffer: &mut Vec<u8>,
    ) -> Result<Option<u8>, AbortCode> {
        let BlockSegment { sequence, is_last, data } = BlockSegment::decode(message);
        if sequence == 0 || sequence > self.block_size {
            return Err(AbortCode::SequenceNumber);
        }
        if sequence == self.sequence + 1 {
            if buffer.len() + SEGMENT > self.room() {
                return Err(AbortCode::TooLong);
            }
            self.sequence = sequence;
            self.is_complete = is_last;
            self.check(buffer);
            buffer.extend_from_slice(&data);
        }
        Ok((is_last || sequence == self.block_size).then(|| self.acknowledge()))
    }

    /// Whether a block has begun and its end is missing.
    pub(crate) fn is_within_block(&self) -> bool {
        self.sequence > 0 && !self.is_complete
    }

    /// Bytes that whole segments may fill.
    fn room(&self) -> usize {
        self.announced.unwrap_or(self.longest).div_ceil(SEGMENT).max(1).saturating_mul(SEGMENT)
    }

    /// Ends a block, also one whose end is missing. Returns the last segment that came in order.
    pub(crate) fn acknowledge(&mut self) -> u8 {
        core::mem::take(&mut self.sequence)
    }

    /// Ends the transfer: drops the bytes too many and checks what there is.
    pub(crate) fn end(mut self, unused: u8, crc: u16, buffer: &mut Vec<u8>) -> Result<(), AbortCode> {
        buffer.truncate(buffer.len().saturating_sub(usize::from(unused)));
        match self.announced.unwrap_or(buffer.len()) {
            announced if buffer.len() < announced => return Err(AbortCode::TooShort),
            announced if buffer.len() > announced.min(self.longest) => return Err(AbortCode::TooLong),
            _ => {}
        }
        self.check(buffer);
        if self.has_crc && self.crc != crc { Err(AbortCode::Crc) } else { Ok(()) }
    }

    fn check(&mut self, buffer: &[u8]) {
        self.crc = crc::update(self.crc, buffer.get(self.checked..).unwrap_or_default());
        self.checked = buffer.len();
    }
}

/// The end of a transfer: the last segment has `unused` (0-7) bytes too many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct End {
    pub(crate) unused: u8,
    pub(crate) crc: u16,
}

/// The side that serves the data from a buffer: the server of an upload, the client of a download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sender {
    block_size: u8,
    /// Bytes that the other side has, and the CRC of them.
    acknowledged: usize,
    crc: u16,
    has_crc: bool,
    /// Segments of this block that are on their way.
    sent: u8,
    phase: Phase,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// The transfer is to start.
    Initiated,
    /// Segments go.
    Sending,
    /// The other side is to acknowledge a block.
    Sent,
    /// The other side is to confirm the end.
    Ending,
}

impl Sender {
    /// A transfer in blocks of `block_size`.
    pub(crate) fn new(block_size: u8, has_crc: bool) -> Result<Self, AbortCode> {
        let phase = Phase::Initiated;
        Ok(Self { block_size: checked(block_size)?, acknowledged: 0, crc: 0, has_crc, sent: 0, phase })
    }

    /// Begins with the first block.
    pub(crate) fn start(&mut self) -> Result<(), AbortCode> {
        self.proceed(Phase::Initiated, Phase::Sending)
    }

    /// The next segment to send.
    pub(crate) fn poll(&mut self, buffer: &[u8]) -> Option<BlockSegment> {
        if self.phase != Phase::Sending {
            return None;
        }
        let rest = buffer.get(self.acknowledged + SEGMENT * usize::from(self.sent)..).unwrap_or_default();
        let (data, _, is_last) = cut(rest);
        self.sent += 1;
        if is_last || self.sent == self.block_size {
            self.phase = Phase::Sent;
        }
        Some(BlockSegment { sequence: self.sent, is_last, data })
    }

    /// The other side has the first `sequence` segments of the block; what is missing goes again. After the last one the
    /// end is to be announced.
    pub(crate) fn acknowledge(
        &mut self,
        sequence: u8,
        block_size: u8,
        buffer: &[u8],
    ) -> Result<Option<End>, AbortCode> {
        self.proceed(Phase::Sent, Phase::Sending)?;
        if sequence > self.sent {
            return Err(AbortCode::SequenceNumber);
        }
        self.block_size = checked(block_size)?;
        let until = self.acknowledged + SEGMENT * usize::from(sequence);
        let is_whole = sequence > 0 && until >= buffer.len();
        let until = until.min(buffer.len());
        self.crc = crc::update(self.crc, buffer.get(self.acknowledged..until).unwrap_or_default());
        self.acknowledged = until;
        self.sent = 0;
        if !is_whole {
            return Ok(None);
        }
        self.phase = Phase::Ending;
        let in_last = if buffer.is_empty() { 0 } else { (buffer.len() - 1) % SEGMENT + 1 };
        // Without a CRC there is zero (CiA 301 v4.2, section 7.2.4.3.15).
        let crc = if self.has_crc { self.crc } else { 0 };
        Ok(Some(End { unused: (SEGMENT - in_last) as u8, crc }))
    }

    /// The other side confirms the end.
    pub(crate) fn end(self) -> Result<(), AbortCode> {
        if self.phase == Phase::Ending { Ok(()) } else { Err(AbortCode::UnknownCommand) }
    }

    fn proceed(&mut self, from: Phase, to: Phase) -> Result<(), AbortCode> {
        if self.phase != from {
            return Err(AbortCode::UnknownCommand);
        }
        self.phase = to;
        Ok(())
    }
}

fn checked(block_size: u8) -> Result<u8, AbortCode> {
    if (1..=MAX_BLOCK).contains(&block_size) { Ok(block_size) } else { Err(AbortCode::BlockSize) }
}
