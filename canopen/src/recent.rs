//! What has happened, for whoever asks afterwards: how often, and the last times.

use od::Instant;

/// How many are remembered.
const KEPT: usize = 5;

/// Events of one kind since power-on. Noting one takes no memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recent<T> {
    count: u64,
    /// Newest first.
    last: [Option<(Instant, T)>; KEPT],
}

impl<T: Copy> Recent<T> {
    pub(crate) fn note(&mut self, now: Instant, what: T) {
        self.count += 1;
        self.last.rotate_right(1);
        self.last.iter_mut().take(1).for_each(|newest| *newest = Some((now, what)));
    }

    /// How many there were.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The last five, each with its time, newest first.
    pub fn iter(&self) -> impl Iterator<Item = (Instant, T)> {
        self.last.iter().flatten().copied()
    }
}

impl<T: Copy> Default for Recent<T> {
    fn default() -> Self {
        Self { count: 0, last: [None; KEPT] }
    }
}
