//! The ASCII gateway (CiA 309-3), asked by plain sockets.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{Ipv4Addr, TcpStream};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use tests::{Daemon, PATIENCE, TempDir, free_port, run_peer};

/// Three networks: two behind a TCP port, one behind a Unix socket, each with a servo; and one without a Node-ID.
fn config(port: u16, path: &str) -> String {
    let bus = |name: &str, gateway: &str| {
        format!(
            "[[bus]]\nname = \"{name}\"\nlink = \"virtual\"\ngateway = \"{gateway}\"\n\
             [[device]]\nname = \"{name}-servo\"\nprofile = \"cia402-servo\"\nbus = \"{name}\"\nnode_id = 5\n"
        )
    };
    let place = format!("127.0.0.1:{port}");
    format!(
        "{}{}{}[[device]]\nname = \"new\"\nprofile = \"cia402-servo\"\nbus = \"can1\"\nnode_id = 255\n\
         identity = {{ product_code = 0, revision = 0, serial = 1 }}\n",
        bus("can1", &place),
        bus("can2", &place),
        bus("can3", path)
    )
}

#[test]
fn clients_use_networks_by_lines_of_text() {
    let (port, dir) = (free_port(), TempDir::new());
    let path = dir.path().join("gateway").display().to_string();
    let trail = dir.path().join("audit");
    let config = format!("[audit]\npath = \"{}\"\n{}", trail.display(), config(port, &path));
    let mut daemon = Daemon::start(&config);

    let log = run_peer("ascii_gateway", &[port.to_string(), path.clone()]);

    insta::assert_snapshot!(log, @r"
    1 5 EMCY 8210 11 1 0 1 0 0
    1 5 EMCY 8210 11 1 0 1 0 0
    found 0x00000000 0x00000000 0x00000000 0x00000001
    node 9 has the serial number 1
    ");
    daemon.terminate();
    daemon.wait_until_stopped();
    assert!(!Path::new(&path).exists(), "the socket goes with the daemon");
    assert_is_told_by_whom(&trail);
}

/// What clients have ordered is in the audit trail, with the address of the client, or its user.
fn assert_is_told_by_whom(trail: &Path) {
    let lines = fs::read_to_string(trail.join("audit-00000001.jsonl")).expect("the trail");
    let uid = fs::metadata("/proc/self").expect("this runs").uid();
    let by_address = r#""by":{"kind":"canopen","bus":"can1","client":"127.0.0.1:"#;
    let by_user = format!(r#""by":{{"kind":"canopen","bus":"can3","uid":{uid},"pid":"#);
    for (by, order) in [
        (by_address, r#""bus":"can1","node_id":5,"order":"reset""#),
        (by_address, r#""bus":"can1","node_id":5,"order":"start""#),
        (by_address, r#""event":"lss","device":"new","#),
        (by_address, r#""order":"node-id 9""#),
        (&by_user, r#""bus":"can3","node_id":99,"order":"start""#),
    ] {
        assert!(lines.lines().any(|line| line.contains(by) && line.contains(order)), "{order}: {lines}");
    }
}

#[test]
fn the_example_of_a_gateway_answers_as_it_says() {
    let (port, example) = (free_port(), include_str!("../../config/examples/ascii-gateway.toml"));
    let _daemon = Daemon::start(&example.replace("127.0.0.1:6001", &format!("127.0.0.1:{port}")));
    let mut client = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).expect("connect to the daemon");
    client.set_read_timeout(Some(PATIENCE)).expect("set a time-out");
    let mut answers = BufReader::new(client.try_clone().expect("a second handle")).lines();
    let dialogue: Vec<&str> = example.lines().filter_map(|line| line.strip_prefix("#   ")).skip(1).collect();
    assert_eq!(dialogue.len(), 8);
    for pair in dialogue.chunks(2) {
        writeln!(client, "{}", pair[0]).expect("send to the daemon");
        assert_eq!(answers.next().expect("an answer").expect("in time"), pair[1], "{}", pair[0]);
    }
}
