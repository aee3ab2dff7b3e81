//! Numbers of an EDS or DCF: decimal, hexadecimal after `0x`, octal after `0`, and sums with `$NODEID` (CiA 306-1 v1.4,
//! section 4).

/// A number, and how it was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Number {
    /// What it is, without the Node-ID.
    pub(super) value: i128,
    /// Whether it was written in hexadecimal digits, as bit patterns are.
    pub(super) is_hexadecimal: bool,
    /// Whether the Node-ID is to be added.
    pub(super) has_node_id: bool,
    /// What was guessed.
    pub(super) remark: Option<&'static str>,
}

const NODE_ID: &str = "$NODEID";
const GUESSED_HEXADECIMAL: &str = "is read as hexadecimal: there is no `0x` in front of it";
const GUESSED_DECIMAL: &str =
    "is read as decimal: a number that begins with 0 is octal, and this has an 8 or 9";
const OCTAL: &str = "is read as octal, since it begins with 0";

impl Number {
    fn plain(value: i128) -> Self {
        Self { value, is_hexadecimal: false, has_node_id: false, remark: None }
    }
}

/// The number that `text` is, without `$NODEID`.
pub(super) fn plain(text: &str) -> Option<Number> {
    sum(text).filter(|number| !number.has_node_id)
}

/// The number or sum that `text` is; `$NODEID` may stand in it once, in either place.
pub(super) fn sum(text: &str) -> Option<Number> {
    let packed: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let mut total: Option<Number> = None;
    // A sign in front of the first term belongs to it.
    let terms = packed.strip_prefix('+').unwrap_or(&packed);
    for term in terms.split('+') {
        let is_node_id = term.eq_ignore_ascii_case(NODE_ID);
        let number =
            if is_node_id { Number { has_node_id: true, ..Number::plain(0) } } else { signed(term)? };
        total = Some(match total {
            None => number,
            Some(sum) if sum.has_node_id && number.has_node_id => return None,
            Some(sum) => Number {
                value: sum.value.checked_add(number.value)?,
                is_hexadecimal: sum.is_hexadecimal | number.is_hexadecimal,
                has_node_id: sum.has_node_id | number.has_node_id,
                remark: sum.remark.or(number.remark),
            },
        });
    }
    total
}

fn signed(text: &str) -> Option<Number> {
    match text.strip_prefix('-') {
        Some(rest) => unsigned(rest).map(|number| Number { value: -number.value, ..number }),
        None => unsigned(text),
    }
}

fn unsigned(text: &str) -> Option<Number> {
    if let Some(digits) = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        return digits_of(digits, 16).map(|value| Number { is_hexadecimal: true, ..Number::plain(value) });
    }
    let guessed = |digits| {
        let value = digits_of(digits, 16)?;
        Some(Number { is_hexadecimal: true, remark: Some(GUESSED_HEXADECIMAL), ..Number::plain(value) })
    };
    if let Some(digits) = text.strip_suffix(['h', 'H']) {
        return guessed(digits);
    }
    match text.strip_prefix('0') {
        Some(rest) if !rest.is_empty() => match (digits_of(rest, 8), digits_of(rest, 10)) {
            (Some(octal), decimal) => {
                let remark = (decimal != Some(octal)).then_some(OCTAL);
                Some(Number { remark, ..Number::plain(octal) })
            }
            (None, Some(decimal)) => Some(Number { remark: Some(GUESSED_DECIMAL), ..Number::plain(decimal) }),
            (None, None) => guessed(text),
        },
        Some(_) | None => digits_of(text, 10).map(Number::plain).or_else(|| guessed(text)),
    }
}

/// The number that these digits are, of which there is at least one and nothing else.
fn digits_of(text: &str, radix: u32) -> Option<i128> {
    // Wide enough for 64 bits in every notation, so that no sum of some overflows.
    const MOST_DIGITS: usize = 30;
    let are_digits = (1..=MOST_DIGITS).contains(&text.len()) && text.chars().all(|c| c.is_digit(radix));
    i128::from_str_radix(text, radix).ok().filter(|_| are_digits)
}

/// The real number that `text` is.
pub(super) fn real(text: &str) -> Option<f64> {
    let number = text.trim().replace(',', ".").parse::<f64>().ok();
    number.filter(|number| number.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Option<(i128, bool)> {
        sum(text).map(|number| (number.value, number.has_node_id))
    }

    #[test]
    fn numbers_are_decimal_hexadecimal_or_octal() {
        for (text, number) in [
            ("10", 10),
            ("0x1F", 0x1F),
            ("0X1f", 0x1F),
            ("010", 8),
            ("007", 7),
            ("0", 0),
            ("-5", -5),
            ("+5", 5),
            ("-0x10", -16),
            ("089", 89),
            ("1F", 0x1F),
            ("0FFh", 0xFF),
            ("0xFFFFFFFFFFFFFFFF", 0xFFFF_FFFF_FFFF_FFFF),
        ] {
            assert_eq!(value(text), Some((number, false)), "{text}");
        }
        for text in
            ["", "0x", "x", "1.5", "--1", "5 ms", "0x1000000000000000000000000000000000", "$NODE", "+", "1+"]
        {
            assert_eq!(value(text), None, "{text}");
        }
    }

    #[test]
    fn what_was_guessed_is_told() {
        let remark = |text| sum(text).unwrap().remark;
        assert_eq!(remark("010"), Some(OCTAL));
        assert_eq!(remark("007"), None);
        assert_eq!(remark("08"), Some(GUESSED_DECIMAL));
        assert_eq!(remark("1A"), Some(GUESSED_HEXADECIMAL));
        assert_eq!(remark("0x10"), None);
    }

    #[test]
    fn the_node_id_is_added_in_either_order() {
        for text in
            ["$NODEID+0x180", "0x180+$NODEID", "$NodeId + 384", " 0x180 +\t$NODEID", "$NODEID+0x100+0x80"]
        {
            assert_eq!(value(text), Some((0x180, true)), "{text}");
        }
        assert_eq!(value("$NODEID"), Some((0, true)));
        for text in ["$NODEID+", "$NODEID*2", "$NODEID+$NODEID", "$NODEID0x180", "$NODEID+x"] {
            assert_eq!(value(text), None, "{text}");
        }
    }

    #[test]
    fn reals_may_have_a_comma() {
        assert_eq!(real("1,5"), Some(1.5));
        assert_eq!(real("-2e3"), Some(-2000.0));
        assert_eq!(real("inf").or(real("nan")).or(real("1.2.3")), None);
    }
}
