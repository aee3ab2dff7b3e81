//! Register groups: sets of set-points that a command makes the present ones (JVL Ethernet manual, section 11.3,
//! registers 43 to 88).

use crate::Role;

/// A set-point that register groups can give.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Group {
    /// P1-P8, for P_SOLL.
    Position,
    /// V1-V8, for V_SOLL.
    Velocity,
    /// A1-A4, for A_SOLL.
    Acceleration,
    /// T1-T4, for the torque or the running current.
    Torque,
    /// L1-L4, for the load factor.
    Load,
    /// Z1-Z4, for the in-position window.
    Window,
    /// M1-M4, for the mode; no command activates those with the others.
    Mode,
}

impl Group {
    /// What a FastMac command activates, in that order.
    pub(crate) const ACTIVATED: [Self; 6] =
        [Self::Position, Self::Velocity, Self::Acceleration, Self::Torque, Self::Load, Self::Window];

    /// The register number `number` of the group, from 1 on; `None` if there is none.
    pub(crate) fn register(self, number: u32) -> Option<Role> {
        self.registers().get(usize::try_from(number).ok()?.checked_sub(1)?).copied()
    }

    /// The register that takes a number and activates what stands there; it reads zero afterwards.
    pub(crate) const fn selector(self) -> Option<Role> {
        match self {
            Self::Position => Some(Role::PRegP),
            Self::Velocity => Some(Role::VRegP),
            Self::Acceleration => Some(Role::ARegP),
            Self::Torque => Some(Role::TRegP),
            Self::Load => Some(Role::LRegP),
            Self::Window => Some(Role::ZRegP),
            Self::Mode => None,
        }
    }

    const fn registers(self) -> &'static [Role] {
        match self {
            Self::Position => &Role::POSITIONS,
            Self::Velocity => &Role::VELOCITIES,
            Self::Acceleration => &Role::ACCELERATIONS,
            Self::Torque => &Role::TORQUES,
            Self::Load => &Role::LOADS,
            Self::Window => &Role::WINDOWS,
            Self::Mode => &Role::MODES,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_counts_its_registers_from_one() {
        assert_eq!(Group::Velocity.register(3), Some(Role::Vel2));
        assert_eq!(Group::Position.register(8), Some(Role::Pos7));
        assert_eq!(Group::Load.register(4), Some(Role::Load3));
        assert_eq!([0, 9, u32::MAX].map(|number| Group::Position.register(number)), [None; 3]);
        assert_eq!(Group::Window.register(5), None);
    }
}
