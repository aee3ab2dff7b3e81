//! TIME: the time of day of the network (CiA 301 v4.2, sections 7.1.6.5, 7.2.6 and 7.5.2.15).

use core::time::Duration;

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

/// Days from 1 January 1970 to 1 January 1984.
const DAYS_TO_1984: u64 = 5113;
const SECONDS_PER_DAY: u64 = 24 * 60 * 60;

impl TimeOfDay {
    /// The moment so long after 1 January 1970, midnight, without leap seconds; `None` before 1984 and after 2163, for
    /// which TIME has no days.
    #[must_use]
    pub fn from_unix(since_1970: Duration) -> Option<Self> {
        let days = (since_1970.as_secs() / SECONDS_PER_DAY).checked_sub(DAYS_TO_1984)?;
        let seconds = (since_1970.as_secs() % SECONDS_PER_DAY) as u32;
        Some(Self { days: u16::try_from(days).ok()?, millis: 1000 * seconds + since_1970.subsec_millis() })
    }

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

    #[test]
    fn days_are_counted_from_1984_and_milliseconds_from_midnight() {
        let at =
            |seconds: u64, millis: u64| TimeOfDay::from_unix(Duration::from_millis(1000 * seconds + millis));
        assert_eq!(at(441_763_199, 999), None, "31 December 1983, the last millisecond");
        assert_eq!(at(441_763_200, 0), Some(TimeOfDay { days: 0, millis: 0 }));
        // 1 January 2024, noon.
        assert_eq!(at(1_704_110_400, 7), Some(TimeOfDay { days: 14_610, millis: 43_200_007 }));
        // 29 February 2024, the last millisecond.
        assert_eq!(at(1_709_251_199, 999), Some(TimeOfDay { days: 14_669, millis: 86_399_999 }));
        assert_eq!(at(441_763_200 + 65_535 * 86_400, 0), Some(TimeOfDay { days: u16::MAX, millis: 0 }));
        assert_eq!(at(441_763_200 + 65_536 * 86_400, 0), None);
    }

    proptest! {
        #[test]
        fn a_time_survives_the_journey(days: u16, millis in 0..=MILLIS_MASK) {
            let time = TimeOfDay { days, millis };
            prop_assert_eq!(TimeOfDay::decode(&time.encode()), Some(time));
        }
    }
}
