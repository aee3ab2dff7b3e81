//! The object tables in `docs/objects` are what the profiles say. `UPDATE_DOCS=1` writes them anew.

use std::fmt::Write as _;
use std::path::Path;

use od::{Access, Address, DataType, Entry, Initial, Mappable, Range, Schema, Value};
use profiles::{Format, Profile, Register, RegisterList};

fn table(profile: &Profile) -> String {
    let mut text = format!(
        "# Objects of `{}`\n\n{}\n\nGenerated from the profile file. *Behaviour*: what is behind the entry. An empty \
         cell is a value that is stored and read back; *later* is stored until a coming version acts on it; a *register* \
         stands in the table of its list.\n\n\
         | Object | Name | Type | Access | PDO | Default | Range | Behaviour |\n|---|---|---|---|---|---|---|---|\n",
        profile.name, profile.description
    );
    for schema in [&profile.communication, &profile.application] {
        rows(&mut text, profile, schema);
    }
    text
}

fn rows(text: &mut String, profile: &Profile, schema: &Schema) {
    for (index, name, _, entries) in schema.objects() {
        let entries: Vec<&Entry> = entries.iter().filter(|entry| !entry.is_local).collect();
        if entries.len() > 1 {
            writeln!(text, "| **0x{index:04X}** | **{name}** | | | | | | |").unwrap();
        }
        for entry in entries {
            let address = Address::new(index, entry.sub);
            let (start, behind) = (default(address, entry), behaviour(profile, address));
            let (data_type, access, pdo) = (entry.data_type, entry.access.name(), pdo(entry));
            writeln!(
                text,
                "| {address} | {} | {data_type} | {access} | {pdo} | {start} | {} | {behind} |",
                entry.name,
                range(entry)
            )
            .unwrap();
        }
    }
}

fn pdo(entry: &Entry) -> String {
    let which = match entry.mappable {
        Mappable::No => "",
        Mappable::Receive => "RPDO",
        Mappable::Transmit => "TPDO",
        Mappable::Both => "both",
    };
    entry.part.map_or(which.to_owned(), |part| format!("{which}, also as {part}"))
}

fn default(address: Address, entry: &Entry) -> String {
    match &entry.initial {
        Initial::PlusNodeId(base) => format!("0x{base:X} + Node-ID"),
        Initial::Value(Value::Bytes(_)) if entry.data_type == DataType::Domain => {
            "this profile's EDS".to_owned()
        }
        Initial::Value(Value::Bytes(bytes)) if bytes.is_empty() => String::new(),
        Initial::Value(Value::Bytes(bytes)) => format!("\"{}\"", String::from_utf8_lossy(bytes)),
        Initial::Value(Value::Fixed(raw)) => match Value::as_real(entry.data_type, *raw) {
            Some(real) => real.to_string(),
            None => number(address, entry.data_type.integer(*raw)),
        },
    }
}

/// Communication parameters are identifiers and flags, everything else is a quantity.
fn number(address: Address, value: i128) -> String {
    if address.index < 0x2000 && value > 9 { format!("0x{value:X}") } else { value.to_string() }
}

fn range(entry: &Entry) -> String {
    match entry.range {
        None => String::new(),
        Some(Range::Integer { min, max }) => format!("{min} to {max}"),
        Some(Range::Real { min, max }) => format!("{min} to {max}"),
    }
}

fn behaviour(profile: &Profile, address: Address) -> String {
    if let Some(bound) = profile.bindings.iter().find(|b| b.address == address) {
        return format!("`{}`", bound.binding);
    }
    if register_at(profile, address).is_some() {
        return "register".to_owned();
    }
    let later = profile.later.iter().find(|l| l.index == address.index && l.subs.contains(&address.sub));
    later.map_or(String::new(), |l| format!("*later*: {}", l.what))
}

/// The register that the entry at `address` holds.
fn register_at(profile: &Profile, address: Address) -> Option<&Register> {
    let lists = [&profile.motor_registers, &profile.module_registers].into_iter().flatten();
    lists.flat_map(|list| &list.registers).find(|register| register.place == Some(address))
}

fn assert_documented(name: &str, expected: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/objects");
    let path = folder.join(format!("{name}.md"));
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(&path, expected).unwrap();
    }
    let documented = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(documented == expected, "{} is out of date: run with UPDATE_DOCS=1", path.display());
}

#[test]
fn the_documented_objects_are_those_of_the_profiles() {
    for name in Profile::names() {
        let profile = Profile::embedded(name, None).unwrap().unwrap();
        assert_documented(name, &table(&profile));
    }
}

#[test]
fn every_table_is_of_a_profile_or_a_register_list_that_there_is() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/objects");
    let files =
        std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().file_name().into_string().unwrap());
    let mut files: Vec<String> = files.collect();
    files.sort_unstable();
    let lists = RegisterList::names().map(|name| format!("registers-{name}.md"));
    let mut expected: Vec<String> = Profile::names().map(|name| format!("{name}.md")).chain(lists).collect();
    expected.sort_unstable();
    assert_eq!(files, expected);
}

/// Each register list, with the profile and the motor that it is shown for.
const LISTS: [(&str, &str, &str); 4] = [
    ("mac050-141", "jvl-mac00-fc4", "mac140"),
    ("mac400-3000", "jvl-mac00-fc4", "mac800"),
    ("mis34x", "jvl-mis34x", "mis340"),
    ("module", "jvl-mac00-fc4", "mac140"),
];

fn register_table(list: &RegisterList, motor: &str) -> String {
    let mut text = format!(
        "# Registers `{}`\n\n{}. Defaults are those of a `{motor}`.\n\nGenerated from the register list. Every bus \
         carries a register as 32 bits; *Format* says which of them it has. Ranges are the manual's and not enforced. \
         *Place*: the entry that shows it; those of 0x2F11 and 0x2F13 are not on CANopen. *Kept*: whether saving stores \
         it. Numbers that are not listed read zero and ignore what is written.\n\n\
         | No. | Name | Format | Access | Default | Range | Unit | Place | Kept | Meaning |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
        list.name, list.description
    );
    for register in list.registers.iter().filter(|r| r.format != Format::Reserved) {
        let Register { number, name, format, access, unit, meaning, .. } = register;
        let range = register.range.map_or(String::new(), |(min, max)| format!("{min} to {max}"));
        let place = register.place.map_or(String::new(), |place| place.to_string());
        let is_kept = *access == Access::ReadWrite && !register.is_volatile;
        let (format, access, kept) = (format.name(), access.name(), if is_kept { "yes" } else { "" });
        let start = initial(register);
        writeln!(
            text,
            "| {number} | {name} | {format} | {access} | {start} | {range} | {unit} | {place} | {kept} | {meaning} |"
        )
        .unwrap();
    }
    text
}

fn initial(register: &Register) -> String {
    match &register.initial {
        Initial::PlusNodeId(base) => format!("0x{base:X} + Node-ID"),
        Initial::Value(value) => match register.format {
            Format::U16 | Format::U32 => value.raw().to_string(),
            Format::I16 | Format::I32 | Format::HighWord | Format::Reserved => {
                DataType::Integer32.integer(value.raw()).to_string()
            }
        },
    }
}

#[test]
fn the_documented_registers_are_those_of_the_lists() {
    assert!(RegisterList::names().eq(LISTS.iter().map(|(name, ..)| *name)));
    for (name, profile, motor) in LISTS {
        let profile = Profile::embedded(profile, Some(motor)).unwrap().unwrap();
        let lists = [&profile.motor_registers, &profile.module_registers];
        let list = lists.into_iter().flatten().find(|list| list.name == name).unwrap();
        assert_documented(&format!("registers-{name}"), &register_table(list, motor));
    }
}

/// Objects that tell the master what the units are; no drive does anything with them.
const DESCRIPTIONS: [core::ops::RangeInclusive<u16>; 2] = [0x6089..=0x608E, 0x60A8..=0x60AB];

/// The index that the object has on the first axis.
fn of_first_axis(index: u16) -> u16 {
    index.checked_sub(0x6000).map_or(index, |place| 0x6000 + place % 0x800)
}

#[test]
fn every_writable_motion_object_is_bound_or_marked() {
    for name in Profile::names() {
        let profile = Profile::embedded(name, None).unwrap().unwrap();
        if profile.axes() == 0 {
            continue;
        }
        let silent: Vec<String> = profile
            .application
            .entries()
            .filter(|(_, entry)| matches!(entry.access, Access::ReadWrite | Access::WriteOnly))
            .filter(|(address, _)| behaviour(&profile, *address).is_empty())
            .filter(|(address, _)| {
                DESCRIPTIONS.iter().all(|range| !range.contains(&of_first_axis(address.index)))
            })
            .map(|(address, entry)| format!("{address} {}", entry.name))
            .collect();
        assert_eq!(silent, [""; 0], "{name}");
    }
}
