//! All of a reload that can fail: it is done before anything changes.

use std::collections::BTreeMap;
use std::net::{SocketAddr, TcpListener};

use config::{Changes, Gateway, Listener};

use super::{Adjustment, Arrivals, NewLink, Reloader};
use crate::cli::Failure;
use crate::core::{LinkId, ListenerPlan, ModbusPlan};
use crate::modbus_tcp::{self, Change, Sockets};
use crate::socketcand::{self, Bus};
use crate::{build, commands};

/// A port of socketcand: its address, a new listener if it has none, and its buses.
pub(super) type PortPlan = (SocketAddr, Option<TcpListener>, Vec<Bus>);

/// A reload that cannot fail any more.
pub(super) struct Prepared {
    pub(super) changes: Changes,
    /// The link of each bus.
    pub(super) links: Vec<LinkId>,
    /// The names of the buses by their links.
    pub(super) names: Vec<Option<String>>,
    pub(super) removed_links: Vec<LinkId>,
    pub(super) ports: Vec<PortPlan>,
    pub(super) served: BTreeMap<String, Bus>,
    pub(super) listeners: Vec<Option<Whose>>,
    /// All but the devices.
    pub(super) arrivals: Arrivals,
}

/// Whose a Modbus listener is, which tells it apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Whose {
    /// That of the whole gateway.
    Gateway,
    /// That of the device of this name alone.
    Device(String),
}

impl Whose {
    pub(super) fn of(gateway: &Gateway, listener: &Listener) -> Self {
        let device = listener.device.filter(|_| listener.is_own);
        let device = device.and_then(|device| gateway.devices.get(device));
        device.map_or(Self::Gateway, |device| Self::Device(device.name.clone()))
    }
}

impl Reloader {
    /// Reads the file and makes ready what it changes.
    ///
    /// # Errors
    /// Everything that is wrong, in lines.
    pub(super) fn prepare(&mut self) -> Result<Prepared, Vec<String>> {
        let wanted = commands::read(&self.file)
            .map_err(|wrong| wrong.0.iter().map(ToString::to_string).collect::<Vec<_>>())?;
        let changes = Changes::between(&self.running, wanted);
        let failed = |failure: Failure| vec![failure.into_text()];
        // What only the bus engine can tell: mappings of PDOs, for example.
        build::core(&changes.next, self.clock.now()).map_err(failed)?;
        let (names, removed_links) = self.rename(&changes);
        let link = |name: &String| names.iter().position(|known| known.as_ref() == Some(name));
        let links: Vec<LinkId> =
            changes.next.buses.iter().map(|bus| LinkId(link(&bus.name).unwrap_or_default() as u16)).collect();
        let served = self.served(&changes, &links);
        let ports = self.ports(&changes.next, &served).map_err(failed)?;
        let (listeners, listener_changes) = self.listeners(&changes).map_err(failed)?;
        let sockets = if listener_changes.is_empty() || self.has_sockets {
            None
        } else {
            Some(Sockets::new(Vec::new()).map_err(|error| vec![error.to_string()])?)
        };
        self.has_sockets |= sockets.is_some();
        let mut arrivals = Arrivals { sockets, listeners: listener_changes, ..Arrivals::default() };
        self.fill(&mut arrivals, &changes, &links, &served);
        arrivals.stands_for = stands_for(&changes.next, &listeners);
        arrivals.order.clone_from(&links);
        arrivals.places = changes.next.devices.iter().map(|device| device.name.clone()).zip(0..).collect();
        Ok(Prepared { changes, links, names, removed_links, ports, served, listeners, arrivals })
    }

    /// What Modbus clients see of a device, if there are any.
    pub(super) fn view(&self, gateway: &Gateway, device: &config::Device) -> Option<ModbusPlan> {
        (!gateway.modbus.is_empty()).then(|| modbus_tcp::view(device))
    }

    /// The names of the buses by their links after the changes, and links that become free.
    fn rename(&self, changes: &Changes) -> (Vec<Option<String>>, Vec<LinkId>) {
        let mut names = self.links.clone();
        let mut removed = Vec::new();
        for (number, name) in names.iter_mut().enumerate() {
            if name.as_ref().is_some_and(|name| changes.buses_removed.contains(name)) {
                *name = None;
                removed.push(LinkId(number as u16));
            }
        }
        for bus in changes.buses_added.iter().filter_map(|bus| changes.next.buses.get(*bus)) {
            match names.iter_mut().find(|name| name.is_none()) {
                Some(free) => *free = Some(bus.name.clone()),
                None => names.push(Some(bus.name.clone())),
            }
        }
        (names, removed)
    }

    /// The buses that are served by socketcand or a gateway after the changes.
    fn served(&self, changes: &Changes, links: &[LinkId]) -> BTreeMap<String, Bus> {
        let mut served = BTreeMap::new();
        for (position, (bus, link)) in changes.next.buses.iter().zip(links).enumerate() {
            let known = self.served.get(&bus.name).filter(|_| !changes.buses_added.contains(&position));
            if bus.has_clients() {
                served.insert(bus.name.clone(), known.cloned().unwrap_or_else(|| Bus::new(&bus.name, *link)));
            }
        }
        served
    }

    /// The ports of socketcand after the changes; those that are new are bound.
    fn ports(&self, next: &Gateway, served: &BTreeMap<String, Bus>) -> Result<Vec<PortPlan>, Failure> {
        let mut ports: BTreeMap<SocketAddr, Vec<Bus>> = BTreeMap::new();
        for bus in &next.buses {
            if let (Some(address), Some(served)) = (bus.socketcand, served.get(&bus.name)) {
                ports.entry(address).or_default().push(served.clone());
            }
        }
        let plan = |(address, buses)| {
            let is_known = self.ports.contains_key(&address);
            let listener = (!is_known).then(|| socketcand::listen(address)).transpose();
            let listener = listener
                .map_err(|error| Failure::Other(format!("cannot serve socketcand on {address}: {error}")))?;
            Ok((address, listener, buses))
        };
        ports.into_iter().map(plan).collect()
    }

    /// The Modbus listeners by their numbers after the changes, and what changes of them; sockets that are new are bound.
    fn listeners(&self, changes: &Changes) -> Result<(Vec<Option<Whose>>, Vec<Change>), Failure> {
        let mut numbers = self.listeners.clone();
        if !changes.modbus {
            return Ok((numbers, Vec::new()));
        }
        let next = &changes.next;
        let keys: Vec<_> = next.modbus.iter().map(|listener| Whose::of(next, listener)).collect();
        for number in &mut numbers {
            number.take_if(|known| !keys.contains(known));
        }
        for key in &keys {
            if !numbers.contains(&Some(key.clone())) {
                match numbers.iter_mut().find(|number| number.is_none()) {
                    Some(free) => *free = Some(key.clone()),
                    None => numbers.push(Some(key.clone())),
                }
            }
        }
        let change = |(number, whose): (usize, &Option<Whose>)| {
            let listener = keys.iter().position(|key| Some(key) == whose.as_ref());
            match listener.and_then(|listener| next.modbus.get(listener)) {
                Some(listener) => self.change_of(number, listener),
                None => Ok(gone(number)),
            }
        };
        let listeners = numbers.iter().enumerate().map(change).collect::<Result<_, _>>()?;
        Ok((numbers, listeners))
    }

    fn change_of(&self, number: usize, listener: &Listener) -> Result<Change, Failure> {
        let old = self.listeners.get(number).into_iter().flatten();
        let old: Vec<SocketAddr> = old
            .flat_map(|own| {
                self.running.modbus.iter().filter(move |known| Whose::of(&self.running, known) == *own)
            })
            .flat_map(|known| known.listen.iter().copied())
            .collect();
        let all: Vec<SocketAddr> =
            self.running.modbus.iter().flat_map(|known| known.listen.iter().copied()).collect();
        // Port 0 is one that is free, each time another.
        let is_known = |address: &SocketAddr| {
            if address.port() == 0 { old.contains(address) } else { all.contains(address) }
        };
        let new = listener.listen.iter().filter(|address| !is_known(address));
        let listeners = new.copied().map(modbus_tcp::bind).collect::<Result<_, _>>()?;
        let (allow, read_only) = (listener.allow.clone(), listener.read_only.clone());
        let listening = modbus_tcp::Listening { listeners, allow, read_only };
        Ok(Change { number, plan: modbus_tcp::plan(listener), listen: listener.listen.clone(), listening })
    }

    /// Adds buses and what changes of those, and of devices, that stay.
    fn fill(
        &self,
        arrivals: &mut Arrivals,
        changes: &Changes,
        links: &[LinkId],
        served: &BTreeMap<String, Bus>,
    ) {
        let next = &changes.next;
        let is_timed = next.service.metrics.is_some();
        for (position, (bus, id)) in next.buses.iter().zip(links).enumerate() {
            let clients = served.get(&bus.name).map(|served| served.frames.clone());
            if changes.buses_added.contains(&position) {
                arrivals.links.push_back(NewLink { id: *id, bus: bus.clone(), is_timed, clients });
            } else if changes.socketcand {
                arrivals.clients.push_back((*id, clients, bus.socketcand.is_some()));
            }
        }
        for device in changes.adjusted.iter().filter_map(|device| next.devices.get(*device)) {
            let old = self.running.devices.iter().find(|old| old.name == device.name);
            let owner = device.owner.map(|owner| modbus_tcp::owner(owner, links));
            let before = old.and_then(|old| old.owner);
            let before = before.map(|owner| modbus_tcp::owner(owner, &self.running_links()));
            arrivals.adjustments.push(Adjustment {
                device: device.name.clone(),
                view: self.view(next, device),
                owner: (owner != before).then_some(owner),
            });
        }
    }

    /// The links of the buses in effect.
    fn running_links(&self) -> Vec<LinkId> {
        let link = |bus: &config::Bus| {
            let position = self.links.iter().position(|known| known.as_ref() == Some(&bus.name));
            LinkId(position.unwrap_or_default() as u16)
        };
        self.running.buses.iter().map(link).collect()
    }
}

/// The change of a listener that goes.
fn gone(number: usize) -> Change {
    let (plan, listening) = (ListenerPlan::default(), modbus_tcp::Listening::default());
    Change { number, plan, listen: Vec::new(), listening }
}

/// The device that each listener stands for.
fn stands_for(gateway: &Gateway, listeners: &[Option<Whose>]) -> Vec<Option<String>> {
    let device = |own: &Option<Whose>| {
        let own = own.as_ref()?;
        let listener = gateway.modbus.iter().find(|listener| Whose::of(gateway, listener) == *own)?;
        gateway.devices.get(listener.device?).map(|device| device.name.clone())
    };
    listeners.iter().map(device).collect()
}
