//! Deadlines that come again.

use core::time::Duration;

use od::Instant;

/// What follows `deadline` when it is served at `now`: a period after it, so that a late call shifts nothing. Periods
/// that have passed altogether are not made up for.
pub(crate) fn following(deadline: Instant, period: Duration, now: Instant) -> Instant {
    let next = deadline + period;
    if next > now { next } else { now + period }
}
