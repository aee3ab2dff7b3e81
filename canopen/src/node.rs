//! One CANopen device on one network.

mod diagnostics;
mod local;
mod lss;
mod mpdo;
mod pace;
mod services;
mod storage;
mod supervision;
mod timing;
mod traffic;

use std::collections::VecDeque;
use std::sync::Arc;

use core::time::Duration;

use od::{AbortCode, Bus, Dictionary, Instant, Origin, Schema, Write};
use thiserror::Error;

use crate::cob_id::NMT_ERROR_CONTROL;
use crate::communication::{self as objects, parameter};
use crate::deadline;
use crate::emcy::Producer;
use crate::guarding::Guard;
use crate::heartbeat::Consumer;
use crate::lss::{LssSetting, Slave, UNCONFIGURED};
use crate::pdo::{Occasion, Pace, Pdos, Tpdo};
use crate::sdo::Connections;
use crate::sync::Sync;
use crate::{Emergency, Frame, Id, NetworkOrder, NmtCommand, NmtState, TimeOfDay};
use services::Service;
use storage::Storage;

pub use diagnostics::{Abort, Diagnostics};
pub use storage::Order;
pub use supervision::{BusState, Cause};
pub use traffic::Traffic;

/// What the owner of a node is to act on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The NMT state is now this one.
    Nmt(NmtState),
    /// The node was reset: the application goes back to its power-on values.
    Reset,
    /// [`Node::subscriptions`] gives other identifiers now.
    Subscriptions,
    /// [`Node::network_time`] gives another time now.
    Time,
    /// An LSS master has given the node this Node-ID, or taken it away ([`UNCONFIGURED`]).
    NodeId(u8),
    /// Parameters are to be stored or no longer stored; [`Node::stored`] tells how that went.
    Storage(Order),
    /// Somebody whom this node supervises is not there any more.
    ConnectionLost(Cause),
    /// A PDO was lost because too many wait for their turn, see [`Node::shape_pdos`].
    QueueOverflow,
    /// None waits any more after that.
    QueueDrained,
    /// Another node tells an error (0x1028).
    Emergency {
        /// The Node-ID that 0x1028 knows it by.
        producer: u8,
        /// What it tells.
        emergency: Emergency,
    },
}

/// Why a profile cannot become a node.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum NodeError {
    /// The Node-ID is neither in 1-127 nor [`UNCONFIGURED`].
    #[error("Node-ID {0} is neither in 1..127 nor 255")]
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
    /// Synchronous RPDOs that came when the synchronous window was over.
    pub late_rpdos: u64,
    /// RPDOs whose values the write gate refused.
    pub refused_rpdos: u64,
    /// RPDOs with fewer bytes than mapped, which were not taken.
    pub short_rpdos: u64,
    /// RPDOs with more bytes than mapped, which were taken.
    pub long_rpdos: u64,
    /// PDOs lost because too many waited for the device to process them.
    pub overflows: u64,
    /// Frames dropped because nobody sent those that were waiting.
    pub dropped: u64,
    /// Emergencies of others dropped because nobody took those that were waiting.
    pub dropped_events: u64,
}

/// Frames that may wait to be sent.
const MAX_WAITING: usize = 1024;

/// One node. See the crate's documentation for how it is driven.
#[derive(Debug)]
pub struct Node {
    node_id: u8,
    origin: Origin,
    lss: Slave,
    /// The owner has given it its Node-ID.
    is_fixed: bool,
    /// What an LSS master has stored.
    lss_stored: LssSetting,
    /// 0x1018:04 of this very device, if it is not that of its profile.
    serial: Option<u32>,
    state: NmtState,
    communication: Dictionary,
    services: Vec<(Id, Service)>,
    sdo: Connections,
    storage: Storage,
    emcy: Producer,
    pdos: Pdos,
    /// What waits for a device that takes its time.
    pace: Option<Box<Pace>>,
    heartbeat: Option<Instant>,
    consumer: Consumer,
    guard: Guard,
    bus_state: BusState,
    sync: Sync,
    network_time: Option<(Instant, TimeOfDay)>,
    /// What this node sends TIME with, if it does.
    time_producer: Option<Id>,
    sampled_revision: u64,
    batch: Vec<Write<'static>>,
    outbox: VecDeque<Frame>,
    events: VecDeque<Event>,
    counters: Counters,
    diagnostics: Diagnostics,
    traffic: Traffic,
}

impl Node {
    /// A node with the communication objects of `communication` for the device that shows `application`, on the
    /// link with number `link`. It is silent until [`Node::start`], with the Node-ID [`UNCONFIGURED`] until an LSS
    /// master gives it one.
    ///
    /// # Errors
    /// See [`NodeError`].
    pub fn new(
        node_id: u8,
        link: u16,
        communication: Arc<Schema>,
        application: &Schema,
    ) -> Result<Self, NodeError> {
        let setting = LssSetting { node_id, bit_timing: None };
        if !setting.is_valid() {
            return Err(NodeError::NodeId(node_id));
        }
        let communication = Dictionary::new(communication, node_id);
        let pdos = Pdos::new(&communication, application)?;
        Ok(Self {
            node_id,
            origin: Origin { bus: Bus::CanOpen, link, client: u16::from(node_id) },
            lss: Slave::new(setting),
            is_fixed: node_id != UNCONFIGURED,
            lss_stored: LssSetting::default(),
            serial: None,
            state: NmtState::Initialising,
            pdos,
            pace: None,
            services: Vec::new(),
            sdo: Connections::new(node_id, communication.schema()),
            storage: Storage::default(),
            emcy: Producer::default(),
            heartbeat: None,
            consumer: Consumer::default(),
            guard: Guard::default(),
            bus_state: BusState::Active,
            sync: Sync::default(),
            network_time: None,
            time_producer: None,
            communication,
            sampled_revision: 0,
            batch: Vec::new(),
            outbox: VecDeque::new(),
            events: VecDeque::new(),
            counters: Counters::default(),
            diagnostics: Diagnostics::default(),
            traffic: Traffic::default(),
        })
    }

    /// The Node-ID in effect, [`UNCONFIGURED`] for none.
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

    /// Whether all that this node sends with this identifier are the values of one TPDO, so that a newer frame tells whatever
    /// an older one told. A multiplexed PDO is not meant: each of its frames is about another object.
    #[must_use]
    pub fn is_tpdo(&self, id: Id) -> bool {
        let services = [objects::COB_ID_SYNC, objects::COB_ID_TIME, objects::COB_ID_EMCY];
        let mut others = services.into_iter().filter_map(|index| objects::cob_id(&self.communication, index));
        self.pdos.is_tpdo(id) && !others.any(|cob_id| cob_id.id() == id) && !self.sdo.answers_with(id)
    }

    /// Whether this frame is a heartbeat of this node, so that the next one tells whatever it told. A boot-up message is none,
    /// nor is the answer to a node-guarding request: of those each one counts.
    #[must_use]
    pub fn is_heartbeat(&self, frame: &Frame) -> bool {
        let is_state = matches!(frame.payload(), [state] if *state != NmtState::Initialising as u8);
        self.heartbeat.is_some() && frame.id == self.error_control() && is_state
    }

    /// Powers on: sends the boot-up message and enters PRE-OPERATIONAL, if it has a Node-ID.
    pub fn start(&mut self, now: Instant, application: &Dictionary) {
        self.boot(now, application.schema());
    }

    /// Whether an order changes anything here: an NMT command that leads to another state or resets, an LSS configuration
    /// while this node is selected.
    #[must_use]
    pub fn will_obey(&self, order: NetworkOrder) -> bool {
        match order {
            NetworkOrder::Nmt { node_id, .. } if node_id != 0 && node_id != self.node_id => false,
            NetworkOrder::Nmt { command, .. } => match command {
                NmtCommand::Start => self.state != NmtState::Operational,
                NmtCommand::Stop => self.state != NmtState::Stopped,
                NmtCommand::EnterPreOperational => self.state != NmtState::PreOperational,
                NmtCommand::ResetNode | NmtCommand::ResetCommunication => true,
            },
            NetworkOrder::LssNodeId(_) | NetworkOrder::LssBitTiming { .. } | NetworkOrder::LssStore => {
                self.lss.is_selected()
            }
        }
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

    /// Does what is due at `now`. A SYNC of this node's own lets its RPDOs act, as one of another node does.
    pub fn handle_timeout(&mut self, now: Instant, application: &mut Dictionary) {
        self.supervise(now);
        self.act_on_processed(now, application);
        self.produce_sync(now, application);
        while let Some(answer) = self.sdo.handle_timeout(now) {
            self.send_answer(now, answer);
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
        let occasion = Occasion { tick: self.sync.take(now, &self.communication), has_changed };
        self.send_emergencies(now);
        if self.state == NmtState::Operational && self.pace.is_some() {
            self.sample_in_turn(now, application, occasion);
        } else if self.state == NmtState::Operational {
            let Self { pdos, outbox, counters, traffic, .. } = self;
            for frame in pdos.transmit.iter_mut().filter_map(|t| t.poll(now, application, occasion)) {
                traffic.tpdos += 1;
                queue(outbox, counters, frame);
            }
        }
        if self.state == NmtState::Operational {
            self.send_scanned(now, application, has_changed);
        }
    }

    /// Sends the emergencies that may be sent now.
    fn send_emergencies(&mut self, now: Instant) {
        while self.tells_emergencies()
            && let Some(frame) = self.emcy.poll(now, &self.communication)
        {
            self.send_emergency(now, frame);
        }
    }

    fn tells_emergencies(&self) -> bool {
        self.state.communicates() && self.bus_state != BusState::Off
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
        let emcy = self.emcy.poll_timeout().filter(|_| self.tells_emergencies());
        let pace = self.pace.as_ref().and_then(|pace| pace.poll_timeout());
        let services = [self.sync.poll_timeout(), self.sdo.poll_timeout(), emcy, pace];
        let scan = self.pdos.scan_timeout().filter(|_| self.state == NmtState::Operational);
        let timers = services.into_iter().chain([self.heartbeat, self.supervision_timeout(), scan]);
        timers.chain(tpdos.map(Tpdo::poll_timeout)).flatten().min()
    }

    /// The next frame to send.
    pub fn poll_transmit(&mut self) -> Option<Frame> {
        self.outbox.pop_front()
    }

    /// The next event to act on.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Whether there is an event to act on.
    #[must_use]
    pub fn has_events(&self) -> bool {
        !self.events.is_empty()
    }

    /// Initialisation (CiA 301 v4.2, section 7.3.2.2.1): power-on values, boot-up, PRE-OPERATIONAL, and OPERATIONAL if
    /// the node starts itself.
    fn boot(&mut self, now: Instant, application: &Schema) {
        self.adopt_node_id();
        self.communication.reset();
        self.show_serial();
        self.sdo.reset();
        self.storage.restart();
        self.emcy.restart(&mut self.communication);
        self.tell_passive();
        self.consumer.reload_all(&self.communication);
        self.guard = Guard::default();
        self.outbox.clear();
        self.sync = Sync::default();
        self.network_time = None;
        self.sdo.reload(&self.communication);
        self.pdos.reload_all(now, &self.communication, application);
        self.stop_processing();
        self.state = NmtState::Initialising;
        self.heartbeat = None;
        self.resubscribe();
        if self.node_id == UNCONFIGURED {
            return self.notify(Event::Nmt(NmtState::Initialising));
        }
        self.send(Frame::new(self.error_control(), &[NmtState::Initialising as u8]));
        self.enter(now, NmtState::PreOperational);
        self.start_heartbeat(now);
        if is_self_starting(&self.communication) {
            self.enter(now, NmtState::Operational);
        }
    }

    fn enter(&mut self, now: Instant, state: NmtState) {
        if self.state == state {
            return;
        }
        let was_silent = !self.state.communicates();
        self.state = state;
        self.sync.forget();
        self.pdos.restart(now);
        self.stop_processing();
        if state == NmtState::Stopped {
            self.sdo.reset();
            self.sync.stop();
        } else if was_silent {
            self.sync.start(now, &self.communication);
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

    /// Of equal events that nobody took yet the last one counts, so the last NMT state is the present one.
    fn notify(&mut self, event: Event) {
        self.events.retain(|waiting| *waiting != event);
        self.events.push_back(event);
    }

    fn send(&mut self, frame: Frame) {
        queue(&mut self.outbox, &mut self.counters, frame);
    }
}

/// Whether 0x1F80 says that this device, no NMT master, starts itself: bit 3 set, bit 2 not (CiA 302-2).
fn is_self_starting(communication: &Dictionary) -> bool {
    parameter(communication, objects::NMT_STARTUP, 0) == 1 << 3
}

fn queue(outbox: &mut VecDeque<Frame>, counters: &mut Counters, frame: Frame) {
    if outbox.len() < MAX_WAITING {
        outbox.push_back(frame);
    } else {
        counters.dropped += 1;
    }
}
