//! Heartbeat consumer, 0x1016 (CiA 301 v4.2, sections 7.2.8.3.2.2 and 7.5.2.18).

use core::time::Duration;

use od::{AbortCode, Address, Dictionary, Instant};

use crate::cob_id::NMT_ERROR_CONTROL;
use crate::communication::HEARTBEAT_CONSUMER;
use crate::watch::Watch;
use crate::{Id, NmtState};

/// What an entry of 0x1016 says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Entry {
    producer: u8,
    time: Duration,
}

impl Entry {
    /// Bits 0-15: time in ms, bits 16-23: Node-ID. `None` for an entry that is not used.
    fn decode(raw: u64) -> Option<Self> {
        let [low, high, producer, ..] = raw.to_le_bytes();
        let time = Duration::from_millis(u16::from_le_bytes([low, high]).into());
        ((1..=127).contains(&producer) && !time.is_zero()).then_some(Self { producer, time })
    }

    /// What sub-index `sub` says.
    fn read(communication: &Dictionary, sub: u8) -> Option<Self> {
        let slot = communication.find(Address::new(HEARTBEAT_CONSUMER, sub)).ok()?;
        Self::decode(communication.raw(slot))
    }
}

/// Whether sub-index `sub` may become `raw`: a producer is supervised by one entry at most.
pub(crate) fn check(communication: &Dictionary, sub: u8, raw: u64) -> Result<(), AbortCode> {
    let Some(new) = Entry::decode(raw) else { return Ok(()) };
    let others = subs(communication).filter(|other| *other != sub);
    let mut others = others.filter_map(|other| Entry::read(communication, other));
    if others.any(|other| other.producer == new.producer) {
        Err(AbortCode::ParameterIncompatible)
    } else {
        Ok(())
    }
}

/// The sub-indices of 0x1016 that this node has.
fn subs(communication: &Dictionary) -> impl Iterator<Item = u8> {
    let has = |sub: &u8| communication.find(Address::new(HEARTBEAT_CONSUMER, *sub)).is_ok();
    (1..=127).take_while(has)
}

/// One producer and the supervision of it.
#[derive(Clone, Copy, Debug, Default)]
struct Supervised {
    entry: Option<Entry>,
    watch: Watch,
}

/// All producers that are supervised, in the order of the entries.
#[derive(Debug, Default)]
pub(crate) struct Consumer {
    places: Vec<Supervised>,
}

impl Consumer {
    /// Takes over all entries and waits for the first heartbeats.
    pub(crate) fn reload_all(&mut self, communication: &Dictionary) {
        self.places.clear();
        self.places.extend(
            subs(communication)
                .map(|sub| Supervised { entry: Entry::read(communication, sub), watch: Watch::Idle }),
        );
    }

    /// Takes over the entry `sub`. Returns the producer whose error that ends.
    pub(crate) fn reload(&mut self, communication: &Dictionary, sub: u8) -> Option<u8> {
        let place = self.places.get_mut(usize::from(sub).checked_sub(1)?)?;
        let before = core::mem::replace(&mut place.entry, Entry::read(communication, sub));
        before.filter(|_| place.watch.stop()).map(|entry| entry.producer)
    }

    /// Position and identifier of every producer.
    pub(crate) fn ids(&self) -> impl Iterator<Item = (usize, Id)> {
        let entries = self.places.iter().map(|place| place.entry).enumerate();
        entries.filter_map(|(position, entry)| {
            Some((position, Id::Standard(NMT_ERROR_CONTROL + u16::from(entry?.producer))))
        })
    }

    /// Within which time the heartbeat of this producer is to come, if it is supervised.
    pub(crate) fn time(&self, producer: u8) -> Option<Duration> {
        let mut entries = self.places.iter().filter_map(|place| place.entry);
        entries.find(|entry| entry.producer == producer).map(|entry| entry.time)
    }

    /// Takes the state that a producer has told. Returns the producer if that ends its error.
    ///
    /// A boot-up message shows that the producer lives, but it neither begins a supervision nor ends an error.
    pub(crate) fn receive(&mut self, now: Instant, position: usize, state: NmtState) -> Option<u8> {
        let Supervised { entry, watch } = self.places.get_mut(position)?;
        let Entry { producer, time } = (*entry)?;
        if state == NmtState::Initialising && watch.deadline().is_none() {
            return None;
        }
        watch.feed(now, Some(time)).then_some(producer)
    }

    /// A producer whose heartbeat has just turned out to be late.
    pub(crate) fn expire(&mut self, now: Instant) -> Option<u8> {
        let late = self.places.iter_mut().find_map(|place| place.watch.expire(now).then_some(place.entry));
        late.flatten().map(|entry| entry.producer)
    }

    /// When the next heartbeat is late.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.places.iter().filter_map(|place| place.watch.deadline()).min()
    }
}
