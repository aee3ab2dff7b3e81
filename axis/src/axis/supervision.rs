//! The sign of life of whoever commands the axis (MACCON MAC4 User Manual, section 4.7).

use core::num::NonZeroU32;

/// Counts the raster steps since the last sign of life as a deadline.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Supervision {
    timeout: Option<NonZeroU32>,
    deadline: u64,
}

impl Supervision {
    /// Expects a sign of life every so many raster steps, the first counted from `now`; `None` expects nothing.
    pub(super) fn expect(&mut self, timeout: Option<NonZeroU32>, now: u64) {
        self.timeout = timeout;
        self.refresh(now);
    }

    /// Takes a sign of life.
    pub(super) fn refresh(&mut self, now: u64) {
        self.deadline = now.saturating_add(self.timeout.map_or(0, |steps| u64::from(steps.get())));
    }

    /// Whether it did not come in time.
    pub(super) fn is_expired(&self, now: u64) -> bool {
        self.timeout.is_some() && now > self.deadline
    }
}
