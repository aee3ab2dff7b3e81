//! What the electronic data sheets say of a device, whichever form they have: [`crate::eds`] or [`crate::xdd`].

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::{Address, DataType, Entry, Initial, ObjectKind, Schema, Value};

/// Bit rates of CiA 301, in kbit/s; a virtual or SocketCAN link has whichever the interface has.
pub(crate) const BIT_RATES: [u16; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];
/// The data types that an RPDO may be mapped into to skip bytes (CiA 301 v4.2, section 7.4.7.1).
pub(crate) const DUMMIES: core::ops::RangeInclusive<u16> = 1..=7;
/// Sub-index 4 of the identity object: the one thing in a sheet that equal devices differ in.
const SERIAL_NUMBER: Address = Address::new(0x1018, 4);
/// Year, month and day that this form of the sheets is from. Equal devices have equal sheets, whenever they are made.
pub(crate) const DATE: [u16; 3] = [2026, 11, 26];

/// What is to be described.
#[derive(Clone, Copy, Debug)]
pub struct Sheet<'s> {
    /// The device as a whole.
    pub info: &'s DeviceInfo,
    /// Its objects; those that are not on CANopen are left out.
    pub schemas: &'s [&'s Schema],
    /// The configuration of one device, which makes a DCF of an EDS and an XDC of an XDD.
    pub configuration: Option<&'s Configuration>,
}

/// What a sheet says about the device as a whole.
#[derive(Clone, Debug, Default)]
pub struct DeviceInfo {
    /// Name that the file is meant to have, without its ending.
    pub name: String,
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

/// How one device is configured.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Configuration {
    /// Node-ID, 1-127, or 255 if it has none.
    pub node_id: u8,
    /// Name of the device.
    pub node_name: String,
    /// Bit rate of its network in kbit/s, if that is known.
    pub bit_rate: Option<u16>,
    /// Number of the network, from 1.
    pub network: u32,
    /// Name of the network.
    pub network_name: String,
    /// Serial number, 0x1018:04.
    pub serial_number: u32,
    /// The values of its parameters ([`Entry::is_parameter`]).
    pub values: BTreeMap<Address, Value>,
}

/// An object as sheets have it.
pub(crate) type Shown<'s> = (u16, &'s str, ObjectKind, &'s [Entry]);

impl<'s> Sheet<'s> {
    /// Everything that is on CANopen, in the order of the indices.
    pub(crate) fn objects(&self) -> Vec<Shown<'s>> {
        let is_public = |entries: &[Entry]| !entries.iter().any(|entry| entry.is_local);
        let all = self.schemas.iter().flat_map(|schema| schema.objects());
        let mut objects: Vec<_> = all.filter(|(.., entries)| is_public(entries)).collect();
        objects.sort_by_key(|(index, ..)| *index);
        objects
    }

    /// Whether it has lists for multiplexed PDOs (CiA 301 v4.2, section 7.2.2.4).
    pub(crate) fn is_multiplexing(&self) -> bool {
        let has_list = |schema: &&Schema| (0x1FA0..=0x1FFF).any(|index| schema.has_object(index));
        self.schemas.iter().any(has_list)
    }

    /// The value that the device is configured to have at `address`.
    pub(crate) fn configured(&self, address: Address, data_type: DataType) -> Option<String> {
        text(data_type, self.configuration?.values.get(&address)?)
    }
}

/// The group of objects that sheets count `index` among.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Area {
    Mandatory,
    Optional,
    Manufacturer,
}

impl Area {
    pub(crate) const fn of(index: u16) -> Self {
        match index {
            0x1000 | 0x1001 | 0x1018 => Self::Mandatory,
            0x2000..=0x5FFF => Self::Manufacturer,
            _ => Self::Optional,
        }
    }
}

/// The default of an entry as sheets write it; `None` if there is none to be told: what the device alone changes has
/// no value but that of the moment, each device has its own serial number, and a domain is too much for a line, as
/// is a text with other than printable characters.
pub(crate) fn default(address: Address, entry: &Entry) -> Option<String> {
    match &entry.initial {
        _ if entry.is_live || address == SERIAL_NUMBER => None,
        Initial::PlusNodeId(base) => Some(format!("$NODEID+0x{base:X}")),
        Initial::Value(value) => text(entry.data_type, value),
    }
}

/// A value as sheets write it.
fn text(data_type: DataType, value: &Value) -> Option<String> {
    match value {
        Value::Fixed(raw) => Some(match Value::as_real(data_type, *raw) {
            Some(real) => real.to_string(),
            None if data_type.is_signed() => data_type.integer(*raw).to_string(),
            None => format!("0x{raw:X}"),
        }),
        Value::Bytes(_) if data_type == DataType::Domain => None,
        Value::Bytes(bytes) if data_type == DataType::VisibleString => {
            let text = str::from_utf8(bytes).ok()?;
            let is_kept = text.trim() == text && !text.chars().any(char::is_control);
            is_kept.then(|| text.to_owned())
        }
        Value::Bytes(bytes) => Some(bytes.iter().map(|byte| format!("{byte:02X}")).collect()),
    }
}

/// A name as it may stand in a line.
pub(crate) fn line(name: &str) -> Cow<'_, str> {
    if name.chars().any(char::is_control) {
        Cow::Owned(name.replace(char::is_control, " "))
    } else {
        Cow::Borrowed(name)
    }
}
