//! A generator cycle of several raster steps.

use core::num::NonZeroU32;

use axis::{Acceleration, Generator, Goal, Limits, Period, Position, Profile, SetPoint, Stepping, Velocity};
use proptest::prelude::*;

/// Raster period 2.5 ms, profile generator every 10 ms (MAC4 manual, technical data).
const RASTER: u64 = 2_500_000;
const STEPS: u32 = 4;

fn period(nanos: u64) -> Period {
    Period::from_nanos(nanos).unwrap()
}

fn cycled() -> Generator {
    Generator::new(period(RASTER), Limits::default()).with_cycle(NonZeroU32::new(STEPS).unwrap())
}

/// A generator whose raster is that cycle.
fn slow() -> Generator {
    Generator::new(period(RASTER * u64::from(STEPS)), Limits::default())
}

fn profile() -> Profile {
    Profile {
        velocity: Velocity(8192.0),
        acceleration: Acceleration(102_400.0),
        deceleration: Acceleration(204_800.0),
        jerk: None,
    }
}

fn run(generator: &mut Generator, steps: u32) -> SetPoint {
    (0..steps).for_each(|_| generator.step());
    *generator.set_point()
}

proptest! {
    #[test]
    fn a_cycle_ends_where_a_generator_of_that_period_is(
        start_stop in prop::option::of(0.0..3000.0_f64),
        goals in prop::collection::vec((-5000.0..5000.0_f64, 0..40_u32), 1..8),
    ) {
        let stepping =
            start_stop.map(|velocity| Stepping { start_stop: Velocity(velocity), creep: None });
        let (mut cycled, mut slow) = (cycled(), slow());
        cycled.set_stepping(stepping);
        slow.set_stepping(stepping);
        for (target, cycles) in goals {
            let goal = if target > 3000.0 { Goal::RunAt(Velocity(target)) } else { Goal::MoveTo(Position(target)) };
            cycled.command(goal, profile());
            slow.command(goal, profile());
            for _ in 0..cycles {
                let before = *slow.set_point();
                slow.step();
                let after = *slow.set_point();
                for step in 1..=STEPS {
                    let now = run(&mut cycled, 1);
                    let time = f64::from(step) * 0.0025;
                    let line = match stepping {
                        Some(_) => before.position.0 + after.velocity.0 * time,
                        None => before.position.0
                            + before.velocity.0 * time
                            + after.acceleration.0 / 2.0 * time * time,
                    };
                    prop_assert!((now.position.0 - line).abs() < 1e-6, "{before:?} {now:?} {after:?}");
                }
                prop_assert_eq!(cycled.set_point(), &after);
                prop_assert_eq!(cycled.is_done(), slow.is_done());
            }
        }
    }
}

#[test]
fn a_command_acts_with_the_next_cycle() {
    let mut generator = cycled();
    generator.command(Goal::RunAt(Velocity(8192.0)), profile());
    assert_eq!(run(&mut generator, 2).velocity, Velocity(512.0));
    generator.command(Goal::Stop, profile());
    assert_eq!(run(&mut generator, 2).velocity, Velocity(1024.0));
    assert!(!generator.is_done());
    assert_eq!(run(&mut generator, 2).velocity, Velocity(512.0));
    assert!(!generator.is_done());
    assert_eq!(run(&mut generator, 2).velocity, Velocity(0.0));
    assert!(generator.is_done());
}

#[test]
fn tracking_is_generated_every_raster_step() {
    let mut generator = cycled();
    let track = |target| Goal::TrackPosition { target: Position(target), over: NonZeroU32::MIN };
    for target in [1.0, 2.0, 4.0, 3.0] {
        generator.command(track(target), Profile::default());
        assert_eq!(run(&mut generator, 1).position, Position(target));
        assert!(generator.is_done());
    }
}

#[test]
fn tracking_that_begins_inside_a_cycle_is_still_in_time() {
    let mut generator = cycled();
    generator.command(Goal::RunAt(Velocity(8192.0)), profile());
    run(&mut generator, 17);
    let target = Position(200.0);
    generator.command(Goal::TrackPosition { target, over: NonZeroU32::new(10).unwrap() }, Profile::default());
    run(&mut generator, 9);
    assert!(!generator.is_done());
    assert_eq!(run(&mut generator, 1).position, target);
    assert!(generator.is_done());
}

#[test]
fn a_shift_inside_a_cycle_moves_all_of_it() {
    let (mut plain, mut shifted) = (cycled(), cycled());
    for generator in [&mut plain, &mut shifted] {
        generator.command(Goal::MoveTo(Position(1000.0)), profile());
        run(generator, 6);
    }
    shifted.shift(Position(1024.0));
    let apart = run(&mut shifted, 1).position - run(&mut plain, 1).position;
    assert!((apart - Position(1024.0)).abs() < Position(1e-9));
    assert_eq!(run(&mut shifted, 400).position, Position(2024.0));
    assert_eq!(run(&mut plain, 400).position, Position(1000.0));
}

#[test]
fn a_new_place_ends_the_cycle() {
    let mut generator = cycled();
    generator.command(Goal::RunAt(Velocity(8192.0)), profile());
    run(&mut generator, 6);
    generator.place(Position(7.0), Velocity(0.0));
    assert_eq!(run(&mut generator, 1).position, Position(7.0));
}

#[test]
fn a_goal_that_is_reached_stays_reached_in_every_raster_step() {
    let cycle = NonZeroU32::new(4).unwrap();
    for goal in [Goal::MoveTo(Position(1_000.0)), Goal::RunAt(Velocity(5_000.0)), Goal::Stop] {
        let mut generator = Generator::new(Period::MILLISECOND, Limits::default()).with_cycle(cycle);
        let profile = Profile { velocity: Velocity(5_000.0), ..Profile::default() };
        generator.command(goal, profile);
        assert!(!generator.is_done());
        let reached = (0..2_000).position(|_| {
            generator.step();
            generator.is_done()
        });
        assert!(reached.is_some_and(|step| step % 4 == 3), "with the end of a cycle: {reached:?}");
        for _ in 0..100 {
            generator.step();
            assert!(generator.is_done(), "{goal:?}");
        }
    }
}
