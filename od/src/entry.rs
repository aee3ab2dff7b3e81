//! What is known of an object and its entries before any device exists.

use crate::{AbortCode, DataType, Dictionary, Slot, Value, value};

/// Access from a bus (CiA 306 terms in brackets).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Never changes (`const`).
    Const,
    /// Changed by the device only (`ro`).
    ReadOnly,
    /// Changed by the device and the bus (`rw`).
    ReadWrite,
    /// Written by the bus, not readable (`wo`).
    WriteOnly,
}

impl Access {
    /// Whether a bus may read.
    #[must_use]
    pub const fn is_readable(self) -> bool {
        !matches!(self, Self::WriteOnly)
    }

    /// Whether a bus may write.
    #[must_use]
    pub const fn is_writable(self) -> bool {
        matches!(self, Self::ReadWrite | Self::WriteOnly)
    }

    /// The term used in EDS files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Const => "const",
            Self::ReadOnly => "ro",
            Self::ReadWrite => "rw",
            Self::WriteOnly => "wo",
        }
    }
}

/// Into which PDOs an entry may be mapped, seen from the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mappable {
    /// Into none.
    #[default]
    No,
    /// Into RPDOs only.
    Receive,
    /// Into TPDOs only.
    Transmit,
    /// Into both.
    Both,
}

impl Mappable {
    /// Whether an RPDO may carry the entry.
    #[must_use]
    pub const fn receive(self) -> bool {
        matches!(self, Self::Receive | Self::Both)
    }

    /// Whether a TPDO may carry the entry.
    #[must_use]
    pub const fn transmit(self) -> bool {
        matches!(self, Self::Transmit | Self::Both)
    }
}

/// Bounds of the values that may be written, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// For integer types.
    Integer {
        /// Smallest value; lower ones are refused with [`AbortCode::ValueTooLow`].
        min: i128,
        /// Largest value; higher ones are refused with [`AbortCode::ValueTooHigh`].
        max: i128,
    },
    /// For REAL32 and REAL64; a NaN is refused with [`AbortCode::InvalidValue`].
    Real {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
}

impl Range {
    /// Whether the bit pattern `raw` of `data_type` lies inside.
    pub(crate) fn check(self, data_type: DataType, raw: u64) -> Result<(), AbortCode> {
        let order = match self {
            Self::Integer { min, max } => {
                let value = data_type.integer(raw);
                (value < min, value > max)
            }
            Self::Real { min, max } => {
                let value = Value::as_real(data_type, raw).unwrap_or(f64::NAN);
                if value.is_nan() {
                    return Err(AbortCode::InvalidValue);
                }
                (value < min, value > max)
            }
        };
        match order {
            (true, _) => Err(AbortCode::ValueTooLow),
            (_, true) => Err(AbortCode::ValueTooHigh),
            (false, false) => Ok(()),
        }
    }
}

/// The value an entry starts with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Initial {
    /// The same on every node.
    Value(Value),
    /// This number plus the Node-ID (`$NODEID+n` in an EDS).
    PlusNodeId(u32),
}

/// An owner's objection to a value, asked after all other checks: a pure function of the dictionary.
pub type Veto = fn(&Dictionary, Slot, u64) -> Result<(), AbortCode>;

/// One entry (sub-index) of an object.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Sub-index, 0-254.
    pub sub: u8,
    /// Name as shown in EDS files and tables.
    pub name: String,
    /// Type of the value.
    pub data_type: DataType,
    /// Access from a bus.
    pub access: Access,
    /// Into which PDOs it may be mapped.
    pub mappable: Mappable,
    /// The narrower integer that a PDO may carry in its place, if any: its low bits. What an RPDO brings becomes the
    /// number that this type says.
    pub part: Option<DataType>,
    /// Bounds of what may be written, if narrower than the type.
    pub range: Option<Range>,
    /// Value after power-on without stored parameters.
    pub initial: Initial,
    /// Longest string or domain in bytes that may be written.
    pub max_length: usize,
    /// The axis that this entry commands: only that axis's owner may write it.
    pub command: Option<u8>,
    /// Whether it is stored like a parameter although it is a command.
    pub is_kept: bool,
    /// Whether its value belongs to the moment and is never stored, although it can be read and written.
    pub is_volatile: bool,
    /// Whether the device gives it values, those of the moment: it has no default to be told.
    pub is_live: bool,
    /// The owner's objection, if any.
    pub veto: Option<Veto>,
    /// Whether it is not on CANopen: other views of the device reach it by its slot, [`Dictionary::find`] does not.
    pub is_local: bool,
}

impl Entry {
    /// Longest string or domain an entry takes unless it says otherwise, in bytes.
    pub const DEFAULT_MAX_LENGTH: usize = 256;

    /// An entry that holds zero and is neither mappable nor bounded.
    #[must_use]
    pub fn new(sub: u8, name: impl Into<String>, data_type: DataType, access: Access) -> Self {
        Self {
            sub,
            name: name.into(),
            data_type,
            access,
            mappable: Mappable::No,
            part: None,
            range: None,
            initial: Initial::Value(Value::zero(data_type)),
            max_length: Self::DEFAULT_MAX_LENGTH,
            command: None,
            is_kept: false,
            is_volatile: false,
            is_live: false,
            veto: None,
            is_local: false,
        }
    }

    /// The same entry starting with `value`.
    #[must_use]
    pub fn with_value(mut self, value: Value) -> Self {
        self.initial = Initial::Value(value);
        self
    }

    /// The value at power-on of node `node_id`.
    pub(crate) fn power_on(&self, node_id: u8) -> Value {
        match &self.initial {
            Initial::Value(value) => value.clone(),
            Initial::PlusNodeId(base) => {
                let number = u64::from(base.wrapping_add(u32::from(node_id)));
                Value::Fixed(value::truncate(number, self.data_type))
            }
        }
    }
}

/// The shape of an object (CiA 301 v4.2, table 42).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ObjectKind {
    /// A single entry at sub-index 0.
    Var,
    /// Entries of one type; sub-index 0 holds the highest sub-index.
    Array,
    /// Entries of any type; sub-index 0 holds the highest sub-index.
    Record,
}

/// An object with all its entries.
#[derive(Clone, Debug)]
pub struct Object {
    /// Index, 0x1000-0xFFFF.
    pub index: u16,
    /// Name as shown in EDS files and tables.
    pub name: String,
    /// Shape.
    pub kind: ObjectKind,
    /// Entries in the order of their sub-indices.
    pub entries: Vec<Entry>,
}

impl Object {
    /// An object of one entry, which takes the object's name.
    #[must_use]
    pub fn var(index: u16, mut entry: Entry) -> Self {
        entry.sub = 0;
        Self { index, name: entry.name.clone(), kind: ObjectKind::Var, entries: vec![entry] }
    }

    /// A record of `members`; the constant sub-index 0 is added.
    #[must_use]
    pub fn record(index: u16, name: impl Into<String>, members: Vec<Entry>) -> Self {
        Self::compound(index, name.into(), ObjectKind::Record, members)
    }

    /// An array of `members`; the constant sub-index 0 is added.
    #[must_use]
    pub fn array(index: u16, name: impl Into<String>, members: Vec<Entry>) -> Self {
        Self::compound(index, name.into(), ObjectKind::Array, members)
    }

    /// The same object as one that is not on CANopen, see [`Entry::is_local`].
    #[must_use]
    pub fn local(mut self) -> Self {
        self.entries.iter_mut().for_each(|entry| entry.is_local = true);
        self
    }

    fn compound(index: u16, name: String, kind: ObjectKind, members: Vec<Entry>) -> Self {
        let highest = members.iter().map(|m| m.sub).max().unwrap_or(0);
        let mut entries = vec![
            Entry::new(0, "Highest sub-index supported", DataType::Unsigned8, Access::Const)
                .with_value(Value::Fixed(u64::from(highest))),
        ];
        entries.extend(members);
        Self { index, name, kind, entries }
    }
}
