//! Profiles that build on another one: `extends = "jvl-mac00-fc4"`.
//!
//! Everything that the file does not say itself is taken from the profile that it extends, which comes with the
//! program: keys but for name, description and product, and the objects and PDOs whose index or number the file does
//! not have. `without` lists the objects that it leaves out. What is taken counts as standing at `extends`.

use toml::Spanned;
use toml::de::{DeArray, DeString, DeTable, DeValue};

use super::reader::Document;
use crate::{Profile, Report, Span};

/// What every profile says for itself.
const OWN: [&str; 3] = ["name", "description", "product"];
/// Lists that are joined, and the key that tells their elements apart.
const LISTS: [(&str, &str); 3] = [("object", "index"), ("rpdo", "number"), ("tpdo", "number")];

/// Adds to `document` what it takes from the profile that it extends, if it extends one.
pub(super) fn extend(document: &mut Document<'_>, report: &mut Report) {
    let entries = document.entries_mut();
    let Some(extends) = entries.remove("extends") else { return };
    let name = extends.get_ref().as_str().unwrap_or_default();
    let Some(text) = Profile::text(name) else {
        return report.unknown(&extends.span(), "profile", name, Profile::names());
    };
    let Some(mut base) = Document::parse(text, report) else { return };
    extend(&mut base, report);
    let mut base = base.into_entries();
    leave_out(&mut base, entries, report);
    for (key, value) in base {
        inherit(entries, key.into_inner(), value, &extends.span());
    }
}

/// Takes the objects that `without` lists away from `base`.
fn leave_out(base: &mut DeTable<'_>, entries: &mut DeTable<'_>, report: &mut Report) {
    let Some(without) = entries.remove("without") else { return };
    let DeValue::Array(indices) = without.get_ref() else {
        let help = "write an array of indices, such as `[0x2100]`".to_owned();
        return report.error(&without.span(), "`without` is no array", help);
    };
    let Some(DeValue::Array(objects)) = base.get_mut("object").map(Spanned::get_mut) else { return };
    for index in indices {
        let wanted = number(index.get_ref());
        let before = objects.len();
        let kept = core::mem::replace(objects, DeArray::new())
            .into_iter()
            .filter(|object| wanted != id(object, "index"));
        *objects = kept.collect();
        if wanted.is_none() || objects.len() == before {
            report.error(&index.span(), "there is no such object to leave out", None);
        }
    }
}

/// Gives `entries` the `value` of the base, which counts as standing at `span`, as far as they have none.
fn inherit<'t>(entries: &mut DeTable<'t>, key: DeString<'t>, value: Spanned<DeValue<'t>>, span: &Span) {
    let list = LISTS.iter().find(|(list, _)| *list == key);
    // Whoever brings motors says which is the default.
    let is_own = OWN.contains(&&*key) || key == "default_motor" && entries.contains_key("motors");
    let own = entries.get_mut(&*key).map(Spanned::get_mut);
    match (own, moved(value, span).into_inner(), list) {
        (Some(DeValue::Array(own)), DeValue::Array(elements), Some((_, tag))) => {
            let taken: Vec<_> = own.iter().map(|element| id(element, tag)).collect();
            elements.into_iter().filter(|e| !taken.contains(&id(e, tag))).for_each(|e| own.push(e));
        }
        (None, value, _) if !is_own => {
            entries.insert(Spanned::new(span.clone(), key), Spanned::new(span.clone(), value));
        }
        (_, _, _) => {}
    }
}

/// What tells an element of a list apart.
fn id(element: &Spanned<DeValue<'_>>, tag: &str) -> Option<u64> {
    number(element.get_ref().as_table()?.get(tag)?.get_ref())
}

fn number(value: &DeValue<'_>) -> Option<u64> {
    let number = value.as_integer()?;
    u64::from_str_radix(number.as_str(), number.radix()).ok()
}

/// The same value as if all of it stood at `span`.
fn moved<'t>(value: Spanned<DeValue<'t>>, span: &Span) -> Spanned<DeValue<'t>> {
    let place = |value| Spanned::new(span.clone(), value);
    place(match value.into_inner() {
        DeValue::Array(elements) => {
            DeValue::Array(elements.into_iter().map(|element| moved(element, span)).collect::<DeArray<'_>>())
        }
        DeValue::Table(entries) => {
            let entry = |(key, value): (Spanned<DeString<'t>>, _)| {
                (Spanned::new(span.clone(), key.into_inner()), moved(value, span))
            };
            DeValue::Table(entries.into_iter().map(entry).collect())
        }
        scalar => scalar,
    })
}
