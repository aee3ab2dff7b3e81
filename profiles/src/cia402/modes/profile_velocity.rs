//! Profile velocity mode (IEC 61800-7-201, profile velocity mode).

use axis::{Profile, Velocity};

use super::ModeBits;
use crate::Binding;
use crate::cia402::window::Window;
use crate::cia402::{Context, Controlword, View, ramps};

/// What the axis was last told to run at, and whether it does.
#[derive(Debug, Default)]
pub(crate) struct ProfileVelocity {
    commanded: Option<(Velocity, Profile)>,
    window: Window,
    /// Faster than the velocity threshold.
    moving: Window,
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
        self.commanded = None;
        self.command(context);
    }

    /// Follows the axis after a raster step.
    pub(super) fn step(&mut self, _: Controlword, context: &mut Context<'_>) {
        let Context { parameters, axis, .. } = context;
        let status = axis.status();
        let target = self.commanded.map_or(Velocity(0.0), |(target, _)| target);
        let width = parameters.units.velocity(parameters.or(Binding::VelocityWindow, 0));
        let is_near = (status.actual.velocity - target).abs() <= width;
        self.window.step(status.done && is_near);
        // A drive without a threshold has the window for it.
        let threshold = parameters.get(Binding::VelocityThreshold);
        let threshold = threshold.map_or(width, |threshold| parameters.units.velocity(threshold));
        self.moving.step(status.actual.velocity.abs() > threshold);
    }

    /// Bit 10: the axis has run at its target velocity for the window time. Bit 12: its speed is zero, as it has not
    /// been above the threshold for the threshold time. Bit 13: the slippage is above its maximum.
    pub(super) fn bits(&self, view: View<'_>) -> ModeBits {
        let nanos = view.axis.period().nanos();
        let is_reached = self.window.is_reached(view.parameters.or(Binding::VelocityWindowTime, 0), nanos);
        let is_moving = self.moving.is_reached(view.parameters.or(Binding::VelocityThresholdTime, 0), nanos);
        ModeBits { is_reached, bit_12: !is_moving, bit_13: slips(view) }
    }

    /// Commands the axis if target or ramps have changed.
    fn command(&mut self, context: &mut Context<'_>) {
        let Context { parameters, axis, .. } = context;
        let target = parameters.units.target_velocity(parameters.or(Binding::TargetVelocity, 0));
        let profile = ramps::profile(*parameters, axis.limits().velocity);
        if self.commanded != Some((target, profile)) {
            self.commanded = Some((target, profile));
            self.window.restart();
            axis.run_at(target, profile);
        }
    }
}

/// Whether the velocity is farther from the demand than 0x60F8 allows.
fn slips(view: View<'_>) -> bool {
    let status = view.axis.status();
    let slippage = (status.demand.velocity - status.actual.velocity).abs();
    let most = view.parameters.get(Binding::MaxSlippage);
    most.is_some_and(|most| slippage > view.parameters.units.velocity(most).abs())
}
