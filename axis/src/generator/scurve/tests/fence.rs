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
}
