//! What a node does when it loses the others, and when they come back.

use core::fmt;

use od::Instant;

use super::{Event, Node};
use crate::communication::{ERROR_BEHAVIOUR, parameter};
use crate::guarding::is_guarded;
use crate::{Emergency, Frame, NmtState};

/// How a connection was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The heartbeat of this node did not come in time.
    Heartbeat(u8),
    /// The master did not ask for the state in time.
    LifeGuarding,
    /// The RPDO of this number, from 1, did not come in time.
    Rpdo(u16),
    /// The CAN controller went off the bus, or is gone.
    BusOff,
}

impl Cause {
    /// How it is told (CiA 301 v4.2, table 26); the detail tells equal codes apart.
    fn emergency(self) -> Emergency {
        match self {
            Self::Heartbeat(producer) => {
                Emergency::communication(Emergency::LIFE_GUARD, [producer, 0, 0, 0, 0])
            }
            Self::LifeGuarding => Emergency::communication(Emergency::LIFE_GUARD, [0; 5]),
            Self::Rpdo(number) => {
                let [low, high] = number.to_le_bytes();
                Emergency::communication(Emergency::RPDO_TIMEOUT, [low, high, 0, 0, 0])
            }
            Self::BusOff => Emergency::communication(Emergency::BUS_OFF, [0; 5]),
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Heartbeat(producer) => write!(f, "no heartbeat from node {producer}"),
            Self::LifeGuarding => f.write_str("not guarded any more"),
            Self::Rpdo(number) => write!(f, "RPDO {number} missing"),
            Self::BusOff => f.write_str("off the bus"),
        }
    }
}

/// State of the CAN controller (ISO 11898-1, fault confinement).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BusState {
    /// Error active: all is well.
    #[default]
    Active,
    /// Error passive: many errors.
    Passive,
    /// Bus off: nothing is sent or heard.
    Off,
}

impl BusState {
    /// The standard's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Active => "error active",
            Self::Passive => "error passive",
            Self::Off => "bus off",
        }
    }
}

/// What a lost connection does to the NMT state, 0x1029:01 (CiA 301 v4.2, section 7.5.2.26).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Behaviour {
    LeaveOperational,
    NoChange,
    Stop,
}

impl Behaviour {
    fn decode(raw: u64) -> Self {
        match raw {
            1 => Self::NoChange,
            2 => Self::Stop,
            _ => Self::LeaveOperational,
        }
    }
}

impl Node {
    /// Takes the state of the CAN controller, which its owner has seen to change. One that is gone is off the bus.
    ///
    /// Errors wait until the bus is back: of a bus-off (EMCY 8140h) the others hear afterwards.
    pub fn set_bus_state(&mut self, now: Instant, state: BusState) {
        let before = core::mem::replace(&mut self.bus_state, state);
        if before == state {
            return;
        }
        if state == BusState::Off {
            self.lose_connection(now, Cause::BusOff);
        } else if before == BusState::Off {
            self.restore_connection(Cause::BusOff);
        }
        self.tell_passive();
    }

    /// Tells whether the controller is error passive (EMCY 8120h); a controller off the bus still is.
    pub(super) fn tell_passive(&mut self) {
        match self.bus_state {
            BusState::Active => self.clear(Emergency::ERROR_PASSIVE),
            BusState::Passive => self.raise(Emergency::communication(Emergency::ERROR_PASSIVE, [0; 5])),
            BusState::Off => {}
        }
    }

    /// Notes who has not come in time.
    pub(super) fn supervise(&mut self, now: Instant) {
        while let Some(cause) = self.expire(now) {
            self.lose_connection(now, cause);
        }
    }

    fn expire(&mut self, now: Instant) -> Option<Cause> {
        let heartbeat = self.consumer.expire(now).map(Cause::Heartbeat);
        let guarding = || self.guard.expire(now).then_some(Cause::LifeGuarding);
        heartbeat.or_else(guarding).or_else(|| self.pdos.expire(now).map(Cause::Rpdo))
    }

    /// When somebody is late.
    pub(super) fn supervision_timeout(&self) -> Option<Instant> {
        let timers = [self.consumer.poll_timeout(), self.guard.poll_timeout(), self.pdos.poll_late()];
        timers.into_iter().flatten().min()
    }

    /// The error is told before it may lead to STOPPED, where nothing is.
    fn lose_connection(&mut self, now: Instant, cause: Cause) {
        self.diagnostics.lost.note(now, cause);
        self.raise(cause.emergency());
        self.send_emergencies(now);
        self.notify(Event::ConnectionLost(cause));
        match Behaviour::decode(parameter(&self.communication, ERROR_BEHAVIOUR, 1)) {
            Behaviour::LeaveOperational if self.state == NmtState::Operational => {
                self.enter(now, NmtState::PreOperational);
            }
            Behaviour::Stop if self.state.communicates() => self.enter(now, NmtState::Stopped),
            Behaviour::LeaveOperational | Behaviour::NoChange | Behaviour::Stop => {}
        }
    }

    pub(super) fn restore_connection(&mut self, cause: Cause) {
        self.emcy.end(&mut self.communication, cause.emergency());
    }

    pub(super) fn handle_heartbeat(&mut self, now: Instant, position: usize, frame: &Frame) {
        let Some(state) = NmtState::decode(frame.payload()) else {
            self.counters.malformed += 1;
            return;
        };
        if let Some(producer) = self.consumer.receive(now, position, state) {
            self.restore_connection(Cause::Heartbeat(producer));
        }
    }

    pub(super) fn handle_guarding(&mut self, now: Instant) {
        if !is_guarded(&self.communication) {
            return;
        }
        let (answer, is_back) = self.guard.answer(now, self.state, &self.communication);
        if is_back {
            self.restore_connection(Cause::LifeGuarding);
        }
        self.send(Frame::new(self.error_control(), &[answer]));
    }

    /// Takes over changed parameters of guarding.
    pub(super) fn reload_guarding(&mut self, now: Instant) {
        if self.guard.reload(now, &self.communication) {
            self.restore_connection(Cause::LifeGuarding);
        }
    }

    pub(super) fn handle_emergency(&mut self, now: Instant, producer: u8, frame: &Frame) {
        let Some(message) = frame.eight() else {
            self.counters.malformed += 1;
            return;
        };
        let emergency = Emergency::decode(message);
        self.diagnostics.heard.note(now, (producer, emergency));
        let waiting = self.events.iter().filter(|event| matches!(event, Event::Emergency { .. })).count();
        if waiting < MAX_EMERGENCIES {
            self.events.push_back(Event::Emergency { producer, emergency });
        } else {
            self.counters.dropped_events += 1;
        }
    }
}

/// Emergencies of others that may wait to be taken.
const MAX_EMERGENCIES: usize = 32;
