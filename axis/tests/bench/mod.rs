//! An axis on its simulated drive, for tests.
#![allow(dead_code, reason = "each test uses a part of it")]

use std::num::NonZeroU32;

use axis::{
    Acceleration, Axis, DriveState, Limits, Order, Period, PlantConfig, Position, PositionRange, Profile,
    Seek, ServoConfig, SimulatedServo, Status, Velocity,
};

pub(crate) const PROFILE: Profile = Profile {
    velocity: Velocity(100_000.0),
    acceleration: Acceleration(2e6),
    deceleration: Acceleration(2e6),
    jerk: None,
};

pub(crate) fn steps(count: u32) -> NonZeroU32 {
    NonZeroU32::new(count).unwrap()
}

pub(crate) fn range(min: f64, max: f64) -> Option<PositionRange> {
    PositionRange::new(Position(min), Position(max))
}

/// An axis of 1 ms on this plant, without power.
pub(crate) fn axis_on(plant: PlantConfig) -> Axis {
    let servo = SimulatedServo::new(Period::MILLISECOND, ServoConfig { plant, ..ServoConfig::default() });
    Axis::new(Period::MILLISECOND, Limits::default(), Box::new(servo))
}

/// The same with power.
pub(crate) fn enabled_on(plant: PlantConfig) -> Axis {
    let mut axis = axis_on(plant);
    axis.power_on();
    assert_eq!(run(&mut axis, 11).drive, DriveState::Enabled);
    axis
}

pub(crate) fn enabled() -> Axis {
    enabled_on(PlantConfig::default())
}

pub(crate) fn run(axis: &mut Axis, steps: u32) -> Status {
    (0..steps).for_each(|_| axis.step());
    *axis.status()
}

/// Steps until `is_met`, for ten seconds at most.
pub(crate) fn run_until(axis: &mut Axis, is_met: impl Fn(&Status) -> bool) -> Status {
    for _ in 0..10_000 {
        axis.step();
        if is_met(axis.status()) {
            return *axis.status();
        }
    }
    panic!("never met: {:?}", axis.status());
}

/// Gives an order and waits until it is done.
pub(crate) fn complete(axis: &mut Axis, order: Order) -> Status {
    axis.order(order);
    run_until(axis, |status| status.done)
}

/// A search at this velocity.
pub(crate) fn seek(mark: axis::Mark, velocity: f64, finish: axis::Finish) -> Order {
    Order::Seek(Seek {
        mark,
        velocity: Velocity(velocity),
        acceleration: Acceleration(1e6),
        deceleration: Acceleration(1e6),
        finish,
    })
}
