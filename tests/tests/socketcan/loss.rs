//! The interface goes, in the midst of the traffic of several nodes, and comes back.

use std::iter;

use tests::{Bus, Daemon, TempDir, Vcan, Wire, config};

use crate::bus_state::{QUICK_STOP_ACTIVE, state, wait_for};
use crate::watching::number;
use crate::{OPERATION_ENABLED, READY_TO_SWITCH_ON, SWITCH_ON_DISABLED, SWITCHED_ON, wait_until_served};

const REFERENCE: &str = "canopen-reference";
const SERVO: &str = "cia402-servo";
/// The servo and its companions; the first of these produces SYNC.
const AXIS: u8 = 1;
const COMPANIONS: [u8; 3] = [2, 3, 4];

/// What all companions have in their TPDO 2.
const VALUES: &str = "0000000000000000";
/// Frames for each line of the log, at least; a machine that is too slow has some lines more, but few in a second.
const FRAMES_PER_LINE: u64 = 10;

#[test]
fn an_interface_that_goes_under_load_stops_the_axis_and_all_nodes_recover_when_it_is_back() {
    let (interface, dir) = (Vcan::new(), TempDir::new());
    let socket = dir.path().join("control.sock").display().to_string();
    let names = COMPANIONS.map(|node| format!("node{node}"));
    let mut devices = vec![("axis1", SERVO, AXIS)];
    devices.extend(names.iter().zip(COMPANIONS).map(|(name, node)| (name.as_str(), REFERENCE, node)));
    let config = config(Bus::Interface(&interface), &devices);
    let mut daemon = Daemon::start(&format!("[control]\nsocket = \"{socket}\"\n\n{config}"));
    let mut wire = Wire::on(&interface);
    make_traffic(&mut wire);
    let remove_and_create = |interface: &Vcan| {
        interface.remove();
        interface.create();
    };
    for lose in [Vcan::bounce, remove_and_create] {
        run_away(&mut wire);
        // It would not survive its interface.
        let _ = wire.finish();

        lose(&interface);

        wire = Wire::on(&interface);
        wait_until_served(&mut wire);
        assert_stopped(&mut wire);
        // All goes on as before once the master starts it again.
        wire.send("000#0100");
        let _ = wire.take();
        (0..10).for_each(|_| COMPANIONS.iter().for_each(|node| wire.expect(&format!("28{node}#{VALUES}"))));
        assert_answers_follow_their_sync(&wire.take());
    }
    let sent = number(&socket, "sent");
    daemon.terminate();
    daemon.wait_until_stopped();
    let lines = daemon.printed().lines().count() as u64;
    println!("{sent} frames, {lines} lines");
    assert!(sent > 1000 && lines * FRAMES_PER_LINE < sent, "{sent} frames:\n{}", daemon.printed());
}

/// The newest error of each node is 8140h, "recovered from bus-off", it has left OPERATIONAL (0x1029), and the axis brakes or
/// is at rest (0x6007).
fn assert_stopped(wire: &mut Wire) {
    for node in iter::once(AXIS).chain(COMPANIONS) {
        let answer = wire.ask(&format!("60{node}#4003100100000000"), &format!("58{node}"));
        assert_eq!(answer, format!("58{node}#4303100140810000"));
        wire.expect(&format!("70{node}#7F"));
    }
    let state = state(wire);
    assert!([QUICK_STOP_ACTIVE, SWITCH_ON_DISABLED].contains(&state), "{state:#04X}");
}

/// Heartbeats of all every 10 ms, SYNC of node 2 every 5 ms, to which its companions and the drive answer.
fn make_traffic(wire: &mut Wire) {
    wait_until_served(wire);
    for node in iter::once(AXIS).chain(COMPANIONS) {
        write(wire, node, "2B1710000A000000");
    }
    let [producer, ..] = COMPANIONS;
    write(wire, producer, "2306100088130000");
    write(wire, producer, "2305100080000040");
    wire.send("000#0100");
}

/// The axis at a speed from which a quick stop takes seconds.
fn run_away(wire: &mut Wire) {
    for object in ["2F60600003000000", "2383600050C30000", "2385600010270000", "23FF6000204E0000"] {
        write(wire, AXIS, object);
    }
    for (controlword, reached) in [
        ("00", SWITCH_ON_DISABLED),
        ("06", READY_TO_SWITCH_ON),
        ("07", SWITCHED_ON),
        ("0F", OPERATION_ENABLED),
    ] {
        write(wire, AXIS, &format!("2B406000{controlword}000000"));
        wait_for(reached, wire);
    }
}

fn write(wire: &mut Wire, node: u8, object: &str) {
    let answer = wire.ask(&format!("60{node}#{object}"), &format!("58{node}"));
    assert!(answer.starts_with(&format!("58{node}#60")), "{object}: {answer}");
}

/// After each SYNC TPDO 2 of each companion, the last SYNC aside, whose answers may be missing.
fn assert_answers_follow_their_sync(frames: &[String]) {
    let expected = COMPANIONS.map(|node| format!("28{node}#{VALUES}"));
    let is_meant = |frame: &&String| *frame == "080#" || expected.contains(frame);
    let frames: Vec<_> = frames.iter().filter(is_meant).map(String::as_str).collect();
    let cycles: Vec<_> = frames.split(|frame| *frame == "080#").collect();
    let [_, whole @ .., _] = &cycles[..] else { panic!("no SYNC: {frames:?}") };
    assert!(whole.len() > 10 && whole.iter().all(|cycle| *cycle == expected), "{whole:?}");
}
