//! Hardware-input functions: registers that copy others while an input is on or off (JVL Ethernet manual, register 93).
//!
//! They look at the level of their input in each sample, HWI0 first, so that later ones have the last word.

use crate::jvl::groups::Group;

/// What one function does in a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Copy {
    /// Nothing.
    None,
    /// Makes a register of a group the set-point, counted from 1.
    FromGroup(Group, u32),
    /// Copies a register to another.
    Register {
        /// From this number.
        from: u16,
        /// To this number.
        to: u16,
    },
}

/// The set-point in bits 3:0 that stands for any register.
const ANY_REGISTER: u32 = 7;

impl Copy {
    /// What the function in `register` does while the inputs are like this.
    pub(super) fn of(register: i32, inputs: u32) -> Self {
        let byte = |shift: u32| register.cast_unsigned() >> shift & 0xFF;
        let is_on = inputs >> (byte(0) >> 4) & 1 == 1;
        let source = byte(if is_on { 16 } else { 8 });
        let target = byte(0) & 0x0F;
        if source == 0 {
            return Self::None;
        }
        match (target, group(target)) {
            (_, Some(group)) => Self::FromGroup(group, source),
            (ANY_REGISTER, _) if byte(24) != 0 => Self::Register { from: source as u16, to: byte(24) as u16 },
            _ => Self::None,
        }
    }
}

/// The group that bits 3:0 name.
const fn group(target: u32) -> Option<Group> {
    match target {
        1 => Some(Group::Mode),
        2 => Some(Group::Velocity),
        3 => Some(Group::Position),
        4 => Some(Group::Acceleration),
        5 => Some(Group::Torque),
        6 => Some(Group::Window),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_level_of_the_input_chooses_the_source() {
        // Input 3: on V2, off V5.
        let register = 0x0002_0532;
        assert_eq!(Copy::of(register, 0b1000), Copy::FromGroup(Group::Velocity, 2));
        assert_eq!(Copy::of(register, 0b0111), Copy::FromGroup(Group::Velocity, 5));
    }

    #[test]
    fn a_source_of_zero_and_a_target_of_none_do_nothing() {
        assert_eq!(Copy::of(0x0002_0032, 0), Copy::None);
        for target in [0, 8, 15] {
            assert_eq!(Copy::of(0x0101_0100 | target, 0), Copy::None);
        }
        assert_eq!(Copy::of(0x0001_0107, 0), Copy::None);
    }

    #[test]
    fn target_7_copies_between_any_registers() {
        let register = (0xF1_u32 << 24 | 0x10 << 16 | 0x11 << 8 | 0xF7).cast_signed();
        assert_eq!(Copy::of(register, 1 << 15), Copy::Register { from: 0x10, to: 0xF1 });
        assert_eq!(Copy::of(register, 0), Copy::Register { from: 0x11, to: 0xF1 });
    }
}
