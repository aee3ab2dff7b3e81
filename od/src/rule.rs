//! What is asked of an entry at every write, packed apart from what is seldom asked.

use crate::{DataType, Entry};

/// What must be known of an entry to write it. There is one for each, side by side, because a request of a bus may
/// write a hundred of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rule {
    /// The bits of a value of fixed length; none for strings and domains.
    pub(crate) mask: u64,
    /// A bus may write any value of fixed length, whoever is on it: no check can fail.
    pub(crate) is_free: bool,
    /// It commands an axis.
    pub(crate) is_command: bool,
}

impl Rule {
    pub(crate) fn of(entry: &Entry) -> Self {
        let bits = entry.data_type.bits().unwrap_or(0);
        let is_command = entry.command.is_some();
        let has_limits = entry.range.is_some() || entry.data_type == DataType::Boolean;
        let is_checked = is_command || has_limits || entry.veto.is_some();
        Self {
            mask: u64::MAX.checked_shr(64 - u32::from(bits)).unwrap_or(0),
            is_free: bits > 0 && entry.access.is_writable() && !is_checked,
            is_command,
        }
    }
}
