//! What the core loop measures of itself.

use core::time::Duration;

use od::Instant;

use crate::clock::Clock;
use crate::latency::Histogram;

/// See the module's documentation.
#[derive(Debug, Default)]
pub(crate) struct Times {
    /// From the arrival of CAN frames to their answers. Measured where there are Modbus clients to compete with.
    pub(crate) answers: Histogram,
    /// How late what was due was done.
    pub(crate) lateness: Histogram,
    /// How long it works from one sleep to the next, if somebody wants to know.
    pub(crate) turns: Option<Histogram>,
    /// How long it works from one look at frames and what is due to the next, if somebody wants to know.
    pub(crate) pieces: Option<Histogram>,
    /// The longest of these in ns, whoever wants to know.
    longest_piece_ns: u64,
    /// How late it woke up at most for what was due while it slept.
    latest_wake: Duration,
    /// When the loop last looked for frames, or woke up.
    looked: Instant,
    /// When the first frame came that was taken and not answered yet.
    waiting: Option<Instant>,
    /// When the piece of work that goes on began, as [`moment`] has it.
    began: Instant,
    /// When the sleep began that the loop has just woken up from.
    asleep: Option<Instant>,
}

impl Times {
    /// The same with the times of turns and pieces, which cost one more look at the clock in each turn.
    pub(crate) fn with_turns(self) -> Self {
        Self { turns: Some(Histogram::default()), pieces: Some(Histogram::default()), ..self }
    }

    /// The longest piece of work, in us. What the machine kept the thread from running meanwhile is in it.
    pub(crate) fn longest_piece_us(&self) -> u64 {
        self.longest_piece_ns / 1000
    }

    /// How late the loop woke up at most for what was due while it slept, in us. That is the machine's doing.
    pub(crate) fn latest_wake_us(&self) -> u64 {
        self.latest_wake.as_micros() as u64
    }

    /// A piece of work ends at `now`, and maybe another one begins.
    pub(super) fn work(&mut self, now: Instant) {
        let end = moment(now);
        // After each Modbus request: this is cheaper than a Duration.
        let took = end.as_nanos().saturating_sub(self.began.as_nanos());
        self.longest_piece_ns = self.longest_piece_ns.max(took);
        if let Some(pieces) = &mut self.pieces {
            pieces.record(Duration::from_nanos(took));
        }
        (self.began, self.asleep) = (end, None);
    }

    /// The loop is about to sleep.
    pub(super) fn sleep(&mut self, now: Instant) {
        self.work(now);
        self.asleep = Some(now);
    }

    /// The loop looks for frames, after a sleep or, `in_between`, amid other work.
    pub(super) fn wake(&mut self, now: Instant, in_between: bool) {
        if in_between {
            return self.work(now);
        }
        (self.looked, self.began) = (now, moment(now));
    }

    /// What was due at `deadline` is done at `now`.
    pub(super) fn late(&mut self, now: Instant, deadline: Instant) {
        let late = now.saturating_since(deadline);
        self.lateness.record(late);
        if self.asleep.is_some_and(|asleep| asleep < deadline) {
            self.latest_wake = self.latest_wake.max(late);
        }
    }

    /// A frame was taken that came at this time.
    pub(super) fn arrived(&mut self, at: Instant) {
        self.waiting = Some(self.waiting.map_or(at, |first| first.min(at)));
    }

    /// A frame was taken that came at a time nobody knows: since the last look, at worst.
    pub(super) fn arrived_unseen(&mut self) {
        self.arrived(self.looked);
    }

    /// The loop has answered what it took when it `looked`; since when that had waited, if there was anything.
    pub(super) fn answered(&mut self, looked: Instant) -> Option<Instant> {
        self.looked = looked;
        self.waiting.take()
    }
}

/// What pieces of work are timed by: `now`; with the feature `processor-time` what the thread has used of the processor,
/// which is a system call more. That has nothing in it that somebody else took, were it the hypervisor.
fn moment(now: Instant) -> Instant {
    if cfg!(feature = "processor-time") { Instant::ZERO + Clock::of_thread() } else { now }
}

#[cfg(all(test, not(feature = "processor-time")))]
mod tests {
    use super::*;

    fn at(micros: u64) -> Instant {
        Instant::from_nanos(micros * 1000)
    }

    #[test]
    fn a_step_that_is_late_after_a_sleep_is_told_from_one_that_waited_for_work() {
        let mut times = Times::default();
        times.wake(at(0), false);
        times.sleep(at(30));
        times.wake(at(1070), false);
        times.late(at(1070), at(1000));
        assert_eq!((times.longest_piece_us(), times.latest_wake_us()), (30, 70));
        // Due amid work, which takes 500 us.
        times.work(at(1570));
        times.late(at(1570), at(1100));
        assert_eq!((times.longest_piece_us(), times.latest_wake_us()), (500, 70));
        // Due before a sleep that is none.
        times.sleep(at(1600));
        times.wake(at(1610), false);
        times.late(at(1610), at(1500));
        assert_eq!((times.latest_wake_us(), times.lateness.max_us()), (70, 470));
    }

    #[test]
    fn every_piece_of_work_counts_and_no_sleep_does() {
        let mut times = Times::default().with_turns();
        times.wake(at(0), false);
        [10, 15, 40].into_iter().for_each(|now| times.work(at(now)));
        times.wake(at(45), true);
        times.sleep(at(46));
        times.wake(at(9000), false);
        times.sleep(at(9001));
        let pieces = times.pieces.as_ref().unwrap();
        assert_eq!((pieces.count(), pieces.sum(), pieces.max_us()), (6, Duration::from_micros(47), 25));
    }
}
