//! The state of the whole gateway, for people and programs: what every device does, how its buses are, and what went
//! wrong, in numbers and in words.
//!
//! The core collects it when somebody asks ([`devices`]); [`crate::control`] takes it out of the core as one line of
//! JSON, and `axisctl status` shows it ([`text`]). Fields are only ever added: programs may read it.

mod clients;
mod collect;
mod table;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::latency::Histogram;
use crate::reload::Report;

pub(crate) use clients::owner_name;
pub use clients::{Client, Command, Listener, Modbus, Times};
pub use collect::devices;
pub(crate) use collect::{Around, device, status};
pub(crate) use table::table;
pub use table::text;

/// All of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Version of the daemon.
    pub version: String,
    /// Time since the daemon was started, in s.
    pub uptime_s: u64,
    /// The buses, in the order of the configuration.
    pub buses: Vec<Bus>,
    /// The devices, in the order of the configuration.
    pub devices: Vec<Device>,
    /// Modbus listeners and clients.
    #[serde(default)]
    pub modbus: Modbus,
    /// How long CAN frames waited and were answered; measured where there are Modbus listeners.
    #[serde(default)]
    pub answers: Times,
    /// How late what was due was done.
    #[serde(default)]
    pub lateness: Times,
    /// How long the core loop worked from one sleep to the next; measured while metrics are served.
    #[serde(default)]
    pub turns: Times,
    /// How long it worked from one look at CAN frames and what is due to the next; measured while metrics are served.
    #[serde(default)]
    pub pieces: Times,
    /// The longest of these, in us, whether metrics are served or not. If something else, such as the hypervisor, kept the
    /// thread from running meanwhile, that is in it.
    #[serde(default)]
    pub longest_piece_us: u64,
    /// How late the core loop woke up at most for what fell due while it slept, in us: the kernel's and the machine's share in
    /// `lateness`.
    #[serde(default)]
    pub latest_wake_us: u64,
    /// How much waits in queues to and from the core, by their names.
    #[serde(default)]
    pub queues: BTreeMap<String, u64>,
    /// Entries of the audit trail that were lost, if there is a trail.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost_audit: Option<u64>,
    /// What came of the last reload of the configuration, if there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reload: Option<Report>,
    /// All that the times are made from.
    #[serde(skip)]
    pub histograms: Histograms,
}

/// What times are made from, for metrics.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Histograms {
    /// Of [`Status::lateness`].
    pub lateness: Histogram,
    /// Of [`Status::turns`], if it is measured.
    pub turns: Option<Histogram>,
    /// Of [`Status::pieces`], if it is measured.
    pub pieces: Option<Histogram>,
    /// Of [`Bus::sdo_latency`], for each bus where it is measured.
    pub sdo: Vec<(String, Histogram)>,
}

/// A bus.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bus {
    /// Name.
    pub name: String,
    /// How it is reached, as the configuration says it.
    pub link: String,
    /// State of the CAN controller, or why it is not there.
    pub state: String,
    /// Frames from others.
    pub received: u64,
    /// Frames of our nodes.
    pub sent: u64,
    /// Frames that came and were not processed: malformed ones, and those that were too many.
    pub lost: u64,
    /// Frames that the interface did not take.
    pub unsent: u64,
    /// Error frames that told no state of the controller.
    pub errors: u64,
    /// Bits on the bus in the last second, without stuff bits.
    #[serde(default)]
    pub bits_per_s: u64,
    /// Bit rate of the interface, in bit/s, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bit_rate: Option<u32>,
    /// How long the interface stays in bus-off before the kernel restarts it, in ms, 0 for ever; if it tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restart_ms: Option<u32>,
    /// Frames that wait for room in the interface.
    #[serde(default)]
    pub waiting: u64,
    /// PDOs and heartbeats that waited for it until newer ones of the same COB-ID took their places.
    #[serde(default)]
    pub replaced: u64,
    /// Frames from others by what they are for.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub received_kinds: BTreeMap<String, u64>,
    /// Frames of our nodes by what they are for.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sent_kinds: BTreeMap<String, u64>,
    /// How long clients of the default SDO servers waited, while metrics are served.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sdo_latency: Option<Times>,
}

/// A device.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Device {
    /// Name.
    pub name: String,
    /// Name of its profile.
    pub profile: String,
    /// Its axes.
    pub axes: Vec<Axis>,
    /// Its nodes, one on each of its buses.
    pub nodes: Vec<Node>,
    /// Raster steps that were lost because the device was served too late.
    pub dropped_steps: u64,
    /// Who commanded it, the last one first; the same command of the same origin is one.
    #[serde(default)]
    pub commands: Vec<Command>,
}

/// An axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// State of the drive (CiA 402).
    pub state: String,
    /// Mode in effect.
    pub mode: String,
    /// 0x6041.
    pub statusword: u16,
    /// Actual position, in counts.
    pub position_counts: f64,
    /// Actual velocity, in counts/s.
    pub velocity_counts_s: f64,
    /// The fault, if any.
    pub fault: Option<Fault>,
    /// Who alone may command it: a bus, `modbus`, `local`, or `any`.
    #[serde(default)]
    pub owner: String,
    /// What is broken in its simulated plant, by order or by schedule, as `axisctl fault` says it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plant_faults: Vec<String>,
}

/// An error that stands.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fault {
    /// Error code.
    pub code: u16,
    /// What it means.
    pub text: String,
}

/// A node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Node {
    /// Name of its bus.
    pub bus: String,
    /// Node-ID; 255: it has none.
    pub node_id: u8,
    /// What an LSS master has stored, if anything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lss: Option<Lss>,
    /// NMT state.
    pub state: String,
    /// Errors that stand now.
    pub errors: Vec<Fault>,
    /// Emergencies that it sent; code zero: an error was over.
    pub emergencies: Events,
    /// Emergencies of others that it listens to (0x1028).
    pub heard: Events,
    /// SDO transfers that it aborted.
    pub aborts: Events,
    /// Connections that it lost.
    pub lost_connections: Events,
    /// What it refused or lost without an answer on the bus.
    pub counters: Counters,
    /// How much it had to do.
    #[serde(default)]
    pub traffic: Traffic,
}

/// Frames of a node since power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Traffic {
    /// NMT commands heard.
    pub nmt: u64,
    /// SYNCs heard.
    pub syncs: u64,
    /// Frames of SDO clients heard.
    pub sdo_requests: u64,
    /// Frames that its SDO servers sent.
    pub sdo_answers: u64,
    /// RPDOs heard.
    pub rpdos: u64,
    /// TPDOs sent.
    pub tpdos: u64,
}

/// What an LSS master has stored in a node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lss {
    /// Node-ID; 255: none.
    pub node_id: u8,
    /// Bit rate, in kbit/s; zero stands for automatic detection. The interface keeps its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kbit_per_s: Option<u16>,
    /// The configuration gives the node another Node-ID, which holds.
    pub conflicts: bool,
}

/// What happened since power-on, of one kind.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Events {
    /// How often.
    pub count: u64,
    /// The last times, newest first.
    pub last: Vec<Event>,
}

/// Something that happened.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Event {
    /// How long ago, in ms.
    pub age_ms: u64,
    /// Emergency error code or SDO abort code.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub code: Option<u32>,
    /// What it means.
    pub text: String,
    /// The object it is about, as in `0x6040:00`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// The Node-ID it came from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<u8>,
}

/// What a node refused or lost without an answer on the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Frames of a wrong length or kind for their service.
    pub malformed: u64,
    /// RPDOs that were too short and not taken.
    pub short_rpdos: u64,
    /// RPDOs that were too long and taken.
    pub long_rpdos: u64,
    /// Synchronous RPDOs that came when the synchronous window was over.
    pub late_rpdos: u64,
    /// RPDOs with values that the device refused.
    pub refused_rpdos: u64,
    /// PDOs lost because too many waited for the device to process them.
    #[serde(default)]
    pub overflows: u64,
    /// Frames dropped because too many waited to be sent.
    pub dropped_frames: u64,
    /// Emergencies of others dropped because too many waited to be taken.
    pub dropped_emergencies: u64,
}
