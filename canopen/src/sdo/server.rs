//! The server's side of a transfer.

use core::time::Duration;

use od::{AbortCode, Address, Instant, Value};

use super::command::{Request, Response};
use crate::communication::Objects;

/// Silence of the client after which an unfinished transfer is aborted.
pub(crate) const TIMEOUT: Duration = Duration::from_secs(1);

/// What a request leads to.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Step {
    /// Nothing is to be sent.
    Silent,
    /// This is the answer.
    Answer([u8; 8]),
    /// All data of a download are there, in [`Server::data`]: they are to be written; `answer` if that
    /// succeeds, else what [`Server::refuse`] gives.
    Write { address: Address, answer: [u8; 8] },
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
}

/// One SDO server: at most one transfer at a time, collected in or served from a buffer.
#[derive(Debug)]
pub(crate) struct Server {
    transfer: Transfer,
    buffer: Vec<u8>,
    deadline: Option<Instant>,
}

impl Server {
    pub(crate) fn new() -> Self {
        Self { transfer: Transfer::None, buffer: Vec::with_capacity(64), deadline: None }
    }

    /// When the client's silence ends the transfer.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.deadline
    }

    /// The bytes of a complete download.
    pub(crate) fn data(&self) -> &[u8] {
        &self.buffer
    }

    /// Ends any transfer without a word.
    pub(crate) fn reset(&mut self) {
        self.transfer = Transfer::None;
        self.deadline = None;
    }

    /// Ends the transfer with `code`.
    pub(crate) fn refuse(&mut self, address: Address, code: AbortCode) -> [u8; 8] {
        self.reset();
        Response::Abort { address, code }.encode()
    }

    /// Aborts a transfer whose client was silent for too long.
    pub(crate) fn handle_timeout(&mut self, now: Instant) -> Option<[u8; 8]> {
        if self.deadline.is_none_or(|deadline| now < deadline) {
            return None;
        }
        let address = self.address()?;
        Some(self.refuse(address, AbortCode::TimedOut))
    }

    /// Takes one message of the client.
    pub(crate) fn handle(&mut self, now: Instant, message: [u8; 8], objects: &Objects<'_>) -> Step {
        let request = Request::decode(message);
        let address = match request {
            Request::DownloadExpedited { address, .. }
            | Request::DownloadInitiate { address, .. }
            | Request::UploadInitiate { address } => address,
            Request::Unknown { address } => self.address().unwrap_or(address),
            Request::DownloadSegment { .. } | Request::UploadSegment { .. } | Request::Abort => {
                self.address().unwrap_or(Address::new(0, 0))
            }
        };
        let step = self.serve(request, objects);
        match step {
            Ok(step) => {
                self.deadline = (self.transfer != Transfer::None).then(|| now + TIMEOUT);
                step
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
            Request::Abort => {
                self.reset();
                Ok(Step::Silent)
            }
            Request::Unknown { .. } => Err(AbortCode::UnknownCommand),
        }
    }

    fn address(&self) -> Option<Address> {
        match self.transfer {
            Transfer::None => None,
            Transfer::Upload { address, .. } | Transfer::Download { address, .. } => Some(address),
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
        self.buffer.clear();
        self.buffer.extend(data.into_iter().take(len));
        Ok(Step::Write { address, answer: Response::DownloadInitiate { address }.encode() })
    }

    fn download_start(
        &mut self,
        address: Address,
        size: Option<u32>,
        objects: &Objects<'_>,
    ) -> Result<Step, AbortCode> {
        self.reset();
        let announced = size.map(|s| usize::try_from(s).unwrap_or(usize::MAX));
        let area = objects.area(address.index);
        let longest = area.admit(area.find(address)?, announced)?;
        self.buffer.clear();
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
        self.reset();
        Ok(Step::Write { address, answer })
    }

    fn upload_start(&mut self, address: Address, objects: &Objects<'_>) -> Result<Step, AbortCode> {
        self.reset();
        let (entry, value) = objects.read(address)?;
        self.buffer.clear();
        match value {
            Value::Fixed(raw) => {
                self.buffer.extend(raw.to_le_bytes().into_iter().take(entry.data_type.bytes().unwrap_or(8)));
            }
            Value::Bytes(bytes) => self.buffer.extend_from_slice(bytes),
        }
        let response = match self.buffer.as_slice() {
            short @ [_, ..] if short.len() <= 4 => {
                let data = (od::bits::from_le(short) as u32).to_le_bytes();
                Response::UploadExpedited { address, data, len: short.len() as u8 }
            }
            long => {
                let size = u32::try_from(long.len()).map_err(|_| AbortCode::OutOfMemory)?;
                self.transfer = Transfer::Upload { address, sent: 0, toggle: false };
                Response::UploadInitiate { address, size }
            }
        };
        Ok(Step::Answer(response.encode()))
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
        let mut data = [0; 7];
        for (to, from) in data.iter_mut().zip(rest) {
            *to = *from;
        }
        let len = rest.len().min(7);
        let is_last = rest.len() <= 7;
        *sent += len;
        if is_last {
            self.reset();
        }
        Ok(Step::Answer(Response::UploadSegment { toggle, data, len: len as u8, is_last }.encode()))
    }
}
