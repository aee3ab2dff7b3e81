//! What somebody knows of entries, by their slots.

use crate::Slot;

/// Values for some entries of a dictionary, found without a search.
#[derive(Clone, Debug)]
pub struct SlotTable<T>(Vec<Option<T>>);

impl<T> Default for SlotTable<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T: Copy> SlotTable<T> {
    /// The value at `slot`, if it has one.
    #[must_use]
    #[inline]
    pub fn get(&self, slot: Slot) -> Option<T> {
        self.0.get(slot.position()).copied().flatten()
    }
}

impl<T> FromIterator<(Slot, T)> for SlotTable<T> {
    /// Of several values for a slot the last one counts.
    fn from_iter<I: IntoIterator<Item = (Slot, T)>>(values: I) -> Self {
        let mut table = Self::default();
        for (slot, value) in values {
            if table.0.len() <= slot.position() {
                table.0.resize_with(slot.position() + 1, || None);
            }
            if let Some(place) = table.0.get_mut(slot.position()) {
                *place = Some(value);
            }
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_has_the_last_value_that_was_given_or_none() {
        let slots: Vec<Slot> = (0..5).filter_map(Slot::from_position).collect();
        let table: SlotTable<char> =
            [(slots[3], 'a'), (slots[1], 'b'), (slots[3], 'c')].into_iter().collect();
        let found: Vec<_> = slots.iter().map(|slot| table.get(*slot)).collect();
        assert_eq!(found, [None, Some('b'), None, Some('c'), None]);
    }
}
