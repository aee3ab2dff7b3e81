//! Inputs and outputs that a module shares with its motor: bits 7 to 9 of its setup bits (JVL Ethernet manual, section
//! 8.2.6).

use bitflags::bitflags;

use super::inputs;
use crate::Role;
use crate::vendor::Scope;

bitflags! {
    /// Bits of module register 6.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    struct Setup: i32 {
        /// Inputs are mirrored when they have been stable for a while.
        const DEBOUNCE = 1 << 7;
        /// The outputs follow bits 30 and 31 of the motor's ERR_STAT.
        const OUTPUTS = 1 << 8;
        /// The inputs are copied to the motor.
        const INPUTS = 1 << 9;
    }
}

/// How many inputs a module has, IN1 first.
const INPUTS: usize = 4;
/// How long an input must be stable: "15-25ms delay".
const DEBOUNCE_SECONDS: f64 = 0.02;
/// The motor register with the inputs, and IN1 in it.
const HW_PLIM: u16 = 210;
const IN1: u32 = 2;
/// Where O1 is in ERR_STAT.
const O1: u32 = 30;

/// O1 and O2 in bits, by ERR_STAT of the motor.
pub(super) const fn outputs(motor_status: u32) -> u32 {
    motor_status >> O1
}

/// What is shared.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mirror {
    setup: Setup,
    /// The inputs as they were last seen, in bits.
    seen: u8,
    /// The inputs as the motor has them.
    inputs: u8,
    /// For how long each has been other than the motor has it, in seconds.
    other_for: [f64; INPUTS],
}

impl Mirror {
    /// Looks at setup bits and inputs, `seconds` after the last time.
    pub(super) fn look(&mut self, seconds: f64, scope: &Scope<'_>) {
        self.setup = Setup::from_bits_truncate(scope.register(Role::ModuleSetupBits));
        self.seen = inputs::active(scope.parameters(), &scope.axis.status().inputs) & 0b1111;
        let needed = if self.setup.contains(Setup::DEBOUNCE) { DEBOUNCE_SECONDS } else { 0.0 };
        for (input, other_for) in self.other_for.iter_mut().enumerate() {
            let bit = 1 << input;
            let is_other = (self.seen ^ self.inputs) & bit != 0;
            *other_for = if is_other { *other_for + seconds } else { 0.0 };
            if is_other && *other_for >= needed {
                self.inputs ^= bit;
            }
        }
    }

    /// Whether an input waits for being stable.
    pub(super) fn is_settling(&self) -> bool {
        self.setup.contains(Setup::INPUTS) && self.seen != self.inputs
    }

    /// Whether the outputs are those of the motor.
    pub(super) fn takes_outputs(&self) -> bool {
        self.setup.contains(Setup::OUTPUTS)
    }

    /// Gives the inputs to a motor that has a register for them.
    pub(super) fn show(&self, scope: &mut Scope<'_>) {
        let has_register = scope.registers.role_of_number(HW_PLIM) == Some(Role::Hardwarelim);
        if !self.setup.contains(Setup::INPUTS) || !has_register || scope.dictionary.has_written() {
            return;
        }
        let rest = scope.register(Role::Hardwarelim) & !(0b1111 << IN1);
        scope.show_register(Role::Hardwarelim, rest | i32::from(self.inputs) << IN1);
    }
}
