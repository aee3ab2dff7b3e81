//! From frames to words.

use std::collections::BTreeMap;
use std::sync::Arc;

use canopen::{Frame, Message, Monitor};
use od::{Address, DataType, Dictionary, ObjectKind, Schema};
use profiles::{Dialect, Profile};
use serde::{Deserialize, Serialize};

use super::words;

/// A node of which the objects are known.
#[derive(Clone, Debug)]
pub struct Known {
    /// Node-ID.
    pub node_id: u8,
    /// Name of the device.
    pub device: String,
    /// What it is.
    pub profile: Arc<Profile>,
    /// Its communication objects as they are now.
    pub communication: Dictionary,
}

/// What a frame says.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Decoded {
    /// The service: `nmt`, `sync`, `time`, `emcy`, `pdo`, `sdo`, `boot-up`, `heartbeat`, `guarding`, `lss`, `malformed` or
    /// `unknown`.
    pub service: String,
    /// The node it comes from or goes to, if there is a certain one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node_id: Option<u8>,
    /// What it says, in words.
    pub text: String,
}

/// Who a node is.
#[derive(Clone, Debug)]
struct Identity {
    device: String,
    profile: Arc<Profile>,
}

/// Objects and names of one bus.
#[derive(Debug, Default)]
pub(super) struct Names(BTreeMap<u8, Identity>);

/// Follows any number of buses, each by its name.
#[derive(Debug, Default)]
pub struct Decoder {
    buses: BTreeMap<String, (Monitor, Names)>,
}

impl Decoder {
    /// Learns a node of `bus`, or how its parameters are now.
    pub fn learn(&mut self, bus: &str, known: Known) {
        let (monitor, Names(names)) = self.bus(bus);
        let Known { node_id, device, profile, communication } = known;
        monitor.learn(node_id, communication);
        names.insert(node_id, Identity { device, profile });
    }

    /// What the next frame of `bus` says.
    pub fn decode(&mut self, bus: &str, frame: &Frame) -> Decoded {
        let (monitor, names) = self.bus(bus);
        let message = monitor.take(frame);
        let (service, node_id) = service(&message);
        Decoded { service: service.to_owned(), node_id, text: words::text(&message, names) }
    }

    fn bus(&mut self, name: &str) -> &mut (Monitor, Names) {
        self.buses.entry(name.to_owned()).or_default()
    }
}

fn service(message: &Message) -> (&'static str, Option<u8>) {
    match message {
        Message::Nmt { node_id, .. } => ("nmt", Some(*node_id).filter(|node_id| *node_id != 0)),
        Message::Sync(_) => ("sync", None),
        Message::Time(_) => ("time", None),
        Message::Emergency(node_id, _) => ("emcy", Some(*node_id)),
        Message::Pdo(pdo) => ("pdo", Some(pdo.node_id)),
        Message::PdoRequest(node_id, _) => ("pdo", Some(*node_id)),
        Message::Sdo(sdo) => ("sdo", Some(sdo.node_id)),
        Message::BootUp(node_id) => ("boot-up", Some(*node_id)),
        Message::State { node_id, toggle: false, .. } => ("heartbeat", Some(*node_id)),
        Message::State { node_id, .. } | Message::Guard(node_id) => ("guarding", Some(*node_id)),
        Message::Lss { .. } => ("lss", None),
        Message::Malformed(_) => ("malformed", None),
        Message::Unknown => ("unknown", None),
    }
}

impl Names {
    /// A node in words.
    pub(super) fn node(&self, node_id: u8) -> String {
        match self.0.get(&node_id) {
            Some(Identity { device, .. }) => format!("{device} ({node_id})"),
            None => format!("node {node_id}"),
        }
    }

    /// How a node speaks of its faults.
    pub(super) fn dialect(&self, node_id: u8) -> Dialect {
        self.0.get(&node_id).map_or(Dialect::Cia402, |identity| identity.profile.dialect)
    }

    /// Name and type of an entry, as far as they are known. Of a node that is not known, the communication objects are
    /// those of the standard.
    pub(super) fn entry(&self, node_id: u8, address: Address) -> (Option<String>, Option<DataType>) {
        const END_OF_COMMUNICATION: u16 = 0x2000;
        let profile = self.0.get(&node_id).map(|identity| Arc::clone(&identity.profile));
        let is_communication = address.index < END_OF_COMMUNICATION;
        let profile = profile.or_else(|| standard().filter(|_| is_communication));
        let Some(profile) = profile else { return (None, None) };
        let area = if is_communication { &profile.communication } else { &profile.application };
        described(area, address)
    }
}

/// A device that has about every communication object.
fn standard() -> Option<Arc<Profile>> {
    use std::sync::OnceLock;
    static STANDARD: OnceLock<Option<Arc<Profile>>> = OnceLock::new();
    let read = || Profile::embedded("canopen-reference", None)?.ok().map(Arc::new);
    STANDARD.get_or_init(read).clone()
}

fn described(area: &Schema, address: Address) -> (Option<String>, Option<DataType>) {
    let Some(entry) = area.slot(address).and_then(|slot| area.entry(slot)) else { return (None, None) };
    let object = area.objects().find(|(index, ..)| *index == address.index);
    let name = match object {
        Some((_, object, ObjectKind::Array | ObjectKind::Record, _)) => format!("{object}: {}", entry.name),
        Some((_, _, ObjectKind::Var, _)) | None => entry.name.clone(),
    };
    (Some(name), Some(entry.data_type))
}
