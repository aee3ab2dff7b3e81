//! The server's side of a transfer.

use core::time::Duration;

use od::{AbortCode, Address, Instant, Value};

use super::block::{End, MAX_BLOCK, Receiver, Sender};
use super::command::{ABORT, BlockSegment, Request, Response, cut};
use crate::communication::Objects;

/// Silence of the client after which an unfinished transfer is aborted, unless set otherwise.
const TIMEOUT: Duration = Duration::from_secs(1);
/// Bytes that the buffer keeps between two transfers; what a longer one took is given back.
const KEPT: usize = 4096;

/// What a request leads to.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Nothing is to be answered; [`Server::poll_segment`] may have segments to send.
    Silent,
    /// This is the answer.
    Answer([u8; 8]),
    /// All data of a download are there, in [`Server::data`]: they are to be written; `answer` if that
    /// succeeds, else what [`Server::refuse`] gives. Then [`Server::reset`] forgets them.
    Write { address: Address, answer: [u8; 8] },
    /// The download of an entry was refused before all data of it were there: its access or its length is wrong.
    Refuse { address: Address, code: AbortCode, answer: [u8; 8] },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Transfer {
    None,
    /// `sent` bytes of the buffer are on their way; the next segment has this toggle bit.
    Upload {
        address: Address,
        sent: usize,
        toggle: bool,
    },
    /// The buffer fills up; the next segment has this toggle bit.
    Download {
        address: Address,
        announced: Option<usize>,
        longest: usize,
        toggle: bool,
    },
    BlockDownload(Address, Receiver),
    BlockUpload(Address, Sender),
}

/// One SDO server: at most one transfer at a time, collected in or served from a buffer.
#[derive(Debug)]
pub(crate) struct Server {
    transfer: Transfer,
    buffer: Vec<u8>,
    /// What the client is to be answered when all that it asked for is done, and where it wrote.
    held: Option<(Address, [u8; 8])>,
    timeout: Duration,
    /// When the client's silence ends the transfer.
    deadline: Option<Instant>,
    /// When a block whose end is missing is acknowledged as far as it came.
    reminder: Option<Instant>,
}

impl Server {
    pub(crate) fn new() -> Self {
        Self {
            transfer: Transfer::None,
            buffer: Vec::with_capacity(64),
            held: None,
            timeout: TIMEOUT,
            deadline: None,
            reminder: None,
        }
    }

    /// Makes `timeout` the longest silence of the client, from its next message on.
    pub(crate) fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }

    /// When the client has been silent for too long.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.reminder.or(self.deadline)
    }

    /// The bytes of a complete download.
    pub(crate) fn data(&self) -> &[u8] {
        &self.buffer
    }

    /// Ends any transfer without a word and forgets its data.
    pub(crate) fn reset(&mut self) {
        self.end();
        self.buffer.clear();
        self.buffer.shrink_to(KEPT);
    }

    /// Ends any transfer; the data stay.
    fn end(&mut self) {
        self.transfer = Transfer::None;
        self.held = None;
        self.deadline = None;
        self.reminder = None;
    }

    /// Ends the transfer with `code`.
    pub(crate) fn refuse(&mut self, address: Address, code: AbortCode) -> [u8; 8] {
        self.reset();
        Response::Abort { address, code: code.code() }.encode()
    }

    /// Holds the answer to a complete download back until [`Server::release`], without a time-out. It is given up when
    /// the client asks for something else, and by [`Server::reset`].
    pub(crate) fn hold(&mut self, address: Address, answer: [u8; 8]) {
        self.held = Some((address, answer));
    }

    /// The answer that was held back, or the refusal in its place.
    pub(crate) fn release(&mut self, outcome: Result<(), AbortCode>) -> Option<[u8; 8]> {
        let (address, answer) = self.held.take()?;
        Some(outcome.map_or_else(|code| self.refuse(address, code), |()| answer))
    }

    /// Aborts a transfer whose client was silent for too long. Half that time after the last segment, a block whose
    /// end is missing is acknowledged as far as it came: the client sends the rest again.
    pub(crate) fn handle_timeout(&mut self, now: Instant) -> Option<[u8; 8]> {
        if self.deadline.is_some_and(|deadline| deadline <= now) {
            let address = self.address()?;
            return Some(self.refuse(address, AbortCode::TimedOut));
        }
        self.reminder.take_if(|reminder| *reminder <= now)?;
        match &mut self.transfer {
            Transfer::BlockDownload(_, download) => Some(acknowledgement(download.acknowledge())),
            Transfer::None
            | Transfer::Upload { .. }
            | Transfer::Download { .. }
            | Transfer::BlockUpload(..) => None,
        }
    }

    /// The client was heard at `now`: its silence begins anew.
    fn rearm(&mut self, now: Instant) {
        self.deadline = (self.transfer != Transfer::None).then(|| now + self.timeout);
        let is_within_block =
            matches!(&self.transfer, Transfer::BlockDownload(_, download) if download.is_within_block());
        self.reminder = is_within_block.then(|| now + self.timeout / 2);
    }

    /// The next segment of a block that is to be sent without being asked for.
    pub(crate) fn poll_segment(&mut self) -> Option<[u8; 8]> {
        match &mut self.transfer {
            Transfer::BlockUpload(_, upload) => upload.poll(&self.buffer).map(BlockSegment::encode),
            Transfer::None
            | Transfer::Upload { .. }
            | Transfer::Download { .. }
            | Transfer::BlockDownload(..) => None,
        }
    }

    /// Takes one message of the client.
    pub(crate) fn handle(&mut self, now: Instant, message: [u8; 8], objects: &Objects<'_>) -> Step {
        let request = Request::decode(message);
        let (address, step) = match &mut self.transfer {
            Transfer::BlockDownload(address, download)
                if download.expects_segment() && message[0] != ABORT =>
            {
                let step = download.segment(message, &mut self.buffer);
                (
                    *address,
                    step.map(|last| last.map_or(Step::Silent, |last| Step::Answer(acknowledgement(last)))),
                )
            }
            _ => {
                let address = match request {
                    Request::Unknown { address } => self.address().unwrap_or(address),
                    _ => request.address().or(self.address()).unwrap_or(Address::new(0, 0)),
                };
                (address, self.serve(request, objects))
            }
        };
        match step {
            Ok(step) => {
                self.rearm(now);
                step
            }
            Err(code @ (AbortCode::ReadOnly | AbortCode::TooLong | AbortCode::TooShort)) => {
                Step::Refuse { address, code, answer: self.refuse(address, code) }
            }
            Err(code) => Step::Answer(self.refuse(address, code)),
        }
    }

    fn serve(&mut self, request: Request, objects: &Objects<'_>) -> Result<Step, AbortCode> {
        match request {
            Request::DownloadExpedited { address, data, size } => {
                self.download_now(address, data, size, objects)
            }
            Request::DownloadInitiate { address, size } => self.download_start(address, size, objects),
            Request::DownloadSegment { toggle, data, len, is_last } => {
                self.download_segment(toggle, data.get(..usize::from(len)).unwrap_or_default(), is_last)
            }
            Request::UploadInitiate { address } => self.upload_start(address, objects),
            Request::UploadSegment { toggle } => self.upload_segment(toggle),
            Request::BlockDownloadInitiate { address, crc, size } => {
                self.block_download_start(address, size, crc, objects)
            }
            Request::BlockDownloadEnd { unused, crc } => self.block_download_end(unused, crc),
            Request::BlockUploadInitiate { address, crc, block_size, threshold } => {
                let upload = Sender::new(block_size, crc);
                self.block_upload_start(address, upload, threshold, objects)
            }
            Request::BlockUploadStart => {
                self.block_upload()?.start()?;
                Ok(Step::Silent)
            }
            Request::BlockUploadAcknowledge { sequence, block_size } => {
                self.block_upload_acknowledge(sequence, block_size)
            }
            Request::BlockUploadEnd => {
                self.block_upload()?.end()?;
                self.reset();
                Ok(Step::Silent)
            }
            Request::Abort { .. } => {
                self.reset();
                Ok(Step::Silent)
            }
            Request::Unknown { .. } => Err(AbortCode::UnknownCommand),
        }
    }

    fn address(&self) -> Option<Address> {
        match self.transfer {
            Transfer::None => None,
            Transfer::Upload { address, .. }
            | Transfer::Download { address, .. }
            | Transfer::BlockDownload(address, _)
            | Transfer::BlockUpload(address, _) => Some(address),
        }
    }

    fn download_now(
        &mut self,
        address: Address,
        data: [u8; 4],
        size: Option<u8>,
        objects: &Objects<'_>,
    ) -> Result<Step, AbortCode> {
        self.reset();
        let area = objects.area(address.index);
        let slot = area.find(address)?;
        let longest = area.admit(slot, size.map(usize::from))?;
        let len = size.map_or(longest.min(4), usize::from);
        self.buffer.extend(data.into_iter().take(len));
        Ok(Step::Write { address, answer: Response::DownloadInitiate { address }.encode() })
    }

    /// Begins a download in several messages: the bytes that were announced, and the most there may be.
    fn admit(
        &mut self,
        address: Address,
        size: Option<u32>,
        objects: &Objects<'_>,
    ) -> Result<(Option<usize>, usize), AbortCode> {
        self.reset();
        let announced = size.map(|s| usize::try_from(s).unwrap_or(usize::MAX));
        let area = objects.area(address.index);
        Ok((announced, area.admit(area.find(address)?, announced)?))
    }

    fn download_start(
        &mut self,
        address: Address,
        size: Option<u32>,
        objects: &Objects<'_>,
    ) -> Result<Step, AbortCode> {
        let (announced, longest) = self.admit(address, size, objects)?;
        self.transfer = Transfer::Download { address, announced, longest, toggle: false };
        Ok(Step::Answer(Response::DownloadInitiate { address }.encode()))
    }

    fn download_segment(&mut self, toggle: bool, data: &[u8], is_last: bool) -> Result<Step, AbortCode> {
        let Transfer::Download { address, announced, longest, toggle: expected } = &mut self.transfer else {
            return Err(AbortCode::UnknownCommand);
        };
        if toggle != *expected {
            return Err(AbortCode::ToggleBit);
        }
        *expected = !toggle;
        let len = self.buffer.len() + data.len();
        if len > announced.unwrap_or(*longest) {
            return Err(AbortCode::TooLong);
        }
        self.buffer.extend_from_slice(data);
        let answer = Response::DownloadSegment { toggle }.encode();
        if !is_last {
            return Ok(Step::Answer(answer));
        }
        if announced.is_some_and(|announced| len < announced) {
            return Err(AbortCode::TooShort);
        }
        let address = *address;
        self.end();
        Ok(Step::Write { address, answer })
    }

    /// Takes the value at `address` as it is now: a long transfer is of one moment.
    fn snapshot(&mut self, address: Address, objects: &Objects<'_>) -> Result<u32, AbortCode> {
        self.reset();
        let (entry, value) = objects.read(address)?;
        match value {
            Value::Fixed(raw) => {
                self.buffer.extend(raw.to_le_bytes().into_iter().take(entry.data_type.bytes().unwrap_or(8)));
            }
            Value::Bytes(bytes) => self.buffer.extend_from_slice(bytes),
        }
        u32::try_from(self.buffer.len()).map_err(|_| AbortCode::OutOfMemory)
    }

    fn upload_start(&mut self, address: Address, objects: &Objects<'_>) -> Result<Step, AbortCode> {
        let size = self.snapshot(address, objects)?;
        Ok(self.upload_answer(address, size))
    }

    fn upload_answer(&mut self, address: Address, size: u32) -> Step {
        let response = match self.buffer.as_slice() {
            short @ [_, ..] if short.len() <= 4 => {
                let data = (od::bits::from_le(short) as u32).to_le_bytes();
                Response::UploadExpedited { address, data, len: short.len() as u8 }
            }
            _ => {
                self.transfer = Transfer::Upload { address, sent: 0, toggle: false };
                Response::UploadInitiate { address, size: Some(size) }
            }
        };
        Step::Answer(response.encode())
    }

    fn upload_segment(&mut self, toggle: bool) -> Result<Step, AbortCode> {
        let Transfer::Upload { sent, toggle: expected, .. } = &mut self.transfer else {
            return Err(AbortCode::UnknownCommand);
        };
        if toggle != *expected {
            return Err(AbortCode::ToggleBit);
        }
        *expected = !toggle;
        let rest = self.buffer.get(*sent..).unwrap_or_default();
        let (data, len, is_last) = cut(rest);
        *sent += usize::from(len);
        if is_last {
            self.reset();
        }
        Ok(Step::Answer(Response::UploadSegment { toggle, data, len, is_last }.encode()))
    }

    fn block_download_start(
        &mut self,
        address: Address,
        size: Option<u32>,
        crc: bool,
        objects: &Objects<'_>,
    ) -> Result<Step, AbortCode> {
        let (announced, longest) = self.admit(address, size, objects)?;
        self.transfer = Transfer::BlockDownload(address, Receiver::new(announced, longest, crc, MAX_BLOCK));
        Ok(Step::Answer(
            Response::BlockDownloadInitiate { address, crc: true, block_size: MAX_BLOCK }.encode(),
        ))
    }

    fn block_download_end(&mut self, unused: u8, crc: u16) -> Result<Step, AbortCode> {
        let Transfer::BlockDownload(address, download) = self.transfer else {
            return Err(AbortCode::UnknownCommand);
        };
        download.end(unused, crc, &mut self.buffer)?;
        self.end();
        Ok(Step::Write { address, answer: Response::BlockDownloadEnd.encode() })
    }

    fn block_upload_start(
        &mut self,
        address: Address,
        upload: Result<Sender, AbortCode>,
        threshold: u8,
        objects: &Objects<'_>,
    ) -> Result<Step, AbortCode> {
        let size = self.snapshot(address, objects)?;
        let upload = upload?;
        if threshold > 0 && size <= u32::from(threshold) {
            return Ok(self.upload_answer(address, size));
        }
        self.transfer = Transfer::BlockUpload(address, upload);
        Ok(Step::Answer(Response::BlockUploadInitiate { address, crc: true, size: Some(size) }.encode()))
    }

    fn block_upload_acknowledge(&mut self, sequence: u8, block_size: u8) -> Result<Step, AbortCode> {
        let Transfer::BlockUpload(_, upload) = &mut self.transfer else {
            return Err(AbortCode::UnknownCommand);
        };
        let end = upload.acknowledge(sequence, block_size, &self.buffer)?;
        let answer = |End { unused, crc }| Step::Answer(Response::BlockUploadEnd { unused, crc }.encode());
        Ok(end.map_or(Step::Silent, answer))
    }

    fn block_upload(&mut self) -> Result<&mut Sender, AbortCode> {
        match &mut self.transfer {
            Transfer::BlockUpload(_, upload) => Ok(upload),
            Transfer::None
            | Transfer::Upload { .. }
            | Transfer::Download { .. }
            | Transfer::BlockDownload(..) => Err(AbortCode::UnknownCommand),
        }
    }
}

/// The answer to a block of which the segments up to `sequence` came in order.
fn acknowledgement(sequence: u8) -> [u8; 8] {
    Response::BlockDownloadAcknowledge { sequence, block_size: MAX_BLOCK }.encode()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use od::{Access, DataType, Dictionary, Entry, Object, Schema};

    use super::*;

    const LONG: usize = 1_000_000;

    fn area(objects: Vec<Object>) -> Dictionary {
        Dictionary::new(Arc::new(Schema::new(objects).unwrap()), 1)
    }

    #[test]
    fn the_buffer_grows_with_what_arrives_and_shrinks_after_the_transfer() {
        let domain = Entry::new(0, "Domain", DataType::Domain, Access::ReadWrite);
        let domain = Object::var(0x2000, Entry { max_length: LONG, ..domain });
        let (mut communication, mut application) = (area(vec![]), area(vec![domain]));
        let objects = Objects { communication: &mut communication, application: &mut application };
        let mut server = Server::new();
        let [a, b, c, d] = (LONG as u32).to_le_bytes();
        for initiate in [0x21, 0xC6] {
            server.handle(Instant::ZERO, [initiate, 0x00, 0x20, 0, a, b, c, d], &objects);
            assert!(server.buffer.capacity() <= KEPT, "an announcement alone takes no memory");
            for number in 0..20_000_u32 {
                let head = if initiate == 0x21 { (number % 2) << 4 } else { number % 127 + 1 };
                server.handle(Instant::ZERO, [head as u8, 1, 2, 3, 4, 5, 6, 7], &objects);
            }
            assert_eq!(server.buffer.len(), 140_000);
            assert!(server.buffer.capacity() < LONG);
            server.handle(Instant::ZERO, [ABORT, 0, 0, 0, 0, 0, 0, 0], &objects);
            assert!(server.buffer.capacity() <= KEPT);
        }
    }
}
