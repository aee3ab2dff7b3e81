//! The whole axis on its simulated drive, and on scripted ones.

use std::collections::VecDeque;

use axis::{
    Acceleration, Axis, Command, Drive, DriveFault, DriveState, Fault, Feedback, Limits, Motion, Period,
    PlantConfig, Position, PositionRange, Profile, ServoConfig, SimulatedServo, Status, Torque, TorqueLimit,
    Velocity,
};
use proptest::prelude::*;

const PROFILE: Profile = Profile {
    velocity: Velocity(200_000.0),
    acceleration: Acceleration(2e6),
    deceleration: Acceleration(2e6),
    jerk: None,
};

fn simulated(period: Period, limits: Limits) -> Axis {
    Axis::new(period, limits, Box::new(SimulatedServo::new(period, ServoConfig::default())))
}

fn run(axis: &mut Axis, steps: u32) -> Status {
    (0..steps).for_each(|_| axis.step());
    *axis.status()
}

fn enabled() -> Axis {
    let mut axis = simulated(Period::MILLISECOND, Limits::default());
    axis.power_on();
    assert_eq!(run(&mut axis, 11).drive, DriveState::Enabled);
    axis
}

fn limited_to(min: f64, max: f64) -> Limits {
    Limits { position: PositionRange::new(Position(min), Position(max)), ..Limits::default() }
}

#[test]
fn a_move_follows_closely_and_ends_on_the_count() {
    for nanos in [250_000, 1_000_000, 1_300_000, 2_500_000, 8_000_000] {
        let period = Period::from_nanos(nanos).unwrap();
        let mut axis = simulated(period, Limits::default());
        axis.power_on();
        run(&mut axis, 11);
        axis.move_to(Position(50_000.0), PROFILE);
        let mut worst = 0.0_f64;
        while !axis.status().done {
            axis.step();
            worst = worst.max(axis.status().following_error.0.abs());
        }
        let rest = run(&mut axis, 500);
        assert!(worst <= 2.0, "{nanos}: {worst}");
        assert_eq!(rest.demand.position, Position(50_000.0));
        assert!(rest.following_error.abs() <= Position(1.0), "{nanos}: {rest:?}");
        assert_eq!((rest.actual.velocity, rest.motion), (Velocity(0.0), Motion::Standstill));
    }
}

#[test]
fn a_motion_tells_what_it_is_doing() {
    let mut axis = enabled();
    axis.move_to(Position(50_000.0), PROFILE);
    let mut seen = vec![axis.status().motion];
    while !axis.status().done {
        axis.step();
        if seen.last() != Some(&axis.status().motion) {
            seen.push(axis.status().motion);
        }
    }
    axis.step();
    assert_eq!(seen, [Motion::Standstill, Motion::Accelerating, Motion::Constant, Motion::Decelerating]);
    assert_eq!(axis.status().motion, Motion::Standstill);
}

#[test]
fn without_power_commands_are_ignored() {
    let mut axis = simulated(Period::MILLISECOND, Limits::default());
    axis.move_to(Position(5000.0), PROFILE);
    axis.power_on();
    axis.run_at(Velocity(5000.0), PROFILE);
    let status = run(&mut axis, 500);
    assert_eq!(status.demand.position, Position(0.0));
    assert_eq!(status.motion, Motion::Standstill);
}

#[test]
fn a_power_cut_lets_the_motor_coast_until_friction_stops_it() {
    let mut axis = enabled();
    axis.run_at(Velocity(100_000.0), PROFILE);
    let running = run(&mut axis, 500);
    axis.power_off();
    let mut last = running.actual;
    while last.velocity > Velocity(0.0) {
        assert!(!axis.is_quiet());
        axis.step();
        let now = axis.status();
        assert!(now.actual.velocity < last.velocity && now.actual.position >= last.position);
        assert_eq!((now.actual.torque, now.motion), (Torque(0.0), Motion::Off));
        assert_eq!(now.demand.position, now.actual.position);
        last = now.actual;
    }
    let coasted = last.position - running.actual.position;
    let by_coulomb_alone = 100_000.0 * 100_000.0 / (2.0 * 0.03 / 1.3e-4 * 8192.0 / core::f64::consts::TAU);
    assert!(coasted.0 > 0.8 * by_coulomb_alone && coasted.0 < by_coulomb_alone, "{coasted:?}");
    assert!(axis.is_quiet());
}

#[test]
fn a_quiet_axis_stays_as_it_is() {
    let mut axis = enabled();
    assert!(!axis.is_quiet());
    axis.move_to(Position(1234.0), PROFILE);
    run(&mut axis, 500);
    axis.power_off();
    let before = run(&mut axis, 1);
    assert!(axis.is_quiet());
    let after = run(&mut axis, 1000);
    assert_eq!(Status { steps: before.steps, ..after }, before);
    axis.reset_fault();
    assert!(!axis.is_quiet());
}

#[test]
fn power_comes_back_on_the_fly_without_a_jump() {
    let mut axis = enabled();
    axis.run_at(Velocity(300_000.0), PROFILE);
    run(&mut axis, 500);
    axis.power_off();
    run(&mut axis, 20);
    axis.power_on();
    let caught = run(&mut axis, 11);
    assert_eq!((caught.drive, caught.motion), (DriveState::Enabled, Motion::Constant));
    assert_eq!(caught.demand.position, caught.actual.position);
    assert!(caught.demand.velocity > Velocity(150_000.0));
    for _ in 0..500 {
        axis.step();
        assert!(axis.status().following_error.abs() <= Position(5.0), "{:?}", axis.status());
    }
    assert_eq!(axis.status().motion, Motion::Standstill);
}

#[test]
fn a_new_position_moves_the_coordinates_and_nothing_else() {
    let mut axis = enabled();
    axis.move_to(Position(20_000.0), PROFILE);
    let before = run(&mut axis, 50);
    axis.set_position(before.actual.position + Position(1_000_000.0));
    let named = *axis.status();
    assert_eq!(named.following_error, before.following_error);
    assert_eq!(named.demand.position - before.demand.position, Position(1_000_000.0));
    let rest = run(&mut axis, 1000);
    assert_eq!(rest.demand.position, Position(1_020_000.0));
    assert!(rest.following_error.abs() <= Position(1.0));
    assert_eq!(rest.index, Some(Position(1_016_384.0)));
}

#[test]
fn too_large_a_following_error_is_a_fault_until_it_is_reset() {
    let mut axis = enabled();
    axis.set_following_error_limit(Some(Position(500.0)));
    axis.set_torque_limit(TorqueLimit::both(Torque(30.0)));
    axis.move_to(Position(50_000.0), PROFILE);
    let status = run(&mut axis, 500);
    assert_eq!((status.fault, status.drive), (Some(Fault::FollowingError), DriveState::Disabled));
    axis.power_on();
    assert_eq!(run(&mut axis, 50).drive, DriveState::Disabled);
    axis.reset_fault();
    assert_eq!(run(&mut axis, 50).drive, DriveState::Disabled);
    axis.power_on();
    let status = run(&mut axis, 50);
    assert_eq!((status.fault, status.drive), (None, DriveState::Enabled));
}

#[test]
fn software_limits_stop_a_move_and_say_so() {
    let mut axis = enabled();
    axis.set_limits(limited_to(-1000.0, 1000.0));
    axis.move_to(Position(5000.0), PROFILE);
    let status = run(&mut axis, 500);
    assert_eq!(status.demand.position, Position(1000.0));
    assert!(status.done && status.limited);
    axis.move_to(Position(0.0), PROFILE);
    let status = run(&mut axis, 500);
    assert!(status.done && !status.limited);
}

#[test]
fn switches_are_reported_where_the_plant_has_them() {
    let plant = PlantConfig { positive_switch: Some(Position(3000.0)), ..PlantConfig::default() };
    let servo = SimulatedServo::new(Period::MILLISECOND, ServoConfig { plant, ..ServoConfig::default() });
    let mut axis = Axis::new(Period::MILLISECOND, Limits::default(), Box::new(servo));
    axis.power_on();
    run(&mut axis, 11);
    axis.move_to(Position(2990.0), PROFILE);
    assert!(!run(&mut axis, 500).switches.positive_limit);
    axis.move_to(Position(3010.0), PROFILE);
    assert!(run(&mut axis, 500).switches.positive_limit);
}

#[test]
fn numbers_that_make_no_sense_leave_the_axis_sane() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN] {
        let mut axis = enabled();
        let (velocity, acceleration) = (Velocity(value), Acceleration(value));
        let profile = Profile { velocity, acceleration, deceleration: acceleration, jerk: None };
        axis.set_torque_limit(TorqueLimit::both(Torque(value)));
        axis.set_following_error_limit(Some(Position(value)));
        axis.set_position(Position(value));
        axis.move_to(Position(value), profile);
        run(&mut axis, 20);
        axis.run_at(velocity, profile);
        run(&mut axis, 20);
        axis.stop(acceleration);
        axis.set_limits(Limits { velocity, acceleration, torque: Torque(value), ..Limits::default() });
        let Status { demand, actual, following_error, fault, .. } = run(&mut axis, 20);
        let numbers = [demand.position.0, demand.velocity.0, actual.position.0, following_error.0];
        assert!(numbers.into_iter().all(f64::is_finite), "{value}: {numbers:?}");
        assert_eq!(fault, None);
    }
}

/// A drive that says what it was told to say, then repeats the last.
struct Scripted {
    script: VecDeque<Feedback>,
    last: Feedback,
}

impl Drive for Scripted {
    fn step(&mut self, command: &Command) -> Feedback {
        self.last = match self.last.state {
            DriveState::Fault(_) if command.reset_fault => state(DriveState::Disabled),
            _ => self.script.pop_front().unwrap_or(self.last),
        };
        self.last
    }
}

fn state(state: DriveState) -> Feedback {
    Feedback { valid: true, state, ..Feedback::default() }
}

fn scripted(script: impl IntoIterator<Item = Feedback>) -> Axis {
    let script = script.into_iter().collect();
    let drive = Scripted { script, last: Feedback::default() };
    let mut axis = Axis::new(Period::MILLISECOND, Limits::default(), Box::new(drive));
    axis.power_on();
    axis
}

#[test]
fn a_fault_of_the_drive_is_kept_until_it_is_reset() {
    let fault = DriveState::Fault(DriveFault::OverCurrent);
    let mut axis = scripted([state(DriveState::Enabled), state(fault)]);
    assert_eq!(run(&mut axis, 2).fault, Some(Fault::Drive(DriveFault::OverCurrent)));
    assert_eq!(run(&mut axis, 5).motion, Motion::Off);
    axis.reset_fault();
    let status = run(&mut axis, 1);
    assert_eq!((status.fault, status.drive), (None, DriveState::Disabled));
}

#[test]
fn a_lost_drive_is_a_fault_that_a_reset_does_not_hide() {
    let mut axis = scripted([state(DriveState::Enabled), state(DriveState::Lost)]);
    assert_eq!(run(&mut axis, 2).fault, Some(Fault::Lost));
    axis.reset_fault();
    assert_eq!(run(&mut axis, 1).fault, Some(Fault::Lost));
    assert!(!axis.is_quiet());
}

#[test]
fn an_invalid_sample_leaves_the_last_measurement() {
    let good = Feedback { position: Position(42.0), ..state(DriveState::Disabled) };
    let bad = Feedback { position: Position(9.0), valid: false, ..good };
    let mut axis = scripted([good, bad]);
    assert_eq!(run(&mut axis, 2).actual.position, Position(42.0));
}

#[derive(Clone, Debug)]
enum Event {
    Power(bool),
    MoveTo(f64, Profile),
    RunAt(f64, Profile),
    Stop(f64),
    Limits(Limits),
    SetPosition(f64),
}

fn profiles() -> impl Strategy<Value = Profile> {
    (0.0..500_000.0_f64, 0.0..1e7_f64, 0.0..1e7_f64).prop_map(|(velocity, up, down)| Profile {
        velocity: Velocity(velocity),
        acceleration: Acceleration(up),
        deceleration: Acceleration(down),
        jerk: None,
    })
}

fn limits() -> impl Strategy<Value = Limits> {
    (-30_000.0..10_000.0_f64, 0.0..30_000.0_f64).prop_map(|(min, width)| limited_to(min, min + width))
}

fn events() -> impl Strategy<Value = Event> {
    prop_oneof![
        3 => (-40_000.0..40_000.0_f64, profiles()).prop_map(|(target, profile)| Event::MoveTo(target, profile)),
        3 => (-5e5..5e5_f64, profiles()).prop_map(|(velocity, profile)| Event::RunAt(velocity, profile)),
        1 => (0.0..1e7_f64).prop_map(Event::Stop),
        1 => limits().prop_map(Event::Limits),
        1 => (-20_000.0..20_000.0_f64).prop_map(Event::SetPosition),
        1 => prop::bool::weighted(0.7).prop_map(Event::Power),
    ]
}

fn apply(axis: &mut Axis, event: &Event) {
    match event {
        Event::Power(true) => axis.power_on(),
        Event::Power(false) => axis.power_off(),
        Event::MoveTo(target, profile) => axis.move_to(Position(*target), *profile),
        Event::RunAt(velocity, profile) => axis.run_at(Velocity(*velocity), *profile),
        Event::Stop(deceleration) => axis.stop(Acceleration(*deceleration)),
        Event::Limits(limits) => axis.set_limits(*limits),
        Event::SetPosition(position) => axis.set_position(Position(*position)),
    }
}

/// The places the demand may reach: the limits, and what braking with all the axis has cannot avoid.
fn reach(axis: &Axis) -> (f64, f64) {
    let (demand, limits) = (axis.status().demand, axis.limits());
    let (position, velocity) = (demand.position.0, demand.velocity.0);
    let most = limits.acceleration.0;
    let rounding_up = most * axis.period().seconds().powi(2);
    let stop = position + velocity * velocity.abs() / (2.0 * most) + velocity.signum() * rounding_up;
    (limits.range().min().0.min(position.min(stop)), limits.range().max().0.max(position.max(stop)))
}

/// Whether the event may put the axis where it cannot keep a position limit.
fn redefines(axis: &Axis, event: &Event) -> bool {
    matches!(event, Event::Limits(_) | Event::SetPosition(_)) || axis.status().motion == Motion::Off
}

fn check(axis: &Axis, (low, high): (f64, f64)) -> Result<(), TestCaseError> {
    let (status, limits) = (axis.status(), axis.limits());
    let (position, velocity) = (status.demand.position.0, status.demand.velocity.0);
    prop_assert!(position.is_finite() && status.actual.position.0.is_finite());
    prop_assert!(velocity.abs() <= limits.velocity.0 * (1.0 + 1e-9));
    prop_assert!(status.demand.acceleration.0.abs() <= limits.acceleration.0 * (1.0 + 1e-9));
    prop_assert!(position >= low - 1e-6 && position <= high + 1e-6, "{low} {position} {high}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_sequence_of_commands_breaks_a_limit_of_the_axis(
        start in limits(),
        scenario in prop::collection::vec((events(), 0..100_u32), 1..12),
    ) {
        let mut axis = simulated(Period::MILLISECOND, start);
        axis.power_on();
        run(&mut axis, 11);
        let mut bounds = reach(&axis);
        for (event, steps) in scenario {
            let redefined = redefines(&axis, &event);
            apply(&mut axis, &event);
            if redefined {
                bounds = reach(&axis);
            }
            for _ in 0..steps {
                let was_off = axis.status().motion == Motion::Off;
                axis.step();
                if was_off || axis.status().motion == Motion::Off {
                    bounds = reach(&axis);
                }
                check(&axis, bounds)?;
            }
        }
    }

    #[test]
    fn the_same_commands_give_the_same_bits(
        scenario in prop::collection::vec((events(), 0..60_u32), 1..8),
    ) {
        let trace = || {
            let mut axis = simulated(Period::MILLISECOND, Limits::default());
            axis.power_on();
            let mut bits = Vec::new();
            for (event, steps) in &scenario {
                apply(&mut axis, event);
                let status = run(&mut axis, *steps);
                let Status { demand, actual, .. } = status;
                bits.push([demand.position.0, demand.velocity.0, actual.position.0, actual.velocity.0, actual.torque.0].map(f64::to_bits));
            }
            bits
        };
        prop_assert_eq!(trace(), trace());
    }
}
