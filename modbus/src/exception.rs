//! Exception codes (Modbus Application Protocol V1.1b3, section 7).

use core::fmt;

use od::AbortCode;

/// Why a request was refused. The discriminant is the exception code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Exception {
    /// The function code, or a sub-function of it, is not supported.
    IllegalFunction = 0x01,
    /// There is no such register, or it cannot be accessed this way.
    IllegalDataAddress = 0x02,
    /// A length, quantity or value is wrong.
    IllegalDataValue = 0x03,
    /// The state of the device or the owner of the axis does not let it.
    ServerDeviceFailure = 0x04,
    /// Nobody has this unit identifier.
    GatewayTargetFailedToRespond = 0x0B,
}

impl Exception {
    /// The code as it stands on the wire.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }
}

impl From<AbortCode> for Exception {
    /// What an SDO would be told, in the words of Modbus: read-only or missing is 2, length or value is 3, refused by
    /// state or owner is 4.
    fn from(code: AbortCode) -> Self {
        match code {
            AbortCode::UnsupportedAccess
            | AbortCode::WriteOnly
            | AbortCode::ReadOnly
            | AbortCode::NoObject
            | AbortCode::NoSubIndex
            | AbortCode::NoDictionary => Self::IllegalDataAddress,
            AbortCode::NotMappable
            | AbortCode::PdoLength
            | AbortCode::ParameterIncompatible
            | AbortCode::InternalIncompatible
            | AbortCode::LengthMismatch
            | AbortCode::TooLong
            | AbortCode::TooShort
            | AbortCode::InvalidValue
            | AbortCode::ValueTooHigh
            | AbortCode::ValueTooLow
            | AbortCode::MaxBelowMin => Self::IllegalDataValue,
            AbortCode::ToggleBit
            | AbortCode::TimedOut
            | AbortCode::UnknownCommand
            | AbortCode::BlockSize
            | AbortCode::SequenceNumber
            | AbortCode::Crc
            | AbortCode::OutOfMemory
            | AbortCode::Hardware
            | AbortCode::NoSdoConnection
            | AbortCode::General
            | AbortCode::CannotStore
            | AbortCode::LocalControl
            | AbortCode::DeviceState
            | AbortCode::NoData => Self::ServerDeviceFailure,
        }
    }
}

impl fmt::Display for Exception {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::IllegalFunction => "illegal function",
            Self::IllegalDataAddress => "illegal data address",
            Self::IllegalDataValue => "illegal data value",
            Self::ServerDeviceFailure => "server device failure",
            Self::GatewayTargetFailedToRespond => "gateway target device failed to respond",
        };
        write!(f, "{:02X} ({text})", self.code())
    }
}
