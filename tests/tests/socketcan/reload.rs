//! The configuration is reloaded while an interface of the kernel has traffic.

use std::process::Command;
use std::time::Instant;

use tests::{Bus, Daemon, PATIENCE, TempDir, Vcan, Wire, axisctl, config};

use crate::watching::number;
use crate::{DEVICE_TYPE, PROFILE, READ_DEVICE_TYPE};

/// Reloads this configuration, which is taken.
fn take(daemon: &Daemon, config: &str) {
    daemon.configure(config);
    let output = axisctl(&["--socket", &daemon.socket(), "reload"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn count(log: &[String], frame: &str) -> usize {
    log.iter().filter(|seen| *seen == frame).count()
}

#[test]
fn filters_of_the_kernel_follow_a_reload_and_no_request_is_lost_meanwhile() {
    const ROUNDS: usize = 3;
    const REQUESTS: usize = 200;
    let (interface, dir) = (Vcan::new(), TempDir::new());
    let with = |devices: &[(&str, &str, u8)]| {
        config(Bus::Interface(&interface), &[&[("x", PROFILE, 1)], devices].concat())
    };
    // A request each millisecond.
    let request =
        |n: usize| format!("({}.{:03}000) {} {READ_DEVICE_TYPE}\n", n / 1000, n % 1000, interface.name());
    let log = dir.write("requests.log", &(0..REQUESTS).map(request).collect::<String>());
    let daemon = Daemon::start(&with(&[]));
    let mut wire = Wire::on(&interface);
    wire.ask_until(READ_DEVICE_TYPE, DEVICE_TYPE);
    for _ in 0..ROUNDS {
        let mut requests = Command::new("canplayer").arg("-I").arg(&log).spawn().expect("run canplayer");
        take(&daemon, &with(&[("y", "cia402-servo", 2)]));
        take(&daemon, &with(&[]));
        assert!(requests.wait().expect("it ends").success());
    }
    let (mut seen, deadline) = (wire.take(), Instant::now() + PATIENCE);
    while count(&seen, DEVICE_TYPE) < count(&seen, READ_DEVICE_TYPE) {
        assert!(Instant::now() < deadline, "{} answers", count(&seen, DEVICE_TYPE));
        seen.extend(wire.take());
    }
    assert_eq!(count(&seen, DEVICE_TYPE), count(&seen, READ_DEVICE_TYPE));
    assert!(count(&seen, READ_DEVICE_TYPE) > ROUNDS * REQUESTS);
    assert_eq!((count(&seen, "702#00"), count(&seen, "701#00")), (ROUNDS, 0));

    // What nobody of ours listens to any more does not even reach the daemon.
    let before = number(&daemon.socket(), "received");
    wire.send("602#4000100000000000");
    assert_eq!(wire.ask(READ_DEVICE_TYPE, "581"), DEVICE_TYPE);
    assert_eq!(number(&daemon.socket(), "received"), before + 1);
}
