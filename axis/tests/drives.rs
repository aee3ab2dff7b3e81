//! Axes on the drives of a controller card: analogue outputs under its own controller, and pulse outputs.

mod bench;

use std::num::NonZeroU32;

use axis::{
    Acceleration, AnalogConfig, AnalogDrive, Axis, Coding, Creep, DriveFault, DriveState, Fault, Finish,
    Limits, Load, Mark, Order, Period, PlantConfig, PlantFault, Position, Profile, Scale, SensorConfig,
    ServoConfig, SimulatedServo, Standby, Status, StepConfig, StepDrive, StepFeedback, Stepping, Torque,
    Travel, Turn, Velocity,
};
use bench::{complete, run, run_until, seek};

const SERVO: Period = match Period::from_nanos(2_500_000) {
    Some(period) => period,
    None => Period::MILLISECOND,
};
const STEPPER: Period = match Period::from_nanos(8_000_000) {
    Some(period) => period,
    None => Period::MILLISECOND,
};
/// The generator runs every fourth raster step: 10 ms and 32 ms (MAC4 User Manual, section 7.4).
const CYCLE: NonZeroU32 = match NonZeroU32::new(4) {
    Some(cycle) => cycle,
    None => NonZeroU32::MIN,
};

const PROFILE: Profile = Profile {
    velocity: Velocity(50_000.0),
    acceleration: Acceleration(200_000.0),
    deceleration: Acceleration(200_000.0),
    jerk: None,
};

fn servo(config: AnalogConfig) -> Axis {
    let drive = AnalogDrive::new(SERVO, config);
    let mut axis = Axis::with_generator_cycle(SERVO, CYCLE, Limits::default(), Box::new(drive));
    axis.power_on();
    assert_eq!(run(&mut axis, 2).drive, DriveState::Enabled);
    axis
}

fn stepper(config: StepConfig) -> Axis {
    let limits =
        Limits { velocity: Velocity(40_000.0), acceleration: Acceleration(100_000.0), ..Limits::default() };
    let drive = StepDrive::new(STEPPER, config);
    let mut axis = Axis::with_generator_cycle(STEPPER, CYCLE, limits, Box::new(drive));
    axis.set_stepping(Some(Stepping {
        start_stop: Velocity(400.0),
        creep: Some(Creep { distance: Position(20.0), velocity: Velocity(200.0) }),
    }));
    axis.power_on();
    assert_eq!(run(&mut axis, 2).drive, DriveState::Enabled);
    axis
}

/// Lets everything come to rest.
fn settle(axis: &mut Axis) -> Status {
    run(axis, 800)
}

#[test]
fn a_sampled_controller_moves_an_analogue_drive_to_the_count() {
    let mut axis = servo(AnalogConfig::default());
    axis.order(Order::MoveTo(Position(60_000.0), PROFILE));
    let mut worst = 0.0_f64;
    while !axis.status().done {
        axis.step();
        worst = worst.max(axis.status().following_error.0.abs());
    }
    assert!(worst > 10.0 && worst < 1500.0, "it follows with a lag: {worst}");
    let rest = settle(&mut axis);
    assert!(rest.following_error.abs() <= Position(3.0), "{rest:?}");
}

#[test]
fn a_position_measured_over_the_end_of_its_counter_goes_on() {
    let sensor = SensorConfig::incremental(12);
    let mut axis = servo(AnalogConfig { sensor, ..AnalogConfig::default() });
    complete(&mut axis, Order::MoveTo(Position(-123_456.0), PROFILE));
    assert!((settle(&mut axis).actual.position.0 + 123_456.0).abs() <= 3.0);
}

#[test]
fn an_absolute_encoder_knows_where_it_is_and_faults_beyond_its_range() {
    let sensor = SensorConfig { range: 10_000, ..SensorConfig::ssi(14, 2, Coding::Gray) };
    let plant = PlantConfig { start: Position(7_000.0), ..PlantConfig::default() };
    let mut axis = servo(AnalogConfig { sensor, plant, ..AnalogConfig::default() });
    assert_eq!(axis.status().actual.position, Position(7_000.0));
    complete(&mut axis, Order::MoveTo(Position(9_000.0), PROFILE));
    assert!((settle(&mut axis).actual.position.0 - 9_000.0).abs() <= 3.0);
}

#[test]
fn a_value_beyond_the_range_is_an_encoder_error_and_the_motor_coasts() {
    // A sensor of 14 bits of which the controller believes only 10000 values.
    let mut axis = servo(AnalogConfig {
        sensor: SensorConfig { range: 10_000, ..SensorConfig::ssi(14, 0, Coding::Binary) },
        ..AnalogConfig::default()
    });
    axis.plant().unwrap().inject(PlantFault::EncoderBreak);
    let status = run(&mut axis, 1);
    assert_eq!(status.fault, Some(Fault::Drive(DriveFault::Encoder)));
    assert_eq!(run(&mut axis, 1).actual.torque, Torque(0.0));
}

#[test]
fn a_drive_that_is_not_heard_any_more_coasts_and_is_off_when_it_is_back() {
    let servo_itself = || {
        let drive = SimulatedServo::new(Period::MILLISECOND, ServoConfig::default());
        let mut axis = Axis::new(Period::MILLISECOND, Limits::default(), Box::new(drive));
        axis.power_on();
        run(&mut axis, 20);
        axis
    };
    for mut axis in [servo_itself(), servo(AnalogConfig::default()), stepper(StepConfig::default())] {
        axis.order(Order::RunAt(Velocity(5_000.0), PROFILE));
        assert!(run(&mut axis, 100).actual.velocity.0 > 4_000.0);
        axis.plant().unwrap().inject(PlantFault::ConnectionLoss);
        let before = run(&mut axis, 1);
        assert_eq!((before.drive, before.fault), (DriveState::Lost, Some(Fault::Lost)));
        let lost = run(&mut axis, 100);
        assert_eq!(lost.actual, before.actual, "the last that was heard");
        assert!(!axis.is_quiet(), "it listens");
        axis.reset_fault();
        assert_eq!(run(&mut axis, 2).fault, Some(Fault::Lost), "the cause lasts");
        axis.plant().unwrap().clear(PlantFault::ConnectionLoss);
        let back = run(&mut axis, 1);
        assert_eq!((back.drive, back.fault), (DriveState::Disabled, Some(Fault::Lost)));
        assert_ne!(back.actual.position, before.actual.position, "it has coasted");
        axis.reset_fault();
        axis.power_on();
        let enabled = run(&mut axis, 20);
        assert_eq!((enabled.drive, enabled.fault), (DriveState::Enabled, None));
    }
}

#[test]
fn a_circular_axis_on_an_analogue_drive_takes_the_shortest_way() {
    let mut axis = servo(AnalogConfig::default());
    axis.set_travel(Travel::CircularOptimised(Turn::new(Position(8192.0)).unwrap()));
    complete(&mut axis, Order::MoveTo(Position(8000.0), PROFILE));
    let rest = settle(&mut axis);
    assert!((rest.actual.position.0 - 8000.0).abs() <= 3.0);
    assert!((axis.plant().unwrap().motor_position().0 + 192.0).abs() <= 3.0);
}

#[test]
fn a_motor_that_turns_the_wrong_way_ends_in_a_following_error() {
    let mut axis = servo(AnalogConfig { reversed: true, ..AnalogConfig::default() });
    axis.set_following_error_limit(Some(Position(3000.0)));
    axis.order(Order::MoveTo(Position(60_000.0), PROFILE));
    run_until(&mut axis, |status| status.fault == Some(Fault::FollowingError));
}

#[test]
fn the_index_is_found_through_the_register_of_the_encoder() {
    let plant = PlantConfig { index: Position(1000.0), ..PlantConfig::default() };
    let mut axis = servo(AnalogConfig { plant, ..AnalogConfig::default() });
    let status = complete(&mut axis, seek(Mark::Index, 10_000.0, Finish::Return));
    assert_eq!((status.mark, status.demand.position), (Some(Position(1000.0)), Position(1000.0)));
}

#[test]
fn the_test_output_turns_the_motor_past_the_controller() {
    let mut axis = servo(AnalogConfig { reversed: true, ..AnalogConfig::default() });
    axis.order(Order::Output(0.1));
    let status = run(&mut axis, 400);
    // A tenth of 409600 counts/s, whatever the sign of the controller's output.
    assert!((status.actual.velocity.0 - 40_960.0).abs() < 500.0, "{status:?}");
}

#[test]
fn a_stepper_ends_exactly_on_the_step() {
    let mut axis = stepper(StepConfig::default());
    for target in [5000.0, -321.0, -320.0, 40_000.0] {
        let profile = Profile { velocity: Velocity(8000.0), ..PROFILE };
        complete(&mut axis, Order::MoveTo(Position(target), profile));
        let rest = run(&mut axis, 100);
        assert_eq!((rest.actual.position, rest.demand.position), (Position(target), Position(target)));
    }
    // 8192 counts per 3200 steps.
    let rotor = axis.plant().unwrap().motor_position().0;
    assert!((rotor - 40_000.0 * 2.56).abs() < 3.0, "{rotor}");
}

#[test]
fn boost_leads_every_motion() {
    let mut axis = stepper(StepConfig { boost_lead_nanos: 80_000_000, ..StepConfig::default() });
    axis.order(Order::MoveTo(Position(5000.0), PROFILE));
    let rest = run(&mut axis, 10);
    assert_eq!((rest.demand.position, rest.actual.position), (Position(0.0), Position(0.0)));
    let status = run(&mut axis, 8);
    assert!(status.actual.position > Position(5.0), "{status:?}");
    assert!(status.following_error.abs() <= Position(1.0), "{status:?}");
}

#[test]
fn an_encoder_shows_the_position_in_steps_without_drift() {
    // 8192 increments are 3200 steps.
    let feedback = StepFeedback::Encoder {
        sensor: SensorConfig::incremental(16),
        scale: Scale::of_encoder(2048, 3200).unwrap(),
    };
    let mut axis = stepper(StepConfig { feedback, ..StepConfig::default() });
    for target in [100_000.0, -7.0] {
        complete(&mut axis, Order::MoveTo(Position(target), PROFILE));
        let rest = run(&mut axis, 200);
        assert!(rest.following_error.abs() <= Position(1.0), "{rest:?}");
    }
}

#[test]
fn lost_steps_are_a_following_error_with_an_encoder_and_unseen_without() {
    let encoder = StepFeedback::Encoder {
        sensor: SensorConfig::incremental(16),
        scale: Scale::of_encoder(2048, 3200).unwrap(),
    };
    for (feedback, fault) in [(StepFeedback::Counter, None), (encoder, Some(Fault::FollowingError))] {
        let mut axis = stepper(StepConfig { feedback, ..StepConfig::default() });
        axis.set_following_error_limit(Some(Position(500.0)));
        axis.order(Order::MoveTo(Position(20_000.0), PROFILE));
        run(&mut axis, 20);
        axis.plant().unwrap().inject(PlantFault::BlockedShaft);
        assert_eq!(run(&mut axis, 300).fault, fault);
    }
}

#[test]
fn turbo_reaches_ten_times_the_frequency() {
    for (turbo, highest) in [(false, 50_000.0), (true, 500_000.0)] {
        let mut axis = stepper(StepConfig { turbo, ..StepConfig::default() });
        axis.order(Order::Output(1.0));
        assert!((run(&mut axis, 20).actual.velocity.0 - highest).abs() < 1.0);
    }
}

#[test]
fn an_inner_pulse_output_may_be_faster_by_a_factor() {
    let frequency_factor = NonZeroU32::new(1000).unwrap();
    let mut axis = stepper(StepConfig { frequency_factor, ..StepConfig::default() });
    axis.order(Order::Output(1.0));
    assert!((run(&mut axis, 20).actual.velocity.0 - 50_000_000.0).abs() < 1.0);
}

#[test]
fn at_standstill_the_torque_falls_and_a_load_that_it_does_not_hold_turns_the_motor() {
    let encoder = StepFeedback::Encoder {
        sensor: SensorConfig::incremental(32),
        scale: Scale::of_encoder(2048, 3200).unwrap(),
    };
    let load = |gravity_nm| Load { gravity_nm, ..Load::default() };
    // The rated torque is 1.27 Nm.
    for (gravity_nm, has_slipped) in [(-0.25, false), (-0.6, true)] {
        let plant = PlantConfig { load: load(0.0), viscous_friction_nms: 5e-3, ..PlantConfig::default() };
        let mut axis = stepper(StepConfig { plant, feedback: encoder, ..StepConfig::default() });
        axis.set_standby(Some(Standby { after: 100, limit: Torque(250.0) }));
        axis.plant().unwrap().set_load(load(gravity_nm));
        let held = run(&mut axis, 90);
        assert!(held.following_error.abs() < Position(16.0), "{held:?}");
        let later = run(&mut axis, 100);
        assert_eq!(later.following_error > Position(100.0), has_slipped, "{later:?}");
    }
}

#[test]
fn a_motion_has_its_full_torque_from_the_start() {
    let mut axis = stepper(StepConfig::default());
    axis.set_standby(Some(Standby { after: 10, limit: Torque(0.0) }));
    run(&mut axis, 50);
    axis.plant().unwrap().set_load(Load { gravity_nm: -0.1, ..Load::default() });
    let before = axis.plant().unwrap().motor_position();
    complete(&mut axis, Order::MoveTo(Position(20_000.0), PROFILE));
    let way = axis.plant().unwrap().motor_position() - before;
    assert!((way.0 - 20_000.0 * 8192.0 / 3200.0).abs() < 200.0, "{way:?}");
}
