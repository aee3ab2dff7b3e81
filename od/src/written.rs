//! Which entries a bus has written.

use crate::Slot;

/// Entries that a bus has written and the device has not seen, each once, in the order of writing.
#[derive(Clone, Debug)]
pub(crate) struct Written {
    queue: Vec<Slot>,
    /// How many at the front of the queue were taken.
    taken: usize,
    /// For each slot, whether it waits.
    is_waiting: Vec<bool>,
}

impl Written {
    /// None of so many entries.
    pub(crate) fn new(entries: usize) -> Self {
        Self { queue: Vec::with_capacity(64.min(entries)), taken: 0, is_waiting: vec![false; entries] }
    }

    /// The entry at `slot` was written.
    #[inline]
    pub(crate) fn push(&mut self, slot: Slot) {
        let Some(is_waiting) = self.is_waiting.get_mut(slot.position()) else { return };
        if core::mem::replace(is_waiting, true) {
            return;
        }
        if self.queue.len() == self.queue.capacity() {
            self.queue.drain(..core::mem::take(&mut self.taken));
        }
        self.queue.push(slot);
    }

    /// The next entry.
    #[inline]
    pub(crate) fn pop(&mut self) -> Option<Slot> {
        let slot = *self.queue.get(self.taken)?;
        self.taken += 1;
        if self.taken == self.queue.len() {
            self.queue.clear();
            self.taken = 0;
        }
        if let Some(is_waiting) = self.is_waiting.get_mut(slot.position()) {
            *is_waiting = false;
        }
        Some(slot)
    }

    /// Whether the entry at `slot` waits.
    #[inline]
    pub(crate) fn contains(&self, slot: Slot) -> bool {
        self.is_waiting.get(slot.position()).copied().unwrap_or(false)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    pub(crate) fn clear(&mut self) {
        self.queue.clear();
        self.taken = 0;
        self.is_waiting.fill(false);
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;

    use proptest::prelude::*;

    use super::*;

    /// Few enough for all to wait at times.
    const ENTRIES: usize = 100;

    proptest! {
        #[test]
        fn each_entry_waits_once_in_the_order_of_writing_and_the_queue_has_room_for_all(
            steps in prop::collection::vec(prop::option::weighted(0.6, 0..ENTRIES), 0..2000),
        ) {
            let mut written = Written::new(ENTRIES);
            let mut expected = VecDeque::new();
            for step in steps {
                if let Some(slot) = step.map(|position| Slot::from_position(position).unwrap()) {
                    prop_assert_eq!(written.contains(slot), expected.contains(&slot));
                    written.push(slot);
                    if !expected.contains(&slot) {
                        expected.push_back(slot);
                    }
                } else {
                    prop_assert_eq!(written.pop(), expected.pop_front());
                }
                prop_assert_eq!(written.is_empty(), expected.is_empty());
                prop_assert!(written.queue.capacity() <= 2 * ENTRIES);
            }
            written.clear();
            prop_assert_eq!(written.pop(), None);
        }
    }
}
