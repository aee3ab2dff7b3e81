//! Where an entry stands in the dictionary.

use core::fmt;

/// Index and sub-index of an entry, written `0x6040:00`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address {
    /// Object index, 0x0001-0xFFFF.
    pub index: u16,
    /// Sub-index, 0-254.
    pub sub: u8,
}

impl Address {
    /// The entry `index:sub`.
    #[must_use]
    pub const fn new(index: u16, sub: u8) -> Self {
        Self { index, sub }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:04X}:{:02X}", self.index, self.sub)
    }
}
