//! Which set-points a bus has written: also one that is written with the value it had is a new one.

use bitflags::bitflags;

use crate::Binding;

bitflags! {
    /// Set-points of the cyclic modes.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(crate) struct SetPoints: u8 {
        /// Target position or its offset.
        const POSITION = 1 << 0;
        /// Target velocity or its offset.
        const VELOCITY = 1 << 1;
        /// Target torque or its offset.
        const TORQUE = 1 << 2;
        /// The interpolation data record.
        const RECORD = 1 << 3;
    }
}

impl SetPoints {
    /// The set-points that an entry is part of.
    pub(crate) fn of(binding: Binding) -> Self {
        match binding {
            Binding::TargetPosition | Binding::PositionOffset => Self::POSITION,
            Binding::TargetVelocity | Binding::VelocityOffset => Self::VELOCITY,
            Binding::TargetTorque | Binding::TorqueOffset => Self::TORQUE,
            Binding::InterpolationRecord => Self::RECORD,
            _ => Self::empty(),
        }
    }
}
