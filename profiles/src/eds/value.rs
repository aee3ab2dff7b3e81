//! Default values and limits of an entry, by its type.

use od::{DataType, Initial, Range, Value};

use super::ini::{Section, Text};
use super::number::{self, Number};
use crate::{Report, Span};

/// The value that `text` is for an entry of `data_type`; none if it is no such value, which is reported.
pub(super) fn initial(data_type: DataType, text: &Text<'_>, report: &mut Report) -> Option<Initial> {
    let read = match data_type {
        DataType::VisibleString => Ok(visible(text, report)),
        DataType::UnicodeString => Ok(Value::bytes(utf_16(text.text))),
        DataType::OctetString | DataType::Domain => octets(text.text).map(Value::bytes).ok_or(()),
        DataType::Real32 | DataType::Real64 => real(data_type, text, report).ok_or(()),
        _ => return integer(data_type, text, report),
    };
    if read.is_err() {
        refuse(data_type, text, report);
    }
    read.ok().map(Initial::Value)
}

fn refuse(data_type: DataType, text: &Text<'_>, report: &mut Report) {
    let message =
        format!("`{}`: `{}` is no value of {data_type} and is left out", text.key.0, shown(text.text));
    report.warn(&text.span, message, expected(data_type));
}

/// The beginning of a text of any length.
fn shown(text: &str) -> String {
    const LONGEST: usize = 40;
    let mut shown: String = text.chars().take(LONGEST).collect();
    if shown.len() < text.len() {
        shown.push_str("...");
    }
    shown
}

fn expected(data_type: DataType) -> Option<String> {
    match data_type {
        DataType::OctetString | DataType::Domain => {
            Some("write hexadecimal digits, two for each byte".to_owned())
        }
        _ => data_type.integer_limits().map(|(min, max)| format!("it holds {min} to {max}")),
    }
}

/// A string of printable ASCII; other characters become question marks.
fn visible(text: &Text<'_>, report: &mut Report) -> Value {
    let is_printable = |c: char| matches!(c, ' '..='~');
    if !text.text.chars().all(is_printable) {
        report.warn(&text.span, "a VISIBLE_STRING has ASCII characters only; others become `?`", None);
    }
    let ascii: String = text.text.chars().map(|c| if is_printable(c) { c } else { '?' }).collect();
    Value::bytes(ascii)
}

fn utf_16(text: &str) -> Vec<u8> {
    text.encode_utf16().flat_map(u16::to_le_bytes).collect()
}

/// Bytes in hexadecimal digits, with or without spaces between them.
fn octets(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> = text.bytes().filter(|byte| !byte.is_ascii_whitespace()).collect();
    let (pairs, rest) = digits.as_chunks::<2>();
    let byte = |pair: &[u8; 2]| {
        let text = str::from_utf8(pair).ok().filter(|text| text.bytes().all(|b| b.is_ascii_hexdigit()))?;
        u8::from_str_radix(text, 16).ok()
    };
    let bytes: Option<Vec<u8>> = pairs.iter().map(byte).collect();
    bytes.filter(|_| rest.is_empty())
}

/// A real number; in hexadecimal digits it is the bit pattern.
fn real(data_type: DataType, text: &Text<'_>, report: &mut Report) -> Option<Value> {
    if let Some(number) = number::real(text.text) {
        return Value::real(data_type, number);
    }
    let number = number::plain(text.text).filter(|number| number.is_hexadecimal)?;
    let bits = u64::try_from(number.value).ok()?;
    let fits = data_type.bits().is_some_and(|width| width == 64 || bits >> width == 0);
    if fits {
        report.warn(&text.span, format!("`{}` is read as the bit pattern of a {data_type}", text.text), None);
    }
    fits.then_some(Value::Fixed(bits))
}

fn integer(data_type: DataType, text: &Text<'_>, report: &mut Report) -> Option<Initial> {
    let Some(number) = any_integer(text.text) else {
        refuse(data_type, text, report);
        return None;
    };
    if number.has_node_id {
        return plus_node_id(data_type, number, text, report);
    }
    let fitted = fitted(data_type, number);
    let remark = fitted.and_then(|(_, remark)| remark).or(number.remark);
    if let Some(remark) = remark {
        report.warn(&text.span, format!("`{}`: `{}` {remark}", text.key.0, shown(text.text)), None);
    }
    let value = fitted.and_then(|(value, _)| Value::integer(data_type, value));
    if value.is_none() {
        refuse(data_type, text, report);
    }
    value.map(Initial::Value)
}

/// The integer that `text` is: a number, a sum with the Node-ID, a real without a fraction, a truth value.
fn any_integer(text: &str) -> Option<Number> {
    let word = |word: &str| text.eq_ignore_ascii_case(word);
    let plain = |value| Number { value, is_hexadecimal: false, has_node_id: false, remark: None };
    if word("true") || word("false") {
        return Some(plain(word("true").into()));
    }
    number::sum(text).or_else(|| {
        // The largest integer below which every one is a REAL64.
        const EXACT: f64 = 9_007_199_254_740_992.0;
        let real = number::real(text).filter(|real| real.fract() == 0.0 && real.abs() < EXACT)?;
        Some(Number { remark: Some("is no integer in form"), ..plain(real as i128) })
    })
}

/// What `number` is in a type: itself, or with the same bits, if it fits in either way.
fn fitted(data_type: DataType, number: Number) -> Option<(i128, Option<&'static str>)> {
    let (min, max) = data_type.integer_limits()?;
    let span = max - min + 1;
    if (min..=max).contains(&number.value) {
        return Some((number.value, None));
    }
    if data_type.is_signed() && number.value > max && number.value < span {
        // Bit patterns are written in hexadecimal digits, negative ones too.
        let remark = (!number.is_hexadecimal).then_some("is read as a negative number by its bits");
        return Some((number.value - span, remark));
    }
    let is_negative = !data_type.is_signed() && (-(span / 2)..0).contains(&number.value);
    is_negative
        .then_some((number.value + span, Some("is read as a bit pattern: the type has no negative numbers")))
}

fn plus_node_id(
    data_type: DataType,
    number: Number,
    text: &Text<'_>,
    report: &mut Report,
) -> Option<Initial> {
    const HIGHEST_NODE_ID: i128 = 127;
    let base = u32::try_from(number.value).ok();
    let limits = data_type.integer_limits().filter(|_| !data_type.is_signed());
    let fits = data_type == DataType::Unsigned32
        || limits.is_some_and(|(_, max)| number.value + HIGHEST_NODE_ID <= max);
    if let Some(remark) = number.remark {
        report.warn(&text.span, format!("`{}`: `{}` {remark}", text.key.0, shown(text.text)), None);
    }
    match base.filter(|_| fits) {
        Some(base) => Some(Initial::PlusNodeId(base)),
        None => {
            refuse(data_type, text, report);
            None
        }
    }
}

/// `LowLimit` and `HighLimit`; what does not fit the type is cut or left out, which is reported.
pub(super) fn range(data_type: DataType, section: &Section<'_>, report: &mut Report) -> Option<Range> {
    let (low, high) = (section.get("lowlimit"), section.get("highlimit"));
    let place = low.or(high)?.span.clone();
    if data_type.is_real() {
        let mut limit = |text: Option<&Text<'_>>| {
            let text = text?;
            let number = number::real(text.text);
            if number.is_none() {
                refuse(data_type, text, report);
            }
            number
        };
        let (min, max) = (limit(low), limit(high));
        (min.or(max)).is_some().then_some(())?;
        let range = Range::Real { min: min.unwrap_or(f64::NEG_INFINITY), max: max.unwrap_or(f64::INFINITY) };
        return unless_empty(range, &place, report);
    }
    let Some((lowest, highest)) = data_type.integer_limits() else {
        report.warn(&place, format!("{data_type} has no limits: they are left out"), None);
        return None;
    };
    let min = low.and_then(|text| limit(data_type, text, report));
    let max = high.and_then(|text| limit(data_type, text, report));
    (min.or(max)).is_some().then_some(())?;
    let range = Range::Integer { min: min.unwrap_or(lowest), max: max.unwrap_or(highest) };
    unless_empty(range, &place, report)
}

/// `range` if any value lies in it; else it is reported.
fn unless_empty(range: Range, place: &Span, report: &mut Report) -> Option<Range> {
    let (is_empty, min, max) = match range {
        Range::Integer { min, max } => (min > max, min.to_string(), max.to_string()),
        Range::Real { min, max } => (min > max, min.to_string(), max.to_string()),
    };
    if is_empty {
        let message = format!("no value lies between the limits {min} and {max}, which are left out");
        report.warn(place, message, None);
    }
    (!is_empty).then_some(range)
}

/// One limit of an integer, cut to what the type holds.
fn limit(data_type: DataType, text: &Text<'_>, report: &mut Report) -> Option<i128> {
    let number = any_integer(text.text).filter(|number| !number.has_node_id);
    let Some(number) = number else {
        refuse(data_type, text, report);
        return None;
    };
    if let Some(remark) = number.remark {
        report.warn(&text.span, format!("`{}`: `{}` {remark}", text.key.0, shown(text.text)), None);
    }
    if let Some((value, _)) = fitted(data_type, number).filter(|_| data_type.is_signed() || number.value >= 0)
    {
        return Some(value);
    }
    let (min, max) = data_type.integer_limits()?;
    let cut = number.value.clamp(min, max);
    let message = format!("`{}`: {} exceeds {data_type} and becomes {cut}", text.key.0, shown(text.text));
    report.warn(&text.span, message, None);
    Some(cut)
}
