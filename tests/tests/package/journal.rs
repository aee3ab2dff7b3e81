//! What the journal of systemd gets of the log.

use std::thread;
use std::time::{Duration, Instant};

use tests::system::{System, run};
use tests::{Client, PATIENCE, free_port};

const POLL_PERIOD: Duration = Duration::from_millis(50);
const DEVICE: &str = "AXISD_DEVICE=x-axis";

/// Two devices on a bus that clients reach, and one on a bus whose interface is not there.
fn config(port: u16) -> String {
    format!(
        "[[bus]]\nname = \"can0\"\nlink = \"virtual\"\nsocketcand = \"127.0.0.1:{port}\"\n\
         [[bus]]\nname = \"gone\"\nlink = \"socketcan:gone0\"\n\
         [[device]]\nname = \"x-axis\"\nprofile = \"cia402-servo\"\nbus = \"can0\"\nnode_id = 1\n\
         [[device]]\nname = \"y-axis\"\nprofile = \"cia402-servo\"\nbus = \"can0\"\nnode_id = 2\n\
         [[device]]\nname = \"z-axis\"\nprofile = \"cia402-servo\"\nbus = \"gone\"\nnode_id = 1\n"
    )
}

/// What this run of the service has logged with these fields, a JSON object each.
fn logged(pid: i32, fields: &[&str]) -> Vec<String> {
    run("journalctl", &["--sync"]);
    let process = format!("_PID={pid}");
    let arguments =
        ["--no-pager", "--output=json", "--unit=axisd.service", "SYSLOG_IDENTIFIER=axisd", &process];
    let text = run("journalctl", &[&arguments, fields].concat());
    text.lines().filter(|line| line.starts_with('{')).map(str::to_owned).collect()
}

fn wait_for(pid: i32, fields: &[&str], words: &str) -> String {
    let deadline = Instant::now() + PATIENCE;
    loop {
        let lines = logged(pid, fields);
        if let Some(line) = lines.iter().find(|line| line.contains(words)) {
            return line.clone();
        }
        assert!(Instant::now() < deadline, "no {words} with {fields:?} in {:?}", logged(pid, &[]));
        thread::sleep(POLL_PERIOD);
    }
}

/// Has node 1 answer, so that it has heard all that was sent before.
fn settle(client: &mut Client) {
    client.send("< send 601 8 40 0 10 0 0 0 0 0 >");
    while !client.frame().starts_with("581 43") {}
}

#[test]
fn the_journal_has_the_fields_of_each_line_and_the_level_can_be_changed() {
    let system = System::installed();
    let port = free_port();
    let service = system.service(Some(&config(port)));
    service.start();
    let pid = service.pid();
    let mut client = Client::raw(port);

    let line = wait_for(pid, &[DEVICE, "AXISD_MODULE=device", "PRIORITY=6"], "x-axis: PRE-OPERATIONAL");
    assert!(line.contains(r#""_SYSTEMD_UNIT":"axisd.service""#), "{line}");
    run("axisctl", &["fault", "inject", "x-axis", "encoder-break"]);
    wait_for(pid, &[DEVICE, "PRIORITY=4", "AXISD_CODE=29445"], "fault 0x7305");
    wait_for(pid, &["AXISD_BUS=gone", "AXISD_MODULE=bus", "PRIORITY=4"], "interface gone0");

    assert!(run("axisctl", &["log", "device=off"]).contains("off"));
    client.send("< send 0 2 81 2 >");
    settle(&mut client);
    run("axisctl", &["log", "device=info"]);
    client.send("< send 0 2 81 1 >");
    wait_for(pid, &[DEVICE], "reset over the bus");
    let lines = logged(pid, &["AXISD_DEVICE=y-axis"]);
    assert!(!lines.iter().any(|line| line.contains("reset over the bus")), "{lines:?}");
}

#[test]
fn a_flood_of_frames_is_no_flood_of_lines() {
    const FRAMES: u64 = 2000;
    let system = System::installed();
    let port = free_port();
    let service = system.service(Some(&config(port)));
    service.start();
    let pid = service.pid();
    let began = Instant::now();
    let mut client = Client::raw(port);

    // Each of them changes the state, which is worth a line; in between a frame too short for an SDO.
    for _ in 0..FRAMES / 100 {
        client.send(&"< send 0 2 2 1 >< send 601 1 40 >< send 0 2 1 1 >".repeat(50));
        settle(&mut client);
    }

    let lines = logged(pid, &[DEVICE]);
    let seconds = usize::try_from(began.elapsed().as_secs()).expect("it is not that slow");
    assert!(lines.len() <= 3 * (seconds + 2), "{} lines in {seconds} s: {lines:?}", lines.len());
    let deadline = Instant::now() + PATIENCE;
    while !logged(pid, &[DEVICE]).iter().any(|line| line.contains("lines like this left out")) {
        assert!(Instant::now() < deadline, "nothing says that lines were left out");
        client.send("< send 0 2 2 1 >< send 0 2 1 1 >");
        settle(&mut client);
    }
}
