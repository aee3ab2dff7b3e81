//! Nodes without a Node-ID and an LSS master, python-canopen.

use tests::{Bus, Client, Daemon, Master, TempDir, axisctl, config, free_port};

const PROFILE: &str = "cia402-servo";
const NAMES: [&str; 9] = ["x1", "x2", "y1", "y2", "z", "feeder", "belt 1", "belt 2", "known"];

/// As many equal drives as Node-IDs, which store in a directory.
fn daemon(port: u16, node_ids: &[u8], dir: &TempDir) -> Daemon {
    let devices: Vec<_> = NAMES.into_iter().zip(node_ids).map(|(name, &id)| (name, PROFILE, id)).collect();
    let path = dir.path().display();
    Daemon::start(&format!(
        "[storage]\npath = \"{path}\"\n[control]\nsocket = \"{path}/socket\"\n{}",
        config(Bus::Socketcand(port), &devices)
    ))
}

fn stop(mut daemon: Daemon) {
    daemon.terminate();
    daemon.wait_until_stopped();
}

#[test]
fn fastscan_finds_eight_unconfigured_nodes_and_what_it_stores_lasts() {
    let (port, dir) = (free_port(), TempDir::new());
    let first = daemon(port, &[255, 255, 255, 255, 255, 255, 255, 255, 100], &dir);

    let log = Master::at(port, PROFILE).run("lss", &[]);

    insta::assert_snapshot!(log, @r"
    8 nodes found and stored
    each has the identity that the scan has found
    node 3 is selected by its identity
    ");
    stop(first);
    let port = free_port();
    let _second = daemon(port, &[255; 8], &dir);
    let mut client = Client::raw(port);
    for node_id in 1..=8 {
        client.send(&format!("< send 60{node_id} 8 40 0 10 0 0 0 0 0 >"));
        assert_eq!(client.frame(), format!("58{node_id} 4300100092010200"));
    }
}

#[test]
fn a_node_id_of_the_configuration_holds_and_the_status_names_the_conflict() {
    let (port, dir) = (free_port(), TempDir::new());
    let first = daemon(port, &[255, 12, 13, 14, 15, 16, 17, 18], &dir);
    let mut client = Client::raw(port);
    for (request, answer) in [
        ("7E5 8 4C 0 0 0 0 0 0 0", "7E4 5000000000000000"),
        ("7E5 8 51 0 0 0 0 80 0 0", "7E4 4F00000000000000"),
    ] {
        client.send(&format!("< send {request} >"));
        assert_eq!(client.frame(), answer);
    }
    client.send("< send 7E5 8 4 1 0 0 0 0 0 0 >");
    client.send("< send 7E5 8 11 B 0 0 0 0 0 0 >");
    for _ in 0..8 {
        assert_eq!(client.frame(), "7E4 1100000000000000", "all nodes are in configuration state");
    }
    client.send("< send 7E5 8 17 0 0 0 0 0 0 0 >");
    for _ in 0..8 {
        assert_eq!(client.frame(), "7E4 1700000000000000");
    }
    stop(first);

    let port = free_port();
    let _second = daemon(port, &[255, 12, 13, 14, 15, 16, 17, 18], &dir);
    let socket = dir.path().join("socket").display().to_string();
    let status = axisctl(&["--socket", &socket, "status"]);
    let status = String::from_utf8(status.stdout).expect("it speaks UTF-8");
    assert!(status.contains("can0/11 "), "{status}");
    assert!(status.contains("can0/12 "), "{status}");
    let conflict = "stored by LSS: Node-ID 11; the configuration has another Node-ID, which holds";
    assert_eq!(status.matches(conflict).count(), 7, "{status}");
}
