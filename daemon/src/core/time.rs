//! Telling the networks the time of day (TIME, 0x1012).
//!
//! The core has no wall clock. It knows when one of its nodes is a TIME producer that may speak, asks its owner for the
//! time once a second ([`Core::poll_time_wanted`]) and is given it ([`Core::produce_time`]).

use core::time::Duration;

use canopen::TimeOfDay;
use od::Instant;

use super::{Core, Unit};

/// CiA 301 leaves the period to the producer.
const PERIOD: Duration = Duration::from_secs(1);

/// When the time is to be told next.
#[derive(Debug, Default)]
pub(super) struct Telling {
    /// None while no node is a producer.
    pub(super) deadline: Option<Instant>,
    is_wanted: bool,
}

impl Telling {
    /// There is a producer: the first TIME comes one period after the node became one.
    pub(super) fn begin(&mut self, now: Instant) {
        self.deadline.get_or_insert(now + PERIOD);
    }

    /// Asks for the time if it is due.
    pub(super) fn handle_timeout(&mut self, now: Instant) {
        if let Some(deadline) = self.deadline.filter(|deadline| *deadline <= now) {
            self.is_wanted = true;
            // Those that have passed altogether are not made up for.
            let next = deadline + PERIOD;
            self.deadline = Some(if next > now { next } else { now + PERIOD });
        }
    }
}

impl Core {
    /// Whether [`Core::produce_time`] is to be called now; says so once.
    pub fn poll_time_wanted(&mut self) -> bool {
        core::mem::take(&mut self.telling.is_wanted)
    }

    /// Lets every node that is a TIME producer and may speak tell its network that it is `time`. When there is none any
    /// more, the core asks for no time until there is.
    pub fn produce_time(&mut self, now: Instant, time: TimeOfDay) {
        let mut is_produced = false;
        for unit in 0..self.units.end() {
            let Some(Unit { members, .. }) = self.units.get_mut(unit) else { continue };
            let producers =
                members.iter_mut().filter_map(|member| member.node.produce_time(time).then_some(()));
            if producers.count() > 0 {
                is_produced = true;
                self.send(unit);
            }
        }
        if !is_produced {
            self.telling.deadline = None;
        }
        self.pass(now);
    }
}
