//! Profile velocity mode (IEC 61800-7-201, profile velocity mode).

use axis::{Profile, Velocity};

use super::ModeBits;
use crate::Binding;
use crate::cia402::window::Window;
use crate::cia402::{Context, Controlword, View};

/// What the axis was last told to run at, and whether it does.
#[derive(Debug, Default)]
pub(crate) struct ProfileVelocity {
    commanded: Option<(Velocity, Profile)>,
    window: Window,
}

impl ProfileVelocity {
    pub(super) fn begin(&mut self, word: Controlword, context: &mut Context<'_>) {
        if word.contains(Controlword::HALT) {
            context.axis.stop(context.slow_down_ramp());
        } else {
            self.command(context);
        }
    }

    /// Target and ramps take effect at once in this mode.
    pub(super) fn update(&mut self, word: Controlword, context: &mut Context<'_>) {
        if !word.contains(Controlword::HALT) {
            self.command(context);
        }
    }

    #[expect(clippy::unused_self, reason = "the same verbs for every mode")]
    pub(super) fn control(&mut self, _: Controlword, _: Controlword, _: &mut Context<'_>) {}

    #[expect(clippy::unused_self, reason = "the same verbs for every mode")]
    pub(super) fn halt(&mut self, _: &mut Context<'_>) {}

    pub(super) fn resume(&mut self, _: Controlword, context: &mut Context<'_>) {
        *self = Self::default();
        self.command(context);
    }

    /// Follows the axis after a raster step.
    pub(super) fn step(&mut self, _: Controlword, context: &mut Context<'_>) {
        let status = context.axis.status();
        let target = self.commanded.map_or(Velocity(0.0), |(target, _)| target);
        let width = context.parameters.units.velocity(context.parameters.or(Binding::VelocityWindow, 0));
        let is_near = (status.actual.velocity - target).abs() <= width;
        self.window.step(status.done && is_near);
    }

    /// Bit 10: the axis has run at its target velocity for the window time. Bit 12: its speed is zero.
    pub(super) fn bits(&self, view: View<'_>) -> ModeBits {
        let time = view.parameters.or(Binding::VelocityWindowTime, 0);
        ModeBits {
            is_reached: self.window.is_reached(time, view.axis.period().nanos()),
            bit_12: view.is_standing(),
            bit_13: false,
        }
    }

    /// Commands the axis if target or ramps have changed.
    fn command(&mut self, context: &mut Context<'_>) {
        let Context { parameters, axis, .. } = context;
        let target = parameters.units.velocity(parameters.or(Binding::TargetVelocity, 0));
        let acceleration = parameters.or(Binding::ProfileAcceleration, 0);
        let profile = Profile {
            velocity: axis.limits().velocity,
            acceleration: parameters.units.acceleration(acceleration),
            deceleration: parameters
                .units
                .acceleration(parameters.or(Binding::ProfileDeceleration, acceleration)),
            jerk: None,
        };
        if self.commanded != Some((target, profile)) {
            self.commanded = Some((target, profile));
            self.window.restart();
            axis.run_at(target, profile);
        }
    }
}
