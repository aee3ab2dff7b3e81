//! Writes the device description in XML (XDD; CiA 311 v1.1, a profile of ISO 15745-1) of a kind of device, and the
//! configuration (XDC) of one.
//!
//! Elements that the schema declares for themselves are in its namespace (`co:`), those within a type are in none.

use core::fmt::{Display, Result, Write as _};

use crate::sheet::{Area, BIT_RATES, DATE, DUMMIES, Shown, default};
use crate::{Address, Configuration, Entry, Mappable, ObjectKind, Range, Sheet};

/// The namespace of version 1.1 of the schema.
const NAMESPACE: &str = "http://www.canopen.org/xml/1.1";

/// The sheet as an XML document.
#[must_use]
pub fn write(sheet: &Sheet<'_>) -> String {
    let mut text = String::new();
    // Writing into a String cannot fail.
    let _ = write_container(&mut text, sheet);
    text
}

fn write_container(out: &mut String, sheet: &Sheet<'_>) -> Result {
    writeln!(out, "<?xml version=\"1.0\" encoding=\"utf-8\"?>")?;
    writeln!(
        out,
        "<ISO15745ProfileContainer xmlns=\"{NAMESPACE}\" xmlns:co=\"{NAMESPACE}\" \
         xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\">"
    )?;
    write_profile(out, sheet, "device", "Device", write_device)?;
    write_profile(out, sheet, "communication network", "CommunicationNetwork", write_network)?;
    writeln!(out, "</ISO15745ProfileContainer>")
}

fn write_profile(
    out: &mut String,
    sheet: &Sheet<'_>,
    words: &str,
    class: &str,
    body: fn(&mut String, &Sheet<'_>) -> Result,
) -> Result {
    let [year, month, day] = DATE;
    let ending = if sheet.configuration.is_some() { "xdc" } else { "xdd" };
    writeln!(out, " <ISO15745Profile>\n  <ProfileHeader xmlns=\"\">")?;
    writeln!(out, "   <ProfileIdentification>CANopen {words} profile</ProfileIdentification>")?;
    writeln!(out, "   <ProfileRevision>1.1</ProfileRevision>\n   <ProfileName/>\n   <ProfileSource/>")?;
    writeln!(out, "   <ProfileClassID>{class}</ProfileClassID>")?;
    writeln!(out, "   <ISO15745Reference>\n    <ISO15745Part>1</ISO15745Part>")?;
    writeln!(out, "    <ISO15745Edition>1</ISO15745Edition>")?;
    writeln!(out, "    <ProfileTechnology>CANopen</ProfileTechnology>\n   </ISO15745Reference>")?;
    writeln!(out, "  </ProfileHeader>")?;
    write!(
        out,
        "  <ProfileBody xmlns=\"\" xsi:type=\"co:ProfileBody_{class}_CANopen\" formatName=\"CANopen\""
    )?;
    attribute(out, "formatVersion", "1.0")?;
    attribute(out, "fileName", format_args!("{}.{ending}", sheet.info.name))?;
    attribute(out, "fileCreator", "axisd")?;
    attribute(out, "fileCreationDate", format_args!("{year:04}-{month:02}-{day:02}"))?;
    writeln!(out, " fileVersion=\"1\" supportedLanguages=\"en\">")?;
    body(out, sheet)?;
    writeln!(out, "  </ProfileBody>\n </ISO15745Profile>")
}

fn write_device(out: &mut String, Sheet { info, configuration, .. }: &Sheet<'_>) -> Result {
    writeln!(out, "   <co:DeviceIdentity>")?;
    element(out, "vendorName", &info.vendor_name)?;
    element(out, "vendorID", format_args!("0x{:08X}", info.vendor_number))?;
    element(out, "productName", &info.product_name)?;
    element(out, "productID", format_args!("0x{:08X}", info.product_number))?;
    let (major, minor) = (info.revision_number >> 16, info.revision_number & 0xFFFF);
    writeln!(out, "    <co:version versionType=\"FW\">{major}.{minor}</co:version>")?;
    if let Some(Configuration { node_name, .. }) = configuration {
        element(out, "instanceName", node_name)?;
    }
    writeln!(out, "   </co:DeviceIdentity>\n   <co:DeviceFunction>")?;
    writeln!(out, "    <co:capabilities>\n     <co:characteristicsList>\n      <co:characteristic>")?;
    writeln!(
        out,
        "       <co:characteristicName><label lang=\"en\">Product</label></co:characteristicName>"
    )?;
    write!(out, "       <co:characteristicContent><label lang=\"en\">")?;
    escaped(out, &info.product_name)?;
    writeln!(out, "</label></co:characteristicContent>\n      </co:characteristic>")?;
    writeln!(out, "     </co:characteristicsList>\n    </co:capabilities>\n   </co:DeviceFunction>")
}

fn element(out: &mut String, name: &str, content: impl Display) -> Result {
    write!(out, "    <co:{name}>")?;
    escaped(out, content)?;
    writeln!(out, "</co:{name}>")
}

fn write_network(out: &mut String, sheet: &Sheet<'_>) -> Result {
    writeln!(out, "   <ApplicationLayers>")?;
    write_objects(out, sheet)?;
    writeln!(out, "    <dummyUsage>")?;
    for index in DUMMIES {
        writeln!(out, "     <dummy entry=\"Dummy{index:04X}=1\"/>")?;
    }
    writeln!(out, "    </dummyUsage>\n   </ApplicationLayers>")?;
    writeln!(out, "   <TransportLayers>\n    <PhysicalLayer>\n     <baudRate>")?;
    for rate in BIT_RATES {
        writeln!(out, "      <supportedBaudRate value=\"{rate} Kbps\"/>")?;
    }
    writeln!(out, "     </baudRate>\n    </PhysicalLayer>\n   </TransportLayers>\n   <NetworkManagement>")?;
    write!(out, "    <CANopenGeneralFeatures groupMessaging=\"{}\"", sheet.is_multiplexing())?;
    write!(out, " dynamicChannels=\"0\" selfStartingDevice=\"false\" SDORequestingDevice=\"false\"")?;
    attribute(out, "granularity", 1)?;
    attribute(out, "nrOfRxPDO", sheet.info.rpdos)?;
    attribute(out, "nrOfTxPDO", sheet.info.tpdos)?;
    writeln!(out, " bootUpSlave=\"true\" layerSettingServiceSlave=\"true\"/>")?;
    writeln!(out, "    <CANopenMasterFeatures bootUpMaster=\"false\"/>")?;
    if let Some(configuration) = sheet.configuration {
        write_commissioning(out, configuration)?;
    }
    writeln!(out, "   </NetworkManagement>")
}

fn write_commissioning(out: &mut String, configuration: &Configuration) -> Result {
    let Configuration { node_id, node_name, bit_rate, network, network_name, .. } = configuration;
    write!(out, "    <deviceCommissioning NodeID=\"{node_id}\"")?;
    attribute(out, "nodeName", node_name)?;
    match bit_rate {
        Some(rate) => attribute(out, "actualBaudRate", format_args!("{rate} Kbps"))?,
        None => attribute(out, "actualBaudRate", "auto-baudRate")?,
    }
    attribute(out, "networkNumber", network)?;
    attribute(out, "networkName", network_name)?;
    writeln!(out, " CANopenManager=\"false\"/>")
}

fn write_objects(out: &mut String, sheet: &Sheet<'_>) -> Result {
    let objects = sheet.objects();
    let count = |area| objects.iter().filter(|(index, ..)| Area::of(*index) == area).count();
    write!(out, "    <co:CANopenObjectList")?;
    attribute(out, "mandatoryObjects", count(Area::Mandatory))?;
    attribute(out, "optionalObjects", count(Area::Optional))?;
    attribute(out, "manufacturerObjects", count(Area::Manufacturer))?;
    writeln!(out, ">")?;
    objects.into_iter().try_for_each(|object| write_object(out, sheet, object))?;
    writeln!(out, "    </co:CANopenObjectList>")
}

fn write_object(out: &mut String, sheet: &Sheet<'_>, (index, name, kind, entries): Shown<'_>) -> Result {
    write!(out, "     <CANopenObject index=\"{index:04X}\"")?;
    attribute(out, "name", name)?;
    let object_type = match kind {
        ObjectKind::Var => {
            attribute(out, "objectType", 7)?;
            entries.first().map_or(Ok(()), |entry| write_entry(out, sheet, index, entry))?;
            return writeln!(out, "/>");
        }
        ObjectKind::Array => 8,
        ObjectKind::Record => 9,
    };
    attribute(out, "objectType", object_type)?;
    attribute(out, "subNumber", entries.len())?;
    writeln!(out, ">")?;
    for entry in entries {
        write!(out, "      <CANopenSubObject subIndex=\"{:02X}\"", entry.sub)?;
        attribute(out, "name", &entry.name)?;
        attribute(out, "objectType", 7)?;
        write_entry(out, sheet, index, entry)?;
        writeln!(out, "/>")?;
    }
    writeln!(out, "     </CANopenObject>")
}

fn write_entry(out: &mut String, sheet: &Sheet<'_>, index: u16, entry: &Entry) -> Result {
    let address = Address::new(index, entry.sub);
    attribute(out, "dataType", format_args!("{:04X}", entry.data_type as u16))?;
    if let Some(Range::Integer { min, max }) = entry.range {
        attribute(out, "lowLimit", min)?;
        attribute(out, "highLimit", max)?;
    }
    attribute(out, "accessType", entry.access.name())?;
    if let Some(value) = default(address, entry) {
        attribute(out, "defaultValue", value)?;
    }
    if let Some(value) = sheet.configured(address, entry.data_type) {
        attribute(out, "actualValue", value)?;
    }
    attribute(out, "PDOmapping", pdo_mapping(entry))
}

/// In which PDOs the entry may stand, seen from the device.
fn pdo_mapping(entry: &Entry) -> &'static str {
    match entry.mappable {
        Mappable::No => "no",
        Mappable::Receive => "RPDO",
        Mappable::Transmit => "TPDO",
        Mappable::Both => "optional",
    }
}

fn attribute(out: &mut String, name: &str, value: impl Display) -> Result {
    write!(out, " {name}=\"")?;
    escaped(out, value)?;
    write!(out, "\"")
}

/// Writes text that is no markup (XML 1.0, sections 2.2 and 2.4); what no XML document may hold becomes U+FFFD.
fn escaped(out: &mut String, text: impl Display) -> Result {
    for character in text.to_string().chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => write!(out, "&#{};", u32::from(character))?,
            '\0'..='\x1F' | '\u{FFFE}' | '\u{FFFF}' => out.push('\u{FFFD}'),
            _ => out.push(character),
        }
    }
    Ok(())
}
