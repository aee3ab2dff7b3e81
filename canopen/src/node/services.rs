//! What a node does with the frames it hears.

use od::Instant;
use od::{Address, Dictionary, Schema};

use super::storage::Client;
use super::{Node, Order, queue};
use crate::cob_id::NMT;
use crate::communication::{self as objects, Objects};
use crate::emcy::Producer;
use crate::pdo::Tpdo;
use crate::sdo::Step;
use crate::{Cause, CobId, Event, Frame, Id, NmtCommand, NmtState, UNCONFIGURED, lss, rules, time};

/// What a frame with a subscribed identifier is for; the numbers are positions in the node's lists of PDOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Service {
    Nmt,
    Lss,
    Sync,
    Time,
    /// Of the SDO server at this position.
    Sdo(usize),
    Rpdo(usize),
    TpdoRequest(usize),
    Guarding,
    /// The heartbeat of another node.
    Heartbeat(usize),
    /// The emergencies of the node with this ID.
    Emergency(u8),
}

impl Node {
    pub(super) fn serve(
        &mut self,
        now: Instant,
        service: Service,
        frame: &Frame,
        application: &mut Dictionary,
    ) {
        let is_request = matches!(service, Service::TpdoRequest(_) | Service::Guarding);
        if frame.is_remote != is_request {
            self.counters.malformed += u64::from(!is_request);
            return;
        }
        self.traffic.hear(service);
        match service {
            Service::Nmt => self.handle_nmt(now, frame, application),
            Service::Lss => self.handle_lss(now, frame, application.schema()),
            Service::Sync if self.state.communicates() => self.handle_sync(now, frame, application),
            Service::Time if self.state.communicates() => self.handle_time(now, frame),
            Service::Sdo(position) if self.state.communicates() => {
                self.handle_sdo(now, position, frame, application);
            }
            Service::Rpdo(position) if self.state == NmtState::Operational => {
                self.handle_rpdo(now, position, frame, application);
            }
            Service::TpdoRequest(position) => {
                self.pdos.transmit.get_mut(position).into_iter().for_each(Tpdo::request);
            }
            Service::Guarding => self.handle_guarding(now),
            Service::Heartbeat(position) => self.handle_heartbeat(now, position, frame),
            Service::Emergency(producer) if self.state.communicates() => {
                self.handle_emergency(now, producer, frame);
            }
            Service::Sync | Service::Time | Service::Sdo(_) | Service::Rpdo(_) | Service::Emergency(_) => {}
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
                self.adopt_node_id();
                self.notify(Event::Reset);
                self.emcy = Producer::default();
                self.boot(now, application.schema());
            }
            Some(NmtCommand::ResetCommunication) => self.boot(now, application.schema()),
        }
    }

    fn handle_rpdo(&mut self, now: Instant, position: usize, frame: &Frame, application: &mut Dictionary) {
        let Some(rpdo) = self.pdos.receive.get_mut(position) else { return };
        if let Some(mode) = rpdo.mode {
            return self.handle_mpdo(now, position, mode, frame, application);
        }
        if rpdo.is_synchronous() && self.sync.is_late(now, &self.communication) {
            self.counters.late_rpdos += 1;
            return;
        }
        let number = rpdo.number();
        let before = rpdo.reception;
        let is_back = rpdo.receive(now, frame.payload());
        if !rpdo.is_synchronous() {
            self.act_on(now, position, application);
        }
        if is_back {
            self.restore_connection(Cause::Rpdo(number));
        }
        self.note_reception(position, before, frame.len());
    }

    fn handle_sdo(&mut self, now: Instant, position: usize, frame: &Frame, application: &mut Dictionary) {
        let Some(message) = frame.eight() else {
            self.counters.malformed += 1;
            return;
        };
        let Some(connection) = self.sdo.get_mut(position) else { return };
        let mut objects = Objects { communication: &mut self.communication, application };
        let answer = match connection.server.handle(now, message, &objects) {
            Step::Silent => {
                let Self { outbox, counters, traffic, .. } = self;
                while let Some(segment) = connection.poll_segment() {
                    traffic.sdo_answers += 1;
                    queue(outbox, counters, segment);
                }
                return;
            }
            Step::Answer(answer) => connection.frame(answer),
            Step::Refuse { address, code, answer } => {
                objects.note_refused(self.origin, address, code);
                connection.frame(answer)
            }
            Step::Write { address, answer } => {
                let (pdos, storage) = (&self.pdos, &self.storage);
                let rules = |objects: &Objects<'_>, slot, raw| {
                    storage.check(objects, address, slot, raw)?;
                    rules::check(pdos, objects, address, slot, raw)
                };
                match objects.write(self.origin, address, connection.server.data(), rules) {
                    Ok(()) => {
                        connection.server.reset();
                        let answer = match Order::at(address) {
                            None => connection.frame(answer),
                            Some(_) => {
                                connection.server.hold(address, answer);
                                None
                            }
                        };
                        self.take_over(now, application.schema());
                        self.note_write(Client::Sdo(position), address, application.schema());
                        answer
                    }
                    Err(code) => {
                        let answer = connection.server.refuse(address, code);
                        connection.frame(answer)
                    }
                }
            }
        };
        answer.into_iter().for_each(|answer| self.send_answer(now, answer));
    }

    /// Acts on communication objects that were written.
    pub(super) fn take_over(&mut self, now: Instant, application: &Schema) {
        while let Some(slot) = self.communication.take_written() {
            let Some(Address { index, sub }) = self.communication.schema().address(slot) else { continue };
            match index {
                objects::HEARTBEAT_PRODUCER => {
                    self.start_heartbeat(now);
                    self.reload_guarding(now);
                }
                objects::GUARD_TIME | objects::LIFE_TIME_FACTOR => self.reload_guarding(now),
                objects::HEARTBEAT_CONSUMER => {
                    if let Some(producer) = self.consumer.reload(&self.communication, sub) {
                        self.restore_connection(Cause::Heartbeat(producer));
                    }
                    self.resubscribe();
                }
                objects::COB_ID_SYNC => {
                    self.sync.start(now, &self.communication);
                    self.resubscribe();
                }
                objects::COMMUNICATION_CYCLE => self.sync.start(now, &self.communication),
                objects::COB_ID_TIME | objects::EMCY_CONSUMER => self.resubscribe(),
                index if self.sdo.has(index) => {
                    self.sdo.reload(&self.communication);
                    self.resubscribe();
                }
                index => {
                    if let Some(number) = self.pdos.acquit(index) {
                        self.restore_connection(Cause::Rpdo(number));
                    }
                    if self.pdos.reload(now, index, &self.communication, application) {
                        self.forget_processed(index);
                        self.resubscribe();
                    }
                }
            }
        }
    }

    /// Derives what is listened to from the parameters, and what TIME is sent with.
    pub(super) fn resubscribe(&mut self) {
        self.services.clear();
        self.services.push((Id::Standard(lss::REQUEST), Service::Lss));
        if self.node_id != UNCONFIGURED {
            self.subscribe_to_services();
        }
        self.services.sort_unstable();
        self.notify(Event::Subscriptions);
    }

    fn subscribe_to_services(&mut self) {
        self.services.push((Id::Standard(NMT), Service::Nmt));
        self.services.extend(self.sdo.request_ids().map(|(position, id)| (id, Service::Sdo(position))));
        let sync = objects::cob_id(&self.communication, objects::COB_ID_SYNC);
        self.services.extend(sync.map(|cob_id| (cob_id.id(), Service::Sync)));
        let time = time::consumed(&self.communication);
        self.services.extend(time.map(|cob_id| (cob_id.id(), Service::Time)));
        self.time_producer = time::produced(&self.communication).map(CobId::id);
        self.services.extend(self.pdos.rpdo_ids().map(|(position, id)| (id, Service::Rpdo(position))));
        self.services
            .extend(self.pdos.request_ids().map(|(position, id)| (id, Service::TpdoRequest(position))));
        let heartbeats = self.consumer.ids();
        self.services.extend(heartbeats.map(|(position, id)| (id, Service::Heartbeat(position))));
        let emergencies = objects::emcy_producers(&self.communication);
        self.services
            .extend(emergencies.map(|(producer, cob_id)| (cob_id.id(), Service::Emergency(producer))));
        if self.communication.find(Address::new(objects::GUARD_TIME, 0)).is_ok() {
            self.services.push((self.error_control(), Service::Guarding));
        }
    }
}
