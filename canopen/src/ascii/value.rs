//! Values as text (CiA 309-3, data types).

use od::{AbortCode, DataType, Value, bits};

use super::base64;
use super::words::{Words, real, signed, unsigned};

/// How a value is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// As its data type is.
    Plain(DataType),
    /// An unsigned integer of so many bytes in hexadecimal; not of the standard, but others have it.
    Hexadecimal(usize),
    /// Bytes in hexadecimal, of any type; not of the standard either.
    Bytes,
}

/// The word of each data type.
const WORDS: [(&str, DataType); 24] = [
    ("b", DataType::Boolean),
    ("i8", DataType::Integer8),
    ("i16", DataType::Integer16),
    ("i24", DataType::Integer24),
    ("i32", DataType::Integer32),
    ("i40", DataType::Integer40),
    ("i48", DataType::Integer48),
    ("i56", DataType::Integer56),
    ("i64", DataType::Integer64),
    ("u8", DataType::Unsigned8),
    ("u16", DataType::Unsigned16),
    ("u24", DataType::Unsigned24),
    ("u32", DataType::Unsigned32),
    ("u40", DataType::Unsigned40),
    ("u48", DataType::Unsigned48),
    ("u56", DataType::Unsigned56),
    ("u64", DataType::Unsigned64),
    ("r32", DataType::Real32),
    ("r64", DataType::Real64),
    ("t", DataType::TimeOfDay),
    ("td", DataType::TimeDifference),
    ("vs", DataType::VisibleString),
    ("os", DataType::OctetString),
    ("us", DataType::UnicodeString),
];

impl Form {
    /// The form that a word names.
    pub(super) fn from_word(word: &str) -> Option<Self> {
        let is_named = |(known, _): &&(&str, DataType)| word.eq_ignore_ascii_case(known);
        if let Some((_, data_type)) = WORDS.iter().find(is_named) {
            return Some(Self::Plain(*data_type));
        }
        match word.to_ascii_lowercase().as_str() {
            "d" => Some(Self::Plain(DataType::Domain)),
            "x8" => Some(Self::Hexadecimal(1)),
            "x16" => Some(Self::Hexadecimal(2)),
            "x32" => Some(Self::Hexadecimal(4)),
            "x64" => Some(Self::Hexadecimal(8)),
            "hex" => Some(Self::Bytes),
            _ => None,
        }
    }

    /// Bits of such a value in a PDO; `None` if it has no fixed length or none of these.
    pub(super) fn bits(self) -> Option<u8> {
        match self {
            Self::Plain(data_type) => data_type.bits(),
            Self::Hexadecimal(bytes) => u8::try_from(bytes * 8).ok(),
            Self::Bytes => None,
        }
    }

    /// The bytes of the value that the rest of a line tells; `None` if that is no such value.
    pub(super) fn parse(self, words: &mut Words<'_>) -> Option<Vec<u8>> {
        match self {
            Self::Plain(DataType::VisibleString) => visible(words.rest()),
            Self::Plain(DataType::OctetString | DataType::UnicodeString | DataType::Domain) => {
                base64::decode(words.rest())
            }
            Self::Plain(DataType::TimeOfDay | DataType::TimeDifference) => {
                let (days, millis) =
                    (u16::try_from(unsigned(words.next()?)?).ok()?, unsigned(words.next()?)?);
                let millis = u32::try_from(millis).ok().filter(|millis| *millis < 1 << 28)?;
                Some(millis.to_le_bytes().into_iter().chain(days.to_le_bytes()).collect())
            }
            Self::Plain(data_type) => {
                let word = words.next()?;
                let value = if data_type.is_real() {
                    Value::real(data_type, real(word)?)?
                } else {
                    Value::integer(data_type, signed(word)?)?
                };
                Some(value.raw().to_le_bytes().into_iter().take(data_type.bytes()?).collect())
            }
            Self::Hexadecimal(bytes) => {
                let number = unsigned(words.next()?)?;
                let is_short = bytes >= 8 || number >> (8 * bytes) == 0;
                is_short.then(|| number.to_le_bytes().into_iter().take(bytes).collect())
            }
            Self::Bytes => {
                let digits: String = words.rest().split_ascii_whitespace().collect();
                let byte = |pair: &[u8]| {
                    let pair = str::from_utf8(pair).ok().filter(|pair| pair.len() == 2)?;
                    unsigned(&format!("0x{pair}")).and_then(|byte| u8::try_from(byte).ok())
                };
                digits.as_bytes().chunks(2).map(byte).collect()
            }
        }
    }

    /// A value as text.
    ///
    /// # Errors
    /// The bytes are not as many as the type has.
    pub(super) fn print(self, bytes: &[u8]) -> Result<String, AbortCode> {
        let length = match self {
            Self::Plain(data_type) => data_type.bytes(),
            Self::Hexadecimal(bytes) => Some(bytes),
            Self::Bytes => None,
        };
        if length.is_some_and(|length| length != bytes.len()) {
            return Err(AbortCode::LengthMismatch);
        }
        let raw = bits::from_le(bytes.get(..8).unwrap_or(bytes));
        Ok(match self {
            Self::Plain(DataType::VisibleString) => quoted(bytes),
            Self::Plain(DataType::OctetString | DataType::UnicodeString | DataType::Domain) => {
                base64::encode(bytes)
            }
            Self::Plain(DataType::TimeOfDay | DataType::TimeDifference) => {
                format!("{} {}", raw >> 32 & 0xFFFF, raw & 0x0FFF_FFFF)
            }
            Self::Plain(DataType::Boolean) => (raw & 1).to_string(),
            Self::Plain(data_type) => match Value::as_real(data_type, raw) {
                Some(real) => real.to_string(),
                None => data_type.integer(raw).to_string(),
            },
            Self::Hexadecimal(bytes) => format!("0x{raw:0width$X}", width = bytes * 2),
            Self::Bytes => {
                let digits: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
                digits.join(" ")
            }
        })
    }
}

/// A text in quotes, in which quotes are doubled, or one word.
fn visible(text: &str) -> Option<Vec<u8>> {
    let Some(inner) = text.strip_prefix('"') else {
        let is_word = !text.is_empty() && !text.contains(|c: char| c == '"' || c.is_ascii_whitespace());
        return is_word.then(|| text.as_bytes().to_vec());
    };
    let inner = inner.strip_suffix('"')?;
    let single = inner.replace("\"\"", "");
    (!single.contains('"')).then(|| inner.replace("\"\"", "\"").into_bytes())
}

/// A text in quotes; what is no visible character becomes a question mark.
fn quoted(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len() + 2);
    text.push('"');
    for byte in bytes {
        match byte {
            b'"' => text.push_str("\"\""),
            b' '..=b'~' => text.push(char::from(*byte)),
            _ => text.push('?'),
        }
    }
    text.push('"');
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(form: &str, text: &str) -> Option<Vec<u8>> {
        let mut words = Words::new(text);
        let value = Form::from_word(form).unwrap().parse(&mut words)?;
        words.end().is_ok().then_some(value)
    }

    fn print(form: &str, bytes: &[u8]) -> Result<String, AbortCode> {
        Form::from_word(form).unwrap().print(bytes)
    }

    #[test]
    fn each_type_has_its_text() {
        let examples: [(&str, &str, &[u8]); 25] = [
            ("b", "1", &[1]),
            ("i8", "-1", &[0xFF]),
            ("i16", "-32768", &[0x00, 0x80]),
            ("i24", "-2", &[0xFE, 0xFF, 0xFF]),
            ("i32", "2147483647", &[0xFF, 0xFF, 0xFF, 0x7F]),
            ("i64", "-1", &[0xFF; 8]),
            ("u8", "255", &[0xFF]),
            ("U16", "4660", &[0x34, 0x12]),
            ("u24", "65536", &[0, 0, 1]),
            ("u32", "402", &[0x92, 0x01, 0, 0]),
            ("u40", "4294967296", &[0, 0, 0, 0, 1]),
            ("u64", "18446744073709551615", &[0xFF; 8]),
            ("x8", "0x0A", &[10]),
            ("x16", "0x00FF", &[0xFF, 0]),
            ("x32", "0x00020192", &[0x92, 1, 2, 0]),
            ("x64", "0x0000000000000001", &[1, 0, 0, 0, 0, 0, 0, 0]),
            ("r32", "1.5", &[0, 0, 0xC0, 0x3F]),
            ("r64", "-0.25", &[0, 0, 0, 0, 0, 0, 0xD0, 0xBF]),
            ("t", "12000 86399999", &[0xFF, 0x5B, 0x26, 0x05, 0xE0, 0x2E]),
            ("vs", "\"a \"\"b\"\" #c\"", b"a \"b\" #c"),
            ("vs", "\"\"", b""),
            ("os", "Zm9v", b"foo"),
            ("us", "YQA=", b"a\0"),
            ("d", "AAEC", &[0, 1, 2]),
            ("hex", "01 AB", &[1, 0xAB]),
        ];
        for (form, text, bytes) in examples {
            assert_eq!(parse(form, text).as_deref(), Some(bytes), "{form} {text}");
            assert_eq!(print(form, bytes).as_deref(), Ok(text), "{form} {text}");
        }
        assert_eq!(parse("u16", "0x1234"), Some(vec![0x34, 0x12]));
        assert_eq!(parse("hex", "0 1ab"), Some(vec![0x01, 0xAB]));
        assert_eq!(parse("vs", "word"), Some(b"word".to_vec()));
    }

    #[test]
    fn what_is_no_value_of_a_type_is_refused() {
        for (form, wrong) in [
            ("b", "2"),
            ("b", "true"),
            ("i8", "128"),
            ("i8", "-129"),
            ("u8", "-1"),
            ("u8", "256"),
            ("u8", "+-1"),
            ("u8", "0x"),
            ("u8", "0x+1"),
            ("u8", ""),
            ("u8", "1 2"),
            ("u64", "18446744073709551616"),
            ("x8", "0x100"),
            ("r32", "nan"),
            ("r32", "1e999"),
            ("t", "1"),
            ("t", "65536 0"),
            ("t", "0 268435456"),
            ("vs", "two words"),
            ("vs", "\"open"),
            ("vs", "\"a\"b\""),
            ("os", "Z"),
            ("hex", "1"),
            ("hex", "GG"),
            ("hex", "+1"),
        ] {
            assert_eq!(parse(form, wrong), None, "{form} {wrong}");
        }
        assert_eq!(print("u16", &[1]), Err(AbortCode::LengthMismatch));
        assert_eq!(print("vs", b"\r\n\xFF"), Ok("\"???\"".to_owned()));
        assert_eq!(Form::from_word("u128"), None);
    }

    proptest! {
        #[test]
        fn any_bytes_are_printed_and_read_again(bytes: Vec<u8>) {
            for form in ["os", "us", "d", "hex"] {
                prop_assert_eq!(parse(form, &print(form, &bytes).unwrap()), Some(bytes.clone()), "{}", form);
            }
            for (word, data_type) in WORDS {
                let own: Vec<u8> = bytes.iter().copied().take(data_type.bytes().unwrap_or(0)).collect();
                let text = print(word, &own);
                if let (Ok(text), true) = (text, data_type.is_signed()) {
                    prop_assert_eq!(parse(word, &text), Some(own));
                }
            }
        }
    }
}
