//! Which metrics there are. docs/operation.md lists them.

use super::page::Page;
use crate::status::{Axis, Device, Histograms, Modbus, Node, Status};

/// How late something may be done: half the period of the fastest raster that a motor of ours has.
const TOLERATED_US: u64 = 500;

/// The status as a page of metrics.
#[must_use]
pub fn text(status: &Status) -> String {
    let mut page = Page::default();
    page.gauge("axisd_info", "The daemon by its version; always 1.")
        .sample(&[("version", &status.version)], 1);
    page.gauge("axisd_uptime_seconds", "Time since the daemon was started.").sample(&[], status.uptime_s);
    core_loop(status, &mut page);
    if let Some(reload) = &status.reload {
        page.gauge("axisd_reload_refused", "Whether the last reload of the configuration was refused.")
            .sample(&[], u8::from(reload.is_refused()));
    }
    if let Some(lost) = status.lost_audit {
        page.counter("axisd_audit_lost_total", "Entries of the audit trail that were lost.")
            .sample(&[], lost);
    }
    buses(status, &mut page);
    devices(&status.devices, &mut page);
    nodes(&status.devices, &mut page);
    modbus_clients(&status.modbus, &mut page);
    page.into_text()
}

fn core_loop(status: &Status, page: &mut Page) {
    let Histograms { lateness, turns, pieces, .. } = &status.histograms;
    if let Some(turns) = turns {
        page.histogram("axisd_core_turn_seconds", "Work of the core thread from one sleep to the next.")
            .times(&[], turns);
    }
    if let Some(pieces) = pieces {
        page.histogram(
            "axisd_core_piece_seconds",
            "Work of the core thread from one look at frames and what is due to the next.",
        )
        .times(&[], pieces);
    }
    page.gauge("axisd_core_longest_piece_seconds", "The longest of these.")
        .sample(&[], seconds(status.longest_piece_us));
    page.gauge(
        "axisd_core_latest_wake_seconds",
        "How late the core thread woke up at most for what fell due while it slept.",
    )
    .sample(&[], seconds(status.latest_wake_us));
    page.histogram("axisd_core_lateness_seconds", "How late the core thread did what was due.")
        .times(&[], lateness);
    page.counter("axisd_core_overruns_total", "What was due and done more than half a millisecond late.")
        .sample(&[], lateness.count().saturating_sub(lateness.below_us(TOLERATED_US)));
    let mut queues =
        page.gauge("axisd_queue_length", "What waits for the core thread, or for others from it.");
    for (queue, length) in &status.queues {
        queues.sample(&[("queue", queue)], length);
    }
}

fn seconds(micros: u64) -> f64 {
    micros as f64 / 1e6
}

fn buses(status: &Status, page: &mut Page) {
    let buses = &status.buses;
    let mut states =
        page.gauge("axisd_bus_state", "State of the CAN controller, or why it is not there; always 1.");
    for bus in buses {
        states.sample(&[("bus", &bus.name), ("link", &bus.link), ("state", &bus.state)], 1);
    }
    let mut bits =
        page.gauge("axisd_bus_bits_per_second", "Bits on the bus in the last second, without stuff bits.");
    for bus in buses {
        bits.sample(&[("bus", &bus.name)], bus.bits_per_s);
    }
    let mut rates = page.gauge("axisd_bus_bit_rate", "Bit rate of the interface, if it tells one.");
    for (bus, rate) in buses.iter().filter_map(|bus| Some((bus, bus.bit_rate?))) {
        rates.sample(&[("bus", &bus.name)], rate);
    }
    let mut frames = page.counter("axisd_bus_frames_total", "Frames by what they are for.");
    for bus in buses {
        for (direction, kinds) in [("received", &bus.received_kinds), ("sent", &bus.sent_kinds)] {
            for (kind, count) in kinds {
                frames.sample(&[("bus", &bus.name), ("direction", direction), ("kind", kind)], count);
            }
        }
    }
    let mut errors = page.counter("axisd_bus_errors_total", "Frames that were lost, or that tell an error.");
    for bus in buses {
        let counts = [
            ("lost", bus.lost),
            ("unsent", bus.unsent),
            ("replaced", bus.replaced),
            ("error-frame", bus.errors),
        ];
        for (kind, count) in counts {
            errors.sample(&[("bus", &bus.name), ("kind", kind)], count);
        }
    }
    let mut waiting = page.gauge("axisd_bus_waiting_frames", "Frames that wait for room in the interface.");
    for bus in buses {
        waiting.sample(&[("bus", &bus.name)], bus.waiting);
    }
    let mut answers = page.histogram(
        "axisd_sdo_latency_seconds",
        "From the arrival of a request at the kernel until the answer of the default SDO server has left.",
    );
    for (bus, times) in &status.histograms.sdo {
        answers.times(&[("bus", bus)], times);
    }
}

fn devices(devices: &[Device], page: &mut Page) {
    let mut dropped = page.counter(
        "axisd_device_dropped_steps_total",
        "Raster steps lost because the device was served too late.",
    );
    for device in devices {
        dropped.sample(&[("device", &device.name)], device.dropped_steps);
    }
    let axes: Vec<(&str, String, &Axis)> = devices
        .iter()
        .flat_map(|device| {
            (1..).zip(&device.axes).map(|(number, axis)| (&*device.name, number.to_string(), axis))
        })
        .collect();
    let mut states = page.gauge("axisd_axis_state", "State and mode of the drive; always 1.");
    for (device, number, axis) in &axes {
        let labels = [("device", *device), ("axis", number), ("state", &axis.state), ("mode", &axis.mode)];
        states.sample(&labels, 1);
    }
    let mut positions = page.gauge("axisd_axis_position_counts", "Actual position.");
    for (device, number, axis) in &axes {
        positions.sample(&[("device", device), ("axis", number)], axis.position_counts);
    }
    let mut velocities = page.gauge("axisd_axis_velocity_counts_per_second", "Actual velocity.");
    for (device, number, axis) in &axes {
        velocities.sample(&[("device", device), ("axis", number)], axis.velocity_counts_s);
    }
    let mut faults =
        page.gauge("axisd_axis_fault_code", "Error code of the fault that stands; 0 without one.");
    for (device, number, axis) in &axes {
        let code = axis.fault.as_ref().map_or(0, |fault| fault.code);
        faults.sample(&[("device", device), ("axis", number)], code);
    }
}

fn nodes(devices: &[Device], page: &mut Page) {
    let nodes: Vec<(&str, String, &Node)> = devices
        .iter()
        .flat_map(|device| device.nodes.iter().map(|node| (&*device.name, node.node_id.to_string(), node)))
        .collect();
    let mut states = page.gauge("axisd_node_state", "NMT state; always 1.");
    for (device, node_id, node) in &nodes {
        let labels = [("device", *device), ("bus", &node.bus), ("node_id", node_id), ("state", &node.state)];
        states.sample(&labels, 1);
    }
    let mut frames = page.counter("axisd_node_frames_total", "Frames that a node heard or sent.");
    for (device, node_id, node) in &nodes {
        let traffic = node.traffic;
        for (kind, count) in [
            ("nmt", traffic.nmt),
            ("sync", traffic.syncs),
            ("sdo-request", traffic.sdo_requests),
            ("sdo-answer", traffic.sdo_answers),
            ("rpdo", traffic.rpdos),
            ("tpdo", traffic.tpdos),
            ("emcy-sent", node.emergencies.count),
            ("emcy-received", node.heard.count),
        ] {
            let labels = [("device", *device), ("bus", &node.bus), ("node_id", node_id), ("kind", kind)];
            frames.sample(&labels, count);
        }
    }
    let mut errors = page.counter("axisd_node_errors_total", "What a node refused or lost.");
    for (device, node_id, node) in &nodes {
        let counters = node.counters;
        for (kind, count) in [
            ("sdo-aborted", node.aborts.count),
            ("connection-lost", node.lost_connections.count),
            ("malformed", counters.malformed),
            ("rpdo-short", counters.short_rpdos),
            ("rpdo-long", counters.long_rpdos),
            ("rpdo-late", counters.late_rpdos),
            ("rpdo-refused", counters.refused_rpdos),
            ("frame-dropped", counters.dropped_frames),
            ("emcy-dropped", counters.dropped_emergencies),
            ("overflow", counters.overflows),
        ] {
            let labels = [("device", *device), ("bus", &node.bus), ("node_id", node_id), ("kind", kind)];
            errors.sample(&labels, count);
        }
    }
}

fn modbus_clients(modbus: &Modbus, page: &mut Page) {
    if modbus.listeners.is_empty() {
        return;
    }
    let there = || (0..).zip(&modbus.listeners).filter(|(_, listener)| !listener.addresses.is_empty());
    let listeners = || there().map(|(number, listener): (u32, _)| (number.to_string(), listener));
    let mut clients = page.gauge("axisd_modbus_clients", "Modbus clients that are connected.");
    for (number, listener) in listeners() {
        clients.sample(&[("listener", &number)], listener.clients);
    }
    let mut connections = page.counter("axisd_modbus_connections_total", "What became of Modbus clients.");
    for (number, listener) in listeners() {
        for (kind, count) in [
            ("accepted", listener.accepted),
            ("refused", listener.refused),
            ("replaced", listener.replaced),
            ("idle", listener.idle),
        ] {
            connections.sample(&[("listener", &number), ("kind", kind)], count);
        }
    }
    let mut requests = page.gauge(
        "axisd_modbus_client_requests",
        "Requests of the clients that are connected, by what came of them.",
    );
    for client in &modbus.clients {
        let listener = client.listener.to_string();
        for (kind, count) in
            [("answered", client.requests), ("exception", client.exceptions), ("malformed", client.malformed)]
        {
            requests.sample(&[("listener", &listener), ("client", &client.peer), ("kind", kind)], count);
        }
    }
}
