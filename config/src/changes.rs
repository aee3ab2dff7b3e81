//! What is different between the configuration that is in effect and another one that is to be.
//!
//! Buses and devices are known by their names. What cannot be changed while the daemon runs keeps its value, and is told
//! ([`Changes::restart`]); all else of the new configuration is taken.

use std::net::SocketAddr;

use crate::{Attachment, Bus, Device, Gateway, Listener, ModbusView, Owner};

/// See the module's documentation. Positions are those of [`Changes::next`].
#[derive(Clone, Debug)]
pub struct Changes {
    /// What is in effect then.
    pub next: Gateway,
    /// Buses that go, by name; one that is reached otherwise than before goes and comes.
    pub buses_removed: Vec<String>,
    /// Buses that come.
    pub buses_added: Vec<usize>,
    /// Whether buses are served by socketcand otherwise than before.
    pub socketcand: bool,
    /// Devices that leave for good, by name.
    pub removed: Vec<String>,
    /// Devices that leave and come back as something else.
    pub replaced: Vec<usize>,
    /// Devices that are new.
    pub added: Vec<usize>,
    /// Devices that go on, but are reached or commanded otherwise.
    pub adjusted: Vec<usize>,
    /// Whether Modbus clients are served otherwise than before.
    pub modbus: bool,
    /// Whether the log says more or less than before.
    pub log: bool,
    /// Keys of which the new value comes with a restart of the daemon.
    pub restart: Vec<&'static str>,
}

impl Changes {
    /// From `running`, which is in effect, to `wanted`.
    #[must_use]
    pub fn between(running: &Gateway, wanted: Gateway) -> Self {
        let mut next = wanted;
        let restart = keep_what_needs_a_restart(running, &mut next);
        let bus_stays = |bus: &Bus| running.buses.iter().any(|old| is_same_bus(old, bus));
        let bus_goes = |bus: &&Bus| !next.buses.iter().any(|new| is_same_bus(bus, new));
        let device_goes = |device: &&Device| !next.devices.iter().any(|new| new.name == device.name);
        let mut changes = Self {
            buses_removed: running.buses.iter().filter(bus_goes).map(|bus| bus.name.clone()).collect(),
            buses_added: positions(&next.buses, |bus| !bus_stays(bus)),
            socketcand: served(running) != served(&next),
            removed: running.devices.iter().filter(device_goes).map(|device| device.name.clone()).collect(),
            replaced: Vec::new(),
            added: Vec::new(),
            adjusted: Vec::new(),
            modbus: listeners(running) != listeners(&next),
            log: running.service.log != next.service.log,
            restart,
            next,
        };
        for (position, device) in changes.next.devices.iter().enumerate() {
            let Some(old) = running.devices.iter().find(|old| old.name == device.name) else {
                changes.added.push(position);
                continue;
            };
            if !is_same_device((running, old), (&changes.next, device)) {
                changes.replaced.push(position);
            } else if outside(running, old) != outside(&changes.next, device) {
                changes.adjusted.push(position);
            }
        }
        changes
    }

    /// Whether nothing changes, and nothing would by a restart.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        let Self { removed, replaced, added, adjusted, buses_removed, buses_added, .. } = self;
        let is_unchanged =
            [replaced, added, adjusted, buses_added].iter().all(|positions| positions.is_empty());
        is_unchanged
            && removed.is_empty()
            && buses_removed.is_empty()
            && !(self.socketcand || self.modbus || self.log)
            && self.restart.is_empty()
    }
}

/// Gives `next` the values of `running` where a new one needs a restart; the keys of those that are new.
fn keep_what_needs_a_restart(running: &Gateway, next: &mut Gateway) -> Vec<&'static str> {
    fn keep<T: Clone + PartialEq>(key: &'static str, old: &T, new: &mut T) -> Option<&'static str> {
        let is_new = old != new;
        new.clone_from(old);
        is_new.then_some(key)
    }
    let (old, new) = (&running.service, &mut next.service);
    let service = [
        keep("log.format", &old.log.format, &mut new.log.format),
        keep("realtime", &old.realtime, &mut new.realtime),
        keep("metrics", &old.metrics, &mut new.metrics),
        keep("audit", &old.audit, &mut new.audit),
    ];
    let places = [
        keep("storage", &running.storage, &mut next.storage),
        keep("control", &running.control, &mut next.control),
    ];
    let gateway = keep_gateways(running, next).then_some("bus.gateway");
    places.into_iter().chain(service).chain([gateway]).flatten().collect()
}

/// Gives the buses of `next` the gateways that they have; whether that is not what it says. A bus that comes gets none, and
/// that of one that goes leads nowhere.
fn keep_gateways(running: &Gateway, next: &mut Gateway) -> bool {
    let has_gone = |bus: &&Bus| bus.gateway.is_some() && !next.buses.iter().any(|new| is_same_bus(bus, new));
    let mut is_new = running.buses.iter().any(|bus| has_gone(&bus));
    for bus in &mut next.buses {
        let old = running.buses.iter().find(|old| is_same_bus(old, bus));
        let kept = old.and_then(|old| old.gateway.clone());
        is_new |= kept != bus.gateway;
        bus.gateway = kept;
    }
    is_new
}

fn positions<T>(list: &[T], is_meant: impl Fn(&T) -> bool) -> Vec<usize> {
    list.iter().enumerate().filter(|(_, item)| is_meant(item)).map(|(position, _)| position).collect()
}

/// A bus that is reached in another way is another one. Nobody sets its bit rate, and who joins it by socketcand is of no
/// concern to its devices.
fn is_same_bus(old: &Bus, new: &Bus) -> bool {
    (&old.name, &old.link) == (&new.name, &new.link)
}

/// Where buses are served by socketcand.
fn served(gateway: &Gateway) -> Vec<(&str, SocketAddr)> {
    let mut served: Vec<_> =
        gateway.buses.iter().filter_map(|bus| Some((bus.name.as_str(), bus.socketcand?))).collect();
    served.sort_unstable();
    served
}

/// The listeners, with the names of their devices instead of positions.
fn listeners(gateway: &Gateway) -> Vec<(Option<&str>, Listener)> {
    let named = |listener: &Listener| {
        let device = listener.device.and_then(|device| gateway.devices.get(device));
        (device.map(|device| device.name.as_str()), Listener { device: None, ..listener.clone() })
    };
    gateway.modbus.iter().map(named).collect()
}

/// Whether two devices are built alike and stand at the same places.
fn is_same_device((running, old): (&Gateway, &Device), (next, new): (&Gateway, &Device)) -> bool {
    fn bus(gateway: &Gateway, position: usize) -> Option<&Bus> {
        gateway.buses.get(position)
    }
    let is_same_place = |(old, new): (&Attachment, &Attachment)| {
        let is_same =
            bus(running, old.bus).zip(bus(next, new.bus)).is_some_and(|(old, new)| is_same_bus(old, new));
        is_same && old.node_id == new.node_id
    };
    let motor = |device: &Device| device.profile.motor.as_ref().map(|motor| motor.name.clone());
    let identity = |device: &Device| [1, 2, 3, 4].map(|sub| device.profile.identity(sub));
    old.profile_text == new.profile_text
        && old.profile.name == new.profile.name
        && motor(old) == motor(new)
        && identity(old) == identity(new)
        && (old.sdo_timeout, old.serial, old.timing) == (new.sdo_timeout, new.serial, new.timing)
        && old.defaults == new.defaults
        && old.motor_data == new.motor_data
        && old.plant == new.plant
        && old.on.len() == new.on.len()
        && old.on.iter().zip(&new.on).all(is_same_place)
}

/// What of a device can change while it runs.
#[derive(PartialEq)]
struct Outside<'g> {
    /// How it looks to Modbus clients, if there are any.
    modbus: Option<(Option<u8>, ModbusView)>,
    /// Who alone commands it, as the file says it.
    owner: Option<&'g str>,
}

fn outside<'g>(gateway: &'g Gateway, device: &Device) -> Outside<'g> {
    let owner = device.owner.and_then(|owner| match owner {
        Owner::Bus(bus) => gateway.buses.get(bus).map(|bus| bus.name.as_str()),
        Owner::Modbus => Some("modbus"),
    });
    Outside { modbus: (!gateway.modbus.is_empty()).then_some((device.unit_id, device.modbus)), owner }
}
