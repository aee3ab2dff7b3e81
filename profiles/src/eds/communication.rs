//! What a CANopen node makes of the objects 0x1000-0x1FFF, and so needs of them (CiA 301 v4.2, section 7.5.2).

use od::{Access, Address, DataType, Entry, Initial, ObjectKind, Value, is_restricted};

use super::device::Sheet;
use super::entry::Draft;
use super::object::{Drafted, Objects};
use crate::file::NEVER_STORED;
use crate::{Report, Span};

const DEVICE_TYPE: u16 = 0x1000;
const ERROR_REGISTER: u16 = 0x1001;
const ERROR_FIELD: u16 = 0x1003;
const SYNC: Address = Address::new(0x1005, 0);
const CYCLE_PERIOD: Address = Address::new(0x1006, 0);
const TIME: Address = Address::new(0x1012, 0);
const EMCY: Address = Address::new(0x1014, 0);
const IDENTITY: u16 = 0x1018;
const SYNC_OVERFLOW: Address = Address::new(0x1019, 0);
const APPLICATION: u16 = 0x2000;

/// Bit 31 of most COB-IDs: there is no such communication object.
const NOT_VALID: u32 = 1 << 31;
/// Bit 29 of a COB-ID: the identifier has 29 bits.
const EXTENDED: u32 = 1 << 29;
/// Bits of a COB-ID that hold an identifier of 11 bits.
const IDENTIFIER: u32 = 0x7FF;
/// PDOs that have an identifier in the pre-defined connection set, and what lies between those (CiA 301 v4.2, table 39).
const PREDEFINED: u16 = 4;
const PREDEFINED_STEP: u32 = 0x100;
const EVENT_DRIVEN: u64 = 255;
/// Bit 0 of an entry of 0x1010 or 0x1011: it works on command.
const ON_COMMAND: u64 = 1;
/// The low word of 0x1000 for a drive.
const DRIVE: u64 = 402;
/// The shortest period in us that a node produces SYNC with; zero is for none.
const SHORTEST_CYCLE_US: u64 = 100;

/// The type that the standard gives the entry at `address`, if it is one that a node acts on.
pub(super) fn data_type(address: Address, is_var: bool) -> Option<DataType> {
    use DataType::{Domain, Unsigned8, Unsigned16, Unsigned32, Unsigned64, VisibleString};
    match (address.index, address.sub, is_var) {
        (0x1000 | 0x1002 | 0x1005..=0x1007 | 0x1012..=0x1014 | 0x1F80, 0, true) => Some(Unsigned32),
        (0x1001 | 0x100D | 0x1019 | 0x1022, 0, true) => Some(Unsigned8),
        (0x100C | 0x1015 | 0x1017, 0, true) => Some(Unsigned16),
        (0x1008..=0x100A, 0, true) => Some(VisibleString),
        (0x1021, 0, true) => Some(Domain),
        (_, 0, _) | (_, _, true) => None,
        (0x1003 | 0x1010 | 0x1011 | 0x1016 | 0x1018 | 0x1020 | 0x1028, ..) => Some(Unsigned32),
        (0x1029, ..) => Some(Unsigned8),
        (0x1200..=0x12FF, 1 | 2, _) => Some(Unsigned32),
        (0x1200..=0x12FF, 3, _) => Some(Unsigned8),
        (0x1400..=0x15FF | 0x1800..=0x19FF, 1, _) => Some(Unsigned32),
        (0x1400..=0x15FF | 0x1800..=0x19FF, 2 | 6, _) => Some(Unsigned8),
        (0x1400..=0x15FF | 0x1800..=0x19FF, 3 | 5, _) => Some(Unsigned16),
        (0x1600..=0x17FF | 0x1A00..=0x1BFF | 0x1FA0..=0x1FCF, ..) => Some(Unsigned32),
        (0x1FD0..=0x1FFF, ..) => Some(Unsigned64),
        _ => None,
    }
}

/// Whether sub-index 0 of this object counts what is in use, not what there is: errors, mapped objects.
pub(super) fn has_variable_count(index: u16) -> bool {
    matches!(index, ERROR_FIELD | 0x1600..=0x17FF | 0x1A00..=0x1BFF)
}

/// Completes and corrects what a node acts on: objects that every device has, types, values that would disturb the bus.
pub(super) fn mend(objects: &mut Objects, sheet: &Sheet, report: &mut Report) {
    supply_mandatory(objects, sheet, report);
    drop_misshapen(objects, report);
    for (index, object) in objects.range_mut(..APPLICATION) {
        let is_var = object.kind == ObjectKind::Var;
        for draft in &mut object.entries {
            let address = Address::new(*index, draft.entry.sub);
            check_type(address, is_var, draft, report);
            match draft.value {
                None => draft.entry.initial = usual(address, draft, sheet),
                Some(_) => check_value(address, draft, report),
            }
            draft.entry.is_volatile = NEVER_STORED.contains(index);
        }
    }
    if let Some(device_type) = objects.get(&DEVICE_TYPE).and_then(|object| object.entry(0))
        && device_type.number() & 0xFFFF == DRIVE
    {
        let message = "this is a drive of CiA 402: its objects are served, but nothing moves behind them";
        report.warn(device_type.place(), message, "take a profile with an axis to have motion".to_owned());
    }
}

/// Adds 0x1000, 0x1001 and 0x1018, which every device has (CiA 301 v4.2, table 41).
fn supply_mandatory(objects: &mut Objects, sheet: &Sheet, report: &mut Report) {
    let place = sheet.span.clone();
    let var = |index: u16, name: &str, data_type: DataType| {
        let draft = Draft::supplied(Entry::new(0, name, data_type, Access::ReadOnly), &place);
        let object = Drafted {
            name: name.to_owned(),
            kind: ObjectKind::Var,
            entries: vec![draft],
            span: place.clone(),
        };
        (index, object)
    };
    let entry = |sub, name: &str| {
        Draft::supplied(Entry::new(sub, name, DataType::Unsigned32, Access::ReadOnly), &place)
    };
    let count = Entry::new(0, "Highest sub-index supported", DataType::Unsigned8, Access::Const);
    let identity = Drafted {
        name: "Identity object".to_owned(),
        kind: ObjectKind::Record,
        entries: vec![
            Draft::supplied(count.with_value(Value::Fixed(4)), &place),
            entry(1, "Vendor-ID"),
            entry(2, "Product code"),
            entry(3, "Revision number"),
            entry(4, "Serial number"),
        ],
        span: place.clone(),
    };
    let mandatory = [
        var(DEVICE_TYPE, "Device type", DataType::Unsigned32),
        var(ERROR_REGISTER, "Error register", DataType::Unsigned8),
        (IDENTITY, identity),
    ];
    for (index, object) in mandatory {
        objects.entry(index).or_insert_with(|| {
            let message =
                format!("0x{index:04X} ({}) is missing and supplied: every device has it", object.name);
            report.warn(&place, message, None);
            object
        });
    }
}

/// Leaves out what has several entries where a node looks for a single value.
fn drop_misshapen(objects: &mut Objects, report: &mut Report) {
    objects.retain(|index, object| {
        let is_single = data_type(Address::new(*index, 0), true).is_some();
        let is_misshapen = is_single && object.kind != ObjectKind::Var;
        if is_misshapen {
            let message =
                format!("0x{index:04X} is left out: by the standard it is a VAR, without sub-indices");
            report.warn(&object.span, message, None);
        }
        !is_misshapen
    });
}

/// A node works with unsigned integers that are at least as wide as the standard has them, and with nothing else where
/// the standard has an integer.
fn check_type(address: Address, is_var: bool, draft: &mut Draft, report: &mut Report) {
    let Some(standard) = data_type(address, is_var) else { return };
    let own = draft.entry.data_type;
    if own == standard || standard.integer_limits().is_none() {
        return;
    }
    let is_integer = own.integer_limits().is_some();
    if is_integer && !own.is_signed() && own.bits() >= standard.bits() {
        let message = format!("{address} is {standard} by the standard, and {own} here");
        return report.warn(&draft.span, message, "it is served as this file says".to_owned());
    }
    report.warn(&draft.span, format!("{address} is {own} here and becomes {standard}"), None);
    let Entry { sub, name, access, initial, .. } = draft.entry.clone();
    draft.entry = Entry::new(sub, name, standard, access);
    match initial {
        Initial::PlusNodeId(_) if is_integer => draft.entry.initial = initial,
        Initial::Value(Value::Fixed(raw)) if is_integer => {
            let value = Value::integer(standard, i128::from(raw));
            draft.value = draft.value.take().filter(|_| value.is_some());
            draft.entry.initial = Initial::Value(value.unwrap_or_else(|| Value::zero(standard)));
        }
        Initial::PlusNodeId(_) | Initial::Value(_) => draft.value = None,
    }
}

/// The value of an entry for which the file has none: that of the standard, or what makes the entry work.
fn usual(address: Address, draft: &Draft, sheet: &Sheet) -> Initial {
    let fixed = |number: u64| Initial::Value(Value::Fixed(number));
    let not_valid = fixed(NOT_VALID.into());
    match (address.index, address.sub) {
        _ if draft.entry.data_type.integer_limits().is_none() => draft.entry.initial.clone(),
        _ if address == SYNC => fixed(0x80),
        _ if address == TIME => fixed(0x100),
        _ if address == EMCY => Initial::PlusNodeId(0x80),
        (0x1010 | 0x1011, 1..) => fixed(ON_COMMAND),
        (IDENTITY, sub @ 1..=3) => sheet.identity(sub).map_or(fixed(0), |number| fixed(number.into())),
        (0x1200, 1) => Initial::PlusNodeId(0x600),
        (0x1200, 2) => Initial::PlusNodeId(0x580),
        (0x1201..=0x12FF, 1 | 2) | (0x1028, 1..) => not_valid,
        (0x1400..=0x15FF, 1) => predefined(address.index - 0x1400, 0x200).unwrap_or(not_valid),
        (0x1800..=0x19FF, 1) => predefined(address.index - 0x1800, 0x180).unwrap_or(not_valid),
        (0x1400..=0x15FF | 0x1800..=0x19FF, 2) => fixed(EVENT_DRIVEN),
        _ => draft.entry.initial.clone(),
    }
}

/// The COB-ID of a PDO, by its number from 0 and the COB-ID of the first.
fn predefined(number: u16, first: u32) -> Option<Initial> {
    (number < PREDEFINED).then(|| Initial::PlusNodeId(first + PREDEFINED_STEP * u32::from(number)))
}

/// Corrects a value with which a node would harm others, or would not be what the file says.
fn check_value(address: Address, draft: &mut Draft, report: &mut Report) {
    let number = draft.number();
    let place = draft.place().clone();
    let mut replace = |draft: &mut Draft, number: u64, message: String| {
        draft.entry.initial = Initial::Value(Value::Fixed(number));
        report.warn(&place, message, None);
    };
    match (address.index, address.sub) {
        (ERROR_FIELD, 0) if number != 0 => {
            replace(draft, 0, "the error history is empty at power-on".to_owned());
        }
        _ if address == CYCLE_PERIOD && (1..SHORTEST_CYCLE_US).contains(&number) => {
            replace(draft, 0, format!("no SYNC is produced every {number} us: this becomes 0"));
        }
        _ if address == SYNC_OVERFLOW && (number == 1 || number > 240) => {
            replace(draft, 0, format!("a SYNC counter does not end at {number}: this becomes 0"));
        }
        (0x1400..=0x15FF | 0x1800..=0x19FF, 2) if matches!(number, 241..=251) => {
            replace(draft, EVENT_DRIVEN, format!("transmission type {number} is reserved: this becomes 255"));
        }
        (0x1200, 1 | 2) => check_default_server(address.sub, draft, &place, report),
        _ => check_cob_id(address, draft, &place, report),
    }
}

/// The default SDO server has the identifiers of the pre-defined connection set, whatever 0x1200 says.
fn check_default_server(sub: u8, draft: &Draft, place: &Span, report: &mut Report) {
    let base = if sub == 1 { 0x600 } else { 0x580 };
    if draft.entry.initial != Initial::PlusNodeId(base) {
        let message = "the default SDO server listens to 0x600 and answers with 0x580 plus the Node-ID";
        report.warn(place, message, format!("write $NODEID+0x{base:X}"));
    }
}

/// Takes an identifier away that belongs to NMT or to the error control or SDO of some node.
fn check_cob_id(address: Address, draft: &mut Draft, place: &Span, report: &mut Report) {
    let stands_in = match (address.index, address.sub) {
        _ if address == SYNC => 0x80,
        _ if address == TIME => 0x100,
        (0x1014, 0) | (0x1028, 1..) | (0x1201..=0x12FF, 1 | 2) => NOT_VALID,
        (0x1400..=0x15FF | 0x1800..=0x19FF, 1) => NOT_VALID,
        _ => return,
    };
    let is_harmful = |cob_id: u32| {
        let is_valid = stands_in != NOT_VALID || cob_id & NOT_VALID == 0;
        is_valid && cob_id & EXTENDED == 0 && is_restricted((cob_id & IDENTIFIER) as u16)
    };
    let is_bad = match draft.entry.initial {
        Initial::PlusNodeId(base) => (1..=127).any(|node_id| is_harmful(base.wrapping_add(node_id))),
        Initial::Value(_) => is_harmful(draft.number() as u32),
    };
    if is_bad {
        draft.entry.initial = Initial::Value(Value::Fixed(stands_in.into()));
        let message = format!("{address}: this CAN-ID is restricted; the value becomes 0x{stands_in:X}");
        report.warn(place, message, None);
    }
}
