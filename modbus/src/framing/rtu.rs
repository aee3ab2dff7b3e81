//! Frames of a serial line (Modbus over Serial Line V1.02, section 2.5.1): address, PDU, checksum.

use core::time::Duration;

use od::Instant;

use super::{Found, Frame};
use crate::{MAX_PDU, function};

/// Address and checksum.
const OVERHEAD: usize = 3;
/// Longest frame.
const MAX_FRAME: usize = MAX_PDU + OVERHEAD;

/// Tells frames apart.
#[derive(Debug)]
pub(crate) struct Rtu {
    silence: Duration,
    /// Whether the function code may say where a frame ends.
    predicts: bool,
    /// When the line has been silent for long enough.
    deadline: Option<Instant>,
    /// Length of a frame that has ended by silence.
    ended: Option<usize>,
    /// Everything is ignored until the line is silent.
    is_lost: bool,
}

/// Where a frame ends.
enum End {
    /// After so many bytes.
    After(usize),
    /// More bytes will tell.
    Later,
    /// Where it is silent.
    Unknown,
}

impl Rtu {
    pub(super) fn new(silence: Duration, predicts: bool) -> Self {
        Self { silence, predicts, deadline: None, ended: None, is_lost: false }
    }

    pub(super) fn handle_bytes(&mut self, now: Instant, earlier: usize) {
        self.handle_timeout(now, earlier);
        self.deadline = Some(now + self.silence);
    }

    pub(super) fn handle_timeout(&mut self, now: Instant, length: usize) {
        if self.deadline.is_some_and(|deadline| deadline <= now) {
            self.deadline = None;
            self.is_lost = false;
            self.ended = self.ended.or((length > 0).then_some(length));
        }
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        self.deadline
    }

    pub(super) fn consumed(&mut self, length: usize) {
        self.ended = self.ended.and_then(|ended| ended.checked_sub(length)).filter(|rest| *rest > 0);
    }

    pub(super) fn find(&mut self, input: &[u8]) -> Found {
        if input.is_empty() {
            return Found::Part;
        }
        if self.is_lost {
            return Found::Junk(input.len());
        }
        let expected = if self.predicts { end_of(input) } else { End::Unknown };
        match (expected, self.ended) {
            (End::After(length), _) if length <= input.len() => self.frame(input, length),
            (End::After(_) | End::Later | End::Unknown, Some(ended)) => self.frame(input, ended),
            (End::After(_) | End::Later | End::Unknown, None) if input.len() > MAX_FRAME => {
                self.lose(input.len())
            }
            (End::After(_) | End::Later | End::Unknown, None) => Found::Part,
        }
    }

    /// The first `length` bytes as a frame, if their checksum is right.
    fn frame(&mut self, input: &[u8], length: usize) -> Found {
        let Some(([unit, pdu @ ..], crc)) = input.get(..length).and_then(|frame| frame.split_last_chunk())
        else {
            return Found::Junk(length);
        };
        let body = input.get(..length - crc.len()).unwrap_or_default();
        if pdu.is_empty() || pdu.len() > MAX_PDU || crc16(body) != u16::from_le_bytes(*crc) {
            return if self.ended.is_some() { Found::Junk(length) } else { self.lose(input.len()) };
        }
        Found::Frame(Frame { transaction: 0, unit: *unit, pdu: (1, pdu.len()), length })
    }

    fn lose(&mut self, length: usize) -> Found {
        self.is_lost = true;
        Found::Junk(length)
    }
}

/// Where the request at the beginning of `input` ends.
fn end_of(input: &[u8]) -> End {
    let Some(code) = input.get(1) else { return End::Later };
    let counted = |position: usize, fixed: usize| match input.get(position) {
        Some(count) => End::After(fixed + usize::from(*count)),
        None => End::Later,
    };
    match *code {
        function::READ_COILS..=function::WRITE_SINGLE_REGISTER => End::After(8),
        function::WRITE_MULTIPLE_COILS | function::WRITE_MULTIPLE_REGISTERS => counted(6, 9),
        function::REPORT_SERVER_ID => End::After(4),
        function::MASK_WRITE_REGISTER => End::After(10),
        function::READ_WRITE_MULTIPLE_REGISTERS => counted(10, 13),
        _ => End::Unknown,
    }
}

/// The checksum of `bytes` (section 6.2.2); its low byte is sent first.
#[must_use]
pub fn crc16(bytes: &[u8]) -> u16 {
    const POLYNOMIAL: u16 = 0xA001;
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(
            crc ^ u16::from(*byte),
            |crc, _| {
                if crc & 1 == 1 { crc >> 1 ^ POLYNOMIAL } else { crc >> 1 }
            },
        )
    })
}

pub(super) fn end(start: usize, out: &mut Vec<u8>) {
    let crc = crc16(out.get(start..).unwrap_or_default());
    out.extend(crc.to_le_bytes());
}

/// The frame of `pdu` for `unit`.
#[must_use]
pub fn rtu_adu(unit: u8, pdu: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(pdu.len() + OVERHEAD);
    out.push(unit);
    out.extend(pdu);
    end(0, &mut out);
    out
}
