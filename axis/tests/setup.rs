//! Drives that are set up anew while the axis is without power, and faults that come from outside.

mod bench;

use std::num::NonZeroU32;

use axis::{
    Acceleration, AnalogConfig, AnalogDrive, Axis, Coefficients, Fault, Guard, Limits, Motion, Order, Period,
    Position, Profile, Reaction, Scale, SensorConfig, Setting, Source, StepConfig, StepDrive, Velocity,
};
use bench::{complete, run, run_until};

const CYCLE: NonZeroU32 = match NonZeroU32::new(4) {
    Some(cycle) => cycle,
    None => NonZeroU32::MIN,
};

const PROFILE: Profile = Profile {
    velocity: Velocity(10_000.0),
    acceleration: Acceleration(100_000.0),
    deceleration: Acceleration(100_000.0),
    jerk: None,
};

fn period(nanos: u64) -> Period {
    Period::from_nanos(nanos).unwrap()
}

fn servo() -> Axis {
    let period = period(2_500_000);
    let drive = AnalogDrive::new(period, AnalogConfig::default());
    Axis::with_generator_cycle(period, CYCLE, Limits::default(), Box::new(drive))
}

fn stepper() -> Axis {
    let period = period(8_000_000);
    let drive = StepDrive::new(period, StepConfig::default());
    Axis::with_generator_cycle(period, CYCLE, Limits::default(), Box::new(drive))
}

fn on(mut axis: Axis) -> Axis {
    axis.power_on();
    run(&mut axis, 3);
    axis
}

fn off(axis: &mut Axis) {
    axis.power_off();
    run(axis, 400);
}

#[test]
fn a_reversed_stepper_turns_the_other_way_from_where_it_stands() {
    let mut axis = on(stepper());
    complete(&mut axis, Order::MoveTo(Position(3200.0), PROFILE));
    run(&mut axis, 100);
    let forward = axis.plant_view().unwrap().motor_position().0;
    assert!((forward - 8192.0).abs() < 20.0, "{forward}");
    off(&mut axis);
    axis.configure(Setting::Reversed(true));
    axis.power_on();
    run(&mut axis, 50);
    let standing = axis.plant_view().unwrap().motor_position().0;
    assert!((standing - forward).abs() < 20.0, "it stays: {standing}");
    complete(&mut axis, Order::MoveTo(Position(6400.0), PROFILE));
    run(&mut axis, 100);
    let back = axis.plant_view().unwrap().motor_position().0;
    assert!(back.abs() < 20.0, "{back}");
    assert_eq!(axis.status().actual.position, Position(6400.0));
}

#[test]
fn a_new_source_tells_the_place_at_once_and_the_demand_with_it() {
    let mut axis = on(servo());
    complete(&mut axis, Order::MoveTo(Position(5_000.0), PROFILE));
    run(&mut axis, 200);
    off(&mut axis);
    axis.configure(Setting::Source(Source::Elsewhere(
        SensorConfig::ssi(20, 0, axis::Coding::Gray),
        Scale::ONE,
    )));
    let status = axis.status();
    assert!((status.actual.position.0 - 5_000.0).abs() < 20.0, "{status:?}");
    assert_eq!(status.following_error, Position(0.0));
    axis.configure(Setting::Source(Source::Own(SensorConfig::incremental(16), Scale::ONE)));
    assert_eq!(axis.status().actual.position, Position(0.0), "a relative sensor begins at zero");
}

#[test]
fn an_axis_follows_the_words_of_its_host() {
    let mut axis = servo();
    axis.configure(Setting::Source(Source::Host(SensorConfig::incremental(16), Scale::ONE)));
    for word in [100, 250, 65_000] {
        axis.configure(Setting::Word(word));
        run(&mut axis, 1);
    }
    assert_eq!(axis.status().actual.position, Position(-536.0));
    assert_eq!(axis.signals().word, 65_000);
}

#[test]
fn coefficients_act_from_the_next_step_on() {
    let mut axis = on(servo());
    let stiff = Coefficients { gain: 0, zero: 0, pole: 0, integral: 0, integral_shift: 0 };
    axis.configure(Setting::Coefficients(stiff));
    axis.order(Order::MoveTo(Position(1_000.0), PROFILE));
    run(&mut axis, 200);
    assert_eq!(axis.status().actual.position, Position(0.0), "without any gain nothing moves");
    axis.configure(Setting::Coefficients(AnalogConfig::default().coefficients));
    run(&mut axis, 800);
    assert!((axis.status().actual.position.0 - 1_000.0).abs() < 5.0);
}

#[test]
fn a_fault_from_outside_brakes_as_an_own_one_does() {
    let mut axis = on(servo());
    axis.set_guard(Guard { supervision: Reaction::Brake, ..Guard::default() });
    axis.order(Order::RunAt(Velocity(10_000.0), PROFILE));
    run(&mut axis, 200);
    axis.raise(Fault::Supervision);
    assert_eq!(axis.status().fault, Some(Fault::Supervision));
    run_until(&mut axis, |status| status.motion == Motion::Decelerating);
    run_until(&mut axis, |status| status.motion == Motion::Off);
    axis.reset_fault();
    axis.power_on();
    run(&mut axis, 3);
    axis.order(Order::RunAt(Velocity(10_000.0), PROFILE));
    run(&mut axis, 100);
    axis.raise(Fault::EmergencyStop);
    run(&mut axis, 1);
    assert_eq!(axis.status().motion, Motion::Off, "an emergency stop coasts");
}
