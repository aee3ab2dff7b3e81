//! SDO abort codes (CiA 301 v4.2, table 22): the refusals every bus translates from.

use core::fmt;

macro_rules! abort_codes {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $text:literal;)*) => {
        /// Why an access was refused. The discriminant is the SDO abort code.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u32)]
        pub enum AbortCode {
            $(#[doc = $text] $name = $code,)*
        }

        impl AbortCode {
            /// Every abort code of the standard.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// The standard's explanation.
            #[must_use]
            pub const fn text(self) -> &'static str {
                match self { $(Self::$name => $text,)* }
            }
        }
    };
}

abort_codes! {
    ToggleBit = 0x0503_0000, "toggle bit not alternated";
    TimedOut = 0x0504_0000, "SDO protocol timed out";
    UnknownCommand = 0x0504_0001, "client/server command specifier not valid or unknown";
    BlockSize = 0x0504_0002, "invalid block size";
    SequenceNumber = 0x0504_0003, "invalid sequence number";
    Crc = 0x0504_0004, "CRC error";
    OutOfMemory = 0x0504_0005, "out of memory";
    UnsupportedAccess = 0x0601_0000, "unsupported access to an object";
    WriteOnly = 0x0601_0001, "attempt to read a write only object";
    ReadOnly = 0x0601_0002, "attempt to write a read only object";
    NoObject = 0x0602_0000, "object does not exist in the object dictionary";
    NotMappable = 0x0604_0041, "object cannot be mapped to the PDO";
    PdoLength = 0x0604_0042, "number and length of the objects to be mapped would exceed PDO length";
    ParameterIncompatible = 0x0604_0043, "general parameter incompatibility";
    InternalIncompatible = 0x0604_0047, "general internal incompatibility in the device";
    Hardware = 0x0606_0000, "access failed due to a hardware error";
    LengthMismatch = 0x0607_0010, "data type does not match, length of service parameter does not match";
    TooLong = 0x0607_0012, "data type does not match, length of service parameter too high";
    TooShort = 0x0607_0013, "data type does not match, length of service parameter too low";
    NoSubIndex = 0x0609_0011, "sub-index does not exist";
    InvalidValue = 0x0609_0030, "invalid value for parameter";
    ValueTooHigh = 0x0609_0031, "value of parameter written too high";
    ValueTooLow = 0x0609_0032, "value of parameter written too low";
    MaxBelowMin = 0x0609_0036, "maximum value is less than minimum value";
    NoSdoConnection = 0x060A_0023, "resource not available: SDO connection";
    General = 0x0800_0000, "general error";
    CannotStore = 0x0800_0020, "data cannot be transferred or stored to the application";
    LocalControl = 0x0800_0021, "data cannot be transferred or stored because of local control";
    DeviceState = 0x0800_0022, "data cannot be transferred or stored because of the present device state";
    NoDictionary = 0x0800_0023, "object dictionary dynamic generation fails or no object dictionary is present";
    NoData = 0x0800_0024, "no data available";
}

impl AbortCode {
    /// The abort code that `code` is on the wire, if it is one of the standard.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.iter().copied().find(|known| known.code() == code)
    }

    /// The code as it stands on the wire.
    #[must_use]
    pub const fn code(self) -> u32 {
        self as u32
    }
}

impl fmt::Display for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:08X} ({})", self.code(), self.text())
    }
}
