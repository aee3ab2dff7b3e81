//! The lines of the control socket, both ways.

use std::collections::BTreeMap;

use canopen::NmtCommand;
use serde::{Deserialize, Serialize};

use super::{
    AxisFaults, AxisOwner, AxisSignals, Commanded, DataSheet, Ended, LssResult, ObjectValue, Progress,
    Traffic,
};
use crate::reload::Report;
use crate::status::Status;

/// Version of the protocol. Requests and fields may come in addition; what changes in another way raises it.
pub const PROTOCOL: u32 = 1;

/// NMT commands by the words of operators.
pub const NMT_COMMANDS: [(&str, NmtCommand); 5] = [
    ("start", NmtCommand::Start),
    ("stop", NmtCommand::Stop),
    ("preop", NmtCommand::EnterPreOperational),
    ("reset", NmtCommand::ResetNode),
    ("reset-comm", NmtCommand::ResetCommunication),
];

/// What a client asks for. Axes have numbers from 1.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Request {
    /// Version of protocol and daemon.
    Version {},
    /// The state of everything.
    Status {},
    /// Break something of a simulated plant.
    FaultInject {
        /// Name of the device.
        device: String,
        /// Number of the axis, from 1; all of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// What breaks, such as `supply-dip:10`.
        fault: String,
    },
    /// Repair something of a simulated plant.
    FaultClear {
        /// Name of the device.
        device: String,
        /// Number of the axis, from 1; all of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// What is repaired, such as `supply-dip`, or `all`.
        fault: String,
    },
    /// What is broken in the simulated plants.
    FaultList {
        /// Name of the device; all devices without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        device: Option<String>,
    },
    /// Set what comes to a simulated axis from outside of its machine.
    SignalSet {
        /// Name of the device.
        device: String,
        /// Number of the axis, from 1; all of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// What it is to be, such as `analog-input:2.5`.
        signal: String,
    },
    /// What comes to the simulated axes.
    SignalList {
        /// Name of the device; all devices without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        device: Option<String>,
    },
    /// Take the configuration as its file now says.
    Reload {},
    /// How much is logged.
    Log {
        /// What is to change: a level, or a module with its level, such as `device=debug`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        change: Option<String>,
    },
    /// The last entries of the audit trail.
    Audit {
        /// How many, at most a thousand.
        count: usize,
    },
    /// The objects of a device with their values.
    OdList {
        /// Name of the device.
        device: String,
        /// The bus whose communication objects are meant; the first of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bus: Option<String>,
        /// Only those whose name holds this, without case.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        filter: Option<String>,
    },
    /// The value of an entry, or of all of an object.
    OdRead {
        /// Name of the device.
        device: String,
        /// The entry, by number or name.
        object: String,
        /// The bus whose communication objects are meant; the first of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bus: Option<String>,
    },
    /// Write an entry.
    OdWrite {
        /// Name of the device.
        device: String,
        /// The entry, by number or name.
        object: String,
        /// What to write, as a text.
        value: String,
        /// The bus whose communication objects are meant; the first of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bus: Option<String>,
    },
    /// The data sheet of a device.
    OdExport {
        /// Name of the device.
        device: String,
        /// `eds`, `dcf`, `xdd` or `xdc`.
        format: String,
        /// The bus whose communication objects are meant; the first of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bus: Option<String>,
    },
    /// Move an axis to a position, in user units.
    Move {
        /// Name of the device.
        device: String,
        /// The axis, the first without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// Where to, or how far.
        position: i64,
        /// Whether it is a distance.
        #[serde(default)]
        relative: bool,
        /// Profile velocity.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        velocity: Option<i64>,
        /// Profile acceleration and deceleration.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        acceleration: Option<i64>,
    },
    /// Run at a velocity as long as the client gives signs of life: an empty line twice a second.
    Jog {
        /// Name of the device.
        device: String,
        /// The axis, the first without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// Target velocity, in user units.
        velocity: i64,
        /// Profile acceleration and deceleration.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        acceleration: Option<i64>,
        /// For how long, in ms; until the client ends it without.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        time_ms: Option<u64>,
    },
    /// Find the origin of an axis.
    Home {
        /// Name of the device.
        device: String,
        /// The axis, the first without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// Homing method.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        method: Option<i64>,
    },
    /// Stop by the quick stop.
    Stop {
        /// Name of the device; all devices without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        device: Option<String>,
        /// The axis; all of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
    },
    /// Let one alone command an axis, until it is released or claimed again.
    Claim {
        /// Name of the device.
        device: String,
        /// The axis; all of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
        /// A bus of the device, `modbus`, or `local`: who commands by this socket.
        #[serde(rename = "for")]
        owner: String,
    },
    /// Let those command an axis who may by the configuration.
    Release {
        /// Name of the device.
        device: String,
        /// The axis; all of the device without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        axis: Option<usize>,
    },
    /// Send an NMT command.
    Nmt {
        /// Name of a device, a Node-ID, or `all`.
        target: String,
        /// One of [`NMT_COMMANDS`].
        command: String,
        /// On this bus.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bus: Option<String>,
    },
    /// Be LSS master for one task: `scan` for a slave without a Node-ID, `inquire` the Node-ID of one, or `configure` it.
    Lss {
        /// The task.
        action: String,
        /// Vendor-ID, product code, revision number and serial number of the slave; without it, one without a Node-ID.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        address: Option<[u32; 4]>,
        /// The Node-ID to configure; 255 takes it away.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        node_id: Option<u8>,
        /// The bus; the only one without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bus: Option<String>,
    },
    /// Everything that passes on a bus, in words, until the client leaves or says something.
    Dump {
        /// The bus; all without it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        bus: Option<String>,
    },
}

/// What it is answered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[expect(clippy::large_enum_variant, reason = "there is one at a time, and not for long")]
pub enum Response {
    /// Version of protocol and daemon.
    Version(Version),
    /// The state of everything.
    Status(Status),
    /// What is broken now behind each axis that was asked about.
    Faults(Vec<AxisFaults>),
    /// What comes to each axis that was asked about.
    Signals(Vec<AxisSignals>),
    /// What came of a reload.
    Reload(Report),
    /// How much each module of the log says.
    Log(BTreeMap<String, String>),
    /// Entries of the audit trail, the oldest first.
    Audit(Vec<serde_json::Value>),
    /// Objects with their values.
    Objects(Vec<ObjectValue>),
    /// A data sheet.
    Sheet(DataSheet),
    /// How far a motion is; others follow.
    Progress(Progress),
    /// How a motion has ended.
    Done(Vec<Ended>),
    /// Who commands each axis of a device now.
    Owners(Vec<AxisOwner>),
    /// NMT commands that were sent.
    Commanded(Vec<Commanded>),
    /// The LSS slave that was found.
    Lss(LssResult),
    /// A bus is watched from now on; frames follow.
    Watching(Vec<String>),
    /// A frame was on a bus.
    Frame(Traffic),
    /// So many frames could not be shown here.
    Dropped(u64),
    /// The request was not understood, cannot be answered or has failed.
    Error(String),
}

/// Who answers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Version {
    /// [`PROTOCOL`].
    pub protocol: u32,
    /// Version of the daemon.
    pub daemon: String,
}
