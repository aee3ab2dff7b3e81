//! An operator watches a real bus.

use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use tests::{Bus, Daemon, PATIENCE, TempDir, Vcan, Wire, axisctl, axisctl_command, config};

use crate::PROFILE;

/// Nobody of ours listens to it.
const FOREIGN: &str = "7E0#0102";

/// A number of the status that stands behind this key for the first time.
pub(crate) fn number(socket: &str, key: &str) -> u64 {
    let output = axisctl(&["--socket", socket, "status", "--json"]);
    let text = String::from_utf8(output.stdout).expect("it speaks UTF-8");
    let value = text.split(&format!("\"{key}\":")).nth(1).unwrap_or_else(|| panic!("no {key} in {text}"));
    value.trim_start().chars().take_while(char::is_ascii_digit).collect::<String>().parse().expect("a number")
}

/// A daemon with one node on `interface`, and where its control socket is.
fn daemon(interface: &Vcan, dir: &TempDir) -> (Daemon, String) {
    let socket = dir.path().join("control.sock").display().to_string();
    let config = config(Bus::Interface(interface), &[("axis1", PROFILE, 1)]);
    (Daemon::start(&format!("[control]\nsocket = \"{socket}\"\n\n{config}")), socket)
}

#[test]
fn a_watcher_sees_frames_that_nobody_else_listens_to_and_only_while_he_watches() {
    let (interface, dir) = (Vcan::new(), TempDir::new());
    let (_daemon, socket) = daemon(&interface, &dir);
    let wire = Wire::on(&interface);
    wire.send(FOREIGN);
    let before = number(&socket, "received");

    let mut command = axisctl_command(&["--socket", &socket, "dump", "can0", "--count", "1", "--json"]);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("run axisctl");
    let deadline = Instant::now() + PATIENCE;
    while number(&socket, "received") == before {
        assert!(Instant::now() < deadline, "nobody watches");
        wire.send(FOREIGN);
    }
    let output = child.wait_with_output().expect("it ends");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("\"id\":\"7E0\",\"length\":2,\"data\":\"0102\",\"service\":\"unknown\""), "{text}");

    // The filter is back when the daemon has seen the watcher leave.
    let is_quiet = || {
        let before = number(&socket, "received");
        wire.send(FOREIGN);
        thread::sleep(Duration::from_millis(50));
        number(&socket, "received") == before
    };
    assert!(core::iter::repeat_with(is_quiet).take(100).any(|is_quiet| is_quiet));
}

#[test]
fn the_load_of_an_interface_has_foreign_frames_in_it() {
    let (interface, dir) = (Vcan::new(), TempDir::new());
    let (_daemon, socket) = daemon(&interface, &dir);
    let wire = Wire::on(&interface);
    let deadline = Instant::now() + PATIENCE;
    while number(&socket, "bits_per_s") == 0 {
        assert!(Instant::now() < deadline, "there is no load");
        (0..10).for_each(|_| wire.send(FOREIGN));
    }
    assert_eq!(number(&socket, "received"), 0, "our node did not hear them");
}

#[test]
fn an_axis_on_a_quiet_bus_is_moved_without_delay() {
    let (interface, dir) = (Vcan::new(), TempDir::new());
    let (_daemon, socket) = daemon(&interface, &dir);
    let output = axisctl(&[
        "--socket",
        &socket,
        "move",
        "axis1",
        "2000",
        "--velocity",
        "20000",
        "--acceleration",
        "100000",
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
