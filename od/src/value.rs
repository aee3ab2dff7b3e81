//! What an entry holds.

use std::sync::Arc;

use crate::DataType;

/// The value of an entry, without its type: the entry knows that.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Value {
    /// A value of fixed length up to 64 bits, as its little-endian bit pattern; unused high bits are zero.
    Fixed(u64),
    /// A string or domain. Devices of a kind share what none of them has written.
    Bytes(Arc<Vec<u8>>),
}

impl Value {
    /// The integer `number` as a value of `data_type`; `None` if it does not fit or the type holds no integers.
    #[must_use]
    pub fn integer(data_type: DataType, number: i128) -> Option<Self> {
        let (min, max) = data_type.integer_limits()?;
        (min..=max).contains(&number).then(|| Self::Fixed(truncate(number.cast_unsigned() as u64, data_type)))
    }

    /// The real `number` as a value of `data_type`; `None` if the type holds no reals.
    #[must_use]
    pub fn real(data_type: DataType, number: f64) -> Option<Self> {
        match data_type {
            #[expect(
                clippy::cast_possible_truncation,
                reason = "REAL32 is the nearest single to what was given"
            )]
            DataType::Real32 => Some(Self::Fixed(u64::from((number as f32).to_bits()))),
            DataType::Real64 => Some(Self::Fixed(number.to_bits())),
            _ => None,
        }
    }

    /// A string or domain that holds `bytes`.
    #[must_use]
    pub fn bytes(bytes: impl Into<Vec<u8>>) -> Self {
        Self::Bytes(Arc::new(bytes.into()))
    }

    /// The zero or empty value of `data_type`.
    #[must_use]
    pub fn zero(data_type: DataType) -> Self {
        match data_type.bits() {
            Some(_) => Self::Fixed(0),
            None => Self::bytes(Vec::new()),
        }
    }

    /// The real that the bit pattern `raw` of `data_type` stands for.
    #[must_use]
    pub fn as_real(data_type: DataType, raw: u64) -> Option<f64> {
        match data_type {
            #[expect(clippy::cast_possible_truncation, reason = "a REAL32 occupies the low 32 bits")]
            DataType::Real32 => Some(f64::from(f32::from_bits(raw as u32))),
            DataType::Real64 => Some(f64::from_bits(raw)),
            _ => None,
        }
    }

    /// The bit pattern of a fixed value, zero for a string or domain.
    #[must_use]
    pub const fn raw(&self) -> u64 {
        match self {
            Self::Fixed(raw) => *raw,
            Self::Bytes(_) => 0,
        }
    }
}

/// `raw` without the bits that `data_type` does not have.
pub(crate) fn truncate(raw: u64, data_type: DataType) -> u64 {
    let unused = 64 - u32::from(data_type.bits().unwrap_or(64));
    (raw << unused) >> unused
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_keep_their_sign_in_every_width() {
        for data_type in DataType::ALL.iter().copied().filter(|t| t.integer_limits().is_some()) {
            let (min, max) = data_type.integer_limits().unwrap();
            for number in [min, max, 0, 1, if min < 0 { -1 } else { 2.min(max) }] {
                let raw = Value::integer(data_type, number).unwrap().raw();
                assert_eq!(data_type.integer(raw), number, "{data_type}");
            }
            assert_eq!(Value::integer(data_type, max + 1), None, "{data_type}");
            assert_eq!(Value::integer(data_type, min - 1), None, "{data_type}");
        }
    }

    #[test]
    fn reals_travel_as_ieee_754() {
        assert_eq!(Value::real(DataType::Real32, 1.5), Some(Value::Fixed(0x3FC0_0000)));
        assert_eq!(Value::as_real(DataType::Real64, 1.5_f64.to_bits()), Some(1.5));
        assert_eq!(Value::real(DataType::Unsigned8, 1.5), None);
    }
}
