//! Stored values take the place of the defaults at power-on, and only then.

use std::sync::Arc;

use od::{
    AbortCode, Access, Address, Bus, Data, DataType, Dictionary, Entry, Group, Initial, Object, Origin,
    Range, Saved, Schema, Value, Write,
};

use Access::{ReadOnly, ReadWrite, WriteOnly};
use DataType::{Integer16, Real64, Unsigned8, Unsigned16, Unsigned24, Unsigned32, VisibleString};

const CAN: Origin = Origin { bus: Bus::CanOpen, link: 0, client: 0 };

fn entry(data_type: DataType, access: Access) -> Entry {
    Entry::new(0, "entry", data_type, access)
}

fn schema() -> Schema {
    let ranged = Entry { range: Some(Range::Integer { min: -10, max: 10 }), ..entry(Integer16, ReadWrite) };
    let vetoed = Entry {
        veto: Some(|_, _, raw| if raw == 7 { Err(AbortCode::DeviceState) } else { Ok(()) }),
        ..entry(Unsigned8, ReadWrite)
    };
    let objects = vec![
        Object::var(0x1014, Entry { initial: Initial::PlusNodeId(0x80), ..entry(Unsigned32, ReadWrite) }),
        Object::var(0x1017, entry(Unsigned16, ReadWrite).with_value(Value::Fixed(100))),
        Object::var(0x2000, entry(Unsigned24, ReadWrite)),
        Object::var(0x2001, entry(Unsigned32, ReadOnly)),
        Object::var(0x2002, entry(Unsigned8, WriteOnly)),
        Object::var(0x2003, Entry { command: Some(0), ..entry(Unsigned16, ReadWrite) }),
        Object::var(0x2004, Entry { is_volatile: true, ..entry(Unsigned16, ReadWrite) }),
        Object::var(0x2005, entry(VisibleString, ReadWrite)),
        Object::var(0x6000, ranged),
        Object::var(0x6001, vetoed),
        Object::var(0x6002, entry(Real64, ReadWrite)),
    ];
    Schema::new(objects).unwrap()
}

fn dictionary(node_id: u8) -> Dictionary {
    Dictionary::new(Arc::new(schema()), node_id)
}

fn write(dictionary: &mut Dictionary, index: u16, bytes: &[u8]) {
    let slot = dictionary.find(Address::new(index, 0)).unwrap();
    dictionary.write(CAN, &[Write { slot, data: Data::Bytes(bytes) }]).unwrap();
}

fn value(dictionary: &Dictionary, index: u16) -> Value {
    dictionary.value(dictionary.find(Address::new(index, 0)).unwrap()).unwrap().clone()
}

/// Everything written, with a value of its own.
fn written() -> Dictionary {
    let mut dictionary = dictionary(5);
    write(&mut dictionary, 0x1014, &[0x81, 0, 0, 0]);
    write(&mut dictionary, 0x1017, &[0xE8, 3]);
    write(&mut dictionary, 0x2000, &[3, 2, 1]);
    write(&mut dictionary, 0x2002, &[1]);
    write(&mut dictionary, 0x2003, &[1, 0]);
    write(&mut dictionary, 0x2004, &[1, 0]);
    write(&mut dictionary, 0x2005, b"text");
    write(&mut dictionary, 0x6000, &[0xF6, 0xFF]);
    write(&mut dictionary, 0x6001, &[8]);
    write(&mut dictionary, 0x6002, &1.5_f64.to_le_bytes());
    dictionary
}

fn indices(saved: &Saved) -> Vec<u16> {
    saved.iter().map(|(address, _)| address.index).collect()
}

#[test]
fn a_parameter_can_be_read_and_written_commands_nothing_and_is_not_volatile() {
    let saved = written().save(|_| true);
    assert_eq!(indices(&saved), [0x1014, 0x1017, 0x2000, 0x2005, 0x6000, 0x6001, 0x6002]);
    assert_eq!(saved.get(Address::new(0x2000, 0)), Some(&[3, 2, 1][..]), "as an SDO carries it");
    assert_eq!(saved.get(Address::new(0x2003, 0)), None);
}

#[test]
fn stored_values_take_effect_with_the_next_reset() {
    let saved = written().save(|_| true);
    let mut dictionary = dictionary(5);
    assert_eq!(dictionary.set_saved(saved), 0);
    assert_eq!(value(&dictionary, 0x1017), Value::Fixed(100));

    dictionary.reset();
    assert_eq!(value(&dictionary, 0x1014), Value::Fixed(0x81));
    assert_eq!(value(&dictionary, 0x1017), Value::Fixed(1000));
    assert_eq!(value(&dictionary, 0x2000), Value::Fixed(0x0001_0203));
    assert_eq!(value(&dictionary, 0x2003), Value::Fixed(0));
    assert_eq!(value(&dictionary, 0x2005), Value::bytes(b"text"));
    assert_eq!(value(&dictionary, 0x6000), Value::Fixed(0xFFF6));
    assert_eq!(value(&dictionary, 0x6002), Value::Fixed(1.5_f64.to_bits()));
    assert!(!dictionary.has_written(), "nobody wrote them");

    write(&mut dictionary, 0x1017, &[1, 0]);
    dictionary.reset();
    assert_eq!(value(&dictionary, 0x1017), Value::Fixed(1000), "as often as it is reset");
}

#[test]
fn a_part_that_starts_anew_has_its_power_on_values_and_leaves_the_others() {
    let mut dictionary = written();
    dictionary.set_saved(dictionary.save(|index| index == 0x2000));
    write(&mut dictionary, 0x2000, &[9, 0, 0]);
    write(&mut dictionary, 0x2005, b"other");
    write(&mut dictionary, 0x6000, &[9, 0]);
    let before = dictionary.revision();
    dictionary.restart(|index| index < 0x6000);
    assert_eq!(value(&dictionary, 0x2000), Value::Fixed(0x0001_0203), "stored");
    assert_eq!(value(&dictionary, 0x2005), Value::bytes(b""), "the default");
    assert_eq!(value(&dictionary, 0x6000), Value::Fixed(9));
    assert_ne!(dictionary.revision(), before);
}

#[test]
fn nothing_stored_means_defaults() {
    let mut dictionary = written();
    dictionary.set_saved(dictionary.save(|_| true));
    dictionary.set_saved(dictionary.forget(|_| true));
    assert!(dictionary.saved().is_empty());
    assert_eq!(value(&dictionary, 0x1017), Value::Fixed(1000), "until the next reset");
    dictionary.reset();
    assert_eq!(value(&dictionary, 0x1017), Value::Fixed(100));
    assert_eq!(value(&dictionary, 0x2005), Value::bytes([]));
}

#[test]
fn groups_are_stored_and_forgotten_apart() {
    let by = |group: Group| move |index| group.contains(index);
    let mut dictionary = written();
    let saved = dictionary.save(by(Group::Communication));
    assert_eq!(indices(&saved), [0x1014, 0x1017]);
    dictionary.set_saved(saved);
    let saved = dictionary.save(by(Group::Application));
    assert_eq!(indices(&saved), [0x1014, 0x1017, 0x6000, 0x6001, 0x6002], "beside what was stored before");
    dictionary.set_saved(saved);
    assert_eq!(indices(&dictionary.forget(by(Group::Communication))), [0x6000, 0x6001, 0x6002]);
    assert_eq!(indices(&dictionary.save(by(Group::Manufacturer)))[2..4], [0x2000, 0x2005]);
    assert!(dictionary.forget(by(Group::All)).is_empty());
}

#[test]
fn a_group_is_a_sub_index_of_0x1010() {
    for group in [Group::All, Group::Communication, Group::Application, Group::Manufacturer] {
        assert_eq!(Group::from_sub(group as u8), Some(group));
    }
    assert_eq!(Group::from_sub(0), None);
    assert_eq!(Group::from_sub(5), None);
}

#[test]
fn a_default_that_follows_the_node_id_goes_on_following_it() {
    let saved = dictionary(5).save(|_| true);
    assert!(!indices(&saved).contains(&0x1014));
    let mut moved = dictionary(6);
    moved.set_saved(saved);
    moved.reset();
    assert_eq!(value(&moved, 0x1014), Value::Fixed(0x86));
    assert_eq!(value(&moved, 0x1017), Value::Fixed(100));
}

#[test]
fn what_does_not_fit_the_device_is_left_out_and_counted() {
    let mut saved = Saved::default();
    let misfits: [(u16, u8, &[u8]); 9] = [
        (0x1234, 0, &[0]),          // no such object
        (0x1017, 1, &[0, 0]),       // no such entry
        (0x1017, 0, &[0, 0, 0]),    // too long
        (0x2000, 0, &[0, 0]),       // too short
        (0x2001, 0, &[0, 0, 0, 0]), // read-only
        (0x2003, 0, &[0, 0]),       // a command
        (0x2004, 0, &[0, 0]),       // volatile
        (0x6000, 0, &[11, 0]),      // out of range
        (0x6001, 0, &[7]),          // vetoed
    ];
    for (index, sub, bytes) in misfits {
        assert!(saved.insert(Address::new(index, sub), bytes.to_vec()));
    }
    saved.insert(Address::new(0x6002, 0), 2.5_f64.to_le_bytes().to_vec());

    let mut dictionary = dictionary(5);
    assert_eq!(dictionary.set_saved(saved), misfits.len());
    assert_eq!(indices(dictionary.saved()), [0x6002]);
    dictionary.reset();
    assert_eq!(value(&dictionary, 0x6002), Value::Fixed(2.5_f64.to_bits()));
}

#[test]
fn a_command_may_be_kept_all_the_same() {
    let command = Entry { command: Some(0), ..entry(Unsigned16, ReadWrite) };
    assert!(!command.is_parameter());
    assert!(Entry { is_kept: true, ..command }.is_parameter());
}
