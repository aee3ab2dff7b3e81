//! What the kernel is told to deliver, so that foreign traffic does not even wake the core.
//!
//! A filter lets a frame pass if its identifier agrees with that of the filter in all bits of the mask (`linux/can.h`). As long
//! as there is a filter for each identifier, the kernel finds them by a table. If they are too many for it, two filters that
//! differ in one bit become one without that bit, which still lets nothing else pass; a row of identifiers, as the same
//! service of many nodes has, comes down to a few. Only if that is not enough, filters are widened, those first that then let
//! the fewest foreign identifiers pass.

use std::collections::BTreeSet;

use canopen::Id;

use super::wire_format::{EXTENDED, EXTENDED_MASK, REMOTE, STANDARD_MASK};

/// CAN_RAW_FILTER_MAX.
const MAX_FILTERS: usize = 512;
/// Bits of a filter beside the identifier, which are in every mask.
const FLAGS: u32 = EXTENDED | REMOTE;

/// `struct can_filter`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Filter {
    /// Identifier and flags.
    pub(crate) id: u32,
    /// The bits of it that count.
    pub(crate) mask: u32,
}

/// Every remote frame. There are few, and one more bit would keep filters out of the kernel's table.
const REMOTE_FRAMES: Filter = Filter { id: REMOTE, mask: REMOTE };

/// Filters for data frames with these identifiers and for remote frames, no more than the kernel takes.
pub(crate) fn filters(ids: impl Iterator<Item = Id>) -> Vec<Filter> {
    let exact: BTreeSet<Filter> = ids.map(Filter::exactly).collect();
    let mut filters = cover(exact, MAX_FILTERS - 1);
    filters.push(REMOTE_FRAMES);
    filters
}

/// At most `room` filters, which has to be two or more, that let pass whatever these do.
fn cover(exact: BTreeSet<Filter>, room: usize) -> Vec<Filter> {
    if exact.len() <= room {
        return exact.into_iter().collect();
    }
    let bits = || (0..EXTENDED_MASK.count_ones()).map(|bit| 1 << bit);
    // Bits that none of them looks at, those of extended identifiers for the most part, join nothing.
    let used = exact.iter().fold(0, |used, filter| used | filter.mask);
    let joined = bits().filter(|bit| used & bit != 0).fold(exact, |filters, bit| join(&filters, bit));
    (1..=EXTENDED_MASK.count_ones())
        .fold(joined.into_iter().collect(), |filters, free| widen(filters, free, room))
}

/// Makes one filter of any two that differ in nothing but this bit.
fn join(filters: &BTreeSet<Filter>, bit: u32) -> BTreeSet<Filter> {
    let is_half = |filter: &Filter| {
        filter.mask & bit != 0 && filters.contains(&Filter { id: filter.id ^ bit, ..*filter })
    };
    let without_bit = |filter: Filter| Filter { id: filter.id & !bit, mask: filter.mask & !bit };
    filters.iter().map(|filter| if is_half(filter) { without_bit(*filter) } else { *filter }).collect()
}

/// Makes one filter of neighbours that then ignores at most `free` bits, until there is room.
fn widen(filters: Vec<Filter>, free: u32, room: usize) -> Vec<Filter> {
    let mut surplus = filters.len().saturating_sub(room);
    let mut wide: Vec<Filter> = Vec::with_capacity(filters.len());
    for next in filters {
        let both = wide.last().and_then(|last| last.with(next)).filter(|both| both.free() <= free);
        match (both, wide.last_mut()) {
            (Some(both), Some(last)) if surplus > 0 => {
                *last = both;
                surplus -= 1;
            }
            _ => wide.push(next),
        }
    }
    wide
}

impl Filter {
    fn exactly(id: Id) -> Self {
        match id {
            Id::Standard(id) => Self { id: u32::from(id), mask: STANDARD_MASK | FLAGS },
            Id::Extended(id) => Self { id: id | EXTENDED, mask: EXTENDED_MASK | FLAGS },
        }
    }

    /// The narrowest filter that lets pass whatever either does; `None` if their identifiers have different lengths.
    fn with(self, other: Self) -> Option<Self> {
        let mask = self.mask & other.mask & !(self.id ^ other.id);
        (mask & FLAGS == FLAGS).then_some(Self { id: self.id & mask, mask })
    }

    /// Bits of the identifier that it ignores.
    fn free(self) -> u32 {
        let all = if self.id & EXTENDED == 0 { STANDARD_MASK } else { EXTENDED_MASK };
        (all & !self.mask).count_ones()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// How the kernel decides (`can_rcv_filter` and `raw_rcv` in `net/can`).
    fn passes(filters: &[Filter], raw: u32) -> bool {
        filters.iter().any(|filter| raw & filter.mask == filter.id & filter.mask)
    }

    fn raw(id: Id) -> u32 {
        Filter::exactly(id).id
    }

    /// Standard identifiers that pass.
    fn passing(filters: &[Filter]) -> BTreeSet<u16> {
        (0..=0x7FF).filter(|id| passes(filters, raw(Id::Standard(*id)))).collect()
    }

    fn set(ids: impl IntoIterator<Item = u16>) -> BTreeSet<u16> {
        ids.into_iter().collect()
    }

    fn standard(ids: &BTreeSet<u16>) -> BTreeSet<Filter> {
        ids.iter().map(|id| Filter::exactly(Id::Standard(*id))).collect()
    }

    /// What these nodes listen to: NMT, SYNC, TIME, LSS, four RPDOs each, SDO, and heartbeats of all.
    fn network(nodes: impl Iterator<Item = u16> + Clone) -> BTreeSet<u16> {
        let bases = [0x200, 0x300, 0x400, 0x500, 0x600, 0x700].into_iter();
        let own = bases.flat_map(move |base| nodes.clone().map(move |node| base + node));
        own.chain([0x000, 0x080, 0x100, 0x7E5]).collect()
    }

    #[test]
    fn as_many_identifiers_as_the_kernel_has_filters_for_have_one_each() {
        let wanted = set(0x200..0x200 + 511);
        let filters = filters(wanted.iter().map(|id| Id::Standard(*id)));
        assert_eq!(filters.len(), MAX_FILTERS);
        assert!(filters.iter().all(|filter| *filter == REMOTE_FRAMES || filter.free() == 0));
        assert_eq!(passing(&filters), wanted);
        assert!(passes(&filters, raw(Id::Standard(0x7FF)) | REMOTE));
    }

    #[test]
    fn networks_of_many_nodes_let_nothing_foreign_pass() {
        let scattered = (1..=127).filter(|node| (node * node + 7 * node) % 11 < 6);
        for (wanted, most) in
            [(network(1..=127), 26), (network((1..=127).step_by(2)), 7), (network(scattered), 130)]
        {
            let filters = cover(standard(&wanted), 130);
            assert!(wanted.len() > 2 * 130 && filters.len() <= most, "{} of {most}", filters.len());
            assert_eq!(passing(&filters), wanted);
        }
    }

    #[test]
    fn filters_that_still_are_too_many_let_the_fewest_foreign_identifiers_pass() {
        for (wanted, room, expected) in [
            (set([0x181, 0x281, 0x185]), 2, set([0x181, 0x281, 0x185])),
            (set([0x181, 0x182, 0x601]), 2, set([0x180, 0x181, 0x182, 0x183, 0x601])),
            (
                set([0x000, 0x080, 0x601, 0x602, 0x604, 0x7E5]),
                4,
                set([0x000, 0x080, 0x600, 0x601, 0x602, 0x603, 0x604, 0x7E5]),
            ),
            (set([0x10, 0x21, 0x22]), 2, set([0x10, 0x20, 0x21, 0x22, 0x23])),
        ] {
            assert_eq!(passing(&cover(standard(&wanted), room)), expected, "{wanted:03X?} by {room}");
        }
    }

    #[test]
    fn identifiers_of_both_lengths_never_share_a_filter() {
        let ids = (0..600).flat_map(|id| [Id::Standard(id), Id::Extended(u32::from(id) * 0x3_0001)]);
        let filters = filters(ids.clone());
        assert!(filters.len() <= MAX_FILTERS);
        assert!(ids.clone().all(|id| passes(&filters, raw(id))));
        assert!(!passes(&filters, raw(Id::Standard(0x7FF))), "a foreign one");
        assert!(!passes(&filters, raw(Id::Extended(0x1FFF_FFFF))), "a foreign one");
    }

    fn any_id() -> impl Strategy<Value = Id> {
        prop_oneof![
            4 => (0..0x800_u16).prop_map(Id::Standard),
            1 => (0..=EXTENDED_MASK).prop_map(Id::Extended),
            1 => (0..0x1000_u32).prop_map(Id::Extended),
        ]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn whatever_is_wanted_passes_through_no_more_filters_than_there_is_room_for(
            ids in prop::collection::vec(any_id(), 0..1500), room in 2..512_usize
        ) {
            let exact: BTreeSet<Filter> = ids.iter().copied().map(Filter::exactly).collect();
            let filters = cover(exact.clone(), room);
            prop_assert!(filters.len() <= room);
            prop_assert!(exact.iter().all(|wanted| passes(&filters, wanted.id)));
            prop_assert!(filters.iter().all(|filter| filter.mask & FLAGS == FLAGS && filter.id & !filter.mask == 0));
            if exact.len() <= room {
                prop_assert!(filters.iter().all(|filter| exact.contains(filter)));
            }
        }

        #[test]
        fn joining_lets_nothing_foreign_pass(ids in prop::collection::btree_set(0..0x800_u16, 0..2048)) {
            let bits = (0..11).map(|bit| 1 << bit);
            let joined = bits.fold(standard(&ids), |filters, bit| join(&filters, bit));
            let filters: Vec<Filter> = joined.into_iter().collect();
            prop_assert_eq!(passing(&filters), ids);
        }
    }
}
