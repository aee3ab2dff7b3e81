//! The core without I/O: every device and every bus engine, owned by value. Frames and the time go in, frames and
//! notices come out.
//!
//! Whoever drives it hands it each frame with the time of its reception ([`Core::handle_frame`]) and each
//! deadline it asked for ([`Core::poll_timeout`], [`Core::handle_timeout`]), and after either sends what
//! [`Core::poll_transmit`] yields, in that order.
//!
//! * What is due on a device before it hears a frame runs before it hears it. So the raster steps of an axis lie
//!   between frames where their times say, however late the loop woke up.
//! * All nodes that listen to a frame hear it before the first of them answers: after a SYNC all samples are of
//!   one moment.
//! * A frame that one of our nodes sends reaches our other nodes on that link as on a wire, in bus order, because
//!   the kernel does not hand a socket its own frames.

mod access;
mod audit;
mod deadlines;
mod modbus;
mod notices;
mod ownership;
mod plant;
mod storage;
mod time;
mod trail;
mod view;

use core::ops::Range;
use core::time::Duration;
use std::collections::VecDeque;
use std::sync::Arc;

use canopen::{BusState, Event, Frame, Id, NmtState, Node, NodeError, Router};
use od::{Instant, Owner};
use profiles::{Device, DeviceEvent, PlantSetup, Profile, StoreOrder, Timing};
use thiserror::Error;

use audit::Audit;
use deadlines::Deadlines;
use modbus::Modbus;
use notices::{MAX_NOTICES, clear, note, raise};
use storage::Storing;
use time::Telling;
use trail::Trail;

pub use access::{Authority, LOCAL, WriteRefused};
pub use audit::{AuditEntry, What};
pub use modbus::{
    ClientId, ClientStatus, ListenerCounters, ListenerPlan, ModbusPlan, Refused, WhenFull, identification,
    map,
};
pub use notices::{Counters, Notice};
pub use ownership::NoAxis;
pub use storage::{NodeParameters, Parameters};
pub use trail::{Command, Who};

/// A link by its number in the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LinkId(pub u16);

/// A device to be built.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What it is.
    pub profile: Arc<Profile>,
    /// The links it is a node of, with its Node-ID there.
    pub nodes: Vec<(LinkId, u8)>,
    /// What is behind its axes.
    pub plant: PlantSetup,
    /// 0x1018:04, if it is not that of the profile.
    pub serial: Option<u32>,
}

/// A profile that cannot be built.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("device {device}: {reason}")]
pub struct PlanError {
    /// Position of the device.
    pub device: usize,
    /// What is wrong.
    pub reason: NodeError,
}

/// Frames that may pass the wires in one wake-up, and how long the rest then waits: more than the fastest classic
/// CAN bus carries, so only nodes that answer each other without end ever meet it.
const MAX_PASSING: usize = 1024;
const PAUSE: Duration = Duration::from_millis(20);
/// Frames that may wait to pass the wires.
const MAX_ON_WIRE: usize = 8 * MAX_PASSING;

/// A node and where it belongs.
#[derive(Debug)]
struct Member {
    node: Node,
    unit: usize,
    link: LinkId,
    is_started: bool,
    /// It has told its first NMT state.
    is_up: bool,
}

/// A device and its nodes, one on each of its links.
struct Unit {
    device: Device,
    members: Range<usize>,
    storing: Option<Storing>,
    /// What the device itself wants to be stored, once what is under way is.
    wanted: Option<StoreOrder>,
    /// Who may command its axes unless somebody has claimed them.
    owner: Option<Owner>,
    trail: Trail,
}

/// A frame on its way to our nodes.
#[derive(Debug)]
struct Passing {
    link: LinkId,
    sender: Option<u16>,
    frame: Frame,
}

/// See the module's documentation.
pub struct Core {
    units: Vec<Unit>,
    members: Vec<Member>,
    routers: Vec<Router>,
    deadlines: Deadlines,
    wire: VecDeque<Passing>,
    /// When the wires carry frames again, if too many were under way.
    resume: Option<Instant>,
    hearers: Vec<u16>,
    outbox: VecDeque<(LinkId, Frame)>,
    resubscribed: Vec<LinkId>,
    notices: VecDeque<(usize, Notice)>,
    /// Devices with an order to store that nobody has fetched.
    orders: VecDeque<usize>,
    telling: Telling,
    modbus: Modbus,
    audit: Audit,
    /// For each link, frames that were too many.
    dropped_on_wire: Vec<u64>,
    counters: Counters,
}

impl Core {
    /// Builds the devices of `plans` on links 0 to `links` - 1. All is silent until [`Core::start`].
    ///
    /// # Errors
    /// The first profile that cannot become a node.
    pub fn new(links: u16, plans: &[Plan], now: Instant) -> Result<Self, PlanError> {
        let mut core = Self {
            units: Vec::with_capacity(plans.len()),
            members: Vec::with_capacity(plans.len()),
            routers: vec![Router::default(); usize::from(links)],
            deadlines: Deadlines::new(plans.len()),
            wire: VecDeque::with_capacity(MAX_PASSING),
            resume: None,
            hearers: Vec::with_capacity(plans.len()),
            outbox: VecDeque::with_capacity(MAX_PASSING),
            resubscribed: Vec::with_capacity(usize::from(links)),
            notices: VecDeque::with_capacity(MAX_NOTICES),
            orders: VecDeque::new(),
            telling: Telling::default(),
            modbus: Modbus::default(),
            audit: Audit::default(),
            dropped_on_wire: vec![0; usize::from(links)],
            counters: Counters::default(),
        };
        for (unit, plan) in plans.iter().enumerate() {
            core.add(unit, plan, now).map_err(|reason| PlanError { device: unit, reason })?;
        }
        Ok(core)
    }

    fn add(&mut self, unit: usize, plan: &Plan, now: Instant) -> Result<(), NodeError> {
        let first = self.members.len();
        let Profile { communication, application, pdos, .. } = &*plan.profile;
        for (link, node_id) in plan.nodes.iter().copied() {
            let mut node = Node::new(node_id, link.0, Arc::clone(communication), application)?;
            plan.serial.into_iter().for_each(|serial| node.set_serial(serial));
            node.shape_pdos(pdos, application, false);
            self.members.push(Member { node, unit, link, is_started: false, is_up: false });
        }
        // Defaults of the application that depend on a Node-ID follow the first.
        let node_id = plan.nodes.first().map_or(0, |(_, node_id)| *node_id);
        let device = Device::with_plant(Arc::clone(&plan.profile), node_id, now, &plan.plant);
        let (members, trail) = (first..self.members.len(), Trail::default());
        self.units.push(Unit { device, members, storing: None, wanted: None, owner: None, trail });
        Ok(())
    }

    /// Makes `timeout` the silence of an SDO client of `device` after which its transfer is aborted; it is one second
    /// otherwise.
    pub fn set_sdo_timeout(&mut self, device: usize, timeout: Duration) {
        let Some(Unit { members, .. }) = self.units.get(device) else { return };
        let members = self.members.get_mut(members.clone()).unwrap_or_default();
        members.iter_mut().for_each(|member| member.node.set_sdo_timeout(timeout));
    }

    /// Lets `device`, which has not started, take its time for its process data as `timing` says; it has them at once
    /// otherwise.
    pub fn set_timing(&mut self, device: usize, timing: Timing) {
        let Some(Unit { device, members, .. }) = self.units.get(device) else { return };
        let Profile { application, pdos, .. } = &**device.profile();
        let members = self.members.get_mut(members.clone()).unwrap_or_default();
        let takes_time = timing == Timing::Authentic;
        members.iter_mut().for_each(|member| member.node.shape_pdos(pdos, application, takes_time));
    }

    /// Powers on the nodes of `link`, which send their boot-up messages. Those that run go on.
    pub fn start(&mut self, now: Instant, link: LinkId) {
        for member in 0..self.members.len() {
            let Some(Member { node, unit, link: own, is_started, .. }) = self.members.get_mut(member) else {
                continue;
            };
            if *own != link || core::mem::replace(is_started, true) {
                continue;
            }
            let unit = *unit;
            if let Some(Unit { device, .. }) = self.units.get(unit) {
                node.start(now, device.dictionary());
            }
            self.settle(now, unit);
            self.speak(now, unit);
        }
        self.pass(now);
    }

    /// Takes the state of the CAN controller of `link`.
    pub fn set_bus_state(&mut self, now: Instant, link: LinkId, state: BusState) {
        for member in 0..self.members.len() {
            let Some(Member { node, unit, .. }) = self.members.get_mut(member).filter(|m| m.link == link)
            else {
                continue;
            };
            let unit = *unit;
            node.set_bus_state(now, state);
            self.settle(now, unit);
            self.speak(now, unit);
        }
        self.pass(now);
    }

    /// Takes a frame that came in on `link`.
    pub fn handle_frame(&mut self, now: Instant, link: LinkId, frame: &Frame) {
        self.put_on_wire(Passing { link, sender: None, frame: *frame });
        self.pass(now);
    }

    /// Does what is due at `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.telling.handle_timeout(now);
        self.supervise_modbus(now);
        self.audit.handle_timeout(now);
        while let Some(unit) = self.deadlines.due(now) {
            self.run_due(now, unit);
        }
        self.pass(now);
    }

    /// When [`Core::handle_timeout`] is to be called next.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let others = [self.resume, self.telling.deadline, self.modbus.deadline, self.audit.deadline];
        others.into_iter().chain([self.deadlines.first()]).flatten().min()
    }

    /// The next frame to send, and where.
    pub fn poll_transmit(&mut self) -> Option<(LinkId, Frame)> {
        self.outbox.pop_front()
    }

    /// The next link of which [`Core::subscriptions`] may give other identifiers now.
    pub fn poll_resubscribed(&mut self) -> Option<LinkId> {
        self.resubscribed.pop()
    }

    /// The next notice, and the position of the device it concerns.
    pub fn poll_notice(&mut self) -> Option<(usize, Notice)> {
        self.notices.pop_front()
    }

    /// Every identifier that our nodes on `link` listen to.
    pub fn subscriptions(&self, link: LinkId) -> impl Iterator<Item = Id> {
        self.routers.get(usize::from(link.0)).into_iter().flat_map(Router::ids)
    }

    /// Lets every axis ramp down and switch off.
    pub fn shut_down(&mut self, now: Instant) {
        for unit in 0..self.units.len() {
            if let Some(Unit { device, .. }) = self.units.get_mut(unit) {
                device.shut_down(now);
            }
            self.settle(now, unit);
            self.speak(now, unit);
        }
        self.pass(now);
    }

    fn put_on_wire(&mut self, passing: Passing) {
        if self.wire.len() < MAX_ON_WIRE {
            self.wire.push_back(passing);
        } else {
            let dropped = self.dropped_on_wire.get_mut(usize::from(passing.link.0));
            dropped.into_iter().for_each(|dropped| *dropped += 1);
        }
    }

    /// Lets what is on the wires reach our nodes, and what they answer to it.
    fn pass(&mut self, now: Instant) {
        if self.resume.is_some_and(|resume| now < resume) {
            return;
        }
        self.resume = None;
        for _ in 0..MAX_PASSING {
            let Some(passing) = self.wire.pop_front() else { return };
            self.deliver(now, &passing);
        }
        self.resume = (!self.wire.is_empty()).then(|| now + PAUSE);
    }

    fn deliver(&mut self, now: Instant, passing: &Passing) {
        let mut hearers = core::mem::take(&mut self.hearers);
        hearers.clear();
        hearers.extend(others(&self.routers, passing.link, passing.frame.id, passing.sender));
        for hearer in &hearers {
            self.hear(now, usize::from(*hearer), &passing.frame);
        }
        for hearer in &hearers {
            if let Some(Member { unit, .. }) = self.members.get(usize::from(*hearer)) {
                self.speak(now, *unit);
            }
        }
        self.hearers = hearers;
    }

    fn hear(&mut self, now: Instant, hearer: usize, frame: &Frame) {
        let Some(unit) = self.members.get(hearer).map(|member| member.unit) else { return };
        if self.deadlines.is_due(unit, now) {
            self.run_due(now, unit);
        }
        if let (Some(Member { node, .. }), Some(Unit { device, .. })) =
            (self.members.get_mut(hearer), self.units.get_mut(unit))
        {
            node.handle_frame(now, frame, device.dictionary_mut());
        }
        self.settle(now, unit);
    }

    fn run_due(&mut self, now: Instant, unit: usize) {
        let Some(Unit { device, members, .. }) = self.units.get_mut(unit) else { return };
        let dropped = device.dropped_steps();
        device.advance(now);
        let dropped = device.dropped_steps() - dropped;
        if dropped > 0 {
            note(&mut self.notices, &mut self.counters, unit, Notice::DroppedSteps(dropped));
        }
        for Member { node, .. } in self.members.get_mut(members.clone()).unwrap_or_default() {
            node.handle_timeout(now, device.dictionary_mut());
        }
        self.settle(now, unit);
        self.speak(now, unit);
    }

    /// Lets a device act on what was written to it and on what happened to its nodes, and its nodes on what
    /// happened to it.
    fn settle(&mut self, now: Instant, unit: usize) {
        self.note_commands(now, unit);
        let Self { units, members, routers, resubscribed, notices, counters, .. } = self;
        let Some(Unit { device, members: own, .. }) = units.get_mut(unit) else { return };
        let mut ordered = Vec::new();
        if device.dictionary().has_written() {
            device.apply(now);
        }
        let numbers = own.clone();
        let members = members.get_mut(own.clone()).unwrap_or_default();
        for (number, Member { node, link, is_up, .. }) in numbers.zip(&mut *members) {
            while let Some(event) = node.poll_event() {
                let notice = match event {
                    Event::Reset => {
                        device.reset(now);
                        Some(Notice::Reset)
                    }
                    Event::NodeId(node_id) => {
                        if number == own.start {
                            device.dictionary_mut().set_node_id(node_id);
                        }
                        Some(Notice::NodeId(node_id))
                    }
                    Event::Nmt(state) => {
                        let was_up = core::mem::replace(is_up, true);
                        if was_up && state != NmtState::Operational {
                            device.connection_lost(now);
                        }
                        Some(Notice::Nmt(state))
                    }
                    Event::ConnectionLost(cause) => {
                        device.connection_lost(now);
                        Some(Notice::ConnectionLost(cause))
                    }
                    Event::Emergency { producer, emergency } => {
                        Some(Notice::Emergency { producer, emergency })
                    }
                    Event::QueueOverflow => {
                        device.set_overflow(true);
                        None
                    }
                    Event::QueueDrained => {
                        device.set_overflow(false);
                        None
                    }
                    // For devices that have something to do with it; so far none has.
                    Event::Time => None,
                    Event::Subscriptions => {
                        if let Some(router) = routers.get_mut(usize::from(link.0)) {
                            router.subscribe(number as u16, node.subscriptions());
                        }
                        if !resubscribed.contains(link) {
                            resubscribed.push(*link);
                        }
                        None
                    }
                    Event::Storage(order) => {
                        ordered.push((number, order));
                        None
                    }
                };
                notice.into_iter().for_each(|n| note(notices, counters, unit, n));
            }
        }
        let mut wanted = None;
        while let Some(event) = device.poll_event() {
            match event {
                DeviceEvent::Raised(fault) => note(notices, counters, unit, raise(fault, members)),
                DeviceEvent::Cleared(code) => note(notices, counters, unit, clear(code, members)),
                DeviceEvent::Store(order) => wanted = Some(order),
            }
        }
        ordered.into_iter().for_each(|(number, order)| self.order(now, unit, number, order));
        if let Some(order) = wanted {
            self.order_of_device(unit, order);
        }
    }

    /// Samples what the device now shows and queues what its nodes have to say, also of what comes to light with it.
    fn speak(&mut self, now: Instant, unit: usize) {
        if self.sample(now, unit) {
            self.settle(now, unit);
            self.sample(now, unit);
        }
    }

    /// Samples and queues; whether a node has an event for the device then.
    fn sample(&mut self, now: Instant, unit: usize) -> bool {
        let Some(Unit { device, members, .. }) = self.units.get(unit) else { return false };
        let mut deadline = device.poll_timeout();
        let mut has_events = false;
        for number in members.clone() {
            let Some(Unit { device, .. }) = self.units.get(unit) else { continue };
            let Some(Member { node, link, .. }) = self.members.get_mut(number) else { continue };
            let link = *link;
            node.sample(now, device.dictionary());
            has_events |= node.has_events();
            deadline = deadline.into_iter().chain(node.poll_timeout()).min();
            if node.produces_time() {
                self.telling.begin(now);
            }
            self.send(number, link);
        }
        // A deadline that stays in the past must not keep the caller from its other duties.
        let soonest = now + Duration::from_nanos(1);
        self.deadlines.set(unit, deadline.map(|deadline| deadline.max(soonest)));
        has_events
    }

    fn send(&mut self, number: usize, link: LinkId) {
        let sender = Some(number as u16);
        while let Some(frame) = self.members.get_mut(number).and_then(|member| member.node.poll_transmit()) {
            self.outbox.push_back((link, frame));
            if others(&self.routers, link, frame.id, sender).next().is_some() {
                self.put_on_wire(Passing { link, sender, frame });
            }
        }
    }
}

/// The nodes on `link` beside the sender that hear `id`.
fn others(routers: &[Router], link: LinkId, id: Id, sender: Option<u16>) -> impl Iterator<Item = u16> {
    let receivers = routers.get(usize::from(link.0)).map_or(&[][..], |router| router.receivers(id));
    receivers.iter().copied().filter(move |receiver| Some(*receiver) != sender)
}
