//! The raster of an axis, aligned to the set-points of its master.
//!
//! A master and a drive have clocks of their own, and set-points come a little early or late. If a raster step lay near
//! their arrival, it would be now before and now after it: one step would see no set-point and the next one two. So
//! the raster is moved until its steps lie half a period after the arrivals, as with a phase-locked loop: the first
//! arrival moves it all the way, each further one by its share of the mean, and no less than 1/32 of what is left.
//! Arrivals that vary by less than half a period then find the same steps between them every time.

use core::time::Duration;

use od::Instant;

/// How well the raster is known to lie.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Alignment {
    arrivals: u64,
    last: Instant,
}

impl Alignment {
    /// Arrivals over which the mean is taken.
    const LONGEST_MEAN: u64 = 32;
    /// Periods without an arrival after which the next one is the first again.
    const LONGEST_GAP: u32 = 100;

    /// Where the step that is due at `next` is to be instead, as a set-point arrives at `now`. Never before `now`.
    pub(crate) fn align(&mut self, next: Instant, now: Instant, period: Duration) -> Instant {
        if now.saturating_since(self.last) > period * Self::LONGEST_GAP {
            self.arrivals = 0;
        }
        self.last = now;
        self.arrivals = (self.arrivals + 1).min(Self::LONGEST_MEAN);
        let period = i128::from(period.as_nanos() as u64).max(1);
        let wait = i128::from(next.as_nanos()) - i128::from(now.as_nanos());
        let wait = wait.rem_euclid(period);
        let error = wait - period / 2;
        let corrected = wait - error / i128::from(self.arrivals);
        now + Duration::from_nanos(u64::try_from(corrected).unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(1);

    fn at(nanos: u64) -> Instant {
        Instant::from_nanos(nanos)
    }

    #[test]
    fn the_first_arrival_moves_the_raster_all_the_way() {
        for wait in [0, 1, 400_000, 999_999, 1_000_000] {
            let next = Alignment::default().align(at(5_000_000 + wait), at(5_000_000), PERIOD);
            assert_eq!(next, at(5_500_000), "{wait}");
        }
    }

    #[test]
    fn later_arrivals_move_it_by_their_share_of_the_mean() {
        let mut alignment = Alignment::default();
        alignment.align(at(500_000), at(0), PERIOD);
        // 300 us late: the mean of two is 150 us.
        assert_eq!(alignment.align(at(1_500_000), at(1_300_000), PERIOD), at(1_650_000));
        for cycle in 2..200_u64 {
            alignment.align(at(cycle * 1_000_000 + 500_000), at(cycle * 1_000_000), PERIOD);
        }
        assert_eq!(alignment.align(at(200_500_000), at(200_320_000), PERIOD), at(200_510_000));
    }

    #[test]
    fn a_clock_that_runs_faster_is_followed() {
        // 100 ppm: a tenth of a microsecond in each cycle.
        let mut alignment = Alignment::default();
        let mut next = at(500_000);
        for cycle in 0..10_000_u64 {
            let now = at(cycle * 999_900);
            next = alignment.align(next, now, PERIOD);
            let wait = next.as_nanos() - now.as_nanos();
            assert!((490_000..=510_000).contains(&wait), "{wait}");
            next = next + PERIOD;
        }
    }
}
