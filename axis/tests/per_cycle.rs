//! What a master may order anew in every cycle: places with feed-forward, and torques.

mod bench;

use axis::{Axis, FeedForward, Limits, Order, Position, Torque, Velocity};
use bench::{enabled, range, run, steps};
use proptest::prelude::*;

/// Follows a line of 20 counts a step and gives the largest following error once it runs evenly.
fn error_on_a_line(feed_forward: FeedForward) -> f64 {
    let mut axis = enabled();
    let mut largest = 0.0_f64;
    for step in 1..=400_u32 {
        axis.order(Order::TrackPosition { target: Position(20.0 * f64::from(step)), over: steps(1) });
        axis.feed_forward(feed_forward);
        axis.step();
        if step > 300 {
            largest = largest.max(axis.status().following_error.0.abs());
        }
    }
    largest
}

#[test]
fn the_velocity_of_the_set_points_is_fed_forward_unless_another_one_is_given() {
    let none = error_on_a_line(FeedForward::default());
    let right = error_on_a_line(FeedForward { velocity: Some(Velocity(20_000.0)), ..FeedForward::default() });
    let wrong = error_on_a_line(FeedForward { velocity: Some(Velocity(10_000.0)), ..FeedForward::default() });
    assert!(none <= 1.5 && right <= 1.5, "{none} {right}");
    // 10000 counts/s too few, made up for by a position gain of 200/s.
    assert!((40.0..60.0).contains(&wrong), "{wrong}");
}

fn holding_with(torque: f64) -> (Axis, f64) {
    let mut axis = enabled();
    axis.order(Order::TrackPosition { target: Position(0.0), over: steps(1) });
    axis.feed_forward(FeedForward { torque: Torque(torque), ..FeedForward::default() });
    axis.step();
    let moved = axis.status().actual.position.0;
    (axis, moved)
}

#[test]
fn a_torque_is_added_until_the_next_order() {
    let (mut axis, moved) = holding_with(2000.0);
    assert!(moved > 0.5, "{moved}");
    assert!(holding_with(f64::NAN).1.abs() < 0.5, "what is not a number is left out");
    axis.order(Order::TrackPosition { target: Position(0.0), over: steps(1) });
    let status = run(&mut axis, 300);
    assert!(status.actual.position.0.abs() <= 1.0, "{status:?}");
    assert!(status.actual.torque.0.abs() < 200.0, "{status:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn torques_ordered_in_every_step_do_not_drive_the_axis_past_a_position_limit(
        torques in prop::collection::vec((-800.0..800.0_f64, 1..200_u32), 1..20),
    ) {
        let mut axis = enabled();
        // The axis can brake as hard as these torques accelerate it.
        let limits = Limits { velocity: Velocity(1e5), ..*axis.limits() };
        axis.set_limits(Limits { position: range(-5000.0, 5000.0), ..limits });
        for (torque, count) in torques {
            for _ in 0..count {
                axis.order(Order::Push { torque: Torque(torque), slope: Torque(0.0) });
                axis.step();
                let place = axis.status().actual.position.0;
                // What a torque does is seen a raster step later: 100 counts at the highest speed.
                prop_assert!(place.abs() <= 5100.0, "{place}");
            }
        }
    }
}
