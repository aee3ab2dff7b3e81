//! The checked list of objects that all devices of a kind share.

use core::ops::Range as Span;

use thiserror::Error;

use crate::rule::Rule;
use crate::{
    AbortCode, Access, Address, DataType, Entry, Initial, Object, ObjectKind, Range, Slot, Value, Veto,
};

/// The objects of a device kind: sorted, checked, immutable.
#[derive(Clone, Debug, Default)]
pub struct Schema {
    objects: Vec<Header>,
    addresses: Vec<Address>,
    entries: Vec<Entry>,
    /// What of the entries is asked at every write.
    rules: Vec<Rule>,
}

#[derive(Clone, Debug)]
struct Header {
    index: u16,
    name: String,
    kind: ObjectKind,
    slots: Span<usize>,
}

/// What is wrong with an object that was to become part of a schema.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{address}: {reason}")]
pub struct SchemaError {
    /// The entry at fault.
    pub address: Address,
    /// What is wrong and what would be right.
    pub reason: String,
}

impl Schema {
    /// Most entries a schema may have.
    pub const MAX_ENTRIES: usize = u16::MAX as usize;

    /// Checks and sorts `objects`.
    ///
    /// # Errors
    /// Everything that is wrong with them, not only the first finding.
    pub fn new(mut objects: Vec<Object>) -> Result<Self, Vec<SchemaError>> {
        objects.sort_by_key(|o| o.index);
        let mut errors = Vec::new();
        let mut schema = Self::default();
        for mut object in objects {
            if schema.objects.last().is_some_and(|last| last.index == object.index) {
                errors.push(error(object.index, 0, "the object is defined twice"));
            }
            object.entries.sort_by_key(|e| e.sub);
            check_object(&object, &mut errors);
            schema.push(object);
        }
        if schema.entries.len() > Self::MAX_ENTRIES {
            errors.push(error(0, 0, "there are more than 65535 entries"));
        }
        if errors.is_empty() { Ok(schema) } else { Err(errors) }
    }

    fn push(&mut self, object: Object) {
        let first = self.entries.len();
        self.addresses.extend(object.entries.iter().map(|e| Address::new(object.index, e.sub)));
        self.rules.extend(object.entries.iter().map(Rule::of));
        self.entries.extend(object.entries);
        let (index, name, kind) = (object.index, object.name, object.kind);
        self.objects.push(Header { index, name, kind, slots: first..self.entries.len() });
    }

    /// Adds the owner's objection to the entry at `address`, if it exists.
    pub fn set_veto(&mut self, address: Address, veto: Veto) {
        if let Some(slot) = self.slot(address)
            && let Some(entry) = self.entries.get_mut(slot.position())
            && let Some(rule) = self.rules.get_mut(slot.position())
        {
            entry.veto = Some(veto);
            *rule = Rule::of(entry);
        }
    }

    /// Says that the device gives the entry at `address` values, if it exists. It is live unless a bus sets or commands
    /// it, or it has another default than zero.
    pub fn set_live(&mut self, address: Address) {
        if let Some(entry) = self.slot(address).and_then(|s| self.entries.get_mut(s.position())) {
            let has_no_default = entry.initial == Initial::Value(Value::zero(entry.data_type));
            let is_state = entry.access == Access::ReadOnly || entry.is_volatile && entry.command.is_none();
            entry.is_live = is_state && has_no_default;
        }
    }

    /// Gives the entry at `address`, if it exists, another default, which must be of its type.
    pub fn set_initial(&mut self, address: Address, value: Value) {
        self.set_default(address, Initial::Value(value));
    }

    /// As [`Schema::set_initial`], for a default that may follow the Node-ID.
    pub fn set_default(&mut self, address: Address, initial: Initial) {
        if let Some(entry) = self.slot(address).and_then(|s| self.entries.get_mut(s.position())) {
            entry.initial = initial;
        }
    }

    /// Where the entry at `address` is kept, as CANopen finds it: local entries do not exist for it.
    ///
    /// # Errors
    /// [`AbortCode::NoObject`] or [`AbortCode::NoSubIndex`].
    pub fn find(&self, address: Address) -> Result<Slot, AbortCode> {
        match self.slot(address) {
            Some(slot) if self.entry(slot).is_some_and(|entry| !entry.is_local) => Ok(slot),
            Some(_) => Err(AbortCode::NoObject),
            None if self.has_object(address.index) => Err(AbortCode::NoSubIndex),
            None => Err(AbortCode::NoObject),
        }
    }

    /// Where the entry at `address` is kept, local ones included.
    #[must_use]
    pub fn slot(&self, address: Address) -> Option<Slot> {
        self.addresses.binary_search(&address).ok().and_then(Slot::from_position)
    }

    /// Whether any object that is not local has this index.
    #[must_use]
    pub fn has_object(&self, index: u16) -> bool {
        let object = self.objects.binary_search_by_key(&index, |o| o.index).ok();
        let header = object.and_then(|position| self.objects.get(position));
        let first = header.and_then(|header| self.entries.get(header.slots.start));
        first.is_some_and(|entry| !entry.is_local)
    }

    /// The entry kept at `slot`.
    #[must_use]
    pub fn entry(&self, slot: Slot) -> Option<&Entry> {
        self.entries.get(slot.position())
    }

    /// What is asked at every write of the entry kept at `slot`.
    #[inline]
    pub(crate) fn rule(&self, slot: Slot) -> Option<Rule> {
        self.rules.get(slot.position()).copied()
    }

    /// The address of the entry kept at `slot`.
    #[must_use]
    pub fn address(&self, slot: Slot) -> Option<Address> {
        self.addresses.get(slot.position()).copied()
    }

    /// Every object in the order of the indices: index, name, shape and entries.
    pub fn objects(&self) -> impl Iterator<Item = (u16, &str, ObjectKind, &[Entry])> {
        self.objects.iter().map(|o| {
            (o.index, o.name.as_str(), o.kind, self.entries.get(o.slots.clone()).unwrap_or_default())
        })
    }

    /// Every entry in the order of the addresses.
    pub fn entries(&self) -> impl Iterator<Item = (Address, &Entry)> {
        self.addresses.iter().copied().zip(&self.entries)
    }
}

fn error(index: u16, sub: u8, reason: impl Into<String>) -> SchemaError {
    SchemaError { address: Address::new(index, sub), reason: reason.into() }
}

fn check_object(object: &Object, errors: &mut Vec<SchemaError>) {
    let index = object.index;
    let mut find = |sub: u8, reason: &str| errors.push(error(index, sub, reason));
    if index < 0x1000 {
        find(0, "objects start at index 0x1000");
    }
    for (entry, next) in object.entries.iter().zip(object.entries.iter().skip(1)) {
        if entry.sub == next.sub {
            find(next.sub, "the sub-index is defined twice");
        }
    }
    match object.kind {
        ObjectKind::Var
            if object.entries.len() != 1 || object.entries.first().is_some_and(|e| e.sub != 0) =>
        {
            find(0, "a VAR has exactly sub-index 0");
        }
        ObjectKind::Array | ObjectKind::Record
            if object.entries.first().is_none_or(|e| e.sub != 0 || e.data_type != DataType::Unsigned8) =>
        {
            find(0, "sub-index 0 must be an UNSIGNED8 that holds the highest sub-index");
        }
        ObjectKind::Array if !is_homogeneous(object) => find(1, "all entries of an ARRAY have one type"),
        ObjectKind::Var | ObjectKind::Array | ObjectKind::Record => {}
    }
    if object.entries.iter().zip(object.entries.iter().skip(1)).any(|(a, b)| a.is_local != b.is_local) {
        find(0, "all entries of an object are local or none is");
    }
    for entry in &object.entries {
        for reason in entry_faults(entry) {
            errors.push(error(index, entry.sub, reason));
        }
    }
}

fn is_homogeneous(object: &Object) -> bool {
    let mut types = object.entries.iter().skip(1).map(|e| e.data_type);
    types.next().is_none_or(|first| types.all(|t| t == first))
}

fn entry_faults(entry: &Entry) -> Vec<String> {
    let mut faults = Vec::new();
    if entry.sub == u8::MAX {
        faults.push("sub-index 0xFF is reserved".into());
    }
    if entry.name.is_empty() {
        faults.push("the entry has no name".into());
    }
    if entry.mappable != crate::Mappable::No && entry.data_type.bits().is_none() {
        faults.push(format!("a {} cannot be mapped into a PDO", entry.data_type));
    }
    if entry.is_local && entry.mappable != crate::Mappable::No {
        faults.push("a local entry cannot be mapped into a PDO".into());
    }
    if entry.mappable.receive() && !entry.access.is_writable() {
        faults.push("an entry that a bus may not write cannot be mapped into an RPDO".into());
    }
    if entry.mappable.transmit() && !entry.access.is_readable() {
        faults.push("an entry that a bus may not read cannot be mapped into a TPDO".into());
    }
    faults.extend(part_fault(entry));
    faults.extend(range_fault(entry));
    faults.extend(initial_fault(entry));
    faults
}

fn part_fault(entry: &Entry) -> Option<String> {
    let (part, whole) = (entry.part?, entry.data_type);
    let are_integers = part.integer_limits().is_some() && whole.integer_limits().is_some();
    if entry.mappable == crate::Mappable::No {
        Some("an entry that no PDO carries has no part for one".into())
    } else if are_integers && part.bits() < whole.bits() {
        None
    } else {
        Some(format!("{part} is no narrower integer than {whole}"))
    }
}

fn range_fault(entry: &Entry) -> Option<String> {
    let data_type = entry.data_type;
    match (entry.range?, data_type.integer_limits()) {
        (Range::Integer { min, max }, Some(_)) if min > max => {
            Some(format!("the range {min}..{max} is empty"))
        }
        (Range::Integer { min, max }, Some((low, high))) if min < low || max > high => {
            Some(format!("the range {min}..{max} exceeds {data_type}, {low}..{high}"))
        }
        (Range::Integer { .. }, Some(_)) => None,
        (Range::Real { min, max }, None) if data_type.is_real() => {
            (min > max || min.is_nan() || max.is_nan()).then(|| format!("the range {min}..{max} is empty"))
        }
        (Range::Integer { .. } | Range::Real { .. }, _) => {
            Some(format!("the range does not suit {data_type}"))
        }
    }
}

fn initial_fault(entry: &Entry) -> Option<String> {
    let data_type = entry.data_type;
    match &entry.initial {
        Initial::PlusNodeId(base) if !holds_node_id(data_type, *base) => {
            Some(format!("a default of 0x{base:X} plus the Node-ID does not fit {data_type}"))
        }
        Initial::PlusNodeId(_) => None,
        Initial::Value(Value::Fixed(raw)) if data_type.bits().is_some() => {
            let refusal = entry.range.and_then(|r| r.check(data_type, *raw).err());
            refusal.map(|_| "the default lies outside the range".into())
        }
        Initial::Value(Value::Bytes(bytes)) if data_type.bits().is_none() => {
            let writable = matches!(entry.access, Access::ReadWrite | Access::WriteOnly);
            (writable && bytes.len() > entry.max_length)
                .then(|| "the default is longer than the maximum".into())
        }
        Initial::Value(_) => Some(format!("the default is no {data_type}")),
    }
}

/// Whether `base` plus any Node-ID is a value of `data_type`. The sum of a COB-ID, which has flags in its upper bits,
/// wraps around in 32 bits.
fn holds_node_id(data_type: DataType, base: u32) -> bool {
    const HIGHEST_NODE_ID: i128 = 127;
    let limits = data_type.integer_limits().filter(|_| !data_type.is_signed());
    let fits = |(_, highest)| i128::from(base) + HIGHEST_NODE_ID <= highest;
    data_type == DataType::Unsigned32 || limits.is_some_and(fits)
}
