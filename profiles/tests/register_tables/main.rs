//! The register lists against the tables of the manual, typed from there: every register, its width, and what is
//! printed of its access, default and range. `-` stands for what is not printed or cannot be read.

mod mac050_141;
mod mac400_3000;
mod mis34x;
mod module;

use od::{Address, DataType, Entry, Initial, Schema, Value};
use profiles::{Format, Profile, Register, Space};

/// One row: number, name, bits, access, default, range.
struct Row {
    number: u16,
    name: &'static str,
    bits: u8,
    access: &'static str,
    default: &'static str,
    range: &'static str,
}

fn rows(table: &'static str) -> Vec<Row> {
    let row = |line: &'static str| {
        let cells: Vec<_> = line.split(" | ").collect();
        let [number, name, bits, access, default, range] = cells[..] else { panic!("{line}") };
        Row { number: number.parse().unwrap(), name, bits: bits.parse().unwrap(), access, default, range }
    };
    table.trim().lines().map(row).collect()
}

fn profile(name: &str, motor: &str) -> Profile {
    Profile::embedded(name, Some(motor)).unwrap().unwrap_or_else(|wrong| panic!("{wrong}"))
}

fn entry(schema: &Schema, address: Address) -> &Entry {
    schema.entry(schema.slot(address).unwrap_or_else(|| panic!("{address}"))).unwrap()
}

/// The default of an entry that holds a signed register, on node 0.
fn default(entry: &Entry) -> String {
    match &entry.initial {
        Initial::PlusNodeId(base) => base.to_string(),
        Initial::Value(Value::Fixed(raw)) => u32::try_from(*raw).unwrap().cast_signed().to_string(),
        Initial::Value(Value::Bytes(_)) => panic!("a register is a number"),
    }
}

fn range(register: &Register) -> String {
    register.range.map_or("-".to_owned(), |(min, max)| format!("{min}..{max}"))
}

/// What is printed is so, in the list and in the entry that shows the register.
fn assert_row(profile: &Profile, space: Space, row: &Row) {
    let Row { number, name, bits, access, default: printed, range: printed_range } = row;
    let register = profile.register(space, *number).unwrap();
    let case = format!("{number} {name}");
    assert_eq!((register.number, register.name.as_str()), (*number, *name), "{case}");
    let place = register.place.unwrap_or_else(|| panic!("{case} is nowhere"));
    let entry = entry(&profile.application, place);
    assert_eq!(range(register), *printed_range, "{case}");
    assert!(*access == "-" || entry.access.name() == *access, "{case}: {}", entry.access.name());
    assert!(*printed == "-" || default(entry) == *printed, "{case}: {}", default(entry));
    assert_eq!((register.access, register.is_volatile), (entry.access, entry.is_volatile), "{case}");
    if place == Address::new(0x2012, u8::try_from(*number).unwrap_or(0)) {
        assert_eq!((register.format.bits(), entry.data_type), (*bits, DataType::Unsigned32), "{case}");
    }
}

/// The motor registers of a profile are those of `table` and no others, each at its place in 0x2012.
fn assert_motor_registers(profile: &Profile, table: &'static str, takes_two: bool) {
    let rows = rows(table);
    rows.iter().for_each(|row| assert_row(profile, Space::Motor, row));
    for number in 0..=255 {
        let register = profile.register(Space::Motor, number).unwrap();
        let is_high = |row: &Row| takes_two && row.bits == 32 && row.number + 1 == number;
        let expected = if let Some(row) = rows.iter().find(|row| row.number == number) {
            row.bits
        } else if rows.iter().any(is_high) {
            assert_eq!(register.format, Format::HighWord, "{number}");
            16
        } else {
            assert_eq!(register.format, Format::Reserved, "{number}");
            0
        };
        assert_eq!(register.format.bits(), expected, "{number}");
        let place = u8::try_from(number).ok().filter(|sub| (1..=254).contains(sub));
        assert_eq!(register.place, place.map(|sub| Address::new(0x2012, sub)), "{number}");
    }
    let count = entry(&profile.application, Address::new(0x2012, 0));
    assert_eq!(default(count), "254");
}

#[test]
fn every_register_of_the_mac050_to_141_is_there_as_printed() {
    for name in ["jvl-mac00-fc2", "jvl-mac00-fc4"] {
        for motor in ["mac050", "mac095", "mac140", "mac141"] {
            let profile = profile(name, motor);
            assert_motor_registers(&profile, mac050_141::TABLE, true);
            assert_eq!(profile.register(Space::Motor, 256), None);
        }
    }
}

#[test]
fn every_register_of_the_mac400_to_3000_is_there_as_printed() {
    for name in ["jvl-mac00-fc2", "jvl-mac00-fc4"] {
        for motor in ["mac400", "mac800", "mac1500", "mac3000"] {
            assert_motor_registers(&profile(name, motor), mac400_3000::TABLE, false);
        }
    }
}

#[test]
fn every_register_of_the_mis_steppers_is_there_as_printed() {
    for motor in ["mis340", "mis341", "mis342"] {
        let profile = profile("jvl-mis34x", motor);
        assert_motor_registers(&profile, mis34x::TABLE, false);
        assert_eq!(profile.register(Space::Motor, 256), None);
    }
}

/// Ethernet module manual, section 3.4.11: 0x2013:n is register n + 255.
#[test]
fn the_larger_motors_have_registers_up_to_509_that_are_not_on_canopen() {
    let profile = profile("jvl-mac00-fc4", "mac400");
    for number in 256..=509 {
        let register = profile.register(Space::Motor, number).unwrap();
        let place = Address::new(0x2F13, u8::try_from(number - 255).unwrap());
        assert_eq!((register.place, register.format), (Some(place), Format::I32));
        assert!(entry(&profile.application, place).is_local);
    }
    assert_eq!(profile.register(Space::Motor, 510), None);
}

#[test]
fn every_module_register_is_there_as_printed() {
    for (name, motor) in [("jvl-mac00-fc4", "mac800"), ("jvl-mac00-fc2", "mac400")] {
        let profile = profile(name, motor);
        let rows = rows(module::TABLE);
        rows.iter().for_each(|row| assert_row(&profile, Space::Module, row));
        for number in 0..=63 {
            let register = profile.register(Space::Module, number).unwrap();
            let is_listed = rows.iter().any(|row| row.number == number);
            assert_eq!(register.format == Format::Reserved, !is_listed, "{number}");
            assert_eq!(register.place.is_some(), is_listed, "{number}");
        }
        assert_eq!(profile.register(Space::Module, 64), None);
    }
}

/// What the manual leaves to the motor: the numbers in the lists of cyclic registers (section 3.4.1).
#[test]
fn the_cyclic_registers_are_those_of_the_motor() {
    for (name, motor, read, write) in [
        ("jvl-mac00-fc4", "mac140", [2, 10, 12, 121, 35, 0, 0, 0], [2, 3, 5, 7, 0, 0, 0, 0]),
        ("jvl-mac00-fc4", "mac800", [2, 10, 12, 169, 35, 0, 0, 0], [2, 3, 5, 7, 0, 0, 0, 0]),
        ("jvl-mis34x", "mis340", [2, 10, 12, 35, 36, 0, 0, 0], [2, 3, 5, 6, 0, 0, 0, 0]),
    ] {
        let profile = profile(name, motor);
        let defaults: Vec<_> = (16..32)
            .map(|number| profile.register(Space::Module, number).unwrap().place.unwrap())
            .map(|place| default(entry(&profile.application, place)).parse::<u16>().unwrap())
            .collect();
        assert_eq!(defaults, [read, write].concat(), "{motor}");
    }
}

#[test]
fn the_motor_tells_its_type() {
    for (name, motor, register, code) in [
        ("jvl-mac00-fc4", "mac400", 203, "12"),
        ("jvl-mac00-fc4", "mac800", 203, "14"),
        ("jvl-mis34x", "mis340", 151, "81"),
        ("jvl-mis34x", "mis341", 151, "82"),
        ("jvl-mis34x", "mis342", 151, "83"),
    ] {
        let profile = profile(name, motor);
        assert_eq!(default(entry(&profile.application, Address::new(0x2012, register))), code, "{motor}");
    }
}

#[test]
fn what_a_pdo_may_carry_follows_from_the_access() {
    let profile = profile("jvl-mac00-fc4", "mac800");
    for register in &profile.motor_registers.as_ref().unwrap().registers {
        let Some(place) = register.place.filter(|place| place.index == 0x2012) else { continue };
        let mappable = entry(&profile.application, place).mappable;
        assert!(mappable.transmit(), "{}", register.name);
        assert_eq!(mappable.receive(), register.access.is_writable(), "{}", register.name);
    }
}
