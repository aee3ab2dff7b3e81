//! The register map of a device, for people and programs: `axisd registers` and the tables in `docs/modbus`.

use core::fmt::Write as _;

use modbus::{Dialect, Listed, Map};
use profiles::{Profile, Register, Space};

use crate::core::map;
use crate::status::table;

/// One entry and the registers that stand for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Address of the first register, as it stands on the wire.
    pub first: u16,
    /// Number of registers.
    pub count: u8,
    /// The object.
    pub object: String,
    /// Its type.
    pub data_type: &'static str,
    /// Access.
    pub access: &'static str,
    /// Its name, and which of JVL's registers it is.
    pub name: String,
}

/// Every entry that has registers, in their order. The word order changes nothing here.
#[must_use]
pub fn rows(profile: &Profile, dialect: Dialect) -> Vec<Row> {
    let map = map(profile, dialect, modbus::WordOrder::default());
    map.listing().filter_map(|listed| row(profile, listed)).collect()
}

fn row(profile: &Profile, Listed { first, count, slot }: Listed) -> Option<Row> {
    let schema = &profile.application;
    let (address, entry) = (schema.address(slot)?, schema.entry(slot)?);
    let object = schema.objects().find(|(index, ..)| *index == address.index);
    let name = match object {
        Some((_, name, _, [_, _, ..])) => format!("{name}: {}", entry.name),
        Some(_) | None => entry.name.clone(),
    };
    let name = match register(profile, first) {
        Some((space, register)) => format!("{space} register {}: {}", register.number, register.name),
        None => name,
    };
    Some(Row {
        first,
        count,
        object: address.to_string(),
        data_type: entry.data_type.name(),
        access: entry.access.name(),
        name,
    })
}

/// The register of JVL's that begins at this address.
fn register(profile: &Profile, address: u16) -> Option<(&'static str, &Register)> {
    match address {
        0..=0x1FF => Some(("motor", profile.register(Space::Motor, address / 2)?)),
        modbus::JVL_MODULE.. => {
            Some(("module", profile.register(Space::Module, (address - modbus::JVL_MODULE) / 2)?))
        }
        _ => None,
    }
}

/// The rows as columns for a terminal.
#[must_use]
pub fn text(profile: &Profile, dialect: Dialect) -> String {
    let line = |row: Row| {
        let Row { first, count, object, data_type, access, name } = row;
        let data_type = data_type.to_owned();
        [
            format!("0x{first:04X}"),
            first.to_string(),
            count.to_string(),
            object,
            data_type,
            access.to_owned(),
            name,
        ]
    };
    let rows: Vec<_> = rows(profile, dialect).into_iter().map(line).collect();
    table(&["ADDRESS", ">DECIMAL", ">REGISTERS", "OBJECT", "TYPE", "ACCESS", "NAME"], &rows)
}

/// The rows as a page of the documentation.
#[must_use]
pub fn page(profile: &Profile) -> String {
    let mut text = format!(
        "# Registers of `{}`\n\n{}\n\nGenerated from the profile file: what `axisd registers` prints. What the functions do \
         and how values lie in registers: [modbus](../modbus.md). Coils and discrete inputs are the bits of the digital \
         outputs and inputs.\n\n| Address | | Registers | Object | Type | Access | Name |\n|---|---|---|---|---|---|---|\n",
        profile.name, profile.description
    );
    for Row { first, count, object, data_type, access, name } in rows(profile, Dialect::Full) {
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "| 0x{first:04X} | {first} | {count} | {object} | {data_type} | {access} | {name} |"
        );
    }
    text
}

/// Whether a map of all registers of the profile leaves nothing out.
#[must_use]
pub fn is_complete(profile: &Profile) -> bool {
    let map: Map = map(profile, Dialect::Full, modbus::WordOrder::default());
    map.left_out() == 0
}
