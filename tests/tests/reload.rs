//! The configuration is reloaded while the daemon runs, by SIGHUP and by `axisctl reload`.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread;

use tests::{Bus, Client, Daemon, PATIENCE, ServiceManager, axisctl, config, free_port};

const READ_DEVICE_TYPE: &str = "8 40 0 10 0 0 0 0 0";

/// Runs `axisctl reload` with these arguments: its exit status and all that it says.
fn reload(daemon: &Daemon, arguments: &[&str]) -> (Option<i32>, String) {
    let socket = daemon.socket();
    let output = axisctl(&[&["--socket", &socket, "reload"], arguments].concat());
    (output.status.code(), String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned())
}

fn status(daemon: &Daemon) -> String {
    let output = axisctl(&["--socket", &daemon.socket(), "status"]);
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Reloads this configuration, which is taken; what is told.
fn take(daemon: &Daemon, config: &str) -> String {
    daemon.configure(config);
    let (code, told) = reload(daemon, &[]);
    assert_eq!(code, Some(0), "{told}");
    told
}

/// The next frame that begins with this; others of other devices are passed over.
fn next(client: &mut Client, beginning: &str) -> String {
    loop {
        let frame = client.frame();
        if frame.starts_with(beginning) {
            return frame;
        }
    }
}

fn ask(client: &mut Client, node: u8, request: &str) -> String {
    client.send(&format!("< send {:X} {request} >", 0x600 + u16::from(node)));
    next(client, &format!("{:X} ", 0x580 + u16::from(node)))
}

/// Asks node 1 and lets it sample by SYNC, round after round, until told to end. Each request is answered, and to each SYNC
/// there is one TPDO.
fn traffic(port: u16, is_over: &AtomicBool, rounds: &AtomicU32) {
    let mut client = Client::raw(port);
    // TPDO 1 at each SYNC.
    assert!(ask(&mut client, 1, "8 2F 0 18 2 1 0 0 0").starts_with("581 60"));
    client.send("< send 0 2 1 1 >");
    while !is_over.load(Ordering::Relaxed) {
        client.send("< send 80 0 >");
        client.send(&format!("< send 601 {READ_DEVICE_TYPE} >"));
        let mut tpdos = 0;
        loop {
            let frame = client.frame();
            if frame.starts_with("181 ") {
                tpdos += 1;
            }
            assert!(!frame.starts_with("701"), "it has booted again: {frame}");
            if frame.starts_with("581 ") {
                assert_eq!(frame, "581 4300100092010200");
                break;
            }
        }
        let round = rounds.fetch_add(1, Ordering::Relaxed);
        assert_eq!(tpdos, 1, "round {round}");
    }
}

#[test]
fn under_traffic_no_frame_of_an_untouched_device_is_lost() {
    let port = free_port();
    let with = |devices: &[(&str, &str, u8)]| {
        config(Bus::Socketcand(port), &[&[("x", "cia402-servo", 1)], devices].concat())
    };
    let daemon = Daemon::start(&with(&[]));
    let shared = Arc::new((AtomicBool::new(false), AtomicU32::new(0)));
    let own = Arc::clone(&shared);
    let traffic = thread::spawn(move || traffic(port, &own.0, &own.1));
    let (is_over, rounds) = &*shared;
    // There is traffic between two reloads, too, however slow the machine is.
    let go_on = || {
        let before = rounds.load(Ordering::Relaxed);
        while rounds.load(Ordering::Relaxed) < before + 2 && !traffic.is_finished() {
            thread::yield_now();
        }
    };
    let mut client = Client::raw(port);
    for _ in 0..5 {
        go_on();
        let told = take(&daemon, &with(&[("y", "jvl-mac00-fc4", 2)]));
        assert!(told.ends_with(":\n  devices added: y\n"), "{told}");
        assert_eq!(next(&mut client, "702 "), "702 00");
        assert!(ask(&mut client, 2, READ_DEVICE_TYPE).starts_with("582 43"));

        go_on();
        let told = take(&daemon, &with(&[("y", "jvl-mac00-fc4", 3)]));
        assert!(told.ends_with(":\n  devices changed: y\n"), "{told}");
        assert_eq!(next(&mut client, "703 "), "703 00");
        assert!(ask(&mut client, 3, READ_DEVICE_TYPE).starts_with("583 43"));

        go_on();
        assert!(take(&daemon, &with(&[])).ends_with(":\n  devices removed: y\n"));
    }
    assert!(!status(&daemon).contains("\ny "), "{}", status(&daemon));
    is_over.store(true, Ordering::Relaxed);
    traffic.join().expect("no frame is lost");
    assert!(rounds.load(Ordering::Relaxed) >= 30);
}

#[test]
fn a_bad_file_changes_nothing_and_is_told_with_line_and_column() {
    let port = free_port();
    let good = config(Bus::Socketcand(port), &[("x", "cia402-servo", 1)]);
    let manager = ServiceManager::new(PATIENCE);
    let mut daemon = Daemon::supervised(&good, &manager);
    manager.expect("READY=1");
    daemon.configure(&good.replace("node_id = 1", "node_id = 200"));

    daemon.hang_up();

    manager.expect("RELOADING=1");
    manager.expect("READY=1");
    daemon.logged("reload: refused, nothing has changed");
    daemon.logged("axisd.toml:10:1: error: 200 is no Node-ID");
    let told = status(&daemon);
    assert!(
        told.contains("refused, nothing has changed\n") && told.contains("axisd.toml:10:1: error: "),
        "{told}"
    );
    assert!(ask(&mut Client::raw(port), 1, READ_DEVICE_TYPE).starts_with("581 43"));
    let (code, told) = reload(&daemon, &["--json"]);
    assert_eq!(code, Some(78));
    assert!(told.contains(r#""errors":["/"#) && told.contains("axisd.toml:10:1: error: "), "{told}");

    // A port that is taken is found before anything changes, too.
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("bind to any port");
    let address = taken.local_addr().expect("it has one");
    daemon.configure(&format!("[modbus]\nlisten = \"{address}\"\n{good}"));
    let (code, told) = reload(&daemon, &[]);
    assert_eq!(code, Some(78));
    assert!(told.contains(&format!("cannot serve Modbus on {address}")), "{told}");

    assert!(take(&daemon, &good).contains("nothing has changed"));
    assert!(!status(&daemon).contains("refused"));
}

#[test]
fn what_needs_a_restart_is_told_and_the_rest_is_taken() {
    let port = free_port();
    let old = config(Bus::Socketcand(port), &[("x", "cia402-servo", 1)]);
    let mut daemon = Daemon::start(&old);

    let told = take(&daemon, &format!("[log]\nlevel = \"warn\"\n[realtime]\npriority = 5\n{old}"));

    assert!(told.ends_with(":\n  taken: log\n  needs a restart: realtime\n"), "{told}");
    daemon.logged("reload: needs a restart: realtime");
    let output = axisctl(&["--socket", &daemon.socket(), "log", "--json"]);
    assert_eq!(String::from_utf8_lossy(&output.stdout).matches("\"warn\"").count(), 6);
}

#[test]
fn buses_come_and_go_with_their_clients_and_the_others_stay_connected() {
    let port = free_port();
    let one = config(Bus::Socketcand(port), &[("x", "cia402-servo", 1)]);
    let more = config(Bus::Socketcand(port), &[("y", "cia402-servo", 1)]).replace("can0", "can1");
    let daemon = Daemon::start(&one);
    let mut first = Client::raw(port);

    let told = take(&daemon, &format!("{more}{one}"));

    assert!(told.contains("buses added: can1\n  devices added: y\n  taken: socketcand\n"), "{told}");
    let status = status(&daemon);
    let listed = status.lines().filter_map(|line| line.split(' ').next());
    let listed: Vec<_> = listed.filter(|name| ["x", "y", "can0", "can1"].contains(name)).collect();
    assert_eq!(listed, ["y", "x", "can1", "can0"], "as in the file: {status}");
    let mut second = Client::raw_on("can1", port);
    assert!(ask(&mut second, 1, READ_DEVICE_TYPE).starts_with("581 43"));
    assert!(take(&daemon, &one).contains("buses removed: can1\n  devices removed: y\n"));
    assert!(second.try_ask("80 0").is_err(), "its bus has gone");
    assert!(ask(&mut first, 1, READ_DEVICE_TYPE).starts_with("581 43"));

    // Another port for the same bus: its devices notice nothing.
    let other = free_port();
    let told = take(&daemon, &one.replace(&port.to_string(), &other.to_string()));
    assert!(told.ends_with(":\n  taken: socketcand\n"), "{told}");
    assert!(first.try_ask("80 0").is_err(), "its port is closed");
    assert!(ask(&mut Client::raw(other), 1, READ_DEVICE_TYPE).starts_with("581 43"));
}

/// Reads the first two holding registers of unit 1; `None` once the connection is closed.
fn registers(stream: &mut TcpStream) -> Option<[u8; 4]> {
    stream.write_all(&[0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 2]).ok()?;
    let mut answer = [0; 13];
    stream.read_exact(&mut answer).ok()?;
    let [.., 3, 4, a, b, c, d] = answer else { panic!("{answer:?}") };
    Some([a, b, c, d])
}

#[test]
fn modbus_listeners_come_change_and_go() {
    let (port, bus) = (free_port(), free_port());
    let plain = config(Bus::Socketcand(bus), &[("x", "jvl-mac00-fc4", 1)]);
    let with = |keys: &str| format!("[modbus]\nlisten = \"127.0.0.1:{port}\"\n{keys}{plain}");
    let connect = |port: u16| {
        let stream = TcpStream::connect(("127.0.0.1", port)).expect("it listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("set a time-out");
        stream
    };
    let daemon = Daemon::start(&plain);
    assert!(TcpStream::connect(("127.0.0.1", port)).is_err());

    let told = take(&daemon, &with(""));

    assert!(told.ends_with(":\n  devices adjusted: x\n  taken: modbus\n"), "{told}");
    let mut client = connect(port);
    assert!(registers(&mut client).is_some());
    take(&daemon, &with("max_clients = 7\n"));
    assert!(registers(&mut client).is_some(), "it stays connected");
    // The device behind its unit is another one now.
    take(&daemon, &with("").replace("node_id = 1", "node_id = 1\nsdo_timeout_ms = 500"));
    assert!(registers(&mut client).is_some());
    take(&daemon, &with("allow = \"10.0.0.0/8\"\n"));
    assert!(registers(&mut client).is_none(), "it may not connect any more");
    // A device with a port of its own leaves: so do the port and who is connected to it, and nobody else.
    let own = free_port();
    let both = config(Bus::Socketcand(bus), &[("x", "jvl-mac00-fc4", 1), ("y", "jvl-mac00-fc4", 2)]);
    let both = both + &format!("[device.modbus]\nlisten = \"127.0.0.1:{own}\"\n");
    take(&daemon, &with("").replace(&plain, &both));
    let (mut client, mut own_client) = (connect(port), connect(own));
    assert!(registers(&mut client).is_some() && registers(&mut own_client).is_some());
    let told = take(&daemon, &with(""));
    assert!(told.contains("devices removed: y\n"), "{told}");
    assert!(registers(&mut own_client).is_none(), "the connection is closed");
    assert!(TcpStream::connect(("127.0.0.1", own)).is_err());
    assert!(registers(&mut client).is_some(), "it stays connected");
    // It comes back, and so does its port.
    take(&daemon, &with("").replace(&plain, &both));
    assert!(registers(&mut connect(own)).is_some() && registers(&mut client).is_some());
    take(&daemon, &plain);
    assert!(registers(&mut client).is_none());
    assert!([port, own].iter().all(|port| TcpStream::connect(("127.0.0.1", *port)).is_err()));
}

/// Reads an object of at most four bytes.
fn read(client: &mut Client, node: u8, object: &str) -> i64 {
    let answer = ask(client, node, &format!("8 40 {object} 0 0 0 0"));
    let bytes = u32::from_str_radix(&answer[12..20], 16).expect("hexadecimal");
    i64::from(bytes.swap_bytes() as i32)
}

#[test]
fn a_moving_axis_that_leaves_comes_to_rest_first_even_if_the_daemon_is_to_end() {
    let port = free_port();
    let with = |devices: &[(&str, &str, u8)]| config(Bus::Socketcand(port), devices);
    let (x, y) = (("x", "cia402-servo", 1), ("y", "cia402-servo", 2));
    let mut daemon = Daemon::start(&with(&[x, y]));
    let mut client = Client::raw(port);
    let mut write = |data: &str| {
        let answer = ask(&mut client, 2, &format!("8 {data}"));
        assert!(answer.starts_with("582 60"), "{data}: {answer}");
    };
    // Profile velocity, and a second to rest by the ramp of the quick stop.
    ["2F 60 60 0 3 0 0 0", "23 85 60 0 50 C3 0 0", "23 FF 60 0 50 C3 0 0"].into_iter().for_each(&mut write);
    for (controlword, state) in [("6", 0x21), ("7", 0x23), ("F", 0x27)] {
        assert!(ask(&mut client, 2, &format!("8 2B 40 60 0 {controlword} 0 0 0")).starts_with("582 60"));
        while read(&mut client, 2, "41 60 0") & 0x6F != state {}
    }
    while read(&mut client, 2, "6C 60 0") < 40_000 {}
    daemon.configure(&with(&[x]));

    daemon.hang_up();

    daemon.logged("reload: reading");
    daemon.hang_up();
    // It is still there, and obeys nobody any more.
    daemon.terminate();
    daemon.wait_until_stopped();
}
