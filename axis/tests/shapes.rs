//! What the generator keeps in every shape of motion, whatever it is told, and when.

use core::num::NonZeroU32;

use axis::{
    Acceleration, Creep, Generator, Goal, Jerk, Limits, Period, Position, PositionRange, Profile, SetPoint,
    Stepping, Velocity,
};
use proptest::prelude::*;

/// Relative room for rounding.
const NEARLY: f64 = 1e-6;

/// Room for rounding of positions, in counts.
const HAIR: f64 = 1e-6;

/// A generator and what it has to keep.
#[derive(Clone, Debug)]
struct Setup {
    period: Period,
    cycle: u32,
    limits: Limits,
    stepping: Option<Stepping>,
}

impl Setup {
    fn generator(&self) -> Generator {
        let mut generator =
            Generator::new(self.period, self.limits).with_cycle(NonZeroU32::new(self.cycle).unwrap());
        generator.set_stepping(self.stepping);
        generator
    }

    fn start_stop(&self) -> f64 {
        self.stepping.map_or(0.0, |stepping| stepping.start_stop.0)
    }

    /// Speeds change by no more than the axis maximum, but for jumps from standstill and to it.
    fn check_axis(&self, before: f64, after: f64) -> Result<(), TestCaseError> {
        let steps = if self.stepping.is_some() { self.cycle } else { 1 };
        let (up, down) = (self.limits.acceleration.0, self.limits.braking().0);
        // A cycle that reverses has one rate throughout.
        let most = if after * before < 0.0 || self.cycle > 1 {
            up.max(down)
        } else if after.abs() < before.abs() {
            down
        } else {
            up
        };
        let most = most * self.period.seconds() * f64::from(steps);
        let change = (after - before).abs();
        prop_assert!(
            change <= most * (1.0 + NEARLY) + NEARLY || self.jumps(before, after),
            "{before} {after}"
        );
        prop_assert!(after.abs() <= self.limits.velocity.0 * (1.0 + NEARLY) + NEARLY, "{before} {after}");
        Ok(())
    }

    /// Speeds rise and, where there are no position limits, fall as the profile says.
    fn check_profile(&self, before: f64, after: f64, wanted: &Profile) -> Result<(), TestCaseError> {
        let profile = self.limits.clamp(*wanted);
        let time = self.period.seconds();
        let [up, down] = [profile.acceleration.0, profile.deceleration.0].map(|rate| rate * time);
        let drop = down.max(self.start_stop());
        let top = profile.velocity.0.max(before.abs() - down);
        let completes = self.stepping.is_some() && after.abs() <= drop;
        prop_assert!(completes || after.abs() <= top * (1.0 + NEARLY) + NEARLY, "{before} {after}");
        let change = (after - before).abs();
        let falls = after * before >= 0.0 && after.abs() < before.abs();
        let rate = if falls { down } else { up.max(down) };
        let overruled = falls && self.limits.position.is_some();
        let kept = change <= rate * (1.0 + NEARLY) + NEARLY;
        prop_assert!(kept || overruled || self.jumps(before, after), "{before} {after}");
        Ok(())
    }

    /// Whether a goal is reached with limited jerk.
    fn is_smooth(&self, goal: &Goal, profile: &Profile) -> bool {
        self.stepping.is_none() && !is_tracking(goal) && self.limits.clamp(*profile).jerk.is_some()
    }

    /// The acceleration changes by no more than a jerk allows; its rounding is that of the velocity.
    fn check_jerk(&self, before: &SetPoint, after: &SetPoint, jerk: f64) -> Result<(), TestCaseError> {
        let time = self.period.seconds();
        let change = (after.acceleration - before.acceleration).0.abs();
        let rounding = 1e-9 * (before.velocity.0.abs() + after.velocity.0.abs() + 1.0) / time;
        prop_assert!(change <= jerk * time * (1.0 + NEARLY) + rounding, "{before:?} {after:?} {jerk}");
        Ok(())
    }

    fn jumps(&self, before: f64, after: f64) -> bool {
        let highest = self.start_stop() * (1.0 + NEARLY);
        before.abs() <= highest && after.abs() <= highest && before * after >= 0.0
    }
}

fn decades(from: f64, powers: u32) -> impl Strategy<Value = f64> {
    (0..powers, 1.0..10.0_f64).prop_map(move |(power, digits)| from * digits * 10.0_f64.powi(power as i32))
}

fn steppings() -> impl Strategy<Value = Stepping> {
    let creeps = (0.0..50.0_f64, 1.0..500.0_f64).prop_map(|(distance, velocity)| Creep {
        distance: Position(distance.round()),
        velocity: Velocity(velocity),
    });
    (decades(1.0, 4), prop::option::of(creeps))
        .prop_map(|(start_stop, creep)| Stepping { start_stop: Velocity(start_stop), creep })
}

fn jerks() -> impl Strategy<Value = Jerk> {
    decades(1e4, 5).prop_map(Jerk)
}

fn limits() -> impl Strategy<Value = Limits> {
    let ranges = (-1500.0..0.0_f64, 0.0..1500.0_f64)
        .prop_map(|(min, max)| PositionRange::new(Position(min.round()), Position(max)).unwrap());
    let decelerations = prop::option::of(decades(1e4, 3));
    let jerks = prop::option::of(jerks());
    (decades(100.0, 3), decades(1e4, 3), decelerations, jerks, prop::option::of(ranges)).prop_map(
        |(velocity, acceleration, deceleration, jerk, position)| Limits {
            velocity: Velocity(velocity),
            acceleration: Acceleration(acceleration),
            deceleration: deceleration.map(Acceleration),
            jerk,
            position,
            ..Limits::default()
        },
    )
}

fn setups() -> impl Strategy<Value = Setup> {
    let periods = prop::sample::select(vec![250_000, 1_000_000, 2_500_000, 8_000_000])
        .prop_map(|nanos| Period::from_nanos(nanos).unwrap());
    let cycles = prop_oneof![Just(1_u32), 2..6_u32];
    (periods, cycles, limits(), prop::option::of(steppings()))
        .prop_map(|(period, cycle, limits, stepping)| Setup { period, cycle, limits, stepping })
}

fn goals() -> impl Strategy<Value = Goal> {
    let positions = || (-2000.0..2000.0_f64).prop_map(|target| Position(target.round()));
    let velocities = || (-30_000.0..30_000.0_f64).prop_map(Velocity);
    let times = || (1..20_u32).prop_map(|steps| NonZeroU32::new(steps).unwrap());
    prop_oneof![
        positions().prop_map(Goal::MoveTo),
        velocities().prop_map(Goal::RunAt),
        Just(Goal::Stop),
        (positions(), times()).prop_map(|(target, over)| Goal::TrackPosition { target, over }),
        (velocities(), times()).prop_map(|(target, over)| Goal::TrackVelocity { target, over }),
    ]
}

fn profiles() -> impl Strategy<Value = Profile> {
    (decades(10.0, 4), decades(1e3, 4), decades(1e3, 4), prop::option::of(jerks())).prop_map(
        |(velocity, up, down, jerk)| Profile {
            velocity: Velocity(velocity),
            acceleration: Acceleration(up),
            deceleration: Acceleration(down),
            jerk,
        },
    )
}

/// Commands, each with the number of steps that follow it; often just one.
fn scenarios() -> impl Strategy<Value = Vec<(Goal, Profile, u32)>> {
    let steps = prop_oneof![Just(1_u32), 0..80_u32];
    prop::collection::vec((goals(), profiles(), steps), 1..20)
}

fn is_tracking(goal: &Goal) -> bool {
    match goal {
        Goal::TrackPosition { .. } | Goal::TrackVelocity { .. } => true,
        Goal::MoveTo(_) | Goal::RunAt(_) | Goal::Stop => false,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn no_sequence_of_goals_breaks_a_limit_in_any_shape(setup in setups(), scenario in scenarios()) {
        let range = setup.limits.range();
        let mut generator = setup.generator();
        for (goal, profile, steps) in scenario {
            generator.command(goal, profile);
            for _ in 0..steps {
                let before = *generator.set_point();
                generator.step();
                let now = *generator.set_point();
                prop_assert!(now.position.0 <= range.max().0 + HAIR, "{goal:?}: {before:?} {now:?}");
                prop_assert!(now.position.0 >= range.min().0 - HAIR, "{goal:?}: {before:?} {now:?}");
                setup.check_axis(before.velocity.0, now.velocity.0)?;
                if setup.cycle == 1 && !is_tracking(&goal) && !setup.is_smooth(&goal, &profile) {
                    setup.check_profile(before.velocity.0, now.velocity.0, &profile)?;
                }
            }
        }
    }

    #[test]
    fn whatever_went_before_a_move_ends_exactly_at_its_target_in_any_shape(
        setup in setups(),
        scenario in scenarios(),
        share in 0.0..1.0_f64,
    ) {
        let setup = Setup { limits: Limits { position: setup.limits.position, ..Limits::default() }, ..setup };
        let mut generator = setup.generator();
        for (goal, profile, steps) in scenario {
            generator.command(goal, profile);
            (0..steps).for_each(|_| generator.step());
        }
        let (min, max) = setup.limits.position.map_or((-2000.0, 2000.0), |range| (range.min().0, range.max().0));
        let target = Position((min + share * (max - min)).floor().max(min));
        let profile = Profile { velocity: Velocity(1e4), acceleration: Acceleration(1e5), ..Profile::default() };
        generator.command(Goal::MoveTo(target), profile);
        let steps = (0..200_000).find(|_| { generator.step(); generator.is_done() });
        prop_assert!(steps.is_some(), "{:?}", generator.set_point());
        (0..setup.cycle).for_each(|_| generator.step());
        prop_assert_eq!(generator.set_point().position, target);
        prop_assert_eq!(generator.set_point().velocity, Velocity(0.0));
    }

    #[test]
    fn from_standstill_on_the_jerk_is_the_one_of_the_axis_at_most(
        setup in setups(),
        most in jerks(),
        scenario in scenarios(),
    ) {
        let setup = Setup { limits: Limits { jerk: Some(most), ..setup.limits }, stepping: None, ..setup };
        let mut generator = setup.generator();
        let mut is_smooth = true;
        for (goal, profile, steps) in scenario {
            generator.command(goal, profile);
            let stands = generator.set_point().velocity.0 == 0.0 && generator.set_point().acceleration.0 == 0.0;
            is_smooth = (is_smooth || stands) && !is_tracking(&goal);
            for _ in 0..steps {
                let before = *generator.set_point();
                generator.step();
                if is_smooth {
                    setup.check_jerk(&before, generator.set_point(), most.0)?;
                }
            }
        }
    }

    #[test]
    fn without_position_limits_the_jerk_is_the_one_of_the_profile(
        setup in setups(),
        profile in profiles(),
        jerk in jerks(),
        scenario in scenarios(),
    ) {
        let limits = Limits { position: None, jerk: None, ..setup.limits };
        let setup = Setup { limits, stepping: None, ..setup };
        let profile = Profile { jerk: Some(jerk), ..profile };
        let mut generator = setup.generator();
        for (goal, _, steps) in scenario.into_iter().filter(|(goal, ..)| !is_tracking(goal)) {
            generator.command(goal, profile);
            for _ in 0..steps {
                let before = *generator.set_point();
                generator.step();
                setup.check_jerk(&before, generator.set_point(), jerk.0)?;
            }
        }
    }
}
