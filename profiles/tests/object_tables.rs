//! The object tables in `docs/objects` are what the profiles say. `UPDATE_DOCS=1` writes them anew.

use std::fmt::Write as _;
use std::path::Path;

use od::{Access, Address, DataType, Entry, Initial, Mappable, Range, Schema, Value};
use profiles::{Profile, Register};

fn table(profile: &Profile) -> String {
    let mut text = format!(
        "# Objects of `{}`\n\n{}\n\nGenerated from the profile file. *Behaviour*: what is behind the entry. An empty \
         cell is a value that is stored and read back; *later* is stored until a coming version acts on it.\n\n\
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
        let entries: Vec<&Entry> = entries.iter().collect();
        if entries.len() > 1 {
            writeln!(text, "| **0x{index:04X}** | **{name}** | | | | | | |").unwrap();
        }
        for entry in entries {
            let address = Address::new(index, entry.sub);
            let (start, behind) = (default(address, entry), behaviour(profile, address));
            let (data_type, access, pdo) = (entry.data_type, entry.access.name(), pdo(entry.mappable));
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

fn pdo(mappable: Mappable) -> &'static str {
    match mappable {
        Mappable::No => "",
        Mappable::Receive => "RPDO",
        Mappable::Transmit => "TPDO",
        Mappable::Both => "both",
    }
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
    if let Some(register) = register_at(profile, address) {
        let role = register.role.map_or(String::new(), |role| format!(" `{role}`"));
        return format!("{} register{role}", register.format.name());
    }
    let later = profile.later.iter().find(|l| l.index == address.index && l.subs.contains(&address.sub));
    later.map_or(String::new(), |l| format!("*later*: {}", l.what))
}

/// The register that the entry at `address` holds.
fn register_at(profile: &Profile, address: Address) -> Option<&Register> {
    let lists = [&profile.motor_registers, &profile.module_registers].into_iter().flatten();
    lists.flat_map(|list| &list.registers).find(|register| register.place == Some(address))
}

#[test]
fn the_documented_objects_are_those_of_the_profiles() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/objects");
    for name in Profile::names() {
        let profile = Profile::embedded(name, None).unwrap().unwrap();
        let (path, expected) = (folder.join(format!("{name}.md")), table(&profile));
        if std::env::var_os("UPDATE_DOCS").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &expected).unwrap();
        }
        let documented = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(documented == expected, "{} is out of date: run with UPDATE_DOCS=1", path.display());
    }
}

/// Objects that tell the master what the units are; no drive does anything with them.
const DESCRIPTIONS: [core::ops::RangeInclusive<u16>; 2] = [0x6089..=0x608E, 0x60A8..=0x60AB];

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
            .filter(|(address, _)| DESCRIPTIONS.iter().all(|range| !range.contains(&address.index)))
            .map(|(address, entry)| format!("{address} {}", entry.name))
            .collect();
        assert_eq!(silent, [""; 0], "{name}");
    }
}
