//! Metrics of a real interface.

use std::io::{Read, Write};
use std::net::TcpStream;

use tests::{Bus, Daemon, PATIENCE, Vcan, Wire, config, free_port};

#[test]
fn sdo_clients_are_timed_from_the_kernel_to_the_answer() {
    const REQUESTS: usize = 20;
    let (interface, port) = (Vcan::new(), free_port());
    let config = config(Bus::Interface(&interface), &[("x", "cia402-servo", 1)]);
    let mut wire = Wire::on(&interface);
    let _daemon = Daemon::start(&format!("[metrics]\nlisten = \"127.0.0.1:{port}\"\n{config}"));
    for _ in 0..REQUESTS {
        wire.send("601#4000100000000000");
        wire.expect("581#4300100092010200");
    }
    let mut stream = TcpStream::connect(("127.0.0.1", port)).expect("metrics are served");
    stream.set_read_timeout(Some(PATIENCE)).expect("set a time-out");
    stream.write_all(b"GET /metrics HTTP/1.0\r\n\r\n").expect("send a request");
    let mut page = String::new();
    stream.read_to_string(&mut page).expect("an answer");
    let value = |name: &str| -> f64 {
        let line = page
            .lines()
            .find_map(|line| line.strip_prefix(name))
            .unwrap_or_else(|| panic!("no {name}: {page}"));
        line.trim().parse().expect("a number")
    };
    let count = value("axisd_sdo_latency_seconds_count{bus=\"can0\"}");
    assert!((count - REQUESTS as f64).abs() < 0.5, "{count}");
    let sum = value("axisd_sdo_latency_seconds_sum{bus=\"can0\"}");
    assert!(sum > 0.0 && sum < PATIENCE.as_secs_f64(), "{sum}");
}
