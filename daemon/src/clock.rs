//! The one clock.

use std::time;

use nix::time::{ClockId, clock_gettime};
use od::Instant;

/// Monotonic time since the clock was made.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    start: time::Instant,
    /// Wall-clock time at the start.
    epoch: time::Duration,
    #[cfg(test)]
    ticks: Option<&'static Ticks>,
}

/// Virtual time, for tests of those who look at the clock themselves: each look is so much later than the one before.
#[cfg(test)]
#[derive(Debug)]
pub(crate) struct Ticks {
    next: core::sync::atomic::AtomicU64,
    nanos: u64,
}

impl Clock {
    /// A clock that starts now.
    #[must_use]
    pub fn start() -> Self {
        Self {
            start: time::Instant::now(),
            epoch: Self::wall(),
            #[cfg(test)]
            ticks: None,
        }
    }

    /// A clock that only goes on when it is looked at.
    #[cfg(test)]
    pub(crate) fn ticking(tick: time::Duration) -> Self {
        let nanos = tick.as_nanos() as u64;
        let ticks = Ticks { next: core::sync::atomic::AtomicU64::new(0), nanos };
        Self { ticks: Some(Box::leak(Box::new(ticks))), ..Self::start() }
    }

    /// What it shows.
    #[must_use]
    pub fn now(&self) -> Instant {
        #[cfg(test)]
        if let Some(Ticks { next, nanos }) = self.ticks {
            return Instant::from_nanos(next.fetch_add(*nanos, core::sync::atomic::Ordering::Relaxed));
        }
        Instant::ZERO + self.start.elapsed()
    }

    /// The time since 1970 by the wall clock, which may jump; zero if that believes it is before 1970.
    #[must_use]
    pub fn wall() -> time::Duration {
        time::SystemTime::now().duration_since(time::UNIX_EPOCH).unwrap_or_default()
    }

    /// The processor time that the calling thread has used.
    #[must_use]
    pub fn of_thread() -> time::Duration {
        // There is no machine without this clock.
        clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID).map_or(time::Duration::ZERO, time::Duration::from)
    }

    /// The time since 1970 at `moment`, as the wall clock had it when this clock was started: never backwards.
    #[must_use]
    pub fn unix_time(&self, moment: Instant) -> time::Duration {
        self.epoch + moment.saturating_since(Instant::ZERO)
    }
}
