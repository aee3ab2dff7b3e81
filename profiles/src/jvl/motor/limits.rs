//! The limits that registers put on the axis while a mode runs it.

use axis::{Limits, Position, PositionRange, TorqueLimit, Velocity};

use super::Sample;
use super::mode::Mode;
use crate::Role;
use crate::cia402::limits_of;
use crate::jvl::units::MacUnits;

/// MIN_P_IST and MAX_P_IST, of which zero is no limit; `Err` where they leave no place.
pub(super) fn range(sample: &Sample<'_, '_>) -> Result<Option<PositionRange>, ()> {
    let end = |role| Some(sample.register(role)).filter(|end| *end != 0).map(f64::from);
    match (end(Role::MinPIst), end(Role::MaxPIst)) {
        (None, None) => Ok(None),
        (min, max) => {
            let min = Position(min.unwrap_or(f64::NEG_INFINITY));
            let max = Position(max.unwrap_or(f64::INFINITY));
            PositionRange::new(min, max).map(Some).ok_or(())
        }
    }
}

/// Puts the limits of `mode` on the axis.
pub(super) fn apply(mode: Mode, has_limits_off: bool, sample: &mut Sample<'_, '_>) {
    let of_motor = limits_of(sample.scope.motor);
    let speed = if mode == Mode::LimitedAnalogTorque {
        sample.velocity(Role::VSoll).abs().0.min(of_motor.velocity.0)
    } else {
        of_motor.velocity.0
    };
    let position = if has_limits_off { None } else { range(sample).unwrap_or_default() };
    let limits = Limits { velocity: Velocity(speed), position, ..of_motor };
    let torque = sample.register(if mode.is_search() { Role::THome } else { Role::TSoll });
    let emergency_deceleration = sample.acceleration(Role::AccEmerg);
    let axis = sample.axis_mut();
    if *axis.limits() != limits {
        axis.set_limits(limits);
    }
    if axis.guard().emergency_deceleration != emergency_deceleration {
        axis.set_guard(axis::Guard { emergency_deceleration, ..*axis.guard() });
    }
    axis.set_torque_limit(TorqueLimit::both(MacUnits::torque(torque)));
    axis.set_following_error_limit(None);
}
