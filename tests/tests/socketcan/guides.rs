//! The commands in our documents that need a CAN interface.

use tests::guide::{Place, tell};
use tests::{Bus, Vcan, config};

#[test]
fn the_tutorial_works_on_a_can_interface() {
    assert!(tell("docs/tutorial.md", Place::Vcan(&Vcan::new()), None) > 4);
}

#[test]
fn the_drives_for_ros2_canopen_are_served() {
    assert!(tell("docs/ros2_canopen.md", Place::Vcan(&Vcan::new()), None) > 2);
}

#[test]
fn the_troubleshooting_document_works_on_a_can_interface() {
    let interface = Vcan::new();
    let config = config(Bus::Interface(&interface), &[("axis1", "cia402-servo", 1)]);

    assert!(tell("docs/troubleshooting.md", Place::Vcan(&interface), Some(&config)) > 1);
}
