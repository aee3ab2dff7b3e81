//! What stops an axis: limit switches, emergency stop, drive fault signal, following error, supervision.

mod bench;

use axis::{
    Acceleration, Axis, BehindLimit, DriveState, Fault, Guard, Level, Levels, Motion, Order, PlantConfig,
    Position, PowerDelays, Reaction, Torque, TorqueLimit, Velocity,
};
use bench::{PROFILE, complete, enabled, enabled_on, range, run, run_until, steps};

const EMERGENCY: Acceleration = Acceleration(4e6);

fn braking(levels: Levels) -> Guard {
    Guard {
        levels,
        emergency_deceleration: EMERGENCY,
        following_error: Reaction::Brake,
        drive_signal: Reaction::Brake,
        supervision: Reaction::Brake,
        ..Guard::default()
    }
}

/// An axis that runs at 100000 counts/s towards its positive limit switch at 50000.
fn running() -> Axis {
    let mut axis =
        enabled_on(PlantConfig { positive_switch: Some(Position(50_000.0)), ..PlantConfig::default() });
    axis.set_guard(braking(Levels::default()));
    axis.order(Order::RunAt(Velocity(100_000.0), PROFILE));
    axis
}

#[test]
fn a_limit_switch_brakes_by_the_emergency_ramp_and_holds() {
    let mut axis = running();
    run_until(&mut axis, |status| status.switches.positive_limit);
    let status = run_until(&mut axis, |status| status.done);
    assert!(status.limited && status.drive == DriveState::Enabled);
    // 100000² / (2 · 4·10^6), and two raster steps at full speed.
    let way = status.demand.position.0 - 50_000.0;
    assert!((1250.0..=1450.0).contains(&way), "{way}");
    assert_eq!(run(&mut axis, 1).motion, Motion::Standstill);
}

#[test]
fn behind_a_limit_switch_only_the_way_back_is_open() {
    let mut axis = running();
    let rest = run_until(&mut axis, |status| status.done && status.limited).demand.position;
    for order in [
        Order::MoveTo(Position(60_000.0), PROFILE),
        Order::RunAt(Velocity(10.0), PROFILE),
        Order::TrackPosition { target: Position(60_000.0), over: steps(1) },
        Order::TrackVelocity { target: Velocity(1000.0), over: steps(1) },
        Order::Push { torque: Torque(200.0), slope: Torque(0.0) },
    ] {
        axis.order(order);
        let status = run(&mut axis, 200);
        assert!((status.demand.position - rest).abs() <= Position(1.0), "{order:?}: {status:?}");
        assert!(status.limited, "{order:?}");
    }
    let status = complete(&mut axis, Order::MoveTo(Position(40_000.0), PROFILE));
    assert_eq!((status.limited, status.demand.position), (false, Position(40_000.0)));
    let status = complete(&mut axis, Order::MoveTo(Position(49_000.0), PROFILE));
    assert_eq!((status.limited, status.demand.position), (false, Position(49_000.0)));
}

#[test]
fn an_order_that_comes_amid_the_braking_leads_back_at_once() {
    let mut axis = running();
    run_until(&mut axis, |status| status.switches.positive_limit);
    run(&mut axis, 3);
    let status = complete(&mut axis, Order::MoveTo(Position(0.0), PROFILE));
    assert_eq!((status.demand.position, status.fault), (Position(0.0), None));
}

#[test]
fn behind_a_narrow_switch_the_axis_remembers_unless_told_otherwise() {
    for (behind_limit, is_open) in [(BehindLimit::Closed, false), (BehindLimit::Open, true)] {
        let mut axis = enabled_on(PlantConfig {
            positive_switch: Some(Position(50_000.0)),
            limit_switch_width: Some(Position(300.0)),
            ..PlantConfig::default()
        });
        axis.set_guard(Guard { behind_limit, ..braking(Levels::default()) });
        axis.order(Order::RunAt(Velocity(100_000.0), PROFILE));
        let status = run_until(&mut axis, |status| status.done && status.limited);
        assert!(!status.switches.positive_limit, "it has come to rest behind the switch");
        let status = complete(&mut axis, Order::MoveTo(Position(52_000.0), PROFILE));
        assert_eq!(status.limited, !is_open, "{behind_limit:?}");
        let status = complete(&mut axis, Order::MoveTo(Position(40_000.0), PROFILE));
        assert!(!status.limited);
    }
}

#[test]
fn an_emergency_stop_cuts_the_power_and_the_motor_coasts() {
    let mut axis = running();
    run(&mut axis, 100);
    // Nobody presses the button: a level that is always active stands for it.
    let levels = Levels { emergency_stop: Level::Low, ..Levels::default() };
    axis.set_guard(braking(levels));
    let status = run(&mut axis, 2);
    assert_eq!((status.fault, status.motion), (Some(Fault::EmergencyStop), Motion::Off));
    assert!(status.actual.velocity > Velocity(90_000.0));
    let later = run(&mut axis, 10);
    assert!(later.actual.velocity > Velocity(90_000.0) && later.actual.torque == Torque(0.0));
    axis.reset_fault();
    assert_eq!(run(&mut axis, 1).fault, Some(Fault::EmergencyStop), "the button is still pressed");
    axis.set_guard(braking(Levels::default()));
    run(&mut axis, 1);
    axis.reset_fault();
    axis.power_on();
    assert_eq!(run(&mut axis, 20).drive, DriveState::Enabled);
}

#[test]
fn a_drive_fault_signal_brakes_then_switches_off() {
    let mut axis = running();
    let running = run(&mut axis, 100);
    axis.set_guard(braking(Levels { drive_fault: Level::Low, ..Levels::default() }));
    let status = run(&mut axis, 2);
    assert_eq!((status.fault, status.motion), (Some(Fault::DriveSignal), Motion::Decelerating));
    axis.order(Order::RunAt(Velocity(100_000.0), PROFILE));
    let status = run_until(&mut axis, |status| status.drive == DriveState::Disabled);
    assert!(status.actual.velocity.abs() < Velocity(500.0), "{status:?}");
    let way = (status.actual.position - running.actual.position).0;
    assert!((1250.0..=1600.0).contains(&way), "{way}");
}

#[test]
fn too_large_a_following_error_brakes_from_where_the_axis_is() {
    let mut axis = running();
    axis.set_following_error_limit(Some(Position(200.0)));
    run(&mut axis, 200);
    axis.set_torque_limit(TorqueLimit::both(Torque(10.0)));
    let at_fault = run_until(&mut axis, |status| status.fault.is_some());
    assert_eq!(at_fault.fault, Some(Fault::FollowingError));
    axis.set_torque_limit(TorqueLimit::both(Torque(3000.0)));
    let status = run_until(&mut axis, |status| status.drive == DriveState::Disabled);
    let way = (status.actual.position - at_fault.actual.position).0;
    let expected = at_fault.actual.velocity.0.powi(2) / (2.0 * EMERGENCY.0);
    assert!((way - expected).abs() < 0.1 * expected + 150.0, "{way} {expected}");
}

#[test]
fn without_a_sign_of_life_the_axis_brakes_and_switches_off() {
    let mut axis = running();
    axis.set_supervision(Some(steps(50)));
    for _ in 0..10 {
        run(&mut axis, 40);
        axis.confirm();
    }
    assert_eq!(axis.status().fault, None);
    assert_eq!(run(&mut axis, 50).fault, None);
    assert_eq!(run(&mut axis, 1).fault, Some(Fault::Supervision));
    // 100000 / 4·10^6 s.
    let status = run(&mut axis, 27);
    assert_eq!((status.drive, status.actual.velocity.0.abs() < 500.0), (DriveState::Disabled, true));
}

#[test]
fn an_axis_without_power_is_not_supervised_and_power_starts_it_anew() {
    let mut axis = running();
    axis.power_off();
    axis.set_supervision(Some(steps(50)));
    assert_eq!(run(&mut axis, 5000).fault, None);
    axis.power_on();
    assert_eq!(run(&mut axis, 45).fault, None);
    assert_eq!(run(&mut axis, 10).fault, Some(Fault::Supervision));
}

#[test]
fn a_holding_brake_gets_its_time() {
    let mut axis = enabled();
    axis.set_power_delays(PowerDelays { on: 30, off: 20 });
    axis.power_off();
    assert_eq!(run(&mut axis, 19).drive, DriveState::Enabled);
    assert_eq!(run(&mut axis, 3).drive, DriveState::Disabled);
    axis.power_on();
    assert_eq!(run(&mut axis, 35).drive, DriveState::Enabling);
    axis.move_to(Position(1000.0), PROFILE);
    let status = run(&mut axis, 10);
    assert_eq!((status.drive, status.demand.position), (DriveState::Enabled, Position(0.0)));
    complete(&mut axis, Order::MoveTo(Position(1000.0), PROFILE));
    axis.order(Order::RunAt(Velocity(50_000.0), PROFILE));
    run(&mut axis, 50);
    axis.cut_power();
    assert_eq!(run(&mut axis, 1).drive, DriveState::Disabled, "a cut waits for nothing");
}

#[test]
fn a_torque_ends_at_a_limit_and_never_drives_above_the_highest_speed() {
    let mut axis = enabled();
    axis.set_limits(axis::Limits { velocity: Velocity(50_000.0), ..*axis.limits() });
    let push = Order::Push { torque: Torque(500.0), slope: Torque(1000.0) };
    assert!(!{
        axis.order(push);
        axis.status().done
    });
    let torques = [5, 10, 5].map(|steps| Torque(run(&mut axis, steps).actual.torque.0.round()));
    assert_eq!(torques, [5.0, 15.0, 20.0].map(Torque));
    let status = run(&mut axis, 2000);
    assert!(status.done && status.actual.velocity <= Velocity(50_000.0), "{status:?}");
    let end = status.actual.position.0 + 20_000.0;
    axis.set_limits(axis::Limits { position: range(-1e9, end), ..*axis.limits() });
    let status = run_until(&mut axis, |status| status.done && status.limited);
    assert!(status.demand.position.0 <= end && status.demand.position.0 > end - 1000.0, "{status:?}");
    assert!((0.0..1.0).contains(&run(&mut axis, 100).actual.velocity.0));
}

#[test]
fn the_direct_output_is_cut_off_by_a_limit_switch() {
    let mut axis = running();
    axis.stop(Acceleration(0.0));
    run(&mut axis, 100);
    axis.order(Order::Output(0.02));
    let status = run_until(&mut axis, |status| status.switches.positive_limit);
    assert_eq!(status.fault, None);
    assert_eq!(run(&mut axis, 1).drive, DriveState::Disabled);
    run(&mut axis, 1000);
    axis.power_on();
    run(&mut axis, 20);
    axis.order(Order::Output(-0.02));
    assert!(run_until(&mut axis, |status| !status.switches.positive_limit).drive == DriveState::Enabled);
}
