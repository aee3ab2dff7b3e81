//! CRC of block transfers: x^16 + x^12 + x^5 + 1, starting at zero (CiA 301 v4.2, section 7.2.4.3.16).

const POLYNOMIAL: u16 = 0x1021;

const TABLE: [u16; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < table.len() {
        let mut crc = (byte as u16) << 8;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 0x8000 != 0 { crc << 1 ^ POLYNOMIAL } else { crc << 1 };
            bit += 1;
        }
        #[expect(clippy::indexing_slicing, reason = "the loop ends before the end of the table")]
        {
            table[byte] = crc;
        }
        byte += 1;
    }
    table
};

/// The CRC of what `crc` is of, followed by `bytes`.
pub(crate) fn update(crc: u16, bytes: &[u8]) -> u16 {
    bytes.iter().fold(crc, |crc, byte| {
        let entry = TABLE.get(usize::from((crc >> 8) as u8 ^ byte)).copied().unwrap_or(0);
        crc << 8 ^ entry
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_check_value_is_that_of_the_standard() {
        assert_eq!(update(0, b"123456789"), 0x31C3);
        assert_eq!(update(update(0, b"12345"), b"6789"), 0x31C3);
    }
}
