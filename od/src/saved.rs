//! Power-on values: what takes the place of the defaults because somebody had it stored (CiA 301 v4.2, sections
//! 7.5.2.13 and 7.5.2.14).
//!
//! Stored are the *parameters* of a device ([`Entry::is_parameter`]): what can be read and written, is no command and
//! is not volatile. A [`Saved`] never changes what an entry shows now; [`Dictionary::reset`] goes back to it.

use std::collections::BTreeMap;

use crate::{Address, Data, Dictionary, Entry, Initial, Value};

/// The parameters that are stored and restored together. The discriminant is the sub-index in 0x1010 and 0x1011.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// All of them.
    All = 1,
    /// 0x1000-0x1FFF.
    Communication = 2,
    /// 0x6000-0x9FFF.
    Application = 3,
    /// 0x2000-0x5FFF.
    Manufacturer = 4,
}

impl Group {
    /// The group that sub-index `sub` of 0x1010 and 0x1011 stands for, if there is one.
    #[must_use]
    pub const fn from_sub(sub: u8) -> Option<Self> {
        match sub {
            1 => Some(Self::All),
            2 => Some(Self::Communication),
            3 => Some(Self::Application),
            4 => Some(Self::Manufacturer),
            _ => None,
        }
    }

    /// Whether the object `index` belongs to it.
    #[must_use]
    pub const fn contains(self, index: u16) -> bool {
        match self {
            Self::All => true,
            Self::Communication => matches!(index, 0x1000..=0x1FFF),
            Self::Application => matches!(index, 0x6000..=0x9FFF),
            Self::Manufacturer => matches!(index, 0x2000..=0x5FFF),
        }
    }
}

/// Stored values, each as the bytes that an SDO would carry.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Saved(BTreeMap<Address, Vec<u8>>);

impl Saved {
    /// Whether every entry has its default.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The values in the order of their addresses.
    pub fn iter(&self) -> impl Iterator<Item = (Address, &[u8])> {
        self.0.iter().map(|(address, bytes)| (*address, bytes.as_slice()))
    }

    /// The value of the entry at `address`, if it is stored.
    #[must_use]
    pub fn get(&self, address: Address) -> Option<&[u8]> {
        self.0.get(&address).map(Vec::as_slice)
    }

    /// Adds a value; whether there was none at this address.
    pub fn insert(&mut self, address: Address, bytes: Vec<u8>) -> bool {
        self.0.insert(address, bytes).is_none()
    }
}

impl Entry {
    /// Whether its value can be stored: it can be read and written, commands nothing and is not volatile.
    #[must_use]
    pub fn is_parameter(&self) -> bool {
        let is_setting = self.command.is_none() || self.is_kept;
        self.access.is_readable() && self.access.is_writable() && is_setting && !self.is_volatile
    }
}

impl Dictionary {
    /// What is stored.
    #[must_use]
    pub fn saved(&self) -> &Saved {
        &self.saved
    }

    /// What would be stored if the parameters in `selected` objects were now: their present values, the others as
    /// they were stored before. A default that follows the Node-ID is not stored, so that it goes on following it.
    #[must_use]
    pub fn save(&self, selected: impl Fn(u16) -> bool) -> Saved {
        let mut saved = self.forget(&selected);
        for ((address, entry), value) in self.schema.entries().zip(&self.values) {
            let follows = matches!(entry.initial, Initial::PlusNodeId(_));
            if selected(address.index)
                && entry.is_parameter()
                && !(follows && *value == entry.power_on(self.node_id))
            {
                saved.insert(address, bytes_of(entry, value));
            }
        }
        saved
    }

    /// What would be stored if the parameters in `selected` objects went back to their defaults.
    #[must_use]
    pub fn forget(&self, selected: impl Fn(u16) -> bool) -> Saved {
        let kept = self.saved.0.iter().filter(|(address, _)| !selected(address.index));
        Saved(kept.map(|(address, bytes)| (*address, bytes.clone())).collect())
    }

    /// Takes `saved` for what is stored, from the next [`Dictionary::reset`] on. Values of entries that do not exist,
    /// are no parameters or refuse them are left out; gives how many.
    pub fn set_saved(&mut self, mut saved: Saved) -> usize {
        let before = saved.0.len();
        saved.0.retain(|address, bytes| self.takes(*address, bytes));
        let left_out = before - saved.0.len();
        self.saved = saved;
        left_out
    }

    fn takes(&self, address: Address, bytes: &[u8]) -> bool {
        let Some(slot) = self.schema.slot(address) else { return false };
        let Some(entry) = self.schema.entry(slot) else { return false };
        entry.is_parameter() && self.check_stored(slot, entry, bytes).is_ok()
    }

    /// Puts the stored values of the `selected` objects in the place of the defaults.
    pub(crate) fn restore(&mut self, selected: impl Fn(u16) -> bool) {
        let saved = core::mem::take(&mut self.saved);
        for (address, bytes) in saved.iter().filter(|(address, _)| selected(address.index)) {
            if let Some(slot) = self.schema.slot(address) {
                self.put(slot, Data::Bytes(bytes));
            }
        }
        self.saved = saved;
    }
}

fn bytes_of(entry: &Entry, value: &Value) -> Vec<u8> {
    match value {
        Value::Fixed(raw) => {
            raw.to_le_bytes().into_iter().take(entry.data_type.bytes().unwrap_or(8)).collect()
        }
        Value::Bytes(bytes) => bytes.to_vec(),
    }
}
