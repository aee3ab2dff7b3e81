//! The primitives of homing: searches for switches, index and mechanical stops.

mod bench;

use axis::{
    Acceleration, Axis, DriveState, Finish, Guard, Limits, Mark, Order, PlantConfig, Position, Seek,
    SeekState, Switch, Torque, Velocity,
};
use bench::{PROFILE, complete, enabled_on, range, run, run_until, seek, steps};

const HOME: Mark = Mark::Switch { switch: Switch::Home, actuated: true };

/// Limit switches at ±50000, the home switch from 10000 to 14000, the index at 1000 in each revolution of 8192.
fn machine() -> PlantConfig {
    PlantConfig {
        positive_switch: Some(Position(50_000.0)),
        negative_switch: Some(Position(-50_000.0)),
        home_switch: range(10_000.0, 14_000.0),
        stops: range(-60_000.0, 60_000.0),
        index: Position(1000.0),
        ..PlantConfig::default()
    }
}

/// An axis that has come to rest at `place`.
fn at(place: f64) -> Axis {
    let mut axis = enabled_on(machine());
    complete(&mut axis, Order::MoveTo(Position(place), PROFILE));
    run(&mut axis, 100);
    axis
}

#[test]
fn every_edge_of_a_switch_is_found_from_either_side() {
    // Start, direction, state looked for, and the edge of the switch that is met first.
    let searches = [
        (0.0, 1.0, true, 10_000.0),
        (20_000.0, -1.0, true, 14_000.0),
        (12_000.0, 1.0, false, 14_000.0),
        (12_000.0, -1.0, false, 10_000.0),
    ];
    for (start, direction, actuated, edge) in searches {
        let mut axis = at(start);
        let mark = Mark::Switch { switch: Switch::Home, actuated };
        let status = complete(&mut axis, seek(mark, direction * 30_000.0, Finish::Ramp));
        assert_eq!(status.seek, SeekState::Found);
        let found = status.mark.unwrap().0;
        assert!((found - edge).abs() <= 1.0, "{start} {direction} {actuated}: {found}");
        // 30000² / (2 · 10^6) and the way of a raster step or two.
        let braking = (status.actual.position.0 - edge) * direction;
        assert!((450.0..=520.0).contains(&braking), "{braking}");
    }
}

#[test]
fn a_fine_search_ends_at_the_mark_itself() {
    let mut axis = at(0.0);
    let status = complete(&mut axis, seek(HOME, 30_000.0, Finish::Return));
    assert_eq!(Some(status.demand.position), status.mark);
    assert!((run(&mut axis, 100).actual.position.0 - 10_000.0).abs() <= 1.0);
}

#[test]
fn a_search_at_creeping_speed_stops_at_once() {
    let mut axis = at(9_900.0);
    let status = complete(&mut axis, seek(HOME, 1000.0, Finish::Abrupt));
    assert!((status.demand.position.0 - 10_000.0).abs() <= 3.0, "{status:?}");
}

#[test]
fn the_next_index_is_found_in_both_directions() {
    for (start, velocity, index) in [(2000.0, 20_000.0, 9192.0), (2000.0, -20_000.0, 1000.0)] {
        let mut axis = at(start);
        let status = complete(&mut axis, seek(Mark::Index, velocity, Finish::Return));
        assert_eq!((status.mark, status.index), (Some(Position(index)), Some(Position(index))));
        assert_eq!(status.demand.position, Position(index));
        let mut axis = at(start);
        let coarse = complete(&mut axis, seek(Mark::Index, velocity, Finish::Ramp));
        assert_eq!(coarse.mark, Some(Position(index)));
        assert!((coarse.demand.position.0 - index) * velocity.signum() > 150.0);
    }
}

#[test]
fn a_switch_that_is_in_the_state_looked_for_is_found_where_the_axis_stands() {
    let mut axis = at(12_000.0);
    let status = complete(&mut axis, seek(HOME, 1000.0, Finish::Abrupt));
    assert_eq!(status.seek, SeekState::Found);
    assert!((status.mark.unwrap().0 - 12_000.0).abs() <= 2.0);
}

#[test]
fn the_limit_switch_looked_for_is_no_limit_and_then_one_again() {
    let mut axis = at(40_000.0);
    axis.set_guard(Guard { emergency_deceleration: Acceleration(1e6), ..Guard::default() });
    let mark = Mark::Switch { switch: Switch::PositiveLimit, actuated: true };
    let status = complete(&mut axis, seek(mark, 30_000.0, Finish::Ramp));
    assert_eq!((status.seek, status.limited), (SeekState::Found, false));
    assert_eq!(status.mark, Some(Position(50_000.0)));
    assert!(status.demand.position.0 > 50_400.0);
    let rest = status.demand.position;
    let status = complete(&mut axis, Order::MoveTo(Position(55_000.0), PROFILE));
    assert_eq!((status.limited, status.demand.position), (true, rest));
    let mark = Mark::Switch { switch: Switch::PositiveLimit, actuated: false };
    let status = complete(&mut axis, seek(mark, -1000.0, Finish::Abrupt));
    assert_eq!((status.seek, status.limited), (SeekState::Found, false));
    assert!((status.mark.unwrap().0 - 50_000.0).abs() <= 1.0);
}

#[test]
fn another_limit_switch_ends_a_search_in_failure() {
    let mut axis = at(20_000.0);
    axis.order(seek(HOME, 30_000.0, Finish::Return));
    let status = run_until(&mut axis, |status| status.seek != SeekState::Searching);
    assert_eq!(status.seek, SeekState::Failed);
    let status = run_until(&mut axis, |status| status.done);
    assert!(status.limited && status.drive == DriveState::Enabled);
    assert!(status.demand.position > Position(50_000.0) && status.demand.position < Position(51_000.0));
}

#[test]
fn a_position_limit_ends_a_search_in_failure() {
    let mut axis = at(0.0);
    axis.set_limits(Limits { position: range(-5000.0, 5000.0), ..Limits::default() });
    axis.order(seek(HOME, 30_000.0, Finish::Return));
    let status = run_until(&mut axis, |status| status.seek == SeekState::Failed);
    assert!(status.demand.position <= Position(5000.0));
    assert!(run_until(&mut axis, |status| status.done).limited);
}

#[test]
fn a_mechanical_stop_is_found_by_its_torque() {
    let plant = PlantConfig { stops: range(-3000.0, 60_000.0), ..PlantConfig::default() };
    let mut axis = enabled_on(plant);
    axis.set_following_error_limit(Some(Position(100.0)));
    let mark = Mark::Torque { limit: Torque(300.0), steps: steps(50) };
    axis.order(seek(mark, -5000.0, Finish::Ramp));
    let mut highest = 0.0_f64;
    while axis.status().seek == SeekState::Searching {
        axis.step();
        highest = highest.max(axis.status().actual.torque.0.abs());
    }
    let status = run_until(&mut axis, |status| status.done);
    assert_eq!((status.seek, status.fault), (SeekState::Found, None));
    assert_eq!(status.mark, Some(Position(-3000.0)));
    assert!(highest <= 300.0, "{highest}");
    assert!((status.demand.position.0 + 3000.0).abs() <= 1.0);
    axis.set_position(Position(0.0));
    let status = complete(&mut axis, Order::MoveTo(Position(100.0), PROFILE));
    assert_eq!(status.mark, Some(Position(0.0)));
}

#[test]
fn a_search_for_a_torque_brakes_with_all_torque_to_its_velocity() {
    let mut axis = enabled_on(PlantConfig { stops: range(-60_000.0, 60_000.0), ..PlantConfig::default() });
    axis.order(Order::RunAt(Velocity(100_000.0), PROFILE));
    run(&mut axis, 100);
    let mark = Mark::Torque { limit: Torque(40.0), steps: steps(3) };
    axis.order(seek(mark, 5_000.0, Finish::Abrupt));
    let mut hardest = Torque(0.0);
    let mut is_slow = false;
    while !is_slow {
        let status = run(&mut axis, 1);
        hardest = if status.actual.torque < hardest { status.actual.torque } else { hardest };
        assert_eq!(status.seek, SeekState::Searching, "braking is not the stop looked for");
        assert!(status.following_error.abs() < Position(20.0), "{status:?}");
        is_slow = status.demand.velocity == Velocity(5_000.0);
    }
    assert!(hardest < Torque(-45.0), "{hardest:?}");
    let found = run_until(&mut axis, |status| status.seek == SeekState::Found);
    assert!((found.actual.position.0 - 60_000.0).abs() < 100.0, "{found:?}");
}

#[test]
fn a_limit_switch_looked_for_is_braked_at_as_hard_as_any() {
    for (actuated, outcome) in [(true, SeekState::Found), (false, SeekState::Failed)] {
        let mut axis = at(0.0);
        axis.order(Order::RunAt(Velocity(100_000.0), PROFILE));
        run(&mut axis, 100);
        let mark = Mark::Switch { switch: Switch::PositiveLimit, actuated };
        let Order::Seek(search) = seek(mark, 100_000.0, Finish::Return) else { continue };
        axis.order(Order::Seek(Seek { deceleration: Acceleration(10_000.0), ..search }));
        let farthest = (0..3000).fold(0.0_f64, |most, _| most.max(run(&mut axis, 1).actual.position.0));
        assert!(farthest < 52_000.0, "{farthest}");
        assert_eq!(axis.status().seek, outcome);
    }
}

#[test]
fn a_new_order_gives_up_a_search() {
    let mut axis = at(0.0);
    axis.order(seek(HOME, 30_000.0, Finish::Return));
    run(&mut axis, 50);
    let status = complete(&mut axis, Order::RunAt(Velocity(-10_000.0), PROFILE));
    assert_eq!((status.seek, status.mark), (SeekState::None, None));
}
