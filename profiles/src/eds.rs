//! Reads an electronic data sheet (EDS) or device configuration file (DCF) as a device profile (CiA 306-1 v1.4).
//!
//! Files of vendors are often broken. Whatever can be served is served, and every place where that takes a guess is a
//! warning with its line. What would only look different to another reader (letter case, spaces, quotes) is not.
//!
//! - `text` makes characters of bytes, `ini` sections of lines, `name`, `number` and `value` know what stands in them.
//! - `object` and `entry` make drafts of objects, whether or not the lists (`lists`) have them.
//! - `communication` and `pdo` see to it that a node can work with what is below 0x2000.

mod communication;
mod device;
mod entry;
mod ini;
mod lists;
mod name;
mod number;
mod object;
mod pdo;
mod text;
mod value;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use od::{Address, Object, Schema, SchemaError};

use crate::{Diagnostics, Dialect, Profile, RegisterFile, Report, Span};
use device::Sheet;
use ini::{Ini, Section};
use object::Objects;

/// Longest file that is read, in bytes: ten times the largest that vendors are known to have.
const LONGEST: usize = 8 << 20;
/// Objects below this index belong to the bus (CiA 301 v4.2, table 40).
const FIRST_OF_APPLICATION: u16 = 0x2000;

/// See [`Profile::from_data_sheet`].
pub(crate) fn read(file: &str, bytes: &[u8]) -> (Option<Profile>, Diagnostics) {
    let mut report = Report::default();
    if bytes.len() > LONGEST {
        report.error(&(0..0), format!("the file is longer than {LONGEST} bytes"), None);
        return report.judge(file, "", None);
    }
    let text = text::decode(bytes, &mut report);
    let ini = Ini::parse(&text, &mut report);
    let profile = profile(file, &ini, &mut report);
    report.judge(file, &text, profile)
}

fn profile(file: &str, ini: &Ini<'_>, report: &mut Report) -> Option<Profile> {
    let is_configured = is_configured(file, ini);
    if !is_configured {
        report_values(ini, report);
    }
    let mut objects = object::read_all(ini, is_configured, report);
    if objects.is_empty() {
        let help = "an EDS describes objects in sections such as [1000]".to_owned();
        report.error(&(0..0), "the file describes no object", help);
        return None;
    }
    let sheet = Sheet::read(ini, report);
    let described: BTreeSet<u16> = ini.iter().filter_map(|(name, _)| object_of(name)).collect();
    lists::check(ini, &objects, |index| described.contains(&index), report);
    check_pdo_numbers(&sheet, &objects, report);
    let kinds = [pdo::RECEIVE, pdo::TRANSMIT];
    kinds.iter().for_each(|kind| pdo::supply(*kind, &sheet, &mut objects));
    communication::mend(&mut objects, &sheet, report);
    kinds.iter().for_each(|kind| pdo::prepare(*kind, &mut objects, report));
    let application = objects.split_off(&FIRST_OF_APPLICATION);
    let application = schema(application, report)?;
    kinds.iter().for_each(|kind| pdo::check(*kind, &mut objects, &application, report));
    let [rpdos, tpdos] = kinds.map(|kind| pdo::number_of(kind, &objects));
    let communication = schema(objects, report)?;
    let name = Path::new(file)
        .file_stem()
        .map_or_else(|| file.to_owned(), |stem| stem.to_string_lossy().into_owned());
    let product = sheet.product.unwrap_or_else(|| name.clone());
    Some(Profile {
        description: sheet.description.unwrap_or_else(|| product.clone()),
        vendor: sheet.vendor.unwrap_or_default(),
        product,
        name,
        dialect: Dialect::default(),
        registers: Arc::new(RegisterFile::new(&application, None, None)),
        communication: Arc::new(communication),
        application: Arc::new(application),
        bindings: Vec::new(),
        later: Vec::new(),
        motor_registers: None,
        module_registers: None,
        pdos: Vec::new(),
        motor: None,
        motors: Vec::new(),
        rpdos,
        tpdos,
        commissioning: sheet.commissioning,
    })
}

/// Whether the file is the configuration of one device (DCF), by its name or by what it says.
fn is_configured(file: &str, ini: &Ini<'_>) -> bool {
    let ending = Path::new(file).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("dcf"));
    ending || device::commissioned(ini).is_some()
}

/// Reports the first value that belongs to one device, in a file that is about all of a kind.
fn report_values(ini: &Ini<'_>, report: &mut Report) {
    let both = |(_, section): (_, &Section<'_>)| {
        section.get("defaultvalue").and(section.get("parametervalue")).map(|text| text.key.1.clone())
    };
    if let Some(place) = ini.iter().find_map(both) {
        let message = "`ParameterValue` is of one device and has no meaning in an EDS: defaults hold";
        report.warn(&place, message, "call the file .dcf if it is the configuration of a device".to_owned());
    }
}

/// The object that the section with this name in lower case describes.
fn object_of(name: &str) -> Option<u16> {
    match name::of(name) {
        name::Name::Object(index) | name::Name::Entry(index, _) => Some(index),
        name::Name::Names(_) | name::Name::Values(_) | name::Name::General | name::Name::Unknown => None,
    }
}

/// Compares the numbers of PDOs in `[DeviceInfo]` with their records.
fn check_pdo_numbers(sheet: &Sheet, objects: &Objects, report: &mut Report) {
    let is_compact = sheet.compact_pdo.is_some_and(|mask| mask != 0);
    let said = [(pdo::RECEIVE, &sheet.rpdos, "NrOfRXPDO"), (pdo::TRANSMIT, &sheet.tpdos, "NrOfTXPDO")];
    for (kind, said, key) in said {
        let found = pdo::number_of(kind, objects);
        if let Some((said, place)) = said.as_ref().filter(|(said, _)| *said != found && !is_compact) {
            report.warn(place, format!("`{key}` is {said}, but {found} are described"), None);
        }
    }
}

/// The checked objects of one area.
fn schema(objects: Objects, report: &mut Report) -> Option<Schema> {
    let places = objects.iter().flat_map(|(index, object)| {
        object.entries.iter().map(|draft| (Address::new(*index, draft.entry.sub), draft.span.clone()))
    });
    let places: BTreeMap<Address, Span> = places.collect();
    let objects: Vec<Object> = objects.into_iter().map(|(index, object)| object.finish(index)).collect();
    // What is wrong with the file is mended before; what is left is said rather than hidden.
    let wrong = |errors: Vec<SchemaError>| {
        for error in errors {
            let place = places.get(&error.address).cloned().unwrap_or_default();
            report.error(&place, error.to_string(), None);
        }
    };
    Schema::new(objects).map_err(wrong).ok()
}
