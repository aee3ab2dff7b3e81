//! Orders of a network's master that change what nodes are: NMT commands (CiA 301 v4.2, section 7.3.2.1) and what LSS
//! configures (CiA 305 v3.0, section 4.3).

use crate::cob_id::NMT;
use crate::lss::{self, command};
use crate::{Frame, Id, NmtCommand};

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetworkOrder {
    /// An NMT command.
    Nmt {
        /// What to do.
        command: NmtCommand,
        /// Who is to do it; zero for every node.
        node_id: u8,
    },
    /// The selected slaves get this Node-ID; 255 takes it away.
    LssNodeId(u8),
    /// They get this entry of this table of bit timings.
    LssBitTiming {
        /// The table, 0 for that of CiA 301.
        table: u8,
        /// Index of the bit timing.
        entry: u8,
    },
    /// They are to store what was configured.
    LssStore,
}

impl NetworkOrder {
    /// The order in a frame, if it is one.
    #[must_use]
    pub fn decode(frame: &Frame) -> Option<Self> {
        if frame.is_remote {
            return None;
        }
        match frame.id {
            Id::Standard(NMT) => match *frame.payload() {
                [specifier, node_id] => {
                    NmtCommand::of(specifier).map(|command| Self::Nmt { command, node_id })
                }
                _ => None,
            },
            Id::Standard(lss::REQUEST) => match frame.eight()? {
                [command::CONFIGURE_NODE_ID, node_id, ..] => Some(Self::LssNodeId(node_id)),
                [command::CONFIGURE_BIT_TIMING, table, entry, ..] => {
                    Some(Self::LssBitTiming { table, entry })
                }
                [command::STORE, ..] => Some(Self::LssStore),
                _ => None,
            },
            Id::Standard(_) | Id::Extended(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(id: u16, payload: &[u8]) -> Option<NetworkOrder> {
        NetworkOrder::decode(&Frame::new(Id::Standard(id), payload))
    }

    #[test]
    fn commands_and_configurations_are_orders_and_questions_are_none() {
        let start = NetworkOrder::Nmt { command: NmtCommand::Start, node_id: 0 };
        assert_eq!(decode(0x000, &[0x01, 0]), Some(start));
        assert_eq!(decode(0x000, &[0x03, 0]), None);
        assert_eq!(decode(0x000, &[0x01]), None);
        assert_eq!(decode(0x7E5, &[0x11, 5, 0, 0, 0, 0, 0, 0]), Some(NetworkOrder::LssNodeId(5)));
        let timing = NetworkOrder::LssBitTiming { table: 0, entry: 2 };
        assert_eq!(decode(0x7E5, &[0x13, 0, 2, 0, 0, 0, 0, 0]), Some(timing));
        assert_eq!(decode(0x7E5, &[0x17, 0, 0, 0, 0, 0, 0, 0]), Some(NetworkOrder::LssStore));
        assert_eq!(decode(0x7E5, &[0x5E, 0, 0, 0, 0, 0, 0, 0]), None);
        assert_eq!(decode(0x7E5, &[0x11, 5]), None);
        assert_eq!(decode(0x7E4, &[0x11, 5, 0, 0, 0, 0, 0, 0]), None);
        let remote = Frame::remote(Id::Standard(0x000), 2);
        assert_eq!(NetworkOrder::decode(&remote), None);
    }
}
