//! Per-cycle set-points: exact while the axis can follow, and caught up with after it could not.

use core::num::NonZeroU32;

use axis::{Acceleration, Generator, Goal, Limits, Period, Position, PositionRange, Profile, Velocity};
use proptest::prelude::*;

const TIME: f64 = 0.001;

fn limits(velocity: f64, acceleration: f64) -> Limits {
    Limits { velocity: Velocity(velocity), acceleration: Acceleration(acceleration), ..Limits::default() }
}

fn limited_to(min: f64, max: f64) -> Limits {
    Limits { position: PositionRange::new(Position(min), Position(max)), ..limits(1e4, 1e6) }
}

fn generator(limits: Limits) -> Generator {
    Generator::new(Period::MILLISECOND, limits)
}

fn track(generator: &mut Generator, target: f64, over: u32) {
    let over = NonZeroU32::new(over).unwrap();
    generator.command(Goal::TrackPosition { target: Position(target), over }, Profile::default());
}

fn track_velocity(generator: &mut Generator, target: f64, over: u32) {
    let over = NonZeroU32::new(over).unwrap();
    generator.command(Goal::TrackVelocity { target: Velocity(target), over }, Profile::default());
}

/// Positions of the next steps.
fn positions(generator: &mut Generator, steps: u32) -> Vec<f64> {
    values(generator, steps, |generator| generator.set_point().position.0)
}

/// Velocities of the next steps.
fn velocities(generator: &mut Generator, steps: u32) -> Vec<f64> {
    values(generator, steps, |generator| generator.set_point().velocity.0)
}

fn values(generator: &mut Generator, steps: u32, value: impl Fn(&Generator) -> f64) -> Vec<f64> {
    let mut next = || {
        generator.step();
        value(generator)
    };
    (0..steps).map(|_| next()).collect()
}

fn rounded(values: Vec<f64>) -> Vec<f64> {
    values.into_iter().map(f64::round).collect()
}

#[test]
fn a_target_is_passed_on_a_straight_line_and_held() {
    let mut generator = generator(limits(1e6, 1e9));
    track(&mut generator, 8.0, 4);
    assert_eq!(positions(&mut generator, 3), [2.0, 4.0, 6.0]);
    assert!(!generator.is_done());
    assert_eq!(generator.set_point().velocity, Velocity(2000.0));
    assert_eq!(positions(&mut generator, 1), [8.0]);
    assert!(generator.is_done());
    track(&mut generator, 9.0, 2);
    assert_eq!(positions(&mut generator, 4), [8.5, 9.0, 9.0, 9.0]);
    assert_eq!(generator.set_point().velocity, Velocity(0.0));
    assert!(generator.is_done() && !generator.is_limited());
}

#[test]
fn a_velocity_changes_evenly_and_is_kept() {
    let mut generator = generator(limits(1e6, 1e9));
    track_velocity(&mut generator, 4000.0, 4);
    assert_eq!(velocities(&mut generator, 6), [1000.0, 2000.0, 3000.0, 4000.0, 4000.0, 4000.0]);
    assert_eq!(positions(&mut generator, 1), [22.0]);
    assert!(generator.is_done());
}

#[test]
fn a_velocity_beyond_the_axis_maxima_is_approached_as_fast_as_they_allow() {
    let mut generator = generator(limits(2500.0, 1e6));
    track_velocity(&mut generator, 9000.0, 1);
    assert_eq!(rounded(velocities(&mut generator, 4)), [1000.0, 2000.0, 2500.0, 2500.0]);
    assert!(generator.is_done() && !generator.is_limited());
    track_velocity(&mut generator, -500.0, 1);
    assert_eq!(rounded(velocities(&mut generator, 4)), [1500.0, 500.0, -500.0, -500.0]);
}

#[test]
fn the_axis_speeds_up_and_slows_down_by_maxima_of_their_own() {
    let limits = Limits { deceleration: Some(Acceleration(5e5)), ..limits(2500.0, 1e6) };
    let mut generator = generator(limits);
    track_velocity(&mut generator, 2500.0, 1);
    assert_eq!(rounded(velocities(&mut generator, 3)), [1000.0, 2000.0, 2500.0]);
    track_velocity(&mut generator, -2500.0, 1);
    // The last step to standstill takes all of its time.
    let slowing = [2000.0, 1500.0, 1000.0, 500.0, 0.0, -1000.0, -2000.0, -2500.0];
    assert_eq!(rounded(velocities(&mut generator, 8)), slowing);
}

#[test]
fn a_jump_of_the_target_takes_the_fastest_motion_without_overshoot() {
    let mut generator = generator(limits(1e6, 1e6));
    track(&mut generator, 16.0, 1);
    // Up and down by 1000 counts/s a step.
    let way = [1.0, 3.0, 6.0, 10.0, 13.0, 15.0, 16.0, 16.0];
    for (step, expected) in way.into_iter().enumerate() {
        let here = positions(&mut generator, 1)[0];
        assert!((here - expected).abs() < 1e-5, "step {step}: {here}");
    }
    assert_eq!(generator.set_point().position, Position(16.0));
    assert!(generator.is_done());
}

#[test]
fn a_position_limit_stops_the_axis_exactly_and_lets_it_go_with_the_target() {
    let mut generator = generator(limited_to(-10.0, 10.25));
    for step in 1..=20_u32 {
        track(&mut generator, f64::from(step), 1);
        generator.step();
        assert_eq!(generator.is_limited(), step > 10, "step {step}");
    }
    assert_eq!(generator.set_point().position, Position(10.25));
    assert_eq!(generator.set_point().velocity, Velocity(0.0));
    for target in [19.0, 12.0] {
        track(&mut generator, target, 1);
        assert_eq!(positions(&mut generator, 1), [10.25]);
    }
    for target in [10.0, 9.0, 8.0] {
        track(&mut generator, target, 1);
        assert_eq!(positions(&mut generator, 1), [target]);
        assert!(!generator.is_limited());
    }
}

#[test]
fn a_velocity_running_into_a_limit_ends_exactly_there() {
    let mut generator = generator(limited_to(-10.0, 100.5));
    track_velocity(&mut generator, 5000.0, 1);
    let last = positions(&mut generator, 100).pop();
    assert_eq!(last, Some(100.5));
    assert!(generator.is_limited() && generator.set_point().velocity == Velocity(0.0));
}

#[test]
fn a_shifted_coordinate_system_shifts_the_line() {
    let mut generator = generator(limits(1e6, 1e9));
    track(&mut generator, 8.0, 4);
    generator.step();
    generator.shift(Position(100.0));
    assert_eq!(positions(&mut generator, 4), [104.0, 106.0, 108.0, 108.0]);
}

#[test]
fn the_profile_and_its_jerk_do_not_count() {
    let slow = Profile {
        velocity: Velocity(1.0),
        acceleration: Acceleration(1.0),
        deceleration: Acceleration(1.0),
        jerk: Some(axis::Jerk(1.0)),
    };
    let mut generator = generator(limits(1e6, 1e9));
    generator.command(Goal::TrackPosition { target: Position(50.0), over: NonZeroU32::MIN }, slow);
    assert_eq!(positions(&mut generator, 1), [50.0]);
}

#[test]
fn a_stop_beside_a_limit_after_tracking_stays_inside() {
    let mut generator = generator(limited_to(-10.0, 100.0));
    // On its way to a rest at 100, braking as hard as the axis can: 14 steps of 1000 counts/s each.
    track_velocity(&mut generator, 1e4, 10);
    let mut furthest = 0.0_f64;
    for step in 0..60 {
        if step == 14 {
            generator.command(Goal::Stop, Profile { deceleration: Acceleration(1e3), ..Profile::default() });
        }
        generator.step();
        furthest = furthest.max(generator.set_point().position.0);
        assert!(generator.set_point().acceleration.abs() <= Acceleration(1e6 * (1.0 + 1e-6)));
    }
    assert!(furthest <= 100.0, "{furthest}");
}

proptest! {
    #[test]
    fn within_the_bounds_every_target_is_reached_exactly_and_in_time(
        start in -1e6..1e6_f64,
        changes in prop::collection::vec((-1.0..1.0_f64, 1..12_u32), 1..40),
    ) {
        let most = 1e6 * TIME;
        let mut generator = generator(limits(1e5, 1e6));
        generator.place(Position(start), Velocity(0.0));
        let (mut target, mut velocity) = (start, 0.0_f64);
        for (change, over) in changes {
            velocity = (velocity + change * most).clamp(-1e5, 1e5);
            let before = target;
            target = before + velocity * f64::from(over) * TIME;
            track(&mut generator, target, over);
            for step in 1..=over {
                generator.step();
                let line = before + (target - before) * f64::from(step) / f64::from(over);
                prop_assert!((generator.set_point().position.0 - line).abs() < 1e-8);
                prop_assert!((generator.set_point().velocity.0 - velocity).abs() < 1e-4);
            }
            prop_assert_eq!(generator.set_point().position, Position(target));
            prop_assert!(generator.is_done() && !generator.is_limited());
        }
    }

    #[test]
    fn the_hardest_stop_onto_a_limit_is_followed_exactly(steps in 1..90_u32, max in 1.0..1e4_f64) {
        let most = 1e6 * TIME;
        let mut generator = generator(limited_to(-1e9, max));
        let limits = Limits { velocity: Velocity(1e9), ..*generator.limits() };
        generator.set_limits(limits);
        let place = |left: u32| max - f64::from(left) * f64::from(left + 1) / 2.0 * most * TIME;
        generator.place(Position(place(steps)), Velocity(f64::from(steps) * most));
        for left in (0..steps).rev() {
            track(&mut generator, place(left), 1);
            generator.step();
            prop_assert_eq!(generator.set_point().position, Position(place(left)));
        }
        prop_assert!(!generator.is_limited());
    }

    #[test]
    fn a_uniformly_moving_target_is_caught_up_with_and_not_overshot(
        own in -5e4..5e4_f64,
        ahead in -200.0..200.0_f64,
        over in 1..8_u32,
    ) {
        let most = 1e6 * TIME;
        let mut generator = generator(limits(1e5, 1e6));
        let way = own * f64::from(over) * TIME;
        let mut target = ahead;
        let mut steps = 0_u32;
        // The target passes `ahead` at the start; the first line leads there.
        track(&mut generator, target, over);
        let mut caught_up = false;
        // Nearing it from standstill takes own/most steps, and making up for them less than twice as many.
        let enough = (5.0 * own.abs() / most + 4.0 * (ahead.abs() / (most * TIME)).sqrt()) as u32 + 60;
        let mut side = 0.0_f64;
        while steps < enough {
            for _ in 0..over { generator.step(); steps += 1; }
            let behind = target - generator.set_point().position.0;
            if caught_up {
                prop_assert_eq!(generator.set_point().position, Position(target));
            }
            let relative = generator.set_point().velocity.0 - own;
            // Once it closes in and can stop on the line, it stays on its side of it.
            if side != 0.0 {
                prop_assert!(behind * side >= -1e-6, "{behind} {side}");
            } else if behind * relative > 0.0 && relative * relative / 2e6 <= behind.abs() && steps > 2 * over {
                side = behind.signum();
            }
            caught_up |= generator.is_done() && steps > 2 * over && relative.abs() < 1e-3;
            target += way;
            track(&mut generator, target, over);
        }
        prop_assert!(caught_up, "{own} {ahead} {over}");
    }
}
