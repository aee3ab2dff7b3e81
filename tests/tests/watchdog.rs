//! The service manager is told that axisd lives by the core loop, and by nothing else.

use std::time::{Duration, Instant};

use tests::{Bus, Client, Daemon, ServiceManager, config, free_port};

/// The core loop has half of it for each sign of life.
const WATCHDOG: Duration = Duration::from_secs(1);
/// A time after which any service manager has given up, and a slow machine has not.
const SILENCE: Duration = Duration::from_millis(2500);
const ALIVE: &str = "WATCHDOG=1";

fn daemon(manager: &ServiceManager) -> (Daemon, u16) {
    let port = free_port();
    let daemon = Daemon::supervised(&config(Bus::Socketcand(port), &[("axis1", "cia402-servo", 1)]), manager);
    manager.expect("READY=1");
    manager.expect(ALIVE);
    (daemon, port)
}

/// Whether the thread of the services answers, which has no part in the core loop.
fn services_answer(port: u16) {
    let mut client = Client::connect(port);
    client.expect("< hi >");
    client.send("< open can0 >");
    client.expect("< ok >");
}

#[test]
fn the_core_loop_gives_a_sign_of_life_in_each_half_of_the_interval() {
    let manager = ServiceManager::new(WATCHDOG);
    let (mut daemon, port) = daemon(&manager);

    let start = Instant::now();
    let mut load = Client::raw(port);
    for _ in 0..200 {
        load.try_ask("601 8 40 0 10 0 0 0 0 0").expect("the daemon answers");
    }
    let said = manager.listen(4 * WATCHDOG);

    let time = start.elapsed().as_secs_f64() / WATCHDOG.as_secs_f64();
    assert!(said.iter().all(|line| line == ALIVE), "{said:?}");
    let number = said.len() as f64;
    assert!((time - 1.0..=2.0 * time + 1.0).contains(&number), "{number} in {time:.1} intervals");

    daemon.terminate();
    manager.expect("STOPPING=1");
    daemon.wait_until_stopped();
}

#[test]
fn a_core_loop_that_stalls_is_silent_while_the_other_threads_live() {
    let manager = ServiceManager::new(WATCHDOG);
    let (daemon, port) = daemon(&manager);

    let stall = daemon.stall_core();
    // What was on its way.
    let _ = manager.listen(Duration::ZERO);
    services_answer(port);
    assert_eq!(manager.listen(SILENCE), [""; 0]);
    services_answer(port);

    drop(stall);
    manager.expect(ALIVE);
}

#[test]
fn a_process_that_is_stopped_is_silent() {
    let manager = ServiceManager::new(WATCHDOG);
    let (daemon, _) = daemon(&manager);

    daemon.pause();
    // The signal takes effect at its own time.
    let _ = manager.listen(WATCHDOG / 2);
    assert_eq!(manager.listen(SILENCE), [""; 0]);

    daemon.resume();
    manager.expect(ALIVE);
}

#[test]
fn a_service_manager_that_does_not_listen_holds_nobody_up() {
    const FEW: Duration = Duration::from_micros(200);
    let manager = ServiceManager::new(FEW);
    let (_daemon, port) = daemon(&manager);
    let mut client = Client::raw(port);

    // Its queue is full long before that.
    for _ in 0..2000 {
        let answer = client.try_ask("601 8 40 0 10 0 0 0 0 0").expect("the daemon answers");
        assert_eq!(answer, "581 4300100092010200");
    }
}
