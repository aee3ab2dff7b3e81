//! One entry, from the section that describes it.

use od::{Access, DataType, Entry, Initial, Mappable, Range, Value};

use super::ini::{Section, Text};
use super::{number, value};
use crate::diagnostics::nearest;
use crate::{Report, Span};

/// An entry, and what the file said of it.
#[derive(Clone, Debug)]
pub(super) struct Draft {
    pub(super) entry: Entry,
    /// Where it is described.
    pub(super) span: Span,
    /// Where its value is given, if it is.
    pub(super) value: Option<Span>,
}

/// What an entry is called and of which type it is where its section does not say so.
#[derive(Clone, Copy)]
pub(super) struct Assumed<'n> {
    pub(super) name: &'n str,
    pub(super) data_type: Option<DataType>,
    /// Whether the file is the configuration of one device: then `ParameterValue` is its value at power-on.
    pub(super) is_configured: bool,
}

/// Bytes that a DOMAIN takes. A data sheet does not say how many a device has room for.
const DOMAIN_LENGTH: usize = 4096;
/// What stands in a section of an object or entry, in lower case.
const KEYS: [&str; 15] = [
    "parametername",
    "objecttype",
    "datatype",
    "accesstype",
    "lowlimit",
    "highlimit",
    "defaultvalue",
    "pdomapping",
    "objflags",
    "subnumber",
    "compactsubobj",
    "parametervalue",
    "denotation",
    "uploadfile",
    "downloadfile",
];

/// Reads the entry `sub` that `section` describes.
pub(super) fn read(sub: u8, section: &Section<'_>, assumed: Assumed<'_>, report: &mut Report) -> Draft {
    check_keys(section, report);
    let name = name(section, assumed.name, report);
    let data_type = data_type(section, assumed.data_type, report);
    let (access, mappable) = access(section, data_type, report);
    let mut entry = Entry::new(sub, name, data_type, access);
    entry.mappable = mappable;
    entry.range = value::range(data_type, section, report);
    let mut keys = ["parametervalue", "defaultvalue"];
    if !assumed.is_configured {
        keys.reverse();
    }
    let given = keys.into_iter().filter_map(|key| section.get(key));
    let mut given =
        given.filter_map(|text| Some((value::initial(data_type, text, report)?, text.span.clone())));
    let given = given.next();
    let value = given.map(|(initial, span)| {
        entry.initial = initial;
        span
    });
    if data_type == DataType::Domain {
        entry.max_length = DOMAIN_LENGTH;
    }
    let mut draft = Draft { entry, span: section.span.clone(), value };
    draft.make_consistent(report);
    draft
}

impl Draft {
    /// An entry that the file does not describe.
    pub(super) fn supplied(entry: Entry, span: &Span) -> Self {
        Self { entry, span: span.clone(), value: None }
    }

    /// Gives the entry another value, which is one of the file.
    pub(super) fn set(&mut self, text: &Text<'_>, report: &mut Report) {
        if let Some(initial) = value::initial(self.entry.data_type, text, report) {
            self.entry.initial = initial;
            self.value = Some(text.span.clone());
            self.make_consistent(report);
        }
    }

    /// Where the value stands, or the entry if it is not given.
    pub(super) fn place(&self) -> &Span {
        self.value.as_ref().unwrap_or(&self.span)
    }

    /// The value of an integer, without the Node-ID.
    pub(super) fn number(&self) -> u64 {
        match &self.entry.initial {
            Initial::Value(value) => value.raw(),
            Initial::PlusNodeId(base) => u64::from(*base),
        }
    }

    /// Makes room for the value: within the limits, and in length. Where none is given, the limits have one.
    fn make_consistent(&mut self, report: &mut Report) {
        let place = self.place().clone();
        let Entry { data_type, range, initial, max_length, .. } = &mut self.entry;
        match initial {
            Initial::Value(Value::Bytes(bytes)) => *max_length = bytes.len().max(*max_length),
            Initial::Value(Value::Fixed(raw)) => {
                let Some(outside) = range.filter(|range| !contains(*range, *data_type, *raw)) else { return };
                if self.value.is_none() {
                    *initial = Initial::Value(nearest_to_zero(outside, *data_type));
                } else {
                    *range = None;
                    report.warn(&place, "the value does not lie within the limits, which are left out", None);
                }
            }
            Initial::PlusNodeId(_) => {}
        }
    }
}

/// The value within the limits that is nearest to zero.
fn nearest_to_zero(range: Range, data_type: DataType) -> Value {
    let value = match range {
        Range::Integer { min, max } => Value::integer(data_type, 0.clamp(min, max)),
        Range::Real { min, max } => Value::real(data_type, 0.0_f64.clamp(min, max)),
    };
    value.unwrap_or_else(|| Value::zero(data_type))
}

fn contains(range: Range, data_type: DataType, raw: u64) -> bool {
    match range {
        Range::Integer { min, max } => (min..=max).contains(&data_type.integer(raw)),
        Range::Real { min, max } => {
            Value::as_real(data_type, raw).is_some_and(|value| (min..=max).contains(&value))
        }
    }
}

/// Reports keys that are most likely misspelt. Others are a vendor's own.
pub(super) fn check_keys(section: &Section<'_>, report: &mut Report) {
    for (key, text) in section.iter().filter(|(key, _)| !KEYS.contains(key)) {
        if let Some(near) = nearest(key, &KEYS) {
            let (written, span) = &text.key;
            report.warn(
                span,
                format!("unknown key `{written}` is ignored"),
                format!("did you mean `{near}`?"),
            );
        }
    }
}

/// The name of an entry or object: the one that a configuration gives it, else that of the device.
pub(super) fn name(section: &Section<'_>, assumed: &str, report: &mut Report) -> String {
    let given = section.get("denotation").or_else(|| section.get("parametername"));
    if given.is_none() {
        let message = format!("[{}] has no `ParameterName` and is called `{assumed}`", section.name);
        report.warn(&section.span, message, None);
    }
    given.map_or(assumed, |text| text.text).to_owned()
}

/// The type of an entry. One of unknown size is a DOMAIN, so that it takes and gives what it is given.
fn data_type(section: &Section<'_>, assumed: Option<DataType>, report: &mut Report) -> DataType {
    let is_domain =
        section.get("objecttype").and_then(|text| number::plain(text.text)).is_some_and(|n| n.value == 2);
    let assumed = assumed.or(is_domain.then_some(DataType::Domain));
    let Some(text) = section.get("datatype") else {
        let (stands_in, remark) = assumed.map_or((DataType::Domain, "no type is known"), |t| (t, ""));
        if !is_domain {
            let message = format!("[{}] has no `DataType`: {stands_in} stands in", section.name);
            let help = (!remark.is_empty()).then(|| remark.to_owned());
            report.warn(&section.span, message, help);
        }
        return stands_in;
    };
    let code = number::plain(text.text).and_then(|number| u16::try_from(number.value).ok());
    let known = code.and_then(DataType::from_code).or_else(|| DataType::from_name(&text.text.to_uppercase()));
    known.unwrap_or_else(|| {
        let stands_in = assumed.unwrap_or(DataType::Domain);
        let message = format!("`{}` is no basic data type: {stands_in} stands in", text.text);
        report.warn(&text.span, message, "basic types are 0x0001 to 0x001B".to_owned());
        stands_in
    })
}

/// `AccessType` and `PDOMapping`. With `rwr` and `rww` an entry goes into PDOs of one direction.
fn access(section: &Section<'_>, data_type: DataType, report: &mut Report) -> (Access, Mappable) {
    use Access::{Const, ReadOnly, ReadWrite, WriteOnly};
    let is_mappable = is_mappable(section, data_type, report);
    let word = section.get("accesstype").map(|text| text.text.to_ascii_lowercase());
    let (access, mappable) = match word.as_deref() {
        Some("ro") => (ReadOnly, Mappable::Transmit),
        Some("wo") => (WriteOnly, Mappable::Receive),
        Some("rw") => (ReadWrite, Mappable::Both),
        Some("rwr") => (ReadWrite, Mappable::Transmit),
        Some("rww") => (ReadWrite, Mappable::Receive),
        Some("const") => (Const, Mappable::Transmit),
        Some(_) | None => {
            let text = section.get("accesstype");
            let message = text.map_or_else(
                || format!("[{}] has no `AccessType`: rw stands in", section.name),
                |text| format!("`{}` is no access type: rw stands in", text.text),
            );
            let place = text.map_or(&section.span, |text| &text.span);
            report.warn(place, message, "write ro, wo, rw, rwr, rww or const".to_owned());
            (ReadWrite, Mappable::Both)
        }
    };
    (access, if is_mappable { mappable } else { Mappable::No })
}

fn is_mappable(section: &Section<'_>, data_type: DataType, report: &mut Report) -> bool {
    let Some(text) = section.get("pdomapping") else { return false };
    let number = number::plain(text.text).map(|number| number.value);
    let word = |word: &str| text.text.eq_ignore_ascii_case(word);
    let is_mappable = match number {
        Some(number) => number != 0,
        None if word("true") || word("false") => word("true"),
        None => {
            report.warn(&text.span, format!("`PDOMapping`: `{}` is neither 0 nor 1", text.text), None);
            false
        }
    };
    let has_size = data_type.bits().is_some();
    if is_mappable && !has_size {
        report.warn(
            &text.span,
            format!("{data_type} has no fixed size and cannot be mapped into a PDO"),
            None,
        );
    }
    is_mappable && has_size
}
