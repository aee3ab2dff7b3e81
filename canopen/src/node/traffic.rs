//! How much a node has to do, for display. Nothing in the node depends on it.

use super::Node;
use super::services::Service;

/// Frames of a node since power-on, by what they are for. Those that it heard count whether or not it acted on them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// NMT commands heard.
    pub nmt: u64,
    /// SYNCs heard.
    pub syncs: u64,
    /// Frames of SDO clients heard.
    pub sdo_requests: u64,
    /// Frames that its SDO servers sent.
    pub sdo_answers: u64,
    /// RPDOs heard.
    pub rpdos: u64,
    /// TPDOs sent.
    pub tpdos: u64,
}

impl Traffic {
    /// Counts a frame that the node heard.
    pub(super) fn hear(&mut self, service: Service) {
        let counter = match service {
            Service::Nmt => &mut self.nmt,
            Service::Sync => &mut self.syncs,
            Service::Sdo(_) => &mut self.sdo_requests,
            Service::Rpdo(_) => &mut self.rpdos,
            Service::Lss
            | Service::Time
            | Service::TpdoRequest(_)
            | Service::Guarding
            | Service::Heartbeat(_)
            | Service::Emergency(_) => return,
        };
        *counter += 1;
    }
}

impl Node {
    /// How much it had to do since power-on.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }
}
