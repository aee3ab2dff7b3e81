//! What a node does with the frames it hears.

use od::Instant;
use od::{Address, Dictionary, Schema};

use super::Node;
use crate::cob_id::{NMT, SDO_RECEIVE, SDO_TRANSMIT};
use crate::communication::{self as objects, Objects};
use crate::emcy::Producer;
use crate::pdo::Tpdo;
use crate::sdo::Step;
use crate::{Emergency, Event, Frame, Id, NmtCommand, NmtState, rules};

/// What a frame with a subscribed identifier is for; the numbers are positions in the node's lists of PDOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Service {
    Nmt,
    Sync,
    Sdo,
    Rpdo(usize),
    TpdoRequest(usize),
}

impl Node {
    pub(super) fn serve(
        &mut self,
        now: Instant,
        service: Service,
        frame: &Frame,
        application: &mut Dictionary,
    ) {
        let is_request = matches!(service, Service::TpdoRequest(_));
        if frame.is_remote != is_request {
            self.counters.malformed += u64::from(!is_request);
            return;
        }
        match service {
            Service::Nmt => self.handle_nmt(now, frame, application),
            Service::Sync if self.state.communicates() => self.handle_sync(frame, application),
            Service::Sdo if self.state.communicates() => self.handle_sdo(now, frame, application),
            Service::Rpdo(position) if self.state == NmtState::Operational => {
                self.handle_rpdo(position, frame, application);
            }
            Service::TpdoRequest(position) => {
                self.pdos.transmit.get_mut(position).into_iter().for_each(Tpdo::request);
            }
            Service::Sync | Service::Sdo | Service::Rpdo(_) => {}
        }
    }

    fn handle_nmt(&mut self, now: Instant, frame: &Frame, application: &Dictionary) {
        self.counters.malformed += u64::from(frame.len() != 2);
        match NmtCommand::decode(frame.payload(), self.node_id) {
            None => {}
            Some(NmtCommand::Start) => self.enter(now, NmtState::Operational),
            Some(NmtCommand::Stop) => self.enter(now, NmtState::Stopped),
            Some(NmtCommand::EnterPreOperational) => self.enter(now, NmtState::PreOperational),
            Some(NmtCommand::ResetNode) => {
                self.notify(Event::Reset);
                self.emcy = Producer::default();
                self.boot(now, application.schema());
            }
            Some(NmtCommand::ResetCommunication) => self.boot(now, application.schema()),
        }
    }

    fn handle_sync(&mut self, frame: &Frame, application: &mut Dictionary) {
        if !frame.is_empty() {
            self.raise(Emergency::communication(Emergency::SYNC_LENGTH, [frame.len() as u8, 0, 0, 0, 0]));
            self.counters.malformed += 1;
            return;
        }
        self.clear(Emergency::SYNC_LENGTH);
        self.is_synced = true;
        for rpdo in self.pdos.receive.iter_mut().filter(|r| r.is_synchronous()) {
            let is_taken = rpdo.apply(application, self.origin, &mut self.batch);
            self.counters.refused_rpdos += u64::from(!is_taken);
        }
    }

    fn handle_rpdo(&mut self, position: usize, frame: &Frame, application: &mut Dictionary) {
        let Some(rpdo) = self.pdos.receive.get_mut(position) else { return };
        let [low, high] = (rpdo.parameters.number + 1).to_le_bytes();
        let detail = [low, high, frame.len() as u8, 0, 0];
        let before = rpdo.reception;
        rpdo.receive(frame.payload());
        let after = rpdo.reception;
        if !rpdo.is_synchronous() {
            let is_taken = rpdo.apply(application, self.origin, &mut self.batch);
            self.counters.refused_rpdos += u64::from(!is_taken);
        }
        if let Some(code) = after.error() {
            self.raise(Emergency::communication(code, detail));
        }
        if let Some(code) = before.error()
            && self.pdos.receive.iter().all(|r| r.reception != before || !r.is_active())
        {
            self.clear(code);
        }
    }

    fn handle_sdo(&mut self, now: Instant, frame: &Frame, application: &mut Dictionary) {
        let Some(message) = frame.eight() else {
            self.counters.malformed += 1;
            return;
        };
        let mut objects = Objects { communication: &mut self.communication, application };
        let answer = match self.sdo.handle(now, message, &objects) {
            Step::Silent => {
                while let Some(segment) = self.sdo.poll_segment() {
                    self.answer_sdo(segment);
                }
                return;
            }
            Step::Answer(answer) => answer,
            Step::Write { address, answer } => {
                let pdos = &self.pdos;
                let rules =
                    |objects: &Objects<'_>, slot, raw| rules::check(pdos, objects, address, slot, raw);
                match objects.write(self.origin, address, self.sdo.data(), rules) {
                    Ok(()) => {
                        self.take_over(now, application.schema());
                        answer
                    }
                    Err(code) => self.sdo.refuse(address, code),
                }
            }
        };
        self.answer_sdo(answer);
    }

    pub(super) fn answer_sdo(&mut self, answer: [u8; 8]) {
        self.send(Frame::new(Id::Standard(SDO_TRANSMIT + u16::from(self.node_id)), &answer));
    }

    /// Acts on communication objects that were written.
    fn take_over(&mut self, now: Instant, application: &Schema) {
        while let Some(slot) = self.communication.take_written() {
            let Some(Address { index, .. }) = self.communication.schema().address(slot) else { continue };
            match index {
                objects::HEARTBEAT_PRODUCER => self.start_heartbeat(now),
                objects::COB_ID_SYNC => self.resubscribe(),
                index => {
                    if self.pdos.reload(now, index, &self.communication, application) {
                        self.resubscribe();
                    }
                }
            }
        }
    }

    /// Derives what is listened to from the parameters.
    pub(super) fn resubscribe(&mut self) {
        self.services.clear();
        self.services.push((Id::Standard(NMT), Service::Nmt));
        self.services.push((Id::Standard(SDO_RECEIVE + u16::from(self.node_id)), Service::Sdo));
        let sync = objects::cob_id(&self.communication, objects::COB_ID_SYNC);
        self.services.extend(sync.map(|cob_id| (cob_id.id(), Service::Sync)));
        self.services.extend(self.pdos.rpdo_ids().map(|(position, id)| (id, Service::Rpdo(position))));
        self.services
            .extend(self.pdos.request_ids().map(|(position, id)| (id, Service::TpdoRequest(position))));
        self.services.sort_unstable();
        self.notify(Event::Subscriptions);
    }
}
