//! A classic CAN frame.

use core::fmt;

/// A CAN identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Id {
    /// 11 bits.
    Standard(u16),
    /// 29 bits.
    Extended(u32),
}

/// A classic CAN data or remote frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Frame {
    /// Identifier.
    pub id: Id,
    /// Whether this asks for a frame instead of being one (RTR).
    pub is_remote: bool,
    len: u8,
    data: [u8; 8],
}

impl Frame {
    /// A data frame; bytes past the eighth are dropped.
    #[must_use]
    pub fn new(id: Id, payload: &[u8]) -> Self {
        let mut data = [0; 8];
        for (to, from) in data.iter_mut().zip(payload) {
            *to = *from;
        }
        Self { id, is_remote: false, len: payload.len().min(8) as u8, data }
    }

    /// A remote frame that asks for `len` (0-8) bytes.
    #[must_use]
    pub fn remote(id: Id, len: u8) -> Self {
        Self { id, is_remote: true, len: len.min(8), data: [0; 8] }
    }

    /// Number of data bytes, 0-8.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len as usize
    }

    /// Whether there are no data bytes.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The data; empty for a remote frame.
    #[must_use]
    pub fn payload(&self) -> &[u8] {
        if self.is_remote { &[] } else { self.data.get(..self.len()).unwrap_or_default() }
    }

    /// The data if there are exactly eight bytes.
    #[must_use]
    pub fn eight(&self) -> Option<[u8; 8]> {
        (self.len == 8 && !self.is_remote).then_some(self.data)
    }
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Standard(id) => write!(f, "{id:03X}"),
            Self::Extended(id) => write!(f, "{id:08X}"),
        }
    }
}

/// As `candump -L` shows it: `601#40001000`, a remote frame as `701#R1`.
impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#", self.id)?;
        if self.is_remote {
            return write!(f, "R{}", self.len);
        }
        self.payload().iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}
