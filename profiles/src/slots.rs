//! Where the bound entries of one axis stand in the dictionary.

use od::{Dictionary, Schema, Slot};

use crate::cia402::units::Units;
use crate::{Binding, Bound};

/// The slots behind the bindings of one axis.
#[derive(Debug)]
pub(crate) struct Slots([Option<Slot>; Binding::COUNT]);

impl Slots {
    /// The slots of `axis` among `bindings`.
    pub(crate) fn new(schema: &Schema, bindings: &[Bound], axis: u8) -> Self {
        let mut slots = [None; Binding::COUNT];
        for bound in bindings.iter().filter(|b| b.axis == axis) {
            if let Some(place) = slots.get_mut(bound.binding as usize) {
                *place = schema.slot(bound.address);
            }
        }
        Self(slots)
    }

    /// The slot behind `binding`, if this device has it.
    pub(crate) fn get(&self, binding: Binding) -> Option<Slot> {
        self.0.get(binding as usize).copied().flatten()
    }

    /// The integer at `binding`, if this device has it.
    pub(crate) fn integer(&self, dictionary: &Dictionary, binding: Binding) -> Option<i64> {
        // No entry is wider than 64 bits, and none of those that are bound is an UNSIGNED64.
        self.get(binding).map(|slot| dictionary.integer(slot) as i64)
    }

    /// Shows `value` at `binding`, in two's complement, if this device has it.
    pub(crate) fn show(&self, dictionary: &mut Dictionary, binding: Binding, value: i64) {
        if let Some(slot) = self.get(binding) {
            dictionary.set(slot, value.cast_unsigned());
        }
    }
}

/// The parameters of one axis as its dictionary holds them.
#[derive(Clone, Copy)]
pub(crate) struct Parameters<'a> {
    pub(crate) dictionary: &'a Dictionary,
    pub(crate) slots: &'a Slots,
    /// The units of what they say.
    pub(crate) units: &'a Units,
}

impl Parameters<'_> {
    /// The integer at `binding`, if this device has it.
    pub(crate) fn get(&self, binding: Binding) -> Option<i64> {
        self.slots.integer(self.dictionary, binding)
    }

    /// The integer at `binding`, or what the standard assumes where the object is missing.
    pub(crate) fn or(&self, binding: Binding, assumed: i64) -> i64 {
        self.get(binding).unwrap_or(assumed)
    }
}
