//! Which entries a PDO carries, and how they are packed.

use crate::{AbortCode, Address, DataType, Dictionary, Entry, Schema, Slot, bits};

/// The way process data flow, seen from the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Into the device: RPDO.
    Receive,
    /// Out of the device: TPDO.
    Transmit,
}

/// One mapped entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The entry; `None` for a dummy that only takes room (CiA 301 v4.2, section 7.4.7).
    pub slot: Option<Slot>,
    /// Its width in bits.
    pub width: u8,
    /// Where the PDO carries the low bits of a wider entry as a signed number: the bits above them, which a negative
    /// one sets.
    pub sign: u64,
}

impl Field {
    /// The value of the entry when the PDO carries `raw`.
    fn extend(&self, raw: u64) -> u64 {
        let is_negative = raw >> (self.width.saturating_sub(1) % 64) & 1 == 1;
        if is_negative { raw | self.sign } else { raw }
    }
}

/// The entries of one PDO in the order of their bits.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Mapping {
    fields: Vec<Field>,
    bits: usize,
}

impl Mapping {
    /// Most entries one PDO may carry (CiA 301 v4.2, section 7.5.2.36).
    pub const MAX_FIELDS: usize = 64;

    /// The mapping of the given parameters (0xIIIISSBB: index, sub-index, bits) into `room` bits.
    ///
    /// # Errors
    /// [`AbortCode::NoObject`] or [`AbortCode::NotMappable`] as [`Mapping::field`] says,
    /// [`AbortCode::PdoLength`] when they do not fit.
    pub fn new(
        schema: &Schema,
        direction: Direction,
        room: usize,
        parameters: impl IntoIterator<Item = u32>,
    ) -> Result<Self, AbortCode> {
        let mut mapping = Self::default();
        for parameter in parameters {
            let field = Self::field(schema, direction, parameter)?;
            mapping.bits += usize::from(field.width);
            mapping.fields.push(field);
        }
        let fits = mapping.bits <= room && mapping.fields.len() <= Self::MAX_FIELDS;
        if fits { Ok(mapping) } else { Err(AbortCode::PdoLength) }
    }

    /// What one mapping parameter (0xIIIISSBB) stands for.
    ///
    /// # Errors
    /// [`AbortCode::NoObject`] for what does not exist, sub-index included (CiA 301 v4.2, section 7.5.2.36 names no
    /// other), [`AbortCode::NotMappable`] for what may not be mapped this way or has another width; that of
    /// [`Entry::part`] will do as well.
    pub fn field(schema: &Schema, direction: Direction, parameter: u32) -> Result<Field, AbortCode> {
        let [width, sub, low, high] = parameter.to_le_bytes();
        let address = Address::new(u16::from_le_bytes([low, high]), sub);
        if address.index < 0x1000 {
            return dummy(direction, address, width);
        }
        let slot = schema.find(address).map_err(|_| AbortCode::NoObject)?;
        let entry = schema.entry(slot).ok_or(AbortCode::NoObject)?;
        let allowed = match direction {
            Direction::Receive => entry.mappable.receive(),
            Direction::Transmit => entry.mappable.transmit(),
        };
        let sign = sign_bits(entry, width).filter(|_| allowed).ok_or(AbortCode::NotMappable)?;
        Ok(Field { slot: Some(slot), width, sign })
    }

    /// The mapped entries.
    #[must_use]
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// Length of the PDO in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bits.div_ceil(8)
    }

    /// Packs the mapped values into `payload`, which keeps its bytes beyond the mapping.
    pub fn pack(&self, dictionary: &Dictionary, payload: &mut [u8]) {
        let mut offset = 0;
        for field in &self.fields {
            bits::put(payload, offset, field.width, field.slot.map_or(0, |slot| dictionary.raw(slot)));
            offset += usize::from(field.width);
        }
    }

    /// Puts `raw` where `payload` carries the entry at `slot`.
    pub fn put(&self, slot: Slot, raw: u64, payload: &mut [u8]) {
        let mut offset = 0;
        for field in &self.fields {
            if field.slot == Some(slot) {
                bits::put(payload, offset, field.width, raw);
            }
            offset += usize::from(field.width);
        }
    }

    /// The slots and bit patterns in `payload`, dummies left out.
    pub fn unpack(&self, payload: &[u8]) -> impl Iterator<Item = (Slot, u64)> {
        let mut offset = 0;
        self.fields.iter().filter_map(move |field| {
            let raw = bits::get(payload, offset, field.width);
            offset += usize::from(field.width);
            field.slot.map(|slot| (slot, field.extend(raw)))
        })
    }
}

/// The bits above `width` that a negative number in a PDO sets; `None` where a PDO does not carry `entry` by so many bits.
fn sign_bits(entry: &Entry, width: u8) -> Option<u64> {
    if entry.data_type.bits() == Some(width) {
        return Some(0);
    }
    let part = entry.part.filter(|part| part.bits() == Some(width))?;
    let whole = u64::MAX >> (64 - u32::from(entry.data_type.bits()?));
    Some(if part.is_signed() { whole & u64::MAX << width } else { 0 })
}

/// Types 0x0001-0x0007 and the like take room in an RPDO without being written.
fn dummy(direction: Direction, address: Address, width: u8) -> Result<Field, AbortCode> {
    let data_type = DataType::from_code(address.index).ok_or(AbortCode::NoObject)?;
    let suits = direction == Direction::Receive && address.sub == 0 && data_type.bits() == Some(width);
    if suits { Ok(Field { slot: None, width, sign: 0 }) } else { Err(AbortCode::NotMappable) }
}
