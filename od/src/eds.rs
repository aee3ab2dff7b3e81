//! Writes the electronic data sheet (EDS; CiA 306-1 v1.4) of a kind of device, and the configuration (DCF) of one.

use core::fmt::{Result, Write as _};

use crate::sheet::{Area, BIT_RATES, DATE, DUMMIES, Shown, default, line};
use crate::{Access, Address, Configuration, Entry, Mappable, ObjectKind, Range, Sheet};

/// The sheet as a file of text.
#[must_use]
pub fn write(sheet: &Sheet<'_>) -> String {
    let mut text = String::new();
    // Writing into a String cannot fail.
    let _ = write_sheet(&mut text, sheet);
    text
}

fn write_sheet(out: &mut String, sheet: &Sheet<'_>) -> Result {
    write_file(out, sheet)?;
    write_device(out, sheet)?;
    if let Some(configuration) = sheet.configuration {
        write_commissioning(out, configuration)?;
    }
    writeln!(out, "[DummyUsage]")?;
    for index in DUMMIES {
        writeln!(out, "Dummy{index:04X}=1")?;
    }
    writeln!(out, "\n[Comments]\nLines=0\n")?;
    let objects = sheet.objects();
    let lists = [
        ("MandatoryObjects", Area::Mandatory),
        ("OptionalObjects", Area::Optional),
        ("ManufacturerObjects", Area::Manufacturer),
    ];
    for (section, area) in lists {
        let indices = objects.iter().map(|(index, ..)| *index).filter(|index| Area::of(*index) == area);
        write_list(out, section, &indices.collect::<Vec<_>>())?;
    }
    objects.into_iter().try_for_each(|object| write_object(out, sheet, object))
}

fn write_file(out: &mut String, Sheet { info, configuration, .. }: &Sheet<'_>) -> Result {
    let [year, month, day] = DATE;
    let ending = if configuration.is_some() { "dcf" } else { "eds" };
    writeln!(out, "[FileInfo]\nFileName={}.{ending}", line(&info.name))?;
    writeln!(out, "FileVersion=1\nFileRevision=0\nEDSVersion=4.0\nDescription={}", line(&info.product_name))?;
    writeln!(out, "CreationTime=12:00AM\nCreationDate={month:02}-{day:02}-{year}\nCreatedBy=axisd")?;
    if configuration.is_some() {
        writeln!(out, "LastEDS={}.eds", line(&info.name))?;
    }
    writeln!(out)
}

fn write_device(out: &mut String, sheet: &Sheet<'_>) -> Result {
    let info = sheet.info;
    writeln!(
        out,
        "[DeviceInfo]\nVendorName={}\nVendorNumber=0x{:08X}",
        line(&info.vendor_name),
        info.vendor_number
    )?;
    writeln!(out, "ProductName={}\nProductNumber=0x{:08X}", line(&info.product_name), info.product_number)?;
    writeln!(out, "RevisionNumber=0x{:08X}", info.revision_number)?;
    for rate in BIT_RATES {
        writeln!(out, "BaudRate_{rate}=1")?;
    }
    writeln!(out, "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity=1\nDynamicChannelsSupported=0")?;
    writeln!(out, "GroupMessaging={}", u8::from(sheet.is_multiplexing()))?;
    writeln!(out, "NrOfRXPDO={}\nNrOfTXPDO={}\nLSS_Supported=1\n", info.rpdos, info.tpdos)
}

/// The section has lacked a letter since the first version of CiA 306.
fn write_commissioning(out: &mut String, configuration: &Configuration) -> Result {
    let Configuration { node_id, node_name, bit_rate, network, network_name, serial_number, .. } =
        configuration;
    writeln!(out, "[DeviceComissioning]\nNodeID=0x{node_id:X}\nNodeName={}", line(node_name))?;
    if let Some(bit_rate) = bit_rate {
        writeln!(out, "Baudrate={bit_rate}")?;
    }
    writeln!(out, "NetNumber={network}\nNetworkName={}\nCANopenManager=0", line(network_name))?;
    writeln!(out, "LSS_SerialNumber=0x{serial_number:08X}\n")
}

fn write_list(out: &mut String, section: &str, indices: &[u16]) -> Result {
    writeln!(out, "[{section}]\nSupportedObjects={}", indices.len())?;
    for (number, index) in indices.iter().enumerate() {
        writeln!(out, "{}=0x{index:04X}", number + 1)?;
    }
    writeln!(out)
}

fn write_object(out: &mut String, sheet: &Sheet<'_>, (index, name, kind, entries): Shown<'_>) -> Result {
    writeln!(out, "[{index:04X}]\nParameterName={}", line(name))?;
    match kind {
        ObjectKind::Var => {
            writeln!(out, "ObjectType=0x7")?;
            return entries.first().map_or(Ok(()), |entry| write_entry(out, sheet, index, entry));
        }
        ObjectKind::Array => writeln!(out, "ObjectType=0x8")?,
        ObjectKind::Record => writeln!(out, "ObjectType=0x9")?,
    }
    writeln!(out, "SubNumber={}\n", entries.len())?;
    entries.iter().try_for_each(|entry| {
        let (sub, name) = (entry.sub, line(&entry.name));
        writeln!(out, "[{index:04X}sub{sub:X}]\nParameterName={name}\nObjectType=0x7")?;
        write_entry(out, sheet, index, entry)
    })
}

fn write_entry(out: &mut String, sheet: &Sheet<'_>, index: u16, entry: &Entry) -> Result {
    let address = Address::new(index, entry.sub);
    writeln!(out, "DataType=0x{:04X}\nAccessType={}", entry.data_type as u16, access_type(entry))?;
    if let Some(value) = default(address, entry) {
        writeln!(out, "DefaultValue={value}")?;
    }
    match entry.range {
        Some(Range::Integer { min, max }) => writeln!(out, "LowLimit={min}\nHighLimit={max}")?,
        Some(Range::Real { min, max }) => {
            for (key, limit) in
                [("LowLimit", min), ("HighLimit", max)].iter().filter(|(_, limit)| limit.is_finite())
            {
                writeln!(out, "{key}={limit}")?;
            }
        }
        None => {}
    }
    if let Some(value) = sheet.configured(address, entry.data_type) {
        writeln!(out, "ParameterValue={value}")?;
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
