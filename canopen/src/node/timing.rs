//! What a node does by the clock of the network: SYNC, TIME and the time-out of SDO.

use core::time::Duration;

use od::{Dictionary, Instant};

use super::Node;
use crate::pdo::Rpdo;
use crate::{Emergency, Event, Frame, TimeOfDay};

impl Node {
    /// Makes `timeout` the silence of an SDO client after which a transfer is aborted; it is one second otherwise.
    pub fn set_sdo_timeout(&mut self, timeout: Duration) {
        self.sdo.set_timeout(timeout);
    }

    /// The last TIME that this node has consumed since it booted, and when.
    #[must_use]
    pub fn network_time(&self) -> Option<(Instant, TimeOfDay)> {
        self.network_time
    }

    /// Whether this node is the TIME producer of its network (0x1012, bit 30) and may speak.
    #[must_use]
    pub fn produces_time(&self) -> bool {
        self.time_producer.is_some() && self.state.communicates()
    }

    /// Tells the network what time it is, if this node is its TIME producer (0x1012, bit 30) and may speak; returns
    /// whether it is. When and how often is the owner's choice: the standard has no parameter for it.
    pub fn produce_time(&mut self, time: TimeOfDay) -> bool {
        let producer = self.time_producer.filter(|_| self.state.communicates());
        producer.map(|id| self.send(Frame::new(id, &time.encode()))).is_some()
    }

    pub(super) fn handle_time(&mut self, now: Instant, frame: &Frame) {
        let Some(time) = TimeOfDay::decode(frame.payload()) else {
            self.counters.malformed += 1;
            return;
        };
        self.network_time = Some((now, time));
        self.notify(Event::Time);
    }

    pub(super) fn handle_sync(&mut self, now: Instant, frame: &Frame, application: &mut Dictionary) {
        if !self.sync.consume(now, frame.payload(), &self.communication) {
            self.raise(Emergency::communication(Emergency::SYNC_LENGTH, [frame.len() as u8, 0, 0, 0, 0]));
            self.counters.malformed += 1;
            return;
        }
        self.clear(Emergency::SYNC_LENGTH);
        self.apply_synchronous(now, application);
    }

    /// Sends the SYNC that is due; the TPDOs that it triggers follow when they are sampled.
    pub(super) fn produce_sync(&mut self, now: Instant, application: &mut Dictionary) {
        if let Some(sync) = self.sync.produce(now, &self.communication) {
            self.send(sync);
            self.apply_synchronous(now, application);
        }
    }

    fn apply_synchronous(&mut self, now: Instant, application: &mut Dictionary) {
        for position in 0..self.pdos.receive.len() {
            if self.pdos.receive.get(position).is_some_and(Rpdo::is_synchronous) {
                self.act_on(now, position, application);
            }
        }
    }
}
