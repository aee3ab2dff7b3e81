//! Who a unit says it is (Modbus Application Protocol V1.1b3, sections 6.13 and 6.21).

use crate::IdentificationCode;

/// Longest object that fits into an answer with nothing else.
const LONGEST: usize = 240;
/// The last objects of the basic and of the regular part.
const LAST_BASIC: u8 = 0x02;
const LAST_REGULAR: u8 = 0x06;
/// First private object, of the extended part.
const FIRST_PRIVATE: u8 = 0x80;

/// The identification objects of a unit. A text of more than 240 bytes is cut off.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Identification {
    /// Object 0.
    pub vendor_name: String,
    /// Object 1.
    pub product_code: String,
    /// Object 2: major and minor revision.
    pub revision: String,
    /// Object 3.
    pub vendor_url: String,
    /// Object 4.
    pub product_name: String,
    /// Object 5.
    pub model_name: String,
    /// Object 6: what the user calls it.
    pub application_name: String,
    /// Objects 0x80 and on, 128 at most.
    pub private: Vec<String>,
}

impl Identification {
    /// The text of object `id`.
    pub(crate) fn object(&self, id: u8) -> Option<&[u8]> {
        let text = match id {
            0 => &self.vendor_name,
            1 => &self.product_code,
            2 => &self.revision,
            3 => &self.vendor_url,
            4 => &self.product_name,
            5 => &self.model_name,
            6 => &self.application_name,
            _ => self.private.get(usize::from(id.checked_sub(FIRST_PRIVATE)?))?,
        };
        Some(text.as_bytes().get(..LONGEST).unwrap_or(text.as_bytes()))
    }

    /// The objects from `first` on that `code` asks for.
    pub(crate) fn objects(&self, code: IdentificationCode, first: u8) -> impl Iterator<Item = (u8, &[u8])> {
        let last = match code {
            IdentificationCode::Basic => LAST_BASIC,
            IdentificationCode::Regular => LAST_REGULAR,
            IdentificationCode::Extended => u8::MAX,
            IdentificationCode::Individual => first,
        };
        (first..=last).filter_map(|id| Some((id, self.object(id)?)))
    }
}
