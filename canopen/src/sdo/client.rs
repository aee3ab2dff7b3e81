//! The client's side of a transfer: an engine of its own, which a node or a master has beside it.

use core::fmt;
use core::time::Duration;

use od::{AbortCode, Address, Dictionary, Instant};
use thiserror::Error;

use super::block::{End, MAX_BLOCK, Receiver, Sender};
use super::command::{ABORT, BlockSegment, Request, Response, cut};
use super::connections::{ANSWER, CLIENTS, REQUEST};
use crate::cob_id::{SDO_RECEIVE, SDO_TRANSMIT};
use crate::{CobId, Frame, Id};

/// Silence of the server that ends a transfer, unless set otherwise.
const TIMEOUT: Duration = Duration::from_secs(1);
/// Blocks that may be repeated one after the other without any progress.
const REPETITIONS: u8 = 3;
/// Bytes that the buffer keeps between two transfers; what a longer one took is given back.
const KEPT: usize = 4096;

/// How a transfer is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SdoMode {
    /// Expedited where four bytes are enough, else in segments.
    #[default]
    Ordinary,
    /// In blocks.
    Block {
        /// Of an upload: up to so many bytes the server may send the ordinary way; 0 for none.
        threshold: u8,
    },
}

/// Why a transfer has failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum SdoError {
    /// The server ended it with this abort code, which need not be one of the standard.
    #[error("the server refuses: {}", Code(*.0))]
    Server(u32),
    /// The client ended it.
    #[error("the client gave up: {0}")]
    Client(AbortCode),
}

/// An abort code with its explanation, if it has one.
struct Code(u32);

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match AbortCode::from_code(self.0) {
            Some(code) => code.fmt(f),
            None => write!(f, "0x{:08X}", self.0),
        }
    }
}

/// How a transfer has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SdoEvent {
    /// These are the bytes of the entry.
    Uploaded {
        /// What was read.
        address: Address,
        /// Its value.
        data: Vec<u8>,
    },
    /// The server has taken the bytes.
    Downloaded {
        /// What was written.
        address: Address,
    },
    /// Nothing was read; whether anything was written is not known after a time-out.
    Failed {
        /// What the transfer was about.
        address: Address,
        /// Why.
        error: SdoError,
    },
}

/// What the client waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Nothing: there is no transfer.
    Idle,
    /// The answer to an initiated upload; `in_blocks` if that was asked for.
    Upload { in_blocks: bool },
    /// The next segment of an upload, which has this toggle bit.
    UploadSegment { toggle: bool, announced: Option<usize> },
    /// A segment of a block, or the end of the upload.
    BlockUpload(Receiver),
    /// The answer to a download that is whole in its first message.
    Expedited,
    /// The answer to an initiated download in segments.
    Download,
    /// That the last segment was taken: the bytes up to `sent`.
    DownloadSegment { toggle: bool, sent: usize },
    /// The answer to an initiated download in blocks.
    BlockDownloadInitiate,
    /// That a block was taken, or the end.
    BlockDownload(Sender),
}

/// An SDO client: at most one transfer at a time with one server (CiA 301 v4.2, section 7.2.4.3).
///
/// Hand it the frames with [`SdoClient::subscription`], send what [`SdoClient::poll_transmit`] yields at once, serve its
/// deadlines. Whatever a server sends, an upload takes no more memory than its limit, and every transfer ends.
#[derive(Debug)]
pub struct SdoClient {
    request: Id,
    answer: Id,
    timeout: Duration,
    block_size: u8,
    phase: Phase,
    address: Address,
    /// The most bytes an upload may have.
    limit: usize,
    buffer: Vec<u8>,
    /// Blocks in a row that brought nothing.
    repetitions: u8,
    /// When the server's silence ends the transfer.
    deadline: Option<Instant>,
    /// When a block whose end is missing is acknowledged as far as it came.
    reminder: Option<Instant>,
    /// An abort that waits to be sent.
    abort: Option<[u8; 8]>,
    /// A request that waits to be sent.
    message: Option<[u8; 8]>,
    event: Option<SdoEvent>,
}

impl SdoClient {
    /// The client of the default server of the node with this Node-ID (1-127).
    #[must_use]
    pub fn of_node(node_id: u8) -> Self {
        let node_id = u16::from(node_id & 0x7F);
        Self::new(Id::Standard(SDO_RECEIVE + node_id), Id::Standard(SDO_TRANSMIT + node_id))
    }

    /// The client whose parameters are at `index` (0x1280-0x12FF) of `communication`; `None` if there is none or one of
    /// its COB-IDs is not valid.
    #[must_use]
    pub fn configured(communication: &Dictionary, index: u16) -> Option<Self> {
        let id = |sub| {
            let slot = communication.find(Address::new(index, sub)).ok()?;
            Some(CobId(communication.raw(slot) as u32)).filter(|cob_id| cob_id.is_valid()).map(CobId::id)
        };
        CLIENTS.contains(&index).then(|| Some(Self::new(id(REQUEST)?, id(ANSWER)?)))?
    }

    /// The client that sends requests with the first identifier and is answered with the second.
    #[must_use]
    pub fn new(request: Id, answer: Id) -> Self {
        Self {
            request,
            answer,
            timeout: TIMEOUT,
            block_size: MAX_BLOCK,
            phase: Phase::Idle,
            address: Address::new(0, 0),
            limit: 0,
            buffer: Vec::new(),
            repetitions: 0,
            deadline: None,
            reminder: None,
            abort: None,
            message: None,
            event: None,
        }
    }

    /// The identifier that it listens to.
    #[must_use]
    pub fn subscription(&self) -> Id {
        self.answer
    }

    /// Makes `timeout` the longest silence of the server, from the next message on; it is one second otherwise.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// Makes `segments` (1-127) the size of the blocks of an upload, from the next one on; it is 127 otherwise.
    pub fn set_block_size(&mut self, segments: u8) {
        self.block_size = segments.clamp(1, MAX_BLOCK);
    }

    /// Whether a transfer is under way.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.phase != Phase::Idle
    }

    /// Begins to read `address`; a value of more than `limit` bytes is refused with [`AbortCode::OutOfMemory`].
    /// Returns false, and does nothing, while a transfer is under way or its event was not taken.
    #[must_use]
    pub fn upload(&mut self, now: Instant, address: Address, limit: usize, mode: SdoMode) -> bool {
        let (in_blocks, request) = match mode {
            SdoMode::Ordinary => (false, Request::UploadInitiate { address }),
            SdoMode::Block { threshold } => {
                let block_size = self.block_size;
                (true, Request::BlockUploadInitiate { address, crc: true, block_size, threshold })
            }
        };
        self.begin(now, address, limit, Vec::new(), (Phase::Upload { in_blocks }, request))
    }

    /// Begins to write `data` to `address`. Returns false, and does nothing, while a transfer is under way or its event
    /// was not taken, and for more bytes than a size can tell (2^32 - 1).
    #[must_use]
    pub fn download(&mut self, now: Instant, address: Address, data: Vec<u8>, mode: SdoMode) -> bool {
        let Ok(count) = u32::try_from(data.len()) else { return false };
        let size = Some(count);
        let first = match (mode, data.as_slice()) {
            (SdoMode::Ordinary, short @ [_, ..]) if short.len() <= 4 => {
                let (bytes, size) =
                    ((od::bits::from_le(short) as u32).to_le_bytes(), Some(short.len() as u8));
                (Phase::Expedited, Request::DownloadExpedited { address, data: bytes, size })
            }
            (SdoMode::Ordinary, _) => (Phase::Download, Request::DownloadInitiate { address, size }),
            (SdoMode::Block { .. }, _) => {
                (Phase::BlockDownloadInitiate, Request::BlockDownloadInitiate { address, crc: true, size })
            }
        };
        self.begin(now, address, 0, data, first)
    }

    /// Ends the transfer that is under way, if any, with this reason; the event tells of it.
    pub fn abort(&mut self, code: AbortCode) {
        if self.is_busy() {
            self.give_up(code);
        }
    }

    /// Takes a frame; those that are not answers to this client are ignored.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame) {
        let Some(message) = frame.eight().filter(|_| frame.id == self.answer && self.is_busy()) else {
            return;
        };
        let step = match (&mut self.phase, message) {
            (Phase::BlockUpload(receiver), [command, ..])
                if receiver.expects_segment() && command != ABORT =>
            {
                let step = receiver.segment(message, &mut self.buffer);
                step.and_then(|last| self.take_segment(last))
            }
            _ => self.take(message),
        };
        match step {
            Ok(Heard::Stray) => {}
            Ok(Heard::Progress) => self.rearm(now),
            Err(code) => self.give_up(code),
        }
    }

    /// Does what is due at `now`: ends a transfer whose server was silent for too long, and asks for what is missing of
    /// a block half that time after its last segment.
    pub fn handle_timeout(&mut self, now: Instant) {
        if self.deadline.is_some_and(|deadline| deadline <= now) {
            self.give_up(AbortCode::TimedOut);
        } else if self.reminder.take_if(|reminder| *reminder <= now).is_some()
            && let Phase::BlockUpload(receiver) = &mut self.phase
        {
            let sequence = receiver.acknowledge();
            self.acknowledge(sequence);
        }
    }

    /// When it wants [`SdoClient::handle_timeout`] to be called.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.reminder.or(self.deadline)
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self) -> Option<Frame> {
        let waiting = self.abort.take().or_else(|| self.message.take());
        let message = waiting.or_else(|| match &mut self.phase {
            Phase::BlockDownload(sender) => sender.poll(&self.buffer).map(BlockSegment::encode),
            Phase::Idle
            | Phase::Upload { .. }
            | Phase::UploadSegment { .. }
            | Phase::BlockUpload(_)
            | Phase::Expedited
            | Phase::Download
            | Phase::DownloadSegment { .. }
            | Phase::BlockDownloadInitiate => None,
        });
        message.map(|message| Frame::new(self.request, &message))
    }

    /// How the last transfer has ended; it is told once.
    pub fn poll_event(&mut self) -> Option<SdoEvent> {
        self.event.take()
    }
}

/// What an answer was.
enum Heard {
    /// It belongs to something that is over; the server's silence goes on.
    Stray,
    /// The transfer goes on or has ended.
    Progress,
}

type Step = Result<Heard, AbortCode>;

impl SdoClient {
    fn begin(
        &mut self,
        now: Instant,
        address: Address,
        limit: usize,
        data: Vec<u8>,
        (phase, request): (Phase, Request),
    ) -> bool {
        if self.is_busy() || self.event.is_some() {
            return false;
        }
        (self.address, self.limit, self.buffer, self.phase) = (address, limit, data, phase);
        self.repetitions = 0;
        self.ask(request);
        self.rearm(now);
        true
    }

    fn ask(&mut self, request: Request) {
        self.message = Some(request.encode());
    }

    /// The server was heard at `now`: its silence begins anew.
    fn rearm(&mut self, now: Instant) {
        self.deadline = self.is_busy().then(|| now + self.timeout);
        let is_within_block =
            matches!(&self.phase, Phase::BlockUpload(receiver) if receiver.is_within_block());
        self.reminder = is_within_block.then(|| now + self.timeout / 2);
    }

    fn take(&mut self, message: [u8; 8]) -> Step {
        match (self.phase, Response::decode(message)) {
            // A server that knows no transfer has no address for its abort.
            (_, Response::Abort { address, code }) => {
                if address != self.address && address != Address::new(0, 0) {
                    return Ok(Heard::Stray);
                }
                let address = self.address;
                self.end(SdoEvent::Failed { address, error: SdoError::Server(code) })
            }
            // The answer to an earlier transfer, which took longer than the client waited.
            (_, response) if response.address().is_some_and(|address| address != self.address) => {
                Ok(Heard::Stray)
            }
            (Phase::Upload { .. }, Response::UploadExpedited { data, len, .. }) => {
                self.buffer.extend(data.into_iter().take(len.into()));
                self.uploaded()
            }
            (Phase::Upload { .. }, Response::UploadInitiate { size, .. }) => self.upload_segments(size),
            (Phase::Upload { in_blocks: true }, Response::BlockUploadInitiate { crc, size, .. }) => {
                let announced = self.announced(size)?;
                let receiver = Receiver::new(announced, self.limit, crc, self.block_size);
                self.phase = Phase::BlockUpload(receiver);
                self.ask(Request::BlockUploadStart);
                Ok(Heard::Progress)
            }
            (
                Phase::UploadSegment { toggle, announced },
                Response::UploadSegment { toggle: t, data, len, is_last },
            ) => {
                if t != toggle {
                    return Err(AbortCode::ToggleBit);
                }
                let data = data.get(..usize::from(len)).unwrap_or_default();
                self.upload_segment(toggle, announced, data, is_last)
            }
            (Phase::BlockUpload(receiver), Response::BlockUploadEnd { unused, crc }) => {
                receiver.end(unused, crc, &mut self.buffer)?;
                self.ask(Request::BlockUploadEnd);
                self.uploaded()
            }
            (Phase::Expedited, Response::DownloadInitiate { .. }) => self.downloaded(),
            (Phase::Download, Response::DownloadInitiate { .. }) => self.download_segment(0, false),
            (Phase::DownloadSegment { toggle, .. }, Response::DownloadSegment { toggle: t })
                if t != toggle =>
            {
                Err(AbortCode::ToggleBit)
            }
            (Phase::DownloadSegment { sent, .. }, Response::DownloadSegment { .. })
                if sent >= self.buffer.len() =>
            {
                self.downloaded()
            }
            (Phase::DownloadSegment { sent, toggle }, Response::DownloadSegment { .. }) => {
                self.download_segment(sent, !toggle)
            }
            (Phase::BlockDownloadInitiate, Response::BlockDownloadInitiate { crc, block_size, .. }) => {
                let mut sender = Sender::new(block_size, crc)?;
                sender.start()?;
                self.phase = Phase::BlockDownload(sender);
                Ok(Heard::Progress)
            }
            (Phase::BlockDownload(_), Response::BlockDownloadAcknowledge { sequence, block_size }) => {
                self.block_acknowledged(sequence, block_size)
            }
            (Phase::BlockDownload(sender), Response::BlockDownloadEnd) => {
                sender.end()?;
                self.downloaded()
            }
            _ => Err(AbortCode::UnknownCommand),
        }
    }

    /// What the server announces, if it is not too much.
    fn announced(&self, size: Option<u32>) -> Result<Option<usize>, AbortCode> {
        let announced = size.map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        if announced.is_some_and(|announced| announced > self.limit) {
            return Err(AbortCode::OutOfMemory);
        }
        Ok(announced)
    }

    fn upload_segments(&mut self, size: Option<u32>) -> Step {
        let announced = self.announced(size)?;
        self.phase = Phase::UploadSegment { toggle: false, announced };
        self.ask(Request::UploadSegment { toggle: false });
        Ok(Heard::Progress)
    }

    fn upload_segment(&mut self, toggle: bool, announced: Option<usize>, data: &[u8], is_last: bool) -> Step {
        let count = self.buffer.len() + data.len();
        if announced.is_some_and(|announced| count > announced) {
            return Err(AbortCode::TooLong);
        }
        if count > self.limit {
            return Err(AbortCode::OutOfMemory);
        }
        self.buffer.extend_from_slice(data);
        if is_last {
            let is_whole = announced.is_none_or(|announced| count == announced);
            return if is_whole { self.uploaded() } else { Err(AbortCode::TooShort) };
        }
        if data.is_empty() {
            // It would go on for ever.
            return Err(AbortCode::LengthMismatch);
        }
        self.phase = Phase::UploadSegment { toggle: !toggle, announced };
        self.ask(Request::UploadSegment { toggle: !toggle });
        Ok(Heard::Progress)
    }

    /// Sends the bytes behind the first `sent`.
    fn download_segment(&mut self, sent: usize, toggle: bool) -> Step {
        let (data, len, is_last) = cut(self.buffer.get(sent..).unwrap_or_default());
        self.phase = Phase::DownloadSegment { toggle, sent: sent + usize::from(len) };
        self.ask(Request::DownloadSegment { toggle, data, len, is_last });
        Ok(Heard::Progress)
    }

    /// After a segment of a block: the block is over if `last` is the last of it in order.
    fn take_segment(&mut self, last: Option<u8>) -> Step {
        if let Some(sequence) = last {
            self.repeat(sequence)?;
            self.acknowledge(sequence);
        }
        Ok(Heard::Progress)
    }

    fn acknowledge(&mut self, sequence: u8) {
        self.ask(Request::BlockUploadAcknowledge { sequence, block_size: self.block_size });
    }

    fn block_acknowledged(&mut self, sequence: u8, block_size: u8) -> Step {
        self.repeat(sequence)?;
        if let Phase::BlockDownload(sender) = &mut self.phase
            && let Some(End { unused, crc }) = sender.acknowledge(sequence, block_size, &self.buffer)?
        {
            self.ask(Request::BlockDownloadEnd { unused, crc });
        }
        Ok(Heard::Progress)
    }

    /// Counts blocks of which nothing arrived in order; too many end the transfer.
    fn repeat(&mut self, sequence: u8) -> Result<(), AbortCode> {
        self.repetitions = if sequence == 0 { self.repetitions + 1 } else { 0 };
        if self.repetitions > REPETITIONS { Err(AbortCode::TimedOut) } else { Ok(()) }
    }

    fn uploaded(&mut self) -> Step {
        let data = core::mem::take(&mut self.buffer);
        self.end(SdoEvent::Uploaded { address: self.address, data })
    }

    fn downloaded(&mut self) -> Step {
        self.end(SdoEvent::Downloaded { address: self.address })
    }

    fn give_up(&mut self, code: AbortCode) {
        let address = self.address;
        self.message = None;
        self.abort = Some(Request::Abort { address, code: code.code() }.encode());
        self.finish(SdoEvent::Failed { address, error: SdoError::Client(code) });
    }

    #[expect(clippy::unnecessary_wraps, reason = "the last step of many")]
    fn end(&mut self, event: SdoEvent) -> Step {
        self.finish(event);
        Ok(Heard::Progress)
    }

    fn finish(&mut self, event: SdoEvent) {
        self.phase = Phase::Idle;
        self.deadline = None;
        self.reminder = None;
        self.buffer.clear();
        self.buffer.shrink_to(KEPT);
        self.event = Some(event);
    }
}

impl Response {
    /// The address in the message, where it has one.
    fn address(&self) -> Option<Address> {
        match self {
            Self::DownloadInitiate { address }
            | Self::UploadExpedited { address, .. }
            | Self::UploadInitiate { address, .. }
            | Self::BlockDownloadInitiate { address, .. }
            | Self::BlockUploadInitiate { address, .. }
            | Self::Abort { address, .. } => Some(*address),
            Self::DownloadSegment { .. }
            | Self::UploadSegment { .. }
            | Self::BlockDownloadAcknowledge { .. }
            | Self::BlockDownloadEnd
            | Self::BlockUploadEnd { .. }
            | Self::Unknown => None,
        }
    }
}
