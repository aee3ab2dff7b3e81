//! Node guarding and life guarding, 0x100C and 0x100D (CiA 301 v4.2, section 7.2.8.3.2.1).

use core::time::Duration;

use od::{Address, Dictionary, Instant};

use crate::NmtState;
use crate::communication::{GUARD_TIME, HEARTBEAT_PRODUCER, LIFE_TIME_FACTOR, parameter};
use crate::watch::Watch;

/// Whether this node is guarded: never beside a heartbeat, which takes precedence.
pub(crate) fn is_guarded(communication: &Dictionary) -> bool {
    communication.find(Address::new(GUARD_TIME, 0)).is_ok()
        && parameter(communication, HEARTBEAT_PRODUCER, 0) == 0
}

/// The time within which the master is to ask again; `None` without life guarding.
fn life_time(communication: &Dictionary) -> Option<Duration> {
    let guard_time = parameter(communication, GUARD_TIME, 0);
    let millis = guard_time * parameter(communication, LIFE_TIME_FACTOR, 0);
    (millis > 0 && is_guarded(communication)).then(|| Duration::from_millis(millis))
}

/// What the master has seen, and when it is to ask again.
#[derive(Debug, Default)]
pub(crate) struct Guard {
    toggle: bool,
    watch: Watch,
}

impl Guard {
    /// Answers a request. Returns the answer and whether the request ends an error.
    pub(crate) fn answer(&mut self, now: Instant, state: NmtState, communication: &Dictionary) -> (u8, bool) {
        let toggle = u8::from(self.toggle) << 7;
        self.toggle = !self.toggle;
        (toggle | state as u8, self.watch.feed(now, life_time(communication)))
    }

    /// Takes over changed parameters. Returns whether that ends an error.
    pub(crate) fn reload(&mut self, now: Instant, communication: &Dictionary) -> bool {
        match life_time(communication) {
            None => self.watch.stop(),
            Some(time) if self.watch.deadline().is_some() => self.watch.feed(now, Some(time)),
            Some(_) => false,
        }
    }

    /// Whether the master has just turned out to be late.
    pub(crate) fn expire(&mut self, now: Instant) -> bool {
        self.watch.expire(now)
    }

    /// When the master is late.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.watch.deadline()
    }
}
