//! What the registers of a MIS stepper put on its axis.

use axis::{Guard, Limits, Position, PositionRange, Standby, Stepping, Velocity};

use super::{Sample, pins, units};
use crate::Role;
use crate::cia402::limits_of;

/// MIN_P_IST and MAX_P_IST, of which zero is no limit; none where they leave no place.
pub(super) fn range(sample: &Sample<'_, '_>) -> Option<PositionRange> {
    let end = |role, without: f64| match sample.register(role) {
        0 => without,
        end => f64::from(end),
    };
    let (min, max) = (end(Role::MinPIst, f64::NEG_INFINITY), end(Role::MaxPIst, f64::INFINITY));
    if min.is_infinite() && max.is_infinite() {
        return None;
    }
    let [one, other] = [min, max].map(|end| sample.units.way(Position(end)));
    if sample.is_reversed() { PositionRange::new(other, one) } else { PositionRange::new(one, other) }
}

/// What holds whoever runs the axis: standby current, turn table, inputs and the emergency ramp.
pub(super) fn apply_to_both(sample: &mut Sample<'_, '_>) {
    let travel = sample.travel();
    let levels = pins::axis_levels(sample);
    let stepper = sample.stepper;
    let standby = Standby {
        after: standby_steps(sample),
        limit: units::torque(sample.register(Role::StandbyCurrent), &stepper),
    };
    let guard = *sample.axis().guard();
    let emergency_deceleration = if sample.scope.drive.operates() {
        guard.emergency_deceleration
    } else {
        sample.acceleration(Role::AccEmerg)
    };
    let axis = sample.axis_mut();
    axis.set_standby(Some(standby));
    if axis.travel() != travel {
        axis.set_travel(travel);
    }
    let wanted = Guard { levels, emergency_deceleration, ..guard };
    if guard != wanted {
        axis.set_guard(wanted);
    }
}

/// Lets motions start with V_START, which is taken at standstill; `taken` is the one of before.
pub(super) fn take_start_velocity(taken: &mut Option<i32>, sample: &mut Sample<'_, '_>) {
    let wanted = sample.register(Role::VStart);
    if *taken == Some(wanted) || sample.axis().status().demand.velocity != Velocity(0.0) {
        return;
    }
    *taken = Some(wanted);
    let stepping = Stepping { start_stop: sample.units.velocity(wanted).abs(), creep: None };
    sample.axis_mut().set_stepping(Some(stepping));
}

/// STANDBY_TIME in raster steps.
fn standby_steps(sample: &Sample<'_, '_>) -> u32 {
    let nanos = u64::from(sample.register(Role::StandbyTime).max(0).unsigned_abs()) * 1_000_000;
    u32::try_from(nanos / sample.axis().period().nanos()).unwrap_or(u32::MAX)
}

/// The limits of a mode. A zero search has none for its places.
pub(super) fn apply(is_search: bool, sample: &mut Sample<'_, '_>) {
    let position = if is_search { None } else { range(sample) };
    let limits = Limits { position, ..limits_of(sample.scope.motor) };
    let axis = sample.axis_mut();
    if *axis.limits() != limits {
        axis.set_limits(limits);
    }
}
