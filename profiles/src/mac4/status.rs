//! The status words, bit for bit (appendix 7.1).

use bitflags::bitflags;

bitflags! {
    /// RBS: the state of an axis for its user; bits 0-7 are the mode (appendix 7.1.1).
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct UserStatus: u32 {
        /// The axis is enabled.
        const DR_EN = 1 << 8;
        /// The output is reversed.
        const REV_O = 1 << 9;
        /// Positioning is completed.
        const POS_END = 1 << 10;
        /// The justification is completed.
        const JUS_END = 1 << 11;
        /// The axis is initialised.
        const INIT = 1 << 12;
        /// Syntax error.
        const SYN_F = 1 << 13;
        /// Limit value error.
        const LIMIT_F = 1 << 14;
        /// Logical error.
        const LOGO_F = 1 << 15;
        /// Error of the position measurement system.
        const ENCODER_F = 1 << 16;
        /// The "drive fault" signal is on, or was and is not acknowledged.
        const DR_F = 1 << 17;
        /// Following error overflow.
        const FERR_F = 1 << 18;
        /// The negative hardware limit switch is on.
        const HWL_N = 1 << 19;
        /// The positive hardware limit switch is on.
        const HWL_P = 1 << 20;
        /// The axis is at the negative software limit or beyond.
        const SWL_N = 1 << 21;
        /// The axis is at the positive software limit or beyond.
        const SWL_P = 1 << 22;
        /// The reference switch is on.
        const REF = 1 << 23;
        /// Instructions act at once.
        const ON_FLY = 1 << 25;
        /// SSI: the sensor has Gray code.
        const GRAY = 1 << 27;

        /// What has to be acknowledged.
        const ERRORS = Self::SYN_F.bits() | Self::LIMIT_F.bits() | Self::LOGO_F.bits()
            | Self::ENCODER_F.bits() | Self::DR_F.bits() | Self::FERR_F.bits();
    }
}

bitflags! {
    /// RSS: the state of an axis inside (appendix 7.1.2). Bits that the manual calls internal and does not explain
    /// are zero. Where INC and SSI have another bit than STP both names are here.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct SystemStatus: u32 {
        /// Commands are taken.
        const M_RDY = 1 << 0;
        /// The initialisation is done.
        const INIT_WEG_SYS = 1 << 7;
        /// STP: the axis holds its place with a sensor.
        const SERVO_ON = 1 << 9;
        /// INC and SSI: the axis is locked, since it has no power.
        const DR_DISABLE = 1 << 10;
        /// STP: motion in negative direction.
        const DIRECTION = 1 << 10;
        /// STP: the BOOST signal is on.
        const BOOST = 1 << 11;
        /// STP: the BOOST signal permits a move.
        const BOOST_EN = 1 << 12;
        /// STP: TURBO operation.
        const TURBO = 1 << 13;
        /// STP: the LED "P" is on.
        const IN_POS = 1 << 15;
        /// STP: the LED "F" is on.
        const LED_FAULT = 1 << 16;
        /// STP: the BOOST signal is on and does not permit a move yet.
        const BOOST_LOCK = 1 << 18;
        /// STP: the axis is locked, since it has no power.
        const DR_DISABLE_STP = 1 << 22;
        /// STP: the axis is stopped by the mode "brake".
        const BRAKE_STOP = 1 << 23;
    }
}

bitflags! {
    /// RAS: the state of the card (appendix 7.1.3).
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct OverallStatus: u32 {
        /// Hardware emergency stop: the switch is on, or was and is not acknowledged.
        const H_STOP = 1 << 0;
        /// False axis number.
        const AXIS_F = 1 << 1;
        /// The watchdog has acted.
        const WATCH_F = 1 << 2;
        /// Signal FC0.
        const FCODE0 = 1 << 3;
        /// Signal FC1.
        const FCODE1 = 1 << 4;
        /// Signal FC2.
        const FCODE2 = 1 << 5;
        /// An axis is enabled.
        const SERV_EN = 1 << 6;

        /// What has to be acknowledged.
        const ERRORS = Self::H_STOP.bits() | Self::AXIS_F.bits() | Self::WATCH_F.bits();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bits_of_the_user_status_are_those_of_the_table() {
        let table = [
            (8, "DR_EN"),
            (9, "REV_O"),
            (10, "POS_END"),
            (11, "JUS_END"),
            (12, "INIT"),
            (13, "SYN_F"),
            (14, "LIMIT_F"),
            (15, "LOGO_F"),
            (16, "ENCODER_F"),
            (17, "DR_F"),
            (18, "FERR_F"),
            (19, "HWL_N"),
            (20, "HWL_P"),
            (21, "SWL_N"),
            (22, "SWL_P"),
            (23, "REF"),
            (25, "ON_FLY"),
            (27, "GRAY"),
        ];
        let bits = |name: &str| UserStatus::from_name(name).map(|bits| bits.bits());
        table.iter().for_each(|(bit, name)| assert_eq!(bits(name), Some(1 << bit), "{name}"));
        let all = table.iter().fold(0_u32, |all, (bit, _)| all | 1 << bit);
        assert_eq!(UserStatus::all().bits(), all, "24, 26 and 28-31 are free");
    }

    #[test]
    fn the_bits_of_the_system_status_are_those_of_the_table() {
        let table = [
            (0, "M_RDY"),
            (7, "INIT_WEG_SYS"),
            (9, "SERVO_ON"),
            (10, "DR_DISABLE"),
            (10, "DIRECTION"),
            (11, "BOOST"),
            (12, "BOOST_EN"),
            (13, "TURBO"),
            (15, "IN_POS"),
            (16, "LED_FAULT"),
            (18, "BOOST_LOCK"),
            (22, "DR_DISABLE_STP"),
            (23, "BRAKE_STOP"),
        ];
        let bits = |name: &str| SystemStatus::from_name(name).map(|bits| bits.bits());
        table.iter().for_each(|(bit, name)| assert_eq!(bits(name), Some(1 << bit), "{name}"));
    }

    #[test]
    fn the_bits_of_the_overall_status_are_those_of_the_table() {
        let table = ["H_STOP", "AXIS_F", "WATCH_F", "FCODE0", "FCODE1", "FCODE2", "SERV_EN"];
        for (bit, name) in table.iter().enumerate() {
            assert_eq!(OverallStatus::from_name(name).map(|bits| bits.bits()), Some(1 << bit), "{name}");
        }
        assert_eq!(OverallStatus::all().bits(), 0x7F);
    }
}
