//! What the module counts on the way to its motor since it was started (JVL Ethernet manual, section 8.1, registers 35
//! to 38).
//!
//! A simulated module needs no frames to read from its motor, and repeats none: what it counts are the registers and
//! commands that it passes on.

use axis::DriveState;

use crate::Role;
use crate::vendor::Scope;

/// The counters.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Traffic {
    frames: u32,
    discarded: u32,
    timeouts: u32,
    /// The motor is not heard.
    is_lost: bool,
}

impl Traffic {
    /// So many registers or commands are passed on.
    pub(super) fn pass(&mut self, frames: u32) {
        self.frames = self.frames.wrapping_add(frames);
    }

    /// A PDO was dropped because too many waited for the motor.
    pub(super) fn drop_one(&mut self) {
        self.discarded = self.discarded.wrapping_add(1);
    }

    /// Follows whether the motor is heard.
    pub(super) fn step(&mut self, drive: DriveState) {
        let is_lost = drive == DriveState::Lost;
        if is_lost && !core::mem::replace(&mut self.is_lost, is_lost) {
            self.timeouts = self.timeouts.wrapping_add(1);
        }
        self.is_lost = is_lost;
    }

    /// Starts from zero, as the module does.
    pub(super) fn restart(&mut self) {
        *self = Self { is_lost: self.is_lost, ..Self::default() };
    }

    /// Shows the counters in their registers.
    pub(super) fn show(&self, scope: &mut Scope<'_>) {
        scope.show_register(Role::ModuleTimeouts, self.timeouts.cast_signed());
        scope.show_register(Role::ModuleDiscarded, self.discarded.cast_signed());
        self.show_frames(scope);
    }

    /// Shows the one that everything passed on changes.
    pub(super) fn show_frames(&self, scope: &mut Scope<'_>) {
        scope.show_register(Role::ModuleFrames, self.frames.cast_signed());
    }
}
