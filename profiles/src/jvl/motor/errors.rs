//! ERR_STAT: what is wrong with a MAC motor, and what it is doing (JVL Ethernet manual, sections 11.2 and 11.3).
//!
//! The bits of the MAC400 and larger from 7 on are lost in that manual, but for UV_ERR. Ours are those that JVL's
//! motors have; bit 19, which an example of the manual shows without an error, is "bus voltage ready" there.

use axis::DriveFault;
use bitflags::bitflags;

use crate::jvl::units::Family;

bitflags! {
    /// Errors of a motor.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct Errors: u16 {
        /// The windings are too hot.
        const I2T = 1 << 0;
        /// The motor is too far from its set-point.
        const FOLLOW = 1 << 1;
        /// The motor is too far behind its ideal motion.
        const FUNCTION = 1 << 2;
        /// The brake resistor is too hot.
        const UIT = 1 << 3;
        /// A position limit was passed.
        const POSITION_LIMIT = 1 << 4;
        /// Too much current.
        const CURRENT = 1 << 5;
        /// The supply is too low.
        const UNDER_VOLTAGE = 1 << 6;
        /// The supply is too high.
        const OVER_VOLTAGE = 1 << 7;
        /// The drive is too hot.
        const TEMPERATURE = 1 << 8;
        /// The encoder fails.
        const ENCODER = 1 << 9;
        /// A safety input has taken the torque off.
        const SAFE_TORQUE_OFF = 1 << 10;
        /// Anything else.
        const INTERNAL = 1 << 11;
    }
}

bitflags! {
    /// What else ERR_STAT shows.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct Flags: u16 {
        /// In position, or at the velocity.
        const IN_POSITION = 1 << 0;
        /// The velocity rises.
        const ACCELERATING = 1 << 1;
        /// The velocity falls.
        const DECELERATING = 1 << 2;
        /// Position registers are distances for P_SOLL (small motors).
        const RELATIVE_P_SOLL = 1 << 3;
        /// Position registers are distances for the generator (small motors).
        const RELATIVE_P_FNC = 1 << 4;
        /// The supply is near its lower limit.
        const LOW_SUPPLY = 1 << 5;
        /// The position limits are off.
        const LIMITS_OFF = 1 << 6;
        /// The bus voltage is there (large motors).
        const BUS_READY = 1 << 7;
        /// Output O1 of a module that mirrors it (large motors).
        const OUTPUT_1 = 1 << 8;
        /// Output O2 of a module that mirrors it (large motors).
        const OUTPUT_2 = 1 << 9;
    }
}

/// An error with its bits in ERR_STAT of the small and of the large motors. What the small ones have no bit for shows
/// as the nearest that they have.
const ERROR_BITS: [(Errors, u8, u8); 12] = [
    (Errors::I2T, 0, 0),
    (Errors::FOLLOW, 1, 1),
    (Errors::FUNCTION, 2, 2),
    (Errors::UIT, 3, 3),
    (Errors::POSITION_LIMIT, 7, 7),
    (Errors::CURRENT, 11, 12),
    (Errors::UNDER_VOLTAGE, 12, 9),
    (Errors::OVER_VOLTAGE, 3, 11),
    (Errors::TEMPERATURE, 0, 8),
    (Errors::ENCODER, 11, 15),
    (Errors::SAFE_TORQUE_OFF, 11, 26),
    (Errors::INTERNAL, 11, 24),
];

/// A flag with its bits, if it has any.
const FLAG_BITS: [(Flags, Option<u8>, Option<u8>); 10] = [
    (Flags::IN_POSITION, Some(4), Some(4)),
    (Flags::ACCELERATING, Some(5), Some(5)),
    (Flags::DECELERATING, Some(6), Some(6)),
    (Flags::RELATIVE_P_SOLL, Some(9), None),
    (Flags::RELATIVE_P_FNC, Some(10), None),
    (Flags::LOW_SUPPLY, Some(13), Some(10)),
    (Flags::LIMITS_OFF, Some(14), Some(14)),
    (Flags::BUS_READY, None, Some(19)),
    (Flags::OUTPUT_1, None, Some(30)),
    (Flags::OUTPUT_2, None, Some(31)),
];

/// Set on the large motors with any error.
const ANY_ERROR: u32 = 1 << 23;

impl Errors {
    /// The error that a fault of the axis is.
    pub(super) const fn of(fault: axis::Fault) -> Self {
        match fault {
            axis::Fault::FollowingError => Self::FOLLOW,
            // An error of the module, of which the motor knows nothing.
            axis::Fault::Lost => Self::empty(),
            axis::Fault::EmergencyStop | axis::Fault::DriveSignal | axis::Fault::Supervision => {
                Self::INTERNAL
            }
            axis::Fault::Drive(cause) => match cause {
                DriveFault::OverCurrent => Self::CURRENT,
                DriveFault::OverVoltage => Self::OVER_VOLTAGE,
                DriveFault::UnderVoltage => Self::UNDER_VOLTAGE,
                DriveFault::OverTemperature => Self::TEMPERATURE,
                DriveFault::Overload => Self::I2T,
                DriveFault::Encoder => Self::ENCODER,
                DriveFault::SafeTorqueOff => Self::SAFE_TORQUE_OFF,
                DriveFault::Internal => Self::INTERNAL,
            },
        }
    }

    /// The errors whose bits are set in `status`.
    pub(super) fn from_status(status: i32, family: Family) -> Self {
        let is_set = |(_, small, large): &&(Self, u8, u8)| bit(status, of(family, *small, *large));
        ERROR_BITS.iter().filter(is_set).fold(Self::empty(), |all, (error, ..)| all | *error)
    }
}

impl Flags {
    /// The flags that are set in `status`.
    pub(super) fn from_status(status: i32, family: Family) -> Self {
        let is_set = |(_, small, large): &&(Self, Option<u8>, Option<u8>)| {
            of(family, *small, *large).is_some_and(|number| bit(status, number))
        };
        FLAG_BITS.iter().filter(is_set).fold(Self::empty(), |all, (flag, ..)| all | *flag)
    }
}

/// ERR_STAT.
pub(super) fn status(errors: Errors, flags: Flags, family: Family) -> i32 {
    let wrong = ERROR_BITS.iter().filter(|(error, ..)| errors.contains(*error));
    let wrong = wrong.fold(0_u32, |all, (_, small, large)| all | 1 << of(family, *small, *large));
    let shown = FLAG_BITS.iter().filter(|(flag, ..)| flags.contains(*flag));
    let shown = shown.filter_map(|(_, small, large)| of(family, *small, *large));
    let shown = shown.fold(0_u32, |all, number| all | 1 << number);
    let any = if family == Family::Large && wrong != 0 { ANY_ERROR } else { 0 };
    (wrong | shown | any).cast_signed()
}

fn bit(status: i32, number: u8) -> bool {
    status >> number & 1 == 1
}

fn of<T>(family: Family, small: T, large: T) -> T {
    match family {
        Family::Small => small,
        Family::Large => large,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_example_is_in_position_without_an_error() {
        let flags = Flags::IN_POSITION | Flags::BUS_READY;
        assert_eq!(status(Errors::empty(), flags, Family::Large), 524_304);
        assert_eq!(Flags::from_status(524_304, Family::Large), flags);
        assert_eq!(Errors::from_status(524_304, Family::Large), Errors::empty());
    }

    #[test]
    fn every_error_has_a_bit_in_both_families_and_comes_back_from_it() {
        for error in Errors::all().iter() {
            for family in [Family::Small, Family::Large] {
                let shown = status(error, Flags::empty(), family);
                assert_ne!(shown, 0, "{error:?}");
                assert!(Errors::from_status(shown, family).contains(error), "{error:?}");
            }
            let large = status(error, Flags::empty(), Family::Large);
            assert_eq!(Errors::from_status(large, Family::Large), error);
        }
    }

    #[test]
    fn the_small_motors_have_the_printed_bits() {
        let printed = [
            (Errors::I2T, 0),
            (Errors::FOLLOW, 1),
            (Errors::FUNCTION, 2),
            (Errors::UIT, 3),
            (Errors::POSITION_LIMIT, 7),
            (Errors::CURRENT, 11),
            (Errors::UNDER_VOLTAGE, 12),
        ];
        for (error, number) in printed {
            assert_eq!(status(error, Flags::empty(), Family::Small), 1 << number);
        }
        let relative = Flags::RELATIVE_P_SOLL | Flags::LOW_SUPPLY | Flags::LIMITS_OFF;
        assert_eq!(status(Errors::empty(), relative, Family::Small), 1 << 9 | 1 << 13 | 1 << 14);
    }
}
