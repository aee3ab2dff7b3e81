//! The one clock.

use std::time;

use od::Instant;

/// Monotonic time since the clock was made.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start: time::Instant,
    /// Wall-clock time at the start.
    epoch: time::Duration,
}

impl Clock {
    /// A clock that starts now.
    #[must_use]
    pub fn start() -> Self {
        Self { start: time::Instant::now(), epoch: Self::wall() }
    }

    /// What it shows.
    #[must_use]
    pub fn now(&self) -> Instant {
        Instant::ZERO + self.start.elapsed()
    }

    /// The time since 1970 by the wall clock, which may jump; zero if that believes it is before 1970.
    #[must_use]
    pub fn wall() -> time::Duration {
        time::SystemTime::now().duration_since(time::UNIX_EPOCH).unwrap_or_default()
    }

    /// The time since 1970 at `moment`, as the wall clock had it when this clock was started: never backwards.
    #[must_use]
    pub fn unix_time(&self, moment: Instant) -> time::Duration {
        self.epoch + moment.saturating_since(Instant::ZERO)
    }
}
