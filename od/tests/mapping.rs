//! A PDO mapping packs and unpacks bit by bit and refuses what the standard refuses.

use std::sync::Arc;

use od::{
    AbortCode, Access, Address, DataType, Dictionary, Direction, Entry, Mappable, Mapping, Object, Schema,
};
use proptest::prelude::*;

/// An UNSIGNED32 of which a PDO may carry the low bits as `part`.
fn in_part(index: u16, part: DataType) -> Object {
    let whole = Entry::new(0, "entry", DataType::Unsigned32, Access::ReadWrite);
    Object::var(index, Entry { mappable: Mappable::Both, part: Some(part), ..whole })
}

fn schema() -> Schema {
    let var = |index, data_type, access, mappable| {
        Object::var(index, Entry { mappable, ..Entry::new(0, "entry", data_type, access) })
    };
    Schema::new(vec![
        var(0x2000, DataType::Boolean, Access::ReadWrite, Mappable::Both),
        var(0x2001, DataType::Integer24, Access::ReadWrite, Mappable::Both),
        var(0x2002, DataType::Unsigned32, Access::ReadWrite, Mappable::Both),
        var(0x2003, DataType::Unsigned8, Access::ReadOnly, Mappable::Transmit),
        var(0x2004, DataType::Unsigned8, Access::WriteOnly, Mappable::Receive),
        var(0x2005, DataType::Unsigned8, Access::ReadWrite, Mappable::No),
        in_part(0x2006, DataType::Unsigned16),
        in_part(0x2007, DataType::Integer16),
    ])
    .unwrap()
}

fn refusal(direction: Direction, parameters: &[u32]) -> Option<AbortCode> {
    Mapping::new(&schema(), direction, 64, parameters.iter().copied()).err()
}

#[test]
fn what_may_not_be_mapped_is_refused() {
    use Direction::{Receive, Transmit};
    assert_eq!(refusal(Receive, &[0x3000_0008]), Some(AbortCode::NoObject));
    assert_eq!(refusal(Receive, &[0x2000_0108]), Some(AbortCode::NoObject));
    assert_eq!(refusal(Receive, &[0x2003_0008]), Some(AbortCode::NotMappable));
    assert_eq!(refusal(Transmit, &[0x2003_0008]), None);
    assert_eq!(refusal(Transmit, &[0x2004_0008]), Some(AbortCode::NotMappable));
    assert_eq!(refusal(Receive, &[0x2005_0008]), Some(AbortCode::NotMappable));
    assert_eq!(refusal(Receive, &[0x2002_0010]), Some(AbortCode::NotMappable), "wrong width");
    assert_eq!(refusal(Receive, &[0x2002_0020, 0x2002_0020, 0x2000_0001]), Some(AbortCode::PdoLength));
}

#[test]
fn dummies_take_room_in_an_rpdo_only() {
    assert_eq!(refusal(Direction::Receive, &[0x0005_0008, 0x0001_0001]), None);
    assert_eq!(refusal(Direction::Receive, &[0x0005_0010]), Some(AbortCode::NotMappable));
    assert_eq!(refusal(Direction::Receive, &[0x00FF_0008]), Some(AbortCode::NoObject));
    assert_eq!(refusal(Direction::Transmit, &[0x0005_0008]), Some(AbortCode::NotMappable));
}

#[test]
fn bits_are_packed_low_first() {
    let schema = Arc::new(schema());
    let mut dictionary = Dictionary::new(Arc::clone(&schema), 1);
    let set = |dictionary: &mut Dictionary, index, raw| {
        let slot = dictionary.find(Address::new(index, 0)).unwrap();
        dictionary.set(slot, raw);
    };
    set(&mut dictionary, 0x2000, 1);
    set(&mut dictionary, 0x2001, 0xAB_CDEF);
    let mapping = Mapping::new(&schema, Direction::Transmit, 64, [0x2000_0001, 0x2001_0018]).unwrap();
    let mut payload = [0; 8];
    mapping.pack(&dictionary, &mut payload);
    assert_eq!(mapping.bytes(), 4);
    assert_eq!(payload, [0xDF, 0x9B, 0x57, 0x01, 0, 0, 0, 0]);
}

#[test]
fn an_entry_may_be_carried_in_part_or_whole_where_it_says_so() {
    for direction in [Direction::Receive, Direction::Transmit] {
        assert_eq!(refusal(direction, &[0x2006_0010, 0x2007_0010, 0x2006_0020]), None);
        assert_eq!(refusal(direction, &[0x2006_0008]), Some(AbortCode::NotMappable), "another width");
        assert_eq!(
            refusal(direction, &[0x2006_0020, 0x2007_0010, 0x2006_0010, 0x2000_0001]),
            Some(AbortCode::PdoLength)
        );
    }
}

#[test]
fn what_is_carried_in_part_is_the_low_bits_and_a_negative_part_a_negative_value() {
    let schema = Arc::new(schema());
    let mut dictionary = Dictionary::new(Arc::clone(&schema), 1);
    let [unsigned, signed] = [0x2006, 0x2007].map(|index| dictionary.find(Address::new(index, 0)).unwrap());
    dictionary.set(unsigned, 0x0001_FFFE);
    dictionary.set(signed, 0xFFFF_FF38); // -200
    let mapping =
        Mapping::new(&schema, Direction::Transmit, 64, [0x2006_0010, 0x2007_0010, 0x2007_0020]).unwrap();
    let mut payload = [0; 8];
    mapping.pack(&dictionary, &mut payload);
    assert_eq!(payload, [0xFE, 0xFF, 0x38, 0xFF, 0x38, 0xFF, 0xFF, 0xFF]);
    let unpacked: Vec<_> = mapping.unpack(&payload).collect();
    assert_eq!(unpacked, [(unsigned, 0xFFFE), (signed, 0xFFFF_FF38), (signed, 0xFFFF_FF38)]);
    let positive: Vec<_> = mapping.unpack(&[0, 0, 0xFF, 0x7F, 0, 0, 0, 0]).map(|(_, raw)| raw).collect();
    assert_eq!(positive, [0, 0x7FFF, 0]);
}

proptest! {
    #[test]
    fn what_one_device_packs_another_unpacks(flag: bool, small in 0_u32..0x100_0000, wide: u32, order in 0_usize..6) {
        const FIELDS: [u32; 3] = [0x2000_0001, 0x2001_0018, 0x2002_0020];
        const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        let schema = Arc::new(schema());
        let mut dictionary = Dictionary::new(Arc::clone(&schema), 1);
        let values = [u64::from(flag), u64::from(small), u64::from(wide)];
        for (index, value) in (0x2000..).zip(values) {
            let slot = dictionary.find(Address::new(index, 0)).unwrap();
            dictionary.set(slot, value);
        }
        let mapping = Mapping::new(&schema, Direction::Transmit, 64, ORDERS[order].map(|i| FIELDS[i])).unwrap();
        let mut payload = [0; 8];
        mapping.pack(&dictionary, &mut payload);
        let unpacked: Vec<u64> = mapping.unpack(&payload).map(|(_, raw)| raw).collect();
        prop_assert_eq!(unpacked, ORDERS[order].map(|i| values[i]).to_vec());
    }
}
