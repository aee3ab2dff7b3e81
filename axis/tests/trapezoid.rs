//! The generator against the closed form: at every instant it is where the trapezoid is at some moment at
//! most one raster step away.

use axis::{Acceleration, Generator, Goal, Limits, Period, Position, Profile, Velocity};
use proptest::prelude::*;

/// A motion of constant accelerations: (duration in s, acceleration), from a position and a velocity.
struct ClosedForm {
    start: (f64, f64),
    phases: Vec<(f64, f64)>,
}

impl ClosedForm {
    /// The fastest motion to `target` that keeps `profile`, braking at its deceleration throughout.
    fn new(start: (f64, f64), target: f64, profile: &Profile) -> Self {
        let mut motion = Self { start, phases: Vec::new() };
        let (up, down, top) = (profile.acceleration.0, profile.deceleration.0, profile.velocity.0);
        let (mut position, mut velocity) = start;
        let braking = velocity * velocity.abs() / (2.0 * down);
        let way = target - position;
        if way * velocity < 0.0 || (way - braking) * velocity < 0.0 {
            motion.phases.push((velocity.abs() / down, -down * velocity.signum()));
            (position, velocity) = (position + braking, 0.0);
        }
        let (way, direction) = ((target - position).abs(), (target - position).signum());
        let speed = velocity.abs();
        let peak = ((2.0 * up * down * way + down * speed * speed) / (up + down)).sqrt().min(top);
        let rate = if peak > speed { up } else { -down };
        let gain_time = (peak - speed) / rate;
        let gain_way = (peak + speed) / 2.0 * gain_time;
        let cruise = (way - gain_way - peak * peak / (2.0 * down)).max(0.0) / peak;
        motion.phases.push((gain_time, direction * rate));
        motion.phases.push((cruise, 0.0));
        motion.phases.push((peak / down, -direction * down));
        motion
    }

    fn position(&self, seconds: f64) -> f64 {
        let (mut position, mut velocity) = self.start;
        let mut left = seconds.max(0.0);
        for (duration, acceleration) in &self.phases {
            let time = left.min(*duration);
            position += (velocity + acceleration * time / 2.0) * time;
            velocity += acceleration * time;
            left -= time;
        }
        position
    }

    fn duration(&self) -> f64 {
        self.phases.iter().map(|(duration, _)| duration).sum()
    }
}

fn periods() -> impl Strategy<Value = Period> {
    prop::sample::select(vec![250_000, 1_000_000, 1_300_000, 2_500_000, 8_000_000])
        .prop_map(|nanos| Period::from_nanos(nanos).unwrap())
}

/// Profiles whose ramps take 1 to 150 steps to full speed.
fn profiles(period: Period) -> impl Strategy<Value = Profile> {
    (1.0..400_000.0_f64, 1.0..150.0_f64, 1.0..150.0_f64).prop_map(move |(velocity, up, down)| Profile {
        velocity: Velocity(velocity),
        acceleration: Acceleration(velocity / (up * period.seconds())),
        deceleration: Acceleration(velocity / (down * period.seconds())),
        jerk: None,
    })
}

/// A period, a profile, a start velocity as a share of the profile velocity, and a way in steps at it.
fn moves() -> impl Strategy<Value = (Period, Profile, f64, f64)> {
    periods().prop_flat_map(|period| (Just(period), profiles(period), -1.5..1.5_f64, -400.0..400.0_f64))
}

fn wide_limits() -> Limits {
    Limits { velocity: Velocity(1e9), acceleration: Acceleration(1e12), ..Limits::default() }
}

/// Runs a move and compares it with the closed form, steps and end.
fn compare(
    period: Period,
    profile: Profile,
    velocity: f64,
    way: f64,
    slack: f64,
) -> Result<(), TestCaseError> {
    let time = period.seconds();
    let mut generator = Generator::new(period, wide_limits());
    generator.place(Position(1000.0), Velocity(velocity));
    generator.command(Goal::MoveTo(Position(1000.0 + way)), profile);
    let ideal = ClosedForm::new((1000.0, velocity), 1000.0 + way, &profile);
    let steps = (ideal.duration() / time).ceil() as u32 + 2;
    for step in 1..=steps {
        generator.step();
        let now = f64::from(step) * time;
        let (before, after) = (ideal.position(now - time), ideal.position(now + time));
        let here = generator.set_point().position.0;
        prop_assert!(here >= before.min(after) - slack, "step {step}: {before} {here} {after}");
        prop_assert!(here <= before.max(after) + slack, "step {step}: {before} {here} {after}");
    }
    prop_assert!(generator.is_done());
    prop_assert_eq!(generator.set_point().position, Position(1000.0 + way));
    prop_assert_eq!(generator.set_point().velocity, Velocity(0.0));
    Ok(())
}

proptest! {
    #[test]
    fn a_move_from_rest_is_the_trapezoid_within_one_step((period, profile, _, way) in moves()) {
        let way = way * profile.velocity.0 * period.seconds();
        compare(period, profile, 0.0, way, 1e-6)?;
    }

    #[test]
    fn a_change_on_the_fly_is_the_trapezoid_within_one_step((period, profile, share, way) in moves()) {
        let time = period.seconds();
        let way = way * profile.velocity.0 * time;
        // At a reversal the exact turning point may fall between two steps.
        let turn = profile.acceleration.0.max(profile.deceleration.0) * time * time;
        compare(period, profile, share * profile.velocity.0, way, 1e-6 + turn)?;
    }
}
