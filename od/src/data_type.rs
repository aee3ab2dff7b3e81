//! The basic data types of CiA 301 v4.2, table 44.

use core::fmt;

macro_rules! data_types {
    ($($name:ident = $code:literal, $text:literal, $short:literal, $bits:expr;)*) => {
        /// A basic data type. The discriminant is its index in the dictionary's type area.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u16)]
        pub enum DataType {
            $(#[doc = $text] $name = $code,)*
        }

        impl DataType {
            /// Every data type, in the order of their indices.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// The standard's name, such as `UNSIGNED16`.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => $text,)* }
            }

            /// The short name that profile files use, such as `U16`.
            #[must_use]
            pub const fn short_name(self) -> &'static str {
                match self { $(Self::$name => $short,)* }
            }

            /// Size in bits as packed in a PDO; `None` for types of variable length.
            #[must_use]
            pub const fn bits(self) -> Option<u8> {
                match self { $(Self::$name => $bits,)* }
            }
        }
    };
}

data_types! {
    Boolean = 0x0001, "BOOLEAN", "BOOL", Some(1);
    Integer8 = 0x0002, "INTEGER8", "I8", Some(8);
    Integer16 = 0x0003, "INTEGER16", "I16", Some(16);
    Integer32 = 0x0004, "INTEGER32", "I32", Some(32);
    Unsigned8 = 0x0005, "UNSIGNED8", "U8", Some(8);
    Unsigned16 = 0x0006, "UNSIGNED16", "U16", Some(16);
    Unsigned32 = 0x0007, "UNSIGNED32", "U32", Some(32);
    Real32 = 0x0008, "REAL32", "F32", Some(32);
    VisibleString = 0x0009, "VISIBLE_STRING", "STRING", None;
    OctetString = 0x000A, "OCTET_STRING", "OCTETS", None;
    UnicodeString = 0x000B, "UNICODE_STRING", "UNICODE", None;
    TimeOfDay = 0x000C, "TIME_OF_DAY", "TIME", Some(48);
    TimeDifference = 0x000D, "TIME_DIFFERENCE", "TIMEDIFF", Some(48);
    Domain = 0x000F, "DOMAIN", "DOMAIN", None;
    Integer24 = 0x0010, "INTEGER24", "I24", Some(24);
    Real64 = 0x0011, "REAL64", "F64", Some(64);
    Integer40 = 0x0012, "INTEGER40", "I40", Some(40);
    Integer48 = 0x0013, "INTEGER48", "I48", Some(48);
    Integer56 = 0x0014, "INTEGER56", "I56", Some(56);
    Integer64 = 0x0015, "INTEGER64", "I64", Some(64);
    Unsigned24 = 0x0016, "UNSIGNED24", "U24", Some(24);
    Unsigned40 = 0x0018, "UNSIGNED40", "U40", Some(40);
    Unsigned48 = 0x0019, "UNSIGNED48", "U48", Some(48);
    Unsigned56 = 0x001A, "UNSIGNED56", "U56", Some(56);
    Unsigned64 = 0x001B, "UNSIGNED64", "U64", Some(64);
}

impl DataType {
    /// The type with index `code` in the type area.
    #[must_use]
    pub fn from_code(code: u16) -> Option<Self> {
        Self::ALL.iter().copied().find(|t| *t as u16 == code)
    }

    /// The type with the given short (`U16`) or standard (`UNSIGNED16`) name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|t| t.short_name() == name || t.name() == name)
    }

    /// Size in bytes as transferred by SDO; `None` for types of variable length.
    #[must_use]
    pub const fn bytes(self) -> Option<usize> {
        match self.bits() {
            Some(bits) => Some(bits.div_ceil(8) as usize),
            None => None,
        }
    }

    /// Whether values are two's complement integers.
    #[must_use]
    pub const fn is_signed(self) -> bool {
        matches!(
            self,
            Self::Integer8
                | Self::Integer16
                | Self::Integer24
                | Self::Integer32
                | Self::Integer40
                | Self::Integer48
                | Self::Integer56
                | Self::Integer64
        )
    }

    /// Whether values are IEEE 754 numbers.
    #[must_use]
    pub const fn is_real(self) -> bool {
        matches!(self, Self::Real32 | Self::Real64)
    }

    /// Smallest and largest integer of this type; `None` where values are no integers.
    #[must_use]
    pub fn integer_limits(self) -> Option<(i128, i128)> {
        let bits = self.bits().filter(|_| !self.is_real())?;
        Some(if self.is_signed() {
            (-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1)
        } else {
            (0, (1_i128 << bits) - 1)
        })
    }

    /// The integer that the low bits of `raw` stand for, sign-extended where the type is signed.
    #[must_use]
    pub const fn integer(self, raw: u64) -> i128 {
        let unused = match self.bits() {
            Some(bits) => 64 - bits as u32,
            None => 0,
        };
        if self.is_signed() {
            ((raw << unused).cast_signed() >> unused) as i128
        } else {
            ((raw << unused) >> unused) as i128
        }
    }
}

impl fmt::Display for DataType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
