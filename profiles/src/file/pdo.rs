//! The PDOs of a profile file: `[[rpdo]]` and `[[tpdo]]` tables, which stand for their communication and mapping
//! objects (CiA 301 v4.2, sections 7.5.2.35 to 7.5.2.38).

mod map;
mod traits;

use od::{Access, DataType, Direction, Entry, Initial, Mapping, Object, PdoTraits, Range, Value};

use super::default;
use super::group::Place;
use super::object::Objects;
use super::reader::{Node, Scalar, Spanned, Table};
use crate::Report;
use crate::profile::Later;

pub(super) use map::address;

/// What tells the two kinds of PDO apart.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    key: &'static str,
    name: &'static str,
    direction: Direction,
    communication: u16,
    mapping: u16,
    /// COB-ID of PDO 1 of node 0 in the pre-defined connection set (CiA 301 v4.2, table 38).
    first_cob_id: u32,
    flags: u32,
}

pub(super) const RECEIVE: Kind = Kind {
    key: "rpdo",
    name: "RPDO",
    direction: Direction::Receive,
    communication: 0x1400,
    mapping: 0x1600,
    first_cob_id: 0x200,
    flags: 0,
};

pub(super) const TRANSMIT: Kind = Kind {
    key: "tpdo",
    name: "TPDO",
    direction: Direction::Transmit,
    communication: 0x1800,
    mapping: 0x1A00,
    first_cob_id: 0x180,
    flags: NO_RTR,
};

/// Bit 31 of a PDO's COB-ID: the PDO does not exist.
const NOT_VALID: u32 = 1 << 31;
/// Bit 30 of a TPDO's COB-ID: it cannot be asked for by a remote frame.
const NO_RTR: u32 = 1 << 30;
/// PDOs 1 to this have a COB-ID in the pre-defined connection set, 0x100 apart.
const PREDEFINED: u16 = 4;
/// Entries that can be mapped into one PDO unless it says otherwise: as many as there are bytes in a CAN frame.
const USUAL_CAPACITY: u8 = 8;
const HIGHEST_NUMBER: u16 = 512;
const EVENT_DRIVEN: u8 = 255;
const EVERY_SYNC: u8 = 1;
/// The highest transmission type that is synchronous.
const SLOWEST_SYNC: i128 = 240;

/// Reads the PDOs of one kind, adds their objects and says how many there are.
pub(super) fn read_all(file: &mut Table<'_, '_>, kind: Kind, objects: &mut Objects) -> u16 {
    let nodes = file.get::<Vec<Node>>(kind.key).unwrap_or_default();
    read_list(&nodes, kind, objects, file.report)
}

/// Reads these PDOs, adds their objects and says how many there are.
pub(super) fn read_list(nodes: &[Node<'_>], kind: Kind, objects: &mut Objects, report: &mut Report) -> u16 {
    nodes.iter().fold(0, |sum: u16, node| sum.saturating_add(read(node.clone(), kind, objects, report)))
}

/// Reads the PDO `number`, or the run of equal ones from `number` to `last`, and says how many these are.
fn read(node: Node<'_>, kind: Kind, objects: &mut Objects, report: &mut Report) -> u16 {
    let span = node.span();
    let mut table = node.open(report);
    let place = objects.place;
    let highest = if place.axis.is_some() { Place::PDOS } else { HIGHEST_NUMBER };
    let number = table.require_in("number", 1..=highest);
    let lowest_last = number.unwrap_or(1);
    let last = if table.has("last") { table.require_in("last", lowest_last..=highest) } else { number };
    if place.axis.is_some() && table.has("cob_id") {
        let help = "leave `cob_id` out: the master gives those of axes 2 and up".to_owned();
        table.report.error(&table.key_span("cob_id"), "PDOs of several axes cannot have one COB-ID", help);
    }
    let (number, last) = (number.map(|n| place.pdo(n)), last.map(|n| place.pdo(n)));
    let cob_ids = CobIds::read(&mut table, kind, last);
    let capacity = if table.has("capacity") {
        table.require_in("capacity", 1..=Mapping::MAX_FIELDS as u8)
    } else {
        Some(USUAL_CAPACITY)
    };
    let capacity = capacity.unwrap_or(USUAL_CAPACITY);
    let members = communication_members(&mut table, kind);
    let map = table.require::<Vec<Spanned<&str>>>("map").unwrap_or_default();
    let parameters = map::parameters(&map, capacity, kind, objects, table.report);
    let later = table.get::<&str>("later");
    let traits = traits::read(&mut table, kind, objects);
    table.finish();
    let (Some(first), Some(last)) = (number, last) else { return 1 };
    for number in first..=last {
        let cob_id = u32_entry(1, &format!("COB-ID used by {}", kind.name), cob_ids.of(number, first));
        let members = [cob_id].into_iter().chain(members.iter().cloned()).collect();
        let name = format!("{} communication parameter {number}", kind.name);
        objects.push(Object::record(kind.communication + number - 1, name, members), span.clone());
        objects.push(mapping_object(kind, number, capacity, &parameters), span.clone());
        let postpone = |what: &str| Later {
            index: kind.mapping + number - 1,
            subs: 0..=capacity,
            what: what.to_owned(),
        };
        objects.later.extend(later.map(postpone));
        objects.pdos.extend(traits.clone().map(|traits| PdoTraits { number, ..traits }));
    }
    last - first + 1
}

/// The sub-indices of a communication record but for the COB-ID.
fn communication_members(table: &mut Table<'_, '_>, kind: Kind) -> Vec<Entry> {
    let mut members = vec![
        transmission(table),
        entry(3, "Inhibit time", DataType::Unsigned16, table.get::<u16>("inhibit").unwrap_or(0).into()),
        entry(5, "Event timer", DataType::Unsigned16, table.get::<u16>("event_timer").unwrap_or(0).into()),
    ];
    if kind.direction == Direction::Transmit {
        let start = table.get::<u8>("sync_start").unwrap_or(0);
        members.push(entry(6, "SYNC start value", DataType::Unsigned8, start.into()));
    }
    members
}

/// The COB-IDs of a run of PDOs: `cob_id` for the first and one more for each that follows, or those of the
/// pre-defined connection set. Bit 31 is set unless the PDO is `enabled`.
struct CobIds {
    kind: Kind,
    given: Option<Initial>,
    enabled: Option<bool>,
}

impl Kind {
    pub(super) fn is_receive(self) -> bool {
        self.direction == Direction::Receive
    }
}

impl CobIds {
    /// Reads the COB-IDs of PDOs up to `last`.
    fn read(table: &mut Table<'_, '_>, kind: Kind, last: Option<u16>) -> Self {
        let given = table.get::<Spanned<Scalar<'_>>>("cob_id");
        let given = given.map(|scalar| default::initial(DataType::Unsigned32, &scalar, None, table.report));
        let enabled = table.get::<bool>("enabled");
        if enabled == Some(true) && given.is_none() && last.is_some_and(|last| last > PREDEFINED) {
            let help = "add `cob_id = ` or `enabled = false`".to_owned();
            table.report.error(&table.key_span("enabled"), "only PDOs 1-4 have a COB-ID of their own", help);
        }
        Self { kind, given: given.flatten(), enabled }
    }

    /// The COB-ID of PDO `number` in a run that begins at `first`.
    fn of(&self, number: u16, first: u16) -> Initial {
        let is_predefined = number <= PREDEFINED;
        let enabled = self.enabled.unwrap_or(is_predefined || self.given.is_some());
        let flags = self.kind.flags | if enabled { 0 } else { NOT_VALID };
        let step = u32::from(number - first);
        match &self.given {
            Some(Initial::PlusNodeId(base)) => Initial::PlusNodeId(base.wrapping_add(step) | flags),
            Some(Initial::Value(value)) => {
                let cob_id = (value.raw() as u32).wrapping_add(step) | flags;
                Initial::Value(Value::Fixed(cob_id.into()))
            }
            None if is_predefined => {
                let base = self.kind.first_cob_id + 0x100 * (u32::from(number) - 1);
                Initial::PlusNodeId(base | flags)
            }
            None => Initial::Value(Value::Fixed(flags.into())),
        }
    }
}

/// The transmission type, synchronous ones only if the table says so.
fn transmission(table: &mut Table<'_, '_>) -> Entry {
    let sync_only = table.get::<bool>("sync_only").unwrap_or(false);
    let transmission = table.get::<Spanned<u8>>("transmission");
    if let Some(code) = &transmission
        && matches!(code.get_ref(), 241..=251)
    {
        let help = "write 0-240 (synchronous), 252, 253 (on request) or 254, 255 (event-driven)".to_owned();
        table.report.error(&code.span(), "transmission types 241-251 are reserved", help);
    }
    let usual = if sync_only { EVERY_SYNC } else { EVENT_DRIVEN };
    let value = transmission.map_or(usual, Spanned::into_inner);
    let range = sync_only.then_some(Range::Integer { min: 0, max: SLOWEST_SYNC });
    Entry { range, ..entry(2, "Transmission type", DataType::Unsigned8, value.into()) }
}

fn mapping_object(kind: Kind, number: u16, capacity: u8, parameters: &[u32]) -> Object {
    let members = (1..=capacity).map(|sub| {
        let parameter = parameters.get(usize::from(sub) - 1).copied().unwrap_or(0);
        u32_entry(sub, &format!("Application object {sub}"), Initial::Value(Value::Fixed(parameter.into())))
    });
    let name = format!("{} mapping parameter {number}", kind.name);
    let mut object = Object::record(kind.mapping + number - 1, name, members.collect());
    if let Some(count) = object.entries.first_mut() {
        count.name = format!("Number of mapped application objects in {}", kind.name);
        count.access = Access::ReadWrite;
        count.initial = Initial::Value(Value::Fixed(parameters.len() as u64));
    }
    object
}

fn entry(sub: u8, name: &str, data_type: DataType, value: u64) -> Entry {
    Entry::new(sub, name, data_type, Access::ReadWrite).with_value(Value::Fixed(value))
}

fn u32_entry(sub: u8, name: &str, initial: Initial) -> Entry {
    Entry { initial, ..Entry::new(sub, name, DataType::Unsigned32, Access::ReadWrite) }
}
