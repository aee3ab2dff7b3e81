//! Process data of a device that takes its time for them.

use od::{Dictionary, Instant, PdoTraits, Schema};

use super::{Event, Node, queue};
use crate::pdo::{Occasion, Pace};

impl Node {
    /// Makes the PDOs of a node that has not started as the device says. Their processing times count only if
    /// `takes_time`: then they wait in one queue, and [`Event::QueueOverflow`] tells that they come too fast.
    pub fn shape_pdos(&mut self, traits: &[PdoTraits], application: &Schema, takes_time: bool) {
        self.pdos.shape(traits, &self.communication, application, takes_time);
        let has_times = takes_time && traits.iter().any(|pdo| !pdo.time.is_zero());
        self.pace = has_times.then(|| Box::new(Pace::new(&self.pdos.transmit)));
    }

    /// Writes what an RPDO has brought, at once or when it has been processed.
    pub(super) fn act_on(&mut self, now: Instant, position: usize, application: &mut Dictionary) {
        let Some(rpdo) = self.pdos.receive.get_mut(position) else { return };
        let time = rpdo.shape.longest_time();
        match &mut self.pace {
            Some(pace) if !time.is_zero() => {
                let Some(payload) = rpdo.take() else { return };
                if !pace.receive(now, position, payload, time) {
                    self.overflow();
                }
            }
            Some(_) | None => {
                let is_taken = rpdo.apply(application, self.origin, &mut self.batch);
                self.counters.refused_rpdos += u64::from(!is_taken);
            }
        }
    }

    /// Writes what has been processed; TPDOs go when they are sampled.
    pub(super) fn act_on_processed(&mut self, now: Instant, application: &mut Dictionary) {
        while let Some((position, payload)) = self.pace.as_mut().and_then(|pace| pace.take_received(now)) {
            let Some(rpdo) = self.pdos.receive.get(position) else { continue };
            let is_taken = rpdo.write(&payload, application, self.origin, &mut self.batch);
            self.counters.refused_rpdos += u64::from(!is_taken);
        }
        self.tell_drained();
    }

    /// Samples and sends the TPDOs of a device that takes its time: those that have been processed go, those that are due
    /// now wait for their turn.
    pub(super) fn sample_in_turn(&mut self, now: Instant, application: &Dictionary, occasion: Occasion) {
        let Self { pdos, pace: Some(pace), outbox, counters, traffic, .. } = self else { return };
        pace.scan(now, application);
        while let Some(position) = pace.take_ready() {
            let scanned = pace.scanned(position);
            let Some(tpdo) = pdos.transmit.get_mut(position) else { continue };
            traffic.tpdos += 1;
            queue(outbox, counters, tpdo.compose(application, scanned));
        }
        let mut is_lost = false;
        for (position, tpdo) in pdos.transmit.iter_mut().enumerate() {
            let Some(frame) = tpdo.poll(now, application, occasion) else { continue };
            let time = tpdo.shape.time(application);
            if time.is_zero() {
                traffic.tpdos += 1;
                queue(outbox, counters, frame);
            } else {
                is_lost |= !pace.transmit(now, position, time);
            }
        }
        if is_lost {
            self.overflow();
        }
        self.tell_drained();
    }

    /// Forgets what waits of the PDO whose parameters the object `index` belongs to.
    pub(super) fn forget_processed(&mut self, index: u16) {
        let place = self.pdos.position(index);
        if let Some((pace, (direction, position))) = self.pace.as_mut().zip(place) {
            pace.forget(direction, position);
        }
    }

    /// Forgets all that waits.
    pub(super) fn stop_processing(&mut self) {
        self.pace.iter_mut().for_each(|pace| pace.stop());
        self.tell_drained();
    }

    fn overflow(&mut self) {
        self.counters.overflows += 1;
        self.notify(Event::QueueOverflow);
    }

    fn tell_drained(&mut self) {
        if self.pace.as_mut().is_some_and(|pace| pace.take_drained()) {
            self.notify(Event::QueueDrained);
        }
    }
}
