//! How axes come to rest for good: all of them when the daemon ends, those of a device when it leaves.

use core::time::Duration;

use od::Instant;

/// How long axes may take to ramp down; what moves longer loses its power.
const LONGEST_RAMP: Duration = Duration::from_secs(5);
/// How long masters can then still see them at rest, or without power.
const FAREWELL: Duration = Duration::from_millis(100);

/// Axes that were told to stop.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Departure {
    stage: Stage,
    /// When it is over.
    until: Instant,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// They ramp down.
    Ramp,
    /// They are at rest or coast.
    Farewell,
}

/// What is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Then {
    /// Nothing yet.
    Wait,
    /// Some axis does not come to rest: its power is to be cut.
    CutPower,
    /// They may go.
    Over,
}

impl Departure {
    /// Axes are told to stop at `now`. Of what is at rest nobody has to see that it is.
    pub(super) fn begin(now: Instant, is_at_rest: bool) -> Self {
        match is_at_rest {
            true => Self { stage: Stage::Farewell, until: now },
            false => Self { stage: Stage::Ramp, until: now + LONGEST_RAMP },
        }
    }

    /// When to look again.
    pub(super) fn until(&self) -> Instant {
        self.until
    }

    /// What is to be done at `now`, when all are at rest or not.
    pub(super) fn next(&mut self, now: Instant, is_at_rest: bool) -> Then {
        match self.stage {
            Stage::Ramp if is_at_rest => {
                (self.stage, self.until) = (Stage::Farewell, now + FAREWELL);
                Then::Wait
            }
            Stage::Ramp | Stage::Farewell if now < self.until => Then::Wait,
            Stage::Ramp => {
                (self.stage, self.until) = (Stage::Farewell, now + FAREWELL);
                Then::CutPower
            }
            Stage::Farewell => Then::Over,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLISECOND: Duration = Duration::from_millis(1);

    /// What is done, and after how many milliseconds, if all is at rest after so many.
    fn told(at_rest_after: u32) -> Vec<(u32, Then)> {
        let begun = Instant::from_nanos(7);
        let mut departure = Departure::begin(begun, at_rest_after == 0);
        let mut told = Vec::new();
        for millis in 0..6000 {
            let now = begun + MILLISECOND * millis;
            let then = departure.next(now, millis >= at_rest_after);
            if then != Then::Wait {
                told.push((millis, then));
            }
            if then == Then::Over {
                return told;
            }
            assert!(departure.until() > now, "it is looked at again");
        }
        panic!("it never ends: {told:?}");
    }

    #[test]
    fn what_comes_to_rest_is_seen_so_and_what_does_not_loses_its_power_and_is_seen_so() {
        assert_eq!(told(0), [(0, Then::Over)]);
        assert_eq!(told(300), [(400, Then::Over)]);
        assert_eq!(told(4999), [(5099, Then::Over)]);
        for late in [5001, 5050, 5200, u32::MAX] {
            assert_eq!(told(late), [(5000, Then::CutPower), (5100, Then::Over)]);
        }
    }
}
