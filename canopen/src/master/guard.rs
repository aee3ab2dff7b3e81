//! Node guarding, the master's side (CiA 301 v4.2, section 7.2.8.3.2.1).

use od::Instant;

use super::assignment::GuardTimes;
use crate::NmtState;
use crate::deadline::following;

/// The guarding of one slave.
#[derive(Clone, Copy, Debug)]
pub(super) struct Guarding {
    times: GuardTimes,
    /// When it is asked next.
    next: Instant,
    /// The toggle bit of the next answer; `None` until the first one shows it.
    toggle: Option<bool>,
    /// Requests without an answer.
    open: u8,
}

/// What the guarding wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Due {
    /// Nothing yet.
    Nothing,
    /// The slave is to be asked.
    Request,
    /// The slave has not answered as often as is tolerated.
    Lost,
}

impl Guarding {
    /// A guarding that asks at once.
    pub(super) fn new(times: GuardTimes, now: Instant) -> Self {
        Self { times, next: now, toggle: None, open: 0 }
    }

    /// What is due at `now`.
    pub(super) fn poll(&mut self, now: Instant) -> Due {
        if self.next > now {
            return Due::Nothing;
        }
        if self.open >= self.times.retries {
            return Due::Lost;
        }
        self.open += 1;
        self.next = following(self.next, self.times.period, now);
        Due::Request
    }

    /// Takes an answer. One with the toggle bit of the one before is as none.
    pub(super) fn answer(&mut self, byte: u8) -> Option<NmtState> {
        let toggle = byte & 0x80 != 0;
        let state = NmtState::decode(&[byte & 0x7F])?;
        if self.toggle.is_some_and(|expected| expected != toggle) {
            return None;
        }
        self.toggle = Some(!toggle);
        self.open = 0;
        Some(state)
    }

    /// When something is due.
    pub(super) fn poll_timeout(&self) -> Instant {
        self.next
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use super::*;

    const TIMES: GuardTimes = GuardTimes { period: Duration::from_millis(100), retries: 3 };

    fn at(millis: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(millis)
    }

    #[test]
    fn a_slave_is_lost_when_it_has_not_answered_as_often_as_is_tolerated() {
        let mut guarding = Guarding::new(TIMES, at(0));
        for millis in [0, 100, 200] {
            assert_eq!(guarding.poll_timeout(), at(millis));
            assert_eq!(guarding.poll(at(millis)), Due::Request);
            assert_eq!(guarding.poll(at(millis)), Due::Nothing);
        }
        assert_eq!(guarding.poll(at(299)), Due::Nothing);
        assert_eq!(guarding.poll(at(300)), Due::Lost);
    }

    #[test]
    fn an_answer_with_the_toggle_bit_of_the_one_before_is_as_none() {
        let mut guarding = Guarding::new(TIMES, at(0));
        assert_eq!(guarding.answer(0x85), Some(NmtState::Operational), "the first one may have either");
        assert_eq!(guarding.answer(0x85), None);
        assert_eq!(guarding.answer(0x05), Some(NmtState::Operational));
        assert_eq!(guarding.answer(0x83), None, "no state");
        for millis in [0, 100, 200] {
            assert_eq!(guarding.poll(at(millis)), Due::Request);
            assert_eq!(guarding.answer(0x05), None);
        }
        assert_eq!(guarding.poll(at(300)), Due::Lost);
    }
}
