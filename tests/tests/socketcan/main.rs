//! The daemon on real SocketCAN interfaces, each test on one of its own.

mod bus_state;
mod congestion;
mod cyclic;
mod filters;
mod garbage;
mod guides;
mod jvl;
mod loss;
mod master;
mod metrics;
mod reload;
mod watchdog;
mod watching;

use std::thread;

use tests::{Bus, Daemon, Master, TempDir, Vcan, Wire, config, story};

const PROFILE: &str = "jvl-mac00-fc4";

const READ_DEVICE_TYPE: &str = "601#4000100000000000";
const DEVICE_TYPE: &str = "581#4300100092010200";

/// Bits of the statusword, and what they are in the drive's states (CiA 402, table 30).
const STATE: u16 = 0x6F;
const SWITCH_ON_DISABLED: u16 = 0x40;
const READY_TO_SWITCH_ON: u16 = 0x21;
const SWITCHED_ON: u16 = 0x23;
const OPERATION_ENABLED: u16 = 0x27;

fn one_drive(interface: &Vcan) -> Daemon {
    Daemon::start(&config(Bus::Interface(interface), &[("axis1", PROFILE, 1)]))
}

#[test]
fn python_canopen_drives_an_axis() {
    let interface = Vcan::new();
    let wire = Wire::on(&interface);
    let _daemon = one_drive(&interface);

    let log = Master::on(&interface, PROFILE).run("drive402", &[]);

    insta::assert_snapshot!(story(&wire.finish()));
    // The same log as over socketcand.
    insta::with_settings!({ prepend_module_to_snapshot => false, snapshot_path => "../snapshots" }, {
        insta::assert_snapshot!("drive402", log);
    });
}

#[test]
fn python_canopen_takes_a_drive_through_every_mode() {
    let interface = Vcan::new();
    let _daemon = Daemon::start(&config(Bus::Interface(&interface), &[("axis1", "cia402-servo", 1)]));

    let log = Master::on(&interface, "cia402-servo").run("modes402", &[]);

    insta::with_settings!({ prepend_module_to_snapshot => false, snapshot_path => "../snapshots" }, {
        insta::assert_snapshot!("modes402", log);
    });
}

#[test]
fn fastscan_finds_eight_unconfigured_nodes_on_one_interface() {
    let interface = Vcan::new();
    let storage = TempDir::new();
    let names = ["a", "b", "c", "d", "e", "f", "g", "h"];
    let mut devices = names.map(|name| (name, "cia402-servo", 255)).to_vec();
    devices.push(("known", "cia402-servo", 100));
    let config = config(Bus::Interface(&interface), &devices);
    let _daemon = Daemon::start(&format!("[storage]\npath = \"{}\"\n{config}", storage.path().display()));

    let log = Master::on(&interface, "cia402-servo").run("lss", &[]);

    assert!(log.starts_with("8 nodes found and stored\n"), "{log}");
}

#[test]
fn garbage_beside_a_run_does_not_disturb_it() {
    let interface = Vcan::new();
    let wire = Wire::on(&interface);
    let _daemon = one_drive(&interface);
    let master = Master::on(&interface, PROFILE);

    let log = thread::scope(|scope| {
        let run = scope.spawn(|| master.run("drive402", &[]));
        while !run.is_finished() {
            garbage::UNANSWERED.iter().for_each(|frame| wire.send(frame));
        }
        run.join().expect("the script succeeds")
    });

    insta::with_settings!({ prepend_module_to_snapshot => false, snapshot_path => "../snapshots" }, {
        insta::assert_snapshot!("drive402", log);
    });
}

#[test]
fn two_axes_move_at_once() {
    let interface = Vcan::new();
    let _daemon =
        Daemon::start(&config(Bus::Interface(&interface), &[("axis1", PROFILE, 1), ("axis2", PROFILE, 2)]));

    let log = Master::on(&interface, PROFILE).run("two_drives", &[]);

    insta::assert_snapshot!(log, @r"
    both moved at once
    node 1: target reached at +40000
    node 2: target reached at -40000
    ");
}

#[test]
fn what_one_bus_commands_the_other_bus_of_the_device_sees() {
    let (left, right) = (Vcan::new(), Vcan::new());
    let _daemon = Daemon::start(&format!(
        r#"
        [[bus]]
        name = "left"
        link = "socketcan:{}"

        [[bus]]
        name = "right"
        link = "socketcan:{}"

        [[device]]
        name = "axis1"
        profile = "{PROFILE}"

        [[device.on]]
        bus = "left"
        node_id = 1

        [[device.on]]
        bus = "right"
        node_id = 1
        "#,
        left.name(),
        right.name(),
    ));
    let (commands, mut sees) = (Wire::on(&left), Wire::on(&right));
    sees.send("000#0101");
    sees.expect_statusword(STATE, SWITCH_ON_DISABLED);

    commands.send("000#0101");
    commands.send("201#0600");

    sees.expect_statusword(STATE, READY_TO_SWITCH_ON);
}

#[test]
fn sigterm_lets_a_running_axis_ramp_down_first() {
    let interface = Vcan::new();
    let mut daemon = one_drive(&interface);
    let master = Master::on(&interface, PROFILE);
    let mut peer = master.start("runaway", &[]);
    peer.wait_for("running");

    daemon.terminate();

    assert_eq!(peer.finish(), "running\nramped down, then SWITCH ON DISABLED\n");
    daemon.wait_until_stopped();
}

#[test]
fn an_interface_that_comes_late_is_served() {
    let interface = Vcan::absent();
    let _daemon = one_drive(&interface);

    interface.create();

    assert_served(&interface);
}

#[test]
fn an_interface_that_goes_and_comes_back_is_served_again() {
    let interface = Vcan::new();
    let _daemon = one_drive(&interface);
    assert_served(&interface);

    interface.remove();
    interface.create();

    assert_served(&interface);
}

#[test]
fn an_interface_that_goes_down_and_up_is_served_again() {
    let interface = Vcan::new();
    let _daemon = one_drive(&interface);
    assert_served(&interface);

    interface.bounce();

    assert_served(&interface);
}

/// Asks until the node answers: how soon the daemon sees a new interface is its own affair.
fn assert_served(interface: &Vcan) {
    wait_until_served(&mut Wire::on(interface));
}

/// The same on a wire. What was asked too often has been answered then: a last request is answered otherwise.
fn wait_until_served(wire: &mut Wire) {
    wire.ask_until(READ_DEVICE_TYPE, DEVICE_TYPE);
    wire.send("601#40FF5F0000000000");
    wire.expect("581#80FF5F0000000206");
}
