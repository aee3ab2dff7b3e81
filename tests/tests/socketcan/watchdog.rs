//! The watchdog of a core loop that sleeps in the receiving system call of its only interface.

use std::time::{Duration, Instant};

use tests::{Bus, Daemon, ServiceManager, Vcan, Wire, config};

/// So long that a sleep there, of half a second at most, may delay a sign of life.
const WATCHDOG: Duration = Duration::from_secs(6);

#[test]
fn a_sleep_in_the_receiving_system_call_ends_in_time_for_the_watchdog() {
    let (interface, manager) = (Vcan::new(), ServiceManager::new(WATCHDOG));
    let config = config(Bus::Interface(&interface), &[("axis1", "cia402-servo", 1)]);
    let mut daemon = Daemon::supervised(&config, &manager);
    manager.expect("READY=1");
    manager.expect("WATCHDOG=1");
    let mut wire = Wire::on(&interface);
    assert_eq!(wire.ask("601#4000100000000000", "581"), "581#4300100092010200");

    for _ in 0..2 {
        let start = Instant::now();
        manager.expect("WATCHDOG=1");
        assert!(start.elapsed() < WATCHDOG, "after {:?}", start.elapsed());
    }
    daemon.terminate();
    manager.expect("STOPPING=1");
    daemon.wait_until_stopped();
}
