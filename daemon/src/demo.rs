//! What `axisd run --demo` says about itself.

use core::fmt::Write;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use config::Gateway;

/// What is served, and how to try it.
pub(crate) fn introduction(gateway: &Gateway) -> String {
    let mut text = String::new();
    for (number, bus) in gateway.buses.iter().enumerate() {
        let Some(address) = bus.socketcand else { continue };
        // A String takes whatever is written.
        let _ = writeln!(text, "Bus {}: virtual, by the socketcand protocol on {address}", bus.name);
        for device in &gateway.devices {
            for place in device.on.iter().filter(|place| place.bus == number) {
                let motor = device.profile.motor.as_ref().map(|motor| format!(", motor {}", motor.name));
                let (profile, motor) = (&device.profile.name, motor.unwrap_or_default());
                let _ = writeln!(text, "  node {}: {}, profile {profile}{motor}", place.node_id, device.name);
            }
        }
        text += &snippet(&bus.name, address);
    }
    text
}

/// Three lines of Python.
fn snippet(bus: &str, address: SocketAddr) -> String {
    let host = match address.ip() {
        ip if ip.is_unspecified() => IpAddr::V4(Ipv4Addr::LOCALHOST),
        ip => ip,
    };
    let port = address.port();
    format!(
        "
Try it in Python (pip install canopen python-can):

import canopen; network = canopen.Network()
network.connect(interface=\"socketcand\", host=\"{host}\", port={port}, channel=\"{bus}\")
print(network.add_node(1).sdo.upload(0x1008, 0).decode())

"
    )
}
