//! How PDUs are told apart: by a header on TCP, by silence and a checksum on a serial line.

mod rtu;
mod tcp;

use core::time::Duration;

use od::Instant;

pub use rtu::{crc16, rtu_adu};
pub use tcp::tcp_adu;

use rtu::Rtu;

/// Longest ADU in bytes: header and PDU on TCP (Messaging on TCP/IP V1.0b, section 3.1.3).
pub const MAX_ADU: usize = 260;

/// How PDUs are told apart on a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Framing {
    /// Modbus TCP: an MBAP header says how long they are.
    Tcp,
    /// A serial line: a frame ends with this silence, 3.5 characters (Modbus over Serial Line V1.02, section 2.5.1.1).
    Rtu {
        /// The silence.
        silence: Duration,
    },
    /// Frames of a serial line in a TCP connection: a frame ends where its function code says, or with this silence if
    /// that is not known. After a wrong checksum the connection has to be silent before anything is taken again.
    RtuOverTcp {
        /// The silence.
        silence: Duration,
    },
}

/// A whole request in the input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Frame {
    /// Transaction identifier; zero on a serial line.
    pub(crate) transaction: u16,
    pub(crate) unit: u8,
    /// Where the PDU begins and how long it is.
    pub(crate) pdu: (usize, usize),
    /// Bytes of the whole frame.
    pub(crate) length: usize,
}

/// What stands at the beginning of the input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    /// Less than a frame.
    Part,
    /// A request.
    Frame(Frame),
    /// So many bytes that are no request; some of them may still have to come.
    Junk(usize),
    /// Something after which nothing can be told apart any more.
    Lost,
}

/// Tells the frames of a connection apart.
#[derive(Debug)]
pub(crate) enum Framer {
    Tcp,
    Rtu(Rtu),
}

impl Framer {
    pub(crate) fn new(framing: Framing) -> Self {
        match framing {
            Framing::Tcp => Self::Tcp,
            Framing::Rtu { silence } => Self::Rtu(Rtu::new(silence, false)),
            Framing::RtuOverTcp { silence } => Self::Rtu(Rtu::new(silence, true)),
        }
    }

    /// Takes note that bytes have come after `earlier` others.
    pub(crate) fn handle_bytes(&mut self, now: Instant, earlier: usize) {
        if let Self::Rtu(rtu) = self {
            rtu.handle_bytes(now, earlier);
        }
    }

    pub(crate) fn handle_timeout(&mut self, now: Instant, length: usize) {
        if let Self::Rtu(rtu) = self {
            rtu.handle_timeout(now, length);
        }
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        match self {
            Self::Tcp => None,
            Self::Rtu(rtu) => rtu.poll_timeout(),
        }
    }

    pub(crate) fn find(&mut self, input: &[u8]) -> Found {
        match self {
            Self::Tcp => tcp::find(input),
            Self::Rtu(rtu) => rtu.find(input),
        }
    }

    /// Takes note that the first `length` bytes are gone.
    pub(crate) fn consumed(&mut self, length: usize) {
        if let Self::Rtu(rtu) = self {
            rtu.consumed(length);
        }
    }

    /// Whether a request for this unit is answered, even if nobody is there: on a serial line nobody answers for another,
    /// and unit 0 is everybody.
    pub(crate) fn answers(&self, unit: u8, is_there: bool) -> bool {
        match self {
            Self::Tcp => true,
            Self::Rtu(_) => is_there && unit != 0,
        }
    }

    /// Begins a frame at the end of `out`; [`Framer::end`] completes it.
    pub(crate) fn begin(&self, frame: &Frame, out: &mut Vec<u8>) {
        match self {
            Self::Tcp => tcp::begin(frame.transaction, frame.unit, out),
            Self::Rtu(_) => out.push(frame.unit),
        }
    }

    /// Completes the frame that began at `start`.
    pub(crate) fn end(&self, start: usize, out: &mut Vec<u8>) {
        match self {
            Self::Tcp => tcp::end(start, out),
            Self::Rtu(_) => rtu::end(start, out),
        }
    }
}
