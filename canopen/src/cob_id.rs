//! COB-ID parameters and the pre-defined connection set (CiA 301 v4.2, sections 7.3.5 and 7.5.2.33).

use crate::Id;

/// NMT commands.
pub(crate) const NMT: u16 = 0x000;
/// SDO answers of the default server, plus Node-ID.
pub(crate) const SDO_TRANSMIT: u16 = 0x580;
/// SDO requests to the default server, plus Node-ID.
pub(crate) const SDO_RECEIVE: u16 = 0x600;
/// Boot-up and heartbeat, plus Node-ID.
pub(crate) const NMT_ERROR_CONTROL: u16 = 0x700;

const NOT_VALID: u32 = 1 << 31;
const NO_RTR: u32 = 1 << 30;
const EXTENDED: u32 = 1 << 29;
const IDENTIFIER: u32 = EXTENDED | EXTENDED_MASK;
const STANDARD_MASK: u32 = 0x7FF;
const EXTENDED_MASK: u32 = 0x1FFF_FFFF;

/// The value of a COB-ID parameter: identifier and flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CobId(pub u32);

impl CobId {
    /// Whether the communication object exists (bit 31 clear).
    #[must_use]
    pub const fn is_valid(self) -> bool {
        self.0 & NOT_VALID == 0
    }

    /// Whether a TPDO may be asked for by RTR (bit 30 clear).
    #[must_use]
    pub const fn allows_rtr(self) -> bool {
        self.0 & NO_RTR == 0
    }

    /// The CAN identifier (bits 0-29).
    #[must_use]
    pub const fn id(self) -> Id {
        if self.0 & EXTENDED != 0 {
            Id::Extended(self.0 & EXTENDED_MASK)
        } else {
            Id::Standard((self.0 & STANDARD_MASK) as u16)
        }
    }

    /// Whether both have the same bits 0-29.
    pub(crate) const fn has_identifier_of(self, other: Self) -> bool {
        (self.0 ^ other.0) & IDENTIFIER == 0
    }

    /// Whether the identifier is well-formed and free for configuration: restricted CAN-IDs are not, nor are bits 11-28
    /// in a standard frame.
    #[must_use]
    pub const fn is_configurable(self) -> bool {
        match self.id() {
            Id::Extended(_) => true,
            Id::Standard(_) if self.0 & EXTENDED_MASK & !STANDARD_MASK != 0 => false,
            Id::Standard(id) => !od::is_restricted(id),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn restricted_identifiers_are_not_configurable() {
        for id in
            [0x000, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601, 0x67F, 0x6E0, 0x6FF, 0x701, 0x77F, 0x780, 0x7FF]
        {
            assert!(!CobId(id).is_configurable(), "{id:03X}");
        }
        for id in [0x080, 0x100, 0x181, 0x57F, 0x580, 0x600, 0x680, 0x6DF, 0x700, 0x2000_0000] {
            assert!(CobId(id).is_configurable(), "{id:03X}");
        }
        assert!(!CobId(0x0800_0181).is_configurable());
    }

    #[test]
    fn flags_are_the_top_bits() {
        assert!(!CobId(0x8000_0181).is_valid());
        assert!(!CobId(0x4000_0181).allows_rtr());
        assert_eq!(CobId(0x3FFF_FFFF).id(), Id::Extended(0x1FFF_FFFF));
        assert_eq!(CobId(0xC000_0181).id(), Id::Standard(0x181));
    }
}
