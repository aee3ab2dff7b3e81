//! Writes the electronic data sheet (CiA 306-1 v1.4) of a device from its schemas.

use core::fmt::Write as _;

use crate::{Access, DataType, Entry, Initial, Mappable, ObjectKind, Range, Schema, Value};

/// What the sheet says about the device as a whole.
#[derive(Clone, Debug, Default)]
pub struct DeviceInfo {
    /// File name that the sheet is meant to have.
    pub file_name: String,
    /// Vendor in words.
    pub vendor_name: String,
    /// Vendor-ID, 0x1018:01.
    pub vendor_number: u32,
    /// Product in words.
    pub product_name: String,
    /// Product code, 0x1018:02.
    pub product_number: u32,
    /// Revision number, 0x1018:03.
    pub revision_number: u32,
    /// Number of RPDOs.
    pub rpdos: u16,
    /// Number of TPDOs.
    pub tpdos: u16,
}

/// The sheet of a device that shows the objects of all `schemas`; those that are not on CANopen are left out.
#[must_use]
pub fn write(info: &DeviceInfo, schemas: &[&Schema]) -> String {
    let mut sheet = String::new();
    // Writing into a String cannot fail.
    let _ = write_sheet(&mut sheet, info, schemas);
    sheet
}

/// Bit rates of CiA 301, in kbit/s; a virtual or SocketCAN link has whichever the interface has.
const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

fn write_sheet(out: &mut String, info: &DeviceInfo, schemas: &[&Schema]) -> core::fmt::Result {
    // Multiplexed PDOs, for which a device has lists (CiA 301 v4.2, section 7.2.2.4).
    let has_list = |schema: &&Schema| (0x1FA0..=0x1FFF).any(|index| schema.has_object(index));
    write_header(out, info, schemas.iter().any(has_list))?;
    let is_public = |entries: &[Entry]| !entries.iter().any(|entry| entry.is_local);
    let shown = schemas.iter().flat_map(|s| s.objects()).filter(|(.., entries)| is_public(entries));
    let mut objects: Vec<_> = shown.collect();
    objects.sort_by_key(|(index, ..)| *index);
    let is_mandatory = |index: &u16| matches!(index, 0x1000 | 0x1001 | 0x1018);
    let is_manufacturer = |index: &u16| (0x2000..0x6000).contains(index);
    let indices = || objects.iter().map(|(index, ..)| *index);
    let select = |wanted: &dyn Fn(&u16) -> bool| indices().filter(wanted).collect::<Vec<_>>();
    write_list(out, "MandatoryObjects", &select(&is_mandatory))?;
    write_list(out, "OptionalObjects", &select(&|i| !is_mandatory(i) && !is_manufacturer(i)))?;
    write_list(out, "ManufacturerObjects", &select(&is_manufacturer))?;
    objects
        .into_iter()
        .try_for_each(|(index, name, kind, entries)| write_object(out, index, name, kind, entries))
}

fn write_header(out: &mut String, info: &DeviceInfo, is_multiplexing: bool) -> core::fmt::Result {
    writeln!(out, "[FileInfo]\nFileName={}\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0", info.file_name)?;
    writeln!(out, "Description={}\nCreatedBy=axisd\n", info.product_name)?;
    writeln!(
        out,
        "[DeviceInfo]\nVendorName={}\nVendorNumber=0x{:08X}",
        info.vendor_name, info.vendor_number
    )?;
    writeln!(out, "ProductName={}\nProductNumber=0x{:08X}", info.product_name, info.product_number)?;
    writeln!(out, "RevisionNumber=0x{:08X}", info.revision_number)?;
    for rate in BIT_RATES {
        writeln!(out, "BaudRate_{rate}=1")?;
    }
    writeln!(out, "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity=1\nDynamicChannelsSupported=0")?;
    writeln!(out, "GroupMessaging={}", u8::from(is_multiplexing))?;
    writeln!(out, "NrOfRXPDO={}\nNrOfTXPDO={}\nLSS_Supported=1\n", info.rpdos, info.tpdos)?;
    writeln!(out, "[DummyUsage]")?;
    for index in 1..=7 {
        writeln!(out, "Dummy{index:04X}=1")?;
    }
    writeln!(out, "\n[Comments]\nLines=0\n")
}

fn write_list(out: &mut String, section: &str, indices: &[u16]) -> core::fmt::Result {
    writeln!(out, "[{section}]\nSupportedObjects={}", indices.len())?;
    for (number, index) in indices.iter().enumerate() {
        writeln!(out, "{}=0x{index:04X}", number + 1)?;
    }
    writeln!(out)
}

fn write_object(
    out: &mut String,
    index: u16,
    name: &str,
    kind: ObjectKind,
    entries: &[Entry],
) -> core::fmt::Result {
    writeln!(out, "[{index:04X}]\nParameterName={name}")?;
    match kind {
        ObjectKind::Var => {
            writeln!(out, "ObjectType=0x7")?;
            return entries.first().map_or(Ok(()), |entry| write_entry(out, entry));
        }
        ObjectKind::Array => writeln!(out, "ObjectType=0x8")?,
        ObjectKind::Record => writeln!(out, "ObjectType=0x9")?,
    }
    writeln!(out, "SubNumber={}\n", entries.len())?;
    entries.iter().try_for_each(|entry| {
        writeln!(out, "[{index:04X}sub{:X}]\nParameterName={}\nObjectType=0x7", entry.sub, entry.name)?;
        write_entry(out, entry)
    })
}

fn write_entry(out: &mut String, entry: &Entry) -> core::fmt::Result {
    writeln!(out, "DataType=0x{:04X}\nAccessType={}", entry.data_type as u16, access_type(entry))?;
    match &entry.initial {
        Initial::PlusNodeId(base) => writeln!(out, "DefaultValue=$NODEID+0x{base:X}")?,
        // A domain is too much for a line; 0x1021 holds this very sheet.
        Initial::Value(_) if entry.data_type == DataType::Domain => {}
        Initial::Value(value) => writeln!(out, "DefaultValue={}", value_text(entry.data_type, value))?,
    }
    if let Some(Range::Integer { min, max }) = entry.range {
        writeln!(out, "LowLimit={min}\nHighLimit={max}")?;
    }
    writeln!(out, "PDOMapping={}\n", u8::from(entry.mappable != Mappable::No))
}

/// CiA 306-1 tells readable and writable process data apart by the PDO they may stand in.
fn access_type(entry: &Entry) -> &'static str {
    match (entry.access, entry.mappable) {
        (Access::ReadWrite, Mappable::Receive) => "rww",
        (Access::ReadWrite, Mappable::Transmit) => "rwr",
        (access, _) => access.name(),
    }
}

fn value_text(data_type: DataType, value: &Value) -> String {
    match value {
        Value::Fixed(raw) => match Value::as_real(data_type, *raw) {
            Some(real) => real.to_string(),
            None if data_type.is_signed() => data_type.integer(*raw).to_string(),
            None => format!("0x{raw:X}"),
        },
        Value::Bytes(bytes) if data_type == DataType::VisibleString => {
            String::from_utf8_lossy(bytes).into_owned()
        }
        Value::Bytes(bytes) => bytes.iter().map(|b| format!("{b:02X}")).collect(),
    }
}
