//! Which identifier is for what.

use std::collections::BTreeMap;

use od::{Address, Dictionary, Direction};

use crate::cob_id::{NMT, NMT_ERROR_CONTROL, SDO_RECEIVE, SDO_TRANSMIT};
use crate::communication::{
    COB_ID_EMCY, COB_ID_SYNC, COB_ID_TIME, MAX_PDOS, RPDO_COMMUNICATION, TPDO_COMMUNICATION, cob_id,
};
use crate::sdo::FURTHER;
use crate::{CobId, Id, lss};

/// What an identifier is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Service {
    Nmt,
    Sync,
    Time,
    Emergency(u8),
    Pdo(u8, Direction, u16),
    /// With the server of this number, from zero, of a node.
    Sdo {
        node_id: u8,
        server: u8,
        is_request: bool,
    },
    ErrorControl(u8),
    Lss {
        is_master: bool,
    },
}

impl Service {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Nmt => "NMT",
            Self::Sync => "SYNC",
            Self::Time => "TIME",
            Self::Emergency(_) => "EMCY",
            Self::Pdo(..) => "PDO",
            Self::Sdo { .. } => "SDO",
            Self::ErrorControl(_) => "NMT error control",
            Self::Lss { .. } => "LSS",
        }
    }
}

/// Broadcast identifiers of the pre-defined connection set (CiA 301 v4.2, table 37).
const SYNC: u16 = 0x080;
const TIME: u16 = 0x100;
/// EMCY, plus Node-ID.
const EMERGENCY: u16 = 0x080;
/// TPDO 1 and RPDO 1, plus Node-ID; the next ones follow at this distance.
const TPDO: u16 = 0x180;
const RPDO: u16 = 0x200;
const PDO_DISTANCE: u16 = 0x100;
const PREDEFINED_PDOS: u16 = 4;

/// Whether writing to `index` may change what identifiers are for.
pub(super) fn is_parameter(index: u16) -> bool {
    let pdos = [RPDO_COMMUNICATION, TPDO_COMMUNICATION].map(|first| first..first + MAX_PDOS);
    matches!(index, COB_ID_SYNC | COB_ID_TIME | COB_ID_EMCY) || pdos.iter().any(|all| all.contains(&index))
}

/// The services of a network with these nodes. Where nodes share an identifier, who sends counts before who hears.
pub(super) fn all(nodes: &BTreeMap<u8, Dictionary>) -> BTreeMap<Id, Service> {
    let mut services = BTreeMap::new();
    let mut offer = |id: Id, service: Service| {
        services.entry(id).or_insert(service);
    };
    offer(Id::Standard(NMT), Service::Nmt);
    offer(Id::Standard(lss::ANSWER), Service::Lss { is_master: false });
    offer(Id::Standard(lss::REQUEST), Service::Lss { is_master: true });
    for node_id in 1..=127 {
        let at = |base: u16| Id::Standard(base + u16::from(node_id));
        offer(at(NMT_ERROR_CONTROL), Service::ErrorControl(node_id));
        offer(at(SDO_RECEIVE), Service::Sdo { node_id, server: 0, is_request: true });
        offer(at(SDO_TRANSMIT), Service::Sdo { node_id, server: 0, is_request: false });
    }
    for (node_id, node) in nodes {
        configured(*node_id, node, &mut offer);
    }
    for (node_id, node) in nodes {
        pdos(*node_id, node, Direction::Receive, &mut offer);
    }
    offer(Id::Standard(SYNC), Service::Sync);
    offer(Id::Standard(TIME), Service::Time);
    for node_id in (1..=127).filter(|node_id| !nodes.contains_key(node_id)) {
        let at = |base: u16| Id::Standard(base + u16::from(node_id));
        offer(at(EMERGENCY), Service::Emergency(node_id));
        for number in 0..PREDEFINED_PDOS {
            let (transmit, receive) = (TPDO + number * PDO_DISTANCE, RPDO + number * PDO_DISTANCE);
            offer(at(transmit), Service::Pdo(node_id, Direction::Transmit, number + 1));
            offer(at(receive), Service::Pdo(node_id, Direction::Receive, number + 1));
        }
    }
    services
}

/// What a known node sends and hears by its parameters, without RPDOs.
fn configured(node_id: u8, node: &Dictionary, offer: &mut impl FnMut(Id, Service)) {
    // Bits 31 and 30 of the COB-IDs of SYNC and TIME tell who produces and consumes, not whether they are valid.
    const IDENTIFIER: u32 = 0x3FFF_FFFF;
    let plain = |index| cob_id(node, index).map(|cob_id| CobId(cob_id.0 & IDENTIFIER).id());
    plain(COB_ID_SYNC).into_iter().for_each(|id| offer(id, Service::Sync));
    plain(COB_ID_TIME).into_iter().for_each(|id| offer(id, Service::Time));
    let emcy = cob_id(node, COB_ID_EMCY).filter(|cob_id| cob_id.is_valid());
    emcy.into_iter().for_each(|cob_id| offer(cob_id.id(), Service::Emergency(node_id)));
    for (server, index) in (1..).zip(FURTHER) {
        for (sub, is_request) in [(1, true), (2, false)] {
            if let Some(cob_id) = valid(node, index, sub) {
                offer(cob_id.id(), Service::Sdo { node_id, server, is_request });
            }
        }
    }
    pdos(node_id, node, Direction::Transmit, offer);
}

fn pdos(node_id: u8, node: &Dictionary, direction: Direction, offer: &mut impl FnMut(Id, Service)) {
    let base = match direction {
        Direction::Receive => RPDO_COMMUNICATION,
        Direction::Transmit => TPDO_COMMUNICATION,
    };
    for number in 0..MAX_PDOS {
        if let Some(cob_id) = valid(node, base + number, 1) {
            offer(cob_id.id(), Service::Pdo(node_id, direction, number + 1));
        }
    }
}

/// The COB-ID at `index:sub`, if there is one and it is valid.
fn valid(node: &Dictionary, index: u16, sub: u8) -> Option<CobId> {
    let slot = node.find(Address::new(index, sub)).ok()?;
    Some(CobId(node.raw(slot) as u32)).filter(|cob_id| cob_id.is_valid())
}
