//! Access to a node's communication objects from this machine, by the same rules as from its bus.

use od::{AbortCode, Address, Dictionary, Entry, Instant, Origin, Value};

use super::storage::Client;
use super::{Node, Order};
use crate::communication::{ERROR_FIELD, Objects, is_communication, parameter};
use crate::rules;

impl Node {
    /// What a client reads at `address` of the communication area, 0x1000-0x1FFF.
    ///
    /// # Errors
    /// The abort code that an SDO client would get.
    pub fn read(&self, address: Address) -> Result<(&Entry, &Value), AbortCode> {
        let area = &self.communication;
        let found = area.read(area.find(address)?)?;
        let is_empty =
            address.index == ERROR_FIELD && u64::from(address.sub) > parameter(area, ERROR_FIELD, 0);
        if is_empty { Err(AbortCode::NoData) } else { Ok(found) }
    }

    /// Writes `bytes` to `address` of the communication area and acts on it, as if an SDO client had. Returns whether
    /// that is an order to store, which is done at [`Node::stored`].
    ///
    /// # Errors
    /// The abort code that an SDO client would get; nothing has changed then.
    pub fn write(
        &mut self,
        now: Instant,
        origin: Origin,
        address: Address,
        bytes: &[u8],
        application: &mut Dictionary,
    ) -> Result<bool, AbortCode> {
        if !is_communication(address.index) {
            return Err(AbortCode::NoObject);
        }
        let (pdos, storage) = (&self.pdos, &self.storage);
        let rules = |objects: &Objects<'_>, slot, raw| {
            storage.check(objects, address, slot, raw)?;
            rules::check(pdos, objects, address, slot, raw)
        };
        let mut objects = Objects { communication: &mut self.communication, application };
        objects.write(origin, address, bytes, rules)?;
        self.take_over(now, application.schema());
        self.note_write(Client::Local, address, application.schema());
        Ok(Order::at(address).is_some())
    }
}
