//! What JVL's motors of both kinds ask of their axis and of the CiA 402 drive on it.

use axis::{DriveState, Position};

use crate::cia402::Mode;
use crate::vendor::{Mover, Scope};

impl Scope<'_> {
    /// The drive can be switched on.
    pub(super) fn is_ready(&self) -> bool {
        self.axis.status().drive != DriveState::NotReady
    }

    /// The axis obeys.
    pub(super) fn has_power(&self) -> bool {
        self.axis.status().drive == DriveState::Enabled
    }

    /// The CiA 402 drive has the axis, or there is a fault.
    pub(super) fn is_taken(&self) -> bool {
        self.drive.operates() || self.drive.has_failed()
    }

    /// The motor's registers no longer move the axis.
    pub(super) fn give_back(&mut self) {
        self.mover = Mover::Cia402;
    }

    /// Gives the axis the limits and reactions of the CiA 402 objects again.
    pub(super) fn restore_limits(&mut self) {
        let (drive, mut context) = self.drive();
        drive.handle_parameters(&mut context);
    }

    /// The place of `position` within a turn of the encoder.
    pub(super) fn single_turn(&self, position: Position) -> i32 {
        let raw = position - self.axis.offset();
        raw.0.round().rem_euclid(f64::from(self.motor.counts_per_revolution)) as i32
    }
}

/// Whether MODE_REG shows this mode of the CiA 402 drive as that of velocity; the others are that of position.
pub(super) const fn is_shown_as_velocity(mode: Mode) -> bool {
    match mode {
        Mode::ProfileVelocity | Mode::Velocity | Mode::CyclicVelocity => true,
        Mode::None
        | Mode::ProfilePosition
        | Mode::ProfileTorque
        | Mode::Homing
        | Mode::Interpolated
        | Mode::CyclicPosition
        | Mode::CyclicTorque => false,
    }
}
