//! CAN-IDs that are not free.

/// Whether no PDO, SDO, SYNC, EMCY or TIME may be given the CAN-ID `id` of 11 bits: the restricted ones of CiA 301 v4.2,
/// table 40.
#[must_use]
pub const fn is_restricted(id: u16) -> bool {
    matches!(
        id,
        0x000..=0x07F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..=0x7FF
    )
}
