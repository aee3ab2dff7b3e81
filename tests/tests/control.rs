//! `axisctl` and the control socket of a running daemon.

use std::os::unix::net::UnixStream;
use std::thread;
use std::time::Duration;

use tests::{Bus, Client, Daemon, TempDir, axisctl, axisd, config, free_port, run_python};

/// A daemon with two devices on a bus behind `port`, and the path of its control socket.
fn daemon(port: u16, dir: &TempDir) -> (Daemon, String) {
    let socket = dir.path().join("control.sock").display().to_string();
    let devices = [("x-axis", "jvl-mac00-fc4", 1), ("reference", "canopen-reference", 2)];
    let config = config(Bus::Socketcand(port), &devices);
    (Daemon::start(&format!("[control]\nsocket = \"{socket}\"\n\n{config}")), socket)
}

/// What `axisctl status` prints.
fn status(socket: &str, more: &[&str]) -> String {
    let output = axisctl(&[&["--socket", socket, "status"], more].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it speaks UTF-8")
}

fn has_line(text: &str, beginning: &str, end: &str) -> bool {
    text.lines().any(|line| line.trim_start().starts_with(beginning) && line.ends_with(end))
}

#[test]
fn axisctl_shows_devices_and_buses_and_says_what_went_wrong() {
    let (port, dir) = (free_port(), TempDir::new());
    let (mut daemon, socket) = daemon(port, &dir);
    let mut client = Client::raw(port);
    client.send("< send 602 8 23 28 10 1 81 0 0 0 >"); // node 2 listens to the emergencies of node 1
    assert_eq!(client.frame(), "582 6028100100000000");
    client.send("< send 601 8 40 0 50 0 0 0 0 0 >"); // read 0x5000:00
    assert_eq!(client.frame(), "581 8000500000000206");
    client.send("< send 000 2 1 1 >");
    client.send("< send 201 1 6 >"); // half a controlword
    daemon.logged("reference: node 1 tells 0x8210 (PDO not processed, too short)");

    let text = status(&socket, &[]);

    assert!(has_line(&text, "x-axis     can0/1  OPERATIONAL      SWITCH ON DISABLED", "kbit/s"), "{text}");
    assert!(has_line(&text, "reference  can0/2  PRE-OPERATIONAL", "kbit/s"), "{text}");
    assert!(has_line(&text, "can0  virtual", ""), "{text}");
    assert!(has_line(&text, "error: 0x8210", "PDO not processed, too short"), "{text}");
    assert!(has_line(&text, "EMCY sent: 1", ""), "{text}");
    let words = "0x06020000 object does not exist in the object dictionary, 0x5000:00";
    assert!(has_line(&text, "", words), "{text}");
    assert!(has_line(&text, "", "node 1: 0x8210 PDO not processed, too short"), "{text}");
    assert!(has_line(&text, "RPDOs too short, not taken: 1", ""), "{text}");
}

#[test]
fn a_flood_of_emergencies_costs_one_line_a_second_and_all_are_counted() {
    let (port, dir) = (free_port(), TempDir::new());
    let (mut daemon, socket) = daemon(port, &dir);
    let mut client = Client::raw(port);
    client.send("< send 602 8 23 28 10 9 89 0 0 0 >"); // node 2 listens to the emergencies of node 9
    assert_eq!(client.frame(), "582 6028100900000000");
    let tell = |client: &mut Client| client.send("< send 089 8 10 42 9 0 0 0 0 0 >");

    (0..20).for_each(|_| tell(&mut client));
    daemon.logged("reference: node 9 tells 0x4210 (temperature of the device too high)");
    thread::sleep(Duration::from_millis(1100));
    tell(&mut client);

    daemon.logged("(temperature of the device too high) (19 lines like this left out)");
    let text = status(&socket, &[]);
    assert!(has_line(&text, "EMCY received: 21", ""), "{text}");
}

/// What `axisctl fault` prints.
fn fault(socket: &str, arguments: &[&str]) -> String {
    let output = axisctl(&[&["--socket", socket, "fault"], arguments].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it speaks UTF-8")
}

#[test]
fn axisctl_breaks_a_machine_whose_axis_sleeps_shows_it_and_repairs_it() {
    let (port, dir) = (free_port(), TempDir::new());
    let (mut daemon, socket) = daemon(port, &dir);
    let mut client = Client::raw(port);
    let nothing = "DEVICE  AXIS  FAULTS\nx-axis     1  -\n";
    assert_eq!(fault(&socket, &["list"]), nothing);

    let broken = "DEVICE  AXIS  FAULTS\nx-axis     1  drive-fault:over-current, supply-dip:10\n";
    fault(&socket, &["inject", "x-axis", "supply-dip:10"]);
    assert_eq!(fault(&socket, &["inject", "x-axis", "drive-fault:over-current", "--axis", "1"]), broken);

    assert!(client.frame().starts_with("081 0110"), "an EMCY with JVL's code of a motor error");
    daemon.logged("x-axis: fault supply-dip:10 injected");
    daemon.logged("x-axis: fault 0x1001");
    assert_eq!(fault(&socket, &["list", "x-axis"]), broken);
    let text = status(&socket, &[]);
    assert!(has_line(&text, "x-axis, axis 1: simulated faults:", "supply-dip:10"), "{text}");

    fault(&socket, &["clear", "x-axis", "supply-dip"]);
    assert_eq!(fault(&socket, &["clear", "x-axis", "all"]), nothing);
    assert!(!status(&socket, &[]).contains("simulated faults"));
}

#[test]
fn axisctl_says_what_is_wrong_with_a_fault_and_ends_with_1() {
    let dir = TempDir::new();
    let (_daemon, socket) = daemon(free_port(), &dir);
    let refused = |arguments: &[&str]| {
        let output = axisctl(&[&["--socket", &socket, "fault"], arguments].concat());
        (output.status.code(), String::from_utf8(output.stderr).expect("it speaks UTF-8"))
    };
    let error = |text: &str| (Some(1), format!("axisctl: {text}\n"));

    let unknown = "unknown fault `block-shaft`; did you mean `blocked-shaft`? \
                   known: encoder-break, blocked-shaft, stuck-switch, drive-fault, supply-dip, \
                   connection-loss";
    assert_eq!(refused(&["inject", "x-axis", "block-shaft"]), error(unknown));
    let unknown = "no device `x`; there are: x-axis, reference";
    assert_eq!(refused(&["inject", "x", "blocked-shaft"]), error(unknown));
    assert_eq!(refused(&["list", "x"]), error(unknown));
    let unknown = "device `x-axis` has no axis 2, only axis 1";
    assert_eq!(refused(&["clear", "x-axis", "all", "--axis", "2"]), error(unknown));
    assert_eq!(refused(&["inject", "reference", "blocked-shaft"]), error("device `reference` has no axis"));

    assert_eq!(refused(&["inject", "x-axis"]).0, Some(2));
    assert_eq!(refused(&["mend", "x-axis", "all"]).0, Some(2));
}

#[test]
fn axisctl_prints_the_same_as_json() {
    let (port, dir) = (free_port(), TempDir::new());
    let (_daemon, socket) = daemon(port, &dir);

    let json = status(&socket, &["--json"]);

    let found = run_python(&format!(
        "import json\nstatus = json.loads('''{json}''')\n\
         print([(d['name'], [n['node_id'] for n in d['nodes']]) for d in status['devices']])"
    ));
    assert_eq!(found, "[('x-axis', [1]), ('reference', [2])]\n");
}

#[test]
fn without_a_daemon_axisctl_says_where_it_looked_and_ends_with_1() {
    let dir = TempDir::new();
    let socket = dir.path().join("nobody.sock").display().to_string();

    let output = axisctl(&["--socket", &socket, "status"]);

    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains(&socket) && stderr.contains("no daemon answers"), "{stderr}");
}

#[test]
fn axisctl_says_when_the_daemon_has_no_place_for_one_more() {
    let dir = TempDir::new();
    let (_daemon, socket) = daemon(free_port(), &dir);
    let clients: Vec<_> = (0..16).map(|_| UnixStream::connect(&socket).expect("a place")).collect();

    let output = axisctl(&["--socket", &socket, "status"]);

    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!((output.status.code(), stderr.as_ref()), (Some(1), "axisctl: too many clients\n"));
    drop(clients);
}

#[test]
fn a_socket_goes_with_its_daemon_and_one_that_was_killed_is_replaced() {
    let dir = TempDir::new();
    let (mut killed, socket) = daemon(free_port(), &dir);
    killed.kill();
    drop(killed);
    assert!(dir.path().join("control.sock").exists());

    let (mut next, _) = daemon(free_port(), &dir);
    status(&socket, &[]);

    next.terminate();
    next.wait_until_stopped();
    assert!(!dir.path().join("control.sock").exists());
}

#[test]
fn a_second_daemon_at_the_same_socket_is_a_clear_error() {
    let dir = TempDir::new();
    let (_first, socket) = daemon(free_port(), &dir);
    let config = format!("[control]\nsocket = \"{socket}\"\n{}", config(Bus::Virtual, &[]));
    let file = dir.write("second.toml", &config).display().to_string();

    let output = axisd(&["run", "--config", &file]);

    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains(&socket) && stderr.contains("another axisd serves it"), "{stderr}");
    status(&socket, &[]);
}
