//! PDOs of a data sheet: their records, and whether a node can have their default mappings (CiA 301 v4.2, sections
//! 7.5.2.35 to 7.5.2.38).

use od::{
    AbortCode, Access, Address, DataType, Direction, Entry, Initial, Mappable, Mapping, ObjectKind, Schema,
    Value,
};

use super::device::Sheet;
use super::entry::Draft;
use super::object::{Drafted, Objects};
use crate::Report;

/// Most PDOs of one direction.
const MOST: u16 = 512;
/// Objects that can be mapped into a PDO that is not described: one for each byte of a CAN frame.
const CAPACITY: u8 = 8;
/// Bits of a CAN frame.
const ROOM: usize = 64;
const APPLICATION: u16 = 0x2000;
/// Numbers of mapped objects that stand for multiplexed PDOs of source and destination address mode.
const MULTIPLEXED: core::ops::RangeInclusive<u64> = 0xFE..=0xFF;

/// What tells RPDOs and TPDOs apart.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    name: &'static str,
    direction: Direction,
    communication: u16,
    mapping: u16,
    /// Lists that multiplexed ones need.
    lists: (u16, u16),
}

pub(super) const RECEIVE: Kind = Kind {
    name: "RPDO",
    direction: Direction::Receive,
    communication: 0x1400,
    mapping: 0x1600,
    lists: (0x1FD0, 0x1FFF),
};
pub(super) const TRANSMIT: Kind = Kind {
    name: "TPDO",
    direction: Direction::Transmit,
    communication: 0x1800,
    mapping: 0x1A00,
    lists: (0x1FA0, 0x1FCF),
};

/// How many PDOs have a communication record.
pub(super) fn number_of(kind: Kind, objects: &Objects) -> u16 {
    let records = objects.range(kind.communication..kind.communication + MOST);
    u16::try_from(records.count()).unwrap_or(MOST)
}

/// Adds the records of PDOs that `CompactPDO` leaves out: its bits say which sub-indices of the communication record
/// there are.
pub(super) fn supply(kind: Kind, sheet: &Sheet, objects: &mut Objects) {
    let Some(mask) = sheet.compact_pdo.filter(|mask| *mask != 0) else { return };
    let said = if kind.direction == Direction::Receive { &sheet.rpdos } else { &sheet.tpdos };
    let pdos = said.as_ref().map_or(0, |(number, _)| *number);
    for number in 0..pdos {
        let (communication, mapping) = (kind.communication + number, kind.mapping + number);
        let members = [
            (1, "COB-ID", DataType::Unsigned32),
            (2, "Transmission type", DataType::Unsigned8),
            (3, "Inhibit time", DataType::Unsigned16),
            (4, "Compatibility entry", DataType::Unsigned8),
            (5, "Event timer", DataType::Unsigned16),
            (6, "SYNC start value", DataType::Unsigned8),
        ];
        let members = members.into_iter().filter(|(sub, ..)| mask >> (sub - 1) & 1 == 1);
        let entry = |(sub, name, data_type)| Entry::new(sub, name, data_type, Access::ReadWrite);
        let name = format!("{} communication parameter {}", kind.name, number + 1);
        objects
            .entry(communication)
            .or_insert_with(|| record(name, members.map(entry).collect(), false, sheet));
        let name = format!("{} mapping parameter {}", kind.name, number + 1);
        let member = |sub| entry((sub, "Application object", DataType::Unsigned32));
        let members = (1..=CAPACITY).map(member);
        objects.entry(mapping).or_insert_with(|| record(name, members.collect(), true, sheet));
    }
}

fn record(name: String, members: Vec<Entry>, is_mapping: bool, sheet: &Sheet) -> Drafted {
    let highest = members.last().map_or(0, |member| member.sub);
    let (access, value) = if is_mapping { (Access::ReadWrite, 0) } else { (Access::Const, highest) };
    let count = Entry::new(0, "Highest sub-index supported", DataType::Unsigned8, access);
    let count = count.with_value(Value::Fixed(value.into()));
    let entries = [count].into_iter().chain(members).map(|entry| Draft::supplied(entry, &sheet.span));
    Drafted { name, kind: ObjectKind::Record, entries: entries.collect(), span: sheet.span.clone() }
}

/// Gives mapping records whose count the file leaves open that of the objects in them, and makes what is mapped by default
/// mappable.
pub(super) fn prepare(kind: Kind, objects: &mut Objects, report: &mut Report) {
    for number in 0..MOST {
        let Some(mapping) = objects.get_mut(&(kind.mapping + number)) else { continue };
        let parameters: Vec<_> = (1..=Mapping::MAX_FIELDS as u8)
            .map_while(|sub| mapping.entry(sub).map(|draft| (draft.number() as u32, draft.place().clone())))
            .collect();
        let used = parameters.iter().take_while(|(parameter, _)| *parameter != 0).count();
        let Some(count) = mapping.entry_mut(0) else { continue };
        if count.value.is_none() {
            count.entry.initial = Initial::Value(Value::Fixed(used as u64));
        }
        let count = usize::try_from(count.number()).unwrap_or(0);
        for (parameter, place) in parameters.into_iter().take(count) {
            let [width, sub, low, high] = parameter.to_le_bytes();
            let address = Address::new(u16::from_le_bytes([low, high]), sub);
            let Some(object) = objects.get_mut(&address.index).filter(|_| address.index >= APPLICATION)
            else {
                continue;
            };
            let Some(Draft { entry, .. }) = object.entry_mut(sub) else { continue };
            let part = part(entry, width);
            if part.is_none() && entry.data_type.bits() != Some(width) {
                continue;
            }
            if allow(entry, kind.direction) {
                let message =
                    format!("{address} is mapped by default: it can be, whatever its `PDOMapping` says");
                report.warn(&place, message, None);
            }
            if part.is_some() && entry.mappable != Mappable::No && entry.part != part {
                entry.part = part;
                let message =
                    format!("a PDO carries the lower {width} bits of {address} ({})", entry.data_type);
                report.warn(&place, message, None);
            }
        }
    }
}

/// The integer of so many bits whose place in a PDO the low bits of a wider one can take.
fn part(entry: &Entry, width: u8) -> Option<DataType> {
    let whole = entry.data_type;
    whole.integer_limits().filter(|_| whole.bits().is_some_and(|bits| width < bits))?;
    let suits = |part: &DataType| {
        part.integer_limits().is_some() && part.bits() == Some(width) && part.is_signed() == whole.is_signed()
    };
    DataType::ALL.iter().copied().find(suits)
}

/// Makes an entry mappable in a direction that its access allows; whether it was not.
fn allow(entry: &mut Entry, direction: Direction) -> bool {
    let (is_allowed, access_allows) = match direction {
        Direction::Receive => (entry.mappable.receive(), entry.access.is_writable()),
        Direction::Transmit => (entry.mappable.transmit(), entry.access.is_readable()),
    };
    if is_allowed || !access_allows {
        return false;
    }
    entry.mappable = match (entry.mappable, direction) {
        (Mappable::No, Direction::Receive) => Mappable::Receive,
        (Mappable::No, Direction::Transmit) => Mappable::Transmit,
        (Mappable::Receive | Mappable::Transmit | Mappable::Both, _) => Mappable::Both,
    };
    true
}

/// Empties the default mappings that no node of this device can have.
pub(super) fn check(kind: Kind, objects: &mut Objects, application: &Schema, report: &mut Report) {
    let (first, last) = kind.lists;
    let has_lists = objects.range(first..=last).next().is_some();
    for number in 0..MOST {
        let (communication, index) = (kind.communication + number, kind.mapping + number);
        let is_complete = [1, 2]
            .iter()
            .all(|sub| objects.get(&communication).is_some_and(|object| object.entry(*sub).is_some()));
        let has_record = objects.contains_key(&communication);
        let Some(mapping) = objects.get_mut(&index) else {
            if let Some(object) = objects.get(&communication) {
                let message =
                    format!("{} {} is not served: there is no 0x{index:04X}", kind.name, number + 1);
                report.warn(&object.span, message, None);
            }
            continue;
        };
        if !is_complete {
            let lack =
                if has_record { "0x{:04X} has not both sub-index 1 and 2" } else { "there is no 0x{:04X}" };
            let lack = lack.replace("{:04X}", &format!("{communication:04X}"));
            let message = format!("{} {} is not served: {lack}", kind.name, number + 1);
            report.warn(&mapping.span, message, None);
        }
        let refusal = refusal(kind, mapping, application, has_lists);
        if let Some(reason) = refusal
            && let Some(count) = mapping.entry_mut(0)
        {
            let message =
                format!("the default mapping of {} {} is left out: {reason}", kind.name, number + 1);
            report.warn(&count.place().clone(), message, None);
            count.entry.initial = Initial::Value(Value::Fixed(0));
        }
    }
}

/// Why a node cannot have the default mapping.
fn refusal(kind: Kind, mapping: &Drafted, application: &Schema, has_lists: bool) -> Option<String> {
    let count = mapping.entry(0)?.number();
    if MULTIPLEXED.contains(&count) {
        return (!has_lists).then(|| "the device has no lists for multiplexed PDOs".to_owned());
    }
    let parameters: Vec<u32> = (1..=Mapping::MAX_FIELDS as u8)
        .map_while(|sub| mapping.entry(sub).map(|draft| draft.number() as u32))
        .take(usize::try_from(count).unwrap_or(usize::MAX))
        .collect();
    if parameters.len() as u64 != count {
        return Some(format!("it has {count} objects, but {} are described", parameters.len()));
    }
    let bad = parameters.iter().find_map(|parameter| {
        let code = Mapping::field(application, kind.direction, *parameter).err()?;
        Some(format!("0x{parameter:08X}: {}", reason(*parameter, code)))
    });
    let whole = || Mapping::new(application, kind.direction, ROOM, parameters.iter().copied()).err();
    bad.or_else(|| whole().map(|code| code.text().to_owned()))
}

fn reason(parameter: u32, code: AbortCode) -> &'static str {
    let index = parameter >> 16;
    if (0x1000..u32::from(APPLICATION)).contains(&index) {
        "objects below 0x2000 belong to the bus, no PDO carries them"
    } else {
        code.text()
    }
}
