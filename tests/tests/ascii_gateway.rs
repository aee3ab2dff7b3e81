//! The ASCII gateway (CiA 309-3), asked by plain sockets.

use tests::{Daemon, TempDir, free_port, run_peer};

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
    let mut daemon = Daemon::start(&config(port, &path));

    let log = run_peer("ascii_gateway", &[port.to_string(), path.clone()]);

    insta::assert_snapshot!(log, @r"
    1 5 EMCY 8210 11 1 0 1 0 0
    1 5 EMCY 8210 11 1 0 1 0 0
    found 0x00000000 0x00000000 0x00000000 0x00000001
    node 9 has the serial number 1
    ");
    daemon.terminate();
    daemon.wait_until_stopped();
    assert!(!std::path::Path::new(&path).exists(), "the socket goes with the daemon");
}
