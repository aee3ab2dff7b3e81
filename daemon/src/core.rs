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
//!   one moment. But a reset of a whole network, which takes its time, reaches a few nodes at a time, and other frames wait.
//! * A frame that one of our nodes sends reaches our other nodes on that link as on a wire, in bus order, because
//!   the kernel does not hand a socket its own frames.

mod access;
mod audit;
mod deadlines;
mod modbus;
mod notices;
mod ownership;
mod plant;
mod reset;
mod slots;
mod storage;
mod time;
mod trail;
mod unit;
mod view;
mod wire;

use core::time::Duration;
use std::collections::VecDeque;
use std::sync::Arc;

use canopen::{BusState, Event, Frame, Id, NmtState, NodeError, Router};
use od::Instant;
use profiles::{DeviceEvent, PlantSetup, Profile, Timing};
use thiserror::Error;

use audit::Audit;
use deadlines::Deadlines;
use modbus::Modbus;
use notices::{MAX_NOTICES, clear, note, raise};
use reset::Resetting;
use slots::Slots;
use time::Telling;
use unit::Member;
use wire::{MAX_PASSING, Passing, put_on_wire};

pub use access::{Authority, LOCAL, WriteRefused};
pub use audit::{Again, AuditEntry, Item, What};
pub use modbus::{
    Admission, ClientId, ClientStatus, ListenerCounters, ListenerPlan, ModbusPlan, Refused, WhenFull,
    identification, map,
};
pub use notices::{Counters, Notice};
pub use ownership::NoAxis;
pub use storage::{NodeParameters, Parameters};
pub use trail::{Command, Peer, Who};
pub use unit::Unit;
pub use wire::Sender;

/// A link by its number in the configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LinkId(pub u16);

/// A device to be built.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What it is called; no other device has the name.
    pub name: Arc<str>,
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

/// The shortest time: what is due then comes after what else is due, and does not keep the caller from its other duties.
const SOON: Duration = Duration::from_nanos(1);

/// Where a number of the routers leads: to a node by its position in a unit.
#[derive(Clone, Copy, Debug)]
struct Hearer {
    unit: usize,
    position: usize,
}

/// See the module's documentation.
pub struct Core {
    units: Slots<Unit>,
    /// The nodes by their numbers in the routers.
    members: Slots<Hearer>,
    routers: Vec<Router>,
    deadlines: Deadlines,
    wire: VecDeque<Passing>,
    /// When the wires carry frames again, if many are under way.
    resume: Option<Instant>,
    /// Frames that have passed on end.
    passed: usize,
    hearers: Vec<u16>,
    resetting: Option<Resetting>,
    outbox: VecDeque<(LinkId, Frame)>,
    resubscribed: Vec<LinkId>,
    /// Nodes of which the communication objects may have changed, by link and device.
    changed: Vec<(LinkId, usize)>,
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
            units: Slots::with_capacity(plans.len()),
            members: Slots::with_capacity(plans.len()),
            routers: vec![Router::default(); usize::from(links)],
            deadlines: Deadlines::new(plans.len()),
            wire: VecDeque::with_capacity(MAX_PASSING),
            resume: None,
            passed: 0,
            hearers: Vec::with_capacity(plans.len()),
            resetting: None,
            outbox: VecDeque::with_capacity(MAX_PASSING),
            resubscribed: Vec::with_capacity(usize::from(links)),
            changed: Vec::with_capacity(plans.len()),
            notices: VecDeque::with_capacity(MAX_NOTICES),
            orders: VecDeque::new(),
            telling: Telling::default(),
            modbus: Modbus::default(),
            audit: Audit::default(),
            dropped_on_wire: vec![0; usize::from(links)],
            counters: Counters::default(),
        };
        for (device, plan) in plans.iter().enumerate() {
            core.join(Unit::new(plan, now).map_err(|reason| PlanError { device, reason })?);
        }
        Ok(core)
    }

    /// Gives `link`, which may be new and on which there is no device, to another bus.
    pub fn open_link(&mut self, link: LinkId) {
        let position = usize::from(link.0);
        if self.routers.len() <= position {
            self.routers.resize_with(position + 1, Router::default);
            self.dropped_on_wire.resize(position + 1, 0);
        }
        self.routers.get_mut(position).into_iter().for_each(|router| *router = Router::default());
        self.dropped_on_wire.get_mut(position).into_iter().for_each(|dropped| *dropped = 0);
    }

    /// Makes `timeout` the silence of an SDO client of `device` after which its transfer is aborted; it is one second
    /// otherwise.
    pub fn set_sdo_timeout(&mut self, device: usize, timeout: Duration) {
        self.units.get_mut(device).into_iter().for_each(|unit| unit.set_sdo_timeout(timeout));
    }

    /// Lets `device`, which has not started, take its time for its process data as `timing` says; it has them at once
    /// otherwise.
    pub fn set_timing(&mut self, device: usize, timing: Timing) {
        self.units.get_mut(device).into_iter().for_each(|unit| unit.set_timing(timing));
    }

    /// Powers on the nodes of `link`, which send their boot-up messages. Those that run go on.
    pub fn start(&mut self, now: Instant, link: LinkId) {
        for unit in 0..self.units.end() {
            let Some(Unit { device, members, .. }) = self.units.get_mut(unit) else { continue };
            let new = members.iter_mut().filter(|member| member.link == link && !member.is_started);
            let mut is_new = false;
            for Member { node, is_started, .. } in new {
                *is_started = true;
                node.start(now, device.dictionary());
                is_new = true;
            }
            if is_new {
                self.settle(now, unit);
                self.speak(now, unit);
            }
        }
        self.pass(now);
    }

    /// Takes the state of the CAN controller of `link`.
    pub fn set_bus_state(&mut self, now: Instant, link: LinkId, state: BusState) {
        for unit in 0..self.units.end() {
            let Some(Unit { members, .. }) = self.units.get_mut(unit) else { continue };
            let own = members.iter_mut().filter(|member| member.link == link);
            if own.map(|Member { node, .. }| node.set_bus_state(now, state)).count() > 0 {
                self.settle(now, unit);
                self.speak(now, unit);
            }
        }
        self.pass(now);
    }

    /// Takes a frame that came in on `link`.
    pub fn handle_frame(&mut self, now: Instant, link: LinkId, frame: &Frame) {
        self.handle_frame_of(now, link, Sender::Bus, frame);
    }

    /// Takes a frame that somebody else than one of our nodes has sent on `link`.
    pub fn handle_frame_of(&mut self, now: Instant, link: LinkId, sender: Sender, frame: &Frame) {
        let passing = Passing { link, sender, frame: *frame };
        put_on_wire(&mut self.wire, &mut self.dropped_on_wire, passing);
        self.pass(now);
    }

    /// Takes a frame that an operator on this machine has sent on `link`.
    pub fn handle_own_frame(&mut self, now: Instant, link: LinkId, frame: &Frame) {
        self.handle_frame_of(now, link, Sender::Operator(self.audit.peer), frame);
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
        let own = self.deadlines.first();
        let all = [own, self.resume, self.telling.deadline, self.modbus.deadline, self.audit.deadline];
        all.into_iter().flatten().min()
    }

    /// The next frame to send, and where.
    pub fn poll_transmit(&mut self) -> Option<(LinkId, Frame)> {
        self.outbox.pop_front()
    }

    /// The next link of which [`Core::subscriptions`] may give other identifiers now.
    pub fn poll_resubscribed(&mut self) -> Option<LinkId> {
        self.resubscribed.pop()
    }

    /// The next link and device whose node there may hear and send other identifiers now.
    pub fn poll_changed(&mut self) -> Option<(LinkId, usize)> {
        self.changed.pop()
    }

    /// The next notice, and the position of the device it concerns.
    pub fn poll_notice(&mut self) -> Option<(usize, Notice)> {
        self.notices.pop_front()
    }

    /// Whether [`Core::poll_notice`] gives one.
    #[must_use]
    pub fn has_notices(&self) -> bool {
        !self.notices.is_empty()
    }

    /// Every identifier that our nodes on `link` listen to.
    pub fn subscriptions(&self, link: LinkId) -> impl Iterator<Item = Id> {
        self.routers.get(usize::from(link.0)).into_iter().flat_map(Router::ids)
    }

    /// Whether this frame of one of our nodes on `link` tells how something is now, so that the next one with its identifier
    /// tells whatever it told: the values of a TPDO, the NMT state by heartbeat.
    #[must_use]
    pub fn tells_present(&self, link: LinkId, frame: &Frame) -> bool {
        self.network(link).any(|(_, node)| node.is_tpdo(frame.id) || node.is_heartbeat(frame))
    }

    /// Lets every axis ramp down and switch off.
    pub fn shut_down(&mut self, now: Instant) {
        for unit in 0..self.units.end() {
            self.shut_down_device(now, unit);
        }
    }

    /// Lets the axes of a device ramp down and switch off.
    pub fn shut_down_device(&mut self, now: Instant, device: usize) {
        let Some(unit) = self.units.get_mut(device) else { return };
        unit.device.shut_down(now);
        self.settle(now, device);
        self.speak(now, device);
        self.pass(now);
    }

    /// Cuts the power of every axis that does not come to rest.
    pub fn cut_power(&mut self, now: Instant) {
        for unit in 0..self.units.end() {
            self.cut_power_of_device(now, unit);
        }
    }

    /// Cuts the power of the axes of a device that do not come to rest after [`Core::shut_down_device`], for good: they coast.
    pub fn cut_power_of_device(&mut self, now: Instant, device: usize) {
        let Some(unit) = self.units.get_mut(device).filter(|unit| !unit.device.is_quiet()) else { return };
        unit.device.cut_power(now);
        note(&mut self.notices, &mut self.counters, device, Notice::PowerCut);
        self.settle(now, device);
        self.speak(now, device);
        self.pass(now);
    }

    fn hear(&mut self, now: Instant, hearer: usize, frame: &Frame) {
        let Some(Hearer { unit, position }) = self.members.get(hearer).copied() else { return };
        if self.deadlines.is_due(unit, now) {
            self.run_due(now, unit);
        }
        if let Some(Unit { device, members, .. }) = self.units.get_mut(unit)
            && let Some(Member { node, .. }) = members.get_mut(position)
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
        for Member { node, .. } in members {
            node.handle_timeout(now, device.dictionary_mut());
        }
        self.settle(now, unit);
        self.speak(now, unit);
    }

    /// Lets a device act on what was written to it and on what happened to its nodes, and its nodes on what
    /// happened to it.
    fn settle(&mut self, now: Instant, unit: usize) {
        self.note_commands(now, unit);
        let Self { units, routers, resubscribed, changed, notices, counters, .. } = self;
        let Some(Unit { device, members, .. }) = units.get_mut(unit) else { return };
        let mut ordered = Vec::new();
        if device.dictionary().has_written() {
            device.apply(now);
        }
        for (position, Member { node, number, link, is_up, .. }) in members.iter_mut().enumerate() {
            while let Some(event) = node.poll_event() {
                let notice = match event {
                    Event::Reset => {
                        device.reset(now);
                        Some(Notice::Reset)
                    }
                    Event::NodeId(node_id) => {
                        if position == 0 {
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
                            router.subscribe(*number, node.subscriptions());
                        }
                        if !resubscribed.contains(link) {
                            resubscribed.push(*link);
                        }
                        if !changed.contains(&(*link, unit)) {
                            changed.push((*link, unit));
                        }
                        None
                    }
                    Event::Storage(order) => {
                        ordered.push((position, order));
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
        ordered.into_iter().for_each(|(position, order)| self.order(now, unit, position, order));
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
        let Some(Unit { device, members, .. }) = self.units.get_mut(unit) else { return false };
        let mut deadline = device.poll_timeout();
        let mut has_events = false;
        for Member { node, .. } in members {
            node.sample(now, device.dictionary());
            has_events |= node.has_events();
            deadline = deadline.into_iter().chain(node.poll_timeout()).min();
            if node.produces_time() {
                self.telling.begin(now);
            }
        }
        self.send(unit);
        // It may stay in the past.
        self.deadlines.set(unit, deadline.map(|deadline| deadline.max(now + SOON)));
        has_events
    }
}
