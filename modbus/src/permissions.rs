//! What the client of a connection may do.

use core::ops::RangeInclusive;

/// Restrictions of one client. The default has none.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Permissions {
    /// Nothing may be written.
    pub read_only: bool,
    /// Registers that may be written, all if there is no range. Entries that have registers among them may also be
    /// written otherwise, such as coils and SDOs.
    pub write: Vec<RangeInclusive<u16>>,
}

impl Permissions {
    /// Whether everything may be written.
    pub(crate) fn is_unrestricted(&self) -> bool {
        !self.read_only && self.write.is_empty()
    }

    /// Whether all of `quantity` registers from `start` on may be written.
    pub(crate) fn may_write(&self, start: u16, quantity: usize) -> bool {
        if self.read_only || self.write.is_empty() {
            return !self.read_only;
        }
        let last = usize::from(start) + quantity.max(1) - 1;
        self.write.iter().any(|range| range.contains(&start) && last <= usize::from(*range.end()))
    }
}
