//! The limits that a drive's objects put on its axis, each in its user unit.

use axis::{Acceleration, Limits, Period, PositionRange, Torque, TorqueLimit, Velocity};

use super::{Context, units};
use crate::slots::Parameters;
use crate::{Binding, Dialect, Motor, jvl};

/// What the motor can do: the limits of an axis before any object narrows them.
pub(crate) fn of_motor(motor: &Motor) -> Limits {
    use core::f64::consts::TAU;
    // With a load as heavy as the rotor, and a tenth of the peak torque left to the controller.
    let radians = 0.9 * motor.rated_torque_nm * motor.peak_torque_factor / (2.0 * motor.rotor_inertia_kg_m2);
    Limits {
        velocity: units::from_rpm(i64::from(motor.max_speed_rpm), motor.counts_per_revolution),
        acceleration: Acceleration(radians / TAU * f64::from(motor.counts_per_revolution)),
        deceleration: None,
        jerk: None,
        torque: Torque(1000.0 * motor.peak_torque_factor),
        position: None,
    }
}

/// Puts the limits of the objects on the axis, never beyond those of the motor.
pub(crate) fn apply(context: &mut Context<'_>) {
    let Context { parameters, axis, motor, dialect, .. } = context;
    let of_motor = of_motor(motor);
    let ramp = |binding| ramp(*parameters, binding, of_motor.acceleration);
    let limits = Limits {
        velocity: velocity(*parameters, motor, of_motor.velocity),
        acceleration: ramp(Binding::MaxAcceleration),
        deceleration: Some(ramp(Binding::MaxDeceleration)),
        position: software_limits(*parameters, *dialect),
        ..of_motor
    };
    if *axis.limits() != limits {
        axis.set_limits(limits);
    }
    axis.set_torque_limit(torque_limit(*parameters, motor));
    // 0xFFFFFFFF switches the supervision off (IEC 61800-7-201, 0x6065).
    let window = parameters.get(Binding::FollowingErrorWindow).filter(|w| *w != i64::from(u32::MAX));
    axis.set_following_error_limit(window.map(|w| parameters.units.distance(w)));
    axis.set_following_error_time(following_error_time(*parameters, axis.period()));
}

/// 0x6066 in raster steps, the last one begun.
fn following_error_time(parameters: Parameters<'_>, period: Period) -> u32 {
    let nanos = parameters.or(Binding::FollowingErrorTime, 0).unsigned_abs() * 1_000_000;
    u32::try_from(nanos.div_ceil(period.nanos())).unwrap_or(u32::MAX)
}

/// The least of 0x607F, 0x6080 and what the motor can.
fn velocity(parameters: Parameters<'_>, motor: &Motor, most: Velocity) -> Velocity {
    let profile = parameters.get(Binding::MaxProfileVelocity).map(|v| parameters.units.velocity(v));
    let speed =
        parameters.get(Binding::MaxMotorSpeed).map(|rpm| units::from_rpm(rpm, motor.counts_per_revolution));
    [profile, speed].into_iter().flatten().fold(most, |least, v| Velocity(least.0.min(v.0)))
}

/// 0x60C5 or 0x60C6; zero is no limit beside that of the motor.
fn ramp(parameters: Parameters<'_>, binding: Binding, most: Acceleration) -> Acceleration {
    let limit = parameters.get(binding).filter(|value| *value > 0);
    limit.map_or(most, |value| Acceleration(parameters.units.acceleration(value).0.min(most.0)))
}

/// On each side the least of 0x6072, 0x60E0 or 0x60E1, and what the current of a stepper makes.
fn torque_limit(parameters: Parameters<'_>, motor: &Motor) -> TorqueLimit {
    let torque = |binding| parameters.units.torque(parameters.or(binding, i64::MAX));
    let sides = TorqueLimit {
        positive: torque(Binding::PositiveTorqueLimit),
        negative: torque(Binding::NegativeTorqueLimit),
    };
    let least = sides.least(TorqueLimit::both(torque(Binding::MaxTorque)));
    current_limit(parameters, motor).map_or(least, |limit| least.least(TorqueLimit::both(limit)))
}

/// The torque of the lesser of 0x2204 and 0x6073, if it is a stepper that has them. Zero for 0x6073 is no limit.
fn current_limit(parameters: Parameters<'_>, motor: &Motor) -> Option<Torque> {
    let stepper = motor.stepper()?;
    let rated = parameters.or(Binding::MotorRatedCurrent, stepper.rated_current_ma.into());
    let most = parameters.get(Binding::MaxCurrent).filter(|most| *most > 0);
    let most = most.map(|per_mille| per_mille as f64 * rated as f64 / 1000.0);
    let running = parameters.get(Binding::JvlRunCurrent).map(|current| current as f64);
    let current = [most, running].into_iter().flatten().reduce(f64::min)?;
    Some(Torque(1000.0 * current / f64::from(stepper.rated_current_ma)))
}

/// 0x607D. By the standard it counts from the machine home position, so 0x607C is taken off; the module manual knows
/// nothing of that. Where places have no lasting numbers there is no limit.
fn software_limits(parameters: Parameters<'_>, dialect: Dialect) -> Option<PositionRange> {
    if jvl::is_endless(parameters) {
        return None;
    }
    let min = parameters.get(Binding::MinPositionLimit)?;
    let max = parameters.get(Binding::MaxPositionLimit)?;
    let offset = match dialect {
        Dialect::Cia402 | Dialect::Mac4(_) => parameters.or(Binding::HomeOffset, 0),
        Dialect::Jvl => 0,
    };
    parameters.units.range(min, max, offset)
}
