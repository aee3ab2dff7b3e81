//! What is asked of an entry at every access, packed apart from what is seldom asked.

use crate::{DataType, Entry, value};

/// What must be known of an entry to read or write a value of fixed length. There is one for each, side by side, because
/// one request of a bus may concern a hundred of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rule {
    /// The bits of a value of fixed length; none for strings and domains.
    pub(crate) mask: u64,
    /// The bit that is the sign, if it has one.
    pub(crate) sign: u64,
    /// A bus may read it.
    pub(crate) is_readable: bool,
    /// A bus may write any value of fixed length, whoever is on it: no check can fail.
    pub(crate) is_free: bool,
    /// It commands an axis.
    pub(crate) is_command: bool,
}

impl Rule {
    pub(crate) fn of(entry: &Entry) -> Self {
        let is_command = entry.command.is_some();
        let has_limits = entry.range.is_some() || entry.data_type == DataType::Boolean;
        let is_checked = is_command || has_limits || entry.veto.is_some();
        let is_fixed = entry.data_type.bits().is_some();
        let mask = if is_fixed { value::truncate(u64::MAX, entry.data_type) } else { 0 };
        Self {
            mask,
            sign: if entry.data_type.is_signed() { mask & !(mask >> 1) } else { 0 },
            is_readable: entry.access.is_readable(),
            is_free: is_fixed && entry.access.is_writable() && !is_checked,
            is_command,
        }
    }

    /// The bit pattern `raw` with its sign in all bits above.
    #[inline]
    pub(crate) fn extended(self, raw: u64) -> u64 {
        (raw ^ self.sign).wrapping_sub(self.sign)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Access;

    #[test]
    fn numbers_are_cut_off_and_extended_as_their_types_say() {
        for data_type in DataType::ALL.iter().copied() {
            let rule = Rule::of(&Entry::new(0, "a", data_type, Access::ReadWrite));
            let Some(bits) = data_type.bits() else {
                assert_eq!((rule.mask, rule.is_free), (0, false), "{data_type}");
                continue;
            };
            assert_eq!(rule.mask.count_ones(), u32::from(bits), "{data_type}");
            assert_eq!(rule.mask.trailing_ones(), u32::from(bits), "{data_type}");
            for raw in [0, 1, rule.mask, rule.mask >> 1, rule.mask ^ rule.mask >> 1] {
                assert_eq!(rule.extended(raw), data_type.integer(raw) as u64, "{data_type} {raw:#x}");
            }
        }
    }

    #[test]
    fn an_entry_is_free_if_no_check_can_refuse_a_value() {
        let plain = Entry::new(0, "a", DataType::Unsigned16, Access::ReadWrite);
        let changes: [fn(&mut Entry); 6] = [
            |entry| entry.access = Access::ReadOnly,
            |entry| entry.access = Access::Const,
            |entry| entry.data_type = DataType::Boolean,
            |entry| entry.range = Some(crate::Range::Integer { min: 0, max: 65535 }),
            |entry| entry.command = Some(0),
            |entry| entry.veto = Some(|_, _, _| Ok(())),
        ];
        assert!(Rule::of(&plain).is_free);
        for (number, change) in changes.into_iter().enumerate() {
            let mut entry = plain.clone();
            change(&mut entry);
            assert!(!Rule::of(&entry).is_free, "change {number}");
        }
    }
}
