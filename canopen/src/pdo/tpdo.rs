//! Process data out of the device.

use core::time::Duration;

use od::{Dictionary, Instant, Mapping, Schema, Slot};

use super::mpdo::{Message, Mode};
use super::parameters::{Parameters, Transmission};
use super::shape::Shape;
use crate::deadline::following;
use crate::sync::Tick;
use crate::{CobId, Frame};

/// What has happened since a TPDO was last looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Occasion {
    /// A SYNC came.
    pub(crate) tick: Option<Tick>,
    /// Some value of the dictionary changed.
    pub(crate) has_changed: bool,
}

/// One TPDO.
#[derive(Debug)]
pub(crate) struct Tpdo {
    pub(crate) parameters: Parameters,
    pub(crate) cob_id: CobId,
    /// What the device says of it.
    pub(crate) shape: Shape,
    /// Whether it is a multiplexed one.
    pub(crate) mode: Option<Mode>,
    transmission: Transmission,
    mapping: Mapping,
    /// Its length, reserved bytes included.
    bytes: usize,
    pub(crate) inhibit: Duration,
    event_period: Option<Duration>,
    /// The payload last sent, or last sampled for a request.
    last: Option<[u8; 8]>,
    syncs: u8,
    /// The SYNC counter that the first one waits for, until it comes; zero for none.
    awaited: u8,
    sync_start: u8,
    is_due: bool,
    is_requested: bool,
    not_before: Instant,
    event_deadline: Option<Instant>,
}

impl Tpdo {
    pub(crate) fn new(parameters: Parameters, communication: &Dictionary) -> Self {
        let (cob_id, transmission) =
            (parameters.cob_id(communication), parameters.transmission(communication));
        Self {
            parameters,
            cob_id,
            shape: Shape::default(),
            mode: None,
            transmission,
            mapping: Mapping::default(),
            bytes: 0,
            inhibit: Duration::ZERO,
            event_period: None,
            last: None,
            syncs: 0,
            awaited: 0,
            sync_start: 0,
            is_due: false,
            is_requested: false,
            not_before: Instant::ZERO,
            event_deadline: None,
        }
    }

    /// Takes over changed parameters; a TPDO that is now valid starts anew.
    pub(crate) fn reload(&mut self, now: Instant, communication: &Dictionary, application: &Schema) {
        self.cob_id = self.parameters.cob_id(communication);
        self.transmission = self.parameters.transmission(communication);
        self.mode = self.parameters.mode(communication);
        self.inhibit = self.parameters.inhibit(communication);
        self.event_period = self.parameters.event_period(communication);
        self.sync_start = self.parameters.sync_start(communication);
        let count = self.parameters.count(communication);
        self.mapping = self.parameters.mapping(communication, application, count).unwrap_or_default();
        self.bytes = self.shape.bytes(&self.mapping);
        self.start(now);
    }

    /// Starts anew, as on entering OPERATIONAL: an event-driven TPDO is due at once.
    pub(crate) fn start(&mut self, now: Instant) {
        self.last = None;
        self.syncs = 0;
        self.awaited = self.sync_start;
        self.is_requested = false;
        self.is_due = self.transmission == Transmission::Event;
        self.event_deadline = self.event_period.filter(|_| self.is_due).map(|period| now + period);
    }

    /// Notes a remote frame.
    pub(crate) fn request(&mut self) {
        self.is_requested = true;
    }

    /// Whether it sends what the scanner lists have.
    pub(crate) fn scans(&self) -> bool {
        self.cob_id.is_valid() && self.mode == Some(Mode::Source)
    }

    /// The frame that carries `message`, if this is a valid one of destination address mode and may send now.
    pub(crate) fn send_multiplexed(&mut self, now: Instant, message: Message) -> Option<Frame> {
        let is_meant = self.cob_id.is_valid() && self.mode == Some(Mode::Destination);
        if !is_meant || now < self.not_before {
            return None;
        }
        self.not_before = now + self.inhibit;
        Some(Frame::new(self.cob_id.id(), &message.encode()))
    }

    fn is_active(&self) -> bool {
        self.cob_id.is_valid() && self.mapping.bytes() > 0
    }

    /// When this TPDO wants to be looked at without any other occasion.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        if !self.is_active() {
            None
        } else if self.is_due {
            Some(self.not_before)
        } else {
            self.event_deadline
        }
    }

    /// The frame to send now, if any.
    pub(crate) fn poll(
        &mut self,
        now: Instant,
        application: &Dictionary,
        occasion: Occasion,
    ) -> Option<Frame> {
        if !self.is_active() {
            return None;
        }
        let is_requested = core::mem::take(&mut self.is_requested);
        let tick = occasion.tick.filter(|tick| self.is_started(tick));
        // What is too late for its SYNC is neither sampled nor sent, but the SYNC counts.
        let is_sync = tick.is_some_and(|tick| !tick.is_late);
        let (payload, is_sent) = match self.transmission {
            Transmission::Cyclic(every) => {
                self.syncs = (self.syncs + u8::from(tick.is_some())) % every;
                let is_turn = is_sync && self.syncs == 0;
                (None, is_turn || is_requested)
            }
            Transmission::Acyclic if is_sync => {
                let payload = self.pack(application);
                (Some(payload), self.last != Some(payload) || is_requested)
            }
            Transmission::SyncRtr => {
                if is_sync {
                    self.last = Some(self.pack(application));
                }
                (self.last, is_requested && self.last.is_some())
            }
            Transmission::Acyclic | Transmission::Rtr => (None, is_requested),
            Transmission::Event => {
                self.is_due |= is_requested;
                let payload = self.event(now, application, occasion.has_changed);
                (payload, payload.is_some())
            }
        };
        is_sent.then(|| self.send(now, payload.unwrap_or_else(|| self.pack(application))))
    }

    /// Whether the SYNC with the start value has come, which counts as the first (CiA 301 v4.2, section 7.5.2.37).
    fn is_started(&mut self, tick: &Tick) -> bool {
        if tick.counter.is_none_or(|counter| counter == self.awaited) {
            self.awaited = 0;
        }
        self.awaited == 0
    }

    /// The payload if an event-driven TPDO is due: its values changed, its event timer expired or it was asked for,
    /// and the inhibit time is over.
    fn event(&mut self, now: Instant, application: &Dictionary, has_changed: bool) -> Option<[u8; 8]> {
        let mut payload = None;
        if has_changed && !self.is_due {
            payload = Some(self.pack(application));
            self.is_due = payload != self.last;
        }
        self.is_due |= self.event_deadline.is_some_and(|deadline| deadline <= now);
        if !self.is_due || now < self.not_before {
            return None;
        }
        Some(payload.unwrap_or_else(|| self.pack(application)))
    }

    fn send(&mut self, now: Instant, payload: [u8; 8]) -> Frame {
        self.last = Some(payload);
        self.is_due = false;
        if self.transmission == Transmission::Event {
            self.not_before = now + self.inhibit;
            let expired = self.event_deadline.map_or(now, |deadline| deadline.min(now));
            self.event_deadline = self.event_period.map(|period| following(expired, period, now));
        }
        self.frame(&payload)
    }

    /// The frame to send now that the device has processed it, with what a scan has read last.
    pub(crate) fn compose(&mut self, application: &Dictionary, scanned: Option<(Slot, u64)>) -> Frame {
        let mut payload = self.pack(application);
        scanned.into_iter().for_each(|(slot, raw)| self.mapping.put(slot, raw, &mut payload));
        self.last = Some(payload);
        self.frame(&payload)
    }

    fn frame(&self, payload: &[u8; 8]) -> Frame {
        Frame::new(self.cob_id.id(), payload.get(..self.bytes).unwrap_or_default())
    }

    fn pack(&self, application: &Dictionary) -> [u8; 8] {
        let mut payload = [0; 8];
        self.mapping.pack(application, &mut payload);
        payload
    }
}
