//! The life of the service: it starts, is killed, hangs, comes back and ends.

use std::fs;
use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use tests::parameters::{PARAMETERS, read, save, store_until_gone, write};
use tests::system::{Service, System, run};
use tests::{Client, PATIENCE, free_port};

const POLL_PERIOD: Duration = Duration::from_millis(5);
/// Shorter than that of the service; a busy machine counts.
const WATCHDOG: &str = "WatchdogSec=3";

/// Two buses behind one port: devices on the one store, those on the other are read.
fn config(port: u16) -> String {
    let mut text = String::new();
    for bus in ["can0", "can1"] {
        text +=
            &format!("[[bus]]\nname = \"{bus}\"\nlink = \"virtual\"\nsocketcand = \"127.0.0.1:{port}\"\n");
        text += &format!(
            "[[device]]\nname = \"{bus}-axis\"\nprofile = \"cia402-servo\"\nbus = \"{bus}\"\nnode_id = 1\n"
        );
    }
    text
}

#[test]
fn it_starts_serves_and_ends_with_status_0() {
    let system = System::installed();
    let port = free_port();
    let service = system.service(Some(&config(port)));
    run("systemctl", &["enable", "--now", "axisd.service"]);
    assert_eq!([service.show("ActiveState"), service.show("UnitFileState")], ["active", "enabled"]);
    assert!(run("axisctl", &["status"]).contains("can0-axis"));

    service.stop();

    assert_eq!([service.show("Result"), service.show("ExecMainStatus")], ["success", "0"]);
    assert!(service.journal().contains("stopped"));
    assert!(!fs::exists("/run/axisd/control.sock").expect("the directory can be read"));
}

/// Reads one object of the device on `can1` again and again until the daemon is gone; says when it has begun.
fn read_until_gone(port: u16, has_begun: &Sender<()>) {
    let mut client = Client::raw_on("can1", port);
    while let Ok(answer) = client.try_ask("601 8 40 0 10 0 0 0 0 0") {
        assert_eq!(answer, "581 4300100092010200");
        // The other end listens to the first one only.
        let _ = has_begun.send(());
    }
}

/// When the device on `can0` has last stored.
fn stored() -> SystemTime {
    let file = fs::metadata("/var/lib/axisd/can0-axis.parameters").expect("it has stored before");
    file.modified().expect("files have times")
}

#[test]
fn killed_under_load_it_comes_back_with_whole_parameters() {
    const KILLS: usize = 5;
    let system = System::installed();
    let port = free_port();
    let service = system.service(Some(&config(port)));
    service.start();
    let mut generation = 1;
    let mut client = Client::raw(port);
    PARAMETERS.iter().try_for_each(|address| write(&mut client, *address, generation)).expect("it is there");
    save(&mut client).expect("it is there");
    for kill in 1..=KILLS {
        let mut client = Client::raw(port);
        let storing = thread::spawn(move || store_until_gone(&mut client, generation));
        let (has_begun, begin) = channel();
        let reading = thread::spawn(move || read_until_gone(port, &has_begun));
        begin.recv_timeout(PATIENCE).expect("it answers");
        let (before, deadline) = (stored(), Instant::now() + PATIENCE);
        while stored() == before {
            assert!(Instant::now() < deadline, "nothing is stored");
            thread::sleep(POLL_PERIOD);
        }

        service.kill("KILL");

        let confirmed = storing.join().expect("only good answers");
        reading.join().expect("only good answers");
        service.wait_until("NRestarts", &kill.to_string());
        service.wait_until("ActiveState", "active");
        let mut client = Client::raw(port);
        let set = PARAMETERS.map(|address| read(&mut client, address));
        assert_eq!(set, [set[0]; PARAMETERS.len()], "kill {kill}: half a set");
        assert!(
            [confirmed, confirmed + 1].contains(&set[0]),
            "kill {kill}: {confirmed} was confirmed, not {set:?}"
        );
        generation = set[0];
    }
    assert!(generation > 1, "nothing was stored under load");
}

#[test]
fn a_core_loop_that_hangs_is_ended_and_started_again() {
    let system = System::installed();
    let port = free_port();
    let service = system.service(Some(&config(port))).with(WATCHDOG);
    service.start();

    let stall = service.stall_core();
    // The other threads have no part in it.
    Client::connect(port).expect("< hi >");
    // The dead thread is its debugger's until that lets go.
    service.wait_until("ActiveState", "deactivating");
    drop(stall);

    service.wait_until("NRestarts", "1");
    service.wait_until("ActiveState", "active");
    let mut client = Client::raw(port);
    assert_eq!(client.try_ask("601 8 40 0 10 0 0 0 0 0").expect("it is back"), "581 4300100092010200");
    assert!(service.journal().contains("Watchdog timeout"), "{}", service.journal());
}

#[test]
fn a_daemon_that_is_stopped_is_ended_and_started_again() {
    let system = System::installed();
    let service = system.service(Some(&config(free_port()))).with(WATCHDOG);
    service.start();

    service.kill("STOP");

    service.wait_until("NRestarts", "1");
    service.wait_until("ActiveState", "active");
    assert!(service.journal().contains("Watchdog timeout"), "{}", service.journal());
}

#[test]
fn instances_have_configuration_state_and_socket_of_their_own() {
    let system = System::installed();
    let ports = [free_port(), free_port()];
    let main = system.service(None);
    let instance =
        |name: &str, port| system.instance(name, &config(port).replace("-axis", &format!("-{name}")));
    let (left, right) = (instance("left", ports[0]), instance("right", ports[1]));
    [&main, &left, &right].into_iter().for_each(Service::start);

    let mut client = Client::raw(ports[0]);
    write(&mut client, PARAMETERS[0], 7).expect("it is there");
    save(&mut client).expect("it is there");

    assert!(fs::exists("/var/lib/axisd/left/can0-left.parameters").expect("root may look"));
    assert!(!fs::exists("/var/lib/axisd/right/can0-right.parameters").expect("root may look"));
    let status = |more: &[&str]| run("axisctl", &[&["status"], more].concat());
    assert!(status(&["--instance", "left"]).contains("can0-left"));
    assert!(status(&["--instance=right"]).contains("can1-right"));
    assert!(status(&[]).contains("axis1"));

    main.stop();
    assert!(status(&["--instance", "left"]).contains("can0-left"), "the socket is still there");
    left.stop();
    left.start();
    assert_eq!(read(&mut Client::raw(ports[0]), PARAMETERS[0]), 7);
}

#[test]
fn a_reload_takes_a_good_file_and_refuses_a_wrong_one() {
    let system = System::installed();
    let port = free_port();
    let service = system.service(Some(&config(port)));
    service.start();
    let pid = service.pid();
    let more = "[[device]]\nname = \"new\"\nprofile = \"cia402-servo\"\nbus = \"can0\"\nnode_id = 9\n";
    service.configure(&format!("{}{more}", config(port)));

    service.reload();

    let deadline = Instant::now() + PATIENCE;
    while !run("axisctl", &["status"]).contains("new ") {
        assert!(Instant::now() < deadline, "{}", service.journal());
        thread::sleep(POLL_PERIOD);
    }
    service.wait_until("ActiveState", "active");
    let mut client = Client::raw(port);
    assert_eq!(client.try_ask("609 8 40 0 10 0 0 0 0 0").expect("it is there"), "589 4300100092010200");
    assert!(service.journal().contains("reload: devices added: new"), "{}", service.journal());

    service.configure(&config(port).replace("node_id = 1", "node_id = 200"));
    service.fail_to_reload();

    let journal = service.journal();
    assert!(journal.contains("/etc/axisd/axisd.toml:9:1: error: 200 is no Node-ID"), "{journal}");
    assert_eq!([service.show("ActiveState"), service.show("NRestarts")], ["active", "0"]);
    assert_eq!(service.pid(), pid);
    assert_eq!(client.try_ask("609 8 40 0 10 0 0 0 0 0").expect("it is there"), "589 4300100092010200");
}

#[test]
fn a_wrong_configuration_is_told_and_not_tried_again() {
    let system = System::installed();
    let wrong = system.service(Some("[[bus]]\nname = \"can0\"\nlink = \"socketcan\"\n"));
    wrong.fail_to_start();
    assert_eq!([wrong.show("ExecMainStatus"), wrong.show("NRestarts")], ["78", "0"]);
    assert_eq!(wrong.show("ActiveState"), "failed");
    let journal = wrong.journal();
    assert!(journal.contains("/etc/axisd/axisd.toml:3:8: error: `socketcan` is no link"), "{journal}");

    let missing = system.instance("missing", "");
    fs::remove_file("/etc/axisd/missing.toml").expect("it was there");
    missing.fail_to_start();
    assert_eq!([missing.show("ExecMainStatus"), missing.show("ActiveState")], ["78", "failed"]);
    assert!(missing.journal().contains("/etc/axisd/missing.toml:1:1: error: No such file"));
}
