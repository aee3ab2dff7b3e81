//! Motor registers that are CiA 402 objects (JVL Ethernet manual, section 11.4, registers 180 to 194), and what a
//! stepper has of the drive profile.

use crate::cia402::Mode;
use crate::{Binding, Dialect, Role};

/// The registers that show objects, with the bits of these that they show.
pub(super) const OBJECTS: [(Role, Binding, i64); 10] = [
    (Role::Controlword, Binding::Controlword, 0xFFFF),
    (Role::Statusword, Binding::Statusword, 0xFFFF),
    (Role::ModesOfOperation, Binding::ModesOfOperation, 0xFF),
    (Role::ModesOfOperationDisplay, Binding::ModesOfOperationDisplay, 0xFF),
    (Role::TargetPosition, Binding::TargetPosition, WHOLE),
    (Role::ActualPosition, Binding::PositionActual, WHOLE),
    (Role::TargetVelocity, Binding::TargetVelocity, WHOLE),
    (Role::ActualVelocity, Binding::VelocityActual, WHOLE),
    (Role::DigitalOutputs, Binding::DigitalOutputs, 0xFFFF),
    (Role::DigitalInputs, Binding::DigitalInputs, 0xFFFF),
];

/// All bits.
const WHOLE: i64 = -1;

/// The object that the register with this role is when it is written, if it is one.
pub(crate) fn object_of(role: Role) -> Option<Binding> {
    let is_written = |binding| {
        matches!(
            binding,
            Binding::Controlword
                | Binding::ModesOfOperation
                | Binding::TargetPosition
                | Binding::TargetVelocity
                | Binding::DigitalOutputs
        )
    };
    let (_, binding, _) = OBJECTS.into_iter().find(|(register, ..)| *register == role)?;
    is_written(binding).then_some(binding)
}

/// What the object becomes when `value` is written to its register and `before` is in it: the register has its low
/// bits. A mode that JVL's drives do not have is not taken.
pub(crate) fn taken(binding: Binding, value: i64, before: Option<i64>) -> Option<i64> {
    match binding {
        Binding::ModesOfOperation => {
            let code = i64::from(value as i8);
            Mode::from_code(code).filter(|mode| mode.is_in(Dialect::Jvl)).map(|_| code)
        }
        _ => {
            let (.., mask) = OBJECTS.into_iter().find(|(_, object, _)| *object == binding)?;
            Some(before? & !mask | value & mask)
        }
    }
}

/// Whether a MIS stepper has this homing method of 0x6098; 0, "no homing", always (JVL Ethernet manual, section 3.5.8).
pub(crate) const fn is_stepper_homing(method: i64) -> bool {
    matches!(method, 0 | 20 | 22 | 35)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_register_of_16_bits_leaves_the_upper_ones_of_its_object() {
        let before = Some(0x00FF_0000);
        assert_eq!(taken(Binding::DigitalOutputs, 0x7_1234, before), Some(0x00FF_1234));
        assert_eq!(taken(Binding::TargetPosition, -5, Some(7)), Some(-5));
    }

    #[test]
    fn only_modes_that_the_drive_has_are_taken() {
        assert_eq!(
            [1, 6, 8, 259].map(|m| taken(Binding::ModesOfOperation, m, Some(0))),
            [Some(1), Some(6), None, Some(3)]
        );
    }

    #[test]
    fn what_shows_a_state_is_not_written() {
        assert_eq!(object_of(Role::Statusword), None);
        assert_eq!(object_of(Role::Controlword), Some(Binding::Controlword));
        assert_eq!(object_of(Role::PSoll), None);
    }
}
