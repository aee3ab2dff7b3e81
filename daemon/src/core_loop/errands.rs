//! What the core loop does for the control socket.

use core::time::Duration;

use canopen::{Frame, Id, UNCONFIGURED};
use od::{AbortCode, Address, Instant};

use super::chores::Piece;
use super::{CoreLoop, link_id};
use crate::control::{
    Commanded, Described, Errand, Inbox, NmtOrder, NodePlace, ObjectError, ObjectOrder, ObjectTask, Placed,
    Target, Watched, find_device,
};
use crate::core::{LinkId, WriteRefused};
use crate::dump::Known;
use crate::link::{Link, Record, Tap, in_order};

/// How soon an operator who has asked something asks the next thing.
const ATTENTION: Duration = Duration::from_secs(1);
/// Watchers that a bus may have.
const MAX_TAPS: usize = 4;
/// The sender of frames that are sent for the control socket; clients of socketcand have numbers from 1.
const OPERATOR: u64 = 0;
/// The identifier of NMT commands.
const NMT: Id = Id::Standard(0x000);

impl CoreLoop {
    /// Does the next that is ordered by the control socket.
    pub(super) fn carry_out_errand(&mut self, now: Instant) -> Piece {
        let Some(Placed { by, errand }) = self.inbox.as_mut().and_then(Inbox::poll) else {
            return Piece::None;
        };
        self.attentive_until = now + ATTENTION;
        self.core.act_for(by);
        self.carry_out(now, errand);
        self.core.act_for(None);
        self.transmit(now);
        Piece::Done
    }

    fn carry_out(&mut self, now: Instant, errand: Errand) {
        match errand {
            Errand::Faults(task) => {
                let outcome = task.order.carry_out(now, &mut self.core);
                if let (Ok(_), Some((device, change))) = (&outcome, task.order.change()) {
                    self.reporter.ordered(now, &self.core, device, &change);
                }
                task.conclude(outcome);
            }
            Errand::Signals(task) => {
                let outcome = task.order.carry_out(now, &mut self.core);
                if let (Ok(_), Some((device, change))) = (&outcome, task.order.change()) {
                    self.reporter.ordered(now, &self.core, device, &change);
                }
                task.conclude(outcome);
            }
            Errand::Describe(task) => {
                let described = self.describe(task.order.as_deref());
                task.conclude(described);
            }
            Errand::Objects(task) => self.access(now, task),
            Errand::Claim(task) => {
                let buses: Vec<&str> = self.links.iter().map(|link| link.name.as_str()).collect();
                let outcome = task.order.carry_out(now, &mut self.core, &buses);
                if outcome.is_ok() {
                    self.reporter.ordered(now, &self.core, &task.order.device, &task.order.change());
                }
                task.conclude(outcome);
            }
            Errand::Nmt(task) => {
                let commanded = self.command(now, &task.order);
                task.conclude(commanded);
            }
            Errand::Send(task) => {
                let sent = self.send(now, task.order.link, &task.order.frame);
                task.conclude(sent);
            }
            Errand::Watch(task) => {
                let (bus, tap) = &task.order;
                let watched = self.watch(now, bus.as_deref(), tap);
                task.conclude(watched);
            }
            Errand::Unwatch(task) => {
                self.unwatch(now);
                task.conclude(());
            }
            Errand::Hear(task) => {
                let (link, is_heard) = task.order;
                self.set_heard(now, link, is_heard);
                task.conclude(());
            }
        }
    }

    fn describe(&self, name: Option<&str>) -> Result<Vec<Described>, String> {
        let wanted = name.map(|name| find_device(&self.core, name)).transpose()?;
        let named = self.core.names().filter(|(number, _)| wanted.is_none_or(|wanted| wanted == *number));
        let described = |(number, device): (usize, &str)| {
            let nodes = self.core.nodes_of(number);
            let place = |(link, node): (LinkId, &canopen::Node)| NodePlace {
                bus: self.bus_name(link).to_owned(),
                network: u32::from(link.0) + 1,
                node_id: node.node_id(),
            };
            let nodes = nodes.map(place).collect();
            let profile = self.core.profile(number)?.clone();
            Some(Described { device: device.to_owned(), profile, nodes })
        };
        Ok(named.filter_map(described).collect())
    }

    fn bus_name(&self, link: LinkId) -> &str {
        self.links.get(usize::from(link.0)).map_or("?", |link| link.name.as_str())
    }

    fn access(&mut self, now: Instant, task: ObjectTask) {
        let device = match find_device(&self.core, &task.order.device) {
            Ok(device) => device,
            Err(unknown) => return task.conclude(Err(ObjectError::Unknown(unknown))),
        };
        let ObjectOrder { node, writes, reads, authority, motion, .. } = &task.order;
        let node = *node;
        if let Some((axis, goal)) = motion {
            self.core.note_motion(now, device, *axis, *goal);
        }
        if !writes.is_empty() {
            match self.core.write(now, device, node, writes, *authority) {
                Ok(false) => {}
                Ok(true) => return self.storing.push((device, task)),
                Err(refused) => return task.conclude(Err(ObjectError::Refused(refused))),
            }
        }
        let core = &self.core;
        let values = reads.iter().map(|address| core.read(device, node, *address)).collect();
        task.conclude(Ok(values));
    }

    /// Tells whoever ordered to store the parameters of `device` how that went.
    pub(super) fn conclude_storing(&mut self, device: usize, outcome: Result<(), AbortCode>) {
        while let Some(position) = self.storing.iter().position(|(storing, _)| *storing == device) {
            let (_, task) = self.storing.swap_remove(position);
            let address = task.order.writes.last().map_or(Address::new(0, 0), |(address, _)| *address);
            let refused = |code| ObjectError::Refused(WriteRefused { address, code });
            task.conclude(outcome.map(|()| Vec::new()).map_err(refused));
        }
    }

    fn command(&mut self, now: Instant, order: &NmtOrder) -> Result<Vec<Commanded>, String> {
        let mut commanded = Vec::new();
        for (position, node_id) in self.targets(order)? {
            let link = link_id(position);
            self.send(now, link, &Frame::new(NMT, &[order.command as u8, node_id]))?;
            let mut own = self.core.network(link).map(|(_, node)| node);
            let state = own.find(|node| node.node_id() == node_id).map(|node| node.state().name().to_owned());
            commanded.push(Commanded { bus: self.bus_name(link).to_owned(), node_id, state });
        }
        Ok(commanded)
    }

    /// Puts a frame on a bus: others there hear it, and so do our nodes.
    fn send(&mut self, now: Instant, link: LinkId, frame: &Frame) -> Result<(), String> {
        let known = self.links.get_mut(usize::from(link.0)).ok_or("there is no such bus")?;
        if known.interface.as_ref().is_some_and(|interface| interface.fd().is_none()) {
            return Err(format!("the interface of bus `{}` is not open", known.name));
        }
        known.pass_on(now, OPERATOR, frame);
        self.core.handle_own_frame(now, link, frame);
        Ok(())
    }

    /// Links, by their positions, and Node-IDs.
    fn targets(&self, NmtOrder { target, bus, .. }: &NmtOrder) -> Result<Vec<(usize, u8)>, String> {
        let bus = bus.as_deref().map(|bus| self.find_bus(bus)).transpose()?;
        match (target, bus) {
            (Target::Device(device), bus) => {
                let nodes = self.core.nodes_of(find_device(&self.core, device)?);
                let nodes = nodes.map(|(link, node)| (usize::from(link.0), node.node_id()));
                let is_meant = |(link, node_id): &(usize, u8)| {
                    *node_id != UNCONFIGURED && bus.is_none_or(|bus| bus == *link)
                };
                let nodes: Vec<_> = nodes.filter(is_meant).collect();
                if nodes.is_empty() {
                    Err(format!("device `{device}` has no node with a Node-ID there"))
                } else {
                    Ok(nodes)
                }
            }
            (Target::Node(node_id), Some(bus)) => Ok(vec![(bus, *node_id)]),
            (Target::Node(node_id), None) => match &*self.buses().collect::<Vec<_>>() {
                [(bus, _)] => Ok(vec![(*bus, *node_id)]),
                _ => Err(format!("say on which bus: {}", self.bus_names())),
            },
        }
    }

    fn find_bus(&self, name: &str) -> Result<usize, String> {
        let found = self.buses().find(|(_, link)| link.name == name).map(|(position, _)| position);
        found.ok_or_else(|| format!("no bus `{name}`; there are: {}", self.bus_names()))
    }

    fn bus_names(&self) -> String {
        self.buses().map(|(_, link)| link.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// The buses that there are, with their positions, in the order of the configuration.
    fn buses(&self) -> impl Iterator<Item = (usize, &Link)> {
        in_order(&self.links)
    }

    fn watch(&mut self, now: Instant, bus: Option<&str>, tap: &Tap) -> Result<Vec<Watched>, String> {
        let wanted = bus.map(|bus| self.find_bus(bus)).transpose()?;
        let meant = self.buses().filter(|(position, _)| wanted.is_none_or(|wanted| wanted == *position));
        let (positions, links): (Vec<usize>, Vec<&Link>) = meant.unzip();
        if links.iter().any(|link| link.taps.len() >= MAX_TAPS) {
            return Err("too many watch this bus".to_owned());
        }
        let mut watched = Vec::new();
        for position in positions {
            let nodes = self.core.network(link_id(position));
            let nodes = nodes.filter_map(|(device, node)| self.known(device, node)).collect();
            let Some(link) = self.links.get_mut(position) else { continue };
            link.taps.push(tap.clone());
            watched.push(Watched { link: link_id(position), name: link.name.clone(), nodes });
            self.set_watched(now, position, true);
        }
        Ok(watched)
    }

    /// Forgets those who watch no more.
    fn unwatch(&mut self, now: Instant) {
        for position in 0..self.links.len() {
            let Some(link) = self.links.get_mut(position) else { continue };
            link.taps.retain(Tap::is_watched);
            if link.taps.is_empty() {
                self.set_watched(now, position, false);
            }
        }
    }

    /// Lets the kernel deliver every frame of an interface, or only what our nodes listen to.
    fn set_watched(&mut self, now: Instant, position: usize, is_watched: bool) {
        let interface = self.links.get_mut(position).and_then(|link| link.interface.as_mut());
        if interface.is_some_and(|interface| interface.set_watched(is_watched)) {
            self.subscribe(now, position);
        }
    }

    /// The same for the clients of the ASCII gateway.
    fn set_heard(&mut self, now: Instant, link: LinkId, is_heard: bool) {
        let position = usize::from(link.0);
        if self.links.get_mut(position).is_some_and(|link| link.set_heard(is_heard)) {
            self.subscribe(now, position);
        }
    }

    /// Tells those who watch `link` what the node of a device is there now.
    pub(super) fn show_node(&mut self, link: LinkId, device: usize) {
        let position = usize::from(link.0);
        if self.links.get(position).is_none_or(|link| link.taps.is_empty()) {
            return;
        }
        let own = self.core.nodes_of(device).filter(|(place, _)| *place == link);
        let nodes: Vec<Known> = own.filter_map(|(_, node)| self.known(device, node)).collect();
        if let Some(known) = self.links.get_mut(position) {
            known.taps.retain(|tap| tap.put(Record::Nodes(link, nodes.clone())));
        }
    }

    fn known(&self, device: usize, node: &canopen::Node) -> Option<Known> {
        let profile = self.core.profile(device)?.clone();
        let device = self.core.name(device)?.to_string();
        let (node_id, communication) = (node.node_id(), node.communication().clone());
        Some(Known { node_id, device, profile, communication })
    }
}
