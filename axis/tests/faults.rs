//! What an axis does when its plant breaks.

use axis::{
    Axis, DriveFault, DriveState, EncoderBreak, Fault, Input, Limits, Motion, Period, PlantConfig,
    PlantFault, Position, Profile, ScheduledFault, ServoConfig, SimulatedServo, Status, Velocity, Voltage,
};

const PROFILE: Profile = Profile {
    velocity: Velocity(100_000.0),
    acceleration: axis::Acceleration(1e6),
    deceleration: axis::Acceleration(1e6),
    jerk: None,
};

/// An axis that runs at 100 000 counts/s when `fault` comes half a second after its start.
fn struck(fault: PlantFault, mut plant: PlantConfig) -> Axis {
    plant.faults.push(ScheduledFault { fault, from_seconds: 0.5, until_seconds: None });
    let servo = SimulatedServo::new(Period::MILLISECOND, ServoConfig { plant, ..ServoConfig::default() });
    let mut axis = Axis::new(Period::MILLISECOND, Limits::default(), Box::new(servo));
    axis.power_on();
    run(&mut axis, 11);
    axis.run_at(Velocity(100_000.0), PROFILE);
    let before = run(&mut axis, 489);
    assert_eq!((before.fault, before.motion), (None, Motion::Constant));
    axis
}

fn run(axis: &mut Axis, steps: u32) -> Status {
    (0..steps).for_each(|_| axis.step());
    *axis.status()
}

#[test]
fn a_drive_that_trips_takes_the_torque_away_and_the_axis_coasts_to_rest() {
    let dip = PlantFault::SupplyDip(Voltage(0.0));
    let mut axis = struck(dip, PlantConfig::default());
    let mut last = run(&mut axis, 1);
    assert_eq!(last.drive, DriveState::Fault(DriveFault::UnderVoltage));
    assert_eq!(last.fault, Some(Fault::Drive(DriveFault::UnderVoltage)));
    while last.actual.velocity > Velocity(0.0) {
        assert!(!axis.is_quiet());
        let now = run(&mut axis, 1);
        assert!(now.actual.velocity < last.actual.velocity);
        last = now;
    }
    assert!(axis.is_quiet());
    axis.reset_fault();
    assert_eq!(run(&mut axis, 1).fault, Some(Fault::Drive(DriveFault::UnderVoltage)));
}

#[test]
fn a_broken_encoder_that_nobody_monitors_ends_in_a_following_error() {
    for encoder_break in [EncoderBreak::Stuck, EncoderBreak::Garbage] {
        let plant = PlantConfig { encoder_break, monitors_encoder: false, ..PlantConfig::default() };
        let mut axis = struck(PlantFault::EncoderBreak, plant);
        axis.set_following_error_limit(Some(Position(500.0)));
        assert_eq!(run(&mut axis, 20).fault, Some(Fault::FollowingError));
    }
}

#[test]
fn a_blocked_shaft_is_a_following_error() {
    let mut axis = struck(PlantFault::BlockedShaft, PlantConfig::default());
    axis.set_following_error_limit(Some(Position(500.0)));
    let status = run(&mut axis, 10);
    assert_eq!((status.fault, status.actual.velocity), (Some(Fault::FollowingError), Velocity(0.0)));
}

/// Raster steps from the break of a blocked shaft to the fault.
fn steps_to_fault(axis: &mut Axis) -> u32 {
    (1..100).find(|_| run(axis, 1).fault.is_some()).unwrap()
}

#[test]
fn a_following_error_is_tolerated_for_its_time_on_end() {
    let blocked = |steps| {
        let mut axis = struck(PlantFault::BlockedShaft, PlantConfig::default());
        axis.set_following_error_limit(Some(Position(500.0)));
        axis.set_following_error_time(steps);
        axis
    };
    let at_once = steps_to_fault(&mut blocked(0));
    assert_eq!(steps_to_fault(&mut blocked(20)), at_once + 20);
    let mut axis = blocked(20);
    assert_eq!(run(&mut axis, at_once + 15).fault, None);
    axis.set_following_error_limit(None);
    run(&mut axis, 1);
    axis.set_following_error_limit(Some(Position(500.0)));
    assert_eq!(steps_to_fault(&mut axis), 21, "the time starts anew");
}

#[test]
fn a_stuck_switch_shows_its_level() {
    let stuck = PlantFault::StuckSwitch(Input::PositiveLimit, true);
    let mut axis = struck(stuck, PlantConfig::default());
    assert!(!axis.status().switches.positive_limit);
    assert!(run(&mut axis, 1).switches.positive_limit);
}
