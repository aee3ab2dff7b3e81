//! The communication and mapping records of one PDO.

use core::time::Duration;

use od::{AbortCode, Address, Dictionary, Direction, Mapping, Schema, Slot};

use super::ROOM;
use super::mpdo::Mode;
use crate::CobId;
use crate::communication::{RPDO_COMMUNICATION, RPDO_MAPPING, TPDO_COMMUNICATION, TPDO_MAPPING};

/// When a PDO is processed or sent (CiA 301 v4.2, tables 54 and 55).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Transmission {
    /// 0: with the next SYNC after a change.
    Acyclic,
    /// 1-240: with every n-th SYNC.
    Cyclic(u8),
    /// 252: sampled with SYNC, sent on request.
    SyncRtr,
    /// 253: sampled and sent on request.
    Rtr,
    /// 254, 255: at once, after a change.
    Event,
}

impl Transmission {
    /// The meaning of a transmission type; `None` for the reserved ones.
    pub(crate) fn decode(value: u8, direction: Direction) -> Option<Self> {
        match (value, direction) {
            (0, _) => Some(Self::Acyclic),
            (1..=240, _) => Some(Self::Cyclic(value)),
            (254..=255, _) => Some(Self::Event),
            (252, Direction::Transmit) => Some(Self::SyncRtr),
            (253, Direction::Transmit) => Some(Self::Rtr),
            (241..=253, _) => None,
        }
    }
}

/// Where the parameters of one PDO are kept.
#[derive(Debug)]
pub(crate) struct Parameters {
    /// The PDO's number, from 0.
    pub(crate) number: u16,
    /// RPDO or TPDO.
    pub(crate) direction: Direction,
    cob_id: Slot,
    transmission: Slot,
    inhibit: Option<Slot>,
    event_timer: Option<Slot>,
    sync_start: Option<Slot>,
    count: Slot,
    entries: Vec<Slot>,
}

/// The first indices of the communication and the mapping records.
const fn bases(direction: Direction) -> (u16, u16) {
    match direction {
        Direction::Receive => (RPDO_COMMUNICATION, RPDO_MAPPING),
        Direction::Transmit => (TPDO_COMMUNICATION, TPDO_MAPPING),
    }
}

impl Parameters {
    /// The parameters of PDO `number`; `None` unless both records are complete.
    pub(crate) fn find(schema: &Schema, direction: Direction, number: u16) -> Option<Self> {
        let (communication, mapping) = bases(direction);
        let slot = |base: u16, sub| schema.slot(Address::new(base + number, sub));
        Some(Self {
            number,
            direction,
            cob_id: slot(communication, 1)?,
            transmission: slot(communication, 2)?,
            inhibit: slot(communication, 3),
            event_timer: slot(communication, 5),
            sync_start: slot(communication, 6),
            count: slot(mapping, 0)?,
            entries: (1..=Mapping::MAX_FIELDS as u8).map_while(|sub| slot(mapping, sub)).collect(),
        })
    }

    pub(crate) fn cob_id(&self, communication: &Dictionary) -> CobId {
        CobId(communication.raw(self.cob_id) as u32)
    }

    pub(crate) fn transmission(&self, communication: &Dictionary) -> Transmission {
        let value = communication.raw(self.transmission) as u8;
        Transmission::decode(value, self.direction).unwrap_or(Transmission::Event)
    }

    /// The shortest time between two transmissions.
    pub(crate) fn inhibit(&self, communication: &Dictionary) -> Duration {
        inhibit_time(self.inhibit.map_or(0, |slot| communication.raw(slot)))
    }

    /// The longest time between two transmissions or receptions (parameter in ms), if any.
    pub(crate) fn event_period(&self, communication: &Dictionary) -> Option<Duration> {
        let millis = self.event_timer.map_or(0, |slot| communication.raw(slot));
        (millis > 0).then(|| Duration::from_millis(millis))
    }

    /// The SYNC counter that the first transmission waits for; zero for none.
    pub(crate) fn sync_start(&self, communication: &Dictionary) -> u8 {
        self.sync_start.map_or(0, |slot| communication.raw(slot) as u8)
    }

    /// How many entries are mapped; zero while the mapping is being changed.
    pub(crate) fn count(&self, communication: &Dictionary) -> u64 {
        communication.raw(self.count)
    }

    /// What it is instead, if it is a multiplexed one: those are event-driven.
    pub(crate) fn mode(&self, communication: &Dictionary) -> Option<Mode> {
        let is_event_driven = self.transmission(communication) == Transmission::Event;
        Mode::of(self.count(communication)).filter(|_| is_event_driven)
    }

    /// The mapping of the first `count` entries.
    pub(crate) fn mapping(
        &self,
        communication: &Dictionary,
        application: &Schema,
        count: u64,
    ) -> Result<Mapping, AbortCode> {
        let count = usize::try_from(count).unwrap_or(usize::MAX);
        let entries = self.entries.get(..count).ok_or(AbortCode::PdoLength)?;
        let parameters = entries.iter().map(|slot| communication.raw(*slot) as u32);
        Mapping::new(application, self.direction, ROOM, parameters)
    }
}

/// An inhibit time parameter counts 100 us (CiA 301 v4.2, sections 7.5.2.17 and 7.5.2.37).
pub(crate) fn inhibit_time(raw: u64) -> Duration {
    Duration::from_micros(raw.saturating_mul(100))
}
