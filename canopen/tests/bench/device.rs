//! The device on the bench: one object of every type, and what it takes to be refused.

use od::{
    AbortCode, Access, DataType, Entry, Initial, Mappable, Object, ObjectKind, Range, Schema, Value, Veto,
};

use Access::{Const, ReadOnly, ReadWrite, WriteOnly};
use DataType::{Domain, Integer16, Real32, Unsigned8, Unsigned16, Unsigned32, VisibleString};

/// Most bytes that the large DOMAIN 0x210A takes.
pub(crate) const LARGE_DOMAIN_LENGTH: usize = 4_000_000;

/// Most bytes that the DOMAIN takes.
pub(crate) const DOMAIN_LENGTH: usize = 100_000;

fn entry(sub: u8, data_type: DataType, access: Access) -> Entry {
    Entry::new(sub, format!("Entry {sub}"), data_type, access)
}

fn number(sub: u8, data_type: DataType, access: Access, value: u64) -> Entry {
    entry(sub, data_type, access).with_value(Value::Fixed(value))
}

fn text(access: Access, value: &str) -> Entry {
    entry(0, VisibleString, access).with_value(Value::bytes(value))
}

fn plus_node_id(sub: u8, access: Access, base: u32) -> Entry {
    Entry { initial: Initial::PlusNodeId(base), ..entry(sub, Unsigned32, access) }
}

/// 0x1000-0x1FFF.
pub(crate) fn communication() -> Schema {
    Schema::new(communication_objects()).unwrap()
}

/// 0x1000-0x1FFF and more.
pub(crate) fn communication_with(more: Vec<Object>) -> Schema {
    Schema::new(communication_objects().into_iter().chain(more).collect()).unwrap()
}

pub(crate) fn communication_objects() -> Vec<Object> {
    let identity = [0x0000_04D2, 0x0000_0402, 0x0001_0002, 0x0000_002A];
    let mut objects = vec![
        Object::var(0x1000, number(0, Unsigned32, ReadOnly, 0x0002_0192)),
        Object::var(0x1001, entry(0, Unsigned8, ReadOnly)),
        Object {
            entries: [Entry { is_volatile: true, ..entry(0, Unsigned8, ReadWrite) }]
                .into_iter()
                .chain((1..=4).map(|sub| entry(sub, Unsigned32, ReadOnly)))
                .collect(),
            kind: ObjectKind::Array,
            ..Object::var(0x1003, entry(0, Unsigned8, ReadWrite))
        },
        Object::var(0x1005, number(0, Unsigned32, ReadWrite, 0x80)),
        Object::var(0x1006, entry(0, Unsigned32, ReadWrite)),
        Object::var(0x1007, entry(0, Unsigned32, ReadWrite)),
        Object::var(0x1008, text(Const, "Bench device")),
        Object::var(0x100C, entry(0, Unsigned16, ReadWrite)),
        Object::var(0x100D, entry(0, Unsigned8, ReadWrite)),
        Object::var(0x1012, number(0, Unsigned32, ReadWrite, 0x100)),
        Object::var(0x1014, plus_node_id(0, ReadWrite, 0x80)),
        Object::var(0x1015, entry(0, Unsigned16, ReadWrite)),
        Object::var(0x1017, entry(0, Unsigned16, ReadWrite)),
        Object::record(
            0x1018,
            "Identity",
            (1..).zip(identity).map(|(sub, value)| number(sub, Unsigned32, ReadOnly, value)).collect(),
        ),
        Object::var(0x1019, entry(0, Unsigned8, ReadWrite)),
        Object::array(
            0x1016,
            "Consumer heartbeat time",
            (1..=4).map(|sub| entry(sub, Unsigned32, ReadWrite)).collect(),
        ),
        Object::array(
            0x1028,
            "Emergency consumer",
            (1..=8).map(|sub| number(sub, Unsigned32, ReadWrite, 0x8000_0000)).collect(),
        ),
        Object::array(0x1029, "Error behaviour", vec![entry(1, Unsigned8, ReadWrite)]),
        Object::var(0x1F80, number(0, Unsigned32, ReadWrite, 0x04)),
        Object::record(
            0x1200,
            "SDO server",
            vec![plus_node_id(1, ReadOnly, 0x600), plus_node_id(2, ReadOnly, 0x580)],
        ),
        further_sdo_server(0x1201),
        further_sdo_server(0x1202),
    ];
    let outputs = [0x6200_0108, 0x6200_0208];
    let inputs = [0x6000_0108, 0x6000_0208];
    objects.extend(pdo(0x1400, 0x1600, 0x0000_0200, 255, &outputs));
    objects.extend(pdo(0x1401, 0x1601, 0x0000_0300, 1, &[0x6200_0308]));
    objects.extend(pdo(0x1402, 0x1602, 0x8000_0400, 255, &[]));
    objects.extend(pdo(0x1403, 0x1603, 0x8000_0500, 255, &[]));
    objects.extend(pdo(0x1800, 0x1A00, 0x0000_0180, 255, &inputs));
    objects.extend(pdo(0x1801, 0x1A01, 0x0000_0280, 1, &[0x6200_0308]));
    objects.extend(pdo(0x1802, 0x1A02, 0x8000_0380, 255, &[]));
    objects.extend(pdo(0x1803, 0x1A03, 0xC000_0480, 255, &[]));
    objects
}

/// An SDO server that is off.
fn further_sdo_server(index: u16) -> Object {
    let cob_id = |sub| number(sub, Unsigned32, ReadWrite, 0x8000_0000);
    Object::record(index, "SDO server", vec![cob_id(1), cob_id(2), entry(3, Unsigned8, ReadWrite)])
}

/// The records of one PDO with eight mapping entries.
fn pdo(communication: u16, mapping: u16, cob_id: u32, transmission: u64, mapped: &[u32]) -> [Object; 2] {
    let mut parameters = vec![
        plus_node_id(1, ReadWrite, cob_id),
        number(2, Unsigned8, ReadWrite, transmission),
        entry(3, Unsigned16, ReadWrite),
        entry(5, Unsigned16, ReadWrite),
    ];
    if communication >= 0x1800 {
        parameters.push(entry(6, Unsigned8, ReadWrite));
    }
    let values = mapped.iter().copied().chain(core::iter::repeat(0));
    let entries = (1..=8).zip(values).map(|(sub, value)| number(sub, Unsigned32, ReadWrite, value.into()));
    let mut mapping_record = Object::record(mapping, "PDO mapping", entries.collect());
    mapping_record.entries[0] = number(0, Unsigned8, ReadWrite, mapped.len() as u64);
    [Object::record(communication, "PDO communication", parameters), mapping_record]
}

/// 0x2000-0x9FFF.
///
/// 0x2000 + type code: one object of every type. 0x21xx: objects with an opinion. 0x6000: eight inputs. 0x6200:
/// eight outputs.
pub(crate) fn application() -> Schema {
    let mut objects: Vec<Object> = DataType::ALL.iter().map(|t| typed(*t)).collect();
    let both = |entry| Entry { mappable: Mappable::Both, ..entry };
    let ranged =
        Entry { range: Some(Range::Integer { min: -10, max: 10 }), ..entry(0, Integer16, ReadWrite) };
    let real = Entry { range: Some(Range::Real { min: 0.0, max: 1.0 }), ..entry(0, Real32, ReadWrite) };
    objects.extend([
        Object::var(0x2100, number(0, Unsigned32, ReadOnly, 0x1234_5678)),
        Object::var(0x2101, entry(0, Unsigned8, WriteOnly)),
        Object::var(0x2102, text(Const, "A string that takes segments")),
        Object::var(0x2103, both(ranged)),
        Object::var(0x2104, Entry { veto: Some(VETO), ..entry(0, Unsigned8, ReadWrite) }),
        Object::var(0x2105, real),
        Object::var(0x2106, Entry { command: Some(0), ..entry(0, Unsigned16, ReadWrite) }),
        Object::var(0x2107, entry(0, Unsigned16, ReadWrite)),
        Object::var(0x2108, Entry { mappable: Mappable::Receive, ..entry(0, Unsigned16, WriteOnly) }),
        Object::var(0x2109, Entry { mappable: Mappable::Transmit, ..entry(0, Unsigned16, ReadOnly) }),
        Object::var(0x210A, Entry { max_length: LARGE_DOMAIN_LENGTH, ..entry(0, Domain, ReadWrite) }),
        Object::array(
            0x6000,
            "Inputs",
            (1..=8)
                .map(|sub| Entry { mappable: Mappable::Transmit, ..entry(sub, Unsigned8, ReadOnly) })
                .collect(),
        ),
        Object::array(0x6200, "Outputs", (1..=8).map(|sub| both(entry(sub, Unsigned8, ReadWrite))).collect()),
    ]);
    Schema::new(objects).unwrap()
}

fn typed(data_type: DataType) -> Object {
    let mappable = if data_type.bits().is_some() { Mappable::Both } else { Mappable::No };
    let max_length = if data_type == Domain { DOMAIN_LENGTH } else { 16 };
    let entry = Entry { mappable, max_length, ..entry(0, data_type, ReadWrite) };
    Object::var(0x2000 + data_type as u16, entry)
}

/// The value says what is wrong with it.
const VETO: Veto = |_, _, raw| match raw {
    1 => Err(AbortCode::Hardware),
    2 => Err(AbortCode::LocalControl),
    3 => Err(AbortCode::DeviceState),
    4 => Err(AbortCode::General),
    _ => Ok(()),
};
