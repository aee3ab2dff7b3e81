//! The words of a line.

use core::str::FromStr;

use super::answer::GatewayError;

/// What is still to be read of a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Words<'l>(&'l str);

impl<'l> Words<'l> {
    /// Those of `line`; what stands behind a `#` outside of quotes is a comment.
    pub(super) fn new(line: &'l str) -> Self {
        let mut is_quoted = false;
        let comment = line.char_indices().find(|(_, character)| {
            is_quoted ^= *character == '"';
            *character == '#' && !is_quoted
        });
        let line = comment.and_then(|(start, _)| line.get(..start)).unwrap_or(line);
        Self(line.trim())
    }

    /// The next word, if there is one.
    pub(super) fn next(&mut self) -> Option<&'l str> {
        let end = self.0.find(|c: char| c.is_ascii_whitespace()).unwrap_or(self.0.len());
        let (word, rest) = self.0.split_at_checked(end)?;
        self.0 = rest.trim_start();
        Some(word).filter(|word| !word.is_empty())
    }

    /// The next word, without taking it.
    pub(super) fn peek(self) -> Option<&'l str> {
        let mut words = self;
        words.next()
    }

    /// All the rest as it is.
    pub(super) fn rest(&mut self) -> &'l str {
        core::mem::take(&mut self.0)
    }

    /// The next word as a number of this type.
    pub(super) fn number<N: TryFrom<u64>>(&mut self) -> Result<N, GatewayError> {
        let number = self.next().and_then(unsigned).ok_or(GatewayError::Syntax)?;
        N::try_from(number).map_err(|_| GatewayError::Syntax)
    }

    /// Nothing may be left.
    pub(super) fn end(self) -> Result<(), GatewayError> {
        if self.0.is_empty() { Ok(()) } else { Err(GatewayError::Syntax) }
    }
}

/// A number in decimal, or in hexadecimal behind `0x`.
pub(super) fn unsigned(word: &str) -> Option<u64> {
    let hex = word.strip_prefix("0x").or_else(|| word.strip_prefix("0X"));
    let (digits, radix) = hex.map_or((word, 10), |digits| (digits, 16));
    // `from_str_radix` would take a sign.
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    u64::from_str_radix(digits, radix).ok().filter(|_| is_plain)
}

/// As [`unsigned`], with a sign before it.
pub(super) fn signed(word: &str) -> Option<i128> {
    match word.strip_prefix('-') {
        Some(digits) => unsigned(digits).map(|number| -i128::from(number)),
        None => unsigned(word.strip_prefix('+').unwrap_or(word)).map(i128::from),
    }
}

/// A real number, which is finite.
pub(super) fn real(word: &str) -> Option<f64> {
    f64::from_str(word).ok().filter(|number| number.is_finite())
}
