//! Register groups of a MAC motor: copies to the set-points.

use super::Sample;
use crate::Role;
use crate::jvl::groups::Group;

/// What a position register means when it is activated (CNTRL_BITS on the MAC400 and larger, ERR_STAT below).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Relative {
    /// A place.
    #[default]
    No,
    /// A distance that is added to P_SOLL.
    PSoll,
    /// A distance for the generator; P_SOLL stays.
    PFnc,
}

impl Group {
    /// The set-point that the group gives.
    const fn target(self) -> Role {
        match self {
            Self::Position => Role::PSoll,
            Self::Velocity => Role::VSoll,
            Self::Acceleration => Role::ASoll,
            Self::Torque => Role::TSoll,
            Self::Load => Role::Kvout,
            Self::Window => Role::Inposwin,
            Self::Mode => Role::ModeReg,
        }
    }
}

/// Copies register `number` of a group, from 1 on, to its set-point; whether there is such a register.
pub(super) fn copy(sample: &mut Sample<'_, '_>, group: Group, number: u32) -> bool {
    let Some(role) = group.register(number) else { return false };
    let value = sample.register(role);
    sample.set(group.target(), value);
    true
}

/// Copies what the selector of a group names, and lets it read zero again.
pub(super) fn select(sample: &mut Sample<'_, '_>, group: Group) {
    let Some(selector) = group.selector() else { return };
    let number = sample.register(selector);
    copy(sample, group, number.unsigned_abs());
    sample.set(selector, 0);
}

/// Activates the position register `role` as a place or a distance; how much farther the generator is to go on its
/// own.
pub(super) fn activate_place(sample: &mut Sample<'_, '_>, role: Role) -> i32 {
    let value = sample.register(role);
    match sample.relative {
        Relative::No => sample.set(Role::PSoll, value),
        Relative::PSoll => {
            let target = sample.register(Role::PSoll).wrapping_add(value);
            sample.set(Role::PSoll, target);
        }
        Relative::PFnc => return value,
    }
    0
}
