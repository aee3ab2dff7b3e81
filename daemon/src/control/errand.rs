//! What the core can be asked for, each with the kind of its outcome.

use std::sync::Arc;

use canopen::{Frame, NmtCommand};
use od::{AbortCode, Address, Value};
use profiles::Profile;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::faults::{Order, Outcome};
use super::orders::Task;
use super::owners::{AxisOwner, Claim};
use super::signals::{AxisSignals, SignalOrder};
use crate::core::{Authority, LinkId, WriteRefused};
use crate::dump::Known;
use crate::link::Tap;
use crate::motion::Goal;

/// A task for the core.
#[derive(Debug)]
pub enum Errand {
    /// Faults of the simulated plants.
    Faults(Task<Order, Outcome>),
    /// Signals to simulated axes.
    Signals(Task<SignalOrder, Result<Vec<AxisSignals>, String>>),
    /// What the device of this name is; without one, all devices.
    Describe(Task<Option<String>, Result<Vec<Described>, String>>),
    /// Write and read objects.
    Objects(ObjectTask),
    /// Claim or release axes.
    Claim(Task<Claim, Result<Vec<AxisOwner>, String>>),
    /// Send NMT commands.
    Nmt(Task<NmtOrder, Result<Vec<Commanded>, String>>),
    /// Send a frame.
    Send(Task<SendOrder, Result<(), String>>),
    /// Let somebody watch the bus of this name, or all.
    Watch(Task<(Option<String>, Tap), Result<Vec<Watched>, String>>),
    /// Somebody has stopped watching.
    Unwatch(Task<(), ()>),
    /// The ASCII gateway has clients that hear this bus, or none any more.
    Hear(Task<(LinkId, bool), ()>),
}

/// Objects to be written and read, and what comes of it.
pub type ObjectTask = Task<ObjectOrder, Result<Vec<Result<Value, AbortCode>>, ObjectError>>;

/// A device.
#[derive(Clone, Debug)]
pub struct Described {
    /// Name.
    pub device: String,
    /// What it is.
    pub profile: Arc<Profile>,
    /// Its nodes.
    pub nodes: Vec<NodePlace>,
}

/// Where a node is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodePlace {
    /// Name of its bus.
    pub bus: String,
    /// Number of its bus, from 1 in the order of the configuration.
    pub network: u32,
    /// Node-ID.
    pub node_id: u8,
}

/// Objects of a device to be written, all at once, and then others to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectOrder {
    /// Name of the device.
    pub device: String,
    /// Position of the node whose communication objects are meant.
    pub node: usize,
    /// What to write, as an SDO carries it.
    pub writes: Vec<(Address, Vec<u8>)>,
    /// What to read then.
    pub reads: Vec<Address>,
    /// With which authority to write.
    pub authority: Authority,
    /// The motion that begins with it, and the axis from 0, for the audit trail.
    pub motion: Option<(usize, Goal)>,
}

/// Why objects were not written.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ObjectError {
    /// A write was refused.
    #[error("{address}: {code}", address = .0.address, code = .0.code)]
    Refused(WriteRefused),
    /// There is no such device.
    #[error("{0}")]
    Unknown(String),
}

/// Who gets an NMT command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// The nodes of a device.
    Device(String),
    /// A Node-ID, ours or not; zero for every node.
    Node(u8),
}

/// An NMT command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NmtOrder {
    /// Who gets it.
    pub target: Target,
    /// On this bus; without it on all of a device, or on the only one.
    pub bus: Option<String>,
    /// What to do.
    pub command: NmtCommand,
}

/// An NMT command that was sent.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Commanded {
    /// Name of the bus.
    pub bus: String,
    /// Node-ID, zero for every node.
    pub node_id: u8,
    /// The state that it led to, if it is one of our nodes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<String>,
}

/// A frame that somebody on this machine puts on a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SendOrder {
    /// The bus.
    pub link: LinkId,
    /// The frame.
    pub frame: Frame,
}

/// A bus that is watched.
#[derive(Clone, Debug)]
pub struct Watched {
    /// Its number.
    pub link: LinkId,
    /// Its name.
    pub name: String,
    /// Our nodes on it.
    pub nodes: Vec<Known>,
}
