//! From the bytes of a file to text with one kind of line end.

use crate::{Report, Span};

/// The characters that Windows-1252 has at 0x80-0x9F; where it has none, the control characters of ISO 8859-1.
const WINDOWS_1252: [char; 32] = [
    '\u{20AC}', '\u{81}', '\u{201A}', '\u{192}', '\u{201E}', '\u{2026}', '\u{2020}', '\u{2021}', '\u{2C6}',
    '\u{2030}', '\u{160}', '\u{2039}', '\u{152}', '\u{8D}', '\u{17D}', '\u{8F}', '\u{90}', '\u{2018}',
    '\u{2019}', '\u{201C}', '\u{201D}', '\u{2022}', '\u{2013}', '\u{2014}', '\u{2DC}', '\u{2122}', '\u{161}',
    '\u{203A}', '\u{153}', '\u{9D}', '\u{17E}', '\u{178}',
];

/// The text of a file in UTF-8, UTF-16 with a mark or, failing these, Windows-1252; lines end with `\n`.
///
/// CiA 306-1 asks for ASCII. What is none stands in names only, so that nothing depends on a wrong guess.
pub(super) fn decode(bytes: &[u8], report: &mut Report) -> String {
    let (text, remark) = characters(bytes);
    let text = text.replace("\r\n", "\n").replace('\r', "\n");
    if let Some(remark) = remark {
        let first = text.find(|c: char| !c.is_ascii()).unwrap_or(0);
        report.warn(&at(first), remark, None);
    }
    text
}

fn characters(bytes: &[u8]) -> (String, Option<&'static str>) {
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => (String::from_utf8_lossy(rest).into_owned(), None),
        [0xFF, 0xFE, rest @ ..] => (utf_16(rest, u16::from_le_bytes), Some("the file is UTF-16, not ASCII")),
        [0xFE, 0xFF, rest @ ..] => (utf_16(rest, u16::from_be_bytes), Some("the file is UTF-16, not ASCII")),
        _ => match str::from_utf8(bytes) {
            Ok(text) => (text.to_owned(), None),
            Err(_) => {
                let text = bytes.iter().map(|byte| windows_1252(*byte)).collect();
                (text, Some("this is no UTF-8: the file is read as Windows-1252"))
            }
        },
    }
}

fn utf_16(bytes: &[u8], unit: impl Fn([u8; 2]) -> u16) -> String {
    let units = bytes.as_chunks().0.iter().map(|pair| unit(*pair));
    char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

fn windows_1252(byte: u8) -> char {
    let position = usize::from(byte).checked_sub(0x80);
    position.and_then(|position| WINDOWS_1252.get(position)).copied().unwrap_or(char::from(byte))
}

/// The place of one byte.
pub(super) fn at(offset: usize) -> Span {
    offset..offset
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_editors_write_becomes_text() {
        let read = |bytes: &[u8]| decode(bytes, &mut Report::default());
        assert_eq!(read(b"\xEF\xBB\xBFa\r\nb\rc\n\n"), "a\nb\nc\n\n");
        assert_eq!(read("\u{B0}C".as_bytes()), "\u{B0}C");
        assert_eq!(read(b"20 \xB0C \x80"), "20 \u{B0}C \u{20AC}");
        assert_eq!(read(b"\xFF\xFEa\0\r\0\n\0b\0"), "a\nb");
        assert_eq!(read(b"\xFE\xFF\0a\xD8\0"), "a\u{FFFD}");
    }
}
