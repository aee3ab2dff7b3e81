//! Somebody who only listens.

use std::sync::Arc;

use canopen::{Frame, Id, Message, Monitor, SdoStep};
use od::{Access, Address, DataType, Dictionary, Entry, Mappable, Object, Schema, Value};

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::new(Id::Standard(id), data)
}

fn step(monitor: &mut Monitor, id: u16, data: [u8; 8]) -> SdoStep {
    match monitor.take(&frame(id, &data)) {
        Message::Sdo(message) => message.step,
        other => panic!("{other:?}"),
    }
}

/// TPDO 1 of node 5 with the given COB-ID and one byte mapped.
fn communication(cob_id: u64) -> Dictionary {
    let number = |sub, data_type, value| {
        Entry::new(sub, "Parameter", data_type, Access::ReadWrite).with_value(Value::Fixed(value))
    };
    let mut mapping = Object::record(0x1A00, "Mapping", vec![number(1, DataType::Unsigned32, 0x6000_0108)]);
    mapping.entries[0] = number(0, DataType::Unsigned8, 1);
    let communication = Object::record(0x1800, "TPDO", vec![number(1, DataType::Unsigned32, cob_id)]);
    assert_eq!(mapping.entries[1].mappable, Mappable::No);
    Dictionary::new(Arc::new(Schema::new(vec![communication, mapping]).unwrap()), 5)
}

fn fields(message: &Message) -> Vec<(Address, u8, u64)> {
    match message {
        Message::Pdo(pdo) => pdo.fields.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_pdo_is_found_where_its_node_has_it_and_carries_what_it_maps() {
    let mut monitor = Monitor::new();
    monitor.learn(5, communication(0x6AA));
    assert_eq!(fields(&monitor.take(&frame(0x6AA, &[0x2A]))), [(Address::new(0x6000, 1), 8, 0x2A)]);
    assert_eq!(monitor.take(&frame(0x185, &[0x2A])), Message::Unknown, "it has no PDO there");
    monitor.learn(5, communication(0x8000_06AA));
    assert_eq!(monitor.take(&frame(0x185, &[0x2A])), Message::Unknown, "it has none at all");
}

#[test]
fn a_parameter_acts_when_its_node_has_taken_it_and_not_when_it_is_refused() {
    let mut monitor = Monitor::new();
    monitor.learn(5, communication(0x6AA));
    step(&mut monitor, 0x605, [0x23, 0x00, 0x18, 1, 0xBB, 6, 0, 0]);
    step(&mut monitor, 0x585, [0x80, 0x00, 0x18, 1, 0, 0, 1, 6]);
    assert!(!fields(&monitor.take(&frame(0x6AA, &[1]))).is_empty());
    step(&mut monitor, 0x605, [0x23, 0x00, 0x18, 1, 0xBB, 6, 0, 0]);
    step(&mut monitor, 0x585, [0x60, 0x00, 0x18, 1, 0, 0, 0, 0]);
    assert_eq!(monitor.take(&frame(0x6AA, &[1])), Message::Unknown);
    assert!(!fields(&monitor.take(&frame(0x6BB, &[1]))).is_empty());
}

#[test]
fn a_block_that_is_sent_again_counts_once() {
    let mut monitor = Monitor::new();
    step(&mut monitor, 0x605, [0xC2, 0, 0x20, 0, 15, 0, 0, 0]);
    step(&mut monitor, 0x585, [0xA0, 0, 0x20, 0, 127, 0, 0, 0]);
    step(&mut monitor, 0x605, [0x01, 1, 2, 3, 4, 5, 6, 7]);
    step(&mut monitor, 0x605, [0x02, 8, 9, 10, 11, 12, 13, 14]);
    step(&mut monitor, 0x605, [0x83, 15, 0, 0, 0, 0, 0, 0]);
    // The server has the first segment only.
    step(&mut monitor, 0x585, [0xA2, 1, 127, 0, 0, 0, 0, 0]);
    step(&mut monitor, 0x605, [0x01, 8, 9, 10, 11, 12, 13, 14]);
    step(&mut monitor, 0x605, [0x82, 15, 0, 0, 0, 0, 0, 0]);
    step(&mut monitor, 0x585, [0xA2, 2, 127, 0, 0, 0, 0, 0]);
    let end = step(&mut monitor, 0x605, [0xC1 | 6 << 2, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(end, SdoStep::Value { bytes: (1..=15).collect(), of: 15 });
}

#[test]
fn an_abort_between_the_segments_of_a_block_is_one() {
    let mut monitor = Monitor::new();
    step(&mut monitor, 0x605, [0xC0, 0, 0x20, 0, 0, 0, 0, 0]);
    step(&mut monitor, 0x585, [0xA0, 0, 0x20, 0, 127, 0, 0, 0]);
    step(&mut monitor, 0x605, [0x01, 1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(step(&mut monitor, 0x605, [0x80, 0, 0x20, 0, 0, 0, 4, 5]), SdoStep::Abort(0x0504_0000));
    assert_eq!(step(&mut monitor, 0x605, [0x40, 0, 0x20, 0, 0, 0, 0, 0]), SdoStep::Read);
}

#[test]
fn transfers_with_several_nodes_do_not_mix() {
    let mut monitor = Monitor::new();
    step(&mut monitor, 0x605, [0x21, 0, 0x20, 0, 8, 0, 0, 0]);
    step(&mut monitor, 0x606, [0x21, 0, 0x21, 0, 8, 0, 0, 0]);
    assert_eq!(step(&mut monitor, 0x605, [0x00, 1, 2, 3, 4, 5, 6, 7]), SdoStep::Part(7));
    let Message::Sdo(message) = monitor.take(&frame(0x606, &[0x0D, 9, 0, 0, 0, 0, 0, 0])) else { panic!() };
    assert_eq!((message.address, message.is_write), (Some(Address::new(0x2100, 0)), Some(true)));
    assert_eq!(message.step, SdoStep::Value { bytes: vec![9], of: 1 });
}

#[test]
fn a_frame_of_a_wrong_length_is_said_to_be_one() {
    let mut monitor = Monitor::new();
    for (id, data) in
        [(0x000, &[1][..]), (0x080, &[1, 2]), (0x100, &[1]), (0x081, &[1]), (0x601, &[1]), (0x701, &[])]
    {
        assert!(matches!(monitor.take(&frame(id, data)), Message::Malformed(_)), "{id:03X}");
    }
}
