//! The values of one device.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::written::Written;
use crate::{
    AbortCode, Address, Commanded, Data, DataType, Entry, Origin, Owner, RefusedCommand, Saved, Schema,
    Value, Write,
};

/// Where an entry of a particular dictionary is kept: the fast way to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Slot(u16);

impl Slot {
    pub(crate) fn from_position(position: usize) -> Option<Self> {
        u16::try_from(position).ok().map(Self)
    }

    pub(crate) const fn position(self) -> usize {
        self.0 as usize
    }
}

/// Most axes one device may have.
pub(crate) const MAX_AXES: usize = 8;
/// Commands that may wait to be taken note of; older ones are forgotten.
const MAX_COMMANDED: usize = 64;
/// The same for commands that were refused. A batch has one at most.
const MAX_REFUSED: usize = 8;

/// The object dictionary of one device.
#[derive(Clone, Debug)]
pub struct Dictionary {
    pub(crate) schema: Arc<Schema>,
    pub(crate) node_id: u8,
    pub(crate) values: Vec<Value>,
    pub(crate) saved: Saved,
    written: Written,
    revision: u64,
    pub(crate) owners: [Option<Owner>; MAX_AXES],
    commanded: VecDeque<Commanded>,
    refused: VecDeque<RefusedCommand>,
}

impl Dictionary {
    /// A dictionary of `schema` with the power-on values of node `node_id`.
    #[must_use]
    pub fn new(schema: Arc<Schema>, node_id: u8) -> Self {
        let values: Vec<Value> = schema.entries().map(|(_, entry)| entry.power_on(node_id)).collect();
        let written = Written::new(values.len());
        let (saved, owners) = (Saved::default(), [None; MAX_AXES]);
        let commanded = VecDeque::with_capacity(MAX_COMMANDED);
        let refused = VecDeque::with_capacity(MAX_REFUSED);
        Self { schema, node_id, values, saved, written, revision: 0, owners, commanded, refused }
    }

    /// The objects this dictionary has.
    #[must_use]
    pub fn schema(&self) -> &Arc<Schema> {
        &self.schema
    }

    /// The Node-ID that the defaults were made for.
    #[must_use]
    pub fn node_id(&self) -> u8 {
        self.node_id
    }

    /// Makes the defaults that follow the Node-ID follow this one, from the next [`Dictionary::reset`] on.
    pub fn set_node_id(&mut self, node_id: u8) {
        self.node_id = node_id;
    }

    /// Gives every entry its power-on value again: the stored one, else the default. What was written and not yet taken is forgotten.
    pub fn reset(&mut self) {
        for (value, (_, entry)) in self.values.iter_mut().zip(self.schema.entries()) {
            *value = entry.power_on(self.node_id);
        }
        self.restore(|_| true);
        self.written.clear();
        self.revision += 1;
    }

    /// Gives every entry of the `selected` objects its power-on value again, as if that part alone had been switched
    /// off.
    pub fn restart(&mut self, selected: impl Fn(u16) -> bool) {
        for (value, (address, entry)) in self.values.iter_mut().zip(self.schema.entries()) {
            if selected(address.index) {
                *value = entry.power_on(self.node_id);
            }
        }
        self.restore(selected);
        self.revision += 1;
    }

    /// The slot of the entry at `address`, as CANopen finds it: local entries do not exist for it.
    ///
    /// # Errors
    /// [`AbortCode::NoObject`] or [`AbortCode::NoSubIndex`].
    pub fn find(&self, address: Address) -> Result<Slot, AbortCode> {
        self.schema.find(address)
    }

    /// What a bus reads at `slot`.
    ///
    /// # Errors
    /// [`AbortCode::WriteOnly`].
    pub fn read(&self, slot: Slot) -> Result<(&Entry, &Value), AbortCode> {
        let entry = self.schema.entry(slot).ok_or(AbortCode::NoObject)?;
        let value = self.values.get(slot.position()).ok_or(AbortCode::NoObject)?;
        if entry.access.is_readable() { Ok((entry, value)) } else { Err(AbortCode::WriteOnly) }
    }

    /// The bit pattern at `slot`, zero for strings and domains.
    #[must_use]
    #[inline]
    pub fn raw(&self, slot: Slot) -> u64 {
        self.values.get(slot.position()).map_or(0, Value::raw)
    }

    /// The integer at `slot`, sign-extended by its type; zero for strings and domains.
    #[must_use]
    pub fn integer(&self, slot: Slot) -> i128 {
        self.data_type(slot).map_or(0, |t| t.integer(self.raw(slot)))
    }

    /// What a bus reads at `slot` as a number of 64 bits, sign-extended by its type; zero for strings, domains and what
    /// may only be written.
    #[must_use]
    #[inline]
    pub fn shown(&self, slot: Slot) -> u64 {
        let rule = self.schema.rule(slot).filter(|rule| rule.is_readable);
        rule.map_or(0, |rule| rule.extended(self.raw(slot)))
    }

    /// The value at `slot`.
    #[must_use]
    pub fn value(&self, slot: Slot) -> Option<&Value> {
        self.values.get(slot.position())
    }

    fn data_type(&self, slot: Slot) -> Option<DataType> {
        self.schema.entry(slot).map(|e| e.data_type)
    }

    /// Sets the bit pattern at `slot`: the device showing its own state. Bits the type does not have are cut off.
    /// Never for what comes from a bus.
    #[inline]
    pub fn set(&mut self, slot: Slot, raw: u64) {
        let Some(rule) = self.schema.rule(slot) else { return };
        if let Some(Value::Fixed(old)) = self.values.get_mut(slot.position()) {
            let new = raw & rule.mask;
            self.revision += u64::from(*old != new);
            *old = new;
        }
    }

    /// Sets the string or domain at `slot`: the device showing its own state.
    pub fn set_bytes(&mut self, slot: Slot, bytes: &[u8]) {
        if let Some(Value::Bytes(old)) = self.values.get_mut(slot.position()) {
            self.revision += u64::from(old.as_slice() != bytes);
            match Arc::get_mut(old) {
                Some(own) => {
                    own.clear();
                    own.extend_from_slice(bytes);
                }
                None => *old = Arc::new(bytes.to_vec()),
            }
        }
    }

    /// Stores what the gate let through and remembers that it was written, and who commanded what by it.
    #[inline]
    pub(crate) fn commit(&mut self, origin: Origin, write: &Write<'_>, is_cyclic: bool) {
        let slot = write.slot;
        let is_command = self.is_command(slot);
        let before = if is_command { self.raw(slot) } else { 0 };
        self.put(slot, write.data);
        if is_command {
            if self.commanded.len() == MAX_COMMANDED {
                self.commanded.pop_front();
            }
            let raw = self.raw(slot);
            self.commanded.push_back(Commanded { origin, slot, raw, has_changed: raw != before, is_cyclic });
        }
        self.written.push(slot);
    }

    #[inline]
    pub(crate) fn put(&mut self, slot: Slot, data: Data<'_>) {
        match data {
            Data::Raw(raw) => self.set(slot, raw),
            Data::Bytes(bytes) if matches!(self.value(slot), Some(Value::Bytes(_))) => {
                self.set_bytes(slot, bytes);
            }
            Data::Bytes(_) => self.set(slot, data.raw()),
        }
    }

    /// The next entry that a bus has written since it was last taken, in the order of writing.
    #[inline]
    pub fn take_written(&mut self) -> Option<Slot> {
        self.written.pop()
    }

    /// Whether a bus has written the entry at `slot` since it was last taken.
    #[must_use]
    #[inline]
    pub fn is_written(&self, slot: Slot) -> bool {
        self.written.contains(slot)
    }

    /// Whether a bus has written anything that was not taken yet.
    #[must_use]
    pub fn has_written(&self) -> bool {
        !self.written.is_empty()
    }

    /// A number that grows whenever any value changes.
    #[must_use]
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The next command, in the order of writing.
    pub fn take_commanded(&mut self) -> Option<Commanded> {
        self.commanded.pop_front()
    }

    /// The next command that was refused, in the order of writing. Those of cyclic data are not among them.
    pub fn take_refused(&mut self) -> Option<RefusedCommand> {
        self.refused.pop_front()
    }

    /// Takes note of a command that was refused, or of what came with one in a batch, before it reached the gate: since its
    /// length was wrong, or who sent it may not write it.
    pub fn note_refused(&mut self, refused: RefusedCommand) {
        if self.refused.len() == MAX_REFUSED {
            self.refused.pop_front();
        }
        self.refused.push_back(refused);
    }

    /// Whether the entry at `slot` commands an axis.
    #[must_use]
    pub fn is_command(&self, slot: Slot) -> bool {
        self.schema.rule(slot).is_some_and(|rule| rule.is_command)
    }

    /// Makes `owner` the one who alone may write the entries that command `axis`; `None` for everybody.
    pub fn set_owner(&mut self, axis: u8, owner: Option<Owner>) {
        if let Some(place) = self.owners.get_mut(usize::from(axis)) {
            *place = owner;
        }
    }

    /// Who alone may command `axis`; `None` for everybody.
    #[must_use]
    pub fn owner(&self, axis: u8) -> Option<Owner> {
        self.owners.get(usize::from(axis)).copied().flatten()
    }
}
