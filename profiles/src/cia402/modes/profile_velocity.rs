//! Profile velocity mode (IEC 61800-7-201, profile velocity mode).

use axis::{Axis, Profile, Velocity};

use super::units;
use super::window::Window;
use crate::Binding;
use crate::slots::Parameters;

/// What the axis was last told to run at, and whether it does.
#[derive(Debug, Default)]
pub(crate) struct Running {
    commanded: Option<(Velocity, Profile)>,
    window: Window,
}

impl Running {
    /// Starts anew; the next [`Running::update`] commands the axis.
    pub(crate) fn restart(&mut self) {
        *self = Self::default();
    }

    /// Commands the axis if target or ramps have changed: they take effect at once in this mode.
    pub(crate) fn update(&mut self, parameters: Parameters<'_>, axis: &mut Axis) {
        let target = units::to_velocity(parameters.or(Binding::TargetVelocity, 0));
        let acceleration = parameters.or(Binding::ProfileAcceleration, 0);
        let profile = Profile {
            velocity: axis.limits().velocity,
            acceleration: units::to_acceleration(acceleration),
            deceleration: units::to_acceleration(parameters.or(Binding::ProfileDeceleration, acceleration)),
            jerk: None,
        };
        if self.commanded != Some((target, profile)) {
            self.commanded = Some((target, profile));
            self.window.restart();
            axis.run_at(target, profile);
        }
    }

    /// Follows the axis after a raster step.
    pub(crate) fn step(&mut self, parameters: Parameters<'_>, axis: &Axis) {
        let status = axis.status();
        let target = self.commanded.map_or(Velocity(0.0), |(target, _)| target);
        let width = units::to_velocity(parameters.or(Binding::VelocityWindow, 0));
        let is_near = (status.actual.velocity - target).abs() <= width;
        self.window.step(status.done && is_near);
    }

    /// Whether the axis has run at its target velocity for the window time.
    pub(crate) fn is_reached(&self, parameters: Parameters<'_>, axis: &Axis) -> bool {
        self.window.is_reached(parameters.or(Binding::VelocityWindowTime, 0), axis.period().nanos())
    }
}
