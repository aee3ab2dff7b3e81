//! Process data: what PDOs carry and when they go (CiA 301 v4.2, sections 7.2.2 and 7.5.2.35-38).

mod mpdo;
mod pace;
mod parameters;
mod rpdo;
mod rules;
mod shape;
mod tpdo;

use od::{AbortCode, Address, Dictionary, Direction, Instant, PdoTraits, Schema};

pub(crate) use mpdo::{Message, Mode, field};
pub(crate) use pace::Pace;
pub(crate) use parameters::inhibit_time;
pub(crate) use rpdo::{Reception, Rpdo};
pub(crate) use rules::check_cob_id;
pub(crate) use tpdo::{Occasion, Tpdo};

use crate::communication::{MAX_PDOS, RPDO_COMMUNICATION, RPDO_MAPPING, TPDO_COMMUNICATION, TPDO_MAPPING};
use crate::{Frame, Id, NodeError};
use mpdo::Lists;
use parameters::Parameters;
use shape::Shape;

/// Bits of a classic CAN frame's data field.
const ROOM: usize = 64;

/// All PDOs of a node.
#[derive(Debug)]
pub(crate) struct Pdos {
    pub(crate) receive: Vec<Rpdo>,
    pub(crate) transmit: Vec<Tpdo>,
    /// What multiplexed ones carry.
    pub(crate) lists: Lists,
}

impl Pdos {
    /// The PDOs that `communication` has parameters for, their default mappings checked.
    pub(crate) fn new(communication: &Dictionary, application: &Schema) -> Result<Self, NodeError> {
        let receive = all_parameters(communication, application, Direction::Receive)?;
        let transmit = all_parameters(communication, application, Direction::Transmit)?;
        Ok(Self {
            receive: receive.into_iter().map(|p| Rpdo::new(p, communication)).collect(),
            transmit: transmit.into_iter().map(|p| Tpdo::new(p, communication)).collect(),
            lists: Lists::default(),
        })
    }

    /// Makes the PDOs, which still have their default mappings, as the device says.
    pub(crate) fn shape(
        &mut self,
        traits: &[PdoTraits],
        communication: &Dictionary,
        application: &Schema,
        takes_time: bool,
    ) {
        let shape = |parameters: &Parameters| {
            let is_meant = |t: &&PdoTraits| {
                t.direction == parameters.direction && t.number.checked_sub(1) == Some(parameters.number)
            };
            let count = parameters.count(communication);
            let mapping = parameters.mapping(communication, application, count).unwrap_or_default();
            let traits = traits.iter().find(is_meant);
            traits.map_or_else(Shape::default, |t| Shape::new(t, mapping, application, takes_time))
        };
        self.receive.iter_mut().for_each(|r| r.shape = shape(&r.parameters));
        self.transmit.iter_mut().for_each(|t| t.shape = shape(&t.parameters));
    }

    /// Takes over all parameters, as a reset does.
    pub(crate) fn reload_all(&mut self, now: Instant, communication: &Dictionary, application: &Schema) {
        for rpdo in &mut self.receive {
            rpdo.reload(communication, application);
            rpdo.reception = Reception::Good;
            rpdo.watch.stop();
        }
        self.transmit.iter_mut().for_each(|t| t.reload(now, communication, application));
        self.lists.reload(communication, application);
    }

    /// Takes over the parameters of the PDO that the object `index` belongs to; returns whether it does.
    pub(crate) fn reload(
        &mut self,
        now: Instant,
        index: u16,
        communication: &Dictionary,
        application: &Schema,
    ) -> bool {
        if mpdo::is_list(index) {
            self.lists.reload(communication, application);
        }
        let Some(record) = Record::at(index) else { return false };
        let is_meant = |p: &Parameters| p.direction == record.direction && p.number == record.number;
        self.receive
            .iter_mut()
            .filter(|r| is_meant(&r.parameters))
            .for_each(|r| r.reload(communication, application));
        for tpdo in self.transmit.iter_mut().filter(|t| is_meant(&t.parameters)) {
            tpdo.reload(now, communication, application);
            if tpdo.scans() {
                self.lists.start();
            }
        }
        true
    }

    /// Which PDO the object `index` belongs to, and its position among its kind.
    pub(crate) fn position(&self, index: u16) -> Option<(Direction, usize)> {
        let Record { direction, number, .. } = Record::at(index)?;
        let position = match direction {
            Direction::Receive => self.receive.iter().position(|r| r.parameters.number == number),
            Direction::Transmit => self.transmit.iter().position(|t| t.parameters.number == number),
        };
        position.map(|position| (direction, position))
    }

    /// Ends the supervision of the RPDO that the object `index` belongs to. Returns its number if that ends an error.
    pub(crate) fn acquit(&mut self, index: u16) -> Option<u16> {
        let record = Record::at(index).filter(|record| record.direction == Direction::Receive)?;
        let rpdo = self.receive.iter_mut().find(|r| r.parameters.number == record.number)?;
        rpdo.watch.stop().then_some(rpdo.number())
    }

    /// The number of an RPDO that has just turned out to be late.
    pub(crate) fn expire(&mut self, now: Instant) -> Option<u16> {
        self.receive.iter_mut().find_map(|r| r.watch.expire(now).then_some(r.number()))
    }

    /// When the next RPDO is late.
    pub(crate) fn poll_late(&self) -> Option<Instant> {
        self.receive.iter().filter_map(|r| r.watch.deadline()).min()
    }

    /// Starts anew, as after a change of the NMT state.
    pub(crate) fn restart(&mut self, now: Instant) {
        self.receive.iter_mut().for_each(Rpdo::stop);
        self.transmit.iter_mut().for_each(|t| t.start(now));
        self.lists.start();
    }

    /// Sends what has changed of the objects in the scanner lists, by the TPDO of source address mode.
    pub(crate) fn scan(
        &mut self,
        now: Instant,
        node_id: u8,
        application: &Dictionary,
        has_changed: bool,
    ) -> impl Iterator<Item = Frame> {
        self.lists.notice(has_changed);
        let Self { transmit, lists, .. } = self;
        let tpdo = transmit.iter().find(|tpdo| tpdo.scans());
        core::iter::from_fn(move || {
            let tpdo = tpdo?;
            let message = lists.poll(now, node_id, tpdo.inhibit, application)?;
            Some(Frame::new(tpdo.cob_id.id(), &message.encode()))
        })
    }

    /// When a change waits to be sent by it.
    pub(crate) fn scan_timeout(&self) -> Option<Instant> {
        self.lists.poll_timeout().filter(|_| self.transmit.iter().any(Tpdo::scans))
    }

    /// Whether the parameter at `address` may become `raw`.
    pub(crate) fn check(
        &self,
        communication: &Dictionary,
        application: &Schema,
        address: Address,
        raw: u64,
    ) -> Result<(), AbortCode> {
        if mpdo::is_list(address.index) {
            return mpdo::check_entry(communication, application, address, raw);
        }
        let Some(record) = Record::at(address.index) else { return Ok(()) };
        let receive = self.receive.iter().map(|r| &r.parameters);
        let mut all = receive.chain(self.transmit.iter().map(|t| &t.parameters));
        let Some(parameters) = all.find(|p| p.direction == record.direction && p.number == record.number)
        else {
            return Ok(());
        };
        if record.is_mapping {
            if let Some(mode) = Mode::of(raw).filter(|_| address.sub == 0) {
                rules::check_mapping_change(parameters, communication)?;
                let is_scanning = self.transmit.iter().any(|t| t.mode == Some(Mode::Source));
                return mpdo::check_mode(mode, record.direction, communication, is_scanning);
            }
            rules::check_mapping(parameters, communication, application, address.sub, raw)
        } else {
            rules::check_communication(parameters, communication, address.sub, raw)
        }
    }

    /// Whether exactly one TPDO has this identifier, and it is no multiplexed one.
    pub(crate) fn is_tpdo(&self, id: Id) -> bool {
        let mut own = self.transmit.iter().filter(|t| t.cob_id.is_valid() && t.cob_id.id() == id);
        own.next().is_some_and(|tpdo| tpdo.mode.is_none()) && own.next().is_none()
    }

    /// Position and identifier of every active RPDO.
    pub(crate) fn rpdo_ids(&self) -> impl Iterator<Item = (usize, Id)> {
        let rpdos = self.receive.iter().enumerate().filter(|(_, r)| r.is_active());
        rpdos.map(|(position, r)| (position, r.cob_id.id()))
    }

    /// Position and identifier of every valid TPDO that may be asked for by RTR.
    pub(crate) fn request_ids(&self) -> impl Iterator<Item = (usize, Id)> {
        let cob_ids = self.transmit.iter().map(|t| t.cob_id).enumerate();
        cob_ids.filter(|(_, c)| c.is_valid() && c.allows_rtr()).map(|(position, c)| (position, c.id()))
    }
}

/// Which PDO a parameter object belongs to.
struct Record {
    direction: Direction,
    number: u16,
    is_mapping: bool,
}

impl Record {
    fn at(index: u16) -> Option<Self> {
        use Direction::{Receive, Transmit};
        let bases = [
            (RPDO_COMMUNICATION, Receive, false),
            (RPDO_MAPPING, Receive, true),
            (TPDO_COMMUNICATION, Transmit, false),
            (TPDO_MAPPING, Transmit, true),
        ];
        bases.into_iter().find_map(|(base, direction, is_mapping)| {
            let number = index.checked_sub(base).filter(|n| *n < MAX_PDOS)?;
            Some(Self { direction, number, is_mapping })
        })
    }
}

/// The parameters of every PDO that way.
fn all_parameters(
    communication: &Dictionary,
    application: &Schema,
    direction: Direction,
) -> Result<Vec<Parameters>, NodeError> {
    let schema = communication.schema();
    let found = (0..MAX_PDOS).filter_map(|number| Parameters::find(schema, direction, number));
    found
        .map(|parameters| {
            let count = parameters.count(communication);
            let number = parameters.number + 1;
            let refused = |code| NodeError::Mapping { direction: name(direction), number, code };
            match Mode::of(count) {
                Some(mode) => mpdo::check_mode(mode, direction, communication, false),
                None => parameters.mapping(communication, application, count).map(|_| ()),
            }
            .map_err(refused)?;
            Ok(parameters)
        })
        .collect()
}

const fn name(direction: Direction) -> &'static str {
    match direction {
        Direction::Receive => "RPDO",
        Direction::Transmit => "TPDO",
    }
}
