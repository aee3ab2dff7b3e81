//! The CAN controller leaves the bus, or the interface is gone, while an axis runs.
//!
//! A virtual interface has no controller, so `cansend` plays it: an identifier with CAN_ERR_FLAG makes an error
//! frame (`linux/can/error.h`), which the kernel hands to whoever subscribed to its class.

use std::thread;
use std::time::{Duration, Instant};

use tests::{Bus, Daemon, PATIENCE, TempDir, Vcan, Wire, axisctl, config};

use crate::{
    OPERATION_ENABLED, PROFILE, READY_TO_SWITCH_ON, STATE, SWITCH_ON_DISABLED, SWITCHED_ON, assert_served,
    one_drive,
};

const BUS_OFF: &str = "20000040#0000000000000000";
const RESTARTED: &str = "20000100#0000000000000000";
const ERROR_PASSIVE: &str = "20000004#0020000000000000";
const ERROR_ACTIVE: &str = "20000004#0040000000000000";
/// A full receive buffer, and a bus error with its counters.
const NO_CHANGE: [&str; 2] = ["20000004#0001000000000000", "20000288#0000800000000880"];

const READ_STATUSWORD: &str = "601#4041600000000000";
const READ_NEWEST_ERROR: &str = "601#4003100100000000";

const BUS_OFF_IS_OVER: &str = "081#4081110000000000";
const NO_ERROR: &str = "081#0000000000000000";

/// Between two looks at the drive.
const POLL_PERIOD: Duration = Duration::from_millis(50);

pub(crate) const QUICK_STOP_ACTIVE: u16 = 0x07;
/// Target reached and not at rest, in profile velocity mode.
const AT_SPEED: u16 = 0x0400;
const AT_SPEED_OR_REST: u16 = 0x1400;

#[test]
fn a_bus_off_stops_the_axis_and_is_told_when_it_is_over() {
    let interface = Vcan::new();
    let (mut daemon, mut wire) = runaway(&interface);
    wire.take();

    wire.send(BUS_OFF);

    // Whatever the kernel still delivers is answered.
    assert_eq!(state(&mut wire), QUICK_STOP_ACTIVE);
    wire.expect("701#7F");
    daemon.logged("bus can0: bus off");
    wait_for(SWITCH_ON_DISABLED, &mut wire);
    let meanwhile = wire.take();
    assert!(!meanwhile.iter().any(|frame| frame.starts_with("081#")), "{meanwhile:?}");

    wire.send(RESTARTED);

    wire.expect(BUS_OFF_IS_OVER);
    wire.expect(NO_ERROR);
    daemon.logged("bus can0: error active");
    wire.expect("701#7F");
}

#[test]
fn an_error_passive_controller_is_told_and_stops_nothing() {
    let interface = Vcan::new();
    let (mut daemon, mut wire) = runaway(&interface);
    wire.take();

    for error in NO_CHANGE.into_iter().chain([ERROR_PASSIVE, ERROR_PASSIVE, ERROR_ACTIVE]) {
        wire.send(error);
    }

    wire.expect(NO_ERROR);
    assert_eq!(state(&mut wire), OPERATION_ENABLED);
    daemon.logged("bus can0: error passive");
    let told = wire.take();
    let told: Vec<_> = told.iter().filter(|frame| frame.starts_with("081#")).collect();
    assert_eq!(told, ["081#2081110000000000", NO_ERROR]);
}

#[test]
fn axisctl_tells_the_state_of_the_bus_in_words() {
    let (interface, dir) = (Vcan::new(), TempDir::new());
    let socket = dir.path().join("control.sock").display().to_string();
    let config = config(Bus::Interface(&interface), &[("axis1", PROFILE, 1)]);
    let mut daemon = Daemon::start(&format!("[control]\nsocket = \"{socket}\"\n\n{config}"));
    let mut wire = Wire::on(&interface);
    wire.ask(READ_STATUSWORD, "581");
    let status = || {
        // The daemon sleeps in the receiving system call until half a second is over.
        let output = axisctl(&["--socket", &socket, "status"]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("it speaks UTF-8")
    };
    let bus = format!("can0  socketcan:{}", interface.name());
    let text = status();
    let counted = |line: &str| {
        line.starts_with(&format!("{bus}  error active")) && line.ends_with("  1    2     0       0       0")
    };
    assert!(text.lines().any(counted), "{text}");

    wire.send(BUS_OFF);
    daemon.logged("bus can0: bus off");

    let text = status();
    assert!(text.contains(&format!("{bus}  bus off")), "{text}");
    assert!(text.contains("0x8140 recovered from bus off"), "{text}");
    assert!(text.contains("connection lost: 1\n") && text.contains(" ago  off the bus\n"), "{text}");
}

#[test]
fn an_interface_that_is_removed_stops_the_axis() {
    assert_loss_stops_the_axis(|interface| {
        interface.remove();
        interface.create();
    });
}

#[test]
fn an_interface_that_goes_down_stops_the_axis() {
    assert_loss_stops_the_axis(Vcan::bounce);
}

fn assert_loss_stops_the_axis(lose: fn(&Vcan)) {
    let interface = Vcan::new();
    let (_daemon, wire) = runaway(&interface);
    // It would not survive its interface.
    let _ = wire.finish();

    lose(&interface);

    assert_served(&interface);
    let mut wire = Wire::on(&interface);
    assert_eq!(wire.ask(READ_NEWEST_ERROR, "581"), "581#4303100140810000");
    wait_for(SWITCH_ON_DISABLED, &mut wire);
    wire.expect("701#7F");
}

/// Node 1 in OPERATIONAL with a heartbeat, its axis at a speed from which a quick stop takes two seconds. 0x6007 and
/// 0x1029 are as shipped: quick stop, leave OPERATIONAL.
fn runaway(interface: &Vcan) -> (Daemon, Wire) {
    let daemon = one_drive(interface);
    let mut wire = Wire::on(interface);
    // Heartbeat, profile velocity mode, acceleration, quick stop deceleration.
    for object in ["2B171000C8000000", "2F60600003000000", "2383600050C30000", "2385600010270000"] {
        let answer = wire.ask(&format!("601#{object}"), "581");
        assert!(answer.starts_with("581#60"), "{answer}");
    }
    wire.send("000#0101");
    for (controlword, state) in
        [("0600", READY_TO_SWITCH_ON), ("0700", SWITCHED_ON), ("0F00", OPERATION_ENABLED)]
    {
        wire.send(&format!("201#{controlword}"));
        wire.expect_statusword(STATE, state);
    }
    wire.send("501#0F00204E0000"); // 20000/s
    wire.expect_statusword(STATE | AT_SPEED_OR_REST, OPERATION_ENABLED | AT_SPEED);
    (daemon, wire)
}

/// State of the drive, read by SDO because a node that is not OPERATIONAL has no PDOs.
pub(crate) fn state(wire: &mut Wire) -> u16 {
    let answer = wire.ask(READ_STATUSWORD, "581");
    let value = answer.strip_prefix("581#4B416000").and_then(|value| value.get(..4));
    let value = value.and_then(|value| u16::from_str_radix(value, 16).ok()).map(u16::swap_bytes);
    value.unwrap_or_else(|| panic!("no statusword: {answer}")) & STATE
}

pub(crate) fn wait_for(wanted: u16, wire: &mut Wire) {
    let deadline = Instant::now() + PATIENCE;
    while state(wire) != wanted {
        assert!(Instant::now() < deadline, "the drive does not get into state {wanted:#04X}");
        thread::sleep(POLL_PERIOD);
    }
}
