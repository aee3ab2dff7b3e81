//! Orders: relative moves, circular axes, waiting orders, per-cycle set-points.

mod bench;

use axis::{Axis, Base, Order, Position, QueueFull, TargetWindow, Travel, Turn, Velocity};
use bench::{PROFILE, complete, enabled, run, run_until, steps};

fn circular(optimised: bool) -> Axis {
    let turn = Turn::new(Position(10_000.0)).unwrap();
    let mut axis = enabled();
    axis.set_travel(if optimised { Travel::CircularOptimised(turn) } else { Travel::Circular(turn) });
    axis
}

fn by(distance: f64, from: Base) -> Order {
    Order::MoveBy { distance: Position(distance), from, profile: PROFILE }
}

#[test]
fn relative_moves_count_from_where_they_are_told() {
    let mut axis = enabled();
    complete(&mut axis, by(1000.0, Base::Target));
    axis.order(by(1000.0, Base::Target));
    run(&mut axis, 5);
    let status = complete(&mut axis, by(1000.0, Base::Target));
    assert_eq!(status.demand.position, Position(3000.0), "targets add up, reached or not");
    axis.order(Order::RunAt(Velocity(50_000.0), PROFILE));
    let demand = run(&mut axis, 50).demand.position;
    let status = complete(&mut axis, by(5000.0, Base::Target));
    assert_eq!(status.demand.position, demand + Position(5000.0));
    let actual = run(&mut axis, 50).actual.position;
    let status = complete(&mut axis, by(-500.0, Base::Actual));
    assert_eq!(status.demand.position, actual - Position(500.0));
    let demand = status.demand.position;
    assert_eq!(complete(&mut axis, by(500.0, Base::Demand)).demand.position, demand + Position(500.0));
}

#[test]
fn a_circular_axis_counts_within_its_turn_and_goes_on_for_ever() {
    let mut axis = circular(false);
    axis.order(Order::RunAt(Velocity(90_000.0), PROFILE));
    for _ in 0..3000 {
        axis.step();
        let status = axis.status();
        assert!((0.0..10_000.0).contains(&status.actual.position.0));
        assert!((0.0..10_000.0).contains(&status.demand.position.0));
        assert!(status.following_error.abs() < Position(5.0), "no jump at the turn");
    }
    let status = complete(&mut axis, by(35_000.0, Base::Demand));
    assert!((0.0..10_000.0).contains(&status.demand.position.0));
}

#[test]
fn the_shortest_way_crosses_the_origin_and_the_plain_axis_does_not() {
    for (optimised, longest) in [(false, 9000.0), (true, 1000.0)] {
        let mut axis = circular(optimised);
        complete(&mut axis, Order::MoveTo(Position(500.0), PROFILE));
        axis.order(Order::MoveTo(Position(9500.0), PROFILE));
        let mut way = 0.0;
        while !axis.status().done {
            let before = axis.status().demand.velocity.0;
            axis.step();
            way += (before + axis.status().demand.velocity.0) / 2.0 * 1e-3;
        }
        assert_eq!(axis.status().demand.position, Position(9500.0));
        assert!((way.abs() - longest).abs() < 1.0, "{way}");
    }
}

#[test]
fn an_offset_names_places_anew() {
    let mut axis = enabled();
    complete(&mut axis, Order::MoveTo(Position(1000.0), PROFILE));
    axis.set_offset(Position(250.0));
    assert_eq!((axis.offset(), axis.status().demand.position), (Position(250.0), Position(1250.0)));
    axis.set_position(Position(0.0));
    let error = axis.status().following_error;
    assert_eq!(axis.status().demand.position, error);
    assert!((axis.offset().0 + 1000.0).abs() <= 1.0);
}

#[test]
fn orders_wait_for_each_other_until_a_new_one_sweeps_them_away() {
    let mut axis = enabled();
    axis.move_to(Position(20_000.0), PROFILE);
    axis.then(Order::MoveTo(Position(10_000.0), PROFILE)).unwrap();
    axis.then(by(-500.0, Base::Target)).unwrap();
    assert_eq!(axis.status().queued, 2);
    let highest = run_until(&mut axis, |status| status.done || status.queued == 1);
    assert_eq!(highest.demand.position, Position(20_000.0));
    run_until(&mut axis, |status| status.queued == 0);
    let status = run_until(&mut axis, |status| status.done);
    assert_eq!(status.demand.position, Position(9500.0));
    axis.move_to(Position(0.0), PROFILE);
    axis.then(Order::MoveTo(Position(5000.0), PROFILE)).unwrap();
    run(&mut axis, 20);
    let status = complete(&mut axis, Order::MoveTo(Position(9000.0), PROFILE));
    assert_eq!((status.demand.position, status.queued), (Position(9000.0), 0));
}

#[test]
fn no_more_than_sixteen_orders_wait() {
    let mut axis = enabled();
    axis.move_to(Position(20_000.0), PROFILE);
    for _ in 0..16 {
        axis.then(by(1.0, Base::Target)).unwrap();
    }
    assert_eq!(axis.then(by(1.0, Base::Target)), Err(QueueFull));
}

#[test]
fn an_order_waits_until_the_axis_itself_has_arrived() {
    let mut axis = enabled();
    axis.set_target_window(Some(TargetWindow { radius: Position(2.0), steps: 40 }));
    axis.move_to(Position(10_000.0), PROFILE);
    axis.then(Order::MoveTo(Position(0.0), PROFILE)).unwrap();
    let done = run_until(&mut axis, |status| status.done);
    assert!(!done.on_target);
    let gone = run_until(&mut axis, |status| status.queued == 0);
    assert!(gone.steps >= done.steps + 39, "{} {}", done.steps, gone.steps);
}

#[test]
fn streamed_positions_are_followed_to_the_count() {
    let mut axis = enabled();
    let mut place = 0.0;
    for cycle in 0..500_u32 {
        // Accelerates for 250 cycles of 4 ms, then brakes.
        let speed = f64::from(cycle.min(500 - cycle));
        place += speed;
        axis.order(Order::TrackPosition { target: Position(place), over: steps(4) });
        let status = run(&mut axis, 4);
        assert_eq!(status.demand.position, Position(place));
        assert!(status.done && !status.limited);
    }
    let rest = run(&mut axis, 100);
    assert_eq!((rest.demand.position, rest.demand.velocity), (Position(place), Velocity(0.0)));
}

#[test]
fn a_streamed_jump_is_bounded_by_the_axis_maxima() {
    let mut axis = enabled();
    let mut last = axis.status().demand;
    axis.order(Order::TrackPosition { target: Position(1e6), over: steps(1) });
    while !axis.status().done {
        axis.step();
        let demand = axis.status().demand;
        let most = axis.limits().acceleration.0 * 1e-3 * (1.0 + 1e-8);
        assert!((demand.velocity - last.velocity).0.abs() <= most, "{last:?} {demand:?} {most}");
        assert!(demand.velocity.abs() <= axis.limits().velocity);
        assert!(demand.position <= Position(1e6));
        last = demand;
    }
    assert_eq!(last.position, Position(1e6));
}
