//! A client and what it has set.

use core::time::Duration;
use std::collections::BTreeMap;

use od::Instant;

use super::LONGEST_LINE;
use super::answer::GatewayError;
use super::command::{Scope, Target};
use super::pdo::{Rpdo, Tpdo};

/// The SDO time-out of a client that sets none.
const SDO_TIMEOUT: Duration = Duration::from_millis(500);
/// The highest Node-ID.
const HIGHEST_NODE_ID: u64 = 127;

/// A line for a client.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Told {
    /// The answer to its command: it may give the next one.
    Answer(String),
    /// Something has happened.
    Event(String),
}

/// What a client waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ticket {
    pub(super) client: u64,
    /// Which of all commands it is.
    pub(super) number: u64,
}

/// A command that is under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pending {
    pub(super) number: u64,
    pub(super) sequence: u32,
    pub(super) deadline: Option<Instant>,
    /// The RPDO whose values it waits for: net and number.
    pub(super) awaits_pdo: Option<(u16, u16)>,
}

#[derive(Debug)]
pub(super) struct Client {
    pub(super) net: Option<u16>,
    pub(super) node: Option<u8>,
    pub(super) sdo_timeout: Duration,
    pub(super) sdo_blocks: bool,
    pub(super) command_timeout: Option<Duration>,
    pub(super) longest_line: usize,
    pub(super) tells_boot_up: bool,
    pub(super) pending: Option<Pending>,
    /// By net and number.
    pub(super) rpdos: BTreeMap<(u16, u16), Rpdo>,
    pub(super) tpdos: BTreeMap<(u16, u16), Tpdo>,
}

impl Client {
    /// One whose commands are for this net as long as it says no other.
    pub(super) fn new(net: Option<u16>) -> Self {
        Self {
            net,
            node: None,
            sdo_timeout: SDO_TIMEOUT,
            sdo_blocks: false,
            command_timeout: None,
            longest_line: LONGEST_LINE,
            tells_boot_up: true,
            pending: None,
            rpdos: BTreeMap::new(),
            tpdos: BTreeMap::new(),
        }
    }

    /// The net and the node that a command is for; each is zero where the command is for none.
    pub(super) fn resolve(&self, scope: Scope, target: Target) -> Result<(u16, u8), GatewayError> {
        let net = |number: u64| u16::try_from(number).map_err(|_| GatewayError::UnsupportedNet);
        let node = |number: u64| match number {
            0..=HIGHEST_NODE_ID => Ok(number as u8),
            _ => Err(GatewayError::UnsupportedNode),
        };
        let own_net = self.net.ok_or(GatewayError::NoDefaultNet);
        match (scope, target) {
            (Scope::Gateway, Target::None) => Ok((0, 0)),
            (Scope::Net, Target::None) => Ok((own_net?, 0)),
            (Scope::Net, Target::One(one)) => Ok((net(one)?, 0)),
            (Scope::Node, Target::None) => Ok((own_net?, self.node.ok_or(GatewayError::NoDefaultNode)?)),
            (Scope::Node, Target::One(one)) => Ok((own_net?, node(one)?)),
            (Scope::Node, Target::Two(one, two)) => Ok((net(one)?, node(two)?)),
            (Scope::Gateway, Target::One(_) | Target::Two(..)) | (Scope::Net, Target::Two(..)) => {
                Err(GatewayError::Syntax)
            }
        }
    }
}
