use proptest::prelude::*;

use super::*;
use crate::drive::{DriveFault, DriveState};
use crate::limits::PositionRange;
use crate::plant::tests::{wild, wild_config};
use crate::plant::{DcLink, Load, Noise, Overload, PlantFault, ScheduledFault, Supply};
use crate::units::{Acceleration, Position, Velocity, Voltage};

fn servo(plant: PlantConfig) -> SimulatedServo {
    SimulatedServo::new(Period::MILLISECOND, ServoConfig { plant, ..ServoConfig::default() })
}

fn on(position: f64) -> Command {
    following(position, 0.0, 0.0)
}

/// Power on, and this set-point.
fn following(position: f64, velocity: f64, acceleration: f64) -> Command {
    let set_point = SetPoint {
        position: Position(position),
        velocity: Velocity(velocity),
        acceleration: Acceleration(acceleration),
    };
    Command {
        enable: true,
        demand: Demand::Position(set_point),
        torque_limit: TorqueLimit::both(Torque(3000.0)),
        ..Command::default()
    }
}

/// Brings the drive to 50000 counts/s; the last command.
fn run_up(servo: &mut SimulatedServo) -> Command {
    let commands = (0..100_u32).map(|step| following(50.0 * f64::from(step), 50_000.0, 0.0));
    let mut last = Command::default();
    for command in commands {
        servo.step(&command);
        last = command;
    }
    last
}

/// Enables the drive and lets it settle at `position`.
fn settle(servo: &mut SimulatedServo, position: f64) -> Feedback {
    (0..3000).map(|_| servo.step(&on(position))).last().unwrap_or_default()
}

#[test]
fn enabling_takes_its_steps_and_switching_off_none() {
    let mut servo = servo(PlantConfig::default());
    for _ in 0..10 {
        assert_eq!(servo.step(&on(0.0)).state, DriveState::Enabling);
    }
    assert_eq!(servo.step(&on(0.0)).state, DriveState::Enabled);
    assert_eq!(servo.step(&Command::default()).state, DriveState::Disabled);
}

#[test]
fn it_settles_on_the_count_against_friction() {
    for friction in [0.0, 0.03, 0.3] {
        let plant = PlantConfig { coulomb_friction_nm: friction, ..PlantConfig::default() };
        let settled = settle(&mut servo(plant), 3.0);
        assert!((settled.position.0 - 3.0).abs() <= 1.0, "{friction}: {settled:?}");
    }
}

#[test]
fn the_torque_limit_holds() {
    let mut servo = servo(PlantConfig::default());
    settle(&mut servo, 0.0);
    let command = Command { torque_limit: TorqueLimit::both(Torque(50.0)), ..on(10_000.0) };
    for _ in 0..200 {
        assert!(servo.step(&command).torque.abs() <= Torque(50.0));
    }
}

#[test]
fn each_side_has_a_torque_limit_of_its_own() {
    let torque_limit = TorqueLimit { positive: Torque(300.0), negative: Torque(40.0) };
    for (target, most) in [(10_000.0, 300.0), (-10_000.0, 40.0)] {
        let mut servo = servo(PlantConfig::default());
        settle(&mut servo, 0.0);
        let torque = servo.step(&Command { torque_limit, ..on(target) }).torque;
        assert_eq!(torque.abs(), Torque(most));
        let (demand, velocity_limit) = (Demand::Torque(Torque(target)), Velocity(1e9));
        let push = Command { torque_limit, demand, velocity_limit, ..on(0.0) };
        assert_eq!(servo.step(&push).torque.abs(), Torque(most));
    }
}

#[test]
fn the_motor_gives_no_more_than_its_peak_and_winds_nothing_up_there() {
    let mut servo = servo(PlantConfig { peak_torque: Torque(1000.0), ..PlantConfig::default() });
    settle(&mut servo, 0.0);
    servo.plant().unwrap().inject(PlantFault::BlockedShaft);
    for _ in 0..1000 {
        let command = Command { torque_limit: TorqueLimit::both(Torque(1e6)), ..on(5000.0) };
        assert_eq!(servo.step(&command).torque, Torque(1000.0));
    }
    servo.plant().unwrap().clear(PlantFault::BlockedShaft);
    let highest = (0..1000).map(|_| servo.step(&on(100.0)).position.0).fold(0.0, f64::max);
    assert!(highest <= 103.0, "{highest}");
}

#[test]
fn pushing_against_a_stop_winds_nothing_up() {
    let stops = PositionRange::new(Position(-1000.0), Position(1000.0));
    let mut servo = servo(PlantConfig { stops, ..PlantConfig::default() });
    assert_eq!(settle(&mut servo, 3000.0).position, Position(1000.0));
    let back = (0..100).map(|_| servo.step(&on(900.0))).last().unwrap_or_default();
    assert!((back.position.0 - 900.0).abs() <= 1.0, "{back:?}");
}

#[test]
fn without_power_only_friction_works() {
    let mut servo = servo(PlantConfig::default());
    run_up(&mut servo);
    let mut last = servo.plant.velocity().0;
    assert!(last > 40_000.0);
    while last > 0.0 {
        let feedback = servo.step(&Command::default());
        assert!(feedback.torque == Torque(0.0) && feedback.velocity.0 < last);
        last = feedback.velocity.0;
    }
    let rest = servo.step(&Command::default());
    assert_eq!(rest.velocity, Velocity(0.0));
    assert_eq!(servo.step(&Command::default()).position, rest.position);
}

/// Switches on, off when the drive trips, and on again after a reset.
fn trip_and_reset(config: PlantConfig, fault: PlantFault, cause: DriveFault) {
    let mut servo = servo(config);
    settle(&mut servo, 0.0);
    servo.plant().unwrap().inject(fault);
    let tripped = servo.step(&on(0.0));
    assert_eq!((tripped.state, tripped.torque), (DriveState::Fault(cause), Torque(0.0)));
    assert!(tripped.inputs.drive_fault);
    let reset = Command { reset_fault: true, ..Command::default() };
    assert_eq!(servo.step(&reset).state, DriveState::Fault(cause));
    servo.plant().unwrap().clear(fault);
    assert_eq!(servo.step(&on(0.0)).state, DriveState::Fault(cause));
    assert_eq!(servo.step(&reset).state, DriveState::Disabled);
    assert_eq!(settle(&mut servo, 0.0).state, DriveState::Enabled);
}

#[test]
fn what_trips_the_electronics_is_a_fault_until_it_is_gone_and_reset() {
    let injected = PlantFault::DriveFault(DriveFault::OverCurrent);
    trip_and_reset(PlantConfig::default(), injected, DriveFault::OverCurrent);
    trip_and_reset(PlantConfig::default(), PlantFault::EncoderBreak, DriveFault::Encoder);
    let dip = PlantFault::SupplyDip(Voltage(10.0));
    trip_and_reset(PlantConfig::default(), dip, DriveFault::UnderVoltage);
}

#[test]
fn a_fault_while_off_is_a_fault_too() {
    let mut servo = servo(PlantConfig::default());
    servo.plant().unwrap().inject(PlantFault::SupplyDip(Voltage(10.0)));
    assert_eq!(servo.step(&Command::default()).state, DriveState::Fault(DriveFault::UnderVoltage));
}

#[test]
fn a_fault_shorter_than_a_raster_step_is_not_missed() {
    let fault = PlantFault::SupplyDip(Voltage(10.0));
    let faults = vec![ScheduledFault { fault, from_seconds: 0.5, until_seconds: Some(0.50025) }];
    let mut servo = servo(PlantConfig { faults, ..PlantConfig::default() });
    let state = settle(&mut servo, 0.0).state;
    assert_eq!(state, DriveState::Fault(DriveFault::UnderVoltage));
}

#[test]
fn a_fault_on_the_move_lets_the_motor_coast() {
    let mut servo = servo(PlantConfig::default());
    let command = run_up(&mut servo);
    servo.plant().unwrap().inject(PlantFault::EncoderBreak);
    servo.step(&command);
    let speed = servo.plant.motor_velocity();
    assert!(speed > Velocity(40_000.0));
    while servo.plant.motor_velocity() > Velocity(0.0) {
        assert_eq!(servo.step(&command).torque, Torque(0.0));
    }
}

#[test]
fn an_overload_against_a_blocked_shaft_trips_in_time() {
    let config = PlantConfig { overload: Some(Overload::default()), ..PlantConfig::default() };
    let mut servo = servo(config);
    settle(&mut servo, 0.0);
    servo.plant().unwrap().inject(PlantFault::BlockedShaft);
    let steps = (0..).take_while(|_| servo.step(&on(1e6)).state == DriveState::Enabled).count();
    // Three times the rated torque for 9/8 s; the first steps have less.
    assert!((1124..=1126).contains(&steps), "{steps}");
    assert_eq!(servo.stage.state(), DriveState::Fault(DriveFault::Overload));
}

#[test]
fn braking_a_heavy_load_trips_over_voltage_unless_a_chopper_burns_the_energy() {
    for (chopper, expected) in
        [(None, DriveState::Fault(DriveFault::OverVoltage)), (Some(Voltage(60.0)), DriveState::Enabled)]
    {
        let supply = Supply { dc_link: Some(DcLink { chopper, ..DcLink::default() }), ..Supply::default() };
        let load = Load { inertia_kgm2: 3e-4, ..Load::default() };
        let mut servo = servo(PlantConfig { supply, load, ..PlantConfig::default() });
        settle(&mut servo, 0.0);
        let (mut position, mut velocity) = (0.0, 0.0);
        for step in 0..400_u32 {
            let acceleration = if step < 200 { 2e6 } else { -2e6 };
            position += velocity * 1e-3 + acceleration * 0.5e-6;
            velocity += acceleration * 1e-3;
            let feedback = servo.step(&following(position, velocity, acceleration));
            assert!(step >= 200 || feedback.state == DriveState::Enabled, "{step}: {feedback:?}");
        }
        assert_eq!(servo.stage.state(), expected);
    }
}

#[test]
fn it_sleeps_only_when_nothing_is_left_to_happen() {
    let fault = PlantFault::BlockedShaft;
    let faults = vec![ScheduledFault { fault, from_seconds: 0.5, until_seconds: None }];
    let mut servo = servo(PlantConfig { faults, ..PlantConfig::default() });
    for _ in 0..500 {
        servo.step(&Command::default());
        assert!(!servo.capabilities().sleeps);
    }
    servo.step(&Command::default());
    assert!(servo.capabilities().sleeps);
    servo.plant().unwrap().clear(fault);
    assert!(!servo.capabilities().sleeps);
    servo.step(&Command::default());
    assert!(servo.capabilities().sleeps);
}

#[test]
fn edges_are_reported_once() {
    let home_switch = PositionRange::new(Position(200.0), Position(9000.0));
    let mut servo = servo(PlantConfig { home_switch, ..PlantConfig::default() });
    settle(&mut servo, 0.0);
    let latches: Vec<_> = (0..1000).map(|_| servo.step(&on(300.0)).latches).collect();
    let edges: Vec<_> = latches.iter().filter_map(|latches| latches.home).collect();
    assert_eq!(edges, [Position(200.0)]);
}

/// What a jump of the set-point by `width` counts does in 2 s: the highest overshoot, and the farthest from the
/// target in the second half.
fn jump(period: Period, plant: PlantConfig, width: f64) -> (f64, f64) {
    let mut servo = SimulatedServo::new(period, ServoConfig { plant, ..ServoConfig::default() });
    let steps = (2.0 / period.seconds()) as u32;
    for _ in 0..steps {
        servo.step(&on(0.0));
    }
    let (mut overshoot, mut rest) = (0.0_f64, 0.0_f64);
    for step in 0..steps {
        let error = servo.step(&on(width)).position.0 - width;
        overshoot = overshoot.max(error);
        rest = rest.max(if step > steps / 2 { error.abs() } else { 0.0 });
    }
    (overshoot, rest)
}

/// The default motor with a load of so many times its inertia; torques in N·m.
fn loaded(ratio: f64, friction: f64, gravity_nm: f64, backlash: f64) -> PlantConfig {
    let inertia_kgm2 = ratio * 3e-5;
    let load = Load { inertia_kgm2, gravity_nm, coulomb_friction_nm: friction / 2.0, ..Load::default() };
    let backlash = Position(backlash);
    PlantConfig { coulomb_friction_nm: friction, load, backlash, ..PlantConfig::default() }
}

#[test]
fn a_jump_settles_with_any_load_friction_gravity_backlash_and_raster() {
    for nanos in [250_000, 1_000_000, 1_920_000, 8_000_000] {
        let period = Period::from_nanos(nanos).unwrap();
        for ratio in [0.0, 0.3, 1.0, 3.0, 10.0] {
            for (friction, gravity, backlash) in [
                (0.0, 0.0, 0.0),
                (0.1, 0.0, 0.0),
                (0.03, -0.6, 0.0),
                (0.0, 0.0, 60.0),
                (0.03, 0.0, 5.0),
                (0.03, 0.3, 60.0),
            ] {
                for width in [100.0, 1000.0] {
                    let config = loaded(ratio, friction, gravity, backlash);
                    let (overshoot, rest) = jump(period, config.clone(), width);
                    assert!(overshoot <= 5.0 && rest <= 1.0, "{nanos}: {overshoot} {rest} {config:?}");
                }
            }
        }
    }
}

#[test]
fn noise_makes_it_tremble_and_no_more() {
    let noise = Noise { encoder: 1.0, velocity: 500.0, seed: 1 };
    for ratio in [0.0, 1.0, 10.0] {
        let config = PlantConfig { noise, ..loaded(ratio, 0.03, 0.0, 0.0) };
        let (overshoot, rest) = jump(Period::MILLISECOND, config, 100.0);
        assert!(overshoot <= 6.0 && rest <= 6.0, "{overshoot} {rest}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn whatever_the_plant_and_the_command_every_number_is_finite(
        plant in wild_config(),
        commands in prop::collection::vec([wild(), wild(), wild(), wild()], 1..100),
    ) {
        let mut servo = servo(plant);
        for [position, velocity, acceleration, limit] in commands {
            let command = Command {
                torque_limit: TorqueLimit::both(Torque(limit)),
                reset_fault: true,
                ..following(position, velocity, acceleration)
            };
            let shown = servo.step(&command);
            let numbers = [
                shown.position.0,
                shown.velocity.0,
                shown.torque.0,
                shown.voltage.0,
                shown.temperature.0,
            ];
            prop_assert!(numbers.into_iter().all(f64::is_finite), "{numbers:?}");
        }
    }
}
