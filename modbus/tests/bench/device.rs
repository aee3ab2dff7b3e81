//! A device with a few objects of every kind and some of JVL's registers.

use std::sync::Arc;

use modbus::{Dialect, Flag, Identification, Map, WordOrder};
use od::{AbortCode, Access, Address, DataType, Dictionary, Entry, Object, Range, Schema, Slot, Value};

use Access::{Const, ReadOnly, ReadWrite, WriteOnly};
use DataType::{
    Boolean, Integer8, Integer16, Integer24, Integer32, Real32, Unsigned8, Unsigned16, Unsigned32,
    Unsigned64, VisibleString,
};

/// The IP address of the printed examples, 192.168.100.1.
pub const IP_ADDRESS: u64 = 0xC0A8_6401;

const MODULE: u16 = 0x2011;
const MOTOR: u16 = 0x2012;

/// Module registers.
const MODULE_REGISTERS: [(u8, DataType, Access, u64); 5] = [
    (3, Unsigned32, ReadWrite, IP_ADDRESS),
    (6, Unsigned32, ReadWrite, 0),
    (10, Unsigned32, ReadWrite, 0),
    (15, Unsigned32, WriteOnly, 0),
    (47, Unsigned32, ReadOnly, 5),
];

/// Motor registers.
const MOTOR_REGISTERS: [(u8, DataType, Access, u64); 12] = [
    (1, Unsigned32, ReadOnly, 0x0102),
    (2, Unsigned16, ReadWrite, 0),
    (3, Integer32, ReadWrite, 0),
    (5, Integer16, ReadWrite, 0),
    (6, Unsigned16, ReadWrite, 0),
    (7, Unsigned16, ReadWrite, 1023),
    (10, Integer32, ReadWrite, 0x0001_0002),
    (12, Integer16, ReadOnly, 0xFFFE),
    (16, Integer32, ReadOnly, 3),
    (20, Integer32, ReadOnly, -4_i64 as u64 & 0xFFFF_FFFF),
    (35, Unsigned16, ReadOnly, 0x8010),
    (254, Unsigned32, ReadWrite, 0),
];

fn registers(index: u16, registers: &[(u8, DataType, Access, u64)]) -> Object {
    let entry = |&(sub, data_type, access, value): &(u8, DataType, Access, u64)| {
        Entry::new(sub, format!("Register {sub}"), data_type, access).with_value(Value::Fixed(value))
    };
    Object::record(index, "Registers", registers.iter().map(entry).collect())
}

fn objects() -> Vec<Object> {
    let var =
        |index, name: &str, data_type, access| Object::var(index, Entry::new(0, name, data_type, access));
    let command = |sub, name: &str, data_type| {
        let entry = Entry::new(sub, name, data_type, ReadWrite);
        Entry { command: Some(0), ..entry }
    };
    let mut limited = Entry::new(0, "Limited", Unsigned16, ReadWrite).with_value(Value::Fixed(1));
    limited.range = Some(Range::Integer { min: 1, max: 100 });
    let text = Entry::new(0, "Text", VisibleString, ReadWrite).with_value(Value::bytes(*b"axis one"));
    vec![
        registers(MODULE, &MODULE_REGISTERS),
        registers(MOTOR, &MOTOR_REGISTERS),
        var(0x2100, "Wide", Unsigned64, ReadWrite),
        Object::var(0x2101, text),
        var(0x2102, "Real", Real32, ReadWrite),
        var(0x2103, "Secret", Unsigned16, WriteOnly),
        var(0x2104, "Switch", Boolean, ReadWrite),
        var(0x2105, "Narrow", Integer24, ReadWrite),
        Object::var(0x2106, limited),
        Object::var(0x6040, command(0, "Controlword", Unsigned16)),
        Object::var(
            0x6041,
            Entry::new(0, "Statusword", Unsigned16, ReadOnly).with_value(Value::Fixed(0x0216)),
        ),
        Object::var(0x6060, command(0, "Modes of operation", Integer8)),
        Object::var(
            0x6064,
            Entry::new(0, "Position", Integer32, ReadOnly).with_value(Value::Fixed(0x1234_5678)),
        ),
        Object::var(0x607A, command(0, "Target position", Integer32)),
        Object::var(
            0x60FD,
            Entry::new(0, "Digital inputs", Unsigned32, ReadOnly).with_value(Value::Fixed(0x8003_0005)),
        ),
        Object::record(
            0x60FE,
            "Digital outputs",
            vec![
                command(1, "Physical outputs", Unsigned32).with_value(Value::Fixed(0x0005_0000)),
                Entry::new(2, "Bit mask", Unsigned32, ReadWrite),
            ],
        ),
        var(0x6502, "Supported modes", Unsigned32, Const),
    ]
}

/// In state "busy", which this device is in while 0x2104 is set, the target stays.
fn busy(dictionary: &Dictionary, _: Slot, _: u64) -> Result<(), AbortCode> {
    let is_busy = dictionary.find(Address::new(0x2104, 0)).map_or(0, |slot| dictionary.raw(slot)) == 1;
    if is_busy { Err(AbortCode::DeviceState) } else { Ok(()) }
}

pub fn dictionary() -> Dictionary {
    let mut schema = Schema::new(objects()).unwrap();
    schema.set_veto(Address::new(0x607A, 0), busy);
    schema.set_veto(Address::new(MOTOR, 5), busy);
    Dictionary::new(Arc::new(schema), 1)
}

pub fn communication() -> Dictionary {
    let device_type = Entry::new(0, "Device type", Unsigned32, Const).with_value(Value::Fixed(0x0002_0192));
    let name = Entry::new(0, "Name", VisibleString, Const).with_value(Value::bytes(*b"Bench"));
    let register = Entry::new(0, "Error register", Unsigned8, ReadOnly);
    let objects =
        vec![Object::var(0x1000, device_type), Object::var(0x1001, register), Object::var(0x1008, name)];
    Dictionary::new(Arc::new(Schema::new(objects).unwrap()), 1)
}

pub fn identification() -> Identification {
    Identification {
        vendor_name: "Example".into(),
        product_code: "BENCH".into(),
        revision: "1.0".into(),
        vendor_url: "http://example.org".into(),
        product_name: "Bench device".into(),
        model_name: "B1".into(),
        application_name: "left axis".into(),
        private: vec!["bench".into(), "x".repeat(239), "y".repeat(300)],
    }
}

/// The map of the device; JVL's dialect has JVL's registers only.
pub fn map(dictionary: &Dictionary, dialect: Dialect, order: WordOrder) -> Map {
    let schema = dictionary.schema();
    let slot = |index, sub| schema.slot(Address::new(index, sub)).unwrap();
    let motor = MOTOR_REGISTERS.map(|(number, ..)| (number, slot(MOTOR, number)));
    let module = MODULE_REGISTERS.map(|(number, ..)| (number, slot(MODULE, number)));
    let mirror = Flag { slot: slot(MODULE, 6), bit: 5 };
    let map = Map::new(dialect, order).with_jvl(schema, motor, module, Some(mirror));
    match dialect {
        Dialect::Jvl => map,
        Dialect::Full => map.with_application(schema, &[slot(0x60FE, 1)], &[slot(0x60FD, 0)]),
    }
}
