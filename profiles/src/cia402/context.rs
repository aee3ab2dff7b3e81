//! What a drive works with, and what it shows its state from.

use axis::{Acceleration, Axis};

use super::{Mode, SetPoints, limits, modes, options};
use crate::slots::Parameters;
use crate::vendor::Mover;
use crate::{Binding, Dialect, Motor};

/// What a drive works with: its objects and its axis.
pub(crate) struct Context<'a> {
    pub(crate) parameters: Parameters<'a>,
    pub(crate) axis: &'a mut Axis,
    pub(crate) motor: &'a Motor,
    /// The set-points that were written just now.
    pub(crate) written: SetPoints,
    /// Whose drive it is, where vendors differ.
    pub(crate) dialect: Dialect,
    /// The axis knows its home position.
    pub(crate) is_referenced: &'a mut bool,
    /// The mode in effect when the drive was called.
    pub(crate) mode: Mode,
    /// Who moves the axis when the drive is called.
    pub(crate) mover: Mover,
    /// A limit switch that is met may be an error.
    pub(crate) minds_limit_switches: bool,
}

impl Context<'_> {
    /// Switches the axis off, unless others run it.
    pub(super) fn power_off(&mut self) {
        if !self.mover.is_vendor() {
            self.axis.power_off();
        }
    }

    /// Takes the axis over from others, with the limits and reactions of the objects.
    pub(super) fn take_over(&mut self) {
        if self.mover.is_vendor() {
            self.apply_limits();
            options::guard_axis(self);
        }
    }

    /// Puts the limits of the objects on the axis.
    pub(crate) fn apply_limits(&mut self) {
        limits::apply(self);
    }

    /// The ramp that ends a motion in its mode.
    pub(crate) fn slow_down_ramp(&self) -> Acceleration {
        if self.mode == Mode::Velocity {
            return modes::vl_deceleration(self);
        }
        let acceleration = self.parameters.or(Binding::ProfileAcceleration, 0);
        self.parameters.units.acceleration(self.parameters.or(Binding::ProfileDeceleration, acceleration))
    }

    /// The ramp of a quick stop.
    pub(crate) fn quick_stop_ramp(&self) -> Acceleration {
        if self.mode == Mode::Velocity {
            return modes::vl_quick_stop(self);
        }
        self.parameters.units.acceleration(self.parameters.or(Binding::QuickStopDeceleration, 0))
    }
}

/// What a drive shows its state from.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) parameters: Parameters<'a>,
    pub(crate) axis: &'a Axis,
}

impl View<'_> {
    /// Whether the actual velocity counts as zero.
    pub(crate) fn is_standing(&self) -> bool {
        let window = self.parameters.or(Binding::VelocityWindow, 0);
        let threshold = self.parameters.or(Binding::VelocityThreshold, window);
        self.axis.status().actual.velocity.abs() <= self.parameters.units.velocity(threshold)
    }
}
