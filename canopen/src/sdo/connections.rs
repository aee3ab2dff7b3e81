//! The SDO servers of a node: the default one and those that a master may set up (CiA 301 v4.2, section 7.5.2.33).

use core::time::Duration;

use od::{Address, Dictionary, Instant, Schema};

use super::server::Server;
use crate::cob_id::{SDO_RECEIVE, SDO_TRANSMIT};
use crate::{CobId, Frame, Id};

/// The records of the further servers; the one before them describes the default server.
pub(crate) const FURTHER: core::ops::RangeInclusive<u16> = 0x1201..=0x127F;
/// The records of clients (CiA 301 v4.2, section 7.5.2.34).
pub(super) const CLIENTS: core::ops::RangeInclusive<u16> = 0x1280..=0x12FF;
/// Sub-index of the COB-ID from client to server.
pub(super) const REQUEST: u8 = 1;
/// Sub-index of the COB-ID from server to client.
pub(super) const ANSWER: u8 = 2;

/// Whether `address` is a COB-ID of a further server or of a client.
pub(crate) fn is_cob_id(address: Address) -> bool {
    let is_record = FURTHER.contains(&address.index) || CLIENTS.contains(&address.index);
    is_record && matches!(address.sub, REQUEST | ANSWER)
}

/// One server and the identifiers it talks with.
#[derive(Debug)]
pub(crate) struct Connection {
    pub(crate) server: Server,
    index: u16,
    /// Of requests and of answers; `None` while it is off.
    ids: Option<(Id, Id)>,
}

/// All servers of a node; the first is the default one.
#[derive(Debug)]
pub(crate) struct Connections(Vec<Connection>);

impl Connections {
    /// The default server of node `node_id` and those that `communication` has records for.
    pub(crate) fn new(node_id: u8, communication: &Schema) -> Self {
        let default =
            Connection { server: Server::new(), index: FURTHER.start() - 1, ids: Some(default_ids(node_id)) };
        let has = |index, sub| communication.slot(Address::new(index, sub)).is_some();
        let further = FURTHER.filter(|index| has(*index, REQUEST) && has(*index, ANSWER));
        let further = further.map(|index| Connection { server: Server::new(), index, ids: None });
        Self(core::iter::once(default).chain(further).collect())
    }

    /// Makes the default server that of another Node-ID.
    pub(crate) fn set_node_id(&mut self, node_id: u8) {
        if let Some(default) = self.0.first_mut() {
            default.ids = Some(default_ids(node_id));
        }
    }

    /// The server at `position`.
    pub(crate) fn get_mut(&mut self, position: usize) -> Option<&mut Connection> {
        self.0.get_mut(position)
    }

    /// Takes over the COB-IDs of all further servers; one that changes forgets its transfer.
    pub(crate) fn reload(&mut self, communication: &Dictionary) {
        for connection in self.0.iter_mut().skip(1) {
            let ids = connection.configured(communication);
            if ids != connection.ids {
                connection.ids = ids;
                connection.server.reset();
            }
        }
    }

    /// Whether `index` is the record of a further server.
    pub(crate) fn has(&self, index: u16) -> bool {
        self.0.iter().skip(1).any(|connection| connection.index == index)
    }

    /// Position and identifier of requests to every server that is on.
    pub(crate) fn request_ids(&self) -> impl Iterator<Item = (usize, Id)> {
        let connections = self.0.iter().enumerate();
        connections.filter_map(|(position, connection)| Some((position, connection.ids?.0)))
    }

    /// Whether a server that is on answers with this identifier.
    pub(crate) fn answers_with(&self, id: Id) -> bool {
        self.0.iter().filter_map(|connection| connection.ids).any(|(_, answer)| answer == id)
    }

    /// Ends every transfer without a word.
    pub(crate) fn reset(&mut self) {
        self.0.iter_mut().for_each(|connection| connection.server.reset());
    }

    /// Makes `timeout` the longest silence of a client.
    pub(crate) fn set_timeout(&mut self, timeout: Duration) {
        self.0.iter_mut().for_each(|connection| connection.server.set_timeout(timeout));
    }

    /// When the silence of some client is too long.
    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.0.iter().filter_map(|connection| connection.server.poll_timeout()).min()
    }

    /// The next thing to be said to clients that are silent for too long.
    pub(crate) fn handle_timeout(&mut self, now: Instant) -> Option<Frame> {
        self.0.iter_mut().find_map(|connection| {
            let answer = connection.server.handle_timeout(now)?;
            connection.frame(answer)
        })
    }
}

/// The identifiers of requests and answers of the default server (CiA 301 v4.2, table 39).
fn default_ids(node_id: u8) -> (Id, Id) {
    let node_id = u16::from(node_id);
    (Id::Standard(SDO_RECEIVE + node_id), Id::Standard(SDO_TRANSMIT + node_id))
}

impl Connection {
    /// The frame that carries `answer`.
    pub(crate) fn frame(&self, answer: [u8; 8]) -> Option<Frame> {
        self.ids.map(|(_, id)| Frame::new(id, &answer))
    }

    /// The next segment that is to be sent without being asked for.
    pub(crate) fn poll_segment(&mut self) -> Option<Frame> {
        let segment = self.server.poll_segment()?;
        self.frame(segment)
    }

    /// A server is on when both its COB-IDs are valid.
    fn configured(&self, communication: &Dictionary) -> Option<(Id, Id)> {
        let id = |sub| {
            let slot = communication.find(Address::new(self.index, sub)).ok()?;
            Some(CobId(communication.raw(slot) as u32)).filter(|c| c.is_valid()).map(CobId::id)
        };
        Some((id(REQUEST)?, id(ANSWER)?))
    }
}
