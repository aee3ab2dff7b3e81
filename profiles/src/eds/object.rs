//! Objects, from the sections that describe them and their entries (CiA 306-1 v1.4, section 6).

use std::collections::BTreeMap;

use od::{Access, Address, DataType, Entry, Initial, Object, ObjectKind, Schema, Value};

use super::communication;
use super::entry::{self, Assumed, Draft};
use super::ini::{Ini, Section, Text};
use super::name::{self, Name};
use super::number;
use crate::{Report, Span};

/// An object, and where the file describes it.
#[derive(Clone, Debug)]
pub(super) struct Drafted {
    pub(super) name: String,
    pub(super) kind: ObjectKind,
    /// In the order of their sub-indices.
    pub(super) entries: Vec<Draft>,
    pub(super) span: Span,
}

/// All objects of a file by index.
pub(super) type Objects = BTreeMap<u16, Drafted>;

/// The sections of one object.
#[derive(Default)]
struct Parts<'i, 't> {
    whole: Option<&'i Section<'t>>,
    entries: BTreeMap<u8, &'i Section<'t>>,
    names: Option<&'i Section<'t>>,
    values: Option<&'i Section<'t>>,
}

/// Objects below this index define data types, which the standard has, too.
const FIRST: u16 = 0x1000;
/// The sub-index that describes the structure of an object instead of being part of it.
const STRUCTURE: u8 = 0xFF;
/// What sub-index 0 of an object with several entries is called where the file has no name for it.
const COUNT: &str = "Highest sub-index supported";
/// The same, where the object is described in one section.
const COMPACT_COUNT: &str = "NrOfObjects";

/// Reads every object that a section of `ini` describes, whether or not the lists have it.
pub(super) fn read_all(ini: &Ini<'_>, is_configured: bool, report: &mut Report) -> Objects {
    let mut objects = Objects::new();
    let mut room = Schema::MAX_ENTRIES;
    for (index, parts) in parts_of(ini, report) {
        let Some(object) = Reader { index, parts, is_configured, report: &mut *report }.read() else {
            continue;
        };
        let Some(rest) = room.checked_sub(object.entries.len()) else {
            report.error(&object.span, "a device cannot have more than 65535 entries", None);
            break;
        };
        room = rest;
        objects.insert(index, object);
    }
    objects
}

fn parts_of<'i, 't>(ini: &'i Ini<'t>, report: &mut Report) -> BTreeMap<u16, Parts<'i, 't>> {
    let mut all: BTreeMap<u16, Parts<'i, 't>> = BTreeMap::new();
    for (name, section) in ini.iter() {
        let place = match name::of(name) {
            Name::General => continue,
            Name::Unknown => {
                report.warn(
                    &section.span,
                    format!("[{}] describes nothing known and is ignored", section.name),
                    None,
                );
                continue;
            }
            Name::Object(index) | Name::Entry(index, _) | Name::Names(index) | Name::Values(index)
                if index < FIRST =>
            {
                continue;
            }
            Name::Object(index) => &mut all.entry(index).or_default().whole,
            Name::Names(index) => &mut all.entry(index).or_default().names,
            Name::Values(index) => &mut all.entry(index).or_default().values,
            Name::Entry(_, STRUCTURE) => continue,
            Name::Entry(index, sub) => {
                let entries = &mut all.entry(index).or_default().entries;
                if entries.insert(sub, section).is_some() {
                    let message = format!("0x{index:04X}:{sub:02X} is described already; this holds");
                    report.warn(&section.span, message, None);
                }
                continue;
            }
        };
        if place.replace(section).is_some() {
            report.warn(
                &section.span,
                format!("[{}] is there in another notation; this holds", section.name),
                None,
            );
        }
    }
    all
}

/// Reads one object.
struct Reader<'r, 'i, 't> {
    index: u16,
    parts: Parts<'i, 't>,
    is_configured: bool,
    report: &'r mut Report,
}

/// What an object is, by `ObjectType` and by the sections that it has.
enum Shape {
    Var,
    Compound(ObjectKind),
    /// It is none that a bus can reach.
    None,
}

impl Reader<'_, '_, '_> {
    fn read(mut self) -> Option<Drafted> {
        let first = self.parts.whole.or_else(|| self.parts.entries.values().next().copied());
        let Some(first) = first else {
            let orphan = self.parts.names.or(self.parts.values)?;
            self.report.warn(
                &orphan.span,
                format!("[{}] is for no object and is ignored", orphan.name),
                None,
            );
            return None;
        };
        let span = first.span.clone();
        let Some(whole) = self.parts.whole else {
            self.report.warn(
                &span,
                format!("there is no section [{:04X}] for this entry's object", self.index),
                None,
            );
            let name = format!("Object 0x{:04X}", self.index);
            return Some(self.compound(name, ObjectKind::Record, span, 0));
        };
        let compact = self.compact(whole);
        match self.shape(whole, compact > 0) {
            Shape::None => None,
            Shape::Var => Some(self.var(whole)),
            Shape::Compound(kind) => {
                entry::check_keys(whole, self.report);
                let name = entry::name(whole, &format!("Object 0x{:04X}", self.index), self.report);
                let object = self.compound(name, kind, span, compact);
                self.check_count(whole, object.entries.len(), compact);
                Some(object)
            }
        }
    }

    fn assumed<'n>(&self, name: &'n str, data_type: Option<DataType>) -> Assumed<'n> {
        Assumed { name, data_type, is_configured: self.is_configured }
    }

    /// The number of entries that all are as the section of the object says.
    fn compact(&mut self, whole: &Section<'_>) -> u8 {
        const HIGHEST: i128 = 254;
        let Some(text) = whole.get("compactsubobj") else { return 0 };
        let number = number::plain(text.text).map(|number| number.value);
        if !number.is_some_and(|number| (0..=HIGHEST).contains(&number)) {
            let message = format!("`CompactSubObj`: `{}` is no number from 0 to 254", text.text);
            self.report.warn(&text.span, message, None);
        }
        number.unwrap_or(0).clamp(0, HIGHEST) as u8
    }

    fn shape(&mut self, whole: &Section<'_>, is_compact: bool) -> Shape {
        let has_members = is_compact || self.parts.entries.keys().any(|sub| *sub > 0);
        let has_entries = has_members || self.parts.entries.contains_key(&0);
        let text = whole.get("objecttype");
        let code = text.and_then(|text| number::plain(text.text)).map(|number| number.value);
        let place = text.map_or(&whole.span, |text| &text.span);
        let guess = if has_members { Shape::Compound(ObjectKind::Record) } else { Shape::Var };
        match code {
            Some(0x2 | 0x7) if has_members => {
                let message =
                    format!("0x{:04X} is no VAR: it has sub-indices and is read as a RECORD", self.index);
                self.report.warn(place, message, None);
                guess
            }
            Some(0x2 | 0x7) => Shape::Var,
            Some(0x8 | 0x9) if !has_entries && whole.get("datatype").is_some() => {
                self.report.warn(place, "no sub-index is described: this is read as a VAR", None);
                Shape::Var
            }
            Some(0x8 | 0x9) if !has_entries => {
                let message =
                    format!("0x{:04X} is left out: none of its sub-indices is described", self.index);
                self.report.warn(place, message, None);
                Shape::None
            }
            Some(0x8) => Shape::Compound(ObjectKind::Array),
            Some(0x9) => Shape::Compound(ObjectKind::Record),
            Some(0x0 | 0x5 | 0x6) => {
                let message = format!(
                    "0x{:04X} is left out: its `ObjectType` is none of an object with a value",
                    self.index
                );
                self.report.warn(place, message, None);
                Shape::None
            }
            // Without a word it is a VAR.
            None if text.is_none() && !has_members => guess,
            Some(_) | None => {
                let (what, form) =
                    (text.map_or("missing", |text| text.text), if has_members { "RECORD" } else { "VAR" });
                let message = format!("`ObjectType` is {what}: 0x{:04X} is read as a {form}", self.index);
                self.report.warn(place, message, "write 0x7 (VAR), 0x8 (ARRAY) or 0x9 (RECORD)".to_owned());
                guess
            }
        }
    }

    fn var(&mut self, whole: &Section<'_>) -> Drafted {
        let name = format!("Object 0x{:04X}", self.index);
        let data_type = communication::data_type(Address::new(self.index, 0), true);
        let own = self.parts.entries.get(&0).copied();
        let section = own.filter(|_| whole.get("datatype").is_none()).unwrap_or(whole);
        if let Some(own) = own {
            let message = format!("a VAR has no section for its only entry: [{}] is read", section.name);
            self.report.warn(&own.span, message, None);
        }
        let draft = entry::read(0, section, self.assumed(&name, data_type), self.report);
        let (name, span) = (draft.entry.name.clone(), whole.span.clone());
        Drafted { name, kind: ObjectKind::Var, entries: vec![draft], span }
    }

    fn compound(&mut self, name: String, kind: ObjectKind, span: Span, compact: u8) -> Drafted {
        let whole = self.parts.whole;
        let mut entries = BTreeMap::new();
        if let Some(whole) = whole.filter(|_| compact > 0) {
            self.expand(whole, &name, compact, &mut entries);
        }
        let common = whole.filter(|_| kind == ObjectKind::Array).and_then(|whole| whole.get("datatype"));
        let common =
            common.and_then(|text| number::plain(text.text)).and_then(|n| u16::try_from(n.value).ok());
        let common = common.and_then(DataType::from_code);
        for (sub, section) in core::mem::take(&mut self.parts.entries) {
            let address = Address::new(self.index, sub);
            let data_type = if sub == 0 {
                Some(DataType::Unsigned8)
            } else {
                communication::data_type(address, false).or(common)
            };
            let assumed = if sub == 0 { COUNT.to_owned() } else { format!("{name} {sub}") };
            let draft = entry::read(sub, section, self.assumed(&assumed, data_type), self.report);
            entries.insert(sub, draft);
        }
        self.name_and_set(&mut entries);
        let mut entries: Vec<Draft> = entries.into_values().collect();
        self.count(&mut entries, &span);
        let kind = self.kind(kind, &entries, &span);
        Drafted { name, kind, entries, span }
    }

    /// Adds the entries of an object that is described in one section.
    fn expand(&mut self, whole: &Section<'_>, name: &str, compact: u8, entries: &mut BTreeMap<u8, Draft>) {
        let count = Entry::new(0, COMPACT_COUNT, DataType::Unsigned8, Access::ReadOnly);
        let count = count.with_value(Value::Fixed(compact.into()));
        entries.insert(0, Draft::supplied(count, &whole.span));
        let data_type = communication::data_type(Address::new(self.index, 1), false);
        let first = entry::read(1, whole, self.assumed(name, data_type), self.report);
        for sub in 1..=compact {
            let mut draft = first.clone();
            draft.entry.sub = sub;
            draft.entry.name = format!("{name}{sub}");
            entries.insert(sub, draft);
        }
    }

    /// Gives entries the names and values that stand in sections of their own.
    fn name_and_set(&mut self, entries: &mut BTreeMap<u8, Draft>) {
        for (sub, text) in self.listed(self.parts.names, entries) {
            entries.get_mut(&sub).into_iter().for_each(|draft| draft.entry.name = text.text.to_owned());
        }
        let values = self.parts.values.filter(|_| self.is_configured);
        for (sub, text) in self.listed(values, entries) {
            entries.get_mut(&sub).into_iter().for_each(|draft| draft.set(&text, self.report));
        }
    }

    /// The lines `1=...` of a section, for entries that there are; others are reported.
    fn listed<'t>(
        &mut self,
        section: Option<&Section<'t>>,
        entries: &BTreeMap<u8, Draft>,
    ) -> Vec<(u8, Text<'t>)> {
        let mut listed = Vec::new();
        for (key, text) in
            section.into_iter().flat_map(Section::iter).filter(|(key, _)| *key != "nrofentries")
        {
            let sub = number::plain(key).and_then(|number| u8::try_from(number.value).ok());
            match sub.filter(|sub| entries.contains_key(sub)) {
                Some(sub) if !text.text.is_empty() => listed.push((sub, text.clone())),
                Some(_) => {}
                None => {
                    let message = format!("0x{:04X} has no sub-index `{}`", self.index, text.key.0);
                    self.report.warn(&text.key.1, message, None);
                }
            }
        }
        listed
    }

    /// Makes sub-index 0 a number of entries.
    fn count(&mut self, entries: &mut Vec<Draft>, span: &Span) {
        let highest = entries.last().map_or(0, |draft| draft.entry.sub);
        let index = self.index;
        let Some(count) = entries.first_mut().filter(|draft| draft.entry.sub == 0) else {
            self.report.warn(span, format!("0x{index:04X}:00 is not described: it holds {highest}"), None);
            let count = Entry::new(0, COUNT, DataType::Unsigned8, Access::Const);
            let count = count.with_value(Value::Fixed(highest.into()));
            return entries.insert(0, Draft::supplied(count, span));
        };
        if count.entry.data_type != DataType::Unsigned8 {
            let message = format!("0x{index:04X}:00 is {} here and becomes UNSIGNED8", count.entry.data_type);
            self.report.warn(&count.span, message, None);
            let raw = count.number().min(u8::MAX.into());
            let Entry { access, name, .. } = &count.entry;
            count.entry =
                Entry::new(0, name.clone(), DataType::Unsigned8, *access).with_value(Value::Fixed(raw));
        }
        let is_fixed = !count.entry.access.is_writable();
        if count.value.is_none() && (is_fixed || !communication::has_variable_count(index)) {
            count.entry.initial = Initial::Value(Value::Fixed(highest.into()));
            count.entry.range = None;
        } else if is_fixed && count.number() != u64::from(highest) {
            let message =
                format!("0x{index:04X}:00 says {}, the highest sub-index is {highest}", count.number());
            self.report.warn(&count.place().clone(), message, None);
        }
    }

    /// The kind of the object: one with entries of several types is a record.
    fn kind(&mut self, kind: ObjectKind, entries: &[Draft], span: &Span) -> ObjectKind {
        let mut types = entries.iter().skip(1).map(|draft| draft.entry.data_type);
        let is_homogeneous = types.next().is_none_or(|first| types.all(|other| other == first));
        if kind == ObjectKind::Array && !is_homogeneous {
            let message =
                format!("0x{:04X} has entries of several types: it is a RECORD, no ARRAY", self.index);
            self.report.warn(span, message, None);
            return ObjectKind::Record;
        }
        kind
    }

    /// Compares `SubNumber` with what is described.
    fn check_count(&mut self, whole: &Section<'_>, entries: usize, compact: u8) {
        let text = whole.get("subnumber");
        let number = text.and_then(|text| number::plain(text.text)).map(|number| number.value);
        match text {
            None if compact == 0 => {
                self.report.warn(&whole.span, format!("[{}] has no `SubNumber`", whole.name), None);
            }
            Some(text) if compact == 0 && number != i128::try_from(entries).ok() => {
                let message =
                    format!("`SubNumber` is {}, but {entries} sub-indices are described", text.text);
                self.report.warn(&text.span, message, None);
            }
            Some(_) | None => {}
        }
    }
}

impl Drafted {
    /// The entry `sub`.
    pub(super) fn entry(&self, sub: u8) -> Option<&Draft> {
        self.entries.iter().find(|draft| draft.entry.sub == sub)
    }

    /// The same, to be changed.
    pub(super) fn entry_mut(&mut self, sub: u8) -> Option<&mut Draft> {
        self.entries.iter_mut().find(|draft| draft.entry.sub == sub)
    }

    /// The object for a dictionary.
    pub(super) fn finish(self, index: u16) -> Object {
        let entries = self.entries.into_iter().map(|draft| draft.entry).collect();
        Object { index, name: self.name, kind: self.kind, entries }
    }
}
