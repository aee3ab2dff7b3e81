//! One CANopen device on one network.

use std::collections::VecDeque;
use std::sync::Arc;

use core::time::Duration;

use od::{AbortCode, Address, Bus, Dictionary, Instant, Origin, Schema, Write};
use thiserror::Error;

use crate::cob_id::{NMT, NMT_ERROR_CONTROL, SDO_RECEIVE, SDO_TRANSMIT};
use crate::communication::{self as objects, Objects, parameter};
use crate::deadline;
use crate::emcy::Producer;
use crate::pdo::{Occasion, Pdos, Tpdo};
use crate::rules;
use crate::sdo::{Server, Step};
use crate::{Emergency, Frame, Id, NmtCommand, NmtState};

/// What the owner of a node is to act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The NMT state is now this one.
    Nmt(NmtState),
    /// The node was reset: the application goes back to its power-on values.
    Reset,
    /// [`Node::subscriptions`] gives other identifiers now.
    Subscriptions,
}

/// Why a profile cannot become a node.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NodeError {
    /// The Node-ID is not in 1-127.
    #[error("Node-ID {0} is not in 1..127")]
    NodeId(u8),
    /// The default mapping of a PDO is refused.
    #[error("the default mapping of {direction} {number} is refused: {code}")]
    Mapping {
        /// RPDO or TPDO.
        direction: &'static str,
        /// Number of the PDO, from 1.
        number: u16,
        /// The reason.
        code: AbortCode,
    },
}

/// What a node has refused or lost without an answer on the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames of a wrong length or kind for their service.
    pub malformed: u64,
    /// RPDOs whose values the write gate refused.
    pub refused_rpdos: u64,
    /// Frames dropped because nobody sent those that were waiting.
    pub dropped: u64,
}

/// Frames that may wait to be sent.
const MAX_WAITING: usize = 1024;

/// What a frame with a subscribed identifier is for; the numbers are positions in the node's lists of PDOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Service {
    Nmt,
    Sync,
    Sdo,
    Rpdo(usize),
    TpdoRequest(usize),
}

/// One node. See the crate's documentation for how it is driven.
#[derive(Debug)]
pub struct Node {
    node_id: u8,
    origin: Origin,
    state: NmtState,
    communication: Dictionary,
    services: Vec<(Id, Service)>,
    sdo: Server,
    emcy: Producer,
    pdos: Pdos,
    heartbeat: Option<Instant>,
    is_synced: bool,
    sampled_revision: u64,
    batch: Vec<Write<'static>>,
    outbox: VecDeque<Frame>,
    events: VecDeque<Event>,
    counters: Counters,
}

impl Node {
    /// A node with the communication objects of `communication` for the device that shows `application`, on the
    /// link with number `link`. It is silent until [`Node::start`].
    ///
    /// # Errors
    /// See [`NodeError`].
    pub fn new(
        node_id: u8,
        link: u16,
        communication: Arc<Schema>,
        application: &Schema,
    ) -> Result<Self, NodeError> {
        if !(1..=127).contains(&node_id) {
            return Err(NodeError::NodeId(node_id));
        }
        let communication = Dictionary::new(communication, node_id);
        let pdos = Pdos::new(&communication, application)?;
        Ok(Self {
            node_id,
            origin: Origin { bus: Bus::CanOpen, link, client: u16::from(node_id) },
            state: NmtState::Initialising,
            pdos,
            communication,
            services: Vec::new(),
            sdo: Server::new(),
            emcy: Producer::default(),
            heartbeat: None,
            is_synced: false,
            sampled_revision: 0,
            batch: Vec::new(),
            outbox: VecDeque::new(),
            events: VecDeque::new(),
            counters: Counters::default(),
        })
    }

    /// The Node-ID.
    #[must_use]
    pub fn node_id(&self) -> u8 {
        self.node_id
    }

    /// The NMT state.
    #[must_use]
    pub fn state(&self) -> NmtState {
        self.state
    }

    /// The communication objects as they are now.
    #[must_use]
    pub fn communication(&self) -> &Dictionary {
        &self.communication
    }

    /// What was refused or lost without an answer.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// The identifiers this node listens to.
    pub fn subscriptions(&self) -> impl Iterator<Item = Id> {
        self.services.iter().map(|(id, _)| *id)
    }

    /// Powers on: sends the boot-up message and enters PRE-OPERATIONAL.
    pub fn start(&mut self, now: Instant, application: &Dictionary) {
        self.boot(now, application.schema());
    }

    /// Takes one frame from the bus. Frames that nobody subscribed to are ignored.
    pub fn handle_frame(&mut self, now: Instant, frame: &Frame, application: &mut Dictionary) {
        let mut next = self.services.partition_point(|(id, _)| *id < frame.id);
        while let Some((_, service)) = self.services.get(next).copied().filter(|(id, _)| *id == frame.id) {
            self.serve(now, service, frame, application);
            // Serving it may have changed the list.
            next = self.services.partition_point(|known| *known <= (frame.id, service));
        }
    }

    /// Does what is due at `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        if let Some(abort) = self.sdo.handle_timeout(now) {
            self.answer_sdo(abort);
        }
        if let Some(deadline) = self.heartbeat.filter(|deadline| *deadline <= now) {
            self.send(Frame::new(self.error_control(), &[self.state as u8]));
            self.heartbeat = Some(deadline::following(deadline, self.heartbeat_period(), now));
        }
    }

    /// Samples and sends what is due after the device has shown its new values: the TPDOs of a SYNC, changes,
    /// requests, emergencies.
    pub fn sample(&mut self, now: Instant, application: &Dictionary) {
        let revision = application.revision();
        let has_changed = core::mem::replace(&mut self.sampled_revision, revision) != revision;
        let occasion = Occasion { is_sync: core::mem::take(&mut self.is_synced), has_changed };
        while self.state.communicates()
            && let Some(frame) = self.emcy.poll(now, &self.communication)
        {
            self.send(frame);
        }
        if self.state == NmtState::Operational {
            let Self { pdos, outbox, counters, .. } = self;
            for frame in pdos.transmit.iter_mut().filter_map(|t| t.poll(now, application, occasion)) {
                queue(outbox, counters, frame);
            }
        }
    }

    /// Notes an error of the device: EMCY, error register and history tell it once.
    pub fn raise(&mut self, emergency: Emergency) {
        self.emcy.raise(&mut self.communication, emergency);
    }

    /// Ends an error that [`Node::raise`] noted.
    pub fn clear(&mut self, code: u16) {
        self.emcy.clear(&mut self.communication, code);
    }

    /// When the node wants [`Node::handle_timeout`] and [`Node::sample`] to be called next.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let tpdos = self.pdos.transmit.iter().filter(|_| self.state == NmtState::Operational);
        let emcy = self.emcy.poll_timeout().filter(|_| self.state.communicates());
        let timers = [self.sdo.poll_timeout(), self.heartbeat, emcy];
        timers.into_iter().chain(tpdos.map(Tpdo::poll_timeout)).flatten().min()
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self) -> Option<Frame> {
        self.outbox.pop_front()
    }

    /// The next event to act on.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn serve(&mut self, now: Instant, service: Service, frame: &Frame, application: &mut Dictionary) {
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

    fn answer_sdo(&mut self, answer: [u8; 8]) {
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

    /// Initialisation (CiA 301 v4.2, section 7.3.2.2.1): defaults, boot-up, PRE-OPERATIONAL.
    fn boot(&mut self, now: Instant, application: &Schema) {
        self.communication.reset();
        self.sdo.reset();
        self.emcy.restart(&mut self.communication);
        self.outbox.clear();
        self.is_synced = false;
        self.pdos.reload_all(now, &self.communication, application);
        self.resubscribe();
        self.send(Frame::new(self.error_control(), &[NmtState::Initialising as u8]));
        self.state = NmtState::Initialising;
        self.enter(now, NmtState::PreOperational);
        self.start_heartbeat(now);
    }

    fn enter(&mut self, now: Instant, state: NmtState) {
        if self.state == state {
            return;
        }
        self.state = state;
        self.is_synced = false;
        self.pdos.restart(now);
        if state == NmtState::Stopped {
            self.sdo.reset();
        }
        self.notify(Event::Nmt(state));
    }

    fn start_heartbeat(&mut self, now: Instant) {
        let period = self.heartbeat_period();
        self.heartbeat = (!period.is_zero()).then(|| now + period);
    }

    fn heartbeat_period(&self) -> Duration {
        Duration::from_millis(parameter(&self.communication, objects::HEARTBEAT_PRODUCER, 0))
    }

    fn error_control(&self) -> Id {
        Id::Standard(NMT_ERROR_CONTROL + u16::from(self.node_id))
    }

    fn resubscribe(&mut self) {
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

    /// Of equal events that nobody took yet the last one counts, so the last NMT state is the present one.
    fn notify(&mut self, event: Event) {
        self.events.retain(|waiting| *waiting != event);
        self.events.push_back(event);
    }

    fn send(&mut self, frame: Frame) {
        queue(&mut self.outbox, &mut self.counters, frame);
    }
}

fn queue(outbox: &mut VecDeque<Frame>, counters: &mut Counters, frame: Frame) {
    if outbox.len() < MAX_WAITING {
        outbox.push_back(frame);
    } else {
        counters.dropped += 1;
    }
}
