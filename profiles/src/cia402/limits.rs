//! The limits that a drive's objects put on its axis.

use axis::{Axis, Limits, Period, Position, PositionRange};

use super::units;
use crate::slots::Parameters;
use crate::{Binding, Motor};

/// What the motor can do: the limits of an axis before any object narrows them.
pub(crate) fn of_motor(motor: &Motor) -> Limits {
    use core::f64::consts::TAU;
    // With a load as heavy as the rotor, and a tenth of the peak torque left to the controller.
    let radians = 0.9 * motor.rated_torque_nm * motor.peak_torque_factor / (2.0 * motor.rotor_inertia_kg_m2);
    Limits {
        velocity: units::from_rpm(i64::from(motor.max_speed_rpm), motor.counts_per_revolution),
        acceleration: axis::Acceleration(radians / TAU * f64::from(motor.counts_per_revolution)),
        deceleration: None,
        jerk: None,
        deceleration: None,
        torque: axis::Torque(1000.0 * motor.peak_torque_factor),
        position: None,
    }
}

/// Puts the limits of the objects on the axis, never beyond those of the motor.
pub(crate) fn apply(motor: &Motor, parameters: Parameters<'_>, axis: &mut Axis) {
    let of_motor = of_motor(motor);
    let speed =
        parameters.get(Binding::MaxMotorSpeed).map(|rpm| units::from_rpm(rpm, motor.counts_per_revolution));
    let profile = parameters.get(Binding::MaxProfileVelocity).map(|v| parameters.units.velocity(v));
    let velocity =
        [speed, profile].into_iter().flatten().fold(of_motor.velocity.0, |least, v| least.min(v.0));
    let ramp = [Binding::MaxAcceleration, Binding::MaxDeceleration].map(|b| parameters.get(b));
    let ramp = ramp.into_iter().flatten().filter(|v| *v > 0).map(|v| v as f64);
    let acceleration = ramp.fold(of_motor.acceleration.0, f64::min);
    let limits = Limits {
        velocity: axis::Velocity(velocity),
        acceleration: axis::Acceleration(acceleration),
        position: software_limits(parameters),
        ..of_motor
    };
    if *axis.limits() != limits {
        axis.set_limits(limits);
    }
    axis.set_torque_limit(axis::TorqueLimit::both(
        parameters.units.torque(parameters.or(Binding::MaxTorque, i64::MAX)),
    ));
    // 0xFFFFFFFF switches the supervision off (IEC 61800-7-201, 0x6065).
    let window = parameters.get(Binding::FollowingErrorWindow).filter(|w| *w != i64::from(u32::MAX));
    axis.set_following_error_limit(window.map(|w| parameters.units.distance(w)));
    axis.set_following_error_time(following_error_time(parameters, axis.period()));
}

/// 0x6066 in raster steps, the last one begun.
fn following_error_time(parameters: Parameters<'_>, period: Period) -> u32 {
    let nanos = parameters.or(Binding::FollowingErrorTime, 0).unsigned_abs() * 1_000_000;
    u32::try_from(nanos.div_ceil(period.nanos())).unwrap_or(u32::MAX)
}

/// 0x607D; equal limits, as both are from factory, are none.
fn software_limits(parameters: Parameters<'_>) -> Option<PositionRange> {
    let min = parameters.get(Binding::MinPositionLimit)?;
    let max = parameters.get(Binding::MaxPositionLimit)?;
    if min == max { None } else { PositionRange::new(Position(min as f64), Position(max as f64)) }
}
