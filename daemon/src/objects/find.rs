//! From what somebody types to the entries that are meant: by number, `0x6040:00`, `6040` or `2012:0A`, all
//! hexadecimal, or by name, `controlword` or `identity object:serial number`.
//!
//! Names are compared without case, spaces and punctuation. A name may be cut short as long as it is the only one that
//! begins so.

use od::{Address, Entry, ObjectKind, Schema};
use thiserror::Error;

/// What was meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// The entries, in the order of their sub-indices: one, or with an object of several all of them.
    pub addresses: Vec<Address>,
    /// Whether a single entry was named.
    pub is_single: bool,
}

/// Why nothing was found, for a reader.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct NotFound(String);

/// Names told at most where several begin alike.
const MOST_NAMES: usize = 8;

/// An object in one of the areas.
type Candidate<'s> = (u16, &'s str, ObjectKind, &'s [Entry]);

/// What `text` names in `areas`.
///
/// # Errors
/// No object is called that, or several are.
pub fn find(areas: &[&Schema], text: &str) -> Result<Found, NotFound> {
    let (object, sub) = split(text);
    let candidate = match index(object) {
        Some(index) => {
            let found = objects(areas).find(|(number, ..)| *number == index);
            found.ok_or_else(|| NotFound(format!("there is no object 0x{index:04X}")))?
        }
        None => named(areas, object)?,
    };
    let (index, name, kind, entries) = candidate;
    let Some(sub) = sub else {
        let addresses = entries.iter().map(|entry| Address::new(index, entry.sub)).collect();
        return Ok(Found { addresses, is_single: kind == ObjectKind::Var });
    };
    let sub = match number(sub, 2) {
        Some(number) => u8::try_from(number).ok().filter(|sub| entries.iter().any(|e| e.sub == *sub)),
        None => Some(named_sub(name, entries, sub)?),
    };
    let sub =
        sub.ok_or_else(|| NotFound(format!("0x{index:04X} ({name}) has no sub-index {}", text_after(text))))?;
    Ok(Found { addresses: vec![Address::new(index, sub)], is_single: true })
}

/// The address in `text`, such as `0x6040:00` or `6040`.
#[must_use]
pub fn address(text: &str) -> Option<Address> {
    let (object, sub) = split(text);
    let sub = sub.map_or(Some(0), |sub| number(sub, 2).and_then(|sub| u8::try_from(sub).ok()))?;
    Some(Address::new(index(object)?, sub))
}

/// The object and what stands behind the first colon.
fn split(text: &str) -> (&str, Option<&str>) {
    match text.split_once(':') {
        Some((object, sub)) => (object.trim(), Some(sub.trim())),
        None => (text.trim(), None),
    }
}

fn text_after(text: &str) -> &str {
    split(text).1.unwrap_or_default()
}

fn index(text: &str) -> Option<u16> {
    let has_prefix = text.starts_with("0x") || text.starts_with("0X");
    let number = number(text, 4)?;
    (has_prefix || text.len() == 4).then(|| u16::try_from(number).ok()).flatten()
}

/// A hexadecimal number of at most `digits` digits, with or without `0x`.
fn number(text: &str, digits: usize) -> Option<u32> {
    let text = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")).unwrap_or(text);
    let is_number = (1..=digits).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(text, 16).ok().filter(|_| is_number)
}

fn objects<'s>(areas: &[&'s Schema]) -> impl Iterator<Item = Candidate<'s>> {
    areas.iter().flat_map(|area| area.objects())
}

/// The letters and digits of a name.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

fn named<'s>(areas: &[&'s Schema], name: &str) -> Result<Candidate<'s>, NotFound> {
    let names: Vec<_> = objects(areas).map(|candidate| (plain(candidate.1), candidate)).collect();
    let told = |(index, name, ..): &Candidate<'_>| format!("0x{index:04X} ({name})");
    choose(&names, name, "object", told)
}

fn named_sub(object: &str, entries: &[Entry], name: &str) -> Result<u8, NotFound> {
    let names: Vec<_> = entries.iter().map(|entry| (plain(&entry.name), entry.sub)).collect();
    let told = |sub: &u8| {
        let entry = entries.iter().find(|entry| entry.sub == *sub);
        format!("{sub:02X} ({})", entry.map_or("", |entry| entry.name.as_str()))
    };
    choose(&names, name, &format!("entry of {object}"), told)
}

/// The one of `names` that `wanted` is, or the only one that begins with it.
fn choose<T: Clone>(
    names: &[(String, T)],
    wanted: &str,
    what: &str,
    told: impl Fn(&T) -> String,
) -> Result<T, NotFound> {
    let plain = plain(wanted);
    let list = |all: &[&T]| {
        let more = if all.len() > MOST_NAMES { ", ..." } else { "" };
        format!("{}{more}", all.iter().take(MOST_NAMES).map(|t| told(t)).collect::<Vec<_>>().join(", "))
    };
    let matching = |fits: &dyn Fn(&str) -> bool| -> Vec<&T> {
        names.iter().filter(|(name, _)| !plain.is_empty() && fits(name)).map(|(_, t)| t).collect()
    };
    let exact = matching(&|name| name == plain);
    let begun = matching(&|name| name.starts_with(&plain));
    match (&*exact, &*begun) {
        ([one], _) | ([], [one]) => return Ok((*one).clone()),
        ([], []) => {}
        ([], several) | (several, _) => {
            return Err(NotFound(format!("several begin with `{wanted}`: {}", list(several))));
        }
    }
    let inside = matching(&|name| name.contains(&plain));
    if !inside.is_empty() {
        return Err(NotFound(format!("no {what} `{wanted}`; did you mean {}?", list(&inside))));
    }
    let nearest = names.iter().min_by_key(|(name, _)| distance(&plain, name));
    let nearest = nearest.filter(|(name, _)| distance(&plain, name) <= (plain.len() / 3).max(1));
    let help = nearest.map(|(_, t)| format!("; did you mean {}?", told(t))).unwrap_or_default();
    Err(NotFound(format!("no {what} `{wanted}`{help}")))
}

/// How many letters must be inserted, removed or replaced to turn one word into the beginning of the other.
fn distance(from: &str, to: &str) -> usize {
    const LONGEST: usize = 64;
    let to: Vec<char> = to.chars().take(LONGEST).collect();
    let mut row: Vec<usize> = (0..=to.len()).collect();
    for (removed, a) in from.chars().take(LONGEST).enumerate() {
        let mut diagonal = removed;
        let mut left = removed + 1;
        for (place, b) in row.iter_mut().zip(core::iter::once(None).chain(to.iter().map(Some))) {
            let above = *place;
            *place = match b {
                None => left,
                Some(b) => (diagonal + usize::from(a != *b)).min(above + 1).min(left + 1),
            };
            diagonal = above;
            left = *place;
        }
    }
    row.into_iter().min().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use profiles::Profile;

    fn found(text: &str) -> Result<Vec<String>, String> {
        let profile = Profile::embedded("cia402-servo", None).unwrap().unwrap();
        let found = find(&[&profile.communication, &profile.application], text);
        found.map(|f| f.addresses.iter().map(ToString::to_string).collect()).map_err(|e| e.to_string())
    }

    fn one(address: &str) -> Result<Vec<String>, String> {
        Ok(vec![address.to_owned()])
    }

    #[test]
    fn numbers_are_hexadecimal_with_and_without_prefix() {
        for text in ["0x6040:00", "0x6040", "6040", "6040:0", "6040:00", "0X6040:0x00"] {
            assert_eq!(found(text), one("0x6040:00"), "{text}");
        }
        assert_eq!(found("1018:4"), one("0x1018:04"));
        assert_eq!(found("0x5555"), Err("there is no object 0x5555".to_owned()));
        assert_eq!(found("6040:1"), Err("0x6040 (Controlword) has no sub-index 1".to_owned()));
        assert_eq!(found("1018").unwrap().len(), 5);
    }

    #[test]
    fn names_go_without_case_and_punctuation_and_may_be_cut_short() {
        for text in ["Controlword", "control word", "CONTROL-WORD", "controlw"] {
            assert_eq!(found(text), one("0x6040:00"), "{text}");
        }
        assert_eq!(found("identity object:serial"), one("0x1018:04"));
        assert_eq!(found("identity:04"), one("0x1018:04"));
        assert_eq!(found("target position"), one("0x607A:00"));
    }

    #[test]
    fn what_is_missed_is_told_with_what_was_meant() {
        assert_eq!(
            found("contrlword"),
            Err("no object `contrlword`; did you mean 0x6040 (Controlword)?".to_owned())
        );
        let several = found("target").unwrap_err();
        assert!(
            several.starts_with("several begin with `target`: ") && several.contains("0x607A"),
            "{several}"
        );
        let inside = found("actual value").unwrap_err();
        assert!(inside.contains("did you mean ") && inside.contains("0x6064"), "{inside}");
        assert_eq!(found("zzzzzzzzz"), Err("no object `zzzzzzzzz`".to_owned()));
        assert!(found("").is_err() && found(":").is_err() && found("::::").is_err());
    }
}
