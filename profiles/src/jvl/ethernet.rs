//! What JVL's Ethernet modules do beside showing registers.

use crate::cia402::AbortConnection;

/// Setup bits of module register 6 (Ethernet manual, section 8.2.6).
const SETS_VELOCITY_TO_ZERO: i32 = 1 << 0;
const IGNORES_ERRORS: i32 = 1 << 1;

/// What becomes of the motor when nobody polls it any more (Ethernet manual, section 8.2.10): by default it is passive.
pub(crate) const fn reaction_to_silence(setup: i32) -> AbortConnection {
    if setup & IGNORES_ERRORS != 0 {
        AbortConnection::NoAction
    } else if setup & SETS_VELOCITY_TO_ZERO != 0 {
        AbortConnection::QuickStop
    } else {
        AbortConnection::DisableVoltage
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn setup_bits_0_and_1_say_what_silence_does() {
        let reactions = [0b00, 0b01, 0b10, 0b11, 0b100].map(reaction_to_silence);
        let (passive, brake, none) =
            (AbortConnection::DisableVoltage, AbortConnection::QuickStop, AbortConnection::NoAction);
        assert_eq!(reactions, [passive, brake, none, none, passive]);
    }
}
