//! Supervision of what is to come again and again: heartbeats, guarding requests, RPDOs.

use core::time::Duration;

use od::Instant;

/// One supervision. It begins when what it waits for comes for the first time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Watch {
    /// Nothing has come yet.
    #[default]
    Idle,
    /// It came; the next one is to come before this.
    Until(Instant),
    /// It did not come in time.
    Expired,
}

impl Watch {
    /// It has come, and is to come again within `period`, if any. Returns whether that ends an error.
    pub(crate) fn feed(&mut self, now: Instant, period: Option<Duration>) -> bool {
        let next = period.map_or(Self::Idle, |period| Self::Until(now + period));
        core::mem::replace(self, next) == Self::Expired
    }

    /// Whether it has just turned out to be late; that is said once.
    pub(crate) fn expire(&mut self, now: Instant) -> bool {
        let is_late = self.deadline().is_some_and(|deadline| deadline <= now);
        if is_late {
            *self = Self::Expired;
        }
        is_late
    }

    /// When it is late.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        match self {
            Self::Until(deadline) => Some(*deadline),
            Self::Idle | Self::Expired => None,
        }
    }

    /// Waits for the first one again. Returns whether that ends an error.
    pub(crate) fn stop(&mut self) -> bool {
        core::mem::take(self) == Self::Expired
    }

    /// Waits for the first one again; an error stands until then.
    pub(crate) fn pause(&mut self) {
        if self.deadline().is_some() {
            *self = Self::Idle;
        }
    }
}
