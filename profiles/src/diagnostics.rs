//! What is wrong with a file, where, and what would be right.

use core::fmt;
use core::ops::Range;

use thiserror::Error;

/// One finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
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
        write!(f, "{}:{}:{}: error: {}", self.file, self.line, self.column, self.message)?;
        self.help.iter().try_for_each(|help| write!(f, "\n  help: {help}"))
    }
}

/// Everything that is wrong, sorted by position within a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Error)]
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

/// Collects findings about one text.
#[derive(Debug)]
pub struct Report<'t> {
    file: &'t str,
    text: &'t str,
    found: Vec<Finding>,
}

#[derive(Debug)]
struct Finding {
    offset: usize,
    message: String,
    help: Option<String>,
}

impl<'t> Report<'t> {
    /// No findings yet about `text`, which stands in `file`.
    #[must_use]
    pub const fn new(file: &'t str, text: &'t str) -> Self {
        Self { file, text, found: Vec::new() }
    }

    /// Adds a finding at the start of `span`.
    pub fn error(&mut self, span: &Span, message: impl Into<String>) {
        self.found.push(Finding { offset: span.start, message: message.into(), help: None });
    }

    /// Adds a finding at the start of `span` with what would be right.
    pub fn error_with_help(&mut self, span: &Span, message: impl Into<String>, help: impl Into<String>) {
        self.found.push(Finding { offset: span.start, message: message.into(), help: Some(help.into()) });
    }

    /// Line and column of a byte offset.
    #[must_use]
    pub fn position(&self, span: &Span) -> (usize, usize) {
        let mut cursor = Cursor::new(self.text);
        cursor.advance(span.start);
        (cursor.line, cursor.column)
    }

    /// The findings, sorted by position; empty if there are none.
    #[must_use]
    pub fn finish(mut self) -> Diagnostics {
        self.found.sort_by_key(|finding| finding.offset);
        let mut cursor = Cursor::new(self.text);
        let diagnostics = self.found.into_iter().map(|finding| {
            cursor.advance(finding.offset);
            Diagnostic {
                file: self.file.to_owned(),
                line: cursor.line,
                column: cursor.column,
                message: finding.message,
                help: finding.help,
            }
        });
        Diagnostics(diagnostics.collect())
    }
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
        let mut report = Report::new("a.toml", "grün = 1\nx");
        report.error(&(10..11), "second");
        report.error_with_help(&(6..7), "first", "blue");
        report.error(&(99..100), "past the end");
        let shown = report.finish().to_string();
        assert_eq!(
            shown,
            "a.toml:1:6: error: first\n  help: blue\na.toml:2:1: error: second\na.toml:2:2: error: past the end"
        );
    }
}
