//! How much of its processor a core loop with real-time priority takes for Modbus clients.
//!
//! A thread under SCHED_FIFO keeps its processor until it sleeps, and clients that ask without end never let the loop
//! sleep. Nothing else would run there, until Linux takes the processor from it: for 50 ms of each second
//! (`sched_rt_runtime_us` of sched-rt-group.rst in the kernel's documentation; since Linux 6.12 the fair server of
//! sched-deadline.rst), in which no axis is stepped. So the loop rests of its own accord, often and shortly: it then waits
//! for CAN and what is due and for nothing else.

use core::time::Duration;

use od::Instant;

/// What of its time it may work: well below the 95 % at which Linux steps in.
const PER_CENT: u32 = 90;
/// How often what it has worked is looked at.
const WINDOW: Duration = Duration::from_millis(1);
/// A rest is no shorter, for it would be no sleep.
const SHORTEST: Duration = Duration::from_micros(50);
/// Nor is it longer, so that clients are served whatever else the loop has to do.
const LONGEST: Duration = Duration::from_micros(500);

/// See the module's documentation.
#[derive(Debug)]
pub(crate) struct Share {
    /// When it was last looked at.
    looked: Instant,
    /// The processor time that the loop had used by then.
    used: Duration,
    /// What it had then used too much.
    excess: Duration,
    rests_until: Instant,
}

impl Share {
    /// Of a loop that has used so much processor time at `now`.
    pub(crate) fn new(now: Instant, used: Duration) -> Self {
        Self { looked: now, used, excess: Duration::ZERO, rests_until: now }
    }

    /// Whether it is time for [`Share::look`].
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        now >= self.looked + WINDOW
    }

    /// Takes note that the loop has used so much processor time by `now`. Time in which it slept is not saved up.
    pub(crate) fn look(&mut self, now: Instant, used: Duration) {
        let granted = now.saturating_since(self.looked) * PER_CENT / 100;
        let worked = used.saturating_sub(self.used);
        self.excess = (self.excess + worked).saturating_sub(granted).min(LONGEST * PER_CENT / 100);
        (self.looked, self.used) = (now, used);
        let rest = self.excess * 100 / PER_CENT;
        if rest >= SHORTEST {
            self.rests_until = now + rest;
        }
    }

    /// Until when Modbus clients have to wait, if they have to at `now`.
    pub(crate) fn rest(&self, now: Instant) -> Option<Instant> {
        Some(self.rests_until).filter(|end| *end > now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn micros(micros: u64) -> Duration {
        Duration::from_micros(micros)
    }

    /// A thread that has something to do for clients all the time, and what others of its duties take.
    struct Thread {
        now: Instant,
        share: Share,
        used: Duration,
        rested: Duration,
        longest_rest: Duration,
    }

    impl Thread {
        fn new() -> Self {
            let share = Share::new(Instant::ZERO, Duration::ZERO);
            let (used, rested, longest_rest) = Default::default();
            Self { now: Instant::ZERO, share, used, rested, longest_rest }
        }

        fn work(&mut self, time: Duration) {
            self.now = self.now + time;
            self.used += time;
        }

        /// Serves a request that takes so long, after a rest if there is one due, of which other duties take `duties`.
        fn serve(&mut self, request: Duration, duties: Duration) {
            if self.share.is_due(self.now) {
                self.share.look(self.now, self.used);
            }
            if let Some(end) = self.share.rest(self.now) {
                let rest = end.saturating_since(self.now);
                self.longest_rest = self.longest_rest.max(rest);
                let worked = duties.min(rest);
                self.work(worked);
                self.rested += rest - worked;
                self.now = end;
            }
            self.work(request);
        }

        fn per_cent(&self) -> u128 {
            self.used.as_nanos() * 100 / self.now.saturating_since(Instant::ZERO).as_nanos()
        }
    }

    #[test]
    fn a_thread_that_never_sleeps_works_nine_tenths_of_its_time() {
        let mut thread = Thread::new();
        (0..1_000_000).for_each(|_| thread.serve(micros(6), Duration::ZERO));
        assert_eq!(thread.per_cent(), 90);
        assert!(thread.longest_rest < micros(120), "{:?}", thread.longest_rest);
    }

    #[test]
    fn one_that_sleeps_enough_has_no_rest() {
        let mut thread = Thread::new();
        for _ in 0..100_000 {
            thread.serve(micros(85), Duration::ZERO);
            thread.now = thread.now + micros(15);
        }
        assert_eq!(thread.rested, Duration::ZERO);
    }

    #[test]
    fn an_hour_of_sleep_is_not_saved_up() {
        let mut thread = Thread::new();
        thread.now = thread.now + Duration::from_secs(3600);
        let begun = thread.now;
        while thread.rested == Duration::ZERO {
            thread.serve(micros(6), Duration::ZERO);
        }
        assert!(thread.now.saturating_since(begun) < 2 * WINDOW);
    }

    #[test]
    fn clients_are_served_whatever_else_there_is_to_do() {
        let mut thread = Thread::new();
        (0..100_000).for_each(|_| thread.serve(micros(6), micros(10_000)));
        let served = micros(6) * 100_000;
        assert!(thread.now.saturating_since(Instant::ZERO) < 3 * served);
    }

    proptest! {
        #[test]
        fn the_share_is_kept_whatever_requests_take(times in proptest::collection::vec(1_u64..400, 1..40)) {
            let mut thread = Thread::new();
            let mut total = Duration::ZERO;
            for time in times.iter().cycle() {
                thread.serve(micros(*time), Duration::ZERO);
                total += micros(*time);
                if total > Duration::from_millis(200) {
                    break;
                }
            }
            prop_assert!(thread.per_cent() <= 91, "{} %", thread.per_cent());
            prop_assert!(thread.longest_rest <= LONGEST);
        }
    }
}
