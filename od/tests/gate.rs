//! The write gate refuses with the standard's abort codes, in the standard's order, and changes nothing then.

use std::sync::Arc;

use od::{
    AbortCode, Access, Address, Bus, Commanded, Data, DataType, Dictionary, Entry, Mappable, Object, Origin,
    Owner, Range, Refusal, RefusedCommand, Schema, Slot, Value, Write,
};

const CAN: Origin = Origin { bus: Bus::CanOpen, link: 0, client: 0 };

fn entry(data_type: DataType, access: Access) -> Entry {
    Entry::new(0, "entry", data_type, access)
}

fn dictionary() -> Dictionary {
    let ranged = Entry {
        range: Some(Range::Integer { min: -10, max: 10 }),
        ..entry(DataType::Integer16, Access::ReadWrite)
    };
    let real = Entry {
        range: Some(Range::Real { min: 0.0, max: 1.0 }),
        ..entry(DataType::Real32, Access::ReadWrite)
    };
    let command = Entry { command: Some(0), ..entry(DataType::Unsigned16, Access::ReadWrite) };
    let vetoed = Entry {
        veto: Some(|_, _, raw| if raw == 7 { Err(AbortCode::DeviceState) } else { Ok(()) }),
        ..entry(DataType::Unsigned8, Access::ReadWrite)
    };
    let text = Entry { max_length: 4, ..entry(DataType::VisibleString, Access::ReadWrite) };
    let schema = Schema::new(vec![
        Object::var(0x2000, entry(DataType::Unsigned32, Access::ReadWrite)),
        Object::var(0x2001, entry(DataType::Unsigned32, Access::ReadOnly)),
        Object::var(0x2002, entry(DataType::Unsigned8, Access::WriteOnly)),
        Object::var(0x2003, ranged),
        Object::var(0x2004, real),
        Object::var(0x2005, command),
        Object::var(0x2006, vetoed),
        Object::var(0x2007, text),
        Object::var(0x2008, entry(DataType::Boolean, Access::ReadWrite)),
        Object::var(0x2009, entry(DataType::Unsigned64, Access::ReadWrite)),
    ])
    .unwrap();
    Dictionary::new(Arc::new(schema), 1)
}

fn slot(dictionary: &Dictionary, index: u16) -> Slot {
    dictionary.find(Address::new(index, 0)).unwrap()
}

fn write(dictionary: &mut Dictionary, index: u16, data: &[u8]) -> Result<(), AbortCode> {
    let slot = dictionary.find(Address::new(index, 0))?;
    dictionary.write(CAN, &[Write { slot, data: Data::Bytes(data) }]).map_err(|refusal| refusal.code)
}

#[test]
fn every_refusal_has_its_abort_code() {
    let cases: &[(u16, &[u8], AbortCode)] = &[
        (0x3000, &[0], AbortCode::NoObject),
        (0x2001, &[0; 9], AbortCode::ReadOnly),
        (0x2000, &[0; 5], AbortCode::TooLong),
        (0x2000, &[0; 3], AbortCode::TooShort),
        (0x2003, &[11, 0], AbortCode::ValueTooHigh),
        (0x2003, &[0xF5, 0xFF], AbortCode::ValueTooLow),
        (0x2004, &2.0_f32.to_le_bytes(), AbortCode::ValueTooHigh),
        (0x2004, &f32::NAN.to_le_bytes(), AbortCode::InvalidValue),
        (0x2006, &[7], AbortCode::DeviceState),
        (0x2007, b"12345", AbortCode::TooLong),
        (0x2007, b"a\x01", AbortCode::InvalidValue),
        (0x2008, &[2], AbortCode::ValueTooHigh),
    ];
    for (index, data, expected) in cases {
        let mut dictionary = dictionary();
        assert_eq!(write(&mut dictionary, *index, data), Err(*expected), "0x{index:04X} {data:02X?}");
        assert_eq!(dictionary.revision(), 0);
        assert!(!dictionary.has_written());
    }
}

#[test]
fn a_missing_sub_index_is_told_from_a_missing_object() {
    let dictionary = dictionary();
    assert_eq!(dictionary.find(Address::new(0x2000, 1)), Err(AbortCode::NoSubIndex));
    assert_eq!(dictionary.find(Address::new(0x2FFF, 0)), Err(AbortCode::NoObject));
}

#[test]
fn what_is_written_is_read_and_taken_once_in_order() {
    let mut dictionary = dictionary();
    write(&mut dictionary, 0x2009, &[1, 2, 3, 4, 5, 6, 7, 8]).unwrap();
    write(&mut dictionary, 0x2007, b"abc").unwrap();
    write(&mut dictionary, 0x2009, &[8, 7, 6, 5, 4, 3, 2, 1]).unwrap();
    let (wide, text) = (slot(&dictionary, 0x2009), slot(&dictionary, 0x2007));
    assert_eq!(dictionary.raw(wide), 0x0102_0304_0506_0708);
    assert_eq!(dictionary.read(text).unwrap().1, &Value::bytes(b"abc"));
    assert_eq!(dictionary.take_written(), Some(wide));
    assert_eq!(dictionary.take_written(), Some(text));
    assert_eq!(dictionary.take_written(), None);
}

#[test]
fn one_refused_item_drops_the_whole_batch() {
    let mut dictionary = dictionary();
    let batch = [(0x2000, 5), (0x2003, 5), (0x2006, 7)]
        .map(|(index, raw)| Write { slot: slot(&dictionary, index), data: Data::Raw(raw) });
    let refusal = dictionary.write(CAN, &batch).unwrap_err();
    assert_eq!((refusal.item, refusal.code), (2, AbortCode::DeviceState));
    assert_eq!(dictionary.raw(slot(&dictionary, 0x2000)), 0);
    dictionary.write(CAN, &batch[..2]).unwrap();
    assert_eq!(dictionary.raw(slot(&dictionary, 0x2000)), 5);
}

#[test]
fn only_the_owner_commands_an_axis() {
    let mut dictionary = dictionary();
    for owner in
        [Owner { bus: Bus::Local, link: None }, Owner { bus: Bus::CanOpen, link: Some(CAN.link + 1) }]
    {
        dictionary.set_owner(0, Some(owner));
        assert_eq!(dictionary.owner(0), Some(owner));
        assert_eq!(write(&mut dictionary, 0x2005, &[1, 0]), Err(AbortCode::DeviceState));
        assert_eq!(write(&mut dictionary, 0x2000, &[1, 0, 0, 0]), Ok(()));
    }
    for owner in
        [None, Some(Owner { bus: CAN.bus, link: None }), Some(Owner { bus: CAN.bus, link: Some(CAN.link) })]
    {
        dictionary.set_owner(0, owner);
        assert_eq!(write(&mut dictionary, 0x2005, &[1, 0]), Ok(()));
    }
}

#[test]
fn what_brings_an_axis_to_rest_is_taken_from_another_than_the_owner_and_leaves_the_owner() {
    let mut dictionary = dictionary();
    let owner = Some(Owner { bus: Bus::Modbus, link: None });
    dictionary.set_owner(0, owner);
    let command = slot(&dictionary, 0x2005);
    let item = |bytes| [Write { slot: command, data: Data::Bytes(bytes) }];
    assert_eq!(dictionary.write_for_any_owner(CAN, &item(&[1, 0])), Ok(()));
    let commanded = dictionary.take_commanded().unwrap();
    assert_eq!((commanded.origin, commanded.slot, commanded.raw), (CAN, command, 1));
    // All else is checked.
    let refused = dictionary.write_for_any_owner(CAN, &item(&[1]));
    assert_eq!(refused, Err(Refusal { item: 0, code: AbortCode::TooShort }));
    assert_eq!(dictionary.owner(0), owner);
    assert_eq!(write(&mut dictionary, 0x2005, &[2, 0]), Err(AbortCode::DeviceState));
}

#[test]
fn who_commands_what_and_whether_it_is_something_else_is_remembered() {
    let mut dictionary = dictionary();
    let command = slot(&dictionary, 0x2005);
    for value in [1, 1] {
        write(&mut dictionary, 0x2005, &[value, 0]).unwrap();
        write(&mut dictionary, 0x2000, &[value, 0, 0, 0]).unwrap();
    }
    let batch = [Write { slot: command, data: Data::Raw(2) }];
    dictionary.write_cyclic(CAN, &batch).unwrap();
    let told = |raw, has_changed, is_cyclic| {
        Some(Commanded { origin: CAN, slot: command, raw, has_changed, is_cyclic })
    };
    let mut next = || dictionary.take_commanded();
    assert_eq!(next(), told(1, true, false));
    assert_eq!(next(), told(1, false, false));
    assert_eq!(next(), told(2, true, true));
    assert_eq!(next(), None);
    for value in 0..=255 {
        write(&mut dictionary, 0x2005, &[value, 0]).unwrap();
    }
    assert_eq!(dictionary.take_commanded().unwrap().raw, 192, "the last 64");
}

#[test]
fn a_batch_with_a_command_that_is_refused_is_remembered_unless_it_is_cyclic() {
    let mut dictionary = dictionary();
    dictionary.set_owner(0, Some(Owner { bus: Bus::Modbus, link: None }));
    let (command, parameter) = (slot(&dictionary, 0x2005), slot(&dictionary, 0x2000));
    assert_eq!(write(&mut dictionary, 0x2005, &[7, 0]), Err(AbortCode::DeviceState));
    let code = AbortCode::DeviceState;
    let refused = RefusedCommand { origin: CAN, slot: command, raw: Some(7), code };
    assert_eq!(dictionary.take_refused(), Some(refused));
    // The item that is refused need not be the command.
    let batch = |bytes| {
        let item = |slot, bytes| Write { slot, data: Data::Bytes(bytes) };
        [item(parameter, bytes), item(command, &[1, 0])]
    };
    let _ = dictionary.write(CAN, &batch(&[1]));
    let refused = RefusedCommand { origin: CAN, slot: parameter, raw: None, code: AbortCode::TooShort };
    assert_eq!(dictionary.take_refused(), Some(refused));
    let _ = dictionary.write_cyclic(CAN, &[Write { slot: command, data: Data::Raw(2) }]);
    assert_eq!(write(&mut dictionary, 0x2000, &[1]), Err(AbortCode::TooShort));
    assert_eq!(dictionary.take_refused(), None, "cyclic, or no command");
    for value in 0..=255 {
        let _ = write(&mut dictionary, 0x2005, &[value, 0]);
    }
    assert_eq!(dictionary.take_refused().unwrap().raw, Some(248), "the last eight");
}

#[test]
fn a_write_only_entry_is_not_read() {
    let dictionary = dictionary();
    assert_eq!(dictionary.read(slot(&dictionary, 0x2002)).unwrap_err(), AbortCode::WriteOnly);
}

#[test]
fn reset_restores_the_defaults() {
    let mut dictionary = dictionary();
    write(&mut dictionary, 0x2000, &[1, 0, 0, 0]).unwrap();
    dictionary.reset();
    assert_eq!(dictionary.raw(slot(&dictionary, 0x2000)), 0);
    assert!(!dictionary.has_written());
}

#[test]
fn the_device_shows_values_that_a_bus_may_not_write() {
    let mut dictionary = dictionary();
    let shown = slot(&dictionary, 0x2001);
    dictionary.set(shown, 0xFFFF_FFFF_0000_0001);
    assert_eq!(dictionary.raw(shown), 1, "bits beyond the type are cut off");
    let revision = dictionary.revision();
    dictionary.set(shown, 1);
    assert_eq!(dictionary.revision(), revision, "the same value is no change");
}

#[test]
fn a_bad_schema_is_refused_with_everything_that_is_wrong() {
    let twice = Object::var(0x2000, entry(DataType::Unsigned8, Access::ReadWrite));
    let out_of_range = Entry {
        range: Some(Range::Integer { min: 1, max: 300 }),
        ..entry(DataType::Unsigned8, Access::ReadWrite)
    };
    let unmappable = Entry { mappable: Mappable::Receive, ..entry(DataType::Unsigned8, Access::ReadOnly) };
    let part =
        |part, whole| Entry { mappable: Mappable::Both, part: Some(part), ..entry(whole, Access::ReadWrite) };
    let mixed = Object::array(
        0x2003,
        "mixed",
        vec![
            Entry::new(1, "a", DataType::Unsigned8, Access::ReadWrite),
            Entry::new(2, "b", DataType::Unsigned16, Access::ReadWrite),
        ],
    );
    let objects = vec![
        twice.clone(),
        twice,
        Object::var(0x2001, out_of_range),
        Object::var(0x2002, unmappable),
        mixed,
        Object::var(
            0x2004,
            Entry { part: Some(DataType::Integer8), ..entry(DataType::Unsigned16, Access::ReadWrite) },
        ),
        Object::var(0x2005, part(DataType::Integer16, DataType::Unsigned16)),
        Object::var(0x2006, part(DataType::Integer8, DataType::Real32)),
        Object::var(0x2007, part(DataType::Integer16, DataType::Unsigned32)),
        Object::var(0x0FFF, entry(DataType::Unsigned8, Access::ReadWrite).with_value(Value::bytes([]))),
    ];
    let errors = Schema::new(objects).unwrap_err();
    let text: Vec<String> = errors.iter().map(ToString::to_string).collect();
    insta::assert_snapshot!(text.join("\n"));
}
