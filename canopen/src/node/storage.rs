//! Storing and restoring parameters by 0x1010 and 0x1011, and 0x1020, which tells whether the stored ones are still
//! those that a configuration tool left (CiA 301 v4.2, sections 7.5.2.13, 7.5.2.14 and 7.5.2.23).
//!
//! The node stores nothing itself. It passes an [`Order`] to its owner and its SDO server holds the answer back until
//! [`Node::stored`]: a client that has the answer may cut the power.

use od::{AbortCode, Address, Dictionary, Entry, Group, Instant, Saved, Schema, Slot};

use super::{Event, Node};
use crate::LssSetting;
use crate::communication::{Objects, RESTORE_PARAMETERS, STORE_PARAMETERS, VERIFY_CONFIGURATION};
use crate::lss::Slave;

/// What to do with the stored values of a group of parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Make the present values the power-on values.
    Save(Group),
    /// Make the defaults the power-on values.
    Restore(Group),
    /// Keep what an LSS master has set.
    Lss(LssSetting),
}

impl Order {
    /// The order that writing to `address` gives.
    pub(super) fn at(address: Address) -> Option<Self> {
        let group = Group::from_sub(address.sub);
        match address.index {
            STORE_PARAMETERS => group.map(Self::Save),
            RESTORE_PARAMETERS => group.map(Self::Restore),
            _ => None,
        }
    }

    /// What is to be stored of `dictionary` then. The verification 0x1020 goes with every group, since it speaks of
    /// all of them.
    #[must_use]
    pub fn apply(self, dictionary: &Dictionary) -> Saved {
        let is_in = |group: Group| move |index| group.contains(index) || index == VERIFY_CONFIGURATION;
        match self {
            Self::Save(group) => dictionary.save(is_in(group)),
            Self::Restore(group) => dictionary.forget(is_in(group)),
            Self::Lss(_) => dictionary.saved().clone(),
        }
    }

    /// What has to be written: "save" or "load", first letter first; nothing orders LSS to be stored.
    const fn signature(self) -> Option<u64> {
        match self {
            Self::Save(_) => Some(u32::from_le_bytes(*b"save") as u64),
            Self::Restore(_) => Some(u32::from_le_bytes(*b"load") as u64),
            Self::Lss(_) => None,
        }
    }
}

/// What an entry of 0x1010 or 0x1011 reads: bit 0, on command.
const ON_COMMAND: u64 = 1 << 0;

/// The order under way, and whether 0x1020 is being renewed.
#[derive(Debug, Default)]
pub(super) struct Storage {
    /// What is to be done, and for whom.
    order: Option<(Order, Client)>,
    /// Whether 0x1020 was written since parameters were last stored: then it is meant for what is being written.
    is_signed: bool,
}

/// Who waits for an order to end.
#[derive(Clone, Copy, Debug)]
pub(super) enum Client {
    /// That of the SDO server at this position.
    Sdo(usize),
    /// The LSS master.
    Lss,
    /// Somebody on this machine.
    Local,
}

impl Storage {
    /// Whether the entry at `address` may become `raw`.
    pub(super) fn check(
        &self,
        objects: &Objects<'_>,
        address: Address,
        slot: Slot,
        raw: u64,
    ) -> Result<(), AbortCode> {
        if !matches!(address.index, STORE_PARAMETERS | RESTORE_PARAMETERS) {
            return Ok(());
        }
        let order = Order::at(address).filter(|_| objects.communication.raw(slot) & ON_COMMAND != 0);
        match order {
            Some(order) if order.signature() == Some(raw) && self.order.is_none() => Ok(()),
            Some(order) if order.signature() == Some(raw) => Err(AbortCode::DeviceState),
            Some(_) | None => Err(AbortCode::CannotStore),
        }
    }

    /// Begins to store what an LSS master has set, unless something else is being stored.
    pub(super) fn begin_lss(&mut self, setting: LssSetting) -> bool {
        let is_free = self.order.is_none();
        if is_free {
            self.order = Some((Order::Lss(setting), Client::Lss));
        }
        is_free
    }

    /// A reset: what is in effect is what was stored.
    pub(super) fn restart(&mut self) {
        self.is_signed = false;
    }
}

impl Node {
    /// Takes `saved` for the stored communication parameters; they take effect with the next reset. Gives how many of
    /// them do not fit this node and are left out.
    pub fn set_saved(&mut self, saved: Saved) -> usize {
        self.communication.set_saved(saved)
    }

    /// Ends the order of the last [`Event::Storage`]: what it asked for is stored or, for the given reason, as before.
    /// The client gets its answer.
    pub fn stored(&mut self, now: Instant, outcome: Result<(), AbortCode>) {
        let Some((order, client)) = self.storage.order.take() else { return };
        match order {
            _ if outcome.is_err() => {}
            Order::Lss(setting) => self.lss_stored = setting,
            Order::Save(_) => self.storage.is_signed = false,
            Order::Restore(_) => {
                self.storage.is_signed = false;
                self.void_verification();
            }
        }
        let position = match client {
            Client::Sdo(position) => position,
            Client::Lss => return self.answer_lss(&Slave::stored(outcome.is_ok())),
            // Whoever is on this machine hears of it by the owner of the node.
            Client::Local => return,
        };
        if let Some(connection) = self.sdo.get_mut(position)
            && let Some(answer) = connection.server.release(outcome)
            && let Some(answer) = connection.frame(answer)
        {
            self.send_answer(now, answer);
        }
    }

    /// Acts on what `client` has written to `address`, after the checks.
    pub(super) fn note_write(&mut self, client: Client, address: Address, application: &Schema) {
        let Some(order) = Order::at(address) else { return self.verify(address, application) };
        if let Ok(slot) = self.communication.find(address) {
            self.communication.set(slot, ON_COMMAND);
        }
        self.storage.order = Some((order, client));
        self.notify(Event::Storage(order));
    }

    /// A parameter that changes after 0x1020 was stored makes that void.
    fn verify(&mut self, written: Address, application: &Schema) {
        if written.index == VERIFY_CONFIGURATION {
            self.storage.is_signed = true;
        }
        let is_parameter = |schema: &Schema| {
            schema.slot(written).and_then(|slot| schema.entry(slot)).is_some_and(Entry::is_parameter)
        };
        let is_parameter = is_parameter(self.communication.schema()) || is_parameter(application);
        if is_parameter && !self.storage.is_signed {
            self.void_verification();
        }
    }

    fn void_verification(&mut self) {
        for sub in 1..=2 {
            if let Ok(slot) = self.communication.find(Address::new(VERIFY_CONFIGURATION, sub)) {
                self.communication.set(slot, 0);
            }
        }
    }
}
