//! Defaults that a single device has otherwise than its profile: which entry is meant, and whether it takes the value.

use std::sync::Arc;

use od::{
    AbortCode, Address, Bus, Data, DataType, Dictionary, Entry, Initial, ObjectKind, Origin, Range, Schema,
    Value, Write,
};

use crate::diagnostics::suggestion;
use crate::file::default;
use crate::file::reader::{Scalar, Spanned};
use crate::{Binding, Profile, Report, Span};

/// What asks for a default: nobody on a bus.
const LOCAL: Origin = Origin { bus: Bus::Local, link: 0, client: 0 };
/// Objects below this index belong to the bus (CiA 301 v4.2, table 40).
const FIRST_OF_APPLICATION: u16 = 0x2000;

/// A default that a device has of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OwnDefault {
    /// The entry.
    pub address: Address,
    /// Its power-on value where nothing is stored.
    pub initial: Initial,
}

/// Why a text names no entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoEntry {
    /// What is wrong.
    pub message: String,
    /// What would be right, if that can be said.
    pub help: Option<String>,
}

impl Profile {
    /// The entry that `text` names: by number, `0x6081:00` or `0x6081`, or by name, `Profile velocity` or
    /// `Software position limit:Max position limit`, without regard to case, spaces and punctuation.
    ///
    /// # Errors
    /// There is none, or there are several.
    pub fn entry_named(&self, text: &str) -> Result<Address, NoEntry> {
        let (object, sub) = match text.split_once(':') {
            Some((object, sub)) => (object.trim(), Some(sub.trim())),
            None => (text.trim(), None),
        };
        let (index, kind, entries) = self.object_named(object)?;
        let Some(sub) = sub else {
            if kind == ObjectKind::Var {
                return Ok(Address::new(index, 0));
            }
            let help = format!("add a colon and the sub-index, such as \"0x{index:04X}:01\"");
            return Err(NoEntry { message: format!("`{object}` has several entries"), help: Some(help) });
        };
        let number = hexadecimal(sub, 2).and_then(|number| u8::try_from(number).ok());
        let is_meant = |entry: &&Entry| match number {
            Some(number) => entry.sub == number,
            None => plain(&entry.name) == plain(sub),
        };
        let mut meant = entries.iter().filter(is_meant);
        match (meant.next(), meant.next()) {
            (Some(entry), None) => Ok(Address::new(index, entry.sub)),
            (Some(_), Some(_)) => {
                let help = "write its number".to_owned();
                Err(NoEntry { message: format!("several entries are called `{sub}`"), help: Some(help) })
            }
            (None, _) => Err(NoEntry {
                message: format!("0x{index:04X} has no entry `{sub}`"),
                help: suggestion(sub, entries.iter().map(|entry| entry.name.as_str())),
            }),
        }
    }

    fn object_named(&self, text: &str) -> Result<(u16, ObjectKind, &[Entry]), NoEntry> {
        let number = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X"));
        let number = number.and_then(|digits| hexadecimal(digits, 4));
        let objects = || self.communication.objects().chain(self.application.objects());
        let is_meant = |(index, name, ..): &(u16, &str, ObjectKind, &[Entry])| match number {
            Some(number) => u32::from(*index) == number,
            None => plain(name) == plain(text),
        };
        let mut meant = objects().filter(is_meant);
        match (meant.next(), meant.next()) {
            (Some((index, _, kind, entries)), None) => Ok((index, kind, entries)),
            (Some((one, ..)), Some((other, ..))) => Err(NoEntry {
                message: format!("several objects are called `{text}`"),
                help: Some(format!("write the index, such as 0x{one:04X} or 0x{other:04X}")),
            }),
            (None, _) => Err(NoEntry {
                message: format!("the profile {} has no object `{text}`", self.name),
                help: suggestion(text, objects().map(|(_, name, ..)| name)),
            }),
        }
    }

    /// What `binding` is bound to, one entry for each axis that has it.
    pub fn bound_to(&self, binding: Binding) -> impl Iterator<Item = Address> {
        self.bindings.iter().filter(move |bound| bound.binding == binding).map(|bound| bound.address)
    }

    /// The same profile with other defaults. Those that its entries do not take are reported and left out; of two for one
    /// entry the later one holds. The data sheet says so, too.
    #[must_use]
    pub fn with_defaults(
        mut self,
        wanted: &[(Address, Spanned<Scalar<'_>>)],
        report: &mut Report,
    ) -> (Self, Vec<OwnDefault>) {
        let mut own: Vec<OwnDefault> = Vec::new();
        for (address, value) in wanted {
            let Some(initial) = self.accepted(*address, value, report) else { continue };
            let schema = if address.index < FIRST_OF_APPLICATION {
                &mut self.communication
            } else {
                &mut self.application
            };
            Arc::make_mut(schema).set_default(*address, initial.clone());
            own.retain(|known| known.address != *address);
            own.push(OwnDefault { address: *address, initial });
        }
        own.sort_by_key(|own| own.address);
        (self.with_sheet(), own)
    }

    /// The default that `value` is for the entry at `address`; `None` if it takes none or not this one, which is
    /// reported.
    fn accepted(
        &self,
        address: Address,
        value: &Spanned<Scalar<'_>>,
        report: &mut Report,
    ) -> Option<Initial> {
        let schema =
            if address.index < FIRST_OF_APPLICATION { &self.communication } else { &self.application };
        let entry = schema.slot(address).and_then(|slot| schema.entry(slot))?;
        let named = format!("{address} ({})", entry.name);
        let help = if !entry.access.is_writable() {
            "only what a bus may write has a default of its own"
        } else if entry.is_volatile {
            "what is never stored has no default of its own"
        } else if self.bindings.iter().any(|b| b.address == address && b.binding == Binding::Controlword) {
            "a controlword is an order of the moment"
        } else {
            let initial = default::initial(entry.data_type, value, self.motor.as_ref(), report)?;
            let refusal = refusal(schema, address, &initial);
            let reported = refusal.map(|code| {
                let message = format!("{named} does not take this: {}", code.text());
                report.error(&value.span(), message, entry.range.map(bounds));
            });
            return reported.is_none().then_some(initial);
        };
        report_refused(&named, help, &value.span(), report);
        None
    }
}

fn report_refused(named: &str, help: &str, span: &Span, report: &mut Report) {
    report.error(span, format!("{named} takes no default from here"), help.to_owned());
}

/// Why the write gate would not let `initial` in.
fn refusal(schema: &Arc<Schema>, address: Address, initial: &Initial) -> Option<AbortCode> {
    let Initial::Value(value) = initial else {
        let slot = schema.slot(address)?;
        let is_wide = schema.entry(slot)?.data_type == DataType::Unsigned32;
        return (!is_wide).then_some(AbortCode::LengthMismatch);
    };
    let data = match value {
        Value::Fixed(raw) => Data::Raw(*raw),
        Value::Bytes(bytes) => Data::Bytes(bytes),
    };
    let slot = schema.slot(address)?;
    Dictionary::new(Arc::clone(schema), 0).check(LOCAL, &Write { slot, data }).err()
}

fn bounds(range: Range) -> String {
    match range {
        Range::Integer { min, max } => format!("write an integer from {min} to {max}"),
        Range::Real { min, max } => format!("write a number from {min} to {max}"),
    }
}

fn hexadecimal(text: &str, digits: usize) -> Option<u32> {
    let text = text.strip_prefix("0x").unwrap_or(text);
    let is_number = (1..=digits).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(text, 16).ok().filter(|_| is_number)
}

/// The letters and digits of a name.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(text: &str) -> Result<String, NoEntry> {
        let profile = Profile::embedded("cia402-servo", None).unwrap().unwrap();
        profile.entry_named(text).map(|address| address.to_string())
    }

    #[test]
    fn an_entry_is_named_by_number_or_name() {
        for text in
            ["0x6081:00", "0x6081", "0X6081:0", "Profile velocity", "profile-velocity", "PROFILEVELOCITY:00"]
        {
            assert_eq!(named(text).as_deref(), Ok("0x6081:00"), "{text}");
        }
        assert_eq!(named("Software position limit:Max position limit").as_deref(), Ok("0x607D:02"));
        assert_eq!(named("0x607D:2").as_deref(), Ok("0x607D:02"));
    }

    #[test]
    fn what_names_none_says_what_would_be_right() {
        let wrong = |text| named(text).unwrap_err();
        assert_eq!(wrong("0x607D").help.unwrap(), "add a colon and the sub-index, such as \"0x607D:01\"");
        assert_eq!(wrong("Profile velocty").help.unwrap(), "did you mean `Profile velocity`?");
        assert_eq!(wrong("0x5555").message, "the profile cia402-servo has no object `0x5555`");
        assert_eq!(wrong("0x6081:01").message, "0x6081 has no entry `01`");
        assert!(named("").is_err() && named(":").is_err() && named("0x:0x").is_err());
    }
}
