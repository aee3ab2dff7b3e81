//! The command register of JVL's Ethernet modules (module register 15; JVL Ethernet manual, section 8.2.12).
//!
//! A command is carried out when the register changes its value; so one that is held in cyclic data acts once, and
//! acts again after a zero.

/// What a module can be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Command {
    /// Nothing, or what a simulated module does not have.
    None,
    /// Start the module anew; the motor runs on.
    ResetModule,
    /// Keep the module registers.
    SaveModule,
    /// Give the module registers their defaults.
    RestoreModule,
    /// Start motor and module anew.
    ResetBoth,
    /// Keep the motor registers; the motor runs on.
    SaveMotor,
    /// A number for the command register of the motor.
    Motor(u32),
}

impl Command {
    /// What `value` in the command register means.
    pub(crate) const fn of(value: u32) -> Self {
        const TO_MOTOR: u32 = 1 << 31;
        match value {
            0x01 => Self::ResetModule,
            0x10 => Self::SaveModule,
            0x12 => Self::RestoreModule,
            0x101 => Self::ResetBoth,
            0x110 => Self::SaveMotor,
            TO_MOTOR.. => Self::Motor(value & !TO_MOTOR),
            // 0: no operation, 0x11: its LED, 0x13 and 0x14: its pulse of the distributed clock.
            _ => Self::None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_simulated_module_does_not_have_is_taken_and_does_nothing() {
        assert_eq!([0x11, 0x13, 0x14, 0x02, 0x100, 0x111].map(Command::of), [Command::None; 6]);
    }

    #[test]
    fn commands_are_for_the_module_or_go_on_to_the_motor() {
        let meant =
            [0x00, 0x01, 0x10, 0x12, 0x101, 0x110, 0x8000_0001, 0x8000_00F1, 0x8000_010C, 0x7FFF_FFFF];
        let commands = meant.map(Command::of);
        assert_eq!(
            commands,
            [
                Command::None,
                Command::ResetModule,
                Command::SaveModule,
                Command::RestoreModule,
                Command::ResetBoth,
                Command::SaveMotor,
                Command::Motor(1),
                Command::Motor(0xF1),
                Command::Motor(0x10C),
                Command::None,
            ]
        );
    }
}
