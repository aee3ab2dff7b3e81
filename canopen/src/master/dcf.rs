//! Concise DCF: the configuration of a device as one string of bytes (CiA 302-3, object 0x1F22).

use od::Address;
use thiserror::Error;

/// Bytes of an entry before its data: index, sub-index, size.
const HEAD: usize = 7;

/// One write of a configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DcfEntry<'a> {
    /// What is written.
    pub address: Address,
    /// The bytes, as an SDO carries them.
    pub data: &'a [u8],
}

/// Why bytes are no concise DCF; both offsets count from the first byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum DcfError {
    /// The bytes end before what they announce.
    #[error("the concise DCF ends within what begins at byte {0}")]
    Truncated(usize),
    /// There are bytes behind the last entry.
    #[error("the concise DCF goes on behind its last entry, from byte {0}")]
    Excess(usize),
}

/// Reads a configuration: the number of entries, then of each its index, sub-index, size and data, all little-endian.
/// No bytes at all are a configuration without entries, as an object that was never written has them.
///
/// # Errors
/// See [`DcfError`].
pub fn decode_dcf(bytes: &[u8]) -> Result<Vec<DcfEntry<'_>>, DcfError> {
    if bytes.is_empty() {
        return Ok(Vec::new());
    }
    let offset = |rest: &[u8]| bytes.len() - rest.len();
    let (count, mut rest) = bytes.split_first_chunk().ok_or(DcfError::Truncated(0))?;
    let mut entries = Vec::new();
    for _ in 0..u32::from_le_bytes(*count) {
        let (entry, behind) = split_entry(rest).ok_or(DcfError::Truncated(offset(rest)))?;
        entries.push(entry);
        rest = behind;
    }
    if rest.is_empty() { Ok(entries) } else { Err(DcfError::Excess(offset(rest))) }
}

/// Where the first entry begins.
pub(super) const FIRST: usize = size_of::<u32>();

/// The entry that begins at this byte, and where the next one begins.
pub(super) fn entry_at(bytes: &[u8], offset: usize) -> Option<(DcfEntry<'_>, usize)> {
    let (entry, rest) = split_entry(bytes.get(offset..)?)?;
    Some((entry, bytes.len() - rest.len()))
}

fn split_entry(bytes: &[u8]) -> Option<(DcfEntry<'_>, &[u8])> {
    let ([low, high, sub, size @ ..], rest) = bytes.split_first_chunk::<HEAD>()?;
    let size = usize::try_from(u32::from_le_bytes(*size)).ok()?;
    let (data, rest) = rest.split_at_checked(size)?;
    Some((DcfEntry { address: Address::new(u16::from_le_bytes([*low, *high]), *sub), data }, rest))
}

/// Writes a configuration. Data of more than 2^32 - 1 bytes, which no SDO carries, and entries beyond that number are cut.
#[must_use]
pub fn encode_dcf(entries: &[DcfEntry<'_>]) -> Vec<u8> {
    let mut bytes = u32::try_from(entries.len()).unwrap_or(u32::MAX).to_le_bytes().to_vec();
    for DcfEntry { address, data } in entries.iter().take(u32::MAX as usize) {
        let data = data.get(..u32::MAX as usize).unwrap_or(data);
        bytes.extend(address.index.to_le_bytes());
        bytes.push(address.sub);
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend_from_slice(data);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_configuration_is_a_count_and_its_writes() {
        let bytes = [
            2, 0, 0, 0, // two entries
            0x17, 0x10, 0x00, 2, 0, 0, 0, 0xE8, 0x03, // 0x1017:00 = 1000 ms
            0x0F, 0x20, 0x00, 0, 0, 0, 0, // 0x200F:00 = nothing
        ];
        let entries = [
            DcfEntry { address: Address::new(0x1017, 0), data: &[0xE8, 0x03] },
            DcfEntry { address: Address::new(0x200F, 0), data: &[] },
        ];
        assert_eq!(decode_dcf(&bytes), Ok(entries.to_vec()));
        assert_eq!(encode_dcf(&entries), bytes);
        assert_eq!(decode_dcf(&[]), Ok(vec![]));
        assert_eq!(decode_dcf(&[0; 4]), Ok(vec![]));
    }

    #[test]
    fn what_is_cut_or_goes_on_is_refused_where_that_shows() {
        let whole = encode_dcf(&[DcfEntry { address: Address::new(0x1017, 0), data: &[1, 2] }]);
        for len in 1..whole.len() {
            let offset = if len < 4 { 0 } else { 4 };
            assert_eq!(decode_dcf(&whole[..len]), Err(DcfError::Truncated(offset)), "{len}");
        }
        let longer = [&whole[..], &[0]].concat();
        assert_eq!(decode_dcf(&longer), Err(DcfError::Excess(13)));
        // Sizes and counts that no memory holds.
        assert_eq!(decode_dcf(&[0xFF; 4]), Err(DcfError::Truncated(4)));
        assert_eq!(decode_dcf(&[0xFF; 40]), Err(DcfError::Truncated(4)));
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(entries in vec((any::<u16>(), any::<u8>(), vec(any::<u8>(), 0..20)), 0..10)) {
            let entries: Vec<DcfEntry<'_>> = entries
                .iter()
                .map(|(index, sub, data)| DcfEntry { address: Address::new(*index, *sub), data })
                .collect();
            let bytes = encode_dcf(&entries);
            prop_assert_eq!(decode_dcf(&bytes), Ok(entries));
        }

        #[test]
        fn what_is_read_is_written_the_same(bytes in vec(0..4_u8, 1..60)) {
            if let Ok(entries) = decode_dcf(&bytes) {
                prop_assert_eq!(encode_dcf(&entries), bytes);
            }
        }
    }
}
