//! Sections, keys and values of an EDS or DCF, each with its place (CiA 306-1 v1.4, section 4).
//!
//! What only looks different from the standard is read without a word: letter case, spaces, quotes, comments behind values.
//! What has no meaning or several is reported.

use std::collections::HashMap;

use super::text::at;
use crate::{Report, Span};

/// The sections of a file, by name in lower case.
#[derive(Debug, Default)]
pub(super) struct Ini<'t> {
    sections: HashMap<String, Section<'t>>,
    /// Their names in the order of the file.
    order: Vec<String>,
}

/// A section.
#[derive(Debug)]
pub(super) struct Section<'t> {
    /// Its name as the file writes it, without brackets.
    pub(super) name: &'t str,
    /// Where the name stands.
    pub(super) span: Span,
    /// By key in lower case.
    values: HashMap<String, Text<'t>>,
}

/// A piece of a line.
#[derive(Clone, Debug)]
pub(super) struct Text<'t> {
    /// Without spaces around it.
    pub(super) text: &'t str,
    /// Where it stands.
    pub(super) span: Span,
    /// The key as the file writes it, and where that stands.
    pub(super) key: (&'t str, Span),
}

impl<'t> Ini<'t> {
    /// Reads `text`; of two sections or keys of one name the later one holds.
    pub(super) fn parse(text: &'t str, report: &mut Report) -> Self {
        let mut ini = Self::default();
        let mut section: Option<Section<'t>> = None;
        let mut offset = 0;
        for line in text.split('\n') {
            let (content, start) = trimmed(line, offset);
            offset += line.len() + 1;
            if content.is_empty() || content.starts_with([';', '#']) {
                continue;
            }
            if let Some(rest) = content.strip_prefix('[') {
                section.take().into_iter().for_each(|done| ini.add(done, report));
                section = Some(header(rest, start + 1, report));
            } else if let Some(section) = &mut section {
                section.read(content, start, report);
            } else {
                report.warn(&at(start), "this stands before the first section and is ignored", None);
            }
        }
        section.into_iter().for_each(|done| ini.add(done, report));
        ini
    }

    fn add(&mut self, section: Section<'t>, report: &mut Report) {
        let name = section.name.to_lowercase();
        let (written, span) = (section.name, section.span.clone());
        if self.sections.insert(name.clone(), section).is_none() {
            return self.order.push(name);
        }
        report.warn(&span, format!("there is a section [{written}] already; this one holds"), None);
    }

    /// The section `name`, which is given in lower case.
    pub(super) fn get(&self, name: &str) -> Option<&Section<'t>> {
        self.sections.get(name)
    }

    /// All sections in the order of the file, with their names in lower case.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&str, &Section<'t>)> {
        self.order.iter().filter_map(|name| Some((name.as_str(), self.sections.get(name)?)))
    }
}

impl<'t> Section<'t> {
    /// The value of `key`, which is given in lower case; none where it is empty.
    pub(super) fn get(&self, key: &str) -> Option<&Text<'t>> {
        self.values.get(key).filter(|value| !value.text.is_empty())
    }

    /// All values, empty ones too, with their keys in lower case.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&str, &Text<'t>)> {
        self.values.iter().map(|(key, value)| (key.as_str(), value))
    }

    /// Reads a line behind the header.
    fn read(&mut self, line: &'t str, start: usize, report: &mut Report) {
        let Some((key, value)) = line.split_once('=') else {
            let help = "write `Key=Value`, or `;` in front of a comment".to_owned();
            return report.warn(&at(start), "this is neither a section nor a key with a value", help);
        };
        let written = key.trim_end();
        let key_span = start..start + written.len();
        let (value, value_start) = trimmed(value, start + key.len() + 1);
        let (value, value_start) = unquoted(without_comment(value), value_start);
        let span = value_start..value_start + value.len();
        let text = Text { text: value, span, key: (written, key_span.clone()) };
        if self.values.insert(written.to_lowercase(), text).is_some() {
            let message = format!("[{}] has a `{written}` already; this one holds", self.name);
            report.warn(&key_span, message, None);
        }
    }
}

/// The section that begins with a line, of which `rest` is what follows the bracket.
fn header<'t>(rest: &'t str, start: usize, report: &mut Report) -> Section<'t> {
    let (inside, behind) = rest.split_once(']').unwrap_or_else(|| {
        report.warn(&at(start + rest.len()), "the `]` behind the name of the section is missing", None);
        (without_comment(rest), "")
    });
    let behind = behind.trim();
    if !behind.is_empty() && !behind.starts_with([';', '#']) {
        let place = start + rest.len() - behind.len();
        report.warn(&at(place), format!("`{behind}` behind the name of a section is ignored"), None);
    }
    let (name, start) = trimmed(inside, start);
    Section { name, span: start..start + name.len(), values: HashMap::new() }
}

/// `text`, which stands at `start`, without the spaces around it, and where that stands.
fn trimmed(text: &str, start: usize) -> (&str, usize) {
    let is_space = |c: char| c.is_whitespace() || c.is_control();
    let rest = text.trim_start_matches(is_space);
    (rest.trim_end_matches(is_space), start + text.len() - rest.len())
}

/// `value` without a comment: a semicolon behind a space.
fn without_comment(value: &str) -> &str {
    if value.starts_with(';') {
        return "";
    }
    let is_comment = |place: &usize| value.get(..*place).is_some_and(|front| front.ends_with([' ', '\t']));
    let comment = value.match_indices(';').map(|(place, _)| place).find(is_comment);
    comment.and_then(|place| value.get(..place)).unwrap_or(value).trim_end()
}

/// `value` without the quotes around it.
fn unquoted(value: &str, start: usize) -> (&str, usize) {
    let inner = value.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
    inner.map_or((value, start), |inner| trimmed(inner, start + 1))
}
