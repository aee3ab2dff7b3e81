//! What the kernel keeps away from the daemon.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::time::Instant;

use tests::{Bus, Daemon, PATIENCE, TempDir, Vcan, Wire, config, free_port};

use crate::READ_DEVICE_TYPE;
use crate::watching::number;

const REFERENCE: &str = "canopen-reference";

#[test]
fn foreign_traffic_does_not_reach_a_node() {
    // Everything that node 2 and the one node here do not listen to.
    let foreign = (0x001..=0x7FF).filter(|id| ![0x080, 0x100, 0x7E5].contains(id) && id & 0x7F != 1);
    assert_kept_away(1, foreign);
}

#[test]
fn foreign_traffic_does_not_reach_as_many_nodes_as_there_are_ids() {
    // TPDOs and what else the nodes send themselves, NMT error control aside, which is a request when it is remote.
    let bases = [0x080, 0x180, 0x280, 0x380, 0x480, 0x580];
    assert_kept_away(127, bases.into_iter().flat_map(|base| base + 1..=base + 127));
}

#[test]
fn foreign_traffic_reaches_a_bus_with_a_gateway_only_while_that_has_clients() {
    let (interface, port) = (Vcan::new(), free_port());
    let config = config(Bus::Interface(&interface), &[("n1", REFERENCE, 1)]);
    let gateway = format!("[[bus]]\ngateway = \"127.0.0.1:{port}\"\n");
    let daemon = Daemon::start(&config.replacen("[[bus]]\n", &gateway, 1));
    let mut wire = Wire::on(&interface);
    let socket = daemon.socket();
    // Frames arrive in the order in which they were sent: whether the one before a request was received.
    let mut is_heard = || {
        let before = number(&socket, "received");
        wire.send("7E0#0102");
        let _ = wire.ask(READ_DEVICE_TYPE, "581");
        loop {
            match number(&socket, "received") - before {
                0 => {}
                received => return received == 2,
            }
        }
    };
    assert!(!is_heard(), "nobody is connected");
    let mut client = BufReader::new(TcpStream::connect(("127.0.0.1", port)).expect("it listens"));
    client.get_mut().write_all(b"[1] set node 1\n").expect("it takes lines");
    let mut answer = String::new();
    client.read_line(&mut answer).expect("it answers");
    assert_eq!(answer, "[1] OK\r\n");
    assert!(is_heard());
    drop(client);
    let deadline = Instant::now() + PATIENCE;
    while is_heard() {
        assert!(Instant::now() < deadline, "it is heard without clients");
    }
}

/// Of foreign data frames none, and of others all reach `nodes` nodes.
fn assert_kept_away(nodes: u8, foreign: impl Iterator<Item = u16>) {
    let (interface, dir) = (Vcan::new(), TempDir::new());
    let socket = dir.path().join("control.sock").display().to_string();
    let names: Vec<_> = (1..=nodes).map(|node| format!("n{node}")).collect();
    let devices: Vec<_> =
        names.iter().map(String::as_str).zip(1..).map(|(n, id)| (n, REFERENCE, id)).collect();
    let config = config(Bus::Interface(&interface), &devices);
    let _daemon = Daemon::start(&format!("[control]\nsocket = \"{socket}\"\n\n{config}"));
    let mut wire = Wire::on(&interface);
    let mut log = String::new();
    for id in foreign.map(|id| format!("{id:03X}")).chain((0..100).map(|id| format!("{:08X}", 0x601 + id))) {
        writeln!(log, "(0.000000) {} {id}#0102030405060708", interface.name()).expect("a string takes it");
    }
    let (log, before) = (dir.write("foreign.log", &log), number(&socket, "received"));

    wire.play(&log);

    // Frames arrive in the order in which they were sent.
    for _ in 0..2 {
        let _ = wire.ask(READ_DEVICE_TYPE, "581");
    }
    let deadline = Instant::now() + PATIENCE;
    while number(&socket, "received") < before + 2 {
        assert!(Instant::now() < deadline, "not even what is meant for a node is received");
    }
    assert_eq!(number(&socket, "received"), before + 2);
}
