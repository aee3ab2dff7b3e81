//! The data sheets that we write are read back.

use std::collections::HashSet;

use od::{Address, DataType, Entry, Initial, ObjectKind, Range, Schema};
use profiles::Profile;

/// What a data sheet says of an entry. Some have no default that can be told.
#[derive(Debug, PartialEq)]
struct Told {
    name: String,
    data_type: DataType,
    access: od::Access,
    mappable: od::Mappable,
    range: Option<Range>,
    initial: Option<Initial>,
}

/// The sections of a sheet that give a default, by their names.
fn sections_with_default(sheet: &str) -> HashSet<&str> {
    let sections = sheet.split("\n[").filter(|section| section.contains("\nDefaultValue="));
    sections.filter_map(|section| section.split(']').next()).collect()
}

fn told(defaults: &HashSet<&str>, (address, entry): (Address, &Entry)) -> (Address, Told) {
    let Address { index, sub } = address;
    let names = [format!("{index:04X}"), format!("{index:04X}sub{sub:X}")];
    let has_default = names.iter().any(|name| defaults.contains(name.as_str()));
    let initial = has_default.then(|| entry.initial.clone());
    let Entry { name, data_type, access, mappable, range, .. } = entry.clone();
    (address, Told { name, data_type, access, mappable, range, initial })
}

fn is_shown((_, entry): &(Address, &Entry)) -> bool {
    !entry.is_local
}

fn entries(schema: &Schema, defaults: &HashSet<&str>) -> Vec<(Address, Told)> {
    schema.entries().filter(is_shown).map(|entry| told(defaults, entry)).collect()
}

fn objects(schema: &Schema) -> Vec<(u16, String, ObjectKind)> {
    let shown = schema.objects().filter(|(.., entries)| !entries.iter().any(|entry| entry.is_local));
    shown.map(|(index, name, kind, _)| (index, name.to_owned(), kind)).collect()
}

#[test]
fn the_data_sheet_of_every_shipped_profile_is_read_as_the_same_objects() {
    for name in Profile::names() {
        let shipped = Profile::embedded(name, None).unwrap().unwrap();
        let sheet = shipped.eds();
        let (read, findings) = Profile::from_data_sheet(&format!("{name}.eds"), sheet.as_bytes());
        let read = read.unwrap_or_else(|| panic!("{findings}"));
        let defaults = sections_with_default(&sheet);
        assert!(defaults.len() > 100);
        for (own, other) in
            [(&shipped.communication, &read.communication), (&shipped.application, &read.application)]
        {
            let (own_entries, other_entries) = (entries(own, &defaults), entries(other, &defaults));
            assert_eq!(own_entries.len(), other_entries.len());
            let both = own_entries.into_iter().zip(other_entries);
            let differing: Vec<_> = both.filter(|(own, other)| own != other).collect();
            assert!(differing.is_empty(), "{name}: {differing:#?}");
            assert_eq!(objects(own), objects(other), "{name}");
        }
        assert_eq!((read.rpdos, read.tpdos), (shipped.rpdos, shipped.tpdos));
        // Drives are told to be without an axis now. CiA 306 has no word for entries of which a PDO carries a part.
        let is_expected = |message: &str| {
            message.starts_with("this is a drive") || message.starts_with("a PDO carries the lower")
        };
        assert!(findings.0.iter().all(|finding| is_expected(&finding.message)), "{name}: {findings}");
    }
}
