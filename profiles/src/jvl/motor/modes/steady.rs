//! The modes without a memory: a velocity, a torque or a rest that follows from registers and inputs alone.

use axis::Profile;

use super::Demand;
use super::analog::{self, Input};
use crate::Role;
use crate::jvl::motor::Sample;
use crate::jvl::motor::mode::Mode;

/// A mode without a memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Steady {
    /// V_SOLL, as it is or by the analogue input.
    Velocity(Input),
    /// A torque by the analogue input.
    Torque {
        /// V_SOLL is the highest velocity.
        is_limited: bool,
    },
    /// To rest with ACC_EMERG.
    Brake,
    /// To rest with A_SOLL.
    Stop,
}

impl Steady {
    pub(super) fn mode(self) -> Mode {
        match self {
            Self::Velocity(Input::Ignored) => Mode::Velocity,
            Self::Velocity(Input::Whole) => Mode::AnalogVelocity,
            Self::Velocity(Input::OutsideDeadband) => Mode::AnalogVelocityDeadband,
            Self::Torque { is_limited: false } => Mode::AnalogTorque,
            Self::Torque { is_limited: true } => Mode::LimitedAnalogTorque,
            Self::Brake => Mode::Brake,
            Self::Stop => Mode::Stop,
        }
    }

    pub(super) fn demand(self, sample: &Sample<'_, '_>) -> Demand {
        match self {
            Self::Velocity(input) => {
                let velocity = analog::velocity(input, sample);
                Demand::Speed(velocity, Profile { velocity: velocity.abs(), ..sample.profile() })
            }
            Self::Torque { .. } => Demand::Torque(analog::torque(sample)),
            Self::Brake => Demand::Rest(sample.acceleration(Role::AccEmerg)),
            Self::Stop => Demand::Rest(sample.acceleration(Role::ASoll)),
        }
    }
}
