//! Multiplexed PDOs, producer and consumer, both address modes (CiA 301 v4.2, section 7.2.2.4).

mod bench;

use core::time::Duration;
use std::sync::Arc;

use bench::{Bench, device, frame_of};
use canopen::{Counters, Node, NodeError};
use od::{AbortCode, Access, Address, DataType, Entry, Object, Schema, Value};
use proptest::collection::vec;
use proptest::prelude::*;

/// The lists, empty.
fn lists() -> Vec<Object> {
    let list = |index, data_type| {
        let entries = (1..=5).map(|sub| Entry::new(sub, "Entry", data_type, Access::ReadWrite)).collect();
        Object::array(index, "List", entries)
    };
    vec![
        list(0x1FA0, DataType::Unsigned32),
        list(0x1FA1, DataType::Unsigned32),
        list(0x1FD0, DataType::Unsigned64),
    ]
}

/// A node with lists, in OPERATIONAL, without other PDOs.
fn bench() -> Bench {
    let mut bench = Bench::off_with(lists()).started();
    bench.configure("1800:01", 0x8000_0181);
    bench.configure("1400:01", 0x8000_0201);
    bench.send("000#0101");
    bench
}

/// Makes the PDO whose communication record is `number` a multiplexed one.
fn multiplex(bench: &mut Bench, number: u16, cob_id: u32, count: u8) -> Vec<String> {
    bench.configure(&format!("{:04X}:00", number + 0x200), count.into());
    let sent = bench.configure(&format!("{number:04X}:01"), cob_id);
    sent.iter().map(ToString::to_string).collect()
}

fn dispatch(bench: &mut Bench, sub: u8, raw: u64) -> Result<(), AbortCode> {
    bench.download(Address::new(0x1FD0, sub), &raw.to_le_bytes())
}

fn scan(bench: &mut Bench, sub: u8, raw: u32) -> Result<(), AbortCode> {
    bench.download(Address::new(0x1FA0, sub), &raw.to_le_bytes())
}

#[test]
fn a_value_for_this_node_or_for_all_is_written_where_it_is_addressed_to() {
    let mut bench = bench();
    multiplex(&mut bench, 0x1402, 0x401, 0xFF);
    bench.talk(
        "
        > 401#8100620177000000 // 0x6200:01 of node 1
        > 401#8000620288999999 // of all; what the value has no room for does not count
        > 401#8200620399000000 // of node 2
        > 401#0100620399000000 // of node 1, source address mode
        ",
    );
    assert_eq!(["6200:01", "6200:02", "6200:03"].map(|a| bench.value(a)), [0x77, 0x88, 0]);
    bench.send("401#8107200078563412");
    assert_eq!(bench.value("2007:00"), 0x1234_5678);
    bench.send("401#8101200001000000");
    assert_eq!(bench.value("2001:00"), 1);
    assert_eq!(bench.node.counters(), Counters::default());
}

#[test]
fn a_value_that_the_node_cannot_take_is_told_once() {
    let mut bench = bench();
    multiplex(&mut bench, 0x1402, 0x401, 0xFF);
    bench.talk(
        "
        > 401#8134120500000000 // no such object
        < 081#3082113412050000
        > 401#8100200000000000 // another one
        > 401#8100620111000000
        < 081#0000000000000000
        > 401#8100600111000000 // an input
        < 081#3082110060010000
        > 401#8100620111000000
        < 081#0000000000000000
        > 401#811B200011000000 // eight bytes do not fit
        < 081#3082111B20000000
        > 401#8100620111000000
        < 081#0000000000000000
        > 401#8103210063000000 // 99 is out of range
        < 081#3082110321000000
        ",
    );
    assert_eq!(bench.node.counters().refused_rpdos, 5);
    assert_eq!(bench.value("2103:00"), 0);
}

#[test]
fn a_multiplexed_pdo_has_eight_bytes() {
    let mut bench = bench();
    multiplex(&mut bench, 0x1402, 0x401, 0xFF);
    bench.talk(
        "
        > 401#81006201770000
        < 081#1082110300070000 // RPDO 3, seven bytes
        > 401#8100620177000000
        < 081#0000000000000000
        ",
    );
    assert_eq!(bench.node.counters().short_rpdos, 1);
}

#[test]
fn a_multiplexed_pdo_acts_in_operational_and_while_it_is_valid() {
    let mut bench = bench();
    multiplex(&mut bench, 0x1402, 0x401, 0xFF);
    bench.send("000#8001");
    bench.send("401#8100620177000000");
    assert_eq!(bench.value("6200:01"), 0);
    bench.send("000#0101");
    bench.configure("1402:01", 0x8000_0401);
    bench.send("401#8100620177000000");
    assert_eq!(bench.value("6200:01"), 0);
    // Synchronous ones there are none.
    bench.configure("1402:02", 1);
    bench.configure("1402:01", 0x401);
    bench.send("401#8100620177000000");
    bench.send("080#");
    assert_eq!(bench.value("6200:01"), 0);
    bench.configure("1402:02", 254);
    bench.send("401#8100620177000000");
    assert_eq!(bench.value("6200:01"), 0x77);
}

#[test]
fn a_multiplexed_pdo_may_have_a_deadline() {
    let mut bench = bench();
    bench.configure("1402:05", 100);
    multiplex(&mut bench, 0x1402, 0x401, 0xFF);
    bench.talk(
        "
        > 401#8100620177000000
        + 99ms
        > 401#8100620178000000
        + 100ms
        < 081#5082110300000000
        > 000#0101
        > 401#8100620177000000
        < 081#0000000000000000
        ",
    );
}

#[test]
fn values_of_others_go_where_the_dispatching_list_says() {
    let mut bench = bench();
    multiplex(&mut bench, 0x1402, 0x401, 0xFE);
    // 0x6000:01-03 of node 0x22 to 0x6200:05-07, and its 0x6000:02 to 0x2007 as well.
    assert_eq!(dispatch(&mut bench, 1, 0x0362_0005_6000_0122), Ok(()));
    assert_eq!(dispatch(&mut bench, 3, 0x0120_0700_6000_0222), Ok(()));
    bench.talk(
        "
        > 401#2200600111000000
        > 401#2200600222000000
        > 401#2200600333000000
        > 401#2200600444000000 // behind the block
        > 401#2300600155000000 // another node
        > 401#2201600155000000 // another object
        > 401#A200600155000000 // destination address mode
        ",
    );
    let values = ["6200:05", "6200:06", "6200:07", "6200:08"].map(|address| bench.value(address));
    assert_eq!(values, [0x11, 0x22, 0x33, 0]);
    assert_eq!(bench.value("2007:00"), 0x22);
    assert_eq!(dispatch(&mut bench, 1, 0), Ok(()));
    bench.send("401#2200600199000000");
    assert_eq!(bench.value("6200:05"), 0x11);
    assert_eq!(bench.node.counters(), Counters::default());
}

#[test]
fn a_value_that_is_out_of_range_is_not_dispatched() {
    let mut bench = bench();
    multiplex(&mut bench, 0x1402, 0x401, 0xFE);
    assert_eq!(dispatch(&mut bench, 1, 0x0121_0300_6000_0122), Ok(()));
    bench.talk("> 401#2200600163000000\n> 401#2200600105000000");
    assert_eq!(bench.value("2103:00"), 5);
    assert_eq!(bench.node.counters().refused_rpdos, 1);
}

#[test]
fn what_the_scanner_list_has_is_sent_when_it_changes() {
    let mut bench = bench();
    assert_eq!(scan(&mut bench, 1, 0x0260_0003), Ok(())); // 0x6000:03 and :04
    assert_eq!(scan(&mut bench, 4, 0x0120_0700), Ok(())); // 0x2007
    assert_eq!(bench.download(Address::new(0x1FA1, 1), &0x0120_0300_u32.to_le_bytes()), Ok(()));
    let first =
        ["381#0100600300000000", "381#0100600400000000", "381#0107200000000000", "381#0103200000000000"];
    assert_eq!(multiplex(&mut bench, 0x1802, 0x381, 0xFE), first, "each once");
    assert_eq!(bench.configure("1803:02", 254), [], "what concerns another PDO starts nothing anew");
    bench.talk(
        "
        = 6000:03 2A
        < 381#010060032A000000
        = 6000:03 2A
        = 6000:05 11 // not in the list
        > 601#2307200078563412
        < 581#6007200000000000
        < 381#0107200078563412
        = 2003:00 FFFE // a signed one: its bytes, zeros behind
        < 381#01032000FEFF0000
        > 000#8001
        = 6000:03 2B
        > 000#0101
        < 381#010060032B000000
        < 381#0100600400000000
        < 381#0107200078563412
        < 381#01032000FEFF0000
        + 10s
        ",
    );
}

#[test]
fn between_two_multiplexed_pdos_is_the_inhibit_time_and_all_get_their_turn() {
    let mut bench = bench();
    assert_eq!(scan(&mut bench, 1, 0x0260_0003), Ok(()));
    bench.configure("1802:03", 100); // 10 ms
    assert_eq!(multiplex(&mut bench, 0x1802, 0x381, 0xFE), ["381#0100600300000000"]);
    bench.talk(
        "
        = 6000:03 01
        = 6000:04 02
        + 9ms
        + 1ms
        < 381#0100600402000000
        = 6000:04 03
        + 10ms
        < 381#0100600301000000
        + 10ms
        < 381#0100600403000000
        + 10s
        ",
    );
}

#[test]
fn an_application_may_send_a_value_to_another_node() {
    let mut bench = bench();
    bench.configure("1803:03", 100); // 10 ms
    multiplex(&mut bench, 0x1803, 0x481, 0xFF);
    let address = Address::new(0x6200, 1);
    let send = |bench: &mut Bench, number, consumer| {
        bench.node.send_to(bench.now, number, consumer, address, [0x77, 0, 0, 0])
    };
    assert_eq!(send(&mut bench, 4, 2), Ok(()));
    assert_eq!(bench.settle(), [frame_of("481#8200620177000000")]);
    assert_eq!(send(&mut bench, 4, 2), Err(AbortCode::DeviceState), "within the inhibit time");
    bench.pass(Duration::from_millis(10));
    assert_eq!(send(&mut bench, 4, 0), Ok(()));
    assert_eq!(bench.settle(), [frame_of("481#8000620177000000")]);
    bench.pass(Duration::from_millis(10));
    for (number, consumer, refusal) in [
        (4, 128, AbortCode::InvalidValue),
        (0, 2, AbortCode::NoObject),
        (5, 2, AbortCode::NoObject),
        (1, 2, AbortCode::DeviceState),
    ] {
        assert_eq!(send(&mut bench, number, consumer), Err(refusal), "{number} {consumer}");
    }
    bench.send("000#8001");
    assert_eq!(send(&mut bench, 4, 2), Err(AbortCode::DeviceState), "not OPERATIONAL");
    assert_eq!(bench.settle(), []);
}

#[test]
fn two_nodes_pass_their_values_on_by_their_lists() {
    let mut producer = bench();
    let mut consumer = Bench::as_node(2, device::communication_with(lists())).started();
    assert_eq!(scan(&mut producer, 1, 0x0860_0001), Ok(()));
    multiplex(&mut producer, 0x1802, 0x381, 0xFE);
    let list = 0x0862_0001_6000_0101_u64.to_le_bytes();
    // Node 2 by hand: its requests have another identifier.
    for script in ["602#2F02160000000000", "602#2F021600FE000000", "602#2302140181030000"] {
        consumer.send(script);
    }
    consumer.send("602#21D01F0108000000");
    for segment in [format!("602#00{}", hex(&list[..7])), format!("602#1D{}000000000000", hex(&list[7..]))] {
        consumer.send(&segment);
    }
    consumer.send("000#0102");
    for value in 1..=8 {
        producer.show(&format!("6000:0{value}"), value * 0x11);
    }
    for frame in producer.settle() {
        consumer.handle(&frame);
    }
    for value in 1..=8 {
        assert_eq!(consumer.value(&format!("6200:0{value}")), value * 0x11);
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect()
}

#[test]
fn lists_refuse_what_cannot_be_sent_or_taken() {
    let mut bench = bench();
    for (raw, refusal) in [
        (0x0112_3400, AbortCode::NoObject),
        (0x0160_0009, AbortCode::NoObject),     // no such sub-index
        (0x0260_0008, AbortCode::NoObject),     // the second one is missing
        (0x0120_1B00, AbortCode::NotMappable),  // eight bytes
        (0x0120_0900, AbortCode::NotMappable),  // a string
        (0x0121_0800, AbortCode::NotMappable),  // may only be received
        (0x0021_0900, AbortCode::InvalidValue), // a block of none
        (0xFF60_0001, AbortCode::InvalidValue), // behind the last sub-index
    ] {
        assert_eq!(scan(&mut bench, 1, raw), Err(refusal), "{raw:08X}");
    }
    for (raw, refusal) in [
        (0x0112_3400_6000_0122, AbortCode::NoObject),
        (0x0160_0001_6000_0122, AbortCode::NotMappable), // may only be sent
        (0x0120_1B00_6000_0122, AbortCode::NotMappable),
        (0x0162_0001_6000_0100, AbortCode::InvalidValue), // of no node
        (0x0162_0001_6000_0180, AbortCode::InvalidValue),
        (0x0062_0001_6000_0122, AbortCode::InvalidValue),
        (0xFF62_0001_6000_0122, AbortCode::InvalidValue),
    ] {
        assert_eq!(dispatch(&mut bench, 1, raw), Err(refusal), "{raw:016X}");
    }
    // 64 objects are scanned at most; eight blocks of eight.
    for sub in 1..=4 {
        assert_eq!(scan(&mut bench, sub, 0x0860_0001), Ok(()));
        assert_eq!(bench.download(Address::new(0x1FA1, sub), &0x0860_0001_u32.to_le_bytes()), Ok(()));
    }
    assert_eq!(scan(&mut bench, 1, 0x0860_0001), Ok(()), "the same again");
    assert_eq!(scan(&mut bench, 5, 0x0160_0001), Err(AbortCode::OutOfMemory));
    assert_eq!(scan(&mut bench, 1, 0), Ok(()));
    assert_eq!(scan(&mut bench, 5, 0x0860_0001), Ok(()));
}

#[test]
fn a_pdo_becomes_a_multiplexed_one_by_the_procedure_of_a_mapping() {
    let mut bench = bench();
    let mut write = |index, value: u8| bench.download(Address::new(index, 0), &[value]);
    assert_eq!(write(0x1601, 0xFF), Err(AbortCode::UnsupportedAccess), "RPDO 2 is valid");
    assert_eq!(write(0x1A01, 0xFE), Err(AbortCode::UnsupportedAccess), "TPDO 2 is valid");
    assert_eq!(write(0x1602, 0xFD), Err(AbortCode::PdoLength));
    assert_eq!(write(0x1602, 0xFF), Ok(()));
    assert_eq!(write(0x1A02, 0xFE), Ok(()));
    assert_eq!(write(0x1A03, 0xFE), Err(AbortCode::ParameterIncompatible), "one scans already");
    assert_eq!(write(0x1A03, 0xFF), Ok(()));
    let mapped = bench.download(Address::new(0x1602, 1), &0x6200_0108_u32.to_le_bytes());
    assert_eq!(mapped, Err(AbortCode::UnsupportedAccess), "while it is one");
    assert_eq!(bench.upload(Address::new(0x1602, 0)), Ok(vec![0xFF]));
    bench.map(0x1402, 0x401, 255, &[0x6200_0108]);
    bench.send("401#99");
    assert_eq!(bench.value("6200:01"), 0x99, "and back");
}

#[test]
fn a_device_without_lists_has_no_multiplexed_pdos() {
    let mut bench = Bench::new();
    for (index, value) in [(0x1602, 0xFF), (0x1602, 0xFE), (0x1A02, 0xFF), (0x1A02, 0xFE)] {
        let refused = bench.download(Address::new(index, 0), &[value]);
        assert_eq!(refused, Err(AbortCode::PdoLength), "{index:04X} {value:02X}");
    }
    let result = Node::new(1, 0, Arc::new(default_multiplexed(vec![])), &device::application());
    let refused = NodeError::Mapping { direction: "RPDO", number: 5, code: AbortCode::PdoLength };
    assert_eq!(result.err(), Some(refused));
}

/// A profile whose RPDO 5 is a multiplexed one from the start.
fn default_multiplexed(more: Vec<Object>) -> Schema {
    let number = |sub, data_type, value| {
        Entry::new(sub, "Entry", data_type, Access::ReadWrite).with_value(Value::Fixed(value))
    };
    let mut mapping = Object::record(0x1604, "RPDO mapping", vec![number(1, DataType::Unsigned32, 0)]);
    mapping.entries[0] = number(0, DataType::Unsigned8, 0xFF);
    let communication = vec![number(1, DataType::Unsigned32, 0x501), number(2, DataType::Unsigned8, 255)];
    let rpdo = [Object::record(0x1404, "RPDO", communication), mapping];
    device::communication_with(rpdo.into_iter().chain(more).collect())
}

#[test]
fn a_pdo_may_be_a_multiplexed_one_from_the_start() {
    let mut bench = Bench::with(default_multiplexed(lists())).started();
    bench.send("000#0101");
    bench.send("501#8100620177000000");
    assert_eq!(bench.value("6200:01"), 0x77);
}

proptest! {
    #[test]
    fn whatever_lists_and_frames_say_little_is_sent_at_once(
        scans in vec(any::<(u32, bool)>(), 8),
        dispatches in vec(any::<u64>(), 4),
        frames in vec((any::<[u8; 8]>(), 0..=8_usize), 1..60),
    ) {
        let mut bench = bench();
        // Half of them are good ones.
        for (place, (raw, is_good)) in (0..).zip(scans) {
            let raw = if is_good { 0x0060_0001 | (raw & 0x0700_0000) } else { raw };
            let _ = bench.download(Address::new(0x1FA0 + place / 4, (place % 4) as u8 + 1), &raw.to_le_bytes());
        }
        for (sub, raw) in (1..).zip(dispatches) {
            let good = 0x0862_0001_6000_0101 | raw & 0x7E;
            let _ = dispatch(&mut bench, sub, if raw & 1 == 0 { raw } else { good });
        }
        multiplex(&mut bench, 0x1802, 0x381, 0xFE);
        multiplex(&mut bench, 0x1402, 0x401, 0xFE);
        multiplex(&mut bench, 0x1403, 0x501, 0xFF);
        for (number, (mut data, length)) in (0_u8..).zip(frames) {
            let address = [0, 0x60 + data[1] % 3, data[3] % 10];
            data[1..4].copy_from_slice(&address);
            let id = if number % 2 == 0 { 0x401 } else { 0x501 };
            bench.show("6000:01", number.into());
            let sent = bench.handle(&canopen::Frame::new(canopen::Id::Standard(id), &data[..length]));
            prop_assert!(sent.len() <= 64 + 2);
            prop_assert!(bench.node.poll_timeout().is_none_or(|next| next > bench.now));
        }
    }
}

#[test]
fn no_frame_of_a_multiplexed_pdo_stands_for_another_one() {
    let mut bench = bench();
    multiplex(&mut bench, 0x1800, 0x181, 0xFE);
    assert!(!bench.node.is_tpdo(frame_of("181#").id));
}
