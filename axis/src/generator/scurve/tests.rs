//! What every curve keeps.

mod fence;

use super::*;
use proptest::prelude::*;

/// Relative room for rounding.
const NEARLY: f64 = 1e-9;

/// Relative rounding of a few operations.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// A magnitude, evenly over powers of ten.
fn decades(from: i32, to: i32) -> impl Strategy<Value = f64> {
    (from..to, 1.0..10.0_f64).prop_map(|(power, digits)| digits * 10.0_f64.powi(power))
}

fn signed(from: i32, to: i32) -> impl Strategy<Value = f64> {
    (decades(from, to), any::<bool>()).prop_map(|(value, negative)| if negative { -value } else { value })
}

fn bounds() -> impl Strategy<Value = Bounds> {
    (decades(1, 6), decades(2, 8), decades(2, 8), decades(3, 11)).prop_map(
        |(velocity, acceleration, deceleration, jerk)| Bounds { velocity, acceleration, deceleration, jerk },
    )
}

/// Bounds over the whole range that limits may have.
fn any_bounds() -> impl Strategy<Value = Bounds> {
    (decades(-3, 12), decades(-3, 15), decades(-3, 15), decades(-3, 18)).prop_map(
        |(velocity, acceleration, deceleration, jerk)| Bounds { velocity, acceleration, deceleration, jerk },
    )
}

fn any_states() -> impl Strategy<Value = State> {
    (signed(-3, 12), signed(-3, 12), signed(-3, 15)).prop_map(|(position, velocity, acceleration)| State {
        position,
        velocity,
        acceleration,
    })
}

#[derive(Clone, Copy, Debug)]
enum Goal {
    Position(f64),
    Velocity(f64),
}

/// Goals, each with the share of its curve that is run before the next.
fn goals() -> impl Strategy<Value = Vec<(Goal, f64)>> {
    let goal = prop_oneof![signed(-1, 6).prop_map(Goal::Position), signed(0, 6).prop_map(Goal::Velocity)];
    prop::collection::vec((goal, prop_oneof![0.0..1.0, 0.0..0.01, Just(1.0)]), 1..12)
}

fn plan(from: &State, goal: Goal, bounds: &Bounds) -> Curve {
    match goal {
        Goal::Position(end) => Curve::to_position(from, end, bounds),
        Goal::Velocity(velocity) => {
            Curve::to_velocity(from, velocity.clamp(-bounds.velocity, bounds.velocity), bounds)
        }
    }
}

/// Whether this is exactly the final state that the goal asks for.
fn reached(last: &State, goal: Goal, bounds: &Bounds) -> bool {
    let wanted = match goal {
        Goal::Position(position) => State { position, ..State::default() },
        Goal::Velocity(velocity) => State {
            position: last.position,
            velocity: velocity.clamp(-bounds.velocity, bounds.velocity),
            acceleration: 0.0,
        },
    };
    *last == wanted
}

/// Moments of a curve: around every joint and in between.
fn moments(curve: &Curve) -> Vec<f64> {
    let mut moments: Vec<f64> = (0..=60).map(|k| f64::from(k) / 60.0 * curve.duration).collect();
    for piece in curve.pieces() {
        moments.extend([0.0, 0.25, 0.5, 0.75, 1.0].map(|share| piece.begin + share * piece.seconds));
    }
    moments
}

fn within_bounds(state: &State, bounds: &Bounds) -> Result<(), TestCaseError> {
    let State { velocity, acceleration, .. } = *state;
    prop_assert!(velocity.abs() <= bounds.velocity * (1.0 + NEARLY), "{state:?} {bounds:?}");
    let turning = velocity.abs() <= bounds.velocity * NEARLY;
    let bound = if turning {
        bounds.acceleration.max(bounds.deceleration)
    } else if velocity * acceleration > 0.0 {
        bounds.acceleration
    } else {
        bounds.deceleration
    };
    prop_assert!(acceleration.abs() <= bound * (1.0 + NEARLY), "{state:?} {bounds:?}");
    Ok(())
}

/// Each piece begins where the one before ends, the last one ends in the final state, but for rounding.
fn is_continuous(curve: &Curve, from: &State, bounds: &Bounds) -> Result<(), TestCaseError> {
    let mut state = State { position: 0.0, ..*from };
    for piece in curve.pieces() {
        prop_assert!(piece.jerk.abs() <= bounds.jerk);
        is_near(&state, &piece.start, curve)?;
        state = piece.start.after(piece.jerk, piece.seconds);
    }
    is_near(&state, &State { position: curve.end - curve.origin, ..curve.last }, curve)
}

fn is_near(one: &State, other: &State, curve: &Curve) -> Result<(), TestCaseError> {
    let (min, max) = curve.extent();
    let steepest = curve.pieces().iter().map(|piece| piece.start.acceleration.abs()).fold(0.0, f64::max);
    let way = (max - min).max(max.abs()).max(min.abs());
    let jump = [
        (one.position - other.position).abs() <= 2e-9 + ROUNDING * way,
        (one.velocity - other.velocity).abs() <= ROUNDING * curve.fastest(),
        (one.acceleration - other.acceleration).abs() <= ROUNDING * steepest,
    ];
    prop_assert_eq!(jump, [true; 3], "{:?} {:?} in {:?}", one, other, curve);
    Ok(())
}

/// Runs a target, planned anew each raster step: the states at the steps.
fn streamed(targets: &[f64], period: f64, plan: impl Fn(&State, f64) -> Curve) -> Vec<State> {
    let mut states = vec![State::default()];
    for target in targets {
        let state = states[states.len() - 1];
        states.push(plan(&state, *target).at(period));
    }
    states
}

/// Whether the mean acceleration of each step, and its change, are as the bounds say.
fn keeps_sampled(states: &[State], period: f64, bounds: &Bounds) -> Result<(), TestCaseError> {
    let means: Vec<f64> = states.windows(2).map(|two| (two[1].velocity - two[0].velocity) / period).collect();
    let room = ROUNDING * bounds.velocity / period;
    for two in means.windows(2) {
        let bound = bounds.acceleration.max(bounds.deceleration);
        prop_assert!(two[0].abs() <= bound * (1.0 + NEARLY) + room, "{} {bound}", two[0]);
        let change = (two[1] - two[0]).abs();
        prop_assert!(change <= bounds.jerk * period * (1.0 + NEARLY) + room, "{two:?} {bounds:?}");
    }
    for two in states.windows(2) {
        let mean = (two[0].velocity + two[1].velocity) / 2.0 * period;
        let room = bounds.jerk * period * period * period / 12.0 + ROUNDING * bounds.velocity * period;
        let places = 2e-9 + ROUNDING * two[1].position.abs();
        let moved = two[1].position - two[0].position;
        prop_assert!((moved - mean).abs() <= room * (1.0 + NEARLY) + places, "{two:?} {mean} {room}");
    }
    Ok(())
}

/// Targets that wander, with jumps.
fn targets() -> impl Strategy<Value = Vec<f64>> {
    let step = (signed(-4, 5), 1..40_usize);
    prop::collection::vec(step, 1..20).prop_map(|steps| {
        let speeds = steps.into_iter().flat_map(|(speed, count)| core::iter::repeat_n(speed, count));
        let wander = speeds.scan(0.0, |target, speed| {
            *target += speed;
            Some(*target)
        });
        wander.collect()
    })
}

proptest! {
    #[test]
    fn a_chain_of_plans_keeps_the_bounds(bounds in bounds(), goals in goals()) {
        let mut state = State::default();
        for (goal, share) in goals {
            let curve = plan(&state, goal, &bounds);
            is_continuous(&curve, &state, &bounds)?;
            for moment in moments(&curve) {
                within_bounds(&curve.at(moment), &bounds)?;
            }
            let last = curve.at(curve.duration());
            prop_assert!(reached(&last, goal, &bounds), "{last:?}");
            prop_assert_eq!(curve.at(0.0), state);
            state = curve.at(share * curve.duration());
        }
    }

    #[test]
    fn any_state_comes_to_rest_at_any_place(bounds in any_bounds(), state in any_states(), end in signed(-3, 12)) {
        let curve = Curve::to_position(&state, end, &bounds);
        prop_assert!(curve.duration().is_finite());
        let (min, max) = curve.extent();
        prop_assert!(min.is_finite() && max.is_finite());
        is_continuous(&curve, &state, &bounds)?;
        for moment in moments(&curve) {
            let State { position, velocity, acceleration } = curve.at(moment);
            prop_assert!(position.is_finite() && velocity.is_finite() && acceleration.is_finite());
        }
        let last = curve.at(curve.duration());
        prop_assert_eq!(last, State { position: end, ..State::default() });
    }
}

/// The quickest ramp from rest to a speed.
fn ramp_time(speed: f64, bound: f64, jerk: f64) -> f64 {
    if speed * jerk >= bound * bound { speed / bound + bound / jerk } else { 2.0 * (speed / jerk).sqrt() }
}

/// The highest speed and the duration of the quickest move from rest to rest with equal ramps.
fn closed_form(way: f64, bounds: &Bounds) -> (f64, f64) {
    let Bounds { velocity, acceleration, jerk, .. } = *bounds;
    // without a cruise: the way is speed · ramp time
    let full = acceleration * acceleration / jerk; // reached with a triangle of full acceleration
    let peak = if way >= full * 2.0 * acceleration / jerk {
        ((full * full + 4.0 * acceleration * way).sqrt() - full) / 2.0
    } else {
        (way * way * jerk / 4.0).cbrt()
    };
    let peak = peak.min(velocity);
    let ramp = ramp_time(peak, acceleration, jerk);
    (peak, 2.0 * ramp + (way / peak - ramp).max(0.0))
}

/// A detour: first somewhere else for a while, then at a velocity for as long as it takes to end there.
fn detour(from: &State, first: f64, until: f64, second: f64, end: f64, bounds: &Bounds) -> Option<f64> {
    let aside = Curve::to_velocity(from, first, bounds);
    let until = until * aside.duration();
    let on = Curve::to_velocity(&aside.at(until), second, bounds);
    let stop = Curve::to_velocity(&on.at(on.duration()), 0.0, bounds);
    let cruise = (end - stop.end) / second;
    (cruise >= 0.0).then(|| until + on.duration() + cruise + stop.duration())
}

#[test]
fn every_shape_of_a_move_from_rest_is_the_closed_form() {
    let slow = Bounds { velocity: 100.0, acceleration: 1000.0, deceleration: 1000.0, jerk: 1e4 };
    let fast = Bounds { velocity: 1000.0, ..slow };
    let shapes = [(fast, 1e4, 7), (fast, 500.0, 6), (slow, 1000.0, 5), (fast, 1.0, 4)];
    for (bounds, way, pieces) in shapes {
        let curve = Curve::to_position(&State::default(), way, &bounds);
        let (peak, duration) = closed_form(way, &bounds);
        assert_eq!(curve.count, pieces, "{curve:?}");
        assert!((curve.fastest() / peak - 1.0).abs() <= NEARLY, "{curve:?} {peak}");
        assert!((curve.duration() / duration - 1.0).abs() <= NEARLY, "{curve:?} {duration}");
    }
}

#[test]
fn a_reversal_keeps_its_acceleration_through_velocity_zero() {
    let equal = Bounds { velocity: 200.0, acceleration: 1000.0, deceleration: 1000.0, jerk: 1e4 };
    let from = State { velocity: -200.0, ..State::default() };
    let seconds = |bounds| Curve::to_velocity(&from, 200.0, &bounds).duration();
    assert!((seconds(equal) - ramp_time(400.0, 1000.0, 1e4)).abs() <= 1e-12);
    // 0.05 s up to 500 and then evenly; from there 0.05 s up to 1000, evenly, and 0.1 s down
    let (falls, rises) = (0.05 + (200.0 - 12.5) / 500.0, 0.05 + (200.0 - 37.5 - 50.0) / 1000.0 + 0.1);
    assert!((seconds(Bounds { deceleration: 500.0, ..equal }) - falls - rises).abs() <= 1e-12);
}

#[test]
fn a_velocity_is_held_for_ever() {
    let bounds = Bounds { velocity: 100.0, acceleration: 1000.0, deceleration: 500.0, jerk: 1e4 };
    let curve = Curve::to_velocity(&State::default(), 80.0, &bounds);
    let reached = curve.at(curve.duration());
    assert!((curve.duration() - ramp_time(80.0, 1000.0, 1e4)).abs() <= 1e-12);
    assert_eq!(reached, State { position: reached.position, velocity: 80.0, acceleration: 0.0 });
    let later = State { position: reached.position + 800.0, ..reached };
    assert_eq!(curve.at(curve.duration() + 10.0).velocity.to_bits(), later.velocity.to_bits());
    assert!((curve.at(curve.duration() + 10.0).position - later.position).abs() <= 1e-9);
}

#[test]
fn a_highest_speed_of_zero_stops_and_stands() {
    let bounds = Bounds { velocity: 0.0, acceleration: 1000.0, deceleration: 500.0, jerk: 1e4 };
    let moving = State { position: 5.0, velocity: 20.0, acceleration: 100.0 };
    let (curve, stop) =
        (Curve::to_position(&moving, 100.0, &bounds), Curve::to_velocity(&moving, 0.0, &bounds));
    assert_eq!(curve.at(10.0), stop.at(10.0));
    assert_eq!(Curve::to_position(&State::default(), 100.0, &bounds).at(10.0), State::default());
}

proptest! {
    #[test]
    fn a_move_from_rest_is_the_closed_form(bounds in bounds(), way in decades(-1, 8)) {
        let bounds = Bounds { deceleration: bounds.acceleration, ..bounds };
        let (peak, duration) = closed_form(way, &bounds);
        for end in [way, -way] {
            let curve = Curve::to_position(&State::default(), end, &bounds);
            prop_assert!((curve.fastest() / peak - 1.0).abs() <= NEARLY, "{curve:?} {peak}");
            prop_assert!((curve.duration() / duration - 1.0).abs() <= NEARLY, "{curve:?} {duration}");
        }
    }

    #[test]
    fn the_later_a_stop_begins_the_farther_it_gets(
        bounds in any_bounds(), state in any_states(), up: bool, early in 0.0..1.0_f64, late in 0.0..1.0_f64,
    ) {
        let direction = if up { 1.0 } else { -1.0 };
        let curve = Curve::to_velocity(&state, direction * bounds.velocity, &bounds);
        let [early, late] = [early.min(late), early.max(late)].map(|share| {
            stopped(&curve.at(share * curve.duration()), &bounds) * direction
        });
        let (min, max) = curve.extent();
        let room = rounding(min, max) + 1e-9 * (max - min) + 1e-9 * early.abs();
        prop_assert!(early <= late + room, "{early} {late}");
    }

    #[test]
    fn no_detour_is_quicker(
        bounds in bounds(), (before, share) in (signed(0, 6), 0.0..1.0_f64), end in signed(-1, 6),
        detours in prop::collection::vec((-1.0..1.0_f64, 0.0..1.0_f64, -1.0..1.0_f64), 30),
    ) {
        let start = plan(&State::default(), Goal::Velocity(before), &bounds);
        let state = start.at(share * start.duration());
        let end = state.position + end;
        let direct = Curve::to_position(&state, end, &bounds).duration();
        for (first, until, second) in detours {
            let (first, second) = (first * bounds.velocity, second * bounds.velocity);
            if let Some(seconds) = detour(&state, first, until, second, end, &bounds) {
                prop_assert!(direct <= seconds * (1.0 + NEARLY), "{direct} {seconds}");
            }
        }
    }

    #[test]
    fn a_plan_made_anew_on_the_way_takes_the_time_that_is_left(
        bounds in bounds(), (before, share) in (signed(0, 6), 0.0..1.0_f64), end in signed(-1, 6),
        moment in 0.0..1.0_f64,
    ) {
        let start = plan(&State::default(), Goal::Velocity(before), &bounds);
        let first = Curve::to_position(&start.at(share * start.duration()), end, &bounds);
        let left = (1.0 - moment) * first.duration();
        let anew = Curve::to_position(&first.at(moment * first.duration()), end, &bounds);
        let (min, max) = first.extent();
        let rounded = 2e-9 + ROUNDING * (max - min); // a way that takes its time
        let room = NEARLY * first.duration() + 4.0 * (rounded / bounds.jerk).cbrt();
        prop_assert!((anew.duration() - left).abs() <= room, "{} {left} {room}", anew.duration());
    }

    #[test]
    fn an_exceeded_bound_is_come_back_to_as_fast_as_the_jerk_allows(
        bounds in bounds(), state in (signed(0, 6), signed(0, 7), signed(0, 9)), end in signed(-1, 6),
    ) {
        let (position, velocity, acceleration) = state;
        let from = State { position, velocity, acceleration };
        let curve = Curve::to_position(&from, end, &bounds);
        let slowed = [-1.0, 1.0].map(|sign| Curve::to_velocity(&from, sign * bounds.velocity, &bounds));
        let fastest = curve.fastest();
        for moment in moments(&curve) {
            let State { velocity, acceleration, .. } = curve.at(moment);
            let [down, up] = [&slowed[0], &slowed[1]].map(|curve| curve.at(moment).velocity);
            let room = 1e-9 * fastest;
            prop_assert!(velocity >= (-bounds.velocity).min(down) - room, "{velocity} {down}");
            prop_assert!(velocity <= bounds.velocity.max(up) + room, "{velocity} {up}");
            let bound = if velocity.abs() <= room {
                bounds.acceleration.max(bounds.deceleration)
            } else if velocity * acceleration > 0.0 {
                bounds.acceleration
            } else {
                bounds.deceleration
            };
            let bound = bound.max(from.acceleration.abs() - bounds.jerk * moment);
            let room = 1e-9 * (bound + from.acceleration.abs());
            prop_assert!(acceleration.abs() <= bound + room, "{acceleration} {bound}");
        }
    }

    #[test]
    fn streamed_targets_keep_the_bounds_from_sample_to_sample(
        bounds in bounds(), targets in targets(), period in prop::sample::select(vec![0.000_25, 0.001, 0.008]),
    ) {
        let states = streamed(&targets, period, |state, target| Curve::to_position(state, target, &bounds));
        keeps_sampled(&states, period, &bounds)?;
        for state in states {
            within_bounds(&state, &bounds)?;
        }
    }
}
