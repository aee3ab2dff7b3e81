//! Typed access to a TOML document that remembers where everything stands.
//!
//! A [`Table`] is asked for its keys one by one; what has the wrong type is reported with its position, and
//! [`Table::finish`] reports the keys nobody asked for.

use core::fmt;
use core::ops::RangeInclusive;

pub use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::{Report, Span};

/// A parsed text.
#[derive(Debug)]
pub struct Document<'t>(Spanned<DeTable<'t>>);

impl<'t> Document<'t> {
    /// Parses `text`; `None` with one finding if it is no TOML.
    pub fn parse(text: &'t str, report: &mut Report) -> Option<Self> {
        let parsed = DeTable::parse(text);
        parsed.map(Self).map_err(|e| report.error(&e.span().unwrap_or_default(), e.message(), None)).ok()
    }

    /// The table of the whole document, to be changed.
    pub(crate) fn entries_mut(&mut self) -> &mut DeTable<'t> {
        self.0.get_mut()
    }

    /// The table of the whole document.
    pub(crate) fn into_entries(self) -> DeTable<'t> {
        self.0.into_inner()
    }

    /// The table of the whole document, to be read.
    pub fn root<'r, 'd>(&'d self, report: &'r mut Report) -> Table<'r, 'd> {
        Node { entries: self.0.get_ref(), span: 0..0 }.open(report)
    }
}

/// A table that was not opened yet.
#[derive(Clone, Debug)]
pub struct Node<'d> {
    entries: &'d DeTable<'d>,
    span: Span,
}

impl<'d> Node<'d> {
    /// Begins to read the table.
    pub fn open<'r>(self, report: &'r mut Report) -> Table<'r, 'd> {
        Table { report, node: self, asked: Vec::new() }
    }

    /// Where the table stands.
    #[must_use]
    pub fn span(&self) -> Span {
        self.span.clone()
    }

    /// The keys of the table, each with the value behind it; values of other types are reported.
    pub fn values<T: FromToml<'d>>(&self, report: &mut Report) -> Vec<(Spanned<&'d str>, T)> {
        let read = |(key, value): (&'d Spanned<_>, _)| {
            let name = name_of(key);
            let value = T::from_toml(name.get_ref(), value, report)?;
            Some((name, value))
        };
        self.entries.iter().filter_map(read).collect()
    }

    /// The keys of the table, each with the table behind it.
    pub fn tables(&self, report: &mut Report) -> Vec<(Spanned<&'d str>, Self)> {
        self.values(report)
    }
}

/// A table being read.
#[derive(Debug)]
pub struct Table<'r, 'd> {
    /// Where findings go.
    pub report: &'r mut Report,
    node: Node<'d>,
    asked: Vec<&'static str>,
}

impl<'d> Table<'_, 'd> {
    /// Where the table stands.
    #[must_use]
    pub fn span(&self) -> Span {
        self.node.span()
    }

    /// The value of `key`; `None` if there is none or it has the wrong type, which is reported.
    pub fn get<T: FromToml<'d>>(&mut self, key: &'static str) -> Option<T> {
        self.asked.push(key);
        T::from_toml(key, self.node.entries.get(key)?, self.report)
    }

    /// The value of `key`; `None` if there is none or it has the wrong type, both of which are reported.
    pub fn require<T: FromToml<'d>>(&mut self, key: &'static str) -> Option<T> {
        if !self.has(key) {
            self.report_missing(key, &T::expected());
        }
        self.get(key)
    }

    /// The required value of `key`, which must lie in `range`.
    pub fn require_in<T>(&mut self, key: &'static str, range: RangeInclusive<T>) -> Option<T>
    where
        T: FromToml<'d> + PartialOrd + fmt::Display,
    {
        let expected = format!("a number from {} to {}", range.start(), range.end());
        self.asked.push(key);
        let Some(value) = self.node.entries.get(key) else {
            self.report_missing(key, &expected);
            return None;
        };
        let number = T::from_toml(key, value, &mut Report::default());
        let number = number.filter(|number| range.contains(number));
        if number.is_none() {
            report_mismatch(key, value, &expected, self.report);
        }
        number
    }

    /// The value of `key`, which must lie in `range`, if there is such a key.
    pub fn get_in<T>(&mut self, key: &'static str, range: RangeInclusive<T>) -> Option<T>
    where
        T: FromToml<'d> + PartialOrd + fmt::Display,
    {
        if self.has(key) {
            return self.require_in(key, range);
        }
        self.asked.push(key);
        None
    }

    /// Takes these keys for known without reading them.
    pub fn ignore(&mut self, keys: &[&'static str]) {
        self.asked.extend(keys);
    }

    fn report_missing(&mut self, key: &str, expected: &str) {
        let help = format!("add `{key} = ` with {expected}");
        self.report.error(&self.node.span, format!("`{key}` is missing"), help);
    }

    /// Whether there is such a key.
    #[must_use]
    pub fn has(&self, key: &str) -> bool {
        self.node.entries.contains_key(key)
    }

    /// Where the key stands, or the table if there is no such key.
    #[must_use]
    pub fn key_span(&self, key: &str) -> Span {
        self.node.entries.get_key_value(key).map_or_else(|| self.span(), |(key, _)| key.span())
    }

    /// One of the words that `parse` knows; others are reported with the nearest of `known`.
    pub fn word<T>(
        &mut self,
        key: &'static str,
        parse: impl Fn(&str) -> Option<T>,
        known: impl IntoIterator<Item = &'static str>,
    ) -> Option<Spanned<T>> {
        let word: Spanned<&str> = self.get(key)?;
        let value = parse(word.get_ref());
        if value.is_none() {
            self.report.unknown(&word.span(), key, word.get_ref(), known);
        }
        value.map(|value| Spanned::new(word.span(), value))
    }

    /// Reports the keys that nobody asked for.
    pub fn finish(self) {
        for key in self.node.entries.keys() {
            let name = name_of(key);
            if !self.asked.iter().any(|asked| asked == name.get_ref()) {
                self.report.unknown(&name.span(), "key", name.get_ref(), self.asked.iter().copied());
            }
        }
    }
}

fn name_of<'d>(key: &'d Spanned<toml::de::DeString<'d>>) -> Spanned<&'d str> {
    Spanned::new(key.span(), key.get_ref())
}

/// What a TOML value can be read as.
pub trait FromToml<'d>: Sized {
    /// What is expected, with its article.
    fn expected() -> String;

    /// The value of `key`; `None` if it is something else, which is reported.
    fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self>;
}

fn mismatch<'d, T: FromToml<'d>>(key: &str, value: &Spanned<DeValue<'_>>, report: &mut Report) -> Option<T> {
    report_mismatch(key, value, &T::expected(), report);
    None
}

fn report_mismatch(key: &str, value: &Spanned<DeValue<'_>>, expected: &str, report: &mut Report) {
    let found = match value.get_ref() {
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Array(_) => "an array".to_owned(),
        other => format!("a {}", other.type_str()),
    };
    report.error(&value.span(), format!("`{key}` cannot be {found}"), format!("write {expected}"));
}

macro_rules! from_integer {
    ($($integer:ty)*) => {$(
        impl<'d> FromToml<'d> for $integer {
            fn expected() -> String {
                format!("an integer from {} to {}", Self::MIN, Self::MAX)
            }

            fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self> {
                let number = value.get_ref().as_integer();
                let number = number.and_then(|n| Self::from_str_radix(n.as_str(), n.radix()).ok());
                number.or_else(|| mismatch::<Self>(key, value, report))
            }
        }
    )*};
}

from_integer! { u8 u16 u32 u64 }

impl<'d> FromToml<'d> for bool {
    fn expected() -> String {
        "true or false".to_owned()
    }

    fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self> {
        value.get_ref().as_bool().or_else(|| mismatch::<Self>(key, value, report))
    }
}

impl<'d> FromToml<'d> for &'d str {
    fn expected() -> String {
        "a string".to_owned()
    }

    fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self> {
        value.get_ref().as_str().or_else(|| mismatch::<Self>(key, value, report))
    }
}

impl<'d> FromToml<'d> for f64 {
    fn expected() -> String {
        "a number".to_owned()
    }

    fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self> {
        match Scalar::of(value.get_ref()) {
            #[expect(clippy::cast_precision_loss, reason = "a float is what was asked for")]
            Some(Scalar::Integer(number)) => Some(number as Self),
            Some(Scalar::Real(number)) => Some(number),
            Some(Scalar::Bool(_) | Scalar::Text(_)) | None => mismatch::<Self>(key, value, report),
        }
    }
}

/// A single value of whichever type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar<'d> {
    /// `true` or `false`.
    Bool(bool),
    /// An integer.
    Integer(i128),
    /// A floating-point number.
    Real(f64),
    /// A string.
    Text(&'d str),
}

impl<'d> Scalar<'d> {
    fn of(value: &'d DeValue<'d>) -> Option<Self> {
        match value {
            DeValue::Boolean(bool) => Some(Self::Bool(*bool)),
            DeValue::Integer(number) => {
                i128::from_str_radix(number.as_str(), number.radix()).ok().map(Self::Integer)
            }
            DeValue::Float(number) => number.as_str().parse().ok().map(Self::Real),
            DeValue::String(text) => Some(Self::Text(text)),
            DeValue::Datetime(_) | DeValue::Array(_) | DeValue::Table(_) => None,
        }
    }
}

impl<'d> FromToml<'d> for Scalar<'d> {
    fn expected() -> String {
        "a number, a string, true or false".to_owned()
    }

    fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self> {
        Self::of(value.get_ref()).or_else(|| mismatch::<Self>(key, value, report))
    }
}

impl<'d> FromToml<'d> for Node<'d> {
    fn expected() -> String {
        "a table".to_owned()
    }

    fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self> {
        let entries = value.get_ref().as_table();
        entries
            .map(|entries| Self { entries, span: value.span() })
            .or_else(|| mismatch::<Self>(key, value, report))
    }
}

impl<'d, T: FromToml<'d>> FromToml<'d> for Vec<T> {
    fn expected() -> String {
        format!("an array, each element {}", T::expected())
    }

    fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self> {
        let Some(elements) = value.get_ref().as_array() else { return mismatch::<Self>(key, value, report) };
        Some(elements.iter().filter_map(|element| T::from_toml(key, element, report)).collect())
    }
}

/// A single value, or several in an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OneOrMore<T>(pub Vec<T>);

impl<'d, T: FromToml<'d>> FromToml<'d> for OneOrMore<T> {
    fn expected() -> String {
        format!("{} or an array of such", T::expected())
    }

    fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self> {
        match value.get_ref() {
            DeValue::Array(_) => Vec::from_toml(key, value, report).map(Self),
            _ => T::from_toml(key, value, report).map(|one| Self(vec![one])),
        }
    }
}

impl<'d, T: FromToml<'d>> FromToml<'d> for Spanned<T> {
    fn expected() -> String {
        T::expected()
    }

    fn from_toml(key: &str, value: &'d Spanned<DeValue<'d>>, report: &mut Report) -> Option<Self> {
        T::from_toml(key, value, report).map(|inner| Self::new(value.span(), inner))
    }
}
