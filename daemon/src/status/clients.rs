//! Modbus clients, owners of axes and who commanded what.

use std::fmt::Write as _;

use od::{Bus, Instant, Owner};
use serde::{Deserialize, Serialize};

use super::table::{age, table};
use super::{Device, Status};
use crate::core::{self as gateway, ClientStatus, Core, LinkId, Who};
use crate::latency::Histogram;

/// What listeners and clients have done.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Modbus {
    /// Where clients connect, by their numbers: those are the positions in the configuration at first, and stay. One that a
    /// reload took away has no address any more, and the next new one gets its number.
    pub listeners: Vec<Listener>,
    /// The clients that there are.
    pub clients: Vec<Client>,
}

/// Where clients connect.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Listener {
    /// Its addresses.
    pub addresses: Vec<String>,
    /// Clients that are there.
    pub clients: u16,
    /// Clients that have connected.
    pub accepted: u64,
    /// Clients that were sent away at once.
    pub refused: u64,
    /// Clients whose place another one took.
    pub replaced: u64,
    /// Clients that were silent for too long.
    pub idle: u64,
}

/// A client.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Client {
    /// Address and port.
    pub peer: String,
    /// Its listener, from 0.
    pub listener: usize,
    /// How long it has been there, in ms.
    pub age_ms: u64,
    /// How long ago it asked last, in ms.
    pub silent_ms: u64,
    /// Requests that were answered.
    pub requests: u64,
    /// Those that were answered by an exception.
    pub exceptions: u64,
    /// Frames that were no requests.
    pub malformed: u64,
}

/// A command, given once or again and again.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Command {
    /// How long ago it was last given, in ms.
    pub age_ms: u64,
    /// Who gave it.
    pub who: String,
    /// The object, as in `0x6040:00`.
    pub object: String,
    /// Its value when it was last given, as a bit pattern.
    pub value: u64,
    /// How often it was another one than before.
    pub count: u64,
}

/// Times in the core loop, in us.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Times {
    /// How many there were.
    pub count: u64,
    /// The median.
    pub p50_us: u64,
    /// What one of a hundred exceeds.
    pub p99_us: u64,
    /// The longest.
    pub max_us: u64,
}

impl From<&Histogram> for Times {
    fn from(histogram: &Histogram) -> Self {
        Self {
            count: histogram.count(),
            p50_us: histogram.per_mille_us(500),
            p99_us: histogram.per_mille_us(990),
            max_us: histogram.max_us(),
        }
    }
}

/// Listeners, whose addresses these are, and clients.
pub(super) fn collect(now: Instant, core: &Core, addresses: &[Vec<String>]) -> Modbus {
    let listener = |(counters, addresses): (gateway::ListenerCounters, &Vec<String>)| Listener {
        addresses: addresses.clone(),
        clients: counters.clients,
        accepted: counters.accepted,
        refused: counters.refused,
        replaced: counters.replaced,
        idle: counters.idle,
    };
    let client = |client: ClientStatus| Client {
        peer: client.peer.to_string(),
        listener: client.listener,
        age_ms: millis(now, client.since),
        silent_ms: millis(now, client.heard),
        requests: client.counters.requests,
        exceptions: client.counters.exceptions,
        malformed: client.counters.malformed,
    };
    Modbus {
        listeners: core.modbus_listeners().zip(addresses).map(listener).collect(),
        clients: core.modbus_clients().map(client).collect(),
    }
}

/// Who commanded a device, the last one first.
pub(super) fn commands(now: Instant, core: &Core, device: usize, buses: &[&str]) -> Vec<Command> {
    let command = |command: gateway::Command| Command {
        age_ms: millis(now, command.at),
        who: who(command.who, buses),
        object: command.address.to_string(),
        value: command.raw,
        count: command.count,
    };
    core.commands(device).into_iter().map(command).collect()
}

fn who(who: Who, buses: &[&str]) -> String {
    match who {
        Who::CanOpen(LinkId(link)) => bus_name(link, buses).to_owned(),
        Who::Modbus(peer) => format!("modbus {peer}"),
        Who::ModbusGone => "modbus".to_owned(),
        Who::Local => "operator".to_owned(),
    }
}

/// Who alone may command an axis, in the words of the configuration.
pub(crate) fn owner_name(owner: Option<Owner>, buses: &[&str]) -> String {
    match owner {
        None => "any".to_owned(),
        Some(Owner { bus: Bus::CanOpen, link }) => {
            link.map_or("CANopen", |link| bus_name(link, buses)).to_owned()
        }
        Some(Owner { bus: Bus::Modbus, .. }) => "modbus".to_owned(),
        Some(Owner { bus: Bus::Local, .. }) => "local".to_owned(),
    }
}

fn bus_name<'b>(link: u16, buses: &[&'b str]) -> &'b str {
    buses.get(usize::from(link)).copied().unwrap_or("?")
}

fn millis(now: Instant, then: Instant) -> u64 {
    u64::try_from(now.saturating_since(then).as_millis()).unwrap_or(u64::MAX)
}

/// Listeners and clients as tables, if there are listeners.
pub(super) fn text(status: &Status) -> String {
    let Modbus { listeners, clients } = &status.modbus;
    if listeners.iter().all(|listener| listener.addresses.is_empty()) {
        return String::new();
    }
    let listener = |l: &Listener| {
        let [clients, accepted, refused, replaced, idle] =
            [l.clients.into(), l.accepted, l.refused, l.replaced, l.idle].map(|n: u64| n.to_string());
        [l.addresses.join(", "), clients, accepted, refused, replaced, idle]
    };
    let there = listeners.iter().filter(|listener| !listener.addresses.is_empty());
    let rows: Vec<_> = there.map(listener).collect();
    let head = ["MODBUS", ">CLIENTS", ">ACCEPTED", ">REFUSED", ">REPLACED", ">IDLE"];
    let mut text = format!("\n{}", table(&head, &rows));
    if !clients.is_empty() {
        let client = |c: &Client| {
            let [requests, exceptions, malformed] =
                [c.requests, c.exceptions, c.malformed].map(|n| n.to_string());
            [c.peer.clone(), age(c.age_ms), age(c.silent_ms), requests, exceptions, malformed]
        };
        let rows: Vec<_> = clients.iter().map(client).collect();
        let head = ["CLIENT", ">SINCE", ">SILENT", ">REQUESTS", ">EXCEPTIONS", ">MALFORMED"];
        text += &format!("\n{}", table(&head, &rows));
    }
    text
}

/// The owners of a device whose axes are not everybody's, and the commands it was given.
pub(super) fn commanded(device: &Device) -> String {
    let mut text = String::new();
    let owned = (1..).zip(&device.axes).filter(|(_, axis)| !matches!(axis.owner.as_str(), "" | "any"));
    for (number, axis) in owned {
        // Writing to a string does not fail.
        let _ = writeln!(text, "\n{}, axis {number}: commanded by {} alone", device.name, axis.owner);
    }
    if !device.commands.is_empty() {
        let _ = writeln!(text, "\n{}: last commands", device.name);
    }
    for Command { age_ms, who, object, value, count } in &device.commands {
        let _ = writeln!(text, "  {:>8} ago  {who}: {object} = {value:#X} ({count} times)", age(*age_ms));
    }
    text
}
