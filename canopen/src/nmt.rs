//! Network management of one node (CiA 301 v4.2, section 7.3.2).

use crate::cob_id::NMT_ERROR_CONTROL;
use crate::{Frame, Id};

/// The NMT state; the discriminant is its heartbeat value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum NmtState {
    /// Before the boot-up message.
    Initialising = 0x00,
    /// Only NMT and error control.
    Stopped = 0x04,
    /// Everything, PDOs included.
    Operational = 0x05,
    /// Everything but PDOs.
    PreOperational = 0x7F,
}

impl NmtState {
    /// The state in a heartbeat; that of a boot-up message is [`NmtState::Initialising`].
    pub(crate) fn decode(payload: &[u8]) -> Option<Self> {
        let all = [Self::Initialising, Self::Stopped, Self::Operational, Self::PreOperational];
        let [byte] = *payload else { return None };
        all.into_iter().find(|state| *state as u8 == byte)
    }

    /// The standard's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Initialising => "INITIALISING",
            Self::Stopped => "STOPPED",
            Self::Operational => "OPERATIONAL",
            Self::PreOperational => "PRE-OPERATIONAL",
        }
    }

    /// Whether SDO, SYNC, TIME and EMCY are served.
    #[must_use]
    pub const fn communicates(self) -> bool {
        matches!(self, Self::Operational | Self::PreOperational)
    }
}

/// Whether this is the boot-up message of some node: one byte 0 with the COB-ID 700h + Node-ID (CiA 301 v4.2, section
/// 7.2.8.3.3).
#[must_use]
pub fn is_boot_up(frame: &Frame) -> bool {
    let Id::Standard(id) = frame.id else { return false };
    (1..=127).contains(&id.wrapping_sub(NMT_ERROR_CONTROL))
        && NmtState::decode(frame.payload()) == Some(NmtState::Initialising)
}

/// An NMT command; the discriminant is its command specifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum NmtCommand {
    /// Start remote node.
    Start = 0x01,
    /// Stop remote node.
    Stop = 0x02,
    /// Enter PRE-OPERATIONAL.
    EnterPreOperational = 0x80,
    /// Reset the application and the communication.
    ResetNode = 0x81,
    /// Reset the communication.
    ResetCommunication = 0x82,
}

impl NmtCommand {
    /// The command in an NMT message, if it is one and concerns `node_id`.
    #[must_use]
    pub fn decode(payload: &[u8], node_id: u8) -> Option<Self> {
        let [specifier, address] = *payload else { return None };
        Self::of(specifier).filter(|_| address == 0 || address == node_id)
    }

    /// The command with this specifier.
    pub(crate) const fn of(specifier: u8) -> Option<Self> {
        match specifier {
            0x01 => Some(Self::Start),
            0x02 => Some(Self::Stop),
            0x80 => Some(Self::EnterPreOperational),
            0x81 => Some(Self::ResetNode),
            0x82 => Some(Self::ResetCommunication),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heartbeat_is_one_byte_with_a_known_state() {
        for state in
            [NmtState::Initialising, NmtState::Stopped, NmtState::Operational, NmtState::PreOperational]
        {
            assert_eq!(NmtState::decode(&[state as u8]), Some(state));
            assert_eq!(NmtState::decode(&[state as u8 | 0x80]), None);
            assert_eq!(NmtState::decode(&[state as u8, 0]), None);
        }
        assert_eq!(NmtState::decode(&[]), None);
    }

    #[test]
    fn only_whole_commands_to_this_node_or_all_are_taken() {
        assert_eq!(NmtCommand::decode(&[0x01, 5], 5), Some(NmtCommand::Start));
        assert_eq!(NmtCommand::decode(&[0x82, 0], 5), Some(NmtCommand::ResetCommunication));
        assert_eq!(NmtCommand::decode(&[0x01, 6], 5), None);
        assert_eq!(NmtCommand::decode(&[0x03, 5], 5), None);
        assert_eq!(NmtCommand::decode(&[0x01], 5), None);
        assert_eq!(NmtCommand::decode(&[0x01, 5, 0], 5), None);
    }
}
