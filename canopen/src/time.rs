//! TIME: the time of day of the network (CiA 301 v4.2, sections 7.1.6.5, 7.2.6 and 7.5.2.15).

use od::{AbortCode, Dictionary};

use crate::CobId;
use crate::communication::{COB_ID_TIME, cob_id};

/// Bit 31 of the COB-ID: this device consumes TIME.
const CONSUMES: u32 = 1 << 31;
/// Bit 30 of the COB-ID: this device produces TIME.
const PRODUCES: u32 = 1 << 30;
/// The milliseconds have 28 bits.
const MILLIS_MASK: u32 = 0x0FFF_FFFF;

/// A moment of the calendar, as TIME carries it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TimeOfDay {
    /// Days since 1 January 1984.
    pub days: u16,
    /// Milliseconds after midnight, 28 bits.
    pub millis: u32,
}

impl TimeOfDay {
    /// From the six bytes of a TIME message; the four reserved bits do not count.
    pub(crate) fn decode(payload: &[u8]) -> Option<Self> {
        let [a, b, c, d, low, high] = *payload else { return None };
        let millis = u32::from_le_bytes([a, b, c, d]) & MILLIS_MASK;
        Some(Self { days: u16::from_le_bytes([low, high]), millis })
    }

    /// The six bytes of a TIME message.
    pub(crate) fn encode(self) -> [u8; 6] {
        let [a, b, c, d] = (self.millis & MILLIS_MASK).to_le_bytes();
        let [low, high] = self.days.to_le_bytes();
        [a, b, c, d, low, high]
    }
}

/// The COB-ID of the TIME that this device consumes.
pub(crate) fn consumed(communication: &Dictionary) -> Option<CobId> {
    cob_id(communication, COB_ID_TIME).filter(|cob_id| cob_id.0 & CONSUMES != 0)
}

/// The COB-ID of the TIME that this device produces.
pub(crate) fn produced(communication: &Dictionary) -> Option<CobId> {
    cob_id(communication, COB_ID_TIME).filter(|cob_id| cob_id.0 & PRODUCES != 0)
}

/// Whether the COB-ID may become `new`: while TIME is consumed or produced the identifier stays.
pub(crate) fn check_cob_id(communication: &Dictionary, new: CobId) -> Result<(), AbortCode> {
    let old = cob_id(communication, COB_ID_TIME).unwrap_or(CobId(0));
    let is_used = |cob_id: CobId| cob_id.0 & (CONSUMES | PRODUCES) != 0;
    if !new.is_configurable() {
        return Err(AbortCode::InvalidValue);
    }
    let keeps = !is_used(old) || !is_used(new) || old.has_identifier_of(new);
    if keeps { Ok(()) } else { Err(AbortCode::DeviceState) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn only_six_bytes_are_a_time() {
        assert_eq!(TimeOfDay::decode(&[1, 2, 3, 4, 5]), None);
        assert_eq!(TimeOfDay::decode(&[1, 2, 3, 4, 5, 6, 7]), None);
        let time = TimeOfDay { days: 0x0605, millis: 0x0403_0201 };
        assert_eq!(TimeOfDay::decode(&[1, 2, 3, 0xF4, 5, 6]), Some(time));
    }

    proptest! {
        #[test]
        fn a_time_survives_the_journey(days: u16, millis in 0..=MILLIS_MASK) {
            let time = TimeOfDay { days, millis };
            prop_assert_eq!(TimeOfDay::decode(&time.encode()), Some(time));
        }
    }
}
