//! What a node does for an LSS master (CiA 305 v3.0).

use od::{Address, Instant, Schema};

use super::{Event, Node, Order};
use crate::communication::IDENTITY;
use crate::lss::{self, LssAddress, LssSetting, Reaction, Slave};
use crate::{Frame, Id};

/// Sub-index of the serial number in 0x1018.
const SERIAL: u8 = 4;

impl Node {
    /// Takes `stored` for what an LSS master has stored. It is the Node-ID of a node that was made without one.
    pub fn set_lss(&mut self, stored: LssSetting) {
        let node_id = if self.is_fixed { self.node_id } else { stored.node_id };
        self.lss = Slave::new(LssSetting { node_id, ..stored });
        self.lss_stored = stored;
    }

    /// Whether the owner has given the node its Node-ID, so that a stored one has no effect.
    #[must_use]
    pub fn has_fixed_id(&self) -> bool {
        self.is_fixed
    }

    /// What an LSS master has stored.
    #[must_use]
    pub fn lss_stored(&self) -> LssSetting {
        self.lss_stored
    }

    /// What an LSS master has set; it takes effect when the communication is reset.
    #[must_use]
    pub fn lss_pending(&self) -> LssSetting {
        self.lss.pending()
    }

    /// Makes `serial` the serial number 0x1018:04 of this very device, which LSS tells equal devices apart by.
    pub fn set_serial(&mut self, serial: u32) {
        self.serial = Some(serial);
        self.show_serial();
    }

    pub(super) fn show_serial(&mut self) {
        let slot = self.communication.find(Address::new(IDENTITY, SERIAL));
        if let (Some(serial), Ok(slot)) = (self.serial, slot) {
            self.communication.set(slot, serial.into());
        }
    }

    pub(super) fn handle_lss(&mut self, now: Instant, frame: &Frame, application: &Schema) {
        let Some(message) = frame.eight() else {
            self.counters.malformed += 1;
            return;
        };
        let address = self.lss_address();
        match self.lss.handle(message, self.node_id, &address) {
            Reaction::None => {}
            Reaction::Answer(answer) => self.answer_lss(&answer),
            Reaction::Store(setting) => self.store_lss(setting),
            Reaction::Start => self.boot(now, application),
        }
    }

    /// Lets the pending Node-ID take effect.
    pub(super) fn adopt_node_id(&mut self) {
        let node_id = self.lss.pending().node_id;
        if node_id == self.node_id {
            return;
        }
        self.node_id = node_id;
        self.origin.client = u16::from(node_id);
        self.communication.set_node_id(node_id);
        self.sdo.set_node_id(node_id);
        self.notify(Event::NodeId(node_id));
    }

    pub(super) fn answer_lss(&mut self, answer: &[u8; 8]) {
        self.send(Frame::new(Id::Standard(lss::ANSWER), answer));
    }

    /// Passes the order on; the answer waits for [`Node::stored`].
    fn store_lss(&mut self, setting: LssSetting) {
        if !self.storage.begin_lss(setting) {
            return self.answer_lss(&Slave::stored(false));
        }
        self.notify(Event::Storage(Order::Lss(setting)));
    }

    fn lss_address(&self) -> LssAddress {
        let part =
            |sub| self.communication.find(Address::new(IDENTITY, sub)).map(|s| self.communication.raw(s));
        [1, 2, 3, SERIAL].map(|sub| part(sub).map_or(0, |raw| raw as u32))
    }
}
