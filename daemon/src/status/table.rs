//! The status as a text for people.

use core::fmt::Write;

use canopen::{BusState, UNCONFIGURED};

use super::{Axis, Bus, Counters, Device, Event, Events, Fault, Lss, Node, Status, clients};

/// A table of the devices, one of the buses, and what went wrong, where anything did.
#[must_use]
pub fn text(status: &Status) -> String {
    let mut text = devices(status);
    text.push('\n');
    text += &buses(&status.buses);
    status.buses.iter().for_each(|bus| text += &(held_up(bus) + &restart(bus)));
    text += &clients::text(status);
    if let Some(reload) = &status.reload {
        let _ = write!(text, "\n{}", reload.text());
    }
    for device in &status.devices {
        for node in &device.nodes {
            text += &trouble(&device.name, node);
        }
        text += &broken(device);
        text += &clients::commanded(device);
        if device.dropped_steps > 0 {
            let _ = writeln!(
                text,
                "\n{}: served too late, {} raster steps dropped",
                device.name, device.dropped_steps
            );
        }
    }
    text
}

fn devices(status: &Status) -> String {
    const HEAD: [&str; 10] = [
        "DEVICE",
        "NODE",
        "NMT",
        "STATE",
        "MODE",
        ">POSITION",
        ">VELOCITY",
        "ERROR",
        "BUS STATE",
        ">BUS LOAD",
    ];
    let mut rows = Vec::new();
    for device in &status.devices {
        for number in 0..device.axes.len().max(device.nodes.len()).max(1) {
            rows.push(row(device, number, &status.buses));
        }
    }
    table(&HEAD, &rows)
}

/// The line of a device that has its axis and its node of this number.
fn row(device: &Device, number: usize, buses: &[Bus]) -> [String; 10] {
    let none = || "-".to_owned();
    let axis = device.axes.get(number);
    let node = device.nodes.get(number);
    let of_axis = |show: fn(&Axis) -> String| axis.map_or_else(none, show);
    let of_node = |show: fn(&Node) -> String| node.map_or_else(none, show);
    let bus = node.and_then(|node| buses.iter().find(|bus| bus.name == node.bus));
    [
        if number == 0 { device.name.clone() } else { String::new() },
        of_node(|node| match node.node_id {
            UNCONFIGURED => format!("{}/-", node.bus),
            node_id => format!("{}/{node_id}", node.bus),
        }),
        of_node(|node| node.state.clone()),
        of_axis(|axis| axis.state.clone()),
        of_axis(|axis| axis.mode.clone()),
        of_axis(|axis| format!("{:.0}", axis.position_counts)),
        of_axis(|axis| format!("{:.0}/s", axis.velocity_counts_s)),
        error(axis, node).map_or_else(none, shown),
        bus.map_or_else(none, |bus| bus.state.clone()),
        bus.map_or_else(none, load),
    ]
}

/// The error to show: that of the axis before one of the node.
fn error<'s>(axis: Option<&'s Axis>, node: Option<&'s Node>) -> Option<&'s Fault> {
    axis.and_then(|axis| axis.fault.as_ref()).or_else(|| node?.errors.first())
}

fn shown(Fault { code, text }: &Fault) -> String {
    format!("0x{code:04X} {text}")
}

fn buses(buses: &[Bus]) -> String {
    const HEAD: [&str; 9] = ["BUS", "LINK", "STATE", ">LOAD", ">IN", ">OUT", ">LOST", ">UNSENT", ">ERRORS"];
    let row = |bus: &Bus| {
        let Bus { name, link, state, received, sent, lost, unsent, errors, .. } = bus;
        let [received, sent, lost, unsent, errors] =
            [received, sent, lost, unsent, errors].map(ToString::to_string);
        [name.clone(), link.clone(), state.clone(), load(bus), received, sent, lost, unsent, errors]
    };
    table(&HEAD, &buses.iter().map(row).collect::<Vec<_>>())
}

/// What the interface of a bus has had no room for; nothing if it always had some.
fn held_up(bus: &Bus) -> String {
    if bus.waiting == 0 && bus.replaced == 0 {
        return String::new();
    }
    let Bus { name, waiting, replaced, .. } = bus;
    format!(
        "\n{name}: {waiting} frames wait for the interface, {replaced} PDOs and heartbeats were replaced by newer ones\n"
    )
}

/// Who ends the bus-off of an interface; nothing if there is none, or the interface does not tell.
fn restart(bus: &Bus) -> String {
    let Bus { name, link, restart_ms, .. } = bus;
    match restart_ms.filter(|_| bus.state == BusState::Off.name()) {
        None => String::new(),
        Some(0) => {
            let interface = link.rsplit(':').next().unwrap_or_default();
            format!("\n{name}: off until somebody does `ip link set {interface} type can restart`\n")
        }
        Some(millis) => format!("\n{name}: off, the interface restarts by itself after {millis} ms\n"),
    }
}

/// How busy a bus is: in percent of its bit rate where it has one.
fn load(bus: &Bus) -> String {
    match bus.bit_rate {
        Some(bit_rate @ 1..) => format!("{} %", 100 * bus.bits_per_s / u64::from(bit_rate)),
        Some(0) | None => format!("{:.1} kbit/s", bus.bits_per_s as f64 / 1000.0),
    }
}

/// What went wrong at a node; nothing if nothing did.
fn trouble(device: &str, node: &Node) -> String {
    let mut lines: Vec<String> = node.errors.iter().map(|error| format!("error: {}", shown(error))).collect();
    lines.extend(happened("EMCY sent", &node.emergencies, 4));
    lines.extend(happened("EMCY received", &node.heard, 4));
    lines.extend(happened("SDO aborted", &node.aborts, 8));
    lines.extend(happened("connection lost", &node.lost_connections, 0));
    lines.extend(node.lss.as_ref().map(stored_by_lss));
    let counted = counted(&node.counters);
    lines.extend(counted.into_iter().filter(|(count, _)| *count > 0).map(|(c, what)| format!("{what}: {c}")));
    if lines.is_empty() {
        return String::new();
    }
    let lines: String = lines.iter().map(|line| format!("  {line}\n")).collect();
    format!("\n{device}, node {} on {}:\n{lines}", node.node_id, node.bus)
}

fn stored_by_lss(lss: &Lss) -> String {
    let node_id = match lss.node_id {
        UNCONFIGURED => "no Node-ID".to_owned(),
        node_id => format!("Node-ID {node_id}"),
    };
    let rate = match lss.kbit_per_s {
        None => String::new(),
        Some(0) => ", automatic bit rate".to_owned(),
        Some(rate) => format!(", {rate} kbit/s"),
    };
    let conflict = if lss.conflicts { "; the configuration has another Node-ID, which holds" } else { "" };
    format!("stored by LSS: {node_id}{rate}{conflict}")
}

/// What is broken in the simulated plants of a device; nothing if nothing is.
fn broken(device: &Device) -> String {
    let axes = (1..).zip(&device.axes).filter(|(_, axis)| !axis.plant_faults.is_empty());
    let line = |(number, axis): (usize, &Axis)| {
        format!("\n{}, axis {number}: simulated faults: {}\n", device.name, axis.plant_faults.join(", "))
    };
    axes.map(line).collect()
}

fn counted(counters: &Counters) -> [(u64, &'static str); 8] {
    [
        (counters.short_rpdos, "RPDOs too short, not taken"),
        (counters.long_rpdos, "RPDOs too long, taken"),
        (counters.refused_rpdos, "RPDOs with a value that was refused"),
        (counters.late_rpdos, "RPDOs after the synchronous window"),
        (counters.overflows, "PDOs that could not wait to be processed"),
        (counters.malformed, "malformed frames"),
        (counters.dropped_frames, "frames that could not wait to be sent"),
        (counters.dropped_emergencies, "received EMCYs that could not wait"),
    ]
}

/// How often it happened, and the last times; codes have so many `digits`.
fn happened(what: &str, events: &Events, digits: usize) -> Vec<String> {
    if events.count == 0 {
        return Vec::new();
    }
    let line = |event: &Event| {
        let code = event.code.map(|code| format!("0x{code:0digits$X} ")).unwrap_or_default();
        let from = event.from.map(|from| format!("node {from}: ")).unwrap_or_default();
        let object = event.object.as_ref().map(|object| format!(", {object}")).unwrap_or_default();
        format!("  {:>8} ago  {from}{code}{}{object}", age(event.age_ms), event.text)
    };
    let head = format!("{what}: {}", events.count);
    core::iter::once(head).chain(events.last.iter().map(line)).collect()
}

/// A time as one number with its unit.
pub(super) fn age(millis: u64) -> String {
    const SECOND: u64 = 1000;
    const MINUTE: u64 = 60 * SECOND;
    const HOUR: u64 = 60 * MINUTE;
    const DAY: u64 = 24 * HOUR;
    match millis {
        ..SECOND => format!("{millis} ms"),
        SECOND..MINUTE => format!("{} s", millis / SECOND),
        MINUTE..HOUR => format!("{} min", millis / MINUTE),
        HOUR..DAY => format!("{} h", millis / HOUR),
        DAY.. => format!("{} d", millis / DAY),
    }
}

/// Lines of columns under their heads; a head that begins with `>` has its column on the right.
pub(crate) fn table<const COLUMNS: usize>(head: &[&str; COLUMNS], rows: &[[String; COLUMNS]]) -> String {
    let names = head.map(|name| name.trim_start_matches('>').to_owned());
    let mut widths = [0; COLUMNS];
    for row in core::iter::once(&names).chain(rows) {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = cell.chars().count().max(*width);
        }
    }
    let line = |row: &[String; COLUMNS]| {
        let cells = row.iter().zip(widths).zip(head).map(|((cell, width), name)| {
            if name.starts_with('>') { format!("{cell:>width$}") } else { format!("{cell:width$}") }
        });
        format!("{}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    core::iter::once(&names).chain(rows).map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_one_number() {
        let ages = [0, 999, 1000, 59_999, 60_000, 3_599_999, 3_600_000, 86_400_000].map(age);
        assert_eq!(ages, ["0 ms", "999 ms", "1 s", "59 s", "1 min", "59 min", "1 h", "1 d"]);
    }

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let rows = [["a", "1"], ["bcd", "23"]].map(|row| row.map(str::to_owned));
        assert_eq!(table(&["N", ">NUMBER"], &rows), "N    NUMBER\na         1\nbcd      23\n");
    }
}
