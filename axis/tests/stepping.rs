//! The motion of a stepper: MAC4 manual, sections 4.1.2, 5.6 and 5.14, diagram 5.2.

use core::num::NonZeroU32;

use axis::{
    Acceleration, Creep, Generator, Goal, Limits, Period, Position, PositionRange, Profile, Stepping,
    Velocity,
};
use proptest::prelude::*;

/// The raster period of these tests.
const TIME: f64 = 0.01;

/// A stepper that starts and stops at 1000 Hz.
fn stepper(creep: Option<(f64, f64)>) -> Generator {
    let creep = creep
        .map(|(distance, velocity)| Creep { distance: Position(distance), velocity: Velocity(velocity) });
    with_limits(Limits::default(), Stepping { start_stop: Velocity(1000.0), creep })
}

fn with_limits(limits: Limits, stepping: Stepping) -> Generator {
    let mut generator = Generator::new(Period::from_nanos(10_000_000).unwrap(), limits);
    generator.set_stepping(Some(stepping));
    generator
}

/// Rises by 500 Hz and falls by 1000 Hz a step.
fn profile(velocity: f64) -> Profile {
    Profile {
        velocity: Velocity(velocity),
        acceleration: Acceleration(5e4),
        deceleration: Acceleration(1e5),
        jerk: None,
    }
}

/// Velocities of the steps until the goal is reached, in whole Hz.
fn velocities(generator: &mut Generator) -> Vec<f64> {
    let mut all = Vec::new();
    while !generator.is_done() && all.len() < 10_000 {
        generator.step();
        all.push(generator.set_point().velocity.0.round());
    }
    all
}

#[test]
fn a_move_has_the_phases_of_the_manual() {
    let mut generator = stepper(Some((10.0, 200.0)));
    generator.command(Goal::MoveTo(Position(200.0)), profile(3000.0));
    let up = [1000.0, 1500.0, 2000.0, 2500.0];
    let constant = [3000.0; 3];
    let down = [2000.0, 1000.0];
    let creep = [200.0; 5];
    let expected: Vec<f64> = [&up[..], &constant, &down, &creep, &[0.0]].concat();
    assert_eq!(velocities(&mut generator), expected);
    assert_eq!(generator.set_point().position, Position(200.0));
}

#[test]
fn a_velocity_below_start_stop_starts_and_stops_at_once() {
    let mut generator = stepper(None);
    generator.command(Goal::MoveTo(Position(24.0)), profile(800.0));
    assert_eq!(velocities(&mut generator), [800.0, 800.0, 800.0, 0.0]);
    generator.command(Goal::RunAt(Velocity(-700.0)), profile(800.0));
    assert_eq!(velocities(&mut generator), [-700.0]);
    generator.command(Goal::Stop, profile(800.0));
    assert_eq!(velocities(&mut generator), [0.0]);
}

#[test]
fn the_last_step_takes_what_is_left_at_a_lower_frequency() {
    let mut generator = stepper(None);
    generator.command(Goal::MoveTo(Position(27.0)), profile(1000.0));
    assert_eq!(velocities(&mut generator), [1000.0, 1000.0, 700.0, 0.0]);
    assert_eq!(generator.set_point().position, Position(27.0));
}

#[test]
fn a_move_shorter_than_the_creep_is_all_creep() {
    let mut generator = stepper(Some((10.0, 200.0)));
    generator.command(Goal::MoveTo(Position(-7.0)), profile(3000.0));
    assert_eq!(velocities(&mut generator), [-200.0, -200.0, -200.0, -100.0, 0.0]);
    assert_eq!(generator.set_point().position, Position(-7.0));
}

#[test]
fn a_creep_is_never_faster_than_start_stop() {
    let mut generator = stepper(Some((30.0, 5000.0)));
    generator.command(Goal::MoveTo(Position(30.0)), profile(3000.0));
    assert_eq!(velocities(&mut generator), [1000.0, 1000.0, 1000.0, 0.0]);
}

#[test]
fn a_stop_ramps_down_to_start_stop_and_ends_on_a_whole_count() {
    let mut generator = stepper(None);
    generator.command(Goal::RunAt(Velocity(2550.0)), profile(3000.0));
    velocities(&mut generator);
    assert_eq!(generator.set_point().position, Position(95.5));
    generator.command(Goal::Stop, profile(3000.0));
    assert_eq!(velocities(&mut generator), [1550.0, 550.0, 50.0, 0.0]);
    assert_eq!(generator.set_point().position, Position(117.0));
}

#[test]
fn a_reversal_passes_standstill() {
    let mut generator = stepper(None);
    generator.command(Goal::RunAt(Velocity(2000.0)), profile(3000.0));
    velocities(&mut generator);
    generator.command(Goal::RunAt(Velocity(-2000.0)), profile(3000.0));
    assert_eq!(velocities(&mut generator), [1000.0, 0.0, -1000.0, -1500.0, -2000.0]);
}

#[test]
fn a_target_too_near_is_passed_and_returned_to() {
    let mut generator = stepper(None);
    generator.command(Goal::RunAt(Velocity(3000.0)), profile(3000.0));
    velocities(&mut generator);
    let target = generator.set_point().position + Position(10.0);
    generator.command(Goal::MoveTo(target), profile(3000.0));
    assert_eq!(velocities(&mut generator), [2000.0, 1000.0, 0.0, -1000.0, -1000.0, 0.0]);
    assert_eq!(generator.set_point().position, target);
}

#[test]
fn a_velocity_running_into_a_limit_ramps_down_and_ends_exactly_there() {
    let limits = Limits { position: PositionRange::new(Position(0.0), Position(105.0)), ..Limits::default() };
    let mut generator = with_limits(limits, Stepping { start_stop: Velocity(1000.0), creep: None });
    generator.command(Goal::RunAt(Velocity(2500.0)), profile(2500.0));
    let seen: Vec<f64> = (0..8)
        .map(|_| {
            generator.step();
            generator.set_point().velocity.0.round()
        })
        .collect();
    assert_eq!(seen, [1000.0, 1500.0, 2000.0, 2500.0, 2167.0, 1167.0, 167.0, 0.0]);
    assert_eq!(generator.set_point().position, Position(105.0));
    assert!(generator.is_limited());
}

#[test]
fn tracking_stops_at_a_limit_from_start_stop_at_once() {
    let position = PositionRange::new(Position(-50.0), Position(95.0));
    let limits = Limits { position, acceleration: Acceleration(1e4), ..Limits::default() };
    let mut generator = with_limits(limits, Stepping { start_stop: Velocity(1000.0), creep: None });
    generator.command(Goal::RunAt(Velocity(900.0)), profile(900.0));
    (0..10).for_each(|_| generator.step());
    assert_eq!(generator.set_point().position, Position(90.0));
    let over = NonZeroU32::MIN;
    generator.command(Goal::TrackVelocity { target: Velocity(900.0), over }, Profile::default());
    generator.step();
    assert_eq!(generator.set_point().position, Position(95.0));
    generator.step();
    assert_eq!(generator.set_point().velocity, Velocity(0.0));
    assert!(generator.is_limited());
}

#[test]
fn tracking_may_jump_within_start_stop() {
    let limits = Limits { acceleration: Acceleration(1e4), ..Limits::default() };
    let mut generator = with_limits(limits, Stepping { start_stop: Velocity(1000.0), creep: None });
    for target in [10.0, 20.0, 25.0, 25.0, 15.0, 15.0] {
        let target = Position(target);
        generator.command(Goal::TrackPosition { target, over: NonZeroU32::MIN }, Profile::default());
        generator.step();
        assert_eq!(generator.set_point().position, target);
    }
}

#[test]
fn a_stepper_without_a_start_stop_velocity_ramps_all_the_way() {
    let mut generator = with_limits(Limits::default(), Stepping::default());
    generator.command(Goal::MoveTo(Position(80.0)), profile(2000.0));
    let expected = [500.0, 1000.0, 1500.0, 2000.0, 2000.0, 1000.0, 0.0];
    assert_eq!(velocities(&mut generator), expected);
}

proptest! {
    #[test]
    fn a_move_creeps_its_last_counts_and_ends_on_the_step(
        target in -3000..3000_i32,
        distance in 0..40_u32,
        creep in 10.0..1000.0_f64,
        velocity in 1000.0..9000.0_f64,
    ) {
        let mut generator = stepper(Some((f64::from(distance), creep)));
        let target = f64::from(target);
        generator.command(Goal::MoveTo(Position(target)), profile(velocity));
        let mut last = *generator.set_point();
        for _ in 0..10_000 {
            generator.step();
            let now = *generator.set_point();
            let left = (target - last.position.0).abs();
            if left <= f64::from(distance) {
                prop_assert!(now.velocity.0.abs() <= creep * (1.0 + 1e-6), "{now:?}");
            }
            let whole = left > creep * TIME && left <= f64::from(distance) ;
            prop_assert!(!whole || now.velocity.0.abs() >= creep * (1.0 - 1e-6), "{now:?}");
            prop_assert!((target - now.position.0) * target.signum() >= 0.0);
            last = now;
            if generator.is_done() { break; }
        }
        prop_assert!(generator.is_done());
        prop_assert_eq!(last.position, Position(target));
    }

    #[test]
    fn a_move_without_creep_takes_the_time_of_its_ramps(
        target in 1..5000_i32,
        velocity in 1000.0..9000.0_f64,
    ) {
        let mut generator = stepper(None);
        let target = f64::from(target);
        generator.command(Goal::MoveTo(Position(target)), profile(velocity));
        let steps = velocities(&mut generator).len() as f64;
        // Between 1000 Hz and the peak the ramps are those of a trapezoid.
        let (low, up, down) = (1000.0_f64, 5e4_f64, 1e5_f64);
        let peak = (low * low + 2.0 * target * up * down / (up + down)).sqrt().min(velocity);
        let ramps = (peak - low) / up + (peak - low) / down;
        let rest = target - (peak * peak - low * low) / 2.0 * (1.0 / up + 1.0 / down);
        let ideal = (ramps + rest / peak) / TIME;
        prop_assert!(steps >= ideal - 1.0 && steps <= ideal + 4.0, "{steps} {ideal}");
    }
}
