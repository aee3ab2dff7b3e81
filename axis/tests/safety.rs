//! What holds whatever an axis is told, in whatever order, at whatever time.

mod bench;

use axis::{
    Acceleration, Axis, Base, DriveState, Fault, Finish, Guard, Jerk, Limits, Mark, Motion, Order,
    PlantConfig, Position, Profile, Reaction, Seek, Switch, Torque, Travel, Turn, Velocity,
};
use bench::{axis_on, enabled_on, range, run, steps};
use proptest::prelude::*;

const SWITCH: f64 = 30_000.0;
const STOP: f64 = 90_000.0;

/// Limit switches at ±30000, the home switch around 5000, hard stops at ±90000.
fn machine() -> PlantConfig {
    PlantConfig {
        positive_switch: Some(Position(SWITCH)),
        negative_switch: Some(Position(-SWITCH)),
        home_switch: range(4_000.0, 6_000.0),
        stops: range(-STOP, STOP),
        ..PlantConfig::default()
    }
}

fn profiles() -> impl Strategy<Value = Profile> {
    let jerk = prop::option::of((1e6..1e9_f64).prop_map(Jerk));
    (0.0..500_000.0_f64, 0.0..1e7_f64, 0.0..1e7_f64, jerk).prop_map(|(velocity, up, down, jerk)| Profile {
        velocity: Velocity(velocity),
        acceleration: Acceleration(up),
        deceleration: Acceleration(down),
        jerk,
    })
}

fn marks() -> impl Strategy<Value = Mark> {
    let switches = vec![Switch::Home, Switch::PositiveLimit, Switch::NegativeLimit];
    prop_oneof![
        (prop::sample::select(switches), any::<bool>())
            .prop_map(|(switch, actuated)| Mark::Switch { switch, actuated }),
        Just(Mark::Index),
        (10.0..500.0_f64, 1..50_u32)
            .prop_map(|(limit, count)| Mark::Torque { limit: Torque(limit), steps: steps(count) }),
    ]
}

fn searches() -> impl Strategy<Value = Order> {
    let finishes = prop::sample::select(vec![Finish::Ramp, Finish::Abrupt, Finish::Return]);
    (marks(), -2e5..2e5_f64, 1e4..1e7_f64, finishes).prop_map(|(mark, velocity, ramp, finish)| {
        let (acceleration, deceleration) = (Acceleration(ramp), Acceleration(ramp));
        Order::Seek(Seek { mark, velocity: Velocity(velocity), acceleration, deceleration, finish })
    })
}

fn places() -> impl Strategy<Value = Position> {
    (-40_000.0..40_000.0_f64).prop_map(|place| Position(place.round()))
}

/// Orders that the generator carries out.
fn generated() -> impl Strategy<Value = Order> {
    let bases = prop::sample::select(vec![Base::Target, Base::Demand, Base::Actual]);
    prop_oneof![
        3 => (places(), profiles()).prop_map(|(place, profile)| Order::MoveTo(place, profile)),
        2 => (places(), bases, profiles())
            .prop_map(|(distance, from, profile)| Order::MoveBy { distance, from, profile }),
        3 => (-5e5..5e5_f64, profiles()).prop_map(|(velocity, profile)| Order::RunAt(Velocity(velocity), profile)),
        1 => (0.0..1e7_f64).prop_map(|ramp| Order::Stop(Acceleration(ramp))),
        1 => Just(Order::Brake),
        2 => (places(), 1..50_u32)
            .prop_map(|(target, over)| Order::TrackPosition { target, over: steps(over) }),
        2 => (-5e5..5e5_f64, 1..50_u32)
            .prop_map(|(target, over)| Order::TrackVelocity { target: Velocity(target), over: steps(over) }),
    ]
}

fn orders() -> impl Strategy<Value = Order> {
    prop_oneof![
        6 => generated(),
        2 => searches(),
        1 => (-3000.0..3000.0_f64, 0.0..1e4_f64)
            .prop_map(|(torque, slope)| Order::Push { torque: Torque(torque), slope: Torque(slope) }),
    ]
}

/// Orders with the steps to wait after each, and whether it waits for the one before.
fn scripts(order: impl Strategy<Value = Order>) -> impl Strategy<Value = Vec<(Order, bool, u32)>> {
    prop::collection::vec((order, prop::bool::weighted(0.2), 0..150_u32), 1..15)
}

fn give(axis: &mut Axis, order: Order, waits: bool) {
    if waits {
        // A full queue refuses it, which is as good.
        let _ = axis.then(order);
    } else {
        axis.order(order);
    }
}

/// Runs a script and looks at the axis after every step.
fn play(
    axis: &mut Axis,
    script: &[(Order, bool, u32)],
    mut look: impl FnMut(&mut Axis) -> Result<(), TestCaseError>,
) -> Result<(), TestCaseError> {
    for (order, waits, count) in script {
        give(axis, *order, *waits);
        for _ in 0..*count {
            axis.step();
            look(axis)?;
        }
    }
    Ok(())
}

/// Runs an axis without power until it is at rest; how far it came.
fn coast(axis: &mut Axis) -> Result<f64, TestCaseError> {
    let start = axis.status().actual.position.0;
    let mut speed = axis.status().actual.velocity.abs();
    for _ in 0..60_000 {
        axis.step();
        let actual = axis.status().actual;
        prop_assert_eq!(actual.torque, Torque(0.0), "no power, no torque");
        prop_assert!(actual.velocity.abs() <= speed, "coasting only slows down");
        prop_assert!(actual.position.abs() <= Position(STOP));
        speed = actual.velocity.abs();
        if speed == Velocity(0.0) {
            return Ok(actual.position.0 - start);
        }
    }
    Err(TestCaseError::fail("it never came to rest"))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn no_set_point_passes_a_position_limit_or_a_maximum(
        script in scripts(generated()),
        (min, width) in (-20_000.0..0.0_f64, 0.0..40_000.0_f64),
        (fastest, hardest) in (1e4..4e5_f64, 1e5..8e6_f64),
        jerk in prop::option::of((1e6..1e10_f64).prop_map(Jerk)),
    ) {
        let max = (min + width).max(0.0);
        let mut axis = enabled_on(machine());
        axis.set_limits(Limits {
            velocity: Velocity(fastest),
            acceleration: Acceleration(hardest),
            jerk,
            position: range(min, max),
            ..Limits::default()
        });
        let mut last = axis.status().demand;
        play(&mut axis, &script, |axis| {
            let demand = axis.status().demand;
            prop_assert!((min - 1e-6..=max + 1e-6).contains(&demand.position.0), "{demand:?}");
            prop_assert!(demand.velocity.0.abs() <= fastest * (1.0 + 1e-9), "{demand:?}");
            let change = (demand.velocity - last.velocity).0.abs() / 1e-3;
            prop_assert!(change <= hardest * (1.0 + 1e-6) + 1e-3, "{last:?} {demand:?}");
            let way = (demand.position - last.position).0.abs() / 1e-3;
            prop_assert!(way <= fastest * (1.0 + 1e-6) + 1e-3, "{last:?} {demand:?}");
            last = demand;
            Ok(())
        })?;
    }

    #[test]
    fn no_axis_passes_a_limit_switch_by_more_than_its_braking_distance(
        script in scripts(orders()), hardest in 1e6..6e6_f64,
    ) {
        let mut axis = enabled_on(machine());
        axis.set_limits(Limits { acceleration: Acceleration(hardest), ..Limits::default() });
        let fastest = axis.limits().velocity.0;
        // Two raster steps until the axis brakes, and what its controller lags behind and swings over.
        let way = fastest * fastest / (2.0 * hardest) + 2.0 * fastest * 1e-3 + 600.0;
        play(&mut axis, &script, |axis| {
            let place = axis.status().actual.position.0;
            prop_assert!(place.abs() <= SWITCH + way, "{place} {way}");
            Ok(())
        })?;
    }

    #[test]
    fn behind_a_limit_switch_set_points_only_lead_back(
        script in scripts(orders()), direction in prop::sample::select(vec![-1.0, 1.0]),
    ) {
        let mut axis = enabled_on(machine());
        let profile = Profile { velocity: Velocity(50_000.0), ..Profile::default() };
        axis.order(Order::RunAt(Velocity(direction * 50_000.0), profile));
        run(&mut axis, 1000);
        let rest = axis.status().demand.position.0 * direction;
        prop_assert!(rest > SWITCH && axis.status().limited);
        let mut is_behind = true;
        play(&mut axis, &script, |axis| {
            let status = axis.status();
            let switches = status.switches;
            is_behind &= switches.positive_limit || switches.negative_limit;
            let is_held = status.seek == axis::SeekState::None;
            if is_behind && is_held && status.motion != Motion::Off {
                let place = status.demand.position.0 * direction;
                // A torque follows the axis itself, which trembles by a count or two.
                prop_assert!(place <= rest + 5.0, "{place} {rest}");
            } else {
                is_behind = false;
            }
            Ok(())
        })?;
    }

    #[test]
    fn a_cut_of_the_power_is_coasting_until_friction_or_a_hard_stop_ends_it(
        script in scripts(orders()), is_fault: bool,
    ) {
        let mut axis = enabled_on(machine());
        play(&mut axis, &script, |_| Ok(()))?;
        if is_fault {
            let plant = axis.plant().unwrap();
            plant.inject(axis::PlantFault::EncoderBreak);
            let before = plant.motor_velocity();
            axis.step();
            prop_assert!(axis.status().fault.is_some());
            let plant = axis.plant().unwrap();
            let after = plant.motor_velocity();
            prop_assert!(after.abs() <= before.abs() + Velocity(1e5), "no brake, no push: {before:?} {after:?}");
            run(&mut axis, 30_000);
            let plant = axis.plant().unwrap();
            prop_assert_eq!(plant.motor_velocity(), Velocity(0.0));
            prop_assert!(plant.motor_position().abs() <= Position(STOP));
        } else {
            axis.cut_power();
            axis.step();
            prop_assert_eq!(axis.status().motion, Motion::Off);
            coast(&mut axis)?;
        }
    }

    #[test]
    fn without_a_sign_of_life_the_axis_is_at_rest_within_bound(
        script in scripts(generated()), (timeout, ramp) in (1..200_u32, 5e5..6e6_f64),
    ) {
        let mut axis = enabled_on(PlantConfig::default());
        axis.set_guard(Guard {
            emergency_deceleration: Acceleration(ramp),
            supervision: Reaction::Brake,
            ..Guard::default()
        });
        axis.set_supervision(Some(steps(timeout)));
        play(&mut axis, &script, |axis| {
            axis.confirm();
            Ok(())
        })?;
        prop_assert_eq!(axis.status().fault, None);
        let fastest = axis.limits().velocity.0;
        // The time-out, the ramp from the highest speed, and the rest of the motor's own swing.
        let bound = timeout + (fastest / ramp * 1000.0) as u32 + 3;
        let status = run(&mut axis, bound);
        prop_assert_eq!(status.fault, Some(Fault::Supervision));
        prop_assert_eq!(status.drive, DriveState::Disabled);
        prop_assert!(status.actual.velocity.abs() <= Velocity(fastest / 50.0), "{:?}", status.actual);
    }

    #[test]
    fn a_circular_axis_reports_places_within_its_turn_and_never_jumps(
        script in scripts(generated()), turn in 100_u32..50_000, optimised: bool,
    ) {
        let length = f64::from(turn);
        let turn = Turn::new(Position(length)).unwrap();
        let mut axis = enabled_on(PlantConfig::default());
        axis.set_travel(if optimised { Travel::CircularOptimised(turn) } else { Travel::Circular(turn) });
        play(&mut axis, &script, |axis| {
            let status = axis.status();
            prop_assert!((0.0..length).contains(&status.actual.position.0));
            prop_assert!((0.0..length).contains(&status.demand.position.0));
            prop_assert!(status.following_error.abs() < Position(400.0), "{:?}", status.following_error);
            Ok(())
        })?;
    }

    #[test]
    fn orders_without_power_do_nothing(script in scripts(orders())) {
        let mut axis = axis_on(machine());
        play(&mut axis, &script, |axis| {
            prop_assert_eq!(axis.status().demand.position, Position(0.0));
            prop_assert_eq!(axis.status().queued, 0);
            Ok(())
        })?;
    }
}
