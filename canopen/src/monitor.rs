//! What the frames of a network mean, for somebody who only listens: the pre-defined connection set (CiA 301 v4.2,
//! section 7.3.5), and for nodes that are known the COB-IDs and mappings of their dictionaries.
//!
//! The listener follows SDO transfers, so that a value that comes in parts is told as a whole at its end, and PDO
//! parameters that a master writes act on the PDOs that follow. Every frame is something, if only [`Message::Unknown`].

mod sdo;
mod services;

use std::collections::BTreeMap;

use od::{Address, Dictionary, Direction, bits};

use crate::communication::{RPDO_MAPPING, TPDO_MAPPING, is_communication, parameter};
use crate::sdo::is_cob_id;
use crate::{Emergency, Frame, Id, NmtState, TimeOfDay};
use sdo::Channel;
use services::Service;

pub use sdo::{SdoMessage, SdoStep};

/// What a frame says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Message {
    /// An NMT command to one node or, with zero, to all.
    Nmt {
        /// Command specifier, see [`crate::NmtCommand`].
        specifier: u8,
        /// Node-ID, zero for all.
        node_id: u8,
    },
    /// SYNC, with its counter if it has one.
    Sync(Option<u8>),
    /// The time of day.
    Time(TimeOfDay),
    /// A node tells an error, or with code zero that one is over.
    Emergency(u8, Emergency),
    /// Process data of a node.
    Pdo(Pdo),
    /// Somebody asks for a TPDO.
    PdoRequest(u8, u16),
    /// Part of an SDO transfer with the server of a node.
    Sdo(SdoMessage),
    /// A node has booted.
    BootUp(u8),
    /// A node tells its state: as a heartbeat, or guarded, with this toggle bit.
    State {
        /// Node-ID.
        node_id: u8,
        /// NMT state; `None` if the number is none.
        state: Option<NmtState>,
        /// The toggle bit of node guarding; a heartbeat has it zero.
        toggle: bool,
    },
    /// A node is asked for its state (node guarding).
    Guard(u8),
    /// LSS (CiA 305): from the master or from a slave, with its eight bytes.
    Lss {
        /// Whether the master speaks.
        is_master: bool,
        /// Command specifier and data.
        data: [u8; 8],
    },
    /// A frame of this service with a length that it does not have.
    Malformed(&'static str),
    /// Nothing that is known.
    Unknown,
}

/// Process data.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pdo {
    /// Node-ID.
    pub node_id: u8,
    /// Which way, seen from the device.
    pub direction: Direction,
    /// Number, from 1.
    pub number: u16,
    /// What it carries: entry, width in bits and bit pattern; empty if the node is not known. What lies past the end of
    /// the frame is left out.
    pub fields: Vec<(Address, u8, u64)>,
    /// Bytes that its mapping has; those of the frame if the node is not known.
    pub expected: usize,
}

/// Somebody who listens to one network.
#[derive(Debug)]
pub struct Monitor {
    nodes: BTreeMap<u8, Dictionary>,
    services: BTreeMap<Id, Service>,
    channels: BTreeMap<(u8, u8), Channel>,
}

impl Default for Monitor {
    fn default() -> Self {
        Self::new()
    }
}

impl Monitor {
    /// Knows no node.
    #[must_use]
    pub fn new() -> Self {
        Self { nodes: BTreeMap::new(), services: services::all(&BTreeMap::new()), channels: BTreeMap::new() }
    }

    /// Learns the communication objects of a node, 1-127, or what they are now.
    pub fn learn(&mut self, node_id: u8, communication: Dictionary) {
        if (1..=127).contains(&node_id) {
            self.nodes.insert(node_id, communication);
            self.services = services::all(&self.nodes);
        }
    }

    /// What the next frame of the network says.
    pub fn take(&mut self, frame: &Frame) -> Message {
        let Some(service) = self.services.get(&frame.id).copied() else { return Message::Unknown };
        if frame.is_remote {
            return match service {
                Service::ErrorControl(node_id) => Message::Guard(node_id),
                Service::Pdo(node_id, Direction::Transmit, number) => Message::PdoRequest(node_id, number),
                Service::Nmt
                | Service::Sync
                | Service::Time
                | Service::Emergency(_)
                | Service::Pdo(_, Direction::Receive, _)
                | Service::Sdo { .. }
                | Service::Lss { .. } => Message::Unknown,
            };
        }
        self.serve(service, frame).unwrap_or(Message::Malformed(service.name()))
    }

    fn serve(&mut self, service: Service, frame: &Frame) -> Option<Message> {
        match (service, frame.payload()) {
            (Service::Nmt, &[specifier, node_id]) => Some(Message::Nmt { specifier, node_id }),
            (Service::Sync, []) => Some(Message::Sync(None)),
            (Service::Sync, &[counter]) => Some(Message::Sync(Some(counter))),
            (Service::Time, payload) => TimeOfDay::decode(payload).map(Message::Time),
            (Service::Emergency(node_id), _) => {
                frame.eight().map(|message| Message::Emergency(node_id, Emergency::decode(message)))
            }
            (Service::Pdo(node_id, direction, number), payload) => {
                Some(Message::Pdo(self.pdo(node_id, direction, number, payload)))
            }
            (Service::Sdo { node_id, server, is_request }, _) => {
                frame.eight().map(|message| self.sdo(node_id, server, is_request, message))
            }
            (Service::ErrorControl(node_id), &[byte]) => Some(state(node_id, byte)),
            (Service::Lss { is_master }, _) => frame.eight().map(|data| Message::Lss { is_master, data }),
            (Service::Nmt | Service::Sync | Service::ErrorControl(_), _) => None,
        }
    }

    fn pdo(&self, node_id: u8, direction: Direction, number: u16, payload: &[u8]) -> Pdo {
        let base = match direction {
            Direction::Receive => RPDO_MAPPING,
            Direction::Transmit => TPDO_MAPPING,
        };
        let mut pdo = Pdo { node_id, direction, number, fields: Vec::new(), expected: payload.len() };
        let Some(node) = self.nodes.get(&node_id) else { return pdo };
        let index = base + (number - 1);
        let count = u8::try_from(parameter(node, index, 0)).unwrap_or(0).min(64);
        let mut offset = 0;
        for sub in 1..=count {
            let [width, sub, low, high] = (parameter(node, index, sub) as u32).to_le_bytes();
            if offset + usize::from(width) <= 8 * payload.len() {
                let address = Address::new(u16::from_le_bytes([low, high]), sub);
                pdo.fields.push((address, width, bits::get(payload, offset, width.min(64))));
            }
            offset += usize::from(width);
        }
        pdo.expected = offset.div_ceil(8);
        pdo
    }

    fn sdo(&mut self, node_id: u8, server: u8, is_request: bool, message: [u8; 8]) -> Message {
        let channel = self.channels.entry((node_id, server)).or_default();
        let (address, is_write, step) =
            if is_request { channel.request(message) } else { channel.answer(message) };
        let written = channel.take_written();
        if let Some((address, value)) = written {
            self.note(node_id, address, &value);
        }
        Message::Sdo(SdoMessage { node_id, server, is_request, address, is_write, step })
    }

    /// A node has confirmed that it took this value.
    fn note(&mut self, node_id: u8, address: Address, value: &[u8]) {
        let Some(node) = self.nodes.get_mut(&node_id).filter(|_| is_communication(address.index)) else {
            return;
        };
        let Ok(slot) = node.find(address) else { return };
        node.set(slot, bits::from_le(value));
        if services::is_parameter(address.index) || is_cob_id(address) {
            self.services = services::all(&self.nodes);
        }
    }
}

fn state(node_id: u8, byte: u8) -> Message {
    const TOGGLE: u8 = 1 << 7;
    match byte {
        0 => Message::BootUp(node_id),
        _ => {
            Message::State { node_id, state: NmtState::decode(&[byte & !TOGGLE]), toggle: byte & TOGGLE != 0 }
        }
    }
}
