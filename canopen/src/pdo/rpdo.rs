//! Process data into the device.

use core::time::Duration;

use od::{Data, Dictionary, Instant, Mapping, Origin, Schema, Write};

use super::mpdo::{Message, Mode};
use super::parameters::{Parameters, Transmission};
use super::shape::Shape;
use crate::watch::Watch;
use crate::{CobId, Emergency, Frame};

/// What became of a received PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reception {
    /// Taken.
    Good,
    /// Taken; there were more bytes than mapped.
    TooLong,
    /// Not taken; there were fewer bytes than mapped.
    TooShort,
}

impl Reception {
    /// The emergency error code that reports it.
    pub(crate) fn error(self) -> Option<u16> {
        match self {
            Self::Good => None,
            Self::TooLong => Some(Emergency::PDO_TOO_LONG),
            Self::TooShort => Some(Emergency::PDO_TOO_SHORT),
        }
    }
}

/// One RPDO.
#[derive(Debug)]
pub(crate) struct Rpdo {
    pub(crate) parameters: Parameters,
    pub(crate) cob_id: CobId,
    /// What became of the last one.
    pub(crate) reception: Reception,
    /// Whether the next one comes in time.
    pub(crate) watch: Watch,
    /// What the device says of it.
    pub(crate) shape: Shape,
    /// Whether it is a multiplexed one.
    pub(crate) mode: Option<Mode>,
    transmission: Transmission,
    event_period: Option<Duration>,
    mapping: Mapping,
    /// The most bytes it has, reserved ones included.
    bytes: usize,
    latched: Option<[u8; 8]>,
}

impl Rpdo {
    pub(crate) fn new(parameters: Parameters, communication: &Dictionary) -> Self {
        let (cob_id, transmission) =
            (parameters.cob_id(communication), parameters.transmission(communication));
        Self {
            parameters,
            cob_id,
            reception: Reception::Good,
            watch: Watch::Idle,
            shape: Shape::default(),
            mode: None,
            transmission,
            event_period: None,
            mapping: Mapping::default(),
            bytes: 0,
            latched: None,
        }
    }

    /// Takes over changed parameters.
    pub(crate) fn reload(&mut self, communication: &Dictionary, application: &Schema) {
        self.cob_id = self.parameters.cob_id(communication);
        self.transmission = self.parameters.transmission(communication);
        self.mode = self.parameters.mode(communication);
        self.event_period = self.parameters.event_period(communication);
        let count = self.parameters.count(communication);
        self.mapping = self.parameters.mapping(communication, application, count).unwrap_or_default();
        self.bytes = self.shape.bytes(&self.mapping);
        self.latched = None;
    }

    /// The number that users know, from 1.
    pub(crate) fn number(&self) -> u16 {
        self.parameters.number + 1
    }

    /// Forgets what waits for a SYNC, and waits for the first one anew.
    pub(crate) fn stop(&mut self) {
        self.latched = None;
        self.watch.pause();
    }

    /// Whether frames with its identifier concern this RPDO.
    pub(crate) fn is_active(&self) -> bool {
        self.cob_id.is_valid() && (self.mapping.bytes() > 0 || self.mode.is_some())
    }

    /// Takes a frame of a multiplexed one. Returns what it carries, and whether that ends its time-out.
    pub(crate) fn receive_multiplexed(&mut self, now: Instant, frame: &Frame) -> (Option<Message>, bool) {
        let message = frame.eight().map(Message::decode);
        self.reception = if message.is_some() { Reception::Good } else { Reception::TooShort };
        (message, message.is_some() && self.watch.feed(now, self.event_period))
    }

    /// Latches a payload until [`Rpdo::apply`]. Returns whether that ends its time-out.
    ///
    /// The first one starts the supervision (CiA 301 v4.2, section 7.5.2.35, event timer).
    pub(crate) fn receive(&mut self, now: Instant, payload: &[u8]) -> bool {
        self.reception = if payload.len() < self.mapping.bytes() {
            Reception::TooShort
        } else if payload.len() <= self.bytes {
            Reception::Good
        } else {
            Reception::TooLong
        };
        if self.reception == Reception::TooShort {
            return false;
        }
        let mut latched = [0; 8];
        for (to, from) in latched.iter_mut().zip(payload) {
            *to = *from;
        }
        self.latched = Some(latched);
        self.watch.feed(now, self.event_period)
    }

    /// Whether what was received waits for a SYNC.
    pub(crate) fn is_synchronous(&self) -> bool {
        matches!(self.transmission, Transmission::Acyclic | Transmission::Cyclic(_))
    }

    /// Writes what is latched, as one batch. Returns false if the gate refused it.
    pub(crate) fn apply(
        &mut self,
        application: &mut Dictionary,
        origin: Origin,
        batch: &mut Vec<Write<'static>>,
    ) -> bool {
        self.take().is_none_or(|payload| self.write(&payload, application, origin, batch))
    }

    /// Takes what is latched.
    pub(crate) fn take(&mut self) -> Option<[u8; 8]> {
        self.latched.take()
    }

    /// Writes a payload as one batch. Returns false if the gate refused it.
    pub(crate) fn write(
        &self,
        payload: &[u8; 8],
        application: &mut Dictionary,
        origin: Origin,
        batch: &mut Vec<Write<'static>>,
    ) -> bool {
        batch.clear();
        batch.extend(self.mapping.unpack(payload).map(|(slot, raw)| Write { slot, data: Data::Raw(raw) }));
        application.write_cyclic(origin, batch).is_ok()
    }
}
