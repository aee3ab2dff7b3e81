//! The lists of objects: what stands in them and what is described should be the same (CiA 306-1 v1.4, section 6).

use std::collections::BTreeMap;

use super::ini::{Ini, Section};
use super::number;
use super::object::Objects;
use crate::{Report, Span};

const LISTS: [&str; 3] = ["mandatoryobjects", "optionalobjects", "manufacturerobjects"];

/// Reports objects that are listed and not described, and the other way round; the latter are served.
pub(super) fn check(ini: &Ini<'_>, objects: &Objects, described: impl Fn(u16) -> bool, report: &mut Report) {
    let lists: Vec<_> = LISTS.iter().filter_map(|list| ini.get(list)).collect();
    if lists.is_empty() {
        return report.warn(
            &(0..0),
            "there are no lists of objects: all that are described are served",
            None,
        );
    }
    let mut listed = BTreeMap::new();
    for list in lists {
        read(list, &mut listed, report);
    }
    for (index, place) in listed.iter().filter(|(index, _)| !described(**index)) {
        report.warn(place, format!("0x{index:04X} is listed, but not described"), None);
    }
    for (index, object) in objects.iter().filter(|(index, _)| !listed.contains_key(index)) {
        report.warn(&object.span, format!("0x{index:04X} stands in no list of objects, but is served"), None);
    }
}

fn read(list: &Section<'_>, listed: &mut BTreeMap<u16, Span>, report: &mut Report) {
    let mut found = 0;
    for (key, text) in list.iter().filter(|(key, _)| *key != "supportedobjects") {
        if number::plain(key).is_none() {
            let message = format!("`{}` is no number of an object in a list", text.key.0);
            report.warn(&text.key.1, message, None);
            continue;
        }
        found += 1;
        match number::plain(text.text).and_then(|number| u16::try_from(number.value).ok()) {
            Some(index) => drop(listed.insert(index, text.span.clone())),
            None => report.warn(&text.span, format!("`{}` is no index of an object", text.text), None),
        }
    }
    let count = list.get("supportedobjects");
    let number = count.and_then(|text| number::plain(text.text)).map(|number| number.value);
    if number != Some(found) {
        let said = count.map_or("missing", |text| text.text);
        let place = count.map_or(&list.span, |text| &text.span);
        let message = format!("`SupportedObjects` is {said}, but [{}] has {found} objects", list.name);
        report.warn(place, message, None);
    }
}
