//! What every curve within position limits keeps.

use super::*;

/// A profile softer than an axis, as a share of it.
fn softer(axis: &Bounds, shares: [f64; 4]) -> Bounds {
    let [velocity, acceleration, deceleration, jerk] = shares.map(|share| share * share * share);
    Bounds {
        velocity: axis.velocity * velocity,
        acceleration: axis.acceleration * acceleration,
        deceleration: axis.deceleration * deceleration,
        jerk: axis.jerk * jerk,
    }
}

fn shares() -> impl Strategy<Value = [f64; 4]> {
    [0.05..1.0_f64, 0.05..1.0_f64, 0.05..1.0_f64, 0.05..1.0_f64]
}

const AXIS: Bounds = Bounds { velocity: 1000.0, acceleration: 1e4, deceleration: 1e4, jerk: 1e6 };

/// An axis between -100 and 100 counts with a profile that is a tenth of its maxima.
const FENCE: Fence = Fence {
    profile: Bounds { velocity: 1000.0, acceleration: 1e3, deceleration: 1e3, jerk: 1e5 },
    axis: AXIS,
    min: -100.0,
    max: 100.0,
};

fn moving(position: f64, velocity: f64, acceleration: f64) -> State {
    State { position, velocity, acceleration }
}

fn standing(position: f64) -> State {
    moving(position, 0.0, 0.0)
}

#[test]
fn a_motion_that_stays_inside_is_the_one_of_the_profile() {
    let from = moving(0.0, 100.0, 500.0);
    let free = Curve::to_position(&from, 50.0, &FENCE.profile);
    let fenced = FENCE.move_to(&from, 50.0);
    assert_eq!(fenced.duration().to_bits(), free.duration().to_bits());
    assert_eq!(fenced.at(0.1), free.at(0.1));
}

#[test]
fn a_goal_beyond_a_limit_ends_at_the_limit() {
    let curves = [FENCE.move_to(&standing(0.0), 500.0), FENCE.run_at(&standing(0.0), 700.0)];
    for curve in curves {
        assert_eq!(curve.at(curve.duration()), standing(100.0));
    }
}

#[test]
fn a_motion_too_fast_for_its_profile_brakes_just_hard_enough() {
    let from = moving(40.0, 500.0, 0.0); // the profile takes 127.5 counts to stop, the axis 15
    let curve = FENCE.move_to(&from, 0.0);
    let (_, highest) = curve.extent();
    assert!((highest - 100.0).abs() <= 1e-6, "{highest}");
    assert_eq!(curve.at(curve.duration()), standing(0.0));
    let hardest = Curve::to_velocity(&from, 0.0, &AXIS);
    assert!(hardest.extent().1 < 60.0, "{hardest:?}");
}

#[test]
fn a_motion_too_fast_for_its_axis_brakes_as_hard_as_it_can() {
    let from = moving(90.0, 500.0, 0.0);
    let (curve, hardest) = (FENCE.move_to(&from, 100.0), Curve::to_velocity(&from, 0.0, &AXIS));
    for share in [0.0, 0.3, 0.6, 1.0] {
        let moment = share * hardest.duration();
        assert_eq!(curve.at(moment), hardest.at(moment));
    }
    assert_eq!(curve.at(curve.duration()), standing(100.0));
}

#[test]
fn a_state_that_can_only_turn_back_inside_does_so() {
    let from = moving(99.84, 10.0, -400.0);
    let (free, stop) = (Curve::to_velocity(&from, -50.0, &AXIS), Curve::to_velocity(&from, 0.0, &AXIS));
    let limit = (free.extent().1 + stop.extent().1) / 2.0;
    let fence = Fence { max: limit, ..FENCE };
    let curve = fence.move_to(&from, 99.0);
    assert!(curve.extent().1 <= limit + 1e-6);
    assert_eq!(curve.at(curve.duration()), standing(99.0));
}

#[test]
fn a_start_outside_of_the_limits_leads_back_inside_without_going_farther_out() {
    let curve = FENCE.move_to(&standing(150.0), 120.0);
    assert_eq!(curve.at(curve.duration()), standing(100.0));
    assert_eq!(curve.extent(), (100.0, 150.0));
    assert_eq!(FENCE.run_at(&standing(150.0), 10.0).at(1.0), standing(150.0));
}

#[test]
fn a_jerk_lowered_during_a_ramp_does_not_take_the_velocity_above_the_maximum() {
    let from = moving(0.0, 980.0, 6000.0); // with the jerk of the profile: 180 counts/s more
    let wide = Fence { min: -1e6, max: 1e6, ..FENCE };
    let curve = wide.run_at(&from, 1000.0);
    assert!(curve.fastest() <= 1000.0 * (1.0 + NEARLY), "{curve:?}");
    assert!(wide.run_at(&from, 0.0).fastest() <= 1000.0 * (1.0 + NEARLY));
}

proptest! {
    #[test]
    fn a_chain_of_plans_stays_inside_the_limits(
        axis in bounds(), (below, above) in (decades(-1, 6), decades(-1, 6)),
        goals in prop::collection::vec((goals(), shares()), 1..4),
    ) {
        let axis = Bounds { deceleration: axis.acceleration, ..axis };
        let mut state = State::default();
        for (goals, shares) in goals {
            let fence = Fence { profile: softer(&axis, shares), axis, min: -below, max: above };
            for (goal, share) in goals {
                let curve = match goal {
                    Goal::Position(end) => fence.move_to(&state, end),
                    Goal::Velocity(velocity) => fence.run_at(&state, velocity),
                };
                is_continuous(&curve, &state, &axis)?;
                let (min, max) = curve.extent();
                prop_assert!(min >= -below - 1e-6 && max <= above + 1e-6, "{min} {max}");
                for moment in moments(&curve) {
                    let at = curve.at(moment);
                    prop_assert!((-below..=above).contains(&at.position), "{at:?}");
                    within_bounds(&at, &axis)?;
                }
                let last = curve.at(curve.duration());
                let end = match goal {
                    Goal::Position(end) => end.clamp(-below, above),
                    Goal::Velocity(velocity) => if velocity < 0.0 { -below } else { above },
                };
                prop_assert_eq!(last, State { position: end, ..State::default() });
                state = curve.at(share * curve.duration());
            }
        }
    }

    #[test]
    fn streamed_targets_stay_inside_the_limits(
        axis in bounds(), (below, above) in (decades(-1, 5), decades(-1, 5)), targets in targets(),
        profiles in prop::collection::vec(shares(), 3),
    ) {
        let axis = Bounds { deceleration: axis.acceleration, ..axis };
        let period = 0.001;
        let states = streamed(&targets, period, |state, target| {
            let shares = profiles[(target.abs() % 3.0) as usize];
            Fence { profile: softer(&axis, shares), axis, min: -below, max: above }.move_to(state, target)
        });
        keeps_sampled(&states, period, &axis)?;
        for state in states {
            prop_assert!((-below..=above).contains(&state.position), "{state:?}");
            within_bounds(&state, &axis)?;
        }
    }

    #[test]
    fn any_state_comes_to_rest_inside_any_limits(
        axis in any_bounds(), shares in shares(), state in any_states(), end in signed(-3, 12),
        (below, above) in (decades(-3, 12), decades(-3, 12)),
    ) {
        let fence = Fence { profile: softer(&axis, shares), axis, min: -below, max: above };
        let curve = fence.move_to(&state, end);
        is_continuous(&curve, &state, &axis)?;
        let last = curve.at(curve.duration());
        prop_assert_eq!(last, State { position: end.clamp(-below, above), ..State::default() });
    }
}
