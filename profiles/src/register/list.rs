//! The registers of a family, by number.

use od::{Access, Address, DataType, Initial};

use super::Role;
use crate::{Diagnostics, Motor, file};

/// Which numbers are meant: those of the motor or those of its module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Space {
    /// Motor registers: 0x2012 and, above 255, the extended ones.
    Motor,
    /// Module registers, 0-63.
    Module,
}

/// The registers of a family of motors or of a module.
#[derive(Clone, Debug, PartialEq)]
pub struct RegisterList {
    /// Name by which a profile chooses it, such as `mac050-141`.
    pub name: String,
    /// Whose registers they are, in one sentence.
    pub description: String,
    /// Every register from number zero on; numbers that are not listed are reserved.
    pub registers: Vec<Register>,
}

/// The motor that a list is read for. Where nothing is known of it, defaults that depend on it are zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct Behind<'b> {
    /// The motor.
    pub motor: Option<&'b Motor>,
    /// Its registers, for the list of its module.
    pub registers: Option<&'b RegisterList>,
}

/// One register.
#[derive(Clone, Debug, PartialEq)]
pub struct Register {
    /// Its number.
    pub number: u16,
    /// Name in the manual.
    pub name: String,
    /// How the value is held.
    pub format: Format,
    /// Access from a bus.
    pub access: Access,
    /// Value after power-on without stored parameters.
    pub initial: Initial,
    /// Range that the manual prints. It is not enforced.
    pub range: Option<(i64, i64)>,
    /// Unit of the value, empty if it has none.
    pub unit: String,
    /// What it is, in one line.
    pub meaning: String,
    /// Its meaning to behaviours, if any of them may ask for it.
    pub role: Option<Role>,
    /// Whether its value belongs to the moment and is never stored.
    pub is_volatile: bool,
    /// The entry of the dictionary that shows it; none if it reads zero and ignores what is written.
    pub place: Option<Address>,
}

/// How a register holds its value. A bus carries every register as 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// 16 bits, sign-extended to 32.
    I16,
    /// 16 bits; the others read zero.
    U16,
    /// 32 bits, signed.
    I32,
    /// 32 bits.
    U32,
    /// The upper 16 bits of the register before, sign-extended to 32.
    HighWord,
    /// Nothing: reads zero, ignores what is written.
    Reserved,
}

impl RegisterList {
    /// Reads the list `text`, which diagnostics call `file`. Defaults may be data or register numbers of `behind`.
    ///
    /// # Errors
    /// Everything that is wrong with the list.
    pub fn parse(file: &str, text: &str, behind: Behind<'_>) -> Result<Self, Diagnostics> {
        file::registers::parse(file, text, behind)
    }

    /// The list `name` that comes with the program; `None` if there is no such list.
    #[must_use]
    pub fn embedded(name: &str, behind: Behind<'_>) -> Option<Result<Self, Diagnostics>> {
        Some(Self::parse(&format!("registers/{name}.toml"), Self::text(name)?, behind))
    }

    /// The text of the list `name` that comes with the program; `None` if there is no such list.
    #[must_use]
    pub fn text(name: &str) -> Option<&'static str> {
        SHIPPED.iter().find(|(shipped, _)| *shipped == name).map(|(_, text)| *text)
    }

    /// Names of the lists that come with the program, sorted.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SHIPPED.iter().map(|(name, _)| *name)
    }

    /// The register `number`; `None` above the last one.
    #[must_use]
    pub fn get(&self, number: u16) -> Option<&Register> {
        self.registers.get(usize::from(number))
    }

    /// The register with this role, if the family has it.
    #[must_use]
    pub fn with_role(&self, role: Role) -> Option<&Register> {
        self.registers.iter().find(|register| register.role == Some(role))
    }
}

impl Register {
    /// The register `number` of a family that does not have it.
    #[must_use]
    pub fn reserved(number: u16) -> Self {
        Self {
            number,
            name: format!("Reserved {number}"),
            format: Format::Reserved,
            access: Access::ReadWrite,
            initial: Initial::Value(od::Value::Fixed(0)),
            range: None,
            unit: String::new(),
            meaning: String::new(),
            role: None,
            is_volatile: true,
            place: None,
        }
    }

    /// The register that shows the upper 16 bits of this one, at the next number.
    pub(crate) fn high_word(&self) -> Self {
        let value = match &self.initial {
            Initial::Value(value) => value.raw() as u32,
            Initial::PlusNodeId(base) => *base,
        };
        Self {
            name: format!("{} (high word)", self.name),
            format: Format::HighWord,
            access: self.access,
            initial: Initial::Value(od::Value::Fixed(u64::from(Format::HighWord.take(value >> 16)))),
            ..Self::reserved(self.number.saturating_add(1))
        }
    }
}

impl Format {
    /// The format that a list calls `I16`, `U16`, `I32` or `U32`.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        [Self::I16, Self::U16, Self::I32, Self::U32].into_iter().find(|format| format.name() == name)
    }

    /// The name that lists and tables use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::I16 => "I16",
            Self::U16 => "U16",
            Self::I32 => "I32",
            Self::U32 => "U32",
            Self::HighWord => "high word",
            Self::Reserved => "reserved",
        }
    }

    /// An initial value of this format as an entry of 32 bits holds it.
    pub(crate) fn widened(self, initial: Initial) -> Initial {
        match initial {
            Initial::Value(value) => {
                Initial::Value(od::Value::Fixed(u64::from(self.take(value.raw() as u32))))
            }
            Initial::PlusNodeId(base) => Initial::PlusNodeId(base),
        }
    }

    /// How many bits it holds.
    #[must_use]
    pub const fn bits(self) -> u8 {
        match self {
            Self::I16 | Self::U16 | Self::HighWord => 16,
            Self::I32 | Self::U32 => 32,
            Self::Reserved => 0,
        }
    }

    pub(crate) const fn data_type(self) -> DataType {
        match self {
            Self::I16 | Self::HighWord => DataType::Integer16,
            Self::U16 => DataType::Unsigned16,
            Self::I32 => DataType::Integer32,
            Self::U32 | Self::Reserved => DataType::Unsigned32,
        }
    }

    /// The low 16 bits of it as a number.
    pub(crate) const fn half(self) -> DataType {
        if self.data_type().is_signed() { DataType::Integer16 } else { DataType::Unsigned16 }
    }

    /// What a register of this format shows after `raw` was written: the low 16 bits where it has no others.
    #[must_use]
    pub const fn take(self, raw: u32) -> u32 {
        match self {
            Self::I16 | Self::HighWord => (raw as u16).cast_signed() as i32 as u32,
            Self::U16 => raw as u16 as u32,
            Self::I32 | Self::U32 => raw,
            Self::Reserved => 0,
        }
    }

    /// What a register of this format shows for `value`: the nearest that it can hold. The 32 bits of `value` are a
    /// pattern where the format has all of them.
    #[must_use]
    pub fn nearest(self, value: i32) -> u32 {
        match self {
            Self::I16 | Self::HighWord => value.clamp(i16::MIN.into(), i16::MAX.into()).cast_unsigned(),
            Self::U16 => value.clamp(0, u16::MAX.into()).cast_unsigned(),
            Self::I32 | Self::U32 => value.cast_unsigned(),
            Self::Reserved => 0,
        }
    }
}

/// The lists that come with the program: name and text.
const SHIPPED: [(&str, &str); 4] = [
    ("mac050-141", include_str!("../../devices/registers/mac050-141.toml")),
    ("mac400-3000", include_str!("../../devices/registers/mac400-3000.toml")),
    ("mis34x", include_str!("../../devices/registers/mis34x.toml")),
    ("module", include_str!("../../devices/registers/module.toml")),
];
