//! What a drive watches beside its axis: the speed of the motor, and signs of trouble to come.

use axis::{Motion, Temperature, Velocity};

use super::{Context, View};
use crate::Binding;
use crate::simulated::HOTTEST;

/// Notices a motor that runs faster than 0x6080 allows.
///
/// The ceiling is that speed. When it is lowered on the move, it follows the motor down: only a motor that becomes
/// faster is at fault.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SpeedWatch {
    ceiling: Option<Velocity>,
}

impl SpeedWatch {
    /// Looks at the motor after a raster step: whether it is a tenth too fast, and a hundredth of what the motor can.
    pub(crate) fn step(&mut self, context: &Context<'_>) -> bool {
        let speed = context.axis.status().actual.velocity.abs();
        let (allowed, most) = highest(context);
        let ceiling = self.ceiling.map_or(speed.0, |ceiling| ceiling.0.min(speed.0)).max(allowed.0);
        self.ceiling = Some(Velocity(ceiling));
        let is_powered = context.axis.status().motion != Motion::Off;
        is_powered && speed.0 > 1.1 * ceiling + 0.01 * most.0
    }
}

/// The speed that 0x6080 allows, and that of the motor.
fn highest(context: &Context<'_>) -> (Velocity, Velocity) {
    let motor = context.motor;
    let most = i64::from(motor.max_speed_rpm);
    let allowed = context.parameters.or(Binding::MaxMotorSpeed, most).min(most);
    let speed = |rpm| super::units::from_rpm(rpm, motor.counts_per_revolution);
    (speed(allowed), speed(most))
}

/// Whether the drive warns (bit 7 of the statusword): with power, and more than 80 % of the overload capacity (I²t)
/// used, or the motor less than 10 K below its highest temperature, or a following error of more than half the
/// window.
pub(crate) fn warns(view: View<'_>) -> bool {
    const CLOSE: Temperature = Temperature(10.0);
    let status = view.axis.status();
    let window = view.parameters.get(Binding::FollowingErrorWindow).filter(|w| *w != i64::from(u32::MAX));
    let half = window.map(|w| view.parameters.units.distance(w).0 / 2.0);
    let strays = half.is_some_and(|half| half > 0.0 && status.following_error.0.abs() > half);
    let is_hot = status.temperature > HOTTEST - CLOSE;
    status.motion != Motion::Off && (status.overload > 0.8 || is_hot || strays)
}
