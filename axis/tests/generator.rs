//! What the generator keeps whatever it is told, and when.

use core::num::NonZeroU32;

use axis::{
    Acceleration, Creep, Generator, Goal, Limits, Period, Position, PositionRange, Profile, SetPoint,
    Stepping, Torque, Velocity,
};
use proptest::prelude::*;

/// Relative room for rounding.
const NEARLY: f64 = 1e-6;

/// Room for rounding of positions, in counts.
const HAIR: f64 = 1e-6;

#[derive(Clone, Debug)]
enum Event {
    Command(Goal, Profile),
    Limit(Limits),
}

fn periods() -> impl Strategy<Value = Period> {
    prop::sample::select(vec![250_000, 1_000_000, 1_920_000, 8_000_000])
        .prop_map(|nanos| Period::from_nanos(nanos).unwrap())
}

fn goals() -> impl Strategy<Value = Goal> {
    prop_oneof![
        3 => (-2000.0..2000.0_f64).prop_map(|target| Goal::MoveTo(Position(target.round()))),
        2 => (-30_000.0..30_000.0_f64).prop_map(|velocity| Goal::RunAt(Velocity(velocity))),
        1 => Just(Goal::Stop),
    ]
}

/// Magnitudes over several decades.
fn decades(from: f64, powers: u32) -> impl Strategy<Value = f64> {
    (0..powers, 1.0..10.0_f64).prop_map(move |(power, digits)| from * digits * 10.0_f64.powi(power as i32))
}

/// Profiles that finish soon.
fn brisk() -> impl Strategy<Value = Profile> {
    ramps(decades(1e4, 1), decades(1e5, 2), decades(1e5, 2))
}

fn profiles() -> impl Strategy<Value = Profile> {
    ramps(decades(10.0, 4), decades(1e3, 4), decades(1e3, 4))
}

fn ramps(
    velocity: impl Strategy<Value = f64>,
    up: impl Strategy<Value = f64>,
    down: impl Strategy<Value = f64>,
) -> impl Strategy<Value = Profile> {
    (velocity, up, down).prop_map(|(velocity, up, down)| Profile {
        velocity: Velocity(velocity),
        acceleration: Acceleration(up),
        deceleration: Acceleration(down),
        jerk: None,
    })
}

fn limits() -> impl Strategy<Value = Limits> {
    let ranges = (-1500.0..1500.0_f64, 0.0..1500.0_f64)
        .prop_map(|(min, width)| PositionRange::new(Position(min.round()), Position(min.round() + width)));
    let decelerations = prop::option::of(decades(1e4, 3));
    (decades(100.0, 3), decades(1e4, 3), decelerations, ranges).prop_map(
        |(velocity, acceleration, deceleration, position)| Limits {
            velocity: Velocity(velocity),
            acceleration: Acceleration(acceleration),
            deceleration: deceleration.map(Acceleration),
            position,
            ..Limits::default()
        },
    )
}

fn commands() -> impl Strategy<Value = Event> {
    (goals(), profiles()).prop_map(|(goal, profile)| Event::Command(goal, profile))
}

/// Any number, and what is none.
fn anything() -> impl Strategy<Value = f64> {
    let special = [0.0, -0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE];
    prop_oneof![prop::num::f64::ANY, -1e6..1e6_f64, prop::sample::select(special.to_vec())]
}

/// Events, each with the number of steps that follow it.
fn scenarios(events: impl Strategy<Value = Event>) -> impl Strategy<Value = Vec<(Event, u32)>> {
    prop::collection::vec((events, 0..60_u32), 1..8)
}

/// The way of the shortest stop from `speed` in whole steps of at most `rate` (counts/s a step).
fn stopping_way(speed: f64, rate: f64, time: f64) -> f64 {
    let full_steps = (speed / rate).floor();
    let rest = speed - full_steps * rate;
    time * (rate * full_steps * full_steps / 2.0 + (full_steps + 0.5) * rest)
}

/// Where `now` stops when the axis brakes as hard as it can.
fn last_stop(now: &SetPoint, limits: &Limits, time: f64) -> f64 {
    let velocity = now.velocity.0;
    now.position.0 + velocity.signum() * stopping_way(velocity.abs(), limits.braking().0 * time, time)
}

/// The places the set-points may reach: the limits and what cannot be helped when they are set.
fn reach(now: &SetPoint, limits: &Limits, time: f64) -> (f64, f64) {
    let range = limits.range();
    let stop = last_stop(now, limits, time);
    (range.min().0.min(stop).min(now.position.0), range.max().0.max(stop).max(now.position.0))
}

/// Speeds rise at the acceleration, fall at the deceleration, or as fast as the axis can before a limit.
fn check_ramps(
    before: f64,
    after: f64,
    profile: &Profile,
    limits: &Limits,
    time: f64,
) -> Result<(), TestCaseError> {
    let towards_rest = after * before >= 0.0 && after.abs() < before.abs();
    let (up, down) = (limits.acceleration.0, limits.braking().0);
    let most = if towards_rest { down } else { up.max(down) };
    prop_assert!((after - before).abs() <= (1.0 + NEARLY) * most * time + NEARLY, "{before} -> {after}");
    let rise = (1.0 + NEARLY) * profile.acceleration.0.max(profile.deceleration.0) * time + NEARLY;
    prop_assert!(towards_rest || (after - before).abs() <= rise, "{before} -> {after}");
    let top = profile.velocity.0.max(before.abs() - profile.deceleration.0 * time);
    prop_assert!(after.abs() <= top * (1.0 + NEARLY) + NEARLY, "{before} -> {after}");
    Ok(())
}

/// Runs until the goal is reached, or gives up.
fn finish(generator: &mut Generator) {
    for _ in 0..200_000 {
        generator.step();
        if generator.is_done() {
            return;
        }
    }
}

proptest! {
    #[test]
    fn no_sequence_of_commands_and_limits_breaks_a_limit(
        period in periods(),
        first in limits(),
        scenario in scenarios(prop_oneof![4 => commands(), 1 => limits().prop_map(Event::Limit)]),
    ) {
        let time = period.seconds();
        let mut generator = Generator::new(period, first);
        let (mut low, mut high) = reach(generator.set_point(), generator.limits(), time);
        let mut profile = generator.limits().clamp(Profile::default());
        for (event, steps) in scenario {
            match event {
                Event::Command(goal, wanted) => {
                    generator.command(goal, wanted);
                    profile = wanted;
                }
                Event::Limit(limits) => {
                    generator.set_limits(limits);
                    (low, high) = reach(generator.set_point(), &limits, time);
                }
            }
            for _ in 0..steps {
                let before = *generator.set_point();
                generator.step();
                let after = *generator.set_point();
                let limits = *generator.limits();
                check_ramps(before.velocity.0, after.velocity.0, &limits.clamp(profile), &limits, time)?;
                prop_assert!(after.position.0 <= high + HAIR && after.position.0 >= low - HAIR);
                let reached = reach(&after, &limits, time);
                (low, high) = (low.max(reached.0), high.min(reached.1));
            }
        }
    }
}

proptest! {
    #[test]
    fn a_stop_in_front_of_the_target_is_taken_when_possible(
        period in periods(),
        profile in brisk(),
        velocity in -30_000.0..30_000.0_f64,
        spare in 0.0..500.0_f64,
    ) {
        let time = period.seconds();
        let limits = Limits { acceleration: Acceleration(1e12), ..Limits::default() };
        let way = stopping_way(velocity.abs(), profile.deceleration.0 * time, time) + spare;
        let target = velocity.signum() * way;
        let mut generator = Generator::new(period, limits);
        generator.place(Position(0.0), Velocity(velocity));
        generator.command(Goal::MoveTo(Position(target)), profile);
        let mut last = 0.0;
        while !generator.is_done() {
            generator.step();
            let now = generator.set_point().position.0 * velocity.signum();
            prop_assert!(now >= last && now <= way, "{last} -> {now} of {way}");
            last = now;
        }
        prop_assert_eq!(generator.set_point().position, Position(target));
    }

    #[test]
    fn whatever_went_before_a_move_ends_exactly_at_its_target(
        period in periods(),
        scenario in scenarios(commands()),
        target in -2000.0..2000.0_f64,
        profile in brisk(),
    ) {
        let mut generator = Generator::new(period, Limits::default());
        for (event, steps) in scenario {
            let Event::Command(goal, profile) = event else { continue };
            generator.command(goal, profile);
            (0..steps).for_each(|_| generator.step());
        }
        generator.command(Goal::MoveTo(Position(target)), profile);
        finish(&mut generator);
        prop_assert!(generator.is_done());
        generator.step();
        prop_assert_eq!(generator.set_point().position, Position(target));
        prop_assert_eq!(generator.set_point().velocity, Velocity(0.0));
        prop_assert_eq!(generator.set_point().acceleration, Acceleration(0.0));
    }

    #[test]
    fn a_move_within_the_limits_is_not_limited_by_them(
        period in periods(),
        profile in brisk(),
        min in -1500.0..0.0_f64,
        max in 0.0..1500.0_f64,
        share in prop_oneof![0.0..=1.0_f64, Just(0.0), Just(1.0)],
    ) {
        let target = if share < 1.0 { min + share * (max - min) } else { max };
        let mut generator = Generator::new(period, limited_to(min, max));
        generator.command(Goal::MoveTo(Position(target)), profile);
        finish(&mut generator);
        prop_assert_eq!(generator.set_point().position, Position(target));
        prop_assert!(!generator.is_limited());
    }

    #[test]
    fn numbers_that_make_no_sense_give_sane_set_points(
        values in prop::array::uniform8(anything()),
        select in 0..5_u8,
        steps in prop_oneof![Just(u32::MAX), 1..9_u32],
        is_stepper in any::<bool>(),
    ) {
        let [target, velocity, up, down, top, most, min, max] = values;
        let limits = Limits {
            velocity: Velocity(top),
            acceleration: Acceleration(most),
            deceleration: None,
            jerk: None,
            torque: Torque(f64::NAN),
            position: PositionRange::new(Position(min), Position(max)),
        };
        let steps = NonZeroU32::new(steps).unwrap();
        let mut generator = Generator::new(Period::MILLISECOND, limits).with_cycle(steps);
        generator.place(Position(min), Velocity(max));
        if is_stepper {
            let creep = Creep { distance: Position(up), velocity: Velocity(down) };
            generator.set_stepping(Some(Stepping { start_stop: Velocity(velocity), creep: Some(creep) }));
        }
        let goal = match select {
            0 => Goal::MoveTo(Position(target)),
            1 => Goal::RunAt(Velocity(target)),
            2 => Goal::TrackPosition { target: Position(target), over: steps },
            3 => Goal::TrackVelocity { target: Velocity(target), over: steps },
            _ => Goal::Stop,
        };
        let profile = Profile {
            velocity: Velocity(velocity),
            acceleration: Acceleration(up),
            deceleration: Acceleration(down),
            jerk: None,
        };
        generator.command(goal, profile);
        for _ in 0..50 {
            generator.step();
            let now = generator.set_point();
            prop_assert!(now.position.0.is_finite() && now.velocity.0.is_finite());
            prop_assert!(now.acceleration.0.is_finite());
            prop_assert!(now.velocity.abs() <= generator.limits().velocity);
        }
    }
}

fn profile(velocity: f64, acceleration: f64, deceleration: f64) -> Profile {
    Profile {
        velocity: Velocity(velocity),
        acceleration: Acceleration(acceleration),
        deceleration: Acceleration(deceleration),
        jerk: None,
    }
}

fn limited_to(min: f64, max: f64) -> Limits {
    Limits { position: PositionRange::new(Position(min), Position(max)), ..Limits::default() }
}

fn run(generator: &mut Generator, steps: u32) {
    (0..steps).for_each(|_| generator.step());
}

#[test]
fn a_velocity_running_into_a_limit_brakes_in_time_and_stays() {
    let mut generator = Generator::new(Period::MILLISECOND, limited_to(-500.0, 500.0));
    generator.command(Goal::RunAt(Velocity(10_000.0)), profile(20_000.0, 1e6, 2e5));
    run(&mut generator, 1000);
    assert_eq!(generator.set_point().position, Position(500.0));
    assert_eq!(generator.set_point().velocity, Velocity(0.0));
    assert!(generator.is_limited());
}

#[test]
fn a_limit_taken_away_does_not_restart_the_motion_it_stopped() {
    for goal in [Goal::RunAt(Velocity(10_000.0)), Goal::MoveTo(Position(2000.0))] {
        let mut generator = Generator::new(Period::MILLISECOND, limited_to(-500.0, 500.0));
        generator.command(goal, profile(20_000.0, 1e6, 2e5));
        run(&mut generator, 1000);
        generator.set_limits(Limits::default());
        run(&mut generator, 100);
        assert_eq!(generator.set_point().position, Position(500.0));
        assert!(generator.is_done() && generator.is_limited());
    }
}

#[test]
fn a_deceleration_lowered_in_front_of_a_limit_is_overruled() {
    let mut generator = Generator::new(Period::MILLISECOND, limited_to(-500.0, 500.0));
    generator.command(Goal::RunAt(Velocity(10_000.0)), profile(20_000.0, 1e6, 2e5));
    run(&mut generator, 29);
    assert_eq!(generator.set_point().velocity, Velocity(10_000.0));
    generator.command(Goal::RunAt(Velocity(10_000.0)), profile(20_000.0, 1e6, 1e3));
    let mut hardest = 0.0_f64;
    for _ in 0..1000 {
        generator.step();
        hardest = hardest.min(generator.set_point().acceleration.0);
    }
    assert!(hardest >= -2e5 * (1.0 + NEARLY), "{hardest}");
    assert_eq!(generator.set_point().position, Position(500.0));
}

#[test]
fn outside_the_limits_only_moves_back_are_made() {
    let mut generator = Generator::new(Period::MILLISECOND, limited_to(-100.0, 100.0));
    for outward in [Goal::MoveTo(Position(300.0)), Goal::RunAt(Velocity(50.0))] {
        generator.place(Position(200.0), Velocity(0.0));
        generator.command(outward, profile(1000.0, 1e5, 1e5));
        run(&mut generator, 100);
        assert_eq!(generator.set_point().position, Position(200.0));
        assert!(generator.is_limited());
    }
    generator.command(Goal::MoveTo(Position(150.0)), profile(1000.0, 1e5, 1e5));
    run(&mut generator, 300);
    assert_eq!(generator.set_point().position, Position(150.0));
    generator.command(Goal::RunAt(Velocity(-1000.0)), profile(1000.0, 1e5, 1e5));
    run(&mut generator, 1000);
    assert_eq!(generator.set_point().position, Position(-100.0));
}

#[test]
fn a_lower_profile_velocity_is_reached_at_the_deceleration() {
    let mut generator = Generator::new(Period::MILLISECOND, Limits::default());
    generator.command(Goal::MoveTo(Position(1e6)), profile(10_000.0, 1e6, 1e6));
    run(&mut generator, 20);
    assert_eq!(generator.set_point().velocity, Velocity(10_000.0));
    generator.command(Goal::MoveTo(Position(1e6)), profile(1000.0, 1e6, 1e6));
    let velocities: Vec<f64> = (0..10)
        .map(|_| {
            generator.step();
            generator.set_point().velocity.0.round()
        })
        .collect();
    assert_eq!(velocities, [9e3, 8e3, 7e3, 6e3, 5e3, 4e3, 3e3, 2e3, 1e3, 1e3]);
}

#[test]
fn a_shifted_coordinate_system_leaves_the_motion_as_it_is() {
    let mut plain = Generator::new(Period::MILLISECOND, Limits::default());
    plain.command(Goal::MoveTo(Position(512.0)), profile(8192.0, 1e6, 1e6));
    let mut shifted = plain.clone();
    run(&mut plain, 10);
    run(&mut shifted, 10);
    shifted.shift(Position(1024.0));
    finish(&mut plain);
    finish(&mut shifted);
    assert_eq!(plain.set_point().position, Position(512.0));
    assert_eq!(shifted.set_point().position, Position(1536.0));
}

#[test]
fn the_same_commands_give_the_same_bits() {
    let bits = || {
        let mut generator = Generator::new(Period::MILLISECOND, limited_to(-700.0, 900.0));
        let goals = [Goal::MoveTo(Position(777.7)), Goal::RunAt(Velocity(-3333.3)), Goal::Stop];
        let mut bits = Vec::new();
        for goal in goals {
            generator.command(goal, profile(7654.3, 1.234e5, 2.345e5));
            for _ in 0..77 {
                generator.step();
                let now = generator.set_point();
                bits.extend([now.position.0.to_bits(), now.velocity.0.to_bits()]);
            }
        }
        bits
    };
    assert_eq!(bits(), bits());
}
