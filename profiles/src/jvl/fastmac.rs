//! FastMac commands: one byte that makes a JVL motor do something (JVL Ethernet manual, section 8.2.12).
//!
//! Their numbers are 96 to 127. On a MAC motor the same command has bit 7 set where it goes through the motor's
//! command register, so that bit does not matter here.

use crate::Role;

/// A FastMac command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FastMac {
    /// Does nothing, or is reserved.
    None,
    /// Clears the errors (and warnings of a stepper).
    ResetErrors,
    /// P_SOLL = 0.
    ZeroPSoll,
    /// P_IST = 0.
    ZeroPIst,
    /// P_FNC = 0.
    ZeroPFnc,
    /// V_SOLL = 0.
    ZeroVSoll,
    /// T_SOLL = 0.
    ZeroTSoll,
    /// Clears the flags "in position", "accelerating" and "decelerating".
    ResetFlags,
    /// P_FNC = (FLWERR - P7 or P8) * 16.
    BackBy(Distance),
    /// Makes the registers of this group, 0-3, the set-points.
    Activate(u8),
    /// Starts the zero search.
    ZeroSearch,
    /// P_SOLL = P_IST + P7 or P8.
    MoveBy(Distance),
    /// Position registers are places.
    Absolute,
    /// Position registers are distances for P_SOLL.
    RelativePSoll,
    /// Position registers are distances for the generator, P_SOLL stays.
    RelativePFnc,
    /// P_NEW is the present place.
    SyncAbsolute,
    /// P_NEW is added to the present place.
    SyncRelative,
}

/// The position register that is a distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Distance {
    /// The register P7.
    P7,
    /// The register P8.
    P8,
}

impl Distance {
    /// The register that it is in.
    pub(crate) const fn role(self) -> Role {
        match self {
            Self::P7 => Role::Pos6,
            Self::P8 => Role::Pos7,
        }
    }
}

impl FastMac {
    /// The command with this number, bit 7 aside; `None` for one that is not from 96 to 127.
    pub(crate) const fn from_number(number: u8) -> Option<Self> {
        const BIT_7: u8 = 1 << 7;
        Some(match number & !BIT_7 {
            97 => Self::ResetErrors,
            98 => Self::ZeroPSoll,
            99 => Self::ZeroPIst,
            100 => Self::ZeroPFnc,
            101 => Self::ZeroVSoll,
            102 => Self::ZeroTSoll,
            103 => Self::ResetFlags,
            104 => Self::BackBy(Distance::P7),
            105 => Self::BackBy(Distance::P8),
            108 => Self::Activate(0),
            109 => Self::Activate(1),
            110 => Self::Activate(2),
            111 => Self::Activate(3),
            112 => Self::ZeroSearch,
            113 => Self::MoveBy(Distance::P7),
            114 => Self::MoveBy(Distance::P8),
            116 => Self::Absolute,
            117 => Self::RelativePSoll,
            118 => Self::RelativePFnc,
            119 => Self::SyncAbsolute,
            120 => Self::SyncRelative,
            96 | 106 | 107 | 115 | 121..=127 => Self::None,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_manual_with_and_without_bit_7() {
        let printed = [
            (0xE0, FastMac::None),
            (0xE1, FastMac::ResetErrors),
            (0xE2, FastMac::ZeroPSoll),
            (0xE3, FastMac::ZeroPIst),
            (0xE4, FastMac::ZeroPFnc),
            (0xE5, FastMac::ZeroVSoll),
            (0xE6, FastMac::ZeroTSoll),
            (0xE7, FastMac::ResetFlags),
            (0xE8, FastMac::BackBy(Distance::P7)),
            (0xE9, FastMac::BackBy(Distance::P8)),
            (0xEA, FastMac::None),
            (0xEB, FastMac::None),
            (0xEC, FastMac::Activate(0)),
            (0xED, FastMac::Activate(1)),
            (0xEE, FastMac::Activate(2)),
            (0xEF, FastMac::Activate(3)),
            (0xF0, FastMac::ZeroSearch),
            (0xF1, FastMac::MoveBy(Distance::P7)),
            (0xF2, FastMac::MoveBy(Distance::P8)),
            (0xF3, FastMac::None),
            (0xF4, FastMac::Absolute),
            (0xF5, FastMac::RelativePSoll),
            (0xF6, FastMac::RelativePFnc),
            (0xF7, FastMac::SyncAbsolute),
            (0xF8, FastMac::SyncRelative),
            (0xF9, FastMac::None),
            (0xFF, FastMac::None),
        ];
        for (number, command) in printed {
            assert_eq!(FastMac::from_number(number), Some(command), "{number:02X}");
            assert_eq!(FastMac::from_number(number & 0x7F), Some(command), "{number:02X}");
        }
        for number in 0..=255_u8 {
            assert_eq!(FastMac::from_number(number).is_some(), number & 0x7F >= 96, "{number}");
        }
    }
}
