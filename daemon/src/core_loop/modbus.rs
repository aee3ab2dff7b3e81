//! The turn of Modbus clients, and what it costs the others.

use od::Instant;

use super::CoreLoop;
use crate::latency::Histogram;
use crate::link::{Patience, Received};
use crate::modbus_tcp::Sockets;

/// What the loop measures of itself.
#[derive(Debug, Default)]
pub(crate) struct Times {
    /// From the arrival of CAN frames to their answers. Measured where there are Modbus clients to compete with.
    pub(super) answers: Histogram,
    /// How late what was due was done.
    pub(super) lateness: Histogram,
    /// How long it works from one sleep to the next, if somebody wants to know.
    pub(super) turns: Option<Histogram>,
    /// When the loop last looked for frames, or woke up.
    looked: Instant,
    /// When the first frame came that was taken and not answered yet.
    waiting: Option<Instant>,
}

impl Times {
    /// The same with the time of each turn, which costs one more look at the clock.
    pub(crate) fn with_turns(self) -> Self {
        Self { turns: Some(Histogram::default()), ..self }
    }

    /// The loop looks for frames, after a sleep or, `in_between`, amid other work.
    pub(super) fn wake(&mut self, now: Instant, in_between: bool) {
        if !in_between {
            self.looked = now;
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
}

impl CoreLoop {
    /// Takes note of what is ready at the Modbus sockets, if any `is_ready`.
    pub(super) fn take_from_sockets(&mut self, now: Instant, is_ready: bool) {
        if let Self { modbus: Some(modbus), core, .. } = self
            && is_ready
        {
            modbus.take_events(now, core);
        }
    }

    /// Serves one request of each Modbus client that is ready; the time after the last. CAN and what is due have their
    /// turn after each request, and before its answer is sent, which takes as long.
    pub(super) fn serve_modbus(&mut self, mut now: Instant, news: &mut Vec<Received>) -> Instant {
        for _ in 0..self.modbus.as_ref().map_or(0, Sockets::ready) {
            let Self { modbus: Some(modbus), core, .. } = self else { return now };
            let client = modbus.serve_next(now, core);
            now = self.attend(news);
            if let (Self { modbus: Some(modbus), core, .. }, Some(client)) = (&mut *self, client) {
                modbus.send(core, client);
                now = self.attend(news);
            }
        }
        now
    }

    /// Answers the frames that have come meanwhile, and does what is due.
    fn attend(&mut self, news: &mut Vec<Received>) -> Instant {
        let now = self.clock.now();
        for position in 0..self.links.len() {
            let outcome = self.receive(position, Patience::Try, news);
            self.take(now, position, outcome, news);
        }
        self.take_from_clients(now);
        self.transmit(now);
        self.note_answers(now);
        self.do_what_is_due(now);
        now
    }

    /// Takes note of how long the frames waited that have just been answered. `looked` is when they were looked for.
    pub(super) fn note_answers(&mut self, looked: Instant) {
        let Self { times, clock, modbus, .. } = self;
        if let Some(arrived) = times.waiting.take().filter(|_| modbus.is_some()) {
            times.answers.record(clock.now().saturating_since(arrived));
        }
        times.looked = looked;
    }
}
