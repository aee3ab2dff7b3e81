//! How a master changes what a PDO carries (CiA 301 v4.2, section 7.5.2.36).

mod bench;

use std::sync::Arc;

use bench::{Bench, device};
use canopen::{Node, NodeError};
use od::{AbortCode, Access, DataType, Entry, Object, Schema, Value};

// CCT 3.1, 3.2, 3.21
#[test]
fn the_default_parameters_are_read() {
    Bench::new().talk(
        "
        > 601#4000180000000000
        < 581#4F00180006000000
        > 601#4000180100000000
        < 581#4300180181010000
        > 601#4000180200000000
        < 581#4F001802FF000000
        > 601#40001A0000000000
        < 581#4F001A0002000000
        > 601#40001A0100000000
        < 581#43001A0108010060
        > 601#40001A0300000000
        < 581#43001A0300000000
        > 601#4004180000000000
        < 581#8004180000000206
        ",
    );
}

// CCT 3.22
#[test]
fn a_tpdo_gets_another_mapping() {
    Bench::operational().talk(
        "
        > 601#2300180181010080 // not valid
        < 581#6000180100000000
        > 601#2F001A0000000000 // nothing mapped
        < 581#60001A0000000000
        > 601#23001A0110000921
        < 581#60001A0100000000
        > 601#23001A0208020060
        < 581#60001A0200000000
        > 601#2F001A0002000000
        < 581#60001A0000000000
        > 601#2300180181010000 // valid
        < 581#6000180100000000
        < 181#000000
        = 2109:00 1234
        < 181#341200
        ",
    );
}

// CCT 3.22
#[test]
fn an_rpdo_gets_another_mapping() {
    let mut bench = Bench::operational();
    bench.talk(
        "
        > 601#2300140101020080
        < 581#6000140100000000
        > 601#2F00160000000000
        < 581#6000160000000000
        > 601#2300160110000821
        < 581#6000160100000000
        > 601#2F00160001000000
        < 581#6000160000000000
        > 601#2300140101020000
        < 581#6000140100000000
        > 201#3412
        ",
    );
    assert_eq!(bench.value("2108:00"), 0x1234);
    assert_eq!(bench.value("6200:01"), 0);
}

// CCT 3.23, 3.24
#[test]
fn without_the_procedure_the_mapping_stays() {
    let mut bench = Bench::operational();
    bench.talk(
        "
        > 601#2F001A0000000000 // valid
        < 581#80001A0000000106
        > 601#23001A0108030060
        < 581#80001A0100000106
        > 601#2300180181010080
        < 581#6000180100000000
        > 601#23001A0108030060 // not valid, but mapped
        < 581#80001A0100000106
        > 601#2300180181010000
        < 581#6000180100000000
        < 181#0000
        = 6000:01 11
        < 181#1100
        ",
    );
}

// CCT 3.25, 3.26
#[test]
fn a_mapping_that_does_not_fit_is_refused_and_none_remains() {
    let mut bench = Bench::operational();
    bench.talk(
        "
        > 601#2300180181010080
        < 581#6000180100000000
        > 601#2F001A0000000000
        < 581#60001A0000000000
        > 601#23001A0140001B20
        < 581#60001A0100000000
        > 601#2F001A0002000000 // 64 bits and an input
        < 581#80001A0042000406
        > 601#40001A0000000000
        < 581#4F001A0000000000
        > 601#23001A0200000000 // an entry may be empty
        < 581#60001A0200000000
        > 601#2F001A0002000000 // but not count
        < 581#80001A0000000206
        > 601#2300180181010000
        < 581#6000180100000000
        ",
    );
}

// CCT 3.28, 3.29, 3.30, 3.32
#[test]
fn only_what_may_be_mapped_that_way_is_mapped() {
    let mut bench = Bench::new();
    bench.talk(
        "
        > 601#2302160108010060 // an input into an RPDO
        < 581#8002160141000406
        > 601#23021A0108010060 // into a TPDO
        < 581#60021A0100000000
        > 601#2302160108010062 // an output into an RPDO
        < 581#6002160100000000
        > 601#23021A0108010062 // both ways
        < 581#60021A0100000000
        > 601#23021A0108090060 // no such sub-index
        < 581#80021A0100000206
        > 601#23021A0108000061
        < 581#80021A0100000206
        ",
    );
}

// CCT 3.33
#[test]
fn dummies_take_room_in_an_rpdo_only() {
    let mut bench = Bench::operational();
    bench.talk(
        "
        > 601#2302160110000600
        < 581#6002160100000000
        > 601#2302160208000600 // an UNSIGNED16 of eight bits
        < 581#8002160241000406
        > 601#23021A0110000600
        < 581#80021A0141000406
        ",
    );
    bench.map(0x1402, 0x401, 255, &[0x0006_0010, 0x6200_0408]);
    bench.talk("> 401#AABBCC");
    assert_eq!(bench.value("6200:04"), 0xCC);
}

#[test]
fn an_identifier_changes_only_while_the_pdo_is_not_valid() {
    Bench::new().talk(
        "
        > 601#2300140102020000
        < 581#8000140122000008
        > 601#2300140101020000 // the same
        < 581#6000140100000000
        > 601#2300140102020080
        < 581#6000140100000000
        > 601#2300140103020000
        < 581#6000140100000000
        > 601#4000140100000000
        < 581#4300140103020000
        ",
    );
}

#[test]
fn eight_objects_of_a_byte_fill_a_pdo() {
    let mut bench = Bench::operational();
    let mapped: Vec<u32> = (1..=8).map(|sub| 0x6000_0008 | sub << 8).collect();
    let sent = bench.map(0x1802, 0x381, 255, &mapped);
    assert_eq!(sent, [bench::frame_of("381#0000000000000000")]);
}

#[test]
fn a_profile_with_a_wrong_default_mapping_becomes_no_node() {
    let number = |sub, data_type, value| {
        Entry::new(sub, "x", data_type, Access::ReadWrite).with_value(Value::Fixed(value))
    };
    let (byte, word) = (DataType::Unsigned8, DataType::Unsigned32);
    let mut mapping = Object::record(0x1A00, "mapping", vec![number(1, word, 0x2107_0010)]);
    mapping.entries[0] = number(0, byte, 1);
    let communication = Schema::new(vec![
        Object::record(0x1800, "communication", vec![number(1, word, 0x181), number(2, byte, 255)]),
        mapping,
    ])
    .unwrap();
    let refused = Node::new(1, 0, Arc::new(communication), &device::application()).unwrap_err();
    assert_eq!(refused, NodeError::Mapping { direction: "TPDO", number: 1, code: AbortCode::NotMappable });
    assert_eq!(
        refused.to_string(),
        "the default mapping of TPDO 1 is refused: 0x06040041 (object cannot be mapped to the PDO)"
    );
}

#[test]
fn node_ids_are_1_to_127_or_none() {
    let application = device::application();
    let communication = Arc::new(device::communication());
    for node_id in 0..=255 {
        let node = Node::new(node_id, 0, Arc::clone(&communication), &application);
        assert_eq!(node.is_ok(), matches!(node_id, 1..=127 | canopen::UNCONFIGURED), "{node_id}");
    }
}
