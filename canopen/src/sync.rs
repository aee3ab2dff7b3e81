//! SYNC: when it comes, by whom, and how long its synchronous PDOs are in time (CiA 301 v4.2, sections 7.2.5,
//! 7.5.2.5-7 and 7.5.2.22).

use core::time::Duration;

use od::{AbortCode, Dictionary, Instant};

use crate::communication::{
    COB_ID_SYNC, COMMUNICATION_CYCLE, SYNC_COUNTER_OVERFLOW, SYNC_WINDOW, cob_id, parameter,
};
use crate::deadline::following;
use crate::{CobId, Frame};

/// Bit 30 of the COB-ID: this device produces the SYNC.
const PRODUCES: u32 = 1 << 30;
/// The shortest cycle that is produced: no classic CAN carries a SYNC and a PDO in less.
const SHORTEST_CYCLE_US: u64 = 100;
/// The highest value a counter may have.
const HIGHEST_COUNTER: u64 = 240;

/// A SYNC that was sent or received.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tick {
    /// Its counter, if it has one.
    pub(crate) counter: Option<u8>,
    /// Whether the synchronous window was over when its TPDOs were to be sampled.
    pub(crate) is_late: bool,
}

/// The SYNCs of one node.
#[derive(Debug, Default)]
pub(crate) struct Sync {
    /// When the next one is produced.
    due: Option<Instant>,
    /// Counter of the last one produced.
    counter: u8,
    /// When the last one was, produced or consumed.
    last: Option<Instant>,
    /// The one whose TPDOs are not sampled yet.
    pending: Option<Tick>,
}

impl Sync {
    /// Produces from one cycle after `now` on, the counter starting at 1, if the parameters say so.
    pub(crate) fn start(&mut self, now: Instant, communication: &Dictionary) {
        let cycle = cycle(communication).filter(|_| is_producer(communication));
        self.due = cycle.map(|cycle| now + cycle);
        self.counter = 0;
    }

    /// Produces no more.
    pub(crate) fn stop(&mut self) {
        self.due = None;
    }

    /// When the next SYNC is to be produced.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.due
    }

    /// The SYNC to send at `now`; it counts for this node too.
    pub(crate) fn produce(&mut self, now: Instant, communication: &Dictionary) -> Option<Frame> {
        let due = self.due.filter(|due| *due <= now)?;
        self.due = cycle(communication).map(|cycle| following(due, cycle, now));
        let id = cob_id(communication, COB_ID_SYNC)?.id();
        let overflow = overflow(communication);
        if overflow == 0 {
            self.note(now, None);
            return Some(Frame::new(id, &[]));
        }
        self.counter = if self.counter < overflow { self.counter + 1 } else { 1 };
        self.note(now, Some(self.counter));
        Some(Frame::new(id, &[self.counter]))
    }

    /// Takes a SYNC from the bus; returns whether it has the length that the parameters demand.
    pub(crate) fn consume(&mut self, now: Instant, payload: &[u8], communication: &Dictionary) -> bool {
        let counter = match (payload, overflow(communication)) {
            ([], 0) => None,
            ([counter], 1..) => Some(*counter),
            _ => return false,
        };
        self.note(now, counter);
        true
    }

    fn note(&mut self, now: Instant, counter: Option<u8>) {
        self.last = Some(now);
        self.pending = Some(Tick { counter, is_late: false });
    }

    /// Forgets the SYNC whose TPDOs are not sampled yet.
    pub(crate) fn forget(&mut self) {
        self.pending = None;
    }

    /// The SYNC whose TPDOs are to be sampled at `now`.
    pub(crate) fn take(&mut self, now: Instant, communication: &Dictionary) -> Option<Tick> {
        let tick = self.pending.take()?;
        Some(Tick { is_late: self.is_late(now, communication), ..tick })
    }

    /// Whether the window of the last SYNC is over, so that synchronous PDOs wait for the next one.
    pub(crate) fn is_late(&self, now: Instant, communication: &Dictionary) -> bool {
        let window = micros(communication, SYNC_WINDOW);
        window.zip(self.last).is_some_and(|(window, last)| now > last + window)
    }
}

/// Whether the COB-ID may become `new`: a device with a communication cycle may produce, and what it produces
/// keeps its identifier.
pub(crate) fn check_cob_id(communication: &Dictionary, new: CobId) -> Result<(), AbortCode> {
    let old = cob_id(communication, COB_ID_SYNC).unwrap_or(CobId(0));
    let can_produce = cob_id(communication, COMMUNICATION_CYCLE).is_some();
    let is_producer = new.0 & PRODUCES != 0;
    if !new.is_configurable() || is_producer && !can_produce {
        return Err(AbortCode::InvalidValue);
    }
    let keeps = old.0 & PRODUCES == 0 || !is_producer || old.has_identifier_of(new);
    if keeps { Ok(()) } else { Err(AbortCode::DeviceState) }
}

/// Whether the communication cycle may become `raw` microseconds.
pub(crate) fn check_cycle(raw: u64) -> Result<(), AbortCode> {
    if (1..SHORTEST_CYCLE_US).contains(&raw) { Err(AbortCode::ValueTooLow) } else { Ok(()) }
}

/// Whether the counter may overflow at `raw`: not while there is a communication cycle.
pub(crate) fn check_overflow(communication: &Dictionary, raw: u64) -> Result<(), AbortCode> {
    if raw == 1 || raw > HIGHEST_COUNTER {
        Err(AbortCode::InvalidValue)
    } else if cycle(communication).is_some() {
        Err(AbortCode::DeviceState)
    } else {
        Ok(())
    }
}

/// Whether a TPDO may start with the SYNC that counts `raw`.
pub(crate) fn is_start_value(raw: u64) -> bool {
    raw <= HIGHEST_COUNTER
}

fn is_producer(communication: &Dictionary) -> bool {
    cob_id(communication, COB_ID_SYNC).is_some_and(|cob_id| cob_id.0 & PRODUCES != 0)
}

fn cycle(communication: &Dictionary) -> Option<Duration> {
    micros(communication, COMMUNICATION_CYCLE)
}

/// The parameter `index` in microseconds, where zero is none.
fn micros(communication: &Dictionary, index: u16) -> Option<Duration> {
    let micros = parameter(communication, index, 0);
    (micros > 0).then(|| Duration::from_micros(micros))
}

fn overflow(communication: &Dictionary) -> u8 {
    parameter(communication, SYNC_COUNTER_OVERFLOW, 0) as u8
}
