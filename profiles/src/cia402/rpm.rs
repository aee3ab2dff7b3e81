//! The units of velocity mode (IEC 61800-7-201, velocity mode): revolutions per minute of the motor, unless the
//! dimension factor 0x604C or the set-point factor 0x604B says otherwise.
//!
//! A part of a factor that is zero counts as one. What is shown is rounded to the nearest whole number, halves away
//! from zero, and saturates at 16 bits.

use axis::{Acceleration, Velocity};

use super::units;
use crate::slots::Parameters;
use crate::{Binding, Motor};

/// The units of one axis in velocity mode.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RpmUnits {
    /// What targets are multiplied by.
    set_point: f64,
    /// Revolutions per minute in a unit.
    dimension: f64,
    /// One revolution per minute.
    rpm: Velocity,
}

impl RpmUnits {
    pub(crate) fn of(parameters: Parameters<'_>, motor: &Motor) -> Self {
        let factor = |numerator, divisor| part(parameters, numerator) / part(parameters, divisor);
        Self {
            set_point: factor(Binding::VlSetPointNumerator, Binding::VlSetPointDenominator),
            dimension: factor(Binding::VlDimensionNumerator, Binding::VlDimensionDenominator),
            rpm: units::from_rpm(1, motor.counts_per_revolution),
        }
    }

    /// The velocity that 0x6042 means, its amount kept within 0x6046; zero stays zero.
    pub(crate) fn target(&self, value: i64, amounts: (i64, i64)) -> Velocity {
        let (least, most) = amounts;
        let units = value as f64 * self.set_point;
        let amount = units.abs().max(least as f64).min(most as f64);
        let amount = if units == 0.0 { 0.0 } else { amount };
        self.velocity(amount * units.signum())
    }

    /// The ramp with a change of so many units in so many seconds; zero of either is the axis maximum.
    pub(crate) fn ramp(&self, speed: i64, seconds: i64) -> Acceleration {
        let rate = if seconds > 0 { self.velocity(speed as f64).0 / seconds as f64 } else { 0.0 };
        Acceleration(rate.abs())
    }

    /// The velocity as 0x6043 and 0x6044 show it.
    pub(crate) fn shown(&self, velocity: Velocity) -> i64 {
        let units = velocity.0 / self.rpm.0 / self.dimension / self.set_point;
        i64::from(units.round() as i16)
    }

    fn velocity(&self, units: f64) -> Velocity {
        Velocity(units * self.dimension * self.rpm.0)
    }
}

fn part(parameters: Parameters<'_>, binding: Binding) -> f64 {
    match parameters.or(binding, 1) {
        0 => 1.0,
        value => value as f64,
    }
}
