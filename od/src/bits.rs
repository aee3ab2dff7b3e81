//! Bits in byte strings, lowest bit of the first byte first, as PDOs and process images pack them
//! (CiA 301 v4.2, section 7.4.7).

/// The little-endian number in `bytes`; bytes past the eighth are ignored.
#[must_use]
pub fn from_le(bytes: &[u8]) -> u64 {
    bytes.iter().take(8).rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

/// Reads `width` (0-64) bits at bit `offset`; bits past the end of `bytes` are zero.
#[must_use]
pub fn get(bytes: &[u8], offset: usize, width: u8) -> u64 {
    let window = bytes.get(offset / 8..).unwrap_or_default();
    let wide = window.iter().take(9).rev().fold(0_u128, |number, byte| number << 8 | u128::from(*byte));
    (wide >> (offset % 8)) as u64 & mask(width)
}

/// Writes the low `width` (0-64) bits of `value` at bit `offset`; bits past the end of `bytes` are dropped.
pub fn put(bytes: &mut [u8], offset: usize, width: u8, value: u64) {
    let mut clear = u128::from(mask(width)) << (offset % 8);
    let mut set = u128::from(value & mask(width)) << (offset % 8);
    for byte in bytes.get_mut(offset / 8..).unwrap_or_default().iter_mut().take(9) {
        *byte = *byte & !(clear as u8) | set as u8;
        clear >>= 8;
        set >>= 8;
    }
}

const fn mask(width: u8) -> u64 {
    match width {
        0 => 0,
        1..=63 => (1 << width) - 1,
        64.. => u64::MAX,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_put_is_got_and_nothing_else_changes(
            before: [u8; 12], offset in 0_usize..96, width in 0_u8..=64, value: u64,
        ) {
            let mut after = before;
            put(&mut after, offset, width, value);
            let inside = usize::from(width).min(96 - offset) as u8;
            prop_assert_eq!(get(&after, offset, inside), value & mask(inside));
            for bit in (0..96).filter(|b| *b < offset || *b >= offset + usize::from(width)) {
                prop_assert_eq!(get(&after, bit, 1), get(&before, bit, 1));
            }
        }
    }
}
