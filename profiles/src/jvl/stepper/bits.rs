//! SETUP_BITS, Zero_Search_BITS, STATUSBITS, ERR_BITS and WARN_BITS (JVL Ethernet manual, section 11.4).

use axis::DriveFault;
use bitflags::bitflags;

bitflags! {
    /// Register 124. Bits that are not here are stored and do nothing: the start of programs, encoder outputs, SSI and
    /// multi-turn encoders.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct Setup: i32 {
        /// The motor turns the other way round.
        const REVERSED = 1 << 0;
        /// Encoder input: quadrature.
        const QUADRATURE = 1 << 2;
        /// Encoder input: pulse and direction.
        const PULSE_DIRECTION = 1 << 3;
        /// P_IST is that of the encoder when power comes after passive.
        const SYNC_AFTER_PASSIVE = 1 << 5;
        /// In position is in physical position.
        const PHYSICAL_POSITION = 1 << 6;
        /// P_IST follows the encoder.
        const ENCODER_TO_P_IST = 1 << 10;
        /// The external encoder counts the other way round.
        const EXTERNAL_REVERSED = 1 << 16;
        /// A travel limit stops without an error.
        const NO_LIMIT_ERROR = 1 << 17;
    }

    /// Register 122.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct ZeroSearch: i32 {
        /// The zero point is the index behind the sensor.
        const INDEX = 1 << 0;
        /// A limit switch turns the search around.
        const TURNS_ON_LIMIT = 1 << 1;
        /// The zero point is the far side of the sensor.
        const OPPOSITE_SIDE = 1 << 2;
        /// There is no sensor, the zero point is the next index.
        const INDEX_ONLY = 1 << 4;
    }

    /// Register 25.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct Flags: i32 {
        /// The motor corrects its position by the encoder.
        const AUTO_CORRECTION = 1 << 1;
        /// The encoder is within the window around P_SOLL.
        const PHYSICAL_POSITION = 1 << 2;
        /// The motor has its velocity.
        const AT_VELOCITY = 1 << 3;
        /// P_IST is P_SOLL.
        const IN_POSITION = 1 << 4;
        const ACCELERATING = 1 << 5;
        const DECELERATING = 1 << 6;
        /// A zero search has been completed.
        const ZERO_SEARCH_DONE = 1 << 7;
        /// The encoder fails.
        const ENCODER_ERROR = 1 << 9;
    }

    /// Register 35.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct Errors: i32 {
        /// Set with any other.
        const GENERAL = 1 << 0;
        /// The encoder is too far from P_IST.
        const FOLLOW = 1 << 1;
        /// The output driver.
        const DRIVER = 1 << 2;
        /// A travel limit.
        const POSITION_LIMIT = 1 << 3;
        const LOW_VOLTAGE = 1 << 4;
        const OVER_VOLTAGE = 1 << 5;
        const TEMPERATURE = 1 << 6;
        const INTERNAL = 1 << 7;
        /// No communication with the encoder.
        const ENCODER = 1 << 10;
    }

    /// Register 36.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct Warnings: i32 {
        const POSITIVE_LIMIT = 1 << 0;
        const NEGATIVE_LIMIT = 1 << 1;
        /// It has been active.
        const POSITIVE_LIMIT_SEEN = 1 << 2;
        /// It has been active.
        const NEGATIVE_LIMIT_SEEN = 1 << 3;
        const LOW_VOLTAGE = 1 << 4;
        /// The temperature has been high.
        const TEMPERATURE_SEEN = 1 << 6;
    }
}

impl Errors {
    /// The error that a fault of the axis is.
    pub(super) const fn of(fault: axis::Fault) -> Self {
        match fault {
            axis::Fault::FollowingError => Self::FOLLOW,
            axis::Fault::DriveSignal => Self::DRIVER,
            axis::Fault::Lost | axis::Fault::EmergencyStop | axis::Fault::Supervision => Self::INTERNAL,
            axis::Fault::Drive(cause) => match cause {
                DriveFault::OverCurrent | DriveFault::Overload => Self::DRIVER,
                DriveFault::OverVoltage => Self::OVER_VOLTAGE,
                DriveFault::UnderVoltage => Self::LOW_VOLTAGE,
                DriveFault::OverTemperature => Self::TEMPERATURE,
                DriveFault::Encoder => Self::ENCODER,
                DriveFault::SafeTorqueOff | DriveFault::Internal => Self::INTERNAL,
            },
        }
    }

    /// The register: the general error with any other.
    pub(super) fn shown(self) -> i32 {
        let general = if self.is_empty() { Self::empty() } else { Self::GENERAL };
        (self | general).bits()
    }
}
