//! What is wrong with a file, where, and what would be right.

use core::fmt;
use core::ops::Range;

use serde::Serialize;
use thiserror::Error;

/// What a finding means for the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The file cannot be used.
    Error,
    /// The file is used, otherwise than it says or with a guess.
    Warning,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Error => "error",
            Self::Warning => "warning",
        })
    }
}

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// What it means for the file.
    pub severity: Severity,
    /// Name of the file as its reader knows it.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// What is wrong.
    pub message: String,
    /// What would be right, if that can be said.
    pub help: Option<String>,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { severity, file, line, column, message, help } = self;
        write!(f, "{file}:{line}:{column}: {severity}: {message}")?;
        help.iter().try_for_each(|help| write!(f, "\n  help: {help}"))
    }
}

/// Everything that was found, sorted by position within a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Error, Serialize)]
#[serde(transparent)]
pub struct Diagnostics(pub Vec<Diagnostic>);

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut findings = self.0.iter();
        findings.next().map_or(Ok(()), |first| write!(f, "{first}"))?;
        findings.try_for_each(|finding| write!(f, "\n{finding}"))
    }
}

/// Where something stands in a text, in bytes.
pub type Span = Range<usize>;

/// Warnings that are listed of one text; further ones are counted.
const MOST_WARNINGS: usize = 500;

/// Collects findings about one text.
#[derive(Debug, Default)]
pub struct Report {
    found: Vec<Finding>,
    warnings: usize,
}

#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Finding {
    offset: usize,
    severity: Severity,
    message: String,
    help: Option<String>,
}

impl Report {
    /// Adds an error at the start of `span`, with what would be right.
    pub fn error(&mut self, span: &Span, message: impl Into<String>, help: impl Into<Option<String>>) {
        self.add(Severity::Error, span, message.into(), help.into());
    }

    /// Adds something at the start of `span` that does not keep the file from being used.
    pub fn warn(&mut self, span: &Span, message: impl Into<String>, help: impl Into<Option<String>>) {
        self.warnings += 1;
        if self.warnings <= MOST_WARNINGS {
            self.add(Severity::Warning, span, message.into(), help.into());
        }
    }

    fn add(&mut self, severity: Severity, span: &Span, message: String, help: Option<String>) {
        self.found.push(Finding { offset: span.start, severity, message, help });
    }

    /// Adds that `word` at `span` is none of the known words for `what`, and proposes the nearest of them.
    pub fn unknown<'k>(
        &mut self,
        span: &Span,
        what: &str,
        word: &str,
        known: impl IntoIterator<Item = &'k str>,
    ) {
        self.error(span, format!("unknown {what} `{word}`"), suggestion(word, known));
    }

    /// `value` if no error was found in the `text` of `file`.
    ///
    /// # Errors
    /// The findings, sorted by position.
    pub fn conclude<T>(self, file: &str, text: &str, value: Option<T>) -> Result<T, Diagnostics> {
        let (value, findings) = self.judge(file, text, value);
        value.ok_or(findings)
    }

    /// `value` if no error was found in the `text` of `file`, and the findings, sorted by position.
    pub fn judge<T>(self, file: &str, text: &str, value: Option<T>) -> (Option<T>, Diagnostics) {
        let has_errors = self.found.iter().any(|finding| finding.severity == Severity::Error);
        (value.filter(|_| !has_errors), self.into_diagnostics(file, text))
    }

    fn into_diagnostics(mut self, file: &str, text: &str) -> Diagnostics {
        if let Some(more @ 1..) = self.warnings.checked_sub(MOST_WARNINGS) {
            let message = format!("{more} more warnings are not listed");
            self.add(Severity::Warning, &(text.len()..text.len()), message, None);
        }
        // An array says the same of each of its members.
        self.found.sort_unstable();
        self.found.dedup();
        let mut cursor = Cursor::new(text);
        let diagnostics = self.found.into_iter().map(|finding| {
            cursor.advance(finding.offset);
            Diagnostic {
                severity: finding.severity,
                file: file.to_owned(),
                line: cursor.line,
                column: cursor.column,
                message: finding.message,
                help: finding.help,
            }
        });
        Diagnostics(diagnostics.collect())
    }
}

/// Line and column of byte `offset` in `text`, both from 1; the end of the text for what lies beyond.
#[must_use]
pub fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let mut cursor = Cursor::new(text);
    cursor.advance(offset);
    (cursor.line, cursor.column)
}

/// What to write instead of the unknown `word`: the nearest of the known ones, or any of them.
pub(crate) fn suggestion<'k>(word: &str, known: impl IntoIterator<Item = &'k str>) -> Option<String> {
    const SHORT_LIST: usize = 8;
    const LONGEST_LIST: usize = 32;
    let known: Vec<&str> = known.into_iter().collect();
    let list = known.join(", ");
    match nearest(word, &known) {
        Some(near) if known.len() > SHORT_LIST => Some(format!("did you mean `{near}`?")),
        Some(near) => Some(format!("did you mean `{near}`? known: {list}")),
        None if known.is_empty() || known.len() > LONGEST_LIST => None,
        None => Some(format!("known: {list}")),
    }
}

/// The known word that `word` was most likely meant to be: a third of its letters may be wrong, or its unit missing.
pub(crate) fn nearest<'k>(word: &str, known: &[&'k str]) -> Option<&'k str> {
    const LONGEST_WORD: usize = 64;
    if word.len() > LONGEST_WORD {
        return None;
    }
    let tolerated = (word.len() / 3).max(1);
    let distances = known.iter().map(|k| (distance(word, k), *k));
    let nearest = distances.min_by_key(|(distance, _)| *distance);
    let nearest = nearest.filter(|(distance, _)| *distance <= tolerated).map(|(_, k)| k);
    let lacks_end = |k: &&&str| k.strip_prefix(word).is_some_and(|end| end.starts_with('_'));
    nearest.or_else(|| known.iter().find(lacks_end).copied())
}

/// How many letters must be inserted, removed or replaced to turn one word into the other.
fn distance(from: &str, to: &str) -> usize {
    let mut row: Vec<usize> = (0..=to.chars().count()).collect();
    for (removed, a) in from.chars().enumerate() {
        let mut diagonal = removed;
        let mut left = removed + 1;
        if let Some(first) = row.first_mut() {
            *first = left;
        }
        for (cell, b) in row.iter_mut().skip(1).zip(to.chars()) {
            left = (diagonal + usize::from(a != b)).min(*cell + 1).min(left + 1);
            diagonal = core::mem::replace(cell, left);
        }
    }
    row.last().copied().unwrap_or(0)
}

/// Walks a text once and counts lines and characters on the way.
struct Cursor<'t> {
    rest: core::str::CharIndices<'t>,
    line: usize,
    column: usize,
}

impl<'t> Cursor<'t> {
    fn new(text: &'t str) -> Self {
        Self { rest: text.char_indices(), line: 1, column: 1 }
    }

    /// Goes to the character at or before byte `offset`, or to the end of the text.
    fn advance(&mut self, offset: usize) {
        while self.rest.offset() < offset {
            match self.rest.next() {
                Some((_, '\n')) => (self.line, self.column) = (self.line + 1, 1),
                Some(_) => self.column += 1,
                None => return,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters_and_findings_come_in_order() {
        let mut report = Report::default();
        report.error(&(10..11), "second", None);
        report.error(&(6..7), "first", "blue".to_owned());
        report.warn(&(99..100), "past the end", None);
        let shown = report.conclude("a.toml", "grün = 1\nx", Some(())).unwrap_err().to_string();
        assert_eq!(
            shown,
            "a.toml:1:6: error: first\n  help: blue\na.toml:2:1: error: second\na.toml:2:2: warning: past the end"
        );
    }

    #[test]
    fn warnings_refuse_nothing_and_have_an_end() {
        let mut report = Report::default();
        (0..MOST_WARNINGS + 2).for_each(|at| report.warn(&(at..at), "odd", None));
        let (value, findings) = report.judge("a.eds", &" ".repeat(1000), Some(1));
        assert_eq!((value, findings.0.len()), (Some(1), MOST_WARNINGS + 1));
        assert_eq!(
            findings.0.last().unwrap().to_string(),
            "a.eds:1:1001: warning: 2 more warnings are not listed"
        );
    }

    #[test]
    fn the_nearest_word_is_proposed_if_it_is_near_enough() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(nearest("nodeid", &["name", "node_id"]), Some("node_id"));
        assert_eq!(nearest("colour", &["name", "node_id"]), None);
        assert_eq!(nearest("backlash", &["name", "backlash_counts"]), Some("backlash_counts"));
    }
}
