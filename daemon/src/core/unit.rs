//! Devices with their nodes, and how they join and leave a running core.
//!
//! A device is built beside the core ([`Unit::new`]), which may take its time, and joins it between two turns
//! ([`Core::join`]). The others keep their numbers, so nothing that is under way on them notices.

use core::time::Duration;
use std::collections::BTreeMap;
use std::sync::Arc;

use canopen::{Node, NodeError};
use od::{Instant, Owner};
use profiles::{Device, Profile, StoreOrder, Timing};

use super::storage::Storing;
use super::trail::Trail;
use super::{Core, Hearer, LinkId, Plan, Sender};

/// A node and where it belongs.
#[derive(Debug)]
pub(super) struct Member {
    pub(super) node: Node,
    /// Its number in the routers, once it has joined.
    pub(super) number: u16,
    pub(super) link: LinkId,
    pub(super) is_started: bool,
    /// It has told its first NMT state.
    pub(super) is_up: bool,
}

/// A device and its nodes, one on each of its links.
pub struct Unit {
    pub(super) name: Arc<str>,
    pub(super) device: Device,
    pub(super) members: Vec<Member>,
    pub(super) storing: Option<Storing>,
    /// What the device itself wants to be stored, once what is under way is.
    pub(super) wanted: Option<StoreOrder>,
    /// Who may command its axes unless somebody has claimed them.
    pub(super) owner: Option<Owner>,
    pub(super) trail: Trail,
    /// Where it stands among the devices, for whoever lists them.
    pub(super) place: usize,
}

impl Unit {
    /// Builds a device. It is silent until it has joined a core and [`Core::start`] finds it there.
    ///
    /// # Errors
    /// The profile cannot become a node.
    pub fn new(plan: &Plan, now: Instant) -> Result<Self, NodeError> {
        let Profile { communication, application, pdos, .. } = &*plan.profile;
        let mut members = Vec::with_capacity(plan.nodes.len());
        for (link, node_id) in plan.nodes.iter().copied() {
            let mut node = Node::new(node_id, link.0, Arc::clone(communication), application)?;
            plan.serial.into_iter().for_each(|serial| node.set_serial(serial));
            node.shape_pdos(pdos, application, false);
            members.push(Member { node, number: 0, link, is_started: false, is_up: false });
        }
        // Defaults of the application that depend on a Node-ID follow the first.
        let node_id = plan.nodes.first().map_or(0, |(_, node_id)| *node_id);
        let device = Device::with_plant(Arc::clone(&plan.profile), node_id, now, &plan.plant);
        let (name, trail) = (Arc::clone(&plan.name), Trail::default());
        Ok(Self { name, device, members, storing: None, wanted: None, owner: None, trail, place: 0 })
    }

    /// What it is called.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// See [`Core::set_sdo_timeout`].
    pub fn set_sdo_timeout(&mut self, timeout: Duration) {
        self.members.iter_mut().for_each(|member| member.node.set_sdo_timeout(timeout));
    }

    /// See [`Core::set_timing`].
    pub fn set_timing(&mut self, timing: Timing) {
        let Profile { application, pdos, .. } = &**self.device.profile();
        let takes_time = timing == Timing::Authentic;
        self.members.iter_mut().for_each(|member| member.node.shape_pdos(pdos, application, takes_time));
    }

    /// See [`Core::set_owner`].
    pub fn set_owner(&mut self, owner: Option<Owner>) {
        self.owner = owner;
        for axis in 0..self.device.profile().axes() {
            self.device.dictionary_mut().set_owner(axis, owner);
        }
    }
}

impl Core {
    /// Takes a device in, which stays silent until [`Core::start`]; its position.
    pub fn join(&mut self, mut unit: Unit) -> usize {
        unit.place = self.units.iter().map(|(_, other)| other.place + 1).max().unwrap_or(0);
        let device = self.units.insert(unit);
        let Self { units, members, deadlines, audit, .. } = self;
        let Some(unit) = units.get_mut(device) else { return device };
        for (position, member) in unit.members.iter_mut().enumerate() {
            member.number = members.insert(Hearer { unit: device, position }) as u16;
        }
        deadlines.reserve(device);
        audit.join(device, unit.device.profile());
        device
    }

    /// Gives the devices their places where they are listed, by their names; one without a place stands behind the others.
    /// Until then they stand in the order in which they joined.
    pub fn arrange(&mut self, places: &BTreeMap<String, usize>) {
        for unit in self.units.iter_mut() {
            unit.place = places.get(&*unit.name).copied().unwrap_or(places.len());
        }
    }

    /// Takes a device out, wherever its axes are: whoever wants them at rest lets them come to it before
    /// ([`Core::shut_down_device`], [`Core::may_leave`]). What it has told is to be taken before, too.
    pub fn leave(&mut self, device: usize) -> Option<Unit> {
        let unit = self.units.remove(device)?;
        for Member { number, link, .. } in &unit.members {
            self.members.remove(usize::from(*number));
            if let Some(router) = self.routers.get_mut(usize::from(link.0)) {
                router.subscribe(*number, []);
            }
            if !self.resubscribed.contains(link) {
                self.resubscribed.push(*link);
            }
            // Whoever gets the number did not send what is still on the wire.
            let own = self.wire.iter_mut().filter(|passing| passing.sender == Sender::Member(*number));
            own.for_each(|passing| passing.sender = Sender::Bus);
        }
        let gone = |hearer: &u16| unit.members.iter().any(|member| member.number == *hearer);
        self.resetting.iter_mut().for_each(|resetting| resetting.hearers.retain(|hearer| !gone(hearer)));
        self.deadlines.set(device, None);
        self.orders.retain(|ordering| *ordering != device);
        self.notices.retain(|(about, _)| *about != device);
        self.modbus.leave(device);
        Some(unit)
    }

    /// Whether the axes of a device are at rest and off, and nothing of it is being stored.
    #[must_use]
    pub fn may_leave(&self, device: usize) -> bool {
        self.is_at_rest(device) && !self.is_storing(device)
    }

    /// Whether the axes of a device are at rest and off.
    #[must_use]
    pub fn is_at_rest(&self, device: usize) -> bool {
        self.units.get(device).is_none_or(|unit| unit.device.is_quiet())
    }

    /// Whether parameters of a device are being stored.
    #[must_use]
    pub fn is_storing(&self, device: usize) -> bool {
        self.units.get(device).is_some_and(|unit| unit.storing.is_some() || unit.wanted.is_some())
    }

    /// What a device is called, by its position.
    #[must_use]
    pub fn name(&self, device: usize) -> Option<&Arc<str>> {
        self.units.get(device).map(|unit| &unit.name)
    }

    /// The devices, for what is to be done before they start.
    pub fn units_mut(&mut self) -> impl Iterator<Item = &mut Unit> {
        self.units.iter_mut()
    }

    /// The position of the device of this name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.units.iter().find(|(_, unit)| &*unit.name == name).map(|(device, _)| device)
    }
}
