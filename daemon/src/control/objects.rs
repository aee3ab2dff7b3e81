//! Objects by the control socket.

use od::{AbortCode, Address, DataType, Entry, ObjectKind, Schema, Value};
use serde::{Deserialize, Serialize};

use super::errand::{Described, Errand, NodePlace, ObjectError, ObjectOrder};
use super::orders::Orders;
use super::request::Response;
use crate::core::Authority;
use crate::objects::{self, find};

/// Values that the core reads for a list before everything else has its turn again.
pub(super) const BATCH: usize = 64;

/// An entry and its value.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ObjectValue {
    /// The entry, as in `0x6040:00`.
    pub object: String,
    /// Its name; with the name of its object before, where that has several entries.
    pub name: String,
    /// Its data type, as in `UNSIGNED16`.
    #[serde(rename = "type")]
    pub data_type: String,
    /// `ro`, `rw`, `wo` or `const`.
    pub access: String,
    /// What it holds: a number, a boolean or a text; none if it cannot be read.
    #[serde(default, skip_serializing_if = "serde_json::Value::is_null")]
    pub value: serde_json::Value,
    /// What it holds, for people.
    pub text: String,
}

/// A device whose objects are meant.
pub(super) struct Objects<'o> {
    orders: &'o Orders,
    pub(super) described: Described,
    /// Position of the node whose communication objects are meant.
    node: usize,
}

impl<'o> Objects<'o> {
    /// Those of the device of this name, with the communication objects of its node on `bus`.
    pub(super) async fn of(orders: &'o Orders, device: String, bus: Option<&str>) -> Result<Self, String> {
        let described = describe(orders, device).await?;
        let position = |bus: &str| described.nodes.iter().position(|place| place.bus == bus);
        let node = bus.map_or(Ok(0), |bus| {
            let buses = || described.nodes.iter().map(|place| place.bus.as_str());
            let known = || buses().collect::<Vec<_>>().join(", ");
            let unknown = || format!("`{}` is not on bus `{bus}`; it is on: {}", described.device, known());
            position(bus).ok_or_else(unknown)
        })?;
        Ok(Self { orders, described, node })
    }

    /// All entries with `filter` in their names.
    pub(super) async fn list(&self, filter: Option<&str>) -> Result<Response, String> {
        let filter = filter.unwrap_or_default().to_lowercase();
        let mut addresses = Vec::new();
        for area in self.areas() {
            for (index, name, _, entries) in area.objects() {
                let is_named = |entry: &&Entry| {
                    [name, &entry.name].iter().any(|name| name.to_lowercase().contains(&filter))
                };
                addresses.extend(entries.iter().filter(is_named).map(|entry| Address::new(index, entry.sub)));
            }
        }
        let mut values = Vec::with_capacity(addresses.len());
        for some in addresses.chunks(BATCH) {
            values.extend(self.read_all(some.to_vec()).await?);
        }
        Ok(Response::Objects(values))
    }

    /// The entry that `text` names, or every entry of an object of several.
    pub(super) async fn read(&self, text: &str) -> Result<Response, String> {
        let found = find(&self.areas(), text).map_err(|error| error.to_string())?;
        let values = self.order(Vec::new(), found.addresses.clone()).await?;
        if let ([address], [Err(code)]) = (&*found.addresses, &*values) {
            return Err(format!("{}: {code}", self.named(*address)));
        }
        Ok(Response::Objects(self.told(&found.addresses, values)))
    }

    /// Writes the entry that `text` names, and tells what it then holds.
    pub(super) async fn write(&self, text: &str, value: &str) -> Result<Response, String> {
        let found = find(&self.areas(), text).map_err(|error| error.to_string())?;
        let [address] = *found.addresses else {
            return Err(format!("say which sub-index of `{text}`, such as `{text}:1`"));
        };
        if !found.is_single {
            return Err(format!("say which sub-index of `{text}`, such as `{text}:1`"));
        }
        let entry = self.entry(address).ok_or_else(|| AbortCode::NoObject.to_string())?;
        let bytes = objects::parse(entry.data_type, value).map_err(|error| error.to_string())?;
        self.order(vec![(address, bytes)], Vec::new()).await?;
        self.read_all(vec![address]).await.map(Response::Objects)
    }

    async fn read_all(&self, addresses: Vec<Address>) -> Result<Vec<ObjectValue>, String> {
        let values = self.order(Vec::new(), addresses.clone()).await?;
        Ok(self.told(&addresses, values))
    }

    pub(super) async fn order(
        &self,
        writes: Vec<(Address, Vec<u8>)>,
        reads: Vec<Address>,
    ) -> Result<Vec<Result<Value, AbortCode>>, String> {
        let device = self.described.device.clone();
        let order =
            ObjectOrder { device, node: self.node, writes, reads, authority: Authority::Owner, motion: None };
        self.orders.place(Errand::Objects, order).await?.map_err(|error| match error {
            ObjectError::Refused(refused) => format!("{}: {}", self.named(refused.address), refused.code),
            ObjectError::Unknown(unknown) => unknown,
        })
    }

    /// Where the node is whose communication objects are meant.
    pub(super) fn place(&self) -> Result<&NodePlace, String> {
        self.described.nodes.get(self.node).ok_or_else(|| "the device is on no CANopen bus".to_owned())
    }

    pub(super) fn areas(&self) -> [&Schema; 2] {
        [&self.described.profile.communication, &self.described.profile.application]
    }

    fn entry(&self, address: Address) -> Option<&Entry> {
        self.areas().into_iter().find_map(|area| area.entry(area.slot(address)?))
    }

    /// An entry by number and name.
    fn named(&self, address: Address) -> String {
        format!("{address} {}", self.name(address))
    }

    fn name(&self, address: Address) -> String {
        let object = self.areas().into_iter().flat_map(Schema::objects).find(|o| o.0 == address.index);
        let entry = self.entry(address).map_or("?", |entry| entry.name.as_str());
        match object {
            Some((_, name, ObjectKind::Array | ObjectKind::Record, _)) => format!("{name}: {entry}"),
            Some((_, _, ObjectKind::Var, _)) | None => entry.to_owned(),
        }
    }

    fn told(&self, addresses: &[Address], values: Vec<Result<Value, AbortCode>>) -> Vec<ObjectValue> {
        let told = |(address, value): (&Address, Result<Value, AbortCode>)| {
            let entry = self.entry(*address)?;
            let described = ObjectValue {
                object: address.to_string(),
                name: self.name(*address),
                data_type: entry.data_type.name().to_owned(),
                access: entry.access.name().to_owned(),
                ..ObjectValue::default()
            };
            Some(match value {
                Err(AbortCode::WriteOnly) => ObjectValue { text: "-".to_owned(), ..described },
                Err(code) => ObjectValue { text: code.text().to_owned(), ..described },
                Ok(value) => {
                    let bytes = bytes(entry.data_type, &value);
                    let json = objects::json(entry.data_type, &bytes);
                    ObjectValue { value: json, text: objects::text(entry.data_type, &bytes), ..described }
                }
            })
        };
        addresses.iter().zip(values).filter_map(told).collect()
    }
}

/// The one device of this name.
pub(super) async fn describe(orders: &Orders, device: String) -> Result<Described, String> {
    let described = orders.place(Errand::Describe, Some(device)).await??;
    described.into_iter().next().ok_or_else(|| "the device has gone".to_owned())
}

/// A value as an SDO carries it.
fn bytes(data_type: DataType, value: &Value) -> Vec<u8> {
    match value {
        Value::Bytes(bytes) => bytes.to_vec(),
        Value::Fixed(raw) => {
            let le = raw.to_le_bytes();
            le.get(..data_type.bytes().unwrap_or(le.len())).unwrap_or_default().to_vec()
        }
    }
}
