//! Turns an axis and reads one of its objects by SDO, again and again: `sdo_load PORT SECONDS`, on a socketcand bus `can0`
//! with a `cia402-servo` as node 1.

use std::error::Error;
use std::time::{Duration, Instant};

use tests::Client;

const OBJECTS: [&str; 8] = [
    "8 2F 60 60 0 3 0 0 0",
    "8 23 FF 60 0 0 20 0 0",
    "8 2B 40 60 0 6 0 0 0",
    "8 2B 40 60 0 7 0 0 0",
    "8 2B 40 60 0 F 0 0 0",
    "8 23 FF 60 0 0 40 0 0",
    "8 23 83 60 0 0 0 1 0",
    "8 23 FF 60 0 0 30 0 0",
];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [port, seconds] = &arguments[..] else { return Err("usage: sdo_load PORT SECONDS".into()) };
    let mut client = Client::raw(port.parse()?);
    for object in OBJECTS {
        client.send(&format!("< send 601 {object} >"));
        answered(&mut client);
        std::thread::sleep(Duration::from_millis(100));
    }
    let end = Instant::now() + Duration::from_secs_f64(seconds.parse()?);
    let mut count = 0_u64;
    while Instant::now() < end {
        client.send("< send 601 8 40 64 60 0 0 0 0 0 >");
        answered(&mut client);
        count += 1;
        // A master with a cycle of its own.
        std::thread::sleep(Duration::from_micros(500));
    }
    println!("{count} SDOs");
    Ok(())
}

/// Waits for an answer of the SDO server.
fn answered(client: &mut Client) {
    while !client.frame().starts_with("581") {}
}
