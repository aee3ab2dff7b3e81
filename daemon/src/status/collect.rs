//! From the core to plain values.

use canopen::{Abort, Emergency, LssSetting, Recent, UNCONFIGURED};
use od::{Address, Instant};
use profiles::{AxisStatus, Dialect, error_text};

use super::{
    Axis, Bus, Counters, Device, Event, Events, Fault, Histograms, Lss, Node, Status, Traffic, clients,
};
use crate::core::{Core, LinkId};
use crate::core_loop::Times;
use crate::link::{Kinds, Link, SocketCan, in_order};
use crate::reload::Report;
use crate::reporter::Reporter;

/// What is around the core.
pub(crate) struct Around<'a> {
    pub(crate) links: &'a [Link],
    pub(crate) reporter: &'a Reporter,
    /// The addresses of each Modbus listener.
    pub(crate) listeners: &'a [Vec<String>],
    /// What the core loop has measured of itself.
    pub(crate) times: &'a Times,
    /// Frames of socketcand clients that wait for the core.
    pub(crate) waiting_clients: usize,
    /// Entries of the audit trail that were lost, if there is a trail.
    pub(crate) lost_audit: Option<u64>,
    /// What came of the last reload, if there was one.
    pub(crate) reload: Option<&'a Report>,
}

/// Everything, at `now`, with what was collected of the devices.
pub(crate) fn status(now: Instant, core: &Core, devices: Vec<Device>, around: &Around<'_>) -> Status {
    let Around { links, reporter, listeners, times, waiting_clients, lost_audit, reload } = *around;
    let Times { answers, lateness, turns, pieces, .. } = times;
    let counted = |(number, link)| counted(bus(now, number, link, core, reporter), link);
    let buses = in_order(links).map(counted).collect();
    let queues = core.queues().chain([("socketcand", waiting_clients)]);
    let sdo = |(_, link): (usize, &Link)| {
        let times = link.interface.as_ref().and_then(SocketCan::sdo_times)?;
        Some((link.name.clone(), times.clone()))
    };
    let histograms = Histograms {
        lateness: lateness.clone(),
        turns: turns.clone(),
        pieces: pieces.clone(),
        sdo: in_order(links).filter_map(sdo).collect(),
    };
    Status {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        uptime_s: now.saturating_since(Instant::ZERO).as_secs(),
        buses,
        devices,
        modbus: clients::collect(now, core, listeners),
        answers: answers.into(),
        lateness: lateness.into(),
        turns: turns.as_ref().map(Into::into).unwrap_or_default(),
        pieces: pieces.as_ref().map(Into::into).unwrap_or_default(),
        longest_piece_us: times.longest_piece_us(),
        latest_wake_us: times.latest_wake_us(),
        queues: queues.map(|(name, length)| (name.to_owned(), length as u64)).collect(),
        lost_audit,
        reload: reload.cloned(),
        histograms,
    }
}

/// The same bus with what its link has counted and timed.
fn counted(bus: Bus, link: &Link) -> Bus {
    let [received, sent] = link.kinds;
    let kinds = |kinds: Kinds| kinds.iter().map(|(kind, count)| (kind.to_owned(), count)).collect();
    Bus {
        waiting: link.interface.as_ref().map_or(0, |interface| interface.waiting().len() as u64),
        received_kinds: kinds(received),
        sent_kinds: kinds(sent),
        sdo_latency: link.interface.as_ref().and_then(SocketCan::sdo_times).map(Into::into),
        ..bus
    }
}

fn bus(now: Instant, number: usize, link: &Link, core: &Core, reporter: &Reporter) -> Bus {
    let dropped = core.dropped_on_wire(LinkId(number as u16));
    let (received, sent) = (link.received, link.sent);
    let name = link.name.clone();
    let Some(interface) = &link.interface else {
        let (link_text, state) = ("virtual".to_owned(), "virtual".to_owned());
        let bits_per_s = link.load.bits_per_second(now);
        return Bus {
            name,
            link: link_text,
            state,
            received,
            sent,
            lost: dropped,
            unsent: 0,
            errors: 0,
            bits_per_s,
            bit_rate: None,
            ..Bus::default()
        };
    };
    let (bits_per_s, bit_rate) = interface.gauge().read();
    let losses = interface.losses();
    let state = match interface.fd() {
        Some(_) => interface.state().name().to_owned(),
        None => reporter.trouble(number).unwrap_or("not open").to_owned(),
    };
    Bus {
        name,
        link: format!("socketcan:{}", interface.interface()),
        state,
        received,
        sent,
        lost: dropped + losses.malformed,
        unsent: interface.waiting().dropped(),
        replaced: interface.waiting().replaced(),
        errors: losses.errors,
        bits_per_s,
        bit_rate,
        restart_ms: interface.gauge().restart_ms(),
        ..Bus::default()
    }
}

/// The devices at `now`, with the names of the buses by their links.
pub fn devices<'n>(now: Instant, core: &Core, buses: impl Iterator<Item = &'n str>) -> Vec<Device> {
    let buses: Vec<&str> = buses.collect();
    core.names().filter_map(|(number, _)| device(now, core, number, &buses)).collect()
}

/// One of them, by its position.
pub(crate) fn device(now: Instant, core: &Core, number: usize, buses: &[&str]) -> Option<Device> {
    let (name, device) = (core.name(number)?, core.device(number)?);
    let dialect = device.profile().dialect;
    let axes = device.axes().enumerate().map(|(axis_number, status)| Axis {
        owner: clients::owner_name(core.owner(number, axis_number), buses),
        plant_faults: device.plant_faults(axis_number).map(|fault| fault.to_string()).collect(),
        ..axis(&status, dialect)
    });
    let nodes = core.nodes_of(number).map(|(LinkId(link), own)| {
        let bus = buses.get(usize::from(link)).copied().unwrap_or("?");
        node(now, bus, own, dialect)
    });
    Some(Device {
        name: name.to_string(),
        profile: device.profile().name.clone(),
        axes: axes.collect(),
        nodes: nodes.collect(),
        dropped_steps: device.dropped_steps(),
        commands: clients::commands(now, core, number, buses),
    })
}

fn axis(status: &AxisStatus, dialect: Dialect) -> Axis {
    Axis {
        state: status.state.name().to_owned(),
        mode: status.mode.name().to_owned(),
        statusword: status.statusword.bits(),
        position_counts: status.position.0,
        velocity_counts_s: status.velocity.0,
        fault: status.fault.map(|fault| self::fault(fault.code, dialect)),
        owner: String::new(),
        plant_faults: Vec::new(),
    }
}

fn fault(code: u16, dialect: Dialect) -> Fault {
    Fault { code, text: error_text(code, dialect).to_owned() }
}

fn node(now: Instant, bus: &str, node: &canopen::Node, dialect: Dialect) -> Node {
    let diagnostics = node.diagnostics();
    let told = |emergency: Emergency, dialect, from| Event {
        code: Some(u32::from(emergency.code)),
        text: error_text(emergency.code, dialect).to_owned(),
        from,
        ..Event::default()
    };
    Node {
        bus: bus.to_owned(),
        node_id: node.node_id(),
        lss: lss(node),
        state: node.state().name().to_owned(),
        errors: node.errors().iter().map(|error| fault(error.code, dialect)).collect(),
        emergencies: events(now, &diagnostics.sent, |emergency| told(emergency, dialect, None)),
        // Whatever the other node is: it is the standard that both share.
        heard: events(now, &diagnostics.heard, |(from, emergency)| {
            told(emergency, Dialect::Cia402, Some(from))
        }),
        aborts: events(now, &diagnostics.aborts, abort),
        lost_connections: events(now, &diagnostics.lost, |cause| Event {
            text: cause.to_string(),
            ..Event::default()
        }),
        counters: counters(node.counters()),
        traffic: traffic(node.traffic()),
    }
}

fn lss(node: &canopen::Node) -> Option<Lss> {
    let stored = node.lss_stored();
    (stored != LssSetting::default()).then(|| Lss {
        node_id: stored.node_id,
        kbit_per_s: stored.kbit_per_s(),
        conflicts: node.has_fixed_id() && stored.node_id != UNCONFIGURED && stored.node_id != node.node_id(),
    })
}

fn abort(Abort { address: Address { index, sub }, code }: Abort) -> Event {
    Event {
        code: Some(code.code()),
        text: code.text().to_owned(),
        object: Some(format!("0x{index:04X}:{sub:02X}")),
        ..Event::default()
    }
}

fn events<T: Copy>(now: Instant, recent: &Recent<T>, tell: impl Fn(T) -> Event) -> Events {
    let aged = |(at, what): (Instant, T)| {
        let age = now.saturating_since(at).as_millis();
        Event { age_ms: u64::try_from(age).unwrap_or(u64::MAX), ..tell(what) }
    };
    Events { count: recent.count(), last: recent.iter().map(aged).collect() }
}

fn traffic(traffic: canopen::Traffic) -> Traffic {
    let canopen::Traffic { nmt, syncs, sdo_requests, sdo_answers, rpdos, tpdos } = traffic;
    Traffic { nmt, syncs, sdo_requests, sdo_answers, rpdos, tpdos }
}

fn counters(counters: canopen::Counters) -> Counters {
    let canopen::Counters {
        malformed,
        late_rpdos,
        refused_rpdos,
        short_rpdos,
        long_rpdos,
        overflows,
        dropped,
        dropped_events,
    } = counters;
    Counters {
        malformed,
        short_rpdos,
        long_rpdos,
        late_rpdos,
        refused_rpdos,
        overflows,
        dropped_frames: dropped,
        dropped_emergencies: dropped_events,
    }
}
