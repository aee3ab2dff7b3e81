//! Local objects are not on CANopen: neither SDO nor PDO nor the data sheet know them. Other views reach them.

use std::sync::Arc;

use od::{
    AbortCode, Access, Address, Bus, Data, DataType, DeviceInfo, Dictionary, Direction, Entry, Mappable,
    Mapping, Object, Origin, Schema, Sheet, Value, Write, eds,
};

const MODBUS: Origin = Origin { bus: Bus::Local, link: 0, client: 0 };

fn member(sub: u8) -> Entry {
    Entry::new(sub, format!("register {sub}"), DataType::Unsigned32, Access::ReadWrite)
        .with_value(Value::Fixed(7))
}

fn schema() -> Schema {
    let shown = Entry { mappable: Mappable::Both, ..member(1) };
    let hidden = Object::record(0x2F11, "Module registers", vec![member(1), member(3)]).local();
    Schema::new(vec![Object::record(0x2011, "Shown", vec![shown]), hidden]).unwrap()
}

#[test]
fn an_sdo_finds_neither_a_local_object_nor_its_sub_indices() {
    let dictionary = Dictionary::new(Arc::new(schema()), 1);
    for sub in 0..=4 {
        assert_eq!(dictionary.find(Address::new(0x2F11, sub)), Err(AbortCode::NoObject), "{sub}");
    }
    assert_eq!(dictionary.find(Address::new(0x2011, 2)), Err(AbortCode::NoSubIndex));
    assert!(dictionary.find(Address::new(0x2011, 1)).is_ok());
}

#[test]
fn a_pdo_cannot_carry_a_local_entry() {
    let field = |parameter| Mapping::field(&schema(), Direction::Receive, parameter);
    assert_eq!(field(0x2F11_0120), Err(AbortCode::NoObject));
    assert!(field(0x2011_0120).is_ok());
}

#[test]
fn another_view_reads_writes_and_stores_a_local_entry_by_its_slot() {
    let mut dictionary = Dictionary::new(Arc::new(schema()), 1);
    let slot = dictionary.schema().slot(Address::new(0x2F11, 3)).unwrap();
    assert_eq!(dictionary.read(slot).map(|(_, value)| value.raw()), Ok(7));
    let write = Write { slot, data: Data::Raw(9) };
    assert_eq!(dictionary.write(MODBUS, &[write]), Ok(()));
    assert_eq!(dictionary.take_written(), Some(slot));
    let saved = dictionary.save(|_| true);
    assert_eq!(dictionary.set_saved(saved), 0);
    dictionary.reset();
    assert_eq!(dictionary.raw(slot), 9);
}

#[test]
fn the_data_sheet_leaves_local_objects_out() {
    let (info, schema) = (DeviceInfo::default(), schema());
    let sheet = eds::write(&Sheet { info: &info, schemas: &[&schema], configuration: None });
    assert!(sheet.contains("[2011sub1]"));
    assert!(sheet.contains("[ManufacturerObjects]\nSupportedObjects=1\n1=0x2011\n"), "{sheet}");
    assert!(!sheet.contains("2F11"), "{sheet}");
}

#[test]
fn an_object_is_local_as_a_whole_and_in_no_pdo() {
    let mut half = Object::record(0x2000, "half", vec![member(1)]).local();
    half.entries[1].is_local = false;
    let mapped = Entry { mappable: Mappable::Both, ..member(0) };
    let refused = Schema::new(vec![half, Object::var(0x2001, mapped).local()]).unwrap_err();
    let reasons: Vec<String> = refused.iter().map(ToString::to_string).collect();
    assert_eq!(
        reasons,
        [
            "0x2000:00: all entries of an object are local or none is",
            "0x2001:00: a local entry cannot be mapped into a PDO",
        ]
    );
}
