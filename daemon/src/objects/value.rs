//! Values of objects, written and read by people and programs.

use core::fmt::Write;

use od::{DataType, Value};
use thiserror::Error;

/// Why a text is no value of a type.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct Unfit(String);

/// The signatures of 0x1010 and 0x1011 (CiA 301 v4.2, sections 7.5.2.13 and 7.5.2.14).
const SIGNATURES: [&str; 2] = ["save", "load"];

/// The bytes, as an SDO carries them, of the value of `data_type` that `text` is: an integer in decimal, `0x` or `0b`; a
/// real; `true` or `false`; a text; bytes in hexadecimal.
///
/// # Errors
/// It is none of that type.
pub fn parse(data_type: DataType, text: &str) -> Result<Vec<u8>, Unfit> {
    let unfit = |help: &str| Unfit(format!("`{text}` is no {data_type}: {help}"));
    match data_type {
        DataType::VisibleString => Ok(text.as_bytes().to_vec()),
        DataType::UnicodeString => Ok(text.encode_utf16().flat_map(u16::to_le_bytes).collect()),
        DataType::OctetString | DataType::Domain => {
            hex(text).ok_or_else(|| unfit("write its bytes in hexadecimal, such as 0x01A0 or \"01 a0\""))
        }
        DataType::Boolean => match text {
            "true" | "1" => Ok(vec![1]),
            "false" | "0" => Ok(vec![0]),
            _ => Err(unfit("write true or false")),
        },
        DataType::Real32 | DataType::Real64 => {
            let number = text.parse().map_err(|_| unfit("write a number, such as 1.5"))?;
            fixed(data_type, Value::real(data_type, number))
                .ok_or_else(|| unfit("write a number, such as 1.5"))
        }
        DataType::Unsigned32 if SIGNATURES.contains(&text) => Ok(text.as_bytes().to_vec()),
        DataType::Integer8
        | DataType::Integer16
        | DataType::Integer24
        | DataType::Integer32
        | DataType::Integer40
        | DataType::Integer48
        | DataType::Integer56
        | DataType::Integer64
        | DataType::Unsigned8
        | DataType::Unsigned16
        | DataType::Unsigned24
        | DataType::Unsigned32
        | DataType::Unsigned40
        | DataType::Unsigned48
        | DataType::Unsigned56
        | DataType::Unsigned64
        | DataType::TimeOfDay
        | DataType::TimeDifference => {
            let number =
                integer(text).ok_or_else(|| unfit("write a whole number, such as 100, -5 or 0x1F"))?;
            let (min, max) = data_type.integer_limits().unwrap_or_default();
            let value = Value::integer(data_type, number);
            fixed(data_type, value).ok_or_else(|| unfit(&format!("it goes from {min} to {max}")))
        }
    }
}

/// The value that `bytes` are, for people.
#[must_use]
pub fn text(data_type: DataType, bytes: &[u8]) -> String {
    let raw = od::bits::from_le(bytes);
    match data_type {
        DataType::VisibleString => format!("{:?}", String::from_utf8_lossy(bytes)),
        DataType::UnicodeString => format!("{:?}", utf16(bytes)),
        DataType::OctetString | DataType::Domain => hex_text(bytes),
        DataType::Boolean => (raw & 1 != 0).to_string(),
        DataType::Real32 | DataType::Real64 => {
            Value::as_real(data_type, raw).map(|real| real.to_string()).unwrap_or_default()
        }
        _ if data_type.is_signed() => data_type.integer(raw).to_string(),
        _ => {
            let digits = data_type.bytes().unwrap_or(0) * 2;
            format!("{raw} (0x{raw:0digits$X})")
        }
    }
}

/// The value that `bytes` are, for programs: a number, a boolean or a text. A real that is no number is a text.
#[must_use]
pub fn json(data_type: DataType, bytes: &[u8]) -> serde_json::Value {
    let raw = od::bits::from_le(bytes);
    match data_type {
        DataType::VisibleString => String::from_utf8_lossy(bytes).into(),
        DataType::UnicodeString => utf16(bytes).into(),
        DataType::OctetString | DataType::Domain => hex_text(bytes).into(),
        DataType::Boolean => (raw & 1 != 0).into(),
        DataType::Real32 | DataType::Real64 => {
            let real = Value::as_real(data_type, raw).unwrap_or(f64::NAN);
            serde_json::Number::from_f64(real).map_or_else(|| real.to_string().into(), Into::into)
        }
        _ if data_type.is_signed() => i64::try_from(data_type.integer(raw)).unwrap_or_default().into(),
        _ => raw.into(),
    }
}

fn fixed(data_type: DataType, value: Option<Value>) -> Option<Vec<u8>> {
    let bytes = value?.raw().to_le_bytes();
    bytes.get(..data_type.bytes()?).map(<[u8]>::to_vec)
}

/// A whole number in decimal, `0x` or `0b`, with a sign if need be, and with `_` between its digits.
fn integer(text: &str) -> Option<i128> {
    let (sign, digits) = match text.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    };
    let (radix, digits) = match digits.get(..2) {
        Some("0x" | "0X") => (16, digits.get(2..)?),
        Some("0b" | "0B") => (2, digits.get(2..)?),
        Some(_) | None => (10, digits),
    };
    let digits: String = digits.chars().filter(|c| *c != '_').collect();
    let is_number = digits.chars().all(|c| c.is_digit(radix));
    i128::from_str_radix(&digits, radix).ok().filter(|_| is_number).map(|number| sign * number)
}

/// Bytes in hexadecimal, with or without `0x` and spaces.
fn hex(text: &str) -> Option<Vec<u8>> {
    let text = text.strip_prefix("0x").unwrap_or(text);
    let digits: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    if !digits.len().is_multiple_of(2) || !digits.iter().all(u8::is_ascii_hexdigit) {
        return None;
    }
    let byte = |pair: &[u8]| u8::from_str_radix(str::from_utf8(pair).ok()?, 16).ok();
    digits.chunks(2).map(byte).collect()
}

fn hex_text(bytes: &[u8]) -> String {
    let mut text = "0x".to_owned();
    for byte in bytes {
        // A String takes whatever is written.
        let _ = write!(text, "{byte:02X}");
    }
    text
}

fn utf16(bytes: &[u8]) -> String {
    let unit = |pair: &[u8]| {
        u16::from_le_bytes([pair.first().copied().unwrap_or(0), pair.get(1).copied().unwrap_or(0)])
    };
    let units: Vec<u16> = bytes.chunks(2).map(unit).collect();
    String::from_utf16_lossy(&units)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn integers_are_decimal_hexadecimal_and_binary() {
        assert_eq!(parse(DataType::Unsigned16, "15"), Ok(vec![15, 0]));
        assert_eq!(parse(DataType::Unsigned16, "0x1F0"), Ok(vec![0xF0, 1]));
        assert_eq!(parse(DataType::Unsigned16, "0b1_0000_0001"), Ok(vec![1, 1]));
        assert_eq!(parse(DataType::Integer32, "-50_000"), Ok((-50_000_i32).to_le_bytes().to_vec()));
        assert_eq!(parse(DataType::Integer24, "-1"), Ok(vec![0xFF; 3]));
        let error = parse(DataType::Integer8, "128").unwrap_err().to_string();
        assert_eq!(error, "`128` is no INTEGER8: it goes from -128 to 127");
        for wrong in ["", "-", "0x", "x", "1.5", "--1", "+-1", "0x-1", "1e3", "\u{e4}\u{e4}"] {
            assert!(parse(DataType::Integer32, wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn other_types_are_written_as_they_are_read() {
        assert_eq!(parse(DataType::Boolean, "true"), Ok(vec![1]));
        assert_eq!(parse(DataType::Real32, "1.5"), Ok(vec![0, 0, 0xC0, 0x3F]));
        assert_eq!(parse(DataType::VisibleString, "abc"), Ok(b"abc".to_vec()));
        assert_eq!(parse(DataType::UnicodeString, "a\u{20AC}"), Ok(vec![0x61, 0, 0xAC, 0x20]));
        assert_eq!(parse(DataType::Domain, "0x01a0"), Ok(vec![1, 0xA0]));
        assert_eq!(parse(DataType::OctetString, "01 A0"), Ok(vec![1, 0xA0]));
        assert_eq!(parse(DataType::Unsigned32, "save"), Ok(b"save".to_vec()));
        assert!(parse(DataType::Unsigned16, "save").is_err());
        assert!(parse(DataType::Domain, "0x1").is_err() && parse(DataType::Domain, "xy").is_err());
    }

    #[test]
    fn values_are_shown_by_their_type() {
        assert_eq!(text(DataType::Unsigned16, &[0x37, 0x16]), "5687 (0x1637)");
        assert_eq!(text(DataType::Integer32, &[0xFF; 4]), "-1");
        assert_eq!(text(DataType::VisibleString, b"a\"b\n"), r#""a\"b\n""#);
        assert_eq!(text(DataType::Domain, &[1, 0xA0]), "0x01A0");
        assert_eq!(text(DataType::Real64, &1.5_f64.to_le_bytes()), "1.5");
        assert_eq!(json(DataType::Real32, &f32::NAN.to_le_bytes()), serde_json::json!("NaN"));
        assert_eq!(json(DataType::Integer64, &(-7_i64).to_le_bytes()), serde_json::json!(-7));
    }

    proptest! {
        #[test]
        fn any_text_and_any_bytes_are_survived(kind in 0..DataType::ALL.len(), written: String, bytes: Vec<u8>) {
            let _ = parse(DataType::ALL[kind], &written);
            let _ = (text(DataType::ALL[kind], &bytes), json(DataType::ALL[kind], &bytes));
        }

        #[test]
        fn an_integer_survives_the_way(kind in 0..DataType::ALL.len(), raw: u64) {
            let data_type = DataType::ALL[kind];
            if let Some(size) = data_type.bytes().filter(|_| data_type.integer_limits().is_some() && data_type != DataType::Boolean) {
                let bytes = raw.to_le_bytes()[..size].to_vec();
                let shown = text(data_type, &bytes);
                let number = shown.split(' ').next().unwrap();
                prop_assert_eq!(parse(data_type, number), Ok(bytes));
            }
        }
    }
}
